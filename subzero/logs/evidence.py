"""The evidence that the values of a log give for the units of its columns, taken together.

Measurements of one vehicle are tied to one another. Over windows of rows, with a bar for the mean in a window,

    Δψ̄ = ∫r   Δθ̄ = ∫q   Δz̄ = −∫u θ   |Δp̄| = ∫|u|

hold to some ten percent (rates to a factor of two, if the vehicle is steep), while units differ by factors: a slope k
of the left side against the right, in the numbers as they were written, says that f_left k / f_right = 1 for the
factors f of the units. A tie counts if both sides are as good as proportional. From all units that a column may be in,
those are struck out that no choice of units of the others makes fit, until nothing changes (constraint propagation).
What is left is decided if it is one unit.

Left out: currents, angle of attack, large roll and pitch, and calibration of sensors, for which a tie has a tolerance;
and roll, whose slope is not the roll rate where a vehicle dives in a turn.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from subzero.logs.names import LATITUDE, LIMITS, LONGITUDE, PRESSURE, RARE, UNITS, Unit, kind_of

TOLERANCE, TOLERANCE_OF_RATES = 1.3, 4.0
"""A tie may be off by this factor; knots and metres per second are 1.9 apart, degrees and radians 57. [-]"""
PROPORTIONAL = 0.9
"""Cosine between both sides of a tie from which on it counts. [-]"""
WINDOWS, FEWEST_ROWS = (300, 100, 30, 10), 20
"""Numbers of windows, each of three rows or more, of which the one with the best proportion is taken."""
SURFACE_M = 1.0
"""A vehicle is not above the surface, but for the zero of its sensor. [m]"""
LARGEST_ANGLES = {"heading": 2.0 * math.pi, "pitch": 0.5 * math.pi, "roll_angle": math.pi}
"""Channel → the largest angle that it has on a circle. [rad]"""
MOST_TURNS = 10.0
"""A heading that counts on has turned no more often. [-]"""
QUARTER_TURN = 0.5 * math.pi
FAMILIES = {"degree": "angles", "degree/s": "rates", LATITUDE: "places", LONGITUDE: "places"}
"""Units of a kind that are the same in all columns of a log whose names say none; so are those of north and east."""


class Tie(NamedTuple):
    """A law: a channel is the integral of the product of others, times `factor` in the units of `subzero.channels`,
    within a factor `tolerance`.
    """

    words: str
    left: str
    right: tuple[str, ...]
    factor: float = 1.0
    tolerance: float = TOLERANCE


DIVE = "change of depth by pitch and speed"
TIES = (
    Tie("slope of heading", "heading", ("yaw_rate",), 1.0, TOLERANCE_OF_RATES),
    Tie("slope of pitch", "pitch", ("pitch_rate",), 1.0, TOLERANCE_OF_RATES),
    Tie(DIVE, "depth", ("surge_speed", "pitch"), -math.pi / 180.0),
    Tie(DIVE, PRESSURE, ("surge_speed", "pitch"), -math.pi / 180.0),
    Tie("distance of positions", "north", ("surge_speed",)),
    Tie("distance of positions", "north", ("speed_over_ground",)),
)


class Measured(NamedTuple):
    """A column as it was written: its channel, numbers (rows,), and the unit that name or file state, if any."""

    channel: str
    values: np.ndarray
    unit: str = ""
    is_sure: bool = False


class Contradiction(NamedTuple):
    """A tie that stated units break: its words, its channels, and each (channel, unit) that alone would repair it."""

    words: str
    channels: tuple[str, ...]
    repairs: tuple[tuple[str, str], ...]
    is_of_units: bool


class Findings(NamedTuple):
    """The evidence in the values: the units left of each channel, the ties that it agrees with, and the
    contradictions.
    """

    units: Mapping[str, list[str]]
    agrees: Mapping[str, list[str]]
    contradictions: tuple[Contradiction, ...]


class _Slope(NamedTuple):
    """The slope of a tie in written numbers, from its least to its largest estimate."""

    tie: Tie
    least: float
    most: float

    @property
    def channels(self) -> tuple[str, ...]:
        return (self.tie.left, *self.tie.right)

    def fitting(
        self, units: Mapping[str, Sequence[str]], variables: Mapping[str, str]
    ) -> Iterator[dict[str, str]]:
        """Give every choice of units, by variable, in which it holds."""
        names = list(dict.fromkeys(variables[channel] for channel in self.channels))
        for chosen in itertools.product(*(units[name] for name in names)):
            choice = dict(zip(names, chosen, strict=True))
            factors = [UNITS[kind_of(name)][choice[variables[name]]].factor for name in self.channels]
            scale = factors[0] / (math.prod(factors[1:]) * self.tie.factor)
            low, high = sorted((self.least * scale, self.most * scale))
            if high >= 1.0 / self.tie.tolerance and low <= self.tie.tolerance:
                yield choice


def findings(columns: Mapping[str, Measured], time: np.ndarray) -> Findings:
    """Return the evidence of the values of all columns together, for each.

    Args:
        columns: channel → column.
        time: of the rows, increasing (rows,). [s]
    """
    variables = {channel: _variable(column) for channel, column in columns.items()}
    possible = _possible(columns, variables)
    stated = {variables[channel]: [column.unit] for channel, column in columns.items() if column.unit}
    slopes = [slope for tie in TIES if (slope := _slope(tie, columns, time))]
    left = _propagated(possible, slopes, variables)
    agrees: dict[str, list[str]] = {channel: [] for channel in columns}
    contradictions = []
    for slope in slopes:
        if any(slope.fitting({**left, **stated}, variables)):
            for channel in (*slope.channels, *(("east",) if slope.tie.left == "north" else ())):
                agrees[channel].append(slope.tie.words)
        else:
            contradictions.append(_contradiction(slope, columns, {**left, **stated}, possible, variables))
    units = {channel: left[variables[channel]] for channel in columns}
    return Findings(units, agrees, tuple(contradictions))


def tied(channel: str, columns: Mapping[str, Measured], time: np.ndarray) -> bool:
    """Return whether a channel is nearly proportional to the measure that other channels give of its changes."""
    return any(_slope(tie, columns, time) for tie in TIES if tie.left == channel)


def units_by_size(channel: str, values: np.ndarray) -> list[str]:
    """Return the usual units in which numbers (n,) are possible for a vehicle under water."""
    known = values[np.isfinite(values)]
    units = UNITS[kind_of(channel)].items()
    return [name for name, unit in units if name not in RARE and _is_possible(channel, name, known, unit)]


def _is_possible(channel: str, name: str, known: np.ndarray, unit: Unit) -> bool:
    """Return whether numbers in a unit are in the possible range of the channel."""
    most, size = LIMITS.get(kind_of(channel), math.inf), np.abs(known).max(initial=0.0)
    if name == "ddmm.mmmm":  # degrees are shorter than that, but near the meridian
        is_long = size > most or channel == LONGITUDE
        return bool(is_long and size <= 100.0 * most and np.all(np.abs(known) % 100.0 < 60.0))
    if (name == "degE7" and not np.all(known == np.round(known))) or (
        name.endswith(" up") and channel != "depth"
    ):
        return False
    if channel in ("depth", PRESSURE) and np.median(known * unit.factor + unit.offset) < -SURFACE_M:
        return False
    if channel == "pitch":
        most = 1.01 * math.degrees(LARGEST_ANGLES[channel])
    return channel in ("north", "east") or bool(size * abs(unit.factor) <= most - unit.offset)


def _variable(column: Measured) -> str:
    """Return the variable that a column's unit is: its own, or that of a family whose names say none."""
    if column.unit:
        return column.channel
    family = FAMILIES.get(kind_of(column.channel), column.channel)
    return "positions" if column.channel in ("north", "east") else family


