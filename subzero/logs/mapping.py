"""Which column of a log is which channel, in which unit, and why: found from names (`logs.names`) and values
(`logs.evidence`). What these do not decide, or contradict, is asked; the map of `logs.map_file` then has to say it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from subzero.channels import TIME
from subzero.errors import short
from subzero.logs import times
from subzero.logs.evidence import Contradiction, Findings, Measured, findings, tied, units_by_size
from subzero.logs.names import (
    CLOCK_UNITS,
    LATITUDE,
    LONGITUDE,
    TARGETS,
    UNITS,
    Named,
    reason_unused,
    recognised,
)
from subzero.logs.table import NUMBER, TEXT, Table, names_of, refusal

ASKED = "?"
"""Unit in a map that the user has to fill in."""
RIVAL = "one of several with this channel"
"""Reason of a column that may be the one to be used."""
ACROSS = "sway_speed", "heave_speed"
"""Channels that one letter may mean, v and w, and that are taken only with a speed ahead."""
ALIKE = 0.98
"""Cosine between two columns from which on they measure the same. [-]"""
EQUATOR_M, SQUARED_ECCENTRICITY = 6378137.0, 6.69437999014e-3
"""Ellipsoid WGS 84."""


@dataclass(frozen=True, kw_only=True)
class Line:
    """A column of the log in the map; without a channel it is not used.

    Args:
        name: of the column.
        channel: of `subzero.channels`, or latitude, longitude, pressure; empty if it is not used.
        unit: of the column; "?" if it is asked for.
        factor: times the column, besides its unit; −1 for one that is upside down.
        reason: why.
        is_open: the unit is that of the name, and the values leave others too.
    """

    name: str
    channel: str = ""
    unit: str = ""
    factor: float = 1.0
    reason: str = ""
    is_open: bool = False


@dataclass(frozen=True, kw_only=True)
class Clock:
    """How times are read.

    Args:
        columns: one with times, or a date and a time of day; none if rows are evenly spread.
        unit: of its numbers; empty for dates and times of day, "?" if it is asked for.
        start: time of the log that is t = 0; its first one if None.
        part: which part of a clock that was restarted, from 1; 0 if it was not.
        sort: put rows in the order of their times.
        every_s: time between rows, if there are no columns. [s]
        reason: why.
    """

    columns: tuple[str, ...] = ()
    unit: str = ""
    start: float | str | None = None
    part: int = 0
    sort: bool = False
    every_s: float = 0.0
    reason: str = "map"


@dataclass(frozen=True, kw_only=True)
class Map:
    """How a log becomes a record, the decisions that the user has to make first, and its anomalies, in sentences."""

    clock: Clock
    lines: tuple[Line, ...] = ()
    questions: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def find_clock(table: Table) -> tuple[Clock, tuple[str, ...]]:
    """Return how the times of a log are read, by names and forms of its columns, and the questions to ask.

    Raises:
        UserError: there is no time.
    """
    by_form: dict[str, list[str]] = {}
    for name, column in table.columns.items():
        by_form.setdefault(column.form, []).append(name)
    for form in (*times.DATE_AND_TIME, times.MIXED):
        if form in by_form:
            return Clock(columns=(by_form[form][0],), reason=form), ()
    clocks = [by_form[form][0] for form in (times.DATE, times.TIME_OF_DAY) if form in by_form]
    named = {name: found for name in by_form.get(NUMBER, ()) if (found := _is_time(table, name))}
    if len(clocks) == 2 or (not named and times.TIME_OF_DAY in by_form):
        return Clock(columns=tuple(clocks), reason="date and time of day"[0 if len(clocks) == 2 else 9 :]), ()
    if not named:
        why = f"none of its columns is a time: {names_of(table.columns)}"
        remedy = (
            'Say in the map: [time] columns = ["NAME"], unit = "s", or how far rows are apart: every_s = 0.1.'
        )
        raise refusal(table.source, why, remedy)
    name = min(named, key=lambda name: named[name].rank)
    if fractions := [other for other in named if _are_fractions(table, name, other)]:
        return Clock(columns=(name, fractions[0]), unit="s", reason="seconds and their fractions"), ()
    return _clock_of_numbers(name, table.columns[name].values, named[name].unit)


def _is_time(table: Table, name: str) -> Named | None:
    """Return the finding for a column of numbers that is a time by its name."""
    found, column = recognised(name, table.columns[name].unit), table.columns[name]
    return found if found and found.channel == TIME.name and np.isfinite(column.values).any() else None


def _are_fractions(table: Table, name: str, other: str) -> bool:
    """Return whether the fractions of a clock in whole seconds stand in another column, as its name and numbers
    say.
    """
    both = [
        column.values[np.isfinite(column.values)] for column in (table.columns[name], table.columns[other])
    ]
    named = recognised(other)
    is_whole = all(values.size and np.all(values == np.round(values)) for values in both)
    return bool(
        is_whole
        and named
        and named.unit in ("us", "ns")
        and both[1].max() < 1e9
        and np.ptp(both[1]) > 0.0
        and (np.diff(both[0]) == 0.0).any()
    )


def _clock_of_numbers(name: str, values: np.ndarray, written: str) -> tuple[Clock, tuple[str, ...]]:
    """Return the clock of a column of numbers, in the unit that is written if its size and steps allow that."""
    likely = times.unit_by_values(values)
    is_epoch = len(likely) == 1 and np.nanmedian(values) * CLOCK_UNITS[likely[0]] > min(times.EPOCHS)
    if written and (written in likely or len(likely) != 1 or written in ("min", "h", "datenum")):
        return Clock(columns=(name,), unit=written, reason="unit in the name"), ()
    if len(likely) == 1 and (not written or is_epoch):
        reason = "counts from 1970" if is_epoch else "by its steps"
        return Clock(columns=(name,), unit=likely[0], reason=reason), ()
    said = f"by its name in {written}, by its steps in" if written else "in"
    question = f"{short(name)} (time): {said} {_either(likely) or 'no unit that is known'}"
    return Clock(columns=(name,), unit=ASKED, reason="asked"), (question,)


def find_map(table: Table, clock: Clock, rows: np.ndarray, time: np.ndarray) -> Map:
    """Return the meaning of every column of a log, by names and values.

    Args:
        table: the log.
        clock: how its times are read.
        rows: those that are used, in the order of time.
        time: of these rows. [s]
    """
    named = {
        name: found
        for name, column in table.columns.items()
        if column.form == NUMBER
        and (found := recognised(name, column.unit))
        and found.channel != TIME.name
        and np.isfinite(column.values[rows]).any()
        and (
            found.channel not in (LATITUDE, LONGITUDE) or np.nan_to_num(column.values[rows]).any()
        )  # 0: no fix
    }
    if "surge_speed" not in {found.channel for found in named.values()}:  # v may be the speed itself
        named = {name: found for name, found in named.items() if found.channel not in ACROSS}
    values = {name: table.columns[name].values[rows] for name in named}
    chosen, questions = _chosen(named, values, time)
    used = {
        name: named[name] for name, why in chosen.items() if why != RIVAL and not why.startswith("not used")
    }
    columns = {use.channel: Measured(use.channel, values[name], use.unit) for name, use in used.items()}
    said = findings({**_positions(columns), **columns}, time)
    lines = {name: _unused(table, name, chosen) for name in table.columns if name not in clock.columns}
    lines |= {
        name: Line(name=name, channel=named[name].channel, unit=named[name].unit or ASKED, reason=RIVAL)
        for name, reason in chosen.items()
        if reason == RIVAL
    }
    lines |= {name: _line(name, found, said, chosen[name]) for name, found in used.items()}
    questions += [_question(lines[name], said) for name in used if lines[name].unit == ASKED]
    names = {found.channel: lines[name] for name, found in used.items()}
    odd = [(tie.is_of_units, _words(tie, names)) for tie in said.contradictions if tie.channels[0] in names]
    questions += [words for is_asked, words in odd if is_asked]
    notes = tuple(words for is_asked, words in odd if not is_asked)
    return Map(clock=clock, lines=tuple(lines.values()), questions=tuple(questions), notes=notes)


def contradictions(mapping: Map, table: Table, rows: np.ndarray, time: np.ndarray) -> tuple[str, ...]:
    """Return how the values contradict a map that was given, in sentences; the map is used nevertheless."""
    lines = {line.channel: line for line in mapping.lines if line.channel}
    values = {channel: line.factor * table.columns[line.name].values[rows] for channel, line in lines.items()}
    columns = {channel: Measured(channel, values[channel], line.unit) for channel, line in lines.items()}
    found = findings({**_positions(columns), **columns}, time)
    return tuple(_words(tie, lines) for tie in found.contradictions if tie.channels[0] in lines)


def _unused(table: Table, name: str, chosen: Mapping[str, str]) -> Line:
    """Return the line of a column that is not used, and why."""
    column, named = table.columns[name], recognised(name)
    reason = f"not used: {reason_unused(name) or 'no channel has this name'}"
    if named and named.channel in ACROSS:
        reason = f"not used: a {named.channel}, of a log without a speed ahead; say in the map what it is"
    if column.form not in (NUMBER, TEXT) or (named and named.channel == TIME.name):
        reason = "not used: another time"
    if column.form == TEXT or (named and column.is_empty):
        reason = "not used: no numbers"
    return Line(name=name, reason=chosen.get(name, reason))


def _line(name: str, named: Named, found: Findings, choice: str) -> Line:
    """Return the line of a column whose unit is stated, decided by values, or asked."""
    units, agrees = found.units[named.channel], found.agrees[named.channel]
    why = [choice] if choice else []
    why += [named.reason if named.unit else "by its values"]
    why += [f"agrees with the {' and the '.join(dict.fromkeys(agrees))}"] if agrees else []
    line = Line(name=name, channel=named.channel, unit=named.unit, reason="; ".join(why))
    if named.unit:
        unit = named.unit if named.unit in units or agrees else ASKED
        return replace(line, unit=unit, is_open=units != [named.unit])
    return replace(line, unit=units[0]) if len(units) == 1 else replace(line, unit=ASKED, reason="asked")


def _question(line: Line, found: Findings) -> str:
    """Return the question about a column whose unit is not decided."""
    units = _either(found.units[line.channel]) or "no unit that is known"
    if line.is_open:
        return f"{short(line.name)} ({line.channel}): its numbers cannot be in the unit of its name; {units} would do"
    return f"{short(line.name)} ({line.channel}): in {units}, which nothing in the log decides"


def _words(tie: Contradiction, lines: Mapping[str, Line]) -> str:
    """Return a contradiction in words, with the columns' own names."""
    of = {channel: short(line.name) for channel, line in lines.items()}
    columns = " and ".join(of.get(channel, channel) for channel in tie.channels)
    repairs = [f"{unit} for {of.get(channel, channel)}" for channel, unit in tie.repairs]
    alone = f"; alone {_either(repairs)} would do" if repairs else ""
    if tie.is_of_units:
        return f"{columns} contradict the {tie.words} in these units: one or more is in another{alone}"
    return f"{columns} contradict the {tie.words}, in whatever units: look at them."


