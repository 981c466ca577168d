"""Times of a log: dates, times of day, epochs, and clocks that were set back, as seconds from one start.

    t_k = (c_k − c_start) · unit,   c the clock of the log

A date without a zone is taken as UTC, for only differences count. A time of day that falls by more than half a day has
passed midnight. What cannot be known, such as fractions of a second that were not written, is refused, not made up.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np

from subzero.logs.names import CLOCK_UNITS

DATE_AND_TIME = "date and time", "date and time with a zone"
DATE, TIME_OF_DAY, MIXED = "date", "time of day", "dates with a zone and without"
DAY = 86400.0
"""[s]"""

EPOCHS = {1e17: "ns", 1e14: "us", 1e11: "ms", 1e9: "s"}
"""A first time beyond this counts from 1970 in that unit."""

STEP_LIMITS_S = 5e-3, 5.0
"""Between these lie the steps of logs, less than a factor of 1000 apart, so that a step tells s, ms, us and ns. [s]"""

_CLOCK = re.compile(r"(?:(\d+) days?,? )?(\d{1,3}):(\d\d)(?::(\d\d(?:[.,]\d*)?))?$")
_DATE = re.compile(r"(\d{4})[-/](\d\d)[-/](\d\d)$|(\d\d)\.(\d\d)\.(\d{4})$")
_BOTH = re.compile(r"(\d{4}[-/]\d\d[-/]\d\d|\d\d\.\d\d\.\d{4})[T ]\s*(\d\d:\d\d.*)$")


def seconds_of(cell: str) -> tuple[str, float] | None:
    """Return the form of a cell that is a date or a time, and its seconds (dates: since 1970); else None."""
    if ":" in cell:
        if match := _CLOCK.match(cell):
            days, hours, minutes, seconds = match.groups()
            rest = float((seconds or "0").replace(",", "."))
            return TIME_OF_DAY, DAY * int(days or 0) + 3600.0 * int(hours) + 60.0 * int(minutes) + rest
        return _date_and_time(cell)
    if match := _DATE.match(cell):
        a, b, c, day, month, year = match.groups()
        return _since_1970(DATE, f"{a or year}-{b or month}-{c or day}")
    return None


def _date_and_time(cell: str) -> tuple[str, float] | None:
    match = _BOTH.match(cell)
    date = seconds_of(match.group(1)) if match else None
    if match is None or date is None:
        return None
    clock = re.sub(r" ?UTC$", "Z", match.group(2))
    found = _since_1970("", f"{datetime.fromtimestamp(date[1], UTC):%Y-%m-%d}T{clock}")
    return found and (DATE_AND_TIME[bool(re.search(r"(Z|[+-]\d\d:?\d*)$", clock))], found[1])


def _since_1970(form: str, text: str) -> tuple[str, float] | None:
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return None
    return form, (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def unit_by_values(clock: np.ndarray) -> list[str]:
    """Return the units that the numbers of a clock may be in: by the epoch that they count from, or by their steps."""
    known = clock[np.isfinite(clock)]
    if not known.size:
        return []
    for least, unit in EPOCHS.items():
        if known[0] > least:
            return [unit]
    steps = np.diff(known)
    step = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    low, high = STEP_LIMITS_S
    return [unit for unit in ("s", "ms", "us", "ns") if low <= step * CLOCK_UNITS[unit] <= high]


def over_midnight(clock: np.ndarray) -> np.ndarray:
    """Return times of day (n,) that go on counting where they fall by more than half a day. [s]"""
    known = np.flatnonzero(np.isfinite(clock))
    days = np.zeros(clock.size)
    days[known[1:]] = np.cumsum(np.diff(clock[known]) < -0.5 * DAY)
    return clock + DAY * days


def is_epoch(clock: np.ndarray) -> bool:
    """Say whether a clock counts from 1970."""
    return bool(clock[np.isfinite(clock)][0] > min(EPOCHS))


def problem_of(time: np.ndarray, begins: Sequence[int]) -> tuple[str, str] | None:
    """Return what is wrong with times (n,) [s], and what to do; None if they increase.

    Args:
        time: of the rows. [s]
        begins: rows in which the clock begins anew, `parts_of`.
    """
    steps = np.diff(time)
    same, back = np.flatnonzero(steps == 0.0), np.flatnonzero(steps < 0.0)
    if time.size < 2:
        return "it has fewer than two rows with a time", "Give a log with more."
    if same.size > 1 and not back.size:
        why = f"{same.size} rows have the time of the row before: fractions of a second were not written"
        return (
            why,
            "Export times with all digits, or say in the map how far rows are apart: [time] every_s = 0.1.",
        )
    if len(begins) > 1 and back.size == len(begins) - 1:
        where = ", ".join(str(at + 1) for at in begins[1:4])
        why = f"its clock begins anew at row {where}: the logger was restarted"
        return why, f"Say in the map which part is meant, 1 to {len(begins)}: [time] part = 1."
    if same.size + back.size:
        row = int(np.flatnonzero(steps <= 0.0)[0]) + 2
        why = f"{same.size + back.size} rows are not later than the row before, the first is row {row}"
        return (
            why,
            "If rows are only out of order, say so in the map: [time] sort = true; else repair the times.",
        )
    return None


def parts_of(time: np.ndarray) -> list[int]:
    """Return where the parts of a clock begin that was restarted: the first row, and those that fall back behind half
    of what has passed since the part began.
    """
    begins = [0]
    for at in np.flatnonzero(np.diff(time) < 0.0) + 1:
        passed = time[at - 1] - time[begins[-1]]
        if time[at - 1] - time[at] > 0.5 * passed:
            begins.append(int(at))
    return begins


def start_of(value: object) -> float | None:
    """Return the time of a log that is t = 0, as the map gives it: a number, or a text as a log writes it."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    found = seconds_of(str(value).strip())
    return found[1] if found else None