def _possible(columns: Mapping[str, Measured], variables: Mapping[str, str]) -> dict[str, list[str]]:
    """Return the units that each variable may have by the size of its numbers alone."""
    found: dict[str, list[str]] = {}
    for channel, column in columns.items():
        units = [column.unit] if column.is_sure else units_by_size(channel, column.values)
        if column.unit not in units and (column.unit in RARE or _counts_turns(column)):
            units.append(column.unit)
        found[variables[channel]] = [unit for unit in found.get(variables[channel], units) if unit in units]
    loose = [column for channel, column in columns.items() if variables[channel] == "angles"]
    if circle := _circle(loose):
        found["angles"] = [circle]
    return found


def _counts_turns(column: Measured) -> bool:
    """Return whether a column is a heading that its name has in radians or degrees, and that counts on over some
    turns.
    """
    turn = {"rad": 2.0 * math.pi, "degree": 360.0}.get(column.unit, 0.0) * (column.channel == "heading")
    return bool(np.nanmax(np.abs(column.values)) <= MOST_TURNS * turn)


def _circle(loose: Sequence[Measured]) -> str:
    """Return the unit in which all angles of a log that say none are on a circle, by the largest of them.

    Within 2π (pitch π/2, roll π), and a heading over more than a quarter of a turn, they are radians; beyond that
    degrees, beyond two turns of degrees hundredths of a degree. Nothing if smaller angles leave it open.
    """
    sizes = [(np.nanmax(np.abs(angle.values)), LARGEST_ANGLES.get(angle.channel, math.pi)) for angle in loose]
    if all(size <= 1.01 * most for size, most in sizes):
        headings = [angle.values[np.isfinite(angle.values)] for angle in loose if angle.channel == "heading"]
        spans = [np.ptp(heading) for heading in headings]
        return "rad" if spans and spans[0] > QUARTER_TURN else ""
    return "degree" if max(size for size, _ in sizes) <= LIMITS["degree"] else "centidegree"


