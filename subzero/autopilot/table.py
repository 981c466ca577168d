"""The one table of autopilots, and of what can be fed forward, by name.

To add one of your own: a small file with a class as `flight.Autopilot` says, and a line here, or hand the object to
`fly` directly.
"""

from __future__ import annotations

from collections.abc import Callable

import scenarios
from subzero.autopilot.estimator import EstimatorLoop, estimates
from subzero.autopilot.feed_forward import CableModel, FormulaCable, NoCable, TwinCable
from subzero.autopilot.standard import StandardAutopilot
from subzero.autopilot.tuning import Tuning, tune
from subzero.errors import UserError, suggestion
from subzero.model import Model


def _pid(tuning: Tuning, sample_time: float, cable: CableModel) -> StandardAutopilot:
    return StandardAutopilot(tuning, sample_time, cable=cable, name="pid")


def _lqr(tuning: Tuning, sample_time: float, cable: CableModel) -> StandardAutopilot:
    heading = EstimatorLoop(estimates(tuning, sample_time), sample_time)
    return StandardAutopilot(tuning, sample_time, cable=cable, heading=heading, name="lqr")


AUTOPILOTS: dict[str, Callable[[Tuning, float, CableModel], StandardAutopilot]] = {"pid": _pid, "lqr": _lqr}
"""Name → what makes one, from a tuning, a sample time [s] and a cable model."""

FEED_FORWARD: dict[str, Callable[[Tuning, scenarios.Trial, float, Model], CableModel]] = {
    "none": lambda tuning, trial, sample_time, believed: NoCable(),
    "formula": lambda tuning, trial, sample_time, believed: FormulaCable(tuning, believed),
    "model": lambda tuning, trial, sample_time, believed: TwinCable(trial, sample_time, believed),
}
"""Name → what makes a cable model, from a tuning, a trial, a sample time [s] and what is believed of the model."""


def make(
    name: str,
    trial: scenarios.Trial,
    *,
    feed_forward: str = "none",
    sample_time: float = 0.1,
    tuning: Tuning | None = None,
    believed: Model | None = None,
) -> StandardAutopilot:
    """Return an autopilot by name.

    Args:
        name: one of `AUTOPILOTS`.
        trial: what it will fly.
        feed_forward: one of `FEED_FORWARD`.
        sample_time: of the controller. [s]
        tuning: gains; those of `tune` on the trial's vehicle by default.
        believed: what the autopilot believes of vehicle, cable and water; the trial's by default.

    Raises:
        UserError: there is no such autopilot or feed-forward.
    """
    for word, table, what in ((name, AUTOPILOTS, "autopilot"), (feed_forward, FEED_FORWARD, "feed-forward")):
        if word not in table:
            raise UserError(
                f"There is no {what} '{word}'.{suggestion(word, table)} Allowed: {', '.join(table)}."
            )
    believed = believed or Model.of(trial)
    tuning = tuning or tune(believed)
    return AUTOPILOTS[name](
        tuning, sample_time, FEED_FORWARD[feed_forward](tuning, trial, sample_time, believed)
    )
