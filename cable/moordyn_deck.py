"""Read the lines of a MoorDyn v2 input file: line types, points, lines, the sea bed and the water.

Lines that meet at a free point are one line of sections here, with the point's mass and volume as a body; so a deck is
a number of lines between held points (fixed, coupled, or to a vessel), each of which `cable.hold` brings to rest. What
a deck may ask for and this package does not compute is left out, and said in `Deck.left_out`. Axes: MoorDyn's z is up;
north is x, east is −y. Format: https://moordyn.readthedocs.io, "MoorDyn V2 input file".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from cable.properties import GRAVITY, CableProperties
from cable.sea_bed import SeaBed
from cable.sections import Body, Section, SectionedCable
from subzero.errors import BadValueError, short, suggestion

TABLES = dict.fromkeys(("LINE TYPES", "LINE DICTIONARY"), "types")
TABLES |= dict.fromkeys(("POINTS", "POINT PROPERTIES", "CONNECTION PROPERTIES"), "points")
TABLES |= dict.fromkeys(("LINES", "LINE PROPERTIES"), "lines")
TABLES |= dict.fromkeys(("OPTIONS", "SOLVER OPTIONS"), "options") | dict.fromkeys(
    ("OUTPUT", "OUTPUTS"), "end"
)
"""Heading → what it begins."""
NOT_HERE = (
    "ROD TYPES",
    "ROD DICTIONARY",
    "RODS",
    "BODIES",
    "BODY LIST",
    "CONTROL",
    "FAILURE",
    "EXTERNAL LOADS",
)
"""Headings of tables that are left out."""
USED = ("WtrDpth", "WtrDnsty", "rhoW", "rho", "kBot", "cBot", "FrictionCoefficient", "g", "gravity", "depth")
NUMERICS = (
    *("dtM", "dtIC", "TmaxIC", "CdScaleIC", "threshIC", "tScheme", "writeLog", "dtOut", "writeUnits", "Echo"),
    *("ICDfac", "ICthresh", "ICTmax", "TMax", "StatDynFricScale", "FricDamp"),
    *("disableOutput", "disableOutTime"),
)
PHYSICS = ("WaveKin", "Currents", "WaterKin", "dtWave", "UnifyCurrentGrid", "SeafloorFile", "bathymetry")
"""Options that are used, that concern MoorDyn's solver only, and that are left out."""
HELD = ("FIXED", "FIX", "ANCHOR", "COUPLED", "VESSEL", "VES", "CPLD")
FREE = ("FREE", "CONNECT", "CON", "POINT")
DENSITY, DEPTH_UNKNOWN = 1025.0, 0.0


@dataclass(frozen=True, kw_only=True)
class DeckLine:
    """A line of a deck between two held points.

    Attributes:
        name: the numbers of MoorDyn's lines that it is made of, such as "1+2".
        cable: its section or sections.
        ends: places of its first and second end, north, east, down (2, 3). [m]
        length: unstretched. [m]
        segment_length: length of the deck's segments. [m]
        bed: the sea bed, None where the deck has no depth.
    """

    name: str
    cable: SectionedCable
    ends: np.ndarray
    length: float
    segment_length: float
    bed: SeaBed | None


@dataclass(frozen=True, kw_only=True)
class Deck:
    """What a MoorDyn deck says.

    Attributes:
        lines: between held points.
        left_out: what it asks for and is not computed here, in sentences.
    """

    lines: tuple[DeckLine, ...]
    left_out: tuple[str, ...]


def read_deck(text: str) -> Deck:
    """Return the lines of a MoorDyn v2 deck, given its text.

    Raises:
        subzero.UserError: an unknown heading, option, line type or point, or numbers that make no sense; with its line.
    """
    tables, left_out = _tables(text)
    options = _options(tables["options"], left_out)
    water = next((options[key] for key in ("WtrDnsty", "rhoW", "rho") if key in options), DENSITY)
    types = {row["NAME"]: _line_type(row, water, left_out) for row in tables["types"]}
    points = {row["ID"]: row for row in tables["points"]}
    bed = _bed(options, types)
    gravity = options.get("g", options.get("gravity", GRAVITY))
    if abs(gravity - GRAVITY) > 1e-6:
        left_out.append(f"g = {gravity:g} m/s² (here it is {GRAVITY:g}).")
    lines = [_joined(chain, types, points, bed) for chain in _chains(tables["lines"], points)]
    if not lines:
        raise BadValueError(
            "The deck has no line between two held points: it needs LINE TYPES, POINTS and LINES."
        )
    return Deck(lines=tuple(lines), left_out=tuple(dict.fromkeys(left_out)))


