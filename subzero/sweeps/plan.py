"""A sweep as one value: a trial, its points, the outcomes to keep; from Python, or from a TOML file.

    trial = "fig6"                          # a name, or a path from this file's folder
    design = "sobol"                        # see `subzero.sweeps.design`
    samples = 256
    seed = 1

    [parameters]
    "start.wet_length_m" = { from = 0, to = 40 }
    "vehicle.axial_drag.*" = "declared"

    [changes]                               # holds for all members
    "run.rtol" = 0.0

    [outcomes]
    scalars = ["peak_speed_m_s", "cable_tension.max"]
    channels = ["surge_speed", "heading"]
    every_s = 0.5

A file names data only: it holds no program and starts none.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypedDict

import scenarios
from scenarios.files import Source, read_toml
from scenarios.parameters import with_parameters
from subzero.arguments import checked_arguments
from subzero.errors import DISTRIBUTION, UserError, listed, printable, short, suggestion, truth
from subzero.model import load
from subzero.simulation.provenance import code_digest, trial_digest
from subzero.sweeps.design import DISTRIBUTION_KEYS, GRID, Design, Points, points_of
from subzero.sweeps.member import Job
from subzero.sweeps.outcomes import AS_USUAL, Kept, outcomes_of

KEYS = {
    "": (
        "trial",
        "description",
        "design",
        "samples",
        "seed",
        "untethered",
        "parameters",
        "changes",
        "outcomes",
    ),
    "outcomes": ("scalars", "channels", "every_s"),
}
"""Section of a file → its keys; those of parameters and changes are names of numbers."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """A sweep, checked.

    Attributes:
        job: the data that a worker needs.
        points: which members there are.
        description: one line.
        text: of the file that says so; empty without one.
    """

    job: Job
    points: Points
    description: str
    text: str = ""

    def manifest(self) -> dict[str, str]:
        """Return all settings that could change a number, some as digests, to recognise members of the sweep."""
        return {
            "trial": trial_digest(self.job.trial),
            "parameters": json.dumps(self.points.names),
            "points": self.points.digest,
            "outcomes": self.job.outcomes.digest(),
            "tethered": str(self.job.tethered),
            "version of subzero": f"{version(DISTRIBUTION)} {self.job.code}",
        }

    @property
    def attributes(self) -> dict[str, Any]:
        """The provenance attributes of a dataset; no clock, so that two are alike to the last bit."""
        return {
            "title": self.description,
            "scenario": self.job.trial.name,
            "scenario_text": self.job.trial.text,
            "design": self.points.design,
            "seed": self.points.seed,
            "manifest": json.dumps(self.manifest(), sort_keys=True),
            "subzero_version": version(DISTRIBUTION),
        }


class Planned(TypedDict, total=False):
    """Settings of a sweep in addition to its trial and parameters, see `plan_sweep`."""

    design: Design
    changes: Mapping[str, float] | None
    kept: Kept
    tethered: bool
    description: str


@checked_arguments
def plan_sweep(
    scenario: str | Path | scenarios.Trial,
    parameters: Mapping[str, Any],
    *,
    design: Design = GRID,
    changes: Mapping[str, float] | None = None,
    kept: Kept = AS_USUAL,
    tethered: bool = True,
    description: str = "",
) -> Plan:
    """Return a sweep, checked, as `subzero.sweep` takes it.

    >>> import subzero
    >>> from subzero.sweeps import Design, Kept
    >>> lengths = {"start.wet_length_m": {"from": 0.0, "to": 40.0}}
    >>> kept = Kept(scalars=["cable_tension.max"], channels=["surge_speed"], every=0.5)
    >>> subzero.plan_sweep("fig6", lengths, design=Design(kind="sobol", samples=64), kept=kept).description
    '64 members of fig6, sobol'

    Args:
        scenario: name of a shipped scenario, path of a scenario file, or a trial.
        parameters: dotted name (`scenarios.parameters`) → a list of values, ``{"from": a, "to": b}`` with or without
            ``"count": n`` and ``"log": True``, ``{"normal": [mean, deviation]}``, or ``"declared"``, the range that the
            vehicle's or the cable's file declares; ``"vehicle.*"`` stands for all that have one.
        design: which points; every combination of the lists by default.
        changes: dotted name → value that holds for all members.
        kept: outcomes to keep of each run; the usual numbers and channels by default.
        tethered: with the cable.
        description: one line.

    Raises:
        UserError: anything in it that cannot be.
    """
    trial = scenario if isinstance(scenario, scenarios.Trial) else load(scenario)
    trial = with_parameters(trial, changes or {})
    both = sorted(set(changes or {}) & set(parameters))
    if both:
        raise UserError(f"{', '.join(both)}: in changes and in parameters too. Keep one of them.")
    points = points_of(trial, parameters, design)
    job = Job(
        trial=trial,
        names=points.names,
        outcomes=outcomes_of(kept, trial.duration),
        tethered=bool(tethered),
        code=code_digest(),
    )
    words = description or f"{len(points.values)} members of {trial.name}, {points.design.replace('_', ' ')}"
    return Plan(job=job, points=points, description=printable(words))


def read_plan(path: str | Path) -> Plan:
    """Read a sweep from a TOML file.

    Raises:
        UserError: it cannot be read, or cannot be a sweep; with the nearest valid name.
    """
    try:
        return _plan_in(read_toml(Path(path), str(path)), printable(str(path)))
    except scenarios.ScenarioError as error:
        problems = [str(problem) for problem in error.problems]
        raise UserError(listed(f"The sweep {printable(str(path))} cannot be used:", problems)) from None


def _plan_in(source: Source, name: str) -> Plan:
    """Return the sweep that a file says, which is shown by its name."""
    table = source.table
    _check_keys(name, "", table)
    for section in ("parameters", "changes", "outcomes"):
        if not isinstance(table.get(section, {}), dict):
            raise UserError(f"{name}: {section} is {short(table[section])}. Allowed: a section [{section}].")
    kept = table.get("outcomes", {})
    _check_keys(name, "outcomes", kept)
    named = table.get("trial")
    if not isinstance(named, str):
        raise UserError(
            f'{name}: it does not say which trial is swept. Add trial = "fig6", or the path of a trial file.'
        )
    try:
        plan = plan_sweep(
            source.folder / named if named.endswith(".toml") else named,  # a path is from the file's folder
            _dotted(table.get("parameters", {})),
            design=Design(
                kind=table.get("design", "grid"), samples=table.get("samples"), seed=table.get("seed", 0)
            ),
            changes=_dotted(table.get("changes", {})),
            kept=Kept(scalars=kept.get("scalars"), channels=kept.get("channels"), every=kept.get("every_s")),
            tethered=not truth("untethered", table.get("untethered", False)),
            description=str(table.get("description", "")),
        )
        return replace(plan, text=source.text)
    except scenarios.ScenarioError:
        raise
    except UserError as error:
        raise UserError(f"{name}: {error}") from error


def _check_keys(file: str, section: str, table: Mapping[str, Any]) -> None:
    for key in table:
        if key not in KEYS[section]:
            where = f"[{section}]" if section else "a sweep"
            raise UserError(
                f"{file}: {where} has no key {short(key)}.{suggestion(key, KEYS[section])}"
                f" Allowed: {', '.join(KEYS[section])}."
            )


def _dotted(table: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Return dotted names → their values, whether the quotes were left out or not."""
    found: dict[str, Any] = {}
    for key, inside in table.items():
        name = f"{above}{key}"
        is_section = isinstance(inside, Mapping) and (
            all(isinstance(each, Mapping) for each in inside.values())
            or not any(key in DISTRIBUTION_KEYS for key in inside)
        )
        if is_section:
            found |= _dotted(inside, f"{name}.")
        else:
            found[name] = inside
    return found
