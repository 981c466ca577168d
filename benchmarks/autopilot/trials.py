"""What is flown: straight on at 1 m/s, and a wide turn; what is wrong with the vehicle; what of a run counts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
import xarray as xr

import subzero
from subzero import autopilot
from subzero.autopilot import Wanted

RATE, TURN = np.radians(8.0), np.radians(200.0)
BEGIN = 8.0
"""The wide turn: 200 degrees at 8 degrees a second from 8 s on."""


@cache
def trial(name: str):
    """Return a shipped trial."""
    return subzero.load_scenario(name)


@cache
def tuning() -> autopilot.Tuning:
    """Return the gains that everything is flown with."""
    return autopilot.tune(subzero.Model.of(trial("fig6")))


def straight(time: float) -> Wanted:
    """Hold 1 m/s, heading and depth of the start."""
    start = trial("fig6").start
    return Wanted(1.0, start.heading, start.depth)


def turning(time: float) -> Wanted:
    """Hold 1 m/s and depth through the wide turn."""
    start = trial("wide_turn").start
    turned = min(max(time - BEGIN, 0.0) * RATE, TURN)
    rate = RATE if BEGIN <= time < BEGIN + TURN / RATE else 0.0
    return Wanted(1.0, start.heading + turned, start.depth, 0.0, rate)


FLIGHTS: dict[str, tuple[Callable[[float], Wanted], float]] = {
    "fig6": (straight, 60.0),
    "wide_turn": (turning, 45.0),
}
"""Scenario → what is wanted, how long [s]."""


@dataclass(frozen=True, kw_only=True)
class Wrong:
    """What is true and not believed: factor on C_t, current [m/s], dead band of the fins [rad], sensors, their seed."""

    drag: float = 1.0
    current: tuple[float, float, float] = (0.0, 0.0, 0.0)
    dead_band: float = 0.0
    sensors: tuple[autopilot.Sensor, ...] = field(default=autopilot.PERFECT)
    seed: int = 0

    def model(self, name: str) -> subzero.Model:
        """Return the true model of a trial."""
        model = subzero.Model.of(trial(name))
        hull = model.vehicle
        for servo in ("rudder_servo", "stern_plane_port_servo", "stern_plane_starboard_servo"):
            hull = hull.with_parameter(f"{servo}.dead_band", self.dead_band)
        coefficient = self.drag * model.cable.tangential_drag_coefficient
        cable = replace(model.cable, tangential_drag_coefficient=coefficient)
        return replace(model, vehicle=hull, cable=cable, current=self.current)


def flown(
    name: str, pilot: str, feed_forward: str, wrong: Wrong | None = None, tethered: bool = True
) -> xr.Dataset:
    """Return a flight of a scenario."""
    wrong = wrong or Wrong()
    wanted, duration = FLIGHTS[name]
    made = autopilot.make(pilot, trial(name), feed_forward=feed_forward, tuning=tuning())
    return autopilot.fly(
        replace(trial(name), duration=duration), made, wanted, tethered=tethered, model=wrong.model(name),
        sensors=autopilot.Sensors(wrong.sensors, seed=wrong.seed),
    )  # fmt: skip


def lacking(run: xr.Dataset) -> tuple[float, float]:
    """Return root mean squares of the speed error [m/s] and the heading error [degree], transients left out.

    Left out are the first 15 s (from rest), and 7 s after the turn ends.
    """
    time = run["time"].values
    counts = ((time > 15.0) & (time < BEGIN + TURN / RATE)) | (time > BEGIN + TURN / RATE + 7.0)
    errors = (run["surge_speed"] - run["wanted_speed"], run["heading"] - run["wanted_heading"])
    speed, heading = (float(np.sqrt(np.mean(error.values[counts] ** 2))) for error in errors)
    return speed, heading
