"""What a trial is told to do: [commands] or [motion], inline or from a CSV file that it names or is given."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path

from scenarios.csv_file import read_csv
from scenarios.errors import Problem
from scenarios.files import Source
from scenarios.quantities import START
from scenarios.samples import Samples, check_motion, check_times, inline
from scenarios.schema import LISTS, check_section

LEFT_OPEN = ("depth_m", "wet_length_m", "drum_north_m", "drum_east_m", "drum_down_m")
"""Keys of [start] that a prescribed motion leaves open; the depth unless the motion says it."""

Given = Mapping[str, str | Path]
"""``commands`` or ``motion`` → a CSV file that replaces what the trial says."""


def read_instructions(
    source: Source, given: Given, duration: float | None
) -> tuple[dict[str, Samples], list[Problem]]:
    """Read the commands or the motion of a trial.

    Args:
        source: the trial file.
        given: a file of commands that replaces those of the trial, or of a motion that replaces whatever it says.
        duration: how long the run lasts; None if that is wrong itself. [s]

    Returns:
        ``commands`` or ``motion`` → its samples; and the problems.
    """
    kinds = [kind for kind in LISTS if source.table.get(kind) not in (None, {})]
    if "motion" in given or (given and not kinds):
        kinds = list(given)
    problems = _check_kinds(source, kinds, given)
    found: dict[str, Samples] = {}
    for kind in kinds:
        samples, wrong = _read(source, kind, given)
        problems += wrong
        if kind == "motion" and "motion" not in given:
            problems += _check_start(source, samples)
        if samples:
            found[kind] = samples
            problems += check_times(samples, duration)
            problems += check_motion(samples) if kind == "motion" else []
    return found, problems


def _check_kinds(source: Source, kinds: list[str], given: Given) -> list[Problem]:
    """Return the problem that there are no instructions, or two that exclude each other."""
    if not kinds:
        why = "neither [commands] nor [motion] is given"
        return [source.problem("", why, "Give one of the two; fig6 and fig5 show how.")]
    if "commands" in given and "motion" in kinds:
        why = "a prescribed motion takes no commands"
        remedy = "Leave out the file of commands, or take a scenario with [commands]."
        return [source.problem("motion", why, remedy)]
    if len(kinds) > 1:
        return [source.problem("motion", "[commands] is given too", "Keep one of [commands] and [motion].")]
    return []


def _check_start(source: Source, samples: Samples | None) -> list[Problem]:
    """Return what [start] says beside a prescribed motion, though the motion says it already, or has no actuators."""
    start = source.table.get("start", {})
    why, remedy = "the prescribed motion says how the run starts", "Leave it out, and set it in [motion]."
    known = {quantity.name for quantity in START} | {"at_trim"}
    said = known - set(LEFT_OPEN) | {"depth_m"} & set(samples.columns if samples else ())
    given = [key for key in start if key in said] if isinstance(start, Mapping) else []
    return [source.problem(f"start.{key}", why, remedy, found=start[key]) for key in given]


def _read(source: Source, kind: str, given: Given) -> tuple[Samples | None, list[Problem]]:
    """Return the samples of a section: from the file that replaces it, the file that it names, or itself."""
    if kind in given:
        return read_csv(Path(given[kind]), str(given[kind]), kind)
    values, problems = check_section(source, kind, source.table[kind])
    asked = values.pop("interpolation", None)
    if "file" in values:
        samples, wrong = read_csv(source.folder / values["file"], values["file"], kind)
    else:
        lists = {name: values[name] for name in values if values[name] is not None}
        samples, wrong = inline(source, kind, lists)
    if samples:
        samples = dataclasses.replace(samples, interpolation=asked)
    return samples, problems + wrong
