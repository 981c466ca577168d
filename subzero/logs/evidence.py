"""What the values of a log say of the units of its columns, taken together.

Measurements of one vehicle are tied to one another. Over windows of rows, with a bar for the mean in a window,

    Δψ̄ = ∫r   Δθ̄ = ∫q   Δφ̄ = ∫p   Δz̄ = −∫u θ   |Δp̄| = ∫u

hold to some ten percent, while units differ by factors: a slope k of the left side against the right, in the numbers as
they were written, says that f_left k / f_right = 1 for the factors f of the units. A tie counts only if both
sides are as good as proportional. From all units that a column may be in, those are struck out that no choice of units of
the others makes fit, until nothing changes (constraint propagation). What is left is decided if it is one unit.

Left out: currents, angle of attack and calibration of sensors, which are why a tie is allowed to be off by `TOLERANCE`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from subzero.logs.names import LATITUDE, LIMITS, LONGITUDE, PRESSURE, RARE, UNITS, Unit, kind_of

TOLERANCE = 1.3
"""A tie may be off by this factor; the nearest units, knots and metres per second, are 1.9 apart. [-]"""
PROPORTIONAL = 0.9
"""Cosine between both sides of a tie from which on it counts. [-]"""
WINDOWS, FEWEST_ROWS = (300, 100, 30, 10), 20
"""Numbers of windows of which the one with the best proportion is taken, each with three rows or more."""
SURFACE_M = 1.0
"""A vehicle is not above the surface, but for the zero of its sensor. [m]"""
QUARTER_TURN = 0.5 * math.pi
LARGEST_ANGLES = {"heading": 2.0 * math.pi, "pitch": 0.5 * math.pi, "roll_angle": math.pi}
"""Channel → the largest angle that it has on a circle. [rad]"""


class Tie(NamedTuple):
    """A law that ties a channel to the product of others, integrated over time; `factor` is that of their usual units."""

    words: str
    left: str
    right: tuple[str, ...]
    factor: float = 1.0


TIES = (
    Tie("slope of heading", "heading", ("yaw_rate",)),
    Tie("slope of pitch", "pitch", ("pitch_rate",)),
    Tie("slope of roll", "roll_angle", ("roll_rate",)),
    Tie("change of depth by pitch and speed", "depth", ("surge_speed", "pitch"), -math.pi / 180.0),
    Tie("change of depth by pitch and speed", PRESSURE, ("surge_speed", "pitch"), -math.pi / 180.0),
    Tie("distance of positions", "north", ("surge_speed",)),
    Tie("distance of positions", "north", ("speed_over_ground",)),
)


@dataclass(frozen=True, kw_only=True)
class Measured:
    """A column as it was written, and what is said of its unit.

    Args:
        channel: that it holds.
        values: numbers of the log (rows,).
        unit: that name, file or map say; empty if nothing does.
        is_final: the map says so, and no value may contradict.
    """

    channel: str
    values: np.ndarray
    unit: str = ""
    is_final: bool = False


class Finding(NamedTuple):
    """What the values say of a column: units that they leave, the ties that count, and those that its unit breaks."""

    units: tuple[str, ...]
    agrees: tuple[str, ...] = ()
    broken: tuple[str, ...] = ()


class _Slope(NamedTuple):
    """The slope of a tie in written numbers, from its least to its largest estimate."""

    tie: Tie
    least: float
    most: float

    def fits(self, factors: Mapping[str, float]) -> bool:
        """Say whether it holds in units with these factors."""
        right = math.prod(factors[name] for name in self.tie.right)
        scale = factors[self.tie.left] / (right * self.tie.factor)
        low, high = sorted((self.least * scale, self.most * scale))
        return high >= 1.0 / TOLERANCE and low <= TOLERANCE


def findings(columns: Mapping[str, Measured], time: np.ndarray) -> dict[str, Finding]:
    """Return what the values of all columns together say of each, by channel.

    Args:
        columns: channel → column.
        time: of the rows, increasing (rows,). [s]
    """
    possible = _possible(columns)
    slopes = [slope for tie in TIES if (slope := _slope(tie, columns, time))]
    variables = {channel: _family(column) for channel, column in columns.items()}
    left = _propagated(possible, slopes, variables)
    found = {}
    for channel, column in columns.items():
        mine = [slope for slope in slopes if channel in (slope.tie.left, *slope.tie.right)]
        if channel == "east" and "north" in columns:
            mine = [slope for slope in slopes if slope.tie.left == "north"]
        broken = [slope for slope in mine if not _holds(slope, columns, left, variables)]
        units = left[variables[channel]]
        if column.unit and (broken or column.unit not in possible[variables[channel]]):
            units = _repairs(channel, column, mine, columns, possible, left, variables)
        agrees = tuple(dict.fromkeys(slope.tie.words for slope in mine if slope not in broken))
        found[channel] = Finding(
            tuple(units), agrees, tuple(dict.fromkeys(slope.tie.words for slope in broken))
        )
    return found


def tied(channel: str, columns: Mapping[str, Measured], time: np.ndarray) -> bool:
    """Say whether a channel is as good as proportional to what others measure of its changes."""
    return any(_slope(tie, columns, time) for tie in TIES if tie.left == channel)


def units_by_size(channel: str, values: np.ndarray) -> list[str]:
    """Return the usual units in which numbers (n,) are possible for a vehicle under water."""
    kind, known = kind_of(channel), values[np.isfinite(values)]
    return [
        name
        for name, unit in UNITS[kind].items()
        if name not in RARE and _is_possible(channel, kind, name, known, unit)
    ]


# What each column may be in, by itself


def _family(column: Measured) -> str:
    """Return the variable that a column's unit is: one for all angles, and for all rates, that say none themselves."""
    if column.unit:
        return column.channel
    kind = kind_of(column.channel)
    shared = {"degree": "angles", "degree/s": "rates", LATITUDE: "places", LONGITUDE: "places"}
    return "positions" if column.channel in ("north", "east") else shared.get(kind, column.channel)


