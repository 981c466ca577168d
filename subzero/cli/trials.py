"""The commands that look at files before anything runs: ``subzero list``, ``new``, ``show``, ``validate``."""

from __future__ import annotations

import math
import shutil
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import scenarios
from scenarios.errors import Problem, ScenarioError, nearest_or_all
from scenarios.quantities import KNOWN
from subzero.cli.output_mode import FINE, PLAIN, Flag, OutputMode
from subzero.errors import UserError, printable, real, short

if TYPE_CHECKING:
    from scenarios.contents import Contents, Number

Words = Annotated[tuple[str, ...], Parameter(consume_multiple=True, negative=())]
COMMANDS_COLUMN = "propeller_rps"
"""A CSV file with this column holds commands; any other is a measured record."""
FEW_NUMBERS = """
# {title}
#
# All other numbers follow from {base} by similarity: "subzero show" says which are measured, derived and guessed,
# with the range of each; calibrations and diagnoses take half of a derived range as tolerance.{speed}
# A number that you know better goes into its own section, as in the file of {base}:
#
#   [rudder]
#   area = {{ value = 0.009, unit = "m2", range = [0.008, 0.010], source = "measured" }}

base = "{base}"

[known]{rows}

# What else can be known, without the # in front:
{rest}
"""
"""A vehicle file of few numbers: the known ones, and others that could be given, explained. What follows from it is
`scenarios.similar_vehicle`.
"""


def list_shipped(*, vehicles: Flag = False, cables: Flag = False, output_mode: OutputMode = PLAIN) -> int:
    """List the scenarios that are shipped; with a flag, the vehicles or the cables instead.

    Args:
        vehicles: list the vehicles.
        cables: list the cables.
        output_mode: the form of the output.
    """
    from scenarios.contents import first_line
    from scenarios.files import shipped

    kinds = [kind for kind, asked in (("vehicle", vehicles), ("cable", cables)) if asked]
    rows = {f"{kind}s": {name: first_line(kind, name) for name in shipped(f"{kind}s")} for kind in kinds}
    rows = rows or {"scenarios": {name: scenarios.describe(name) for name in scenarios.names()}}
    with output_mode.emit(rows):
        from rich.console import Console
        from rich.markup import escape
        from rich.table import Table

        table = Table.grid(padding=(0, 2))
        table.add_column(no_wrap=True)
        for names in rows.values():
            for name, words in names.items():
                table.add_row(f"[bold]{escape(printable(name))}[/bold]", escape(printable(words)))
        Console(highlight=False).print(table)
    return FINE


def new(
    path: Path,
    /,
    *,
    like: str = "fig6",
    torpedo: Words = (),
    output_mode: OutputMode = PLAIN,
) -> int:
    """Make a file of your own to begin with: a copy of a shipped scenario, vehicle or cable, or a vehicle of few
    numbers; every key explained.

    Args:
        path: file to make, such as my_trial.toml; one that exists is left alone.
        like: the file to copy: a name of "subzero list", "subzero list --vehicles" or "subzero list --cables".
        torpedo: what you know of a torpedo-shaped vehicle, as name=value in SI units: length, diameter, mass, speed,
            propeller_rps, propeller_diameter, net_buoyancy, fin_area, fin_station, tow_station, water_density.
        output_mode: the form of the output.
    """
    from scenarios.contents import locate
    from subzero.files.read_file import make_toml

    if torpedo:
        return _new_torpedo(path, list(torpedo), output_mode)
    if like.endswith(".toml"):
        raise UserError(
            f"--like takes the name of something shipped, and {short(like)} is a path. Copy that file itself."
        )
    kind, source = locate(like)
    make_toml(path, source.text)
    reported = {"path": printable(str(path)), "kind": kind, "like": like}
    with output_mode.emit(reported):
        print(f"Wrote {reported['path']}, a {kind} like {like}. Edit it, then:")
        print(f"  subzero validate {reported['path']}")
        if kind == "trial":
            print(f"  subzero compare {reported['path']}")
        else:
            print(f'  and name it in a trial: {kind} = "{reported["path"]}"')
    return FINE