def _slope(tie: Tie, columns: Mapping[str, Measured], time: np.ndarray) -> _Slope | None:
    """Return the slope of a tie where both sides are measured and as good as proportional."""
    lefts = (tie.left, "east") if tie.left == "north" else (tie.left,)
    names = (*lefts, *tie.right)
    if not columns.keys() >= set(names) or len({columns[name].unit for name in lefts}) > 1:
        return None
    series = {name: _filled(columns[name], time) for name in names}
    known = np.all([np.isfinite(values) for values in series.values()], axis=0)
    if known.sum() < FEWEST_ROWS:
        return None
    product = np.prod([series[name][known] for name in tie.right], axis=0)
    product = np.abs(product) if tie.left == "north" else product
    total = np.r_[0.0, np.cumsum(0.5 * (product[1:] + product[:-1]) * np.diff(time[known]))]
    found = _estimates([series[name][known] for name in lefts], total)
    cosine, least, most = max(found, key=lambda estimate: abs(estimate[0]))
    return _Slope(tie, least, most) if abs(cosine) >= PROPORTIONAL else None


def _estimates(left: Sequence[np.ndarray], total: np.ndarray) -> Iterator[tuple[float, float, float]]:
    """Give for each number of windows the cosine between both sides, and the least and the largest slope.

    The slope is fitted through zero, and with a constant added, which takes up a drift or a current.
    """
    for count in WINDOWS:
        if total.size < 3 * count and count > WINDOWS[-1]:
            continue
        edges = np.linspace(0, total.size, count + 1).astype(int)
        moved = [np.diff(np.add.reduceat(side, edges[:-1]) / np.diff(edges)) for side in (*left, total)]
        y, x = np.hypot(*moved[:-1]) if len(left) > 1 else moved[0], moved[-1]
        fits = [_cosine(x, y), _cosine(x - x.mean(), y - y.mean())]
        slopes = [slope for cosine, slope in fits if abs(cosine) >= PROPORTIONAL] or [0.0]
        yield max((cosine for cosine, _ in fits), key=abs), min(slopes), max(slopes)


def _cosine(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Return the cosine between two sides, and the slope of the second against the first."""
    product, sizes = float(x @ y), float(np.linalg.norm(x) * np.linalg.norm(y))
    return (product / sizes, product / float(x @ x)) if sizes > 0.0 else (0.0, 0.0)


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


def _propagated(
    possible: Mapping[str, list[str]], slopes: Sequence[_Slope], variables: Mapping[str, str]
) -> dict[str, list[str]]:
    """Return the units that some choice of the others makes fit; a tie that nothing fits is left out."""
    left, before = dict(possible), dict[str, list[str]]()
    while left != before:
        before = dict(left)
        for slope in slopes:
            choices = list(slope.fitting(left, variables))
            for name in choices[0] if choices else ():
                left[name] = [unit for unit in left[name] if any(choice[name] == unit for choice in choices)]
    return left


def _contradiction(
    slope: _Slope,
    columns: Mapping[str, Measured],
    stated: Mapping[str, list[str]],
    possible: Mapping[str, list[str]],
    variables: Mapping[str, str],
) -> Contradiction:
    """Return the ties that stated units break, and which one of them alone could be another one."""
    repairs = tuple(
        (channel, unit)
        for channel in slope.channels
        if not columns[channel].is_sure
        for unit in possible[variables[channel]]
        if any(slope.fitting({**stated, variables[channel]: [unit]}, variables))
    )
    is_of_units = any(slope.fitting(possible, variables))
    return Contradiction(slope.tie.words, slope.channels, repairs, is_of_units)
