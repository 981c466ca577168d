"""Warnings about a run that has reached its end: `CHECKS`, each a pure function of the labelled result.

A check takes a run, its trial and its model, and answers with sentences, none if all is well. A sentence says what, how
much, since when, and what to do. They stand in ``attrs["warnings"]`` of the run (`warnings_of` reads them), in
``summary.json``, on the terminal and in the footer of figures.

The first seven checks doubt the numbers (`DOUBTS`); the others say that what was asked for cannot be, or that an
equation does not hold where the run went: there is no air and no sea bed in them, and nothing breaks. A check that has
no say, such as that of the energies under the paper's scheme, which keeps no balance, is silent. Sentences that are no
doubts, but worth knowing, stand in ``attrs["notes"]`` (`NOTES`, `notes_of`).

To add a check, add a row to `CHECKS` or `NOTES`, and a test that it warns and one that it does not (`tests/validity`).
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from subzero.arguments import check_is_run, checked_arguments
from subzero.channels import AnyRun
from subzero.validity.limits import (
    above_surface,
    actuators,
    below_sea_bed,
    bend_radius,
    contradictory_numbers,
    strength,
    unstable_pitch,
)
from subzero.validity.numerics import (
    DRUM_PROOF,
    PROOF,
    closure,
    energy_residual,
    ill_posed_drum,
    is_left_open,
    only_just_fits,
    push,
    resolution,
    slack,
    slack_shape,
    starts_otherwise,
    tow_force,
)

if TYPE_CHECKING:
    import scenarios
    from subzero.channels import AnyRun
    from subzero.model import Model

    Check = Callable[[AnyRun, scenarios.Trial, Model], list[str]]


class RunWarning(NamedTuple):
    """A doubt about a run: the check that has it, and a sentence."""

    check: str
    message: str


@checked_arguments
def check_run(run: AnyRun, trial: scenarios.Trial, model: Model) -> list[RunWarning]:
    """Return everything that may be wrong with a run of a trial with a model, in the order of `CHECKS`."""
    check_is_run("check_run", run)
    return _sentences(CHECKS, run, trial, model)


@checked_arguments
def notes_on(run: AnyRun, trial: scenarios.Trial, model: Model) -> list[RunWarning]:
    """Return what else to know of a run of a trial with a model, in the order of `NOTES`."""
    check_is_run("notes_on", run)
    return _sentences(NOTES, run, trial, model)


def _sentences(
    checks: dict[str, Check], run: AnyRun, trial: scenarios.Trial, model: Model
) -> list[RunWarning]:
    return [RunWarning(name, words) for name, check in checks.items() for words in check(run, trial, model)]


class _Supposed:
    """A run with something else in its attributes."""

    def __init__(self, run: AnyRun, **attrs: str) -> None:
        # A new mapping: the attributes of the run itself are not changed.
        self._run, self.attrs = run, run.attrs | attrs

    def __getitem__(self, name: str, /) -> Any:
        """Return a variable of the run."""
        return self._run[name]


@checked_arguments
def refinement_that_settles(run: AnyRun, trial: scenarios.Trial, model: Model) -> int:
    """Return how much finer a run would have to confirm the tow force so that no doubt of a number remains.

    0 if no number is doubted, if another doubt would remain anyway, if finer runs of the start contradict it already,
    or if the run stopped. Two cases are not doubts yet, but are checked as well: a cable without a determined
    direction at its drum, and an error that is close to the allowed one.
    """
    # A finer run settles neither a run that stopped nor a start that finer runs have contradicted.
    if run.attrs["outcome"] != "completed" or starts_otherwise(run):
        return 0
    # Without a doubt, finer runs are needed in the two cases only that are not doubts yet.
    if not {warning.check for warning in warnings_of(run)}.intersection(DOUBTS):
        return PROOF if only_just_fits(run) or is_left_open(run, trial, model) else 0
    for finer in sorted({PROOF, DRUM_PROOF}):
        # Suppose that the finer run agrees: the doubts that then remain cannot be settled by it.
        proved = json.loads(run.attrs["accuracy"]) | {"force_error": 0.0, "proof_finer": finer}
        supposed = _Supposed(run, accuracy=json.dumps(proved))
        if not any(CHECKS[check](supposed, trial, model) for check in DOUBTS):
            return finer
    return 0


@checked_arguments
def warnings_of(run: AnyRun) -> tuple[RunWarning, ...]:
    """Return the warnings that a run carries in its attributes; none from a version that did not know them."""
    return _saved(run, "warnings")


@checked_arguments
def notes_of(run: AnyRun) -> tuple[RunWarning, ...]:
    """Return the notes that a run carries in its attributes; none from a version that did not know them."""
    return _saved(run, "notes")


def _saved(run: AnyRun, attribute: str) -> tuple[RunWarning, ...]:
    reported = json.loads(run.attrs.get(attribute, "[]"))
    return tuple(RunWarning(each["check"], each["message"]) for each in reported)


def as_json(warnings: list[RunWarning]) -> str:
    """Return warnings as JSON, as in the attributes of a run."""
    return json.dumps([warning._asdict() for warning in warnings], ensure_ascii=False)


CHECKS: dict[str, Check] = {
    "energy_residual": energy_residual,
    "resolution": resolution,
    "tow_force": tow_force,
    "ill_posed_drum": ill_posed_drum,
    "slack": slack,
    "closure": closure,
    "push": push,
    "contradictory_numbers": contradictory_numbers,
    "above_surface": above_surface,
    "below_sea_bed": below_sea_bed,
    "strength": strength,
    "bend_radius": bend_radius,
    "actuators": actuators,
    "unstable_pitch": unstable_pitch,
}
"""Name → check; the names are those in ``summary.json`` and in the attributes of a run."""
DOUBTS = ("energy_residual", "resolution", "tow_force", "ill_posed_drum", "slack", "closure", "push")
"""Those that doubt the numbers; the others say what happened."""
NOTES: dict[str, Check] = {"slack_shape": slack_shape}
"""Name → check; its sentences are worth knowing, and no doubts."""