def _new_torpedo(path: Path, words: list[str], output_mode: OutputMode) -> int:
    """Write a vehicle of few numbers, once it is known that they make one."""
    from scenarios.contents import contents_of_text
    from scenarios.similar_vehicle import speed_command
    from subzero.files.read_file import make_toml

    known = _known_numbers(words)
    found = contents_of_text("vehicle", str(path), _file_text("torpedo", known, "A vehicle."))
    doubts = _doubts(found)
    numbers = {number.name.removeprefix("vehicle."): number.values[0] for number in found.numbers}
    speed = known.get("speed_m_s")
    command = speed_command(lambda key: numbers.get(key, 0.0), speed) if speed else None
    sentence = f"It goes {speed:g} m/s at {command:.1f} rev/s." if command else ""
    title = f"{path.stem}: a torpedo of {len(known)} known numbers."
    make_toml(path, _file_text("torpedo", known, title, sentence))
    reported = {"path": printable(str(path)), "kind": "vehicle", "like": "torpedo", "known": known}
    with output_mode.emit(reported | {"propeller_rps": command, "warnings": doubts}):
        print(f"Wrote {reported['path']}: a torpedo of {len(known)} known numbers. {sentence}".rstrip())
        print(*_counted(found), *(f"Warning: {doubt}." for doubt in doubts), sep="\n")
        print(f"  subzero show {reported['path']}")
        print(f"  subzero manoeuvre zigzag --vehicle {reported['path']}")
    return FINE


def _file_text(base: str, known: Mapping[str, float], title: str, speed: str = "") -> str:
    """Return a vehicle file of few numbers, explained.

    Args:
        base: a shipped vehicle.
        known: key of [known] → value.
        title: its first line.
        speed: a sentence about its speed and command.
    """
    rows = {q.name: f"{q.name} = {{value}}# {q.meaning} [{q.unit}]" for q in KNOWN}
    said = "".join("\n" + rows[key].format(value=f"{value:<12g}") for key, value in known.items())
    rest = "\n".join("# " + rows[key].format(value="...  ") for key in rows if key not in known)
    return (
        FEW_NUMBERS.strip()
        .format(base=base, rows=said, rest=rest, title=title, speed=f"\n# {speed}" if speed else "")
        .replace(". \n", ".\n")
        + "\n"
    )


def _known_numbers(words: list[str]) -> dict[str, float]:
    """Return key of [known] → value for words such as ``length=2.0``; the unit of the key may be left out.

    Raises:
        ScenarioError: a word that is none, a key that is not known, a value outside its limits.
    """
    rows = {quantity.name: quantity for quantity in KNOWN}
    short = {name.removesuffix(f"_{name.rsplit('_', 1)[1]}"): name for name in rows}
    short |= {"speed": "speed_m_s", "fin_area": "fin_area_m2", "water_density": "water_density_kg_m3"}
    found: dict[str, float] = {}
    problems = []
    for word in words:
        name, _, text = word.partition("=")
        key, number = short.get(name, name), _float(text)
        if key not in rows:
            why = "no such number is known of a vehicle" if text else "this is not name=value"
            remedy = nearest_or_all(name, [*short])
            problems.append(Problem(file="the command", key=name, why=why, remedy=remedy))
        elif number is None or not rows[key].low <= number <= rows[key].high:
            problems.append(
                Problem(
                    file="the command", key=name, found=text, why="this cannot be", remedy=rows[key].allowed
                )
            )
        else:
            found[key] = number
    if problems:
        raise ScenarioError(problems)
    return found


def _float(text: str) -> float | None:
    try:
        return real(float(text))
    except ValueError:
        return None


def show(name: str, /, *, output_mode: OutputMode = PLAIN) -> int:
    """Show what a scenario, a vehicle or a cable says: every value with its unit, its range and its source.

    Args:
        name: a shipped name (see "subzero list"), or the path of a TOML file.
        output_mode: the form of the output.
    """
    from scenarios.contents import contents

    found = contents(name)
    with output_mode.emit(_as_json(found)):
        width = shutil.get_terminal_size().columns - 1
        head = f"{found.kind.capitalize()} {found.name}: {found.description}"
        legend = "Each value with its range, and below it what it is."
        for line in (*textwrap.wrap(head, width), *_counted(found), legend, *_lines(found, width)):
            print(printable(line))
        for kind, named in found.parts.items():
            print(printable(f"Its {kind} is {named}: subzero show {named}"))
    return FINE


def validate(path: Path, /, *, output_mode: OutputMode = PLAIN) -> int:
    """Check a file without running it: a scenario, vehicle, cable or sweep (TOML); commands or a record (CSV).

    Args:
        path: the file. All its problems are reported at once, each with its line and the allowed values.
        output_mode: the form of the output.
    """
    kind, reported = _record(path) if path.suffix == ".csv" else _toml(path)
    with output_mode.emit({"path": printable(str(path)), "kind": kind, "valid": True, "about": reported}):
        print(f"{printable(str(path))} is a valid {kind}: {reported}")
    return FINE