def _possible(columns: Mapping[str, Measured]) -> dict[str, list[str]]:
    """Return the units that each variable may have by the size of its numbers alone."""
    found: dict[str, list[str]] = {}
    for channel, column in columns.items():
        variable = _family(column)
        units = [column.unit] if column.is_final else units_by_size(channel, column.values)
        if column.unit in RARE and column.unit not in units:  # a name that says so is believed
            units = [column.unit, *units]
        found[variable] = [unit for unit in found.get(variable, units) if unit in units]
    loose = [column for column in columns.values() if _family(column) == "angles"]
    if loose and (circle := _circle(loose)):
        found["angles"] = [unit for unit in found["angles"] if unit in circle]
    return found


def _is_possible(channel: str, kind: str, name: str, known: np.ndarray, unit: Unit) -> bool:
    """Say whether numbers in a unit lie where the channel can be."""
    size = np.abs(known).max(initial=0.0)
    if name.endswith(" up") and channel != "depth":
        return False
    if name == "ddmm.mmmm":  # degrees are shorter than that, but near the meridian
        is_long = size > LIMITS[kind] or channel == LONGITUDE
        return bool(is_long and size <= 100.0 * LIMITS[kind] and np.all(np.abs(known) % 100.0 < 60.0))
    if name == "degE7" and not np.all(known == np.round(known)):
        return False
    if channel in ("depth", PRESSURE) and np.median(known * unit.factor + unit.offset) < -SURFACE_M:
        return False
    most = 1.01 * math.degrees(LARGEST_ANGLES[channel]) if channel == "pitch" else LIMITS.get(kind, math.inf)
    return channel in ("north", "east") or bool(size * abs(unit.factor) <= most - min(unit.offset, 0.0))


def _circle(loose: Sequence[Measured]) -> tuple[str, ...]:
    """Return the unit in which all angles of a log that say none are on a circle, by the largest of them.

    Within ±π, and over more than a quarter of a turn, they are radians; beyond 2π degrees, beyond two turns of degrees
    hundredths of a degree. Nothing if smaller angles leave it open.
    """
    sizes = [
        (np.nanmax(np.abs(column.values)), LARGEST_ANGLES.get(column.channel, math.pi)) for column in loose
    ]
    if all(size <= 1.01 * most for size, most in sizes):
        is_wide = any(np.ptp(column.values[np.isfinite(column.values)]) > QUARTER_TURN for column in loose)
        return ("rad",) if is_wide and any(column.channel == "heading" for column in loose) else ()
    largest = max(size for size, _ in sizes)
    return ("degree",) if largest <= LIMITS["degree"] else ("centidegree",)


# What they say of one another


def _slope(tie: Tie, columns: Mapping[str, Measured], time: np.ndarray) -> _Slope | None:
    """Return the slope of a tie where both sides are measured and as good as proportional."""
    names = (tie.left, *tie.right, *(("east",) if tie.left == "north" else ()))
    if any(name not in columns or columns[name].channel != name for name in names):
        return None
    if tie.left == "north" and columns["north"].unit != columns["east"].unit:
        return None
    series = {name: _filled(columns[name], time) for name in names}
    known = np.all([np.isfinite(values) for values in series.values()], axis=0)
    if known.sum() < FEWEST_ROWS:
        return None
    product = np.prod([series[name][known] for name in tie.right], axis=0)
    product = np.abs(product) if tie.left == "north" else product
    total = np.r_[0.0, np.cumsum(0.5 * (product[1:] + product[:-1]) * np.diff(time[known]))]
    left = [series[name][known] for name in names if name not in tie.right]
    best = max(_cosines(left, total), key=lambda pair: abs(pair[0]), default=(0.0, 0.0, 0.0))
    return _Slope(tie, *best[1:]) if abs(best[0]) >= PROPORTIONAL else None


