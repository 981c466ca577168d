"""Read a scenario, the trial file and all files that it names, into one checked `Trial`.

Problems are collected from all files and raised together; only a trial file that cannot be read at all stops
sooner.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from math import remainder, tau
from pathlib import Path
from typing import Any, TypeVar

from scenarios.errors import Problem, ScenarioError
from scenarios.files import Source, find
from scenarios.instructions import LEFT_OPEN, read_instructions
from scenarios.parts import Part, nested, read_changes, read_part
from scenarios.quantities import START, by_field
from scenarios.samples import commands, motion
from scenarios.schema import LISTS, check_page, check_section
from scenarios.steps import check_steps
from scenarios.surroundings import check_scheme, read_surroundings
from scenarios.trial import FOUND_BY_TRIM, FOUND_WHY, TRIM_NEEDS_SPEED, Motion, Start, Trial
from subzero.errors import printable

Found = TypeVar("Found")

VehicleCheck = Callable[[Mapping[str, Any]], Iterable[Any]]
"""Takes the numbers of a vehicle; gives complaints with the attributes key, found, why, allowed."""


@dataclass(frozen=True, kw_only=True)
class Reading:
    """A trial file while it is read: what it says, and what is wrong so far."""

    source: Source
    problems: list[Problem] = field(default_factory=list)

    def keep(self, result: tuple[Found, list[Problem]]) -> Found:
        """Note the problems of a result, and return the rest of it."""
        self.problems.extend(result[1])
        return result[0]

    def section(self, name: str) -> dict[str, Any]:
        """Return a section, checked number by number; empty if there is a problem."""
        return self.keep(check_section(self.source, name, self.source.table.get(name, {})))


def load(
    name_or_path: str | Path,
    *,
    commands_csv: str | Path | None = None,
    motion_csv: str | Path | None = None,
    check_vehicle: VehicleCheck | None = None,
) -> Trial:
    """Return a shipped or a user's scenario, checked.

    Args:
        name_or_path: a name of `names`, or the path of a TOML file.
        commands_csv: a CSV file of commands that replaces those of the scenario.
        motion_csv: a CSV file of a motion that replaces the commands or the motion of the scenario, and what its start
            says besides the cable.
        check_vehicle: takes the numbers of the vehicle and gives what its own equations find wrong with them,
            as objects with the attributes key, found, why, allowed. (This package knows no vehicle.)

    Raises:
        ScenarioError: with every problem of every file.
    """
    reading = Reading(source=find(name_or_path))
    reading.problems.extend(check_page(reading.source))
    run, start = (reading.section(name) for name in ("run", "start"))
    reading.problems.extend(check_steps(reading.source, run, start))
    around = reading.keep(read_surroundings(reading.source))
    vehicle, cable = _parts(reading, check_vehicle)
    reading.problems.extend(check_scheme(reading.source, run, cable.get("cable", {})))
    given = {
        kind: path for kind, path in zip(LISTS, (commands_csv, motion_csv), strict=True) if path is not None
    }
    samples = reading.keep(read_instructions(reading.source, given, run.get("duration_s")))
    if "motion" not in samples:
        reading.problems.extend(check_trim(reading.source, start))
    if reading.problems:
        raise ScenarioError(_in_order(reading.problems))
    prescribed = motion(samples["motion"]) if "motion" in samples else None
    return Trial(
        name=printable(Path(name_or_path).stem),
        description=reading.source.table["description"],
        text=reading.source.text,
        source=printable(str(name_or_path)),
        duration=run["duration_s"],
        hull_step=run["hull_step_s"],
        cable_step=run["cable_step_s"],
        segment_length=run["segment_length_m"],
        grading=run["grading"],
        rtol=run["rtol"],
        scheme=run["scheme"],
        start=_start(start, prescribed),
        vehicle=vehicle,
        cable=cable["cable"],
        drum=cable["drum"],
        **around,
        commands=commands(samples["commands"]) if "commands" in samples else None,
        motion=prescribed,
    )


def _in_order(problems: list[Problem]) -> list[Problem]:
    """Sort problems by line within each file; files stay in the order in which they were read."""
    files = list(dict.fromkeys(problem.file for problem in problems))
    return sorted(problems, key=lambda problem: (files.index(problem.file), problem.line or 0))


def _part(reading: Reading, kind: str) -> Part:
    """Return the vehicle or the cable that the trial names, as far as it is good."""
    named = reading.source.table.get(kind)
    if not isinstance(named, str):
        return Part()  # `check_page` has said so
    return reading.keep(read_part(reading.source, kind, named))


def _parts(reading: Reading, check: VehicleCheck | None) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the numbers of the vehicle, and those of cable and drum, with the changes of the trial."""
    part, cable = (_part(reading, kind) for kind in ("vehicle", "cable"))
    changes = reading.keep(read_changes(reading.source))
    of_vehicle = {
        key.removeprefix("vehicle."): value for key, value in changes.items() if key.startswith("vehicle.")
    }
    of_cable = {key: value for key, value in changes.items() if not key.startswith("vehicle.")}
    vehicle = nested({**part.values, **of_vehicle})
    if check and part.complete:
        reading.problems.extend(_complaint(reading, part, of_vehicle, said) for said in check(vehicle))
    return vehicle, nested({**cable.values, **of_cable})


def _complaint(reading: Reading, part: Part, changed: Mapping[str, float], said: Any) -> Problem:
    """Return a complaint of the vehicle as a problem of the file that holds the number."""
    source, key = part.source or reading.source, said.key
    if key in changed:
        source, key = reading.source, f"changes.vehicle.{key}"
    remedy = f"Allowed: {said.allowed}."
    line = source.line(key)
    return Problem(file=source.name, line=line, key=key, found=said.found, why=said.why, remedy=remedy)


def check_trim(source: Source, start: Mapping[str, Any]) -> list[Problem]:
    """Return what [start] says beside at_trim, though that finds it, or does not say, though that needs it."""
    table = source.table.get("start", {})
    if not start.get("at_trim", False) or not isinstance(table, Mapping):
        return []
    names = [by_field(START)[name].name for name in FOUND_BY_TRIM]
    problems = [
        source.problem(f"start.{name}", FOUND_WHY, "Leave it out.", found=table[name])
        for name in names
        if name in table
    ]
    speed = start.get("surge_speed_m_s", 1.0)
    if not speed > 0.0:
        problems.append(
            source.problem("start.surge_speed_m_s", TRIM_NEEDS_SPEED, "Above 0 m/s.", found=speed)
        )
    return problems


def _start(start: Mapping[str, Any], prescribed: Motion | None) -> Start:
    """Return the start; a prescribed motion starts where it says."""
    fields = {name: start[quantity.name] * quantity.scale for name, quantity in by_field(START).items()}
    if prescribed is None:
        return Start(**fields, at_trim=start["at_trim"])
    left_open = {name: value for name, value in fields.items() if by_field(START)[name].name in LEFT_OPEN}
    said = {name: float(getattr(prescribed, name)[0]) for name in prescribed.given if name in fields}
    for angle in ("heading", "roll"):
        said[angle] = remainder(said.get(angle, 0.0), tau)
    return Start(**left_open | said)