Row = Mapping[str, str]


def _tables(text: str) -> tuple[dict[str, list[Row]], list[str]]:
    """Return the rows of the tables by name, and the tables that are left out."""
    tables: dict[str, list[Row]] = {name: [] for name in ("types", "points", "lines", "options")}
    left_out: list[str] = []
    table, columns, skipped = "", [""], 0
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.split("#")[0].strip() if table == "options" else raw.strip()
        if line.startswith("---"):
            heading = " ".join(line.strip("- ").upper().split())
            table, skipped = _table_of(heading, number, table, left_out), 0
            continue
        if not line or table in ("", "end", "skip"):
            continue
        if table == "options":
            value, _, rest = line.partition(" ")
            tables[table].append({"value": value, "name": (rest.split() or [""])[0], "line": str(number)})
        elif skipped == 0:
            words = line.upper().split()
            columns, skipped = [COLUMNS.get(word, word) for word in words], 1
        elif skipped == 1:  # the row of units
            skipped = 2
        else:
            tables[table].append(dict(zip(columns, line.split(), strict=False)) | {"LINE": str(number)})
    return tables, left_out


def _table_of(heading: str, number: int, before: str, left_out: list[str]) -> str:
    """Return which table a heading begins; the first line of a deck, and the last, are titles."""
    if heading in TABLES:
        return TABLES[heading]
    if heading in NOT_HERE:
        left_out.append(f"The table {heading} (line {number}).")
        return "skip"
    if not heading or (before == "" and number <= 2) or before == "end" or "NEED THIS LINE" in heading:
        return before
    known = (*TABLES, *NOT_HERE)
    raise BadValueError(
        f"Line {number} of the deck: there is no table {short(heading)}.{suggestion(heading, known)}"
    )


SPELLINGS = """
NAME=TYPENAME MASS/M=MASSDEN MASS/M=MASSDENINAIR MASS/M=MASS/LENGTH CD=CDN CA=CAN CDAX=CDT CAAX=CAT BA=BA/-ZETA
ID=NODE TYPE=CONNECTION TYPE=LINETYPE A=ATTACHA A=NODEA A=ANCH B=ATTACHB B=NODEB B=FAIR
LENGTH=UNSTRLEN SEGMENTS=NUMSEGS MASS=M VOLUME=V DRAG_AREA=CDA
"""
COLUMNS = {word: name for name, _, word in (pair.partition("=") for pair in SPELLINGS.split())}
"""Name of a column as some decks write it → its one name here."""


def _number(row: Row, name: str, *, default: float | None = None) -> float:
    """Return a number of a row; raise an error for anything else."""
    given = row.get(name, "")
    if given in ("", "-") and default is not None:
        return default
    try:
        value = float(given.split("|")[0])
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        where = row.get("LINE", row.get("line"))
        raise BadValueError(
            f"Line {where} of the deck: {name} is {short(given)}; it must be a finite number."
        )
    return value


def _options(rows: Sequence[Row], left_out: list[str]) -> dict[str, float]:
    """Return the options that are used; refuse unknown ones."""
    known = (*USED, *NUMERICS, *PHYSICS)
    same = {name.lower(): name for name in known}
    found = {}
    for row in rows:
        name = same.get(row["name"].lower())
        if name is None:
            raise BadValueError(
                f"Line {row['line']} of the deck: there is no option {short(row['name'])}."
                f"{suggestion(row['name'], known)}"
            )
        if name in USED:
            found[name] = _number(row, "value")
        elif name in PHYSICS and row["value"] not in ("0", "none", "None"):
            left_out.append(f"{name} = {row['value']} (line {row['line']}): water is still, the bed flat.")
    return found


def _line_type(row: Row, water: float, left_out: list[str]) -> CableProperties:
    """Return the properties of a line type; MoorDyn's diameter is that of its volume."""
    d, name = _number(row, "DIAM"), row.get("NAME")
    if _number(row, "EI", default=0.0) > 0.0:
        left_out.append(f"The bending stiffness EI of line type {name}.")
    damping = _number(row, "BA", default=0.0)
    if damping < 0.0:
        left_out.append(f"The damping ratio −BA of line type {name}: give BA in N s, or none.")
    return CableProperties(
        water_density=water,
        mass_per_length=_number(row, "MASS/M"),
        cross_section_area=0.25 * np.pi * d * d,
        diameter=d,
        normal_drag_coefficient=_number(row, "CD"),
        tangential_drag_coefficient=_number(row, "CDAX"),
        added_mass_coefficient=_number(row, "CA"),
        tangential_added_mass_coefficient=_number(row, "CAAX", default=0.0),
        compliance=1.0 / _number(row, "EA"),
        internal_damping=max(damping, 0.0),
    )


