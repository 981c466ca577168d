"""Time steps: the one grid of a run, which sample holds at a time, and whether steps and lengths fit one another.

>>> run_times(1.0, 0.3).tolist()              # of a run: whole cable steps, and a last one that ends it
[0.0, 0.3, 0.6, 0.8999999999999999, 1.0]
>>> even_times(1.0, 0.3).tolist()             # even, to the end or beyond
[0.0, 0.3, 0.6, 0.8999999999999999, 1.2]
>>> sample_times(1.0, 0.3).tolist()           # of a sensor: even, as far as the end
[0.0, 0.3, 0.6, 0.8999999999999999]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

MOST_STEPS = 10_000_000
"""A run of more hull steps than this is a slip of the pen: it takes minutes to hours, and gigabytes."""

MOST_SEGMENTS = 100_000
"""A cable of more segments than this at the start is one too."""

TOLERANCE = 1e-9
"""Ratios of decimal fractions are whole numbers to within this, relatively."""

JUST_BEFORE_S = 1e-9
"""A sample holds from this much before its time on: grids of decimal fractions meet only to rounding. [s]"""

SHORTEST_LAST_STEP = 0.1
"""Where a run does not last a whole number of steps, its last step is from this to this and 1 of them. [-]"""

END_TOLERANCE = 1e-6
"""An even grid may miss the end of a run by this, in steps and in seconds. [-], [s]"""

Numbers = Mapping[str, float]
"""Fields of a trial and its start → value, as far as they are good by themselves."""


class Misfit(NamedTuple):
    """A number that does not fit the others: its field, the value, the reason, and the remedy."""

    field: str
    found: float
    why: str
    remedy: str


def misfits(numbers: Numbers, words: Mapping[str, str] | None = None) -> list[Misfit]:
    """Return the inconsistencies; `words` gives the names of the fields in messages."""
    words = words or {name: name for name in numbers}
    checks = {
        ("cable_step", "hull_step"): _not_whole,
        ("hull_step", "duration"): _endless,
        ("segment_length", "wet_length"): _countless,
    }
    if numbers.get("every", 0.0) > 0.0:
        checks["every", "cable_step"] = _not_whole
    known = [(names, check) for names, check in checks.items() if set(names) <= set(numbers)]
    found = [check(*names, numbers, words) for names, check in known]
    return [misfit for misfit in found if misfit]


def whole_steps(step: float, count: int) -> np.ndarray:
    """Return the times 0, h, 2h, … (count,). [s]."""
    return step * np.arange(count)


def run_times(duration: float, step: float) -> np.ndarray:
    """Return the times of a run's results (n,): whole steps from 0, and a last step that ends the run. [s]."""
    steps = duration / step
    whole = max(round(steps), 1)
    if abs(steps - whole) <= TOLERANCE * steps:
        return np.linspace(0.0, duration, whole + 1)
    full = max(int(steps - SHORTEST_LAST_STEP), 0)
    return np.append(whole_steps(step, full + 1), duration)


def even_times(duration: float, step: float) -> np.ndarray:
    """Return times that are evenly spaced by a step (n,), to the end of a run, or just beyond if it is not whole. [s].

    A microsecond more or less is rounding: the grid then ends with the run.
    """
    count = max(1, math.ceil(duration / step - END_TOLERANCE))
    end = duration if abs(count * step - duration) < END_TOLERANCE else count * step
    return np.linspace(0.0, end, count + 1)


def sample_times(duration: float, interval: float) -> np.ndarray:
    """Return the times at which a sensor is read (n,): 0 and whole intervals, none later than the end. [s]."""
    return np.arange(0.0, duration + JUST_BEFORE_S, interval)


def holding_rows(time: np.ndarray, at: np.ndarray | float) -> np.ndarray:
    """Return which sample holds at some times: the last that is not later; before the first one, the first.

    Args:
        time: of the samples, increasing (samples,). [s]
        at: times of any shape. [s]
    """
    return np.clip(np.searchsorted(time, np.asarray(at) + JUST_BEFORE_S, side="right") - 1, 0, None)


def held(time: np.ndarray, values: np.ndarray, at: np.ndarray | float) -> np.ndarray:
    """Return the values that hold at some times, sample and hold; what `Commands.at` is for commands.

    >>> held(np.array([0.0, 2.0]), np.array([5.0, 7.0]), np.array([-1.0, 1.9, 2.0, 50.0])).tolist()
    [5.0, 5.0, 7.0, 7.0]

    Args:
        time: of the samples, increasing (samples,). [s]
        values: one row a sample (samples, …).
        at: times of any shape. [s]

    Returns:
        shape of `at`, then that of a row.
    """
    found: np.ndarray = np.asarray(values, dtype=float)[holding_rows(time, at)]
    return found


def fitting_step(span: float, longest: float) -> float:
    """Return the largest step, no longer than `longest`, of which a span is a whole number. [s]."""
    return span / max(1, math.ceil(span / longest - TOLERANCE))


def _not_whole(name: str, step_name: str, numbers: Numbers, words: Mapping[str, str]) -> Misfit | None:
    """Return that a time is not a whole number of steps, with the nearest that are."""
    value, step = numbers[name], numbers[step_name]
    ratio = value / step
    if ratio > 0.5 and abs(ratio - round(ratio)) <= TOLERANCE * ratio:
        return None
    below, above = int(ratio) * step, (int(ratio) + 1) * step
    near = f"{below:.9g} or {above:.9g}" if below > 0.0 else f"{above:.9g}"
    why = f"it must be a whole number of steps {words[step_name]} = {step:g}"
    return Misfit(name, value, why, f"Nearest: {near}.")


def _endless(name: str, duration_name: str, numbers: Numbers, words: Mapping[str, str]) -> Misfit | None:
    """Return that a run has far too many steps."""
    step, duration = numbers[name], numbers[duration_name]
    if duration / step <= MOST_STEPS:
        return None
    why = f"a run of {duration:g} s would take {duration / step:.3g} steps, more than {MOST_STEPS:g}"
    return Misfit(name, step, why, f"At least {duration / MOST_STEPS:.3g} s.")


def _countless(name: str, length_name: str, numbers: Numbers, words: Mapping[str, str]) -> Misfit | None:
    """Return that the cable in the water at the start has far too many segments."""
    segment, length = numbers[name], numbers[length_name]
    if length <= MOST_SEGMENTS * segment:
        return None
    why = f"a cable of {length:g} m at the start would have more than {MOST_SEGMENTS} segments"
    return Misfit(name, segment, why, f"At least {length / MOST_SEGMENTS:g} m.")
