"""The one table of autopilots, and of what can be fed forward, by name.

To add one of your own: a small file with a class as `flight.Autopilot` says, and a line here; or hand the object to
`fly`; or give the path of the file as the name (`user_autopilot`), on the command line too.
"""

from __future__ import annotations

from collections.abc import Callable

import scenarios
from subzero.autopilot.estimator import EstimatorLoop, estimates
from subzero.autopilot.feed_forward import CableModel, FormulaCable, NoCable, TwinCable
from subzero.autopilot.flight import Autopilot
from subzero.autopilot.stability_margins import check_stable
from subzero.autopilot.standard import StandardAutopilot
from subzero.autopilot.tuning import Tuning, tune
from subzero.autopilot.user_autopilot import Build, built, from_file
from subzero.errors import UserError, chosen, real, short
from subzero.model import Model, model_of


def _pid(tuning: Tuning, sample_time: float, cable: CableModel) -> StandardAutopilot:
    check_stable(tuning, sample_time)
    return StandardAutopilot(tuning, sample_time, cable=cable, name="pid")


def _lqr(tuning: Tuning, sample_time: float, cable: CableModel) -> StandardAutopilot:
    matrices = estimates(tuning, sample_time)
    check_stable(tuning, sample_time, matrices)
    heading = EstimatorLoop(matrices, sample_time)
    return StandardAutopilot(tuning, sample_time, cable=cable, heading=heading, name="lqr")


LONGEST_SAMPLE_S = 60.0
"""A controller that sleeps longer holds nothing. [s]"""

AUTOPILOTS: dict[str, Build] = {"pid": _pid, "lqr": _lqr}
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
) -> Autopilot:
    """Return an autopilot by name.

    Args:
        name: one of `AUTOPILOTS`, or the path of a Python file with one (`user_autopilot`).
        trial: what it will fly.
        feed_forward: one of `FEED_FORWARD`.
        sample_time: of the controller. [s]
        tuning: gains; those of `tune` on the trial's vehicle by default.
        believed: what the autopilot believes of vehicle, cable and water; the trial's by default.

    Raises:
        UserError: there is no such autopilot or feed-forward; a sample time of nothing; with these gains and this
            sample time the hull is unstable.
    """
    time = real(sample_time)
    if time is None or not 0.0 < time <= LONGEST_SAMPLE_S:
        raise UserError(
            f"make: the sample time is {short(sample_time)}. Allowed: a time above 0 s, up to {LONGEST_SAMPLE_S:g} s."
        )
    is_path = isinstance(name, str) and name.endswith(".py")
    build = from_file(name) if is_path else chosen(AUTOPILOTS, name, "autopilot")
    cable = chosen(FEED_FORWARD, feed_forward, "feed-forward")
    believed = model_of(trial, believed)
    tuning = tuning or tune(believed)
    ahead = cable(tuning, trial, time, believed)
    return built(name, build, tuning, time, ahead) if is_path else build(tuning, time, ahead)
