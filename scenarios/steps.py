"""Checks of time steps and lengths against one another: they must fit, and the run must end in a lifetime."""

from __future__ import annotations

from collections.abc import Mapping

from scenarios.errors import Problem
from scenarios.files import Source

MOST_STEPS = 10_000_000
"""A run of more hull steps than this is a slip of the pen: it takes minutes to hours, and gigabytes."""

MOST_SEGMENTS = 100_000
"""A cable of more segments than this at the start is one too."""

TOLERANCE = 1e-9
"""Ratios of decimal fractions are whole numbers to within this, relatively."""


def check_steps(source: Source, run: Mapping[str, float], start: Mapping[str, float]) -> list[Problem]:
    """Return what does not fit in [run] and [start], as far as their numbers are good by themselves.

    Args:
        source: the trial file, for the lines in messages.
        run: numbers of the section [run], without those that are wrong.
        start: numbers of the section [start], likewise.
    """
    numbers = {**run, **start}

    def known(*names: str) -> bool:
        return all(name in numbers for name in names)

    problems = []
    for name, step in (("cable_step_s", "hull_step_s"), ("duration_s", "cable_step_s")):
        if known(name, step):
            problems += _whole(source, name, numbers[name], step, numbers[step])
    if known("duration_s", "hull_step_s"):
        problems += _not_endless(source, numbers["duration_s"], numbers["hull_step_s"])
    if known("wet_length_m", "segment_length_m"):
        problems += _not_countless(source, numbers["wet_length_m"], numbers["segment_length_m"])
    return problems


def _whole(source: Source, name: str, value: float, step_name: str, step: float) -> list[Problem]:
    """Return the problem that a time is not a whole number of steps, with the nearest that are."""
    ratio = value / step
    if abs(ratio - round(ratio)) <= TOLERANCE * ratio:
        return []
    below, above = int(ratio) * step, (int(ratio) + 1) * step
    near = f"{below:.9g} or {above:.9g}" if below > 0.0 else f"{above:.9g}"
    why = f"it must be a whole number of steps {step_name} = {step:g}"
    return [source.problem(f"run.{name}", why, f"Nearest: {near}.", found=value)]


def _not_endless(source: Source, duration: float, step: float) -> list[Problem]:
    """Return the problem that a run has far too many steps."""
    if duration / step <= MOST_STEPS:
        return []
    why = f"a run of {duration:g} s would take {duration / step:.3g} steps, more than {MOST_STEPS:g}"
    return [source.problem("run.hull_step_s", why, f"At least {duration / MOST_STEPS:.3g} s.", found=step)]


def _not_countless(source: Source, length: float, segment: float) -> list[Problem]:
    """Return the problem that the cable in the water at the start has far too many segments."""
    if length <= MOST_SEGMENTS * segment:
        return []
    why = f"a cable of {length:g} m at the start would have more than {MOST_SEGMENTS} segments"
    key, remedy = "run.segment_length_m", f"At least {length / MOST_SEGMENTS:g} m."
    return [source.problem(key, why, remedy, found=segment)]