def _either(words: Sequence[str]) -> str:
    return " or ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _chosen(
    named: Mapping[str, Named], values: Mapping[str, np.ndarray], time: np.ndarray
) -> tuple[dict[str, str], list[str]]:
    """Return why each column is chosen among those of its channel, or "not used: …"; and the questions to ask."""
    ranks = {name: (found.channel in TARGETS, found.rank) for name, found in named.items()}
    by_target: dict[str, list[str]] = {}
    for name in sorted(named, key=lambda name: ranks[name]):
        by_target.setdefault(TARGETS.get(named[name].channel, named[name].channel), []).append(name)
    reasons, questions = dict[str, str](), []
    for target, names in by_target.items():
        rivals = [name for name in names if ranks[name] == ranks[names[0]]]
        first, reason = _best_of(rivals, named, values, time)
        if not first:
            either = _either([short(name) for name in rivals])
            questions.append(f"{either} is the {target}; they differ, so keep one in the map")
        unused = f"not used: {short(first or names[0])} is the {target}"
        reasons |= {
            name: reason if name == first else RIVAL if not first and name in rivals else unused
            for name in names
        }
    return reasons, questions


def _best_of(
    rivals: Sequence[str], named: Mapping[str, Named], values: Mapping[str, np.ndarray], time: np.ndarray
) -> tuple[str, str]:
    """Return which of some columns with one name measures what it is called, and why; no name if that is open."""
    if len(rivals) == 1:
        return rivals[0], ""
    others = {found.channel: Measured(found.channel, values[name]) for name, found in named.items()}
    channel = named[rivals[0]].channel
    measured = {name: {**others, channel: Measured(channel, values[name])} for name in rivals}
    best = [name for name in rivals if tied(channel, measured[name], time)] or list(rivals)
    if all(_are_alike(values[best[0]], values[name]) for name in best[1:]):
        odd, same = [name for name in rivals if name not in best], ", ".join(map(short, best[1:]))
        words = [f"as good as {same}"] if same else []
        words += [f"changes as others say, which {', '.join(map(short, odd))} does not"] if odd else []
        return best[0], "; ".join(words)
    return "", ""


