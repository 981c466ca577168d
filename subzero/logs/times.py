"""Times of a log: dates, times of day, epochs, and clocks that were set back, as seconds from one start.

    t_k = (c_k − c_start) · unit,   c the clock of the log

A date without a zone is taken as UTC, for only differences count. A time of day that falls by more than half a day has
passed midnight. What cannot be known, such as fractions of a second that were not written, is refused, not made up.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np

from subzero.logs.names import CLOCK_UNITS

DATE_AND_TIME = "date and time", "date and time with a zone"
DATE, TIME_OF_DAY, MIXED = "date", "time of day", "dates with a zone and without"
DAY, YEAR = 86400.0, 3.2e7
"""[s]"""

EPOCHS = {1e17: "ns", 1e14: "us", 1e11: "ms", 1e9: "s"}
"""A time beyond this counts from 1970 in that unit, if its steps are shorter than the next."""
LONGEST_STEP_S = 3600.0

DAYS = (4e4, 6e4), (7e5, 8e5)
"""Between these lie the days that Excel counts from 1900, and MATLAB from year 0, in this century."""

STEP_LIMITS_S = 5e-3, 5.0
"""Between these lie the steps of logs, less than a factor of 1000 apart, so that a step identifies s, ms, us or ns.
[s]"""

DAY_FIRST, MONTH_FIRST, EITHER, BOTH = ", day first", ", month first", ", day or month first", ", both orders"
"""Ending of the form of dates with slashes until the whole column shows which number is the day."""

_CLOCK = re.compile(r"(?:(\d+) days?,? )?(\d{1,3}):(\d\d)(?::(\d\d(?:[.,]\d*)?))? ?([AP]M)?$")
_DATE = re.compile(
    r"(?P<Y>\d{4})[-/](?P<m>\d\d)[-/](?P<d>\d\d)$|(?P<a>\d\d?)(?P<sign>[./])(?P<b>\d\d?)[./](?P<y>\d{4})$"
)
_BOTH = re.compile(r"(\d{4}[-/]\d\d[-/]\d\d|\d\d?[./]\d\d?[./]\d{4})[T ]\s*(\d\d?:\d\d.*)$")
MONTHS = "janfebmaraprmayjunjulaugsepoctnovdec"
_WORDS = re.compile(rf"(?i)(\d\d?)[- ]({'|'.join(re.findall('...', MONTHS))})[- ](\d{{4}})(.*)$")
_ZONE = re.compile(r"(Z|[+-]\d\d:?\d*)$")


def seconds_of(cell: str) -> tuple[str, float] | None:
    """Return the form of a cell that is a date or a time, and its seconds (dates: since 1970); else None."""
    if match := _CLOCK.match(cell):
        days, hours, minutes, seconds, half = match.groups()
        hour = int(hours) % 12 + 12 * (half == "PM") if half else int(hours)
        return TIME_OF_DAY, DAY * int(days or 0) + 3600.0 * hour + 60.0 * int(minutes) + _decimal(seconds)
    if match := _DATE.match(cell):
        return _date(match)
    if match := _BOTH.match(cell):
        return _date_and_time(*match.groups())
    if match := _WORDS.match(cell):
        day, month, year, rest = match.groups()
        return seconds_of(f"{year}-{MONTHS.index(month.lower()) // 3 + 1:02}-{int(day):02}{rest}")
    found = _since_1970(cell) if "T" in cell else None  # 20261025T005950Z
    return None if found is None else (DATE_AND_TIME[bool(_ZONE.search(cell))], found)


def _decimal(seconds: str | None) -> float:
    return float((seconds or "0").replace(",", "."))


def _date(match: re.Match[str]) -> tuple[str, float] | None:
    """Return a date; of two numbers before a year with slashes the first is taken as the day if it can be."""
    year, month, day = match["Y"] or match["y"], match["m"] or match["b"], match["d"] or match["a"]
    order = ""
    if match["sign"] == "/":
        order = MONTH_FIRST if int(month) > 12 else DAY_FIRST if int(day) > 12 else EITHER
        month, day = (day, month) if order == MONTH_FIRST else (month, day)
    found = _since_1970(f"{year}-{int(month):02}-{int(day):02}")
    return None if found is None else (DATE + order, found)


def _date_and_time(date: str, clock: str) -> tuple[str, float] | None:
    found, zone = seconds_of(date), _ZONE.search(re.sub(r" ?UTC$", "Z", clock))
    time = seconds_of(re.sub(r" ?UTC$", "Z", clock)[: zone.start() if zone else None])
    offset = _since_1970(f"1970-01-01T00:00:00{zone[0]}") if zone else 0.0
    if found is None or time is None or offset is None:
        return None
    return found[0].replace(DATE, DATE_AND_TIME[zone is not None], 1), found[1] + time[1] + offset


def _since_1970(text: str) -> float | None:
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return None
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def form_of(forms: Counter[str]) -> str:
    """Return the form of a column from those of its cells; dates with a zone and without cannot be set side by side."""
    plain = Counter[str]()
    for form, count in forms.items():
        plain[form.partition(", ")[0]] += count
    orders = {form[form.index(", ") :] for form in forms if ", " in form}
    clear = orders - {EITHER}
    order = BOTH if len(clear) > 1 else (clear or orders or {""}).pop()
    is_mixed = MIXED in plain or all(form in plain for form in DATE_AND_TIME)
    return (MIXED if is_mixed else plain.most_common(1)[0][0]) + order


def in_order(values: np.ndarray, form: str) -> tuple[np.ndarray, str, str]:
    """Return times (n,) [s] whose dates with slashes are read as the whole column shows, their form, and the problem
    found.

    Dates that can be read in both ways were read with the day first; those that cannot say how all are meant. Nothing
    depends on it if all are one day.
    """
    order = form[len(form.partition(", ")[0]) :]
    form, days = form.removesuffix(order), np.floor(values / DAY)
    if order == BOTH:
        return values, form, "has dates with the day first and with the month first"
    if order == EITHER and np.unique(days[np.isfinite(days)]).size > 1:
        return values, form, "has dates of which nothing says whether the day or the month is first"
    if order == MONTH_FIRST:
        for day in np.unique(days[np.isfinite(days)]):
            read = datetime.fromtimestamp(day * DAY, UTC)
            meant = read.replace(month=read.day, day=read.month) if read.day <= 12 else read
            values = np.where(days == day, values + (meant - read).total_seconds(), values)
    return values, form, ""


def unit_by_values(clock: np.ndarray) -> list[str]:
    """Return the units that the numbers of a clock may be in: by the epoch that they count from, or by their steps."""
    known = clock[np.isfinite(clock)]
    if not known.size:
        return []
    steps = np.diff(known)
    middle = float(np.median(known))  # the first rows may be of a clock that was not set yet
    step = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    for least, unit in EPOCHS.items():
        if middle > least and step * CLOCK_UNITS[unit] < LONGEST_STEP_S:
            return [unit]
    low, high = STEP_LIMITS_S
    if _counts_in_sixties(known) and step < 40.0 and (np.abs(steps - step - 40.0) < step).any():
        return ["hhmmss"]
    if any(least < middle < most for least, most in DAYS) and low <= step * DAY <= high:
        return ["datenum"]
    return [unit for unit in ("s", "ms", "us", "ns") if low <= step * CLOCK_UNITS[unit] <= high]


def _counts_in_sixties(clock: np.ndarray) -> bool:
    """Return whether numbers can be hours, minutes and seconds in two digits each."""
    return bool(np.all((clock % 100.0 < 60.0) & (clock % 10_000.0 < 6_000.0) & (clock < 240_000.0)))


def seconds_of_digits(clock: np.ndarray) -> np.ndarray:
    """Return times (n,) that are written as hhmmss. [s]"""
    return 3600.0 * (clock // 10_000.0) + 60.0 * (clock % 10_000.0 // 100.0) + clock % 100.0


def fraction_unit(values: np.ndarray) -> str:
    """Return the unit of fractions of a second (n,) that stand in a column of their own, by the largest of them."""
    largest = np.nanmax(values, initial=0.0)
    return "ms" if largest < 1e3 else "us" if largest < 1e6 else "ns"


def over_midnight(clock: np.ndarray) -> np.ndarray:
    """Return times of day (n,) that go on counting where they fall by more than half a day. [s]"""
    known = np.flatnonzero(np.isfinite(clock))
    days = np.zeros(clock.size)
    days[known[1:]] = np.cumsum(np.diff(clock[known]) < -0.5 * DAY)
    return clock + DAY * days


def first_after_setting(time: np.ndarray) -> int:
    """Return the first row after the last step of more than a year: before it, the clock was not set. 0 if none
    is.
    """
    return int(np.flatnonzero(np.diff(time, prepend=time[:1]) > YEAR)[-1:].sum())


def problem_of(time: np.ndarray, begins: Sequence[int], stride: int = 1) -> tuple[str, str] | None:
    """Return the problem with times (n,) [s], and its remedy; None if they increase.

    Args:
        time: of the rows. [s]
        begins: rows in which the clock begins again, `parts_of`.
        stride: of so many rows of the log one is here.
    """
    steps = np.diff(time)
    same, back = np.flatnonzero(steps == 0.0), np.flatnonzero(steps < 0.0)
    if time.size < 2:
        return "it has fewer than two rows with a time", "Give a log with more."
    if 2 * back.size > steps.size:
        return "its clock runs backwards", "Say so in the map, and rows are put in order: [time] sort = true."
    if same.size > 1 and not back.size:
        why = f"{same.size} rows have the time of the row before: fractions of a second were not written"
        remedy = (
            "Export times with all digits, or say in the map how far rows are apart: [time] every_s = 0.1."
        )
        return why, remedy
    if len(begins) > 1 and back.size == len(begins) - 1:
        where = ", ".join(str(stride * at + 1) for at in begins[1:4])
        why = f"its clock begins anew at row {where}: the logger was restarted"
        return why, f"Say in the map which part is meant, 1 to {len(begins)}: [time] part = 1."
    if same.size + back.size:
        row = stride * int(np.flatnonzero(steps <= 0.0)[0] + 1) + 1
        why = f"{same.size + back.size} rows are not later than the row before, the first is row {row}"
        remedy = (
            "If rows are only out of order, say so in the map: [time] sort = true; else repair the times."
        )
        return why, remedy
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
