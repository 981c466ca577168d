"""A simulation that is driven from outside, step by step: for people with a controller of their own.

    >>> sim = subzero.Simulator("fig6")
    >>> obs = sim.observation
    >>> while sim.time < 30.0:
    ...     obs = sim.step((25.0, 0.5 * (wanted - obs.heading), 0.0, 0.0))
    >>> run = sim.result()                              # the dataset of subzero.simulate

Each step holds a command for one sample time. The exchanges of hull and cable inside are those of `subzero.simulate`:
the same commands give the same numbers, to the last bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, pi
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

import scenarios
from cable.newton import Solved
from subzero import coupling
from subzero.errors import UserError
from subzero.handle import advance, hold, observe
from subzero.loop import NO_ROOM
from subzero.model import Model
from subzero.recording import Recording, Run, cut, new_recording, record_row
from subzero.run_state import Orders
from subzero.simulation import in_words, more_room
from subzero.start import prepare
from subzero.trials import load

if TYPE_CHECKING:
    import xarray as xr

Command = Sequence[float] | np.ndarray
"""Propeller [rev/s], rudder, port and starboard stern-plane [rad]."""

WENT_WELL = in_words(coupling.FINE, Solved(True, 0, 0.0, 0, 0), 0.0)
COMMANDED = ("propeller [rev/s]", "rudder [rad]", "port stern-plane [rad]", "starboard stern-plane [rad]")


class Observation(NamedTuple):
    """What is true at one time, by the names of `subzero.channels`, in SI units, radians and rev/s.

    The heading is continuous: no jump at a full turn. Forces and moments of the cable are those on the hull, body axes.
    """

    time: float
    north: float
    east: float
    depth: float
    roll: float
    pitch: float
    heading: float
    surge_speed: float
    sway_speed: float
    heave_speed: float
    roll_rate: float
    pitch_rate: float
    yaw_rate: float
    propeller_speed: float
    rudder_angle: float
    stern_plane_port_angle: float
    stern_plane_starboard_angle: float
    battery_voltage: float
    cable_length: float
    cable_tension: float
    drum_tension: float
    cable_force_forward: float
    cable_force_starboard: float
    cable_force_down: float
    cable_moment_roll: float
    cable_moment_pitch: float
    cable_moment_yaw: float


class RunStoppedError(UserError):
    """The simulation cannot go on: when, where, what to try. `Simulator.result` keeps what it has."""


class Simulator:
    """A run that waits for the next command.

    Attributes:
        trial: what is simulated; it goes on beyond the trial's duration if asked to.
        model: vehicle, cable, drum and water.
        sample_time: how long a step lasts. [s]
        observation: what is true now.
    """

    def __init__(
        self,
        scenario: str | Path | scenarios.Trial,
        *,
        tethered: bool = True,
        model: Model | None = None,
        sample_time: float | None = None,
    ) -> None:
        """Prepare a run.

        Args:
            scenario: name of a shipped scenario, path of a file, or a trial.
            tethered: with the cable.
            model: another model than the one that the scenario describes.
            sample_time: how long a step holds its command, a whole number of cable steps; one by default. [s]

        Raises:
            UserError: a prescribed motion, a scheme that cannot be stepped, a sample time that does not fit.
        """
        self.trial = scenario if isinstance(scenario, scenarios.Trial) else load(scenario)
        self.model = model or Model.of(self.trial)
        self._tethered = tethered
        self._exchanges = _exchanges(self.trial, sample_time, tethered)
        self.sample_time = self._exchanges * self.trial.cable_step
        self.reset()

    def reset(self) -> Observation:
        """Go back to the start, and return what is true there."""
        setup, self._live = prepare(self.trial, self.model, self._tethered)
        self._setup = setup._replace(orders=Orders(np.zeros(1), np.zeros((1, 4))))
        self._times = _times(self.trial)
        self._recording: Recording = new_recording(self._times.size, self._first_nodes())
        self._row, self._ending, self._message = 0, coupling.FINE, WENT_WELL
        self._setup.orders.values[0] = self._own_command()
        self._used = record_row(self._setup, self._live, self._recording, 0, 0.0, 0)
        self._seen = np.zeros(len(Observation._fields))
        self._seen[6] = pi - 1e-12  # headings begin in [0, 2π), as in `subzero.dataset`
        self._grip()
        observe(self._handle, 0, self._used, self._seen)
        self.observation = Observation(*self._seen.tolist())
        return self.observation

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self.observation.time

    def step(self, command: Command | None = None) -> Observation:
        """Hold a command for one sample time, and return what is true then.

        Args:
            command: propeller [rev/s], rudder, port and starboard stern-plane [rad]; None: what the scenario commands
                at this time.

        Raises:
            UserError: the command is not four finite numbers; the run stands where it was.
            RunStoppedError: the simulation cannot go on.
        """
        n, rudder, port, starboard = self._own_command() if command is None else self._checked(command)
        if self._ending != coupling.FINE:
            raise RunStoppedError(self._message)
        goal = self._row + self._exchanges
        if goal >= self._times.size:
            self._more_rows(goal)
        while True:
            self._row, self._used, ending, solved = advance(
                self._handle, self._row, goal - self._row, self._used, n, rudder, port, starboard, self._seen
            )
            if ending != NO_ROOM:
                break
            self._live, self._recording = more_room(self._live, self._recording, self._used)
            self._grip()
        self.observation = Observation(*self._seen.tolist())
        if ending != coupling.FINE:
            words = in_words(ending, solved, self.time, self._setup, self._live)
            self._ending, self._message = ending, words
            raise RunStoppedError(self._message)
        return self.observation

    def result(self) -> xr.Dataset:
        """Return the run so far as `subzero.simulate` does: channels with units, forces, the cable's shape."""
        from subzero.dataset import dataset_of

        run = Run(
            times=self._times[: self._row + 1].copy(),
            recording=cut(self._recording, self._row + 1, self._used),
            completed=self._ending == coupling.FINE,
            message=self._message,
        )
        return dataset_of(self.trial, self.model, self._tethered, run)

    def _checked(self, command: Command) -> tuple[float, float, float, float]:
        """Return a command as four floats."""
        try:
            n, rudder, port, starboard = (float(value) for value in command)
            if isfinite(n) and isfinite(rudder) and isfinite(port) and isfinite(starboard):
                return n, rudder, port, starboard
        except (TypeError, ValueError):
            pass
        raise UserError(
            f"At t = {self.time:g} s the command is {command!r}. Allowed: four finite numbers, {', '.join(COMMANDED)}."
        )

    def _own_command(self) -> tuple[float, float, float, float]:
        """Return what the scenario commands at the present time."""
        commands = self.trial.commands
        if commands is None:
            return 0.0, 0.0, 0.0, 0.0
        row = int(np.searchsorted(commands.time, self._times[self._row] + 1e-9, side="right")) - 1
        n, rudder, port, starboard = commands.values[row].tolist()
        return n, rudder, port, starboard

    def _grip(self) -> None:
        """Take hold of the run's arrays again, after they were replaced."""
        self._handle = hold(self._setup, self._live, self._recording, self._times)

    def _first_nodes(self) -> int:
        """Return the room for nodes that a recording begins with."""
        return 4 * self._times.size * self._live.line.length.size if self._tethered else 0

    def _more_rows(self, goal: int) -> None:
        """Make room for rows up to `goal`, and twice as many as there were."""
        rows = max(2 * self._times.size, goal + 1)
        step = self._times[1]
        self._times = np.concatenate([self._times, step * np.arange(self._times.size, rows)])
        old, new = self._recording, new_recording(rows, self._recording.tension.size)
        for name, values in old._asdict().items():
            getattr(new, name)[: values.shape[0]] = values
        self._recording = new
        self._grip()


def _times(trial: scenarios.Trial) -> np.ndarray:
    """Return the times of the rows (n,), whole cable steps: as far as the trial goes, those of `subzero.simulate` [s]."""
    times = trial.times()
    even = np.allclose(np.diff(times), trial.cable_step, rtol=0.0, atol=1e-9)
    return times if even else trial.cable_step * np.arange(times.size + 1)


def _exchanges(trial: scenarios.Trial, sample_time: float | None, tethered: bool) -> int:
    """Return the number of exchanges in a sample, or refuse what cannot be stepped."""
    if trial.motion is not None:
        raise UserError(
            f"'{trial.name}' prescribes its motion, so there is nothing to command. Use subzero.simulate."
        )
    if tethered and trial.scheme != "moving_end":
        raise UserError(f"'{trial.name}' has the scheme '{trial.scheme}'; only 'moving_end' can be stepped.")
    count = 1.0 if sample_time is None else sample_time / trial.cable_step
    if not (isfinite(count) and round(count) >= 1 and abs(count - round(count)) < 1e-6):
        raise UserError(
            f"A sample time of {sample_time:g} s does not fit. Allowed: a whole number of cable steps,"
            f" {trial.cable_step:g} s each."
        )
    return round(count)
