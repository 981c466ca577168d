"""What a trial is told to do: its section [commands] or [motion], inline or from a CSV file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from scenarios.csv_file import read_csv
from scenarios.errors import Problem
from scenarios.files import Source
from scenarios.samples import Samples, check_times, inline
from scenarios.schema import LISTS, check_section

SAID_BY_MOTION = ("heading_deg", "pitch_deg", "roll_deg", "surge_speed_m_s")
"""Keys of [start] that a prescribed motion leaves no room for; its roll is zero."""


def read_instructions(
    source: Source, commands_csv: str | Path | None, duration: float | None
) -> tuple[dict[str, Samples], list[Problem]]:
    """Read the commands or the motion of a trial.

    Args:
        source: the trial file.
        commands_csv: a file of commands that replaces those of the trial.
        duration: how long the run lasts; None if that is wrong itself. [s]

    Returns:
        ``commands`` or ``motion`` → its samples; and the problems.
    """
    kinds = [kind for kind in LISTS if source.table.get(kind) not in (None, {})]
    if commands_csv is not None and not kinds:
        kinds = ["commands"]
    problems = _check_kinds(source, kinds, commands_csv)
    if "motion" in kinds:
        problems += _check_start(source)
    found: dict[str, Samples] = {}
    for kind in kinds:
        samples, wrong = _read(source, kind, commands_csv)
        problems += wrong
        if samples:
            found[kind] = samples
            problems += check_times(samples, duration)
    return found, problems


def _check_kinds(source: Source, kinds: list[str], commands_csv: str | Path | None) -> list[Problem]:
    """Return the problem that there are no instructions, or two that exclude each other."""
    if not kinds:
        why = "neither [commands] nor [motion] is given"
        return [source.problem("", why, "Give one of the two; fig6 and fig5 show how.")]
    if commands_csv is not None and "motion" in kinds:
        why = "a prescribed motion takes no commands"
        remedy = "Leave out the file of commands, or take a scenario with [commands]."
        return [source.problem("motion", why, remedy)]
    if len(kinds) > 1:
        return [source.problem("motion", "[commands] is given too", "Keep one of [commands] and [motion].")]
    return []


def _check_start(source: Source) -> list[Problem]:
    """Return what [start] says beside a prescribed motion, though the motion says it already."""
    start = source.table.get("start", {})
    why, remedy = "the prescribed motion says how the run starts", "Leave it out, and set it in [motion]."
    given = [key for key in SAID_BY_MOTION if isinstance(start, Mapping) and key in start]
    return [source.problem(f"start.{key}", why, remedy, found=start[key]) for key in given]


def _read(source: Source, kind: str, commands_csv: str | Path | None) -> tuple[Samples | None, list[Problem]]:
    """Return the samples of a section: from the file that replaces it, the file that it names, or itself."""
    if kind == "commands" and commands_csv is not None:
        return read_csv(Path(commands_csv), str(commands_csv), kind)
    values, problems = check_section(source, kind, source.table[kind])
    if "file" in values:
        return read_csv(source.folder / values["file"], values["file"], kind)
    samples, wrong = inline(source, kind, values)
    return samples, problems + wrong