def _are_alike(first: np.ndarray, second: np.ndarray) -> bool:
    """Return whether two columns change alike, by as much."""
    known = np.isfinite(first) & np.isfinite(second)
    if not known.any():
        return False
    a, b = (values[known] - values[known].mean() for values in (first, second))
    return 2.0 * float(a @ b) >= ALIKE * float(a @ a + b @ b)


def _positions(columns: Mapping[str, Measured]) -> dict[str, Measured]:
    """Return north and east of latitude and longitude, if their unit is known by their size or by their names."""
    places = [columns[name] for name in (LATITUDE, LONGITUDE) if name in columns]
    likely = units_by_size(LATITUDE, places[0].values) if len(places) == 2 else []
    units = [place.unit or (likely[0] if len(likely) == 1 else "") for place in places]
    if len(places) < 2 or not all(units):
        return {}
    metres = north_and_east([place.values for place in places], units)
    return {name: Measured(name, way, "m", True) for name, way in zip(("north", "east"), metres, strict=True)}


def north_and_east(places: Sequence[np.ndarray], units: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return the way north and east of the first place (n,), on the tangent to the ellipsoid WGS 84 there. [m]

    Args:
        places: latitude and longitude (n,).
        units: of both.
    """
    phi, lam = (_radians(place, unit) for place, unit in zip(places, units, strict=True))
    first = int(np.argmax(np.isfinite(phi) & np.isfinite(lam)))
    lam = lam[first] + np.remainder(lam - lam[first] + np.pi, 2.0 * np.pi) - np.pi  # the date line is no jump
    w = 1.0 - SQUARED_ECCENTRICITY * np.sin(phi[first]) ** 2
    meridian, normal = EQUATOR_M * (1.0 - SQUARED_ECCENTRICITY) / w**1.5, EQUATOR_M / np.sqrt(w)
    return meridian * (phi - phi[first]), normal * np.cos(phi[first]) * (lam - lam[first])


def _radians(angle: np.ndarray, unit: str) -> np.ndarray:
    if unit == "ddmm.mmmm":
        whole = np.trunc(angle / 100.0)
        angle = whole + (angle - 100.0 * whole) / 60.0
    radians: np.ndarray = np.radians(angle * UNITS[LATITUDE][unit].factor)
    return radians