def _bed(options: Mapping[str, float], types: Mapping[str, CableProperties]) -> SeaBed | None:
    """Return the sea bed of the options, None without a depth."""
    depth = options.get("WtrDpth", options.get("depth", DEPTH_UNKNOWN))
    if depth <= 0.0:
        return None
    friction = options.get("FrictionCoefficient", 0.0)
    return SeaBed(
        depth=depth, modulus=options.get("kBot", 3e6), axial_friction=friction, lateral_friction=friction
    )


def _chains(lines: Sequence[Row], points: Mapping[str, Row]) -> Iterator[list[tuple[Row, bool]]]:
    """Give the lines of the deck joined at free points: each a list of lines, and whether it is taken from A to B."""
    left = list(lines)
    while left:
        chain = [(left.pop(0), True)]
        for forwards in (False, True):
            while (
                _kind(point := _end_of(chain[-1 if forwards else 0], forwards), points, chain[0][0]) == "free"
            ):
                joined = [row for row in left if point in (row.get("A"), row.get("B"))]
                if len(joined) != 1:
                    raise BadValueError(
                        f"Point {point} of the deck is free and has {len(joined) + 1} lines; two can be joined to one"
                        " line of sections, and a branch cannot."
                    )
                row = left.pop(left.index(joined[0]))
                link = (row, (row["A"] == point) == forwards)
                chain.insert(len(chain) if forwards else 0, link)
        yield chain


def _end_of(link: tuple[Row, bool], far: bool) -> str:
    """Return the point at the far or the near end of a line of a chain."""
    row, forwards = link
    return row.get("B" if forwards == far else "A", "")


def _kind(point: str, points: Mapping[str, Row], row: Row) -> str:
    """Return whether a point is held or free; refuse unknown ones."""
    if point not in points:
        raise BadValueError(
            f"Line {row['LINE']} of the deck: there is no point {short(point)}.{suggestion(point, points)}"
        )
    kind = points[point].get("TYPE", "").upper()
    if kind in HELD or kind in FREE:
        return "held" if kind in HELD else "free"
    raise BadValueError(
        f"Line {points[point]['LINE']} of the deck: a point of type {short(kind)} is neither held nor free."
        f"{suggestion(kind, (*HELD, *FREE))}"
    )


def _joined(
    chain: Sequence[tuple[Row, bool]],
    types: Mapping[str, CableProperties],
    points: Mapping[str, Row],
    bed: SeaBed | None,
) -> DeckLine:
    """Return a chain as one line: from its upper end, so that the second one is the anchor."""
    upper = [_place(points[_end_of(chain[k], bool(k))]) for k in (0, -1)]
    if upper[0][2] > upper[1][2]:
        chain = [(row, not forwards) for row, forwards in reversed(chain)]
    sections, bodies, along, each = [], [], 0.0, np.inf
    for k, (row, forwards) in enumerate(chain):
        if row.get("TYPE") not in types:
            raise BadValueError(
                f"Line {row['LINE']} of the deck: there is no line type {short(row.get('TYPE'))}."
                f"{suggestion(row.get('TYPE'), types)}"
            )
        sections.append(Section(_number(row, "LENGTH"), types[row["TYPE"]]))
        along += sections[-1].length
        each = min(each, sections[-1].length / max(_number(row, "SEGMENTS", default=50.0), 1.0))
        if k < len(chain) - 1:
            point = points[_end_of((row, forwards), True)]
            values = {
                name.lower(): _number(point, name, default=0.0) for name in ("MASS", "VOLUME", "DRAG_AREA")
            }
            bodies.append(Body(along, added_mass_coefficient=_number(point, "CA", default=0.0), **values))
    ends = np.array([_place(points[_end_of(chain[0], False)]), _place(points[_end_of(chain[-1], True)])])
    name = "+".join(row["ID"] for row, _ in chain)
    line = SectionedCable(sections=sections, bodies=[body for body in bodies if body.mass or body.volume])
    return DeckLine(name=name, cable=line, ends=ends, length=line.length, segment_length=each, bed=bed)


def _place(point: Row) -> list[float]:
    """Return a place north, east, down (3,). [m]."""
    return [_number(point, "X"), -_number(point, "Y"), -_number(point, "Z")]