def _toml(path: Path) -> tuple[str, str]:
    """Return the kind and the contents of a TOML file; raise an error if it cannot be used."""
    from scenarios.contents import contents, locate
    from scenarios.files import read_toml

    source = read_toml(path, str(path))
    if isinstance(source.table.get("trial"), str):
        from subzero.sweeps.plan import read_plan

        return "sweep", f"{len(read_plan(path).points.values)} runs"
    kind, _ = locate(path)
    if kind == "trial":
        from subzero.model import load

        trial = load(path)
        return kind, f"{trial.duration:g} s; {printable(trial.description)}"
    found = contents(path)
    said = f"{len(found.numbers)} numbers, {_count_implausible(found)} outside their own plausible range"
    doubts = _doubts(found) if kind == "vehicle" else []
    if doubts:
        said += "".join(f"\n  Warning: {doubt}." for doubt in doubts)
    return kind, said


def _doubts(found: Contents) -> list[str]:
    """Return what contradicts itself in a vehicle; raise an error for one that its own equations refuse."""
    from scenarios.parts import nested
    from vehicle import from_mapping
    from vehicle.consistency import contradictions

    numbers = nested({number.name.removeprefix("vehicle."): number.values[0] for number in found.numbers})
    return contradictions(from_mapping(numbers))


def _count_implausible(found: Contents) -> int:
    return sum(
        not number.low <= number.values[0] <= number.high
        for number in found.numbers
        if not math.isnan(number.low)
    )


def _record(path: Path) -> tuple[str, str]:
    """Return the kind and the contents of a CSV file; raise an error if it cannot be used."""
    from scenarios.samples import check_times, read_csv
    from subzero.files.read_file import MOST_OF_A_CSV, UnreadableFileError, read_text
    from subzero.records.record import read_record

    try:
        header = read_text(path, MOST_OF_A_CSV).partition("\n")[0]
    except UnreadableFileError as error:
        raise UserError(str(error)) from None
    if COMMANDS_COLUMN in header.split(","):
        samples, problems = read_csv(path, str(path), "commands")
        problems += check_times(samples, None) if samples else []
        if problems or samples is None:
            raise scenarios.ScenarioError(problems)
        return "file of commands", f"{len(samples.time)} rows, to {samples.time[-1]:g} s"
    record = read_record(path)
    return "record", f"{record.time.size} samples of {', '.join(record.values)}, to {record.time[-1]:g} s"


# Tables.


def _lines(found: Contents, width: int) -> Iterator[str]:
    """Return all numbers as lines of a width: name, value and range; below, where the value comes from."""
    names = [each.name.rpartition(".") for each in found.numbers]
    values = [_value(each) for each in found.numbers]
    long, wide = max(len(key) for _, _, key in names), max(map(len, values))
    above = ""
    for number, (section, _, key), value in zip(found.numbers, names, values, strict=True):
        if section != above:
            yield f"[{section}]"
            above = section
        yield f"  {key:<{long}}  {value:>{wide}}  {_span(number)}".rstrip()
        indent = " " * 6
        yield from textwrap.wrap(
            f"{number.source} [{number.origin}]" if number.origin else number.source,
            max(width, 40),
            initial_indent=indent,
            subsequent_indent=indent,
        )


MOST_VALUES = 3
"""So many values of a list are shown."""


def _counted(found: Contents) -> list[str]:
    """Return in a line how many numbers of a vehicle or a cable are measured, derived and guessed."""
    from scenarios.contents import ORIGINS

    origins = [number.origin for number in found.numbers]
    said = ", ".join(f"{origins.count(name)} {name}" for name in ORIGINS if name in origins)
    return [f"{len(origins)} numbers: {said}."] if said else []


def _value(number: Number) -> str:
    shown = [f"{value:.6g}" for value in number.values[:MOST_VALUES]]
    unit = "" if number.unit == "1" else f" {number.unit}"
    return ", ".join(shown) + (", …" if len(number.values) > MOST_VALUES else "") + unit


def _span(number: Number) -> str:
    return "" if math.isnan(number.low) else f"{number.low:g} … {number.high:g}"


def _as_json(found: Contents) -> dict[str, Any]:
    """Return the contents, ready for JSON."""
    whole = asdict(found)
    for number in whole["numbers"]:
        number["low"], number["high"] = (
            None if math.isnan(x) else x for x in (number["low"], number["high"])
        )
    return whole