def _cosines(left: Sequence[np.ndarray], total: np.ndarray) -> Iterator[tuple[float, float, float]]:
    """Give for each number of windows the cosine between both sides, and the least and the largest slope."""
    for count in WINDOWS:
        if total.size < 3 * count and count > WINDOWS[-1]:
            continue
        edges = np.linspace(0, total.size, count + 1).astype(int)[:-1]
        sizes = np.diff(np.r_[edges, total.size])
        moved = [np.diff(np.add.reduceat(values, edges) / sizes) for values in left]
        y, x = (
            np.hypot(*moved) if len(moved) > 1 else moved[0],
            np.diff(np.add.reduceat(total, edges) / sizes),
        )
        plain, level = _cosine(x, y), _cosine(x - x.mean(), y - y.mean())
        slopes = [pair[1] for pair in (plain, level) if abs(pair[0]) >= PROPORTIONAL] or [plain[1]]
        yield max(plain[0], level[0], key=abs), min(slopes), max(slopes)


def _cosine(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Return the cosine between two sides, and the slope of the second against the first."""
    sizes = float(np.linalg.norm(x) * np.linalg.norm(y))
    return (float(x @ y) / sizes, float(x @ y) / float(x @ x)) if sizes > 0.0 else (0.0, 0.0)


def _filled(column: Measured, time: np.ndarray) -> np.ndarray:
    """Return the values between the first and the last measurement without gaps; a heading without jumps."""
    known = np.flatnonzero(np.isfinite(column.values))
    if known.size < 2:
        return np.full(time.size, np.nan)
    values = column.values[known]
    if column.channel == "heading":
        reach = max(float(np.ptp(values)), float(np.abs(values).max()))
        turn = next(turn for turn in (2.0 * math.pi, 360.0, 36000.0, math.inf) if reach <= 1.01 * turn)
        values = np.unwrap(values, period=turn) if math.isfinite(turn) else values
    filled: np.ndarray = np.interp(time, time[known], values, left=np.nan, right=np.nan)
    return filled


def _choices(
    slope: _Slope, units: Mapping[str, Sequence[str]], variables: Mapping[str, str]
) -> Iterator[dict[str, str]]:
    """Give every choice of units, by variable, in which a tie holds."""
    channels = (slope.tie.left, *slope.tie.right)
    names = list(dict.fromkeys(variables[channel] for channel in channels))
    for chosen in itertools.product(*(units[name] for name in names)):
        choice = dict(zip(names, chosen, strict=True))
        if slope.fits({name: UNITS[kind_of(name)][choice[variables[name]]].factor for name in channels}):
            yield choice


def _propagated(
    possible: Mapping[str, list[str]], slopes: Sequence[_Slope], variables: Mapping[str, str]
) -> dict[str, list[str]]:
    """Return the units of each variable that some choice of the others makes fit; a tie that nothing fits is left out."""
    left = dict(possible)
    for _ in range(len(TIES) * len(left)):
        before = dict(left)
        for slope in slopes:
            choices = list(_choices(slope, left, variables))
            for name in choices[0] if choices else ():
                left[name] = [unit for unit in left[name] if any(choice[name] == unit for choice in choices)]
        if left == before:
            break
    return left


def _holds(
    slope: _Slope,
    columns: Mapping[str, Measured],
    left: Mapping[str, list[str]],
    variables: Mapping[str, str],
) -> bool:
    """Say whether a tie holds in the units that are stated, with some of those that are left for the others."""
    stated = {variables[channel]: [column.unit] for channel, column in columns.items() if column.unit}
    return any(True for _ in _choices(slope, {**left, **stated}, variables))


def _repairs(
    channel: str, column: Measured, mine: Sequence[_Slope], columns: Mapping[str, Measured],
    possible: Mapping[str, list[str]], left: Mapping[str, list[str]], variables: Mapping[str, str],
) -> list[str]:  # fmt: skip
    """Return the units of a column that would make all its ties hold with what is stated of the others."""
    found = []
    for unit in possible[variables[channel]]:
        changed = {**columns, channel: Measured(channel=channel, values=column.values, unit=unit)}
        if all(_holds(slope, changed, left, variables) for slope in mine):
            found.append(unit)
    return found
