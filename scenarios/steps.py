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
    """Return what does not fit in the sections [run] and [start], each checked by itself before."""
    problems = []
    if run:
        problems += _whole(source, "cable_step_s", run["cable_step_s"], "hull_step_s", run["hull_step_s"])
        problems += _whole(source, "duration_s", run["duration_s"], "cable_step_s", run["cable_step_s"])
        problems += _not_endless(source, run["duration_s"], run["hull_step_s"])
    if run and start and start["wet_length_m"] > MOST_SEGMENTS * run["segment_length_m"]:
        why = f"the cable at the start would have more than {MOST_SEGMENTS} segments"
        remedy = f"At least {start['wet_length_m'] / MOST_SEGMENTS:g} m."
        key = "run.segment_length_m"
        problems.append(source.problem(key, why, remedy, found=run["segment_length_m"]))
    return problems


def _whole(source: Source, name: str, value: float, step_name: str, step: float) -> list[Problem]:
    """Return the problem that a time is not a whole number of steps, with the nearest that are."""
    ratio = value / step
    if round(ratio) >= 1 and abs(ratio - round(ratio)) <= TOLERANCE * ratio:
        return []
    below, above = int(ratio) * step, (int(ratio) + 1) * step
    nearest = f"{below:.6g} or {above:.6g}" if below > 0.0 else f"{above:.6g}"
    why = f"it must be a whole number of steps {step_name} = {step:g}"
    return [source.problem(f"run.{name}", why, f"Nearest: {nearest}.", found=value)]


def _not_endless(source: Source, duration: float, step: float) -> list[Problem]:
    """Return the problem that a run has far too many steps."""
    if duration / step <= MOST_STEPS:
        return []
    why = f"a run of {duration:g} s would take {duration / step:.3g} steps, more than {MOST_STEPS:g}"
    return [source.problem("run.hull_step_s", why, f"At least {duration / MOST_STEPS:.3g} s.", found=step)]
