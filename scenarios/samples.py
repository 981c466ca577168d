"""Commands and prescribed motions: columns of numbers over time, inline in the trial file or in a CSV file.

Inline lists are *switch points*: the last value holds to the end of the run. The rows of a CSV file are
*samples of a log*: a row holds until the next, and the last for one sampling interval more, at most
`LONGEST_HOLD`. A log that ends before the run does is refused, because what was commanded after it is not
known. A smooth motion is known only as far as its last sample, and not where samples are missing, inline or not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from scenarios.errors import Problem
from scenarios.files import Source
from scenarios.motion import (
    REACH_THE_END,
    SMOOTH,
    Motion,
    ends_early,
    gap_at,
    gap_words,
    interpolation_of,
    motion_faults,
)  # fmt: skip
from scenarios.quantities import COMMANDS, MOTION, Quantity, by_field
from scenarios.trial import Commands
from subzero.errors import short as shown

LONGEST_HOLD = 1.0
"""The last row of a log is believed for no longer than this: a vehicle turns by tens of degrees in it. [s]"""

NUMERICAL = 1e-9
"""Times that differ by less than this are the same: decimal fractions are not exact in binary. [s]"""


@dataclass(frozen=True, kw_only=True)
class Samples:
    """Columns of numbers as they stand in a file, each number checked by itself.

    Attributes:
        file: the file as the user named it.
        key: what messages call the column of times.
        columns: column → values, in the units of the file.
        lines: the line of each sample in a CSV file; None in an inline list, where `key_line` is meant.
        key_line: line of the list of times in a trial file.
        interpolation: what a motion asks for, see `Motion`.
    """

    file: str
    key: str
    columns: Mapping[str, Sequence[float]]
    lines: Sequence[int] | None = None
    key_line: int | None = None
    interpolation: str | None = None

    @property
    def is_smooth(self) -> bool:
        """Whether these are the samples of a motion that is smooth between them."""
        given = [name for name, q in by_field(MOTION).items() if q.name in self.columns]
        is_motion = "surge_speed" in given
        return is_motion and interpolation_of(given, self.interpolation) == SMOOTH

    @property
    def time(self) -> Sequence[float]:
        """The times of the samples. [s]"""
        return self.columns["time_s"]

    def problem(self, at: int, why: str, remedy: str) -> Problem:
        """Return a problem with the time of sample `at`."""
        line = self.lines[at] if self.lines else self.key_line
        key = self.key if self.lines else f"{self.key}[{at}]"
        return Problem(file=self.file, line=line, key=key, found=shown(self.time[at]), why=why, remedy=remedy)


def inline(
    source: Source, section: str, columns: Mapping[str, list[float]]
) -> tuple[Samples | None, list[Problem]]:
    """Return the lists of a section as samples, None if there are no times; and those of a wrong length."""
    key = f"{section}.time_s"
    if "time_s" not in columns:
        return None, []
    count = len(columns["time_s"])
    remedy = "Give one value for each time."
    problems = [
        source.problem(
            f"{section}.{name}", f"this list has {len(values)} and time_s has {count} values", remedy
        )
        for name, values in columns.items()
        if len(values) != count
    ]
    return Samples(file=source.name, key=key, columns=columns, key_line=source.line(key)), problems


def check_times(samples: Samples, duration: float | None) -> list[Problem]:
    """Return the problems of the times: they start at 0, increase, and a log lasts as long as the run.

    Args:
        samples: what was read.
        duration: how long the run lasts; None if that is not known, because it is wrong itself. [s]
    """
    time = samples.time
    problems = []
    if time[0] != 0.0:
        why = "what holds from 0 s until then is not said"
        problems.append(samples.problem(0, why, "The first time must be 0."))
    for at, (before, now) in enumerate(pairwise(time), start=1):
        if not now > before:
            why = f"the time before it is {before:g}"
            problems.append(samples.problem(at, why, "Times must increase from sample to sample."))
    if not problems and samples.is_smooth:
        return _check_smooth(samples, duration)
    if not problems and samples.lines and duration is not None:
        problems += _check_end(samples, duration)
    return problems


def check_motion(samples: Samples) -> list[Problem]:
    """Return what does not fit in the columns of a motion, each by itself right."""
    names = {name: quantity.name for name, quantity in by_field(MOTION).items()}
    given = [name for name, column in names.items() if column in samples.columns]
    section = "" if samples.lines else "motion."
    return [
        Problem(
            file=samples.file, line=samples.key_line, key=f"{section}{names.get(name, name)}", why=why, remedy=remedy
        )
        for name, why, remedy in motion_faults(given, samples.interpolation)
    ]  # fmt: skip


def _check_smooth(samples: Samples, duration: float | None) -> list[Problem]:
    """Return what is not known of a smooth motion: a gap, and what comes behind its last sample."""
    time = np.asarray(samples.time, dtype=float)
    at = gap_at(time)
    problems = [] if at is None else [samples.problem(at, *gap_words(time, at))]
    if duration is not None and time[-1] < duration - NUMERICAL:
        problems.append(samples.problem(time.size - 1, ends_early(duration), REACH_THE_END))
    return problems


def _check_end(samples: Samples, duration: float) -> list[Problem]:
    """Return the problem that a log ends before the run does."""
    last = samples.time[-1]
    interval = last - samples.time[-2] if len(samples.time) > 1 else 0.0
    if last + min(interval, LONGEST_HOLD) >= duration - NUMERICAL:
        return []
    why = f"the file ends early: the run lasts {duration:g} s"
    shorter = f", or set duration_s to {last:g}" if last > 0.0 else ""
    remedy = f"Add rows up to {duration:g} s{shorter}."
    return [samples.problem(len(samples.time) - 1, why, remedy)]


def commands(samples: Samples) -> Commands:
    """Return checked samples as commands: rev/s and radians."""
    time, *values = (_inner(samples, quantity) for quantity in COMMANDS)
    return Commands(time=time, values=np.ascontiguousarray(np.column_stack(values)))


def motion(samples: Samples) -> Motion:
    """Return checked samples as a prescribed motion: m/s and radians. A compass in a log may jump by whole turns."""
    given = {name: _inner(samples, q) for name, q in by_field(MOTION).items() if q.name in samples.columns}
    if samples.lines:
        given["heading"] = np.unwrap(given["heading"])
    return Motion(**given, interpolation=samples.interpolation)


def _inner(samples: Samples, quantity: Quantity) -> np.ndarray:
    """Return one column in inner units."""
    return np.asarray(samples.columns[quantity.name], dtype=float) * quantity.scale
