"""Steps of what an autopilot has to hold, and how well it does: heading, depth, speed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import radians
from typing import TYPE_CHECKING

import scenarios
from subzero.autopilot.flight import Autopilot, fly
from subzero.autopilot.indices import step_response
from subzero.autopilot.registry import make
from subzero.autopilot.sensors import PERFECT, Sensor, Sensors
from subzero.autopilot.standard import Wanted
from subzero.autopilot.tuning import Tuning
from subzero.errors import UserError, checked, chosen, real, short
from subzero.model import Model, load
from subzero.simulation.refinement import Progress
from subzero.steady_motion.trim import trim

if TYPE_CHECKING:
    from collections.abc import Sequence

    import xarray as xr

STEP_AT, DURATION = 15.0, 60.0
"""When the step comes, and how long a run lasts. [s]"""


@dataclass(frozen=True, kw_only=True)
class Step:
    """A row of the table of steps: the field that is stepped, its channel, the size of the step (in the unit of the
    channel), the internal unit per unit of the channel, and the ending of the name of an index in that unit.
    """

    field: str
    channel: str
    size: float
    scale: float
    ending: str


STEPS = {
    "heading_step": Step(field="heading", channel="heading", size=10.0, scale=radians(1.0), ending="_deg"),
    "depth_step": Step(field="depth", channel="depth", size=1.0, scale=1.0, ending="_m"),
    "speed_step": Step(field="speed", channel="surge_speed", size=0.2, scale=1.0, ending="_m_s"),
}
"""Step by name: degrees, m, m/s."""


@dataclass(frozen=True, kw_only=True)
class Pilot:
    """The autopilot that flies a step, and its model of the plant.

    Attributes:
        autopilot: one of `AUTOPILOTS`, or the path of a Python file with one.
        feed_forward: one of `FEED_FORWARD`: the model of the cable that is fed forward.
        tuning: gains; those of `tune` on the assumed model by default.
        believed: the assumed vehicle, cable and water; the scenario's by default, which is the true model.
        sensors: sensors that the autopilot reads; `Sensors` have a seed.
    """

    autopilot: str = "pid"
    feed_forward: str = "none"
    tuning: Tuning | None = None
    believed: Model | None = None
    sensors: Sensors | Sequence[Sensor] = PERFECT

    def made(self, trial: scenarios.Trial) -> Autopilot:
        """Return the autopilot for a trial, with a sample for each cable step."""
        return make(
            self.autopilot,
            trial,
            feed_forward=self.feed_forward,
            sample_time=trial.cable_step,
            tuning=self.tuning,
            believed=self.believed,
        )


PID = Pilot()


def step(
    name: str,
    scenario: str | scenarios.Trial = "fig6",
    *,
    pilot: Pilot = PID,
    size: float | None = None,
    speed: float = 1.0,
    tethered: bool = True,
    progress: Progress | None = None,
) -> tuple[xr.Dataset, dict[str, float]]:
    """Return the run of a step and its indices: rise, overshoot, settling, steady error (units in their names).

    Args:
        name: one of `STEPS`.
        scenario: whose vehicle, cable and start; its commands are not used.
        pilot: the autopilot; by default a PID autopilot without a model of the cable.
        size: of the step, in degrees, m or m/s; the table's by default.
        speed: to hold. [m/s]
        tethered: with the cable.
        progress: called with the fraction that is done.

    Raises:
        NoTrimError: the bare hull cannot hold a speed that is asked for; the message says which it can.
        UserError: there is no such step, autopilot or feed-forward, or a step of nothing.
    """
    line = chosen(STEPS, name, "step")
    size = line.size if size is None else size
    if not real(size):
        raise UserError(f"A step of {short(size)} is none. Allowed: a finite number, not 0.")
    speed = checked("", "speed", speed, unit="m/s")
    trial = scenario if isinstance(scenario, scenarios.Trial) else load(scenario)
    flown_by = pilot.made(trial)
    before = Wanted(speed, trial.start.heading, trial.start.depth)
    goal = before._replace(**{line.field: getattr(before, line.field) + size * line.scale})
    for fast in sorted({before.speed, goal.speed}):
        trim(Model.of(trial), speed=fast)  # refuses a speed that the bare hull does not reach
    begin = replace(trial, start=replace(trial.start, surge_speed=speed), duration=DURATION)
    run = fly(
        begin,
        flown_by,
        lambda t: goal if t >= STEP_AT - 1e-9 else before,
        tethered=tethered,
        sensors=pilot.sensors,
        progress=progress,
    )
    values = run[line.channel].values
    wanted = getattr(goal, line.field) / line.scale
    indices = step_response(run["time"].values, values, wanted, STEP_AT)
    indices[f"steady_error{line.ending}"] = indices.pop("steady_error")
    return run, indices
