"""Fly: a simulation, sensors and an autopilot in a loop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

import scenarios
from subzero.autopilot.sensors import PERFECT, Sensor, Sensors
from subzero.autopilot.standard import Wanted
from subzero.channels import DEGREE
from subzero.errors import UserError
from subzero.model import Model
from subzero.simulator import COMMANDED, Observation, Simulator

if TYPE_CHECKING:
    import xarray as xr


class Autopilot(Protocol):
    """What can fly; a user's own is any object that:

    1. has a `name` and a `sample_time`, a whole number of the trial's cable steps [s];
    2. begins again on `reset()`;
    3. answers `update(reading, wanted)` once a sample with four finite numbers: propeller [rev/s], rudder, port and
       starboard stern-plane [rad]. What no sensor measures reads NaN.
    """

    name: str
    sample_time: float

    def reset(self) -> None:
        """Begin again."""

    def update(self, reading: Observation, wanted: Wanted) -> Sequence[float]:
        """Return the command for the next sample."""


def fly(
    scenario: str | Path | scenarios.Trial,
    autopilot: Autopilot,
    wanted: Callable[[float], Wanted],
    *,
    tethered: bool = True,
    model: Model | None = None,
    duration: float | None = None,
    sensors: Sequence[Sensor] = PERFECT,
    seed: int = 0,
) -> xr.Dataset:
    """Return a run of a scenario whose commands come from an autopilot.

    Args:
        scenario: where it starts, in what water, with what cable; its commands are not used.
        autopilot: what flies.
        wanted: what to hold, at a time [s].
        tethered: with the cable.
        model: another model than the scenario's: what is true, whatever the autopilot believes.
        duration: how long; the scenario's by default. [s]
        sensors: what the autopilot is told.
        seed: of the sensors.

    Returns:
        the run as `subzero.simulate` gives it, with wanted_speed [m/s], wanted_heading [degree], wanted_depth [m]. A
        run that could not go on, or whose autopilot returned nonsense, ends early and says so in
        ``attrs["outcome_message"]``.

    Raises:
        UserError: a sample time that does not fit the trial's cable step, what is no autopilot, a duration of nothing.
    """
    _check(autopilot, duration)
    sim = Simulator(scenario, tethered=tethered, model=model, sample_time=autopilot.sample_time)
    told = Sensors(sensors, seed=seed)
    autopilot.reset()
    end = sim.trial.duration if duration is None else duration
    goals, trouble, seen = [(0.0, *wanted(0.0)[:3])], "", sim.observation
    for _ in range(round(end / autopilot.sample_time)):
        goal = wanted(seen.time)
        goals.append((seen.time, *goal[:3]))
        try:
            command = autopilot.update(told.read(seen), goal)
            seen = sim.step(_given(command, seen.time))
        except UserError as error:
            trouble = f"Autopilot '{autopilot.name}': {error}"
            break
    return _with_goals(sim.result(), np.array(goals), trouble)


def _check(autopilot: Autopilot, duration: float | None) -> None:
    """Refuse what cannot fly."""
    missing = [name for name in ("name", "sample_time", "reset", "update") if not hasattr(autopilot, name)]
    if missing:
        raise UserError(
            f"{type(autopilot).__name__} has no {', '.join(missing)}. Allowed: an object as `Autopilot` says."
        )
    if duration is not None and not (np.isfinite(duration) and duration > 0.0):
        raise UserError(f"fly: the duration is {duration!r}. Allowed: a time above 0 s.")


def _given(command: Sequence[float] | None, time: float) -> Sequence[float]:
    """Return a command, or refuse none: the simulator would take it for the scenario's own."""
    if command is None:
        raise UserError(
            f"At t = {time:g} s the command is None. Allowed: four finite numbers, {', '.join(COMMANDED)}."
        )
    return command


def _with_goals(run: xr.Dataset, goals: np.ndarray, trouble: str) -> xr.Dataset:
    """Return a run with what was wanted beside what was had."""
    rows = np.searchsorted(goals[1:, 0], run["time"].values + 1e-9, side="right")
    held = goals[rows]
    for i, (name, unit, scale) in enumerate(
        (("speed", "m/s", 1.0), ("heading", "degree", DEGREE), ("depth", "m", 1.0))
    ):
        words = {"units": unit, "long_name": f"{name} that was wanted"}
        run[f"wanted_{name}"] = ("time", held[:, 1 + i] * scale, words)
    if trouble:
        run.attrs |= {"outcome": "stopped", "outcome_message": trouble}
    return run
