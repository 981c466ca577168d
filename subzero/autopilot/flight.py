"""Closed-loop simulation: the simulator, sensors and an autopilot in a loop."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from math import ceil, isinf, pi, tau
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

import scenarios
from scenarios.steps import holding_rows
from subzero.autopilot.sensors import PERFECT, Sensor, Sensors
from subzero.autopilot.standard import Wanted
from subzero.channels import DEGREE, HEADING, Observation
from subzero.errors import BadValueError, UserError, short
from subzero.model import Model
from subzero.simulation.refinement import Progress
from subzero.simulation.stepper import COMMANDED, CommandError, RunStoppedError, Simulator

if TYPE_CHECKING:
    import xarray as xr


class Autopilot(Protocol):
    """The interface of an autopilot; one of your own is any object that

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


class AutopilotError(UserError):
    """An autopilot raised an error of its own, which is this one's cause."""


class AutopilotWarning(UserWarning):
    """A flight ended early: its autopilot gave no valid command."""


def fly(
    scenario: str | Path | scenarios.Trial,
    autopilot: Autopilot,
    wanted: Callable[[float], Wanted],
    *,
    tethered: bool = True,
    model: Model | None = None,
    sensors: Sensors | Sequence[Sensor] = PERFECT,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Simulate a scenario with its commands from an autopilot, and return the run.

    Args:
        scenario: where it starts, in what water, with what cable, and how long it lasts, to the first sample that
            reaches its end (``dataclasses.replace(trial, duration=60.0)`` is another); its commands are not used.
        autopilot: gives the commands.
        wanted: the set-point as a function of time [s].
        tethered: with the cable.
        model: the true model, if not the scenario's; the autopilot may be designed for another.
        sensors: through which the autopilot sees the run; `Sensors` have a seed, which is 0 for plain ones.
        progress: called with the fraction that is done.

    Returns:
        the run as `subzero.simulate` gives it, with wanted_speed [m/s], wanted_heading [degree], wanted_depth [m]. A
        run that could not go on ends early and says so in ``attrs["outcome_message"]``; so does one whose autopilot
        has no command or one that is none, with an `AutopilotWarning`.

    Raises:
        AutopilotError: the autopilot raised an error of its own.
        UserError: a sample time that does not fit the trial's cable step, an invalid autopilot, an invalid reference.
    """
    _check(autopilot)
    sim = Simulator(scenario, tethered=tethered, model=model, sample_time=autopilot.sample_time)
    reported = sensors if isinstance(sensors, Sensors) else Sensors(sensors)
    autopilot.reset()
    reported.reset()
    seen, trouble = sim.observation, ""
    goals = [(0.0, *_goal(wanted, 0.0, seen.heading)[:3])]
    samples = max(1, ceil(sim.trial.duration / sim.sample_time - 1e-9))
    for sample in range(samples):
        goal = _goal(wanted, seen.time, goals[-1][2])
        goals.append((seen.time, *goal[:3]))
        try:
            seen = sim.step(_command(autopilot, reported.read(seen), goal))
        except RunStoppedError:
            break  # the result reports it
        except AutopilotError:
            raise
        except UserError as error:
            trouble = f"Autopilot '{autopilot.name}': {error}"
            warnings.warn(
                f"The flight ended at t = {seen.time:g} s. {trouble}", AutopilotWarning, stacklevel=2
            )
            break
        if progress is not None:
            progress((sample + 1) / samples)
    return _with_goals(sim.result(), np.array(goals), trouble)


def _goal(wanted: Callable[[float], Wanted], time: float, before: float) -> Wanted:
    """Return the reference at a time, in plain numbers; raise an error if it is not valid; NaN leaves a quantity
    free.

    A heading that is more than a turn from the one `before` [rad], or a roll of more than half a turn, is in degrees.
    """
    given = wanted(time)
    try:
        goal = Wanted(*map(float, given))
    except Exception:  # a user's __float__ may do anything
        goal = None
    if goal is None or any(map(isinf, goal)):
        raise BadValueError(
            f"fly: what is wanted at t = {time:g} s is {short(given)}. Allowed: a Wanted with numbers that are finite,"
            " or NaN for nothing."
        )
    for name, angle, most in (("heading", goal.heading - before, tau), ("roll", goal.roll, pi)):
        if abs(angle) > most:
            number = getattr(goal, name)
            raise BadValueError(
                f"fly: the {name} that is wanted at t = {time:g} s is {number:g} rad, {number * DEGREE:g} degrees: "
                f"more than {'a turn away' if name == HEADING else 'half a turn'}. Give radians; if degrees are meant, "
                f"{name}=math.radians({number:g})."
            )
    return goal


def _command(autopilot: Autopilot, reading: Observation, goal: Wanted) -> Sequence[float]:
    """Return the autopilot's command; an exception that it raises is reported with its name and the time.

    Raises:
        CommandError: none, which the simulator would take for the scenario's own.
        AutopilotError: it raised something.
    """
    try:
        command = autopilot.update(reading, goal)
    except UserError:
        raise
    except Exception as error:
        raise AutopilotError(
            f"Autopilot '{autopilot.name}' broke at t = {reading.time:g} s: {type(error).__name__}: {error}"
        ) from error
    if command is None:
        raise CommandError(
            f"At t = {reading.time:g} s the command is None. Allowed: four finite numbers, {', '.join(COMMANDED)}."
        )
    return command


def _check(autopilot: Autopilot) -> None:
    """Raise an error for an autopilot that cannot fly."""
    missing = [name for name in ("name", "sample_time", "reset", "update") if not hasattr(autopilot, name)]
    if missing:
        raise UserError(
            f"{type(autopilot).__name__} has no {', '.join(missing)}. Allowed: an object as `Autopilot` says."
        )


def _with_goals(run: xr.Dataset, goals: np.ndarray, trouble: str) -> xr.Dataset:
    """Return a run with the references next to the states."""
    held = goals[holding_rows(goals[:, 0], run["time"].values)]
    for i, (name, unit, scale) in enumerate(
        (("speed", "m/s", 1.0), ("heading", "degree", DEGREE), ("depth", "m", 1.0))
    ):
        words = {"units": unit, "long_name": f"{name} that was wanted"}
        run[f"wanted_{name}"] = ("time", held[:, 1 + i] * scale, words)
    if trouble:
        run.attrs |= {"outcome": "stopped", "outcome_message": trouble}
    return run
