"""A simulation that is driven from outside, step by step: for people with a controller of their own.

    >>> import subzero
    >>> sim = subzero.Simulator("fig6")
    >>> obs = sim.observation
    >>> while sim.time < 1.0:
    ...     obs = sim.step((25.0, 0.5 * (0.6 - obs.heading), 0.0, 0.0))   # propeller [rev/s], fins [rad]
    >>> run = sim.result()                              # the dataset of subzero.simulate
    >>> run["rudder_command"].attrs["units"]
    'degree'

A vehicle with listed actuators, such as thrusters, takes their commands behind the four, or by name:

    >>> from dataclasses import replace
    >>> rov = subzero.Simulator(replace(subzero.load_scenario("rov_hover"), station=None))
    >>> rov.step({"front_port": 0.2, "aft_port": 0.2}).time
    0.1

Each step holds a command for one sample time. The exchanges of hull and cable inside are those of `subzero.simulate`:
the same commands give the same numbers, to the last bit. A `SteppingGroup` steps many simulators together, by some
threads: each takes the next one that no other has taken.
"""

from __future__ import annotations

import time
import weakref
from collections.abc import Mapping, Sequence
from itertools import islice
from math import isfinite, pi
from operator import is_
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any, NamedTuple

import numba
import numpy as np

import scenarios
from scenarios.steps import held, whole_steps
from subzero.arguments import checked_arguments
from subzero.channels import Observation
from subzero.engine import coupling
from subzero.engine.initial_conditions import prepare
from subzero.engine.recording import Recording, Run, cut, new_recording, record_row
from subzero.engine.run_state import Live, Orders, Setup
from subzero.engine.time_loop import (
    ENDING,
    NO_SPACE,
    ROW,
    USED,
    advance,
    begin,
    hold,
    hold_batch,
    observe,
    share,
)
from subzero.errors import UserError, real, short, suggestion
from subzero.model import Model, load, model_of
from subzero.simulation.run import SPARE_SEGMENTS, WENT_WELL, enlarged_run, in_words
from vehicle.channels import FIRST_COMMAND

if TYPE_CHECKING:
    import xarray as xr

Command = Sequence[float] | np.ndarray | Mapping[str, float]
"""Propeller [rev/s], rudder, port and starboard stern-plane [rad], and, if any of them is given, one number for each of
the vehicle's `channels`; or numbers by name, those of `FOUR` and of the channels, the others zero.
"""

FOUR = ("propeller", "rudder", "stern_plane_port", "stern_plane_starboard")
COMMANDED = ("propeller [rev/s]", "rudder [rad]", "port stern-plane [rad]", "starboard stern-plane [rad]")


MOST_EXCHANGES = 1e6
"""A sample of more cable steps than this is a slip of the pen."""
WELL = (coupling.FINE, NO_SPACE)
"""Endings of a step from which a run can go on."""


class Held(NamedTuple):
    """A run: its arrays, times of its rows (n,) [s], its position in time (`subzero.engine.time_loop`), its
    observation, and the handle that machine code knows the arrays by. It is exchanged as a whole: an interrupt finds
    the old one or the new one.
    """

    setup: Setup
    live: Live
    recording: Recording
    times: np.ndarray
    at: np.ndarray
    seen: np.ndarray
    handle: Any

    @classmethod
    def of(cls, arrays: tuple[Setup, Live, Recording, np.ndarray], at: np.ndarray, seen: np.ndarray) -> Held:
        """Return a run with its handle; `arrays` are its setup, state and recording, and the times of its rows."""
        return cls(*arrays, at, seen, hold(*arrays))


class CommandError(UserError, ValueError):
    """A command that is not finite numbers, four or one for each actuator; the run does not advance."""


class RunStoppedError(UserError):
    """The simulation cannot go on: when, where, the advice. `Simulator.result` keeps the results up to then."""


class Simulator:
    """A run that waits for the next command.

    Attributes:
        trial: the trial to simulate; the run goes on beyond its duration if asked to.
        model: vehicle, cable, drum and water.
        sample_time: how long a step lasts. [s]
        observation: the true values now.
    """

    @checked_arguments
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
        self.model = model_of(self.trial, model)
        self._tethered = bool(tethered)
        self._channels = tuple(channel.name for channel in self.model.vehicle.channels)
        self._exchanges = _exchanges(self.trial, sample_time, self._tethered)
        self.sample_time = self._exchanges * self.trial.cable_step
        self.reset()

    def reset(self) -> Observation:
        """Return to the start; return the observation there."""
        setup, live = prepare(self.trial, self.model, self._tethered, spare=SPARE_SEGMENTS)
        self._orders = setup.orders
        setup = setup._replace(orders=Orders(np.zeros(1), np.zeros((1, setup.orders.values.shape[1]))))
        setup.orders.values[0] = self._command_at(0.0)
        times = _times(self.trial)
        nodes = times.size * live.line.length.size if self._tethered else 0
        recording = new_recording(times.size, nodes, entries=live.state.size)
        used = record_row(setup, live, recording, 0, 0.0, 0)
        at, seen = np.array([0, used, coupling.FINE]), np.zeros(len(Observation._fields))
        seen[6] = pi - 1e-12  # headings begin in [0, 2π), as in `subzero.results.dataset`
        held = Held.of((setup, live, recording, times), at, seen)
        observe(held.handle, 0, seen)
        self._held = held
        return self.observation

    @property
    def observation(self) -> Observation:
        """The true values now."""
        return Observation(*self._held.seen.tolist())

    @property
    def seen(self) -> np.ndarray:
        """The observation as an array (27,), in SI units; the next step writes over it."""
        return self._held.seen

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return float(self._held.seen[0])

    def step(self, command: Command | None = None) -> Observation:
        """Hold a command for one sample time; return the observation after it.

        Args:
            command: propeller [rev/s], rudder, port and starboard stern-plane [rad], then the `channels` of the vehicle
                in their units, or zero for all of them; or all by name; None: what the scenario commands at this time.

        Raises:
            CommandError: the command is not finite numbers, or not of this vehicle (a UserError); the run stands where
                it was.
            RunStoppedError: the simulation cannot go on.
        """
        n, rudder, port, starboard, *listed = (
            self._command_at(self.time) if command is None else self._checked(command)
        )
        if self._channels:
            self._held.setup.orders.values[0, FIRST_COMMAND:] = listed or 0.0
        self.hold(n, rudder, port, starboard)
        return self.observation

    def hold(self, n: float, rudder: float, port: float, starboard: float) -> None:
        """Hold a command of four finite numbers, not checked here, for one sample time: `step` without observing.

        Raises:
            RunStoppedError: the simulation cannot go on.
        """
        self._check_on()
        self._reach(int(self._held.at[ROW]) + self._exchanges, n, rudder, port, starboard)
        self._check_on()

    def _reach(self, goal: int, n: float, rudder: float, port: float, starboard: float) -> None:
        """Go on to a row, or until that is not possible; enlarge the arrays where they are full."""
        if goal >= self._held.times.size:
            self._held = _with_rows(self._held, goal)
        while True:
            held = self._held
            count = goal - int(held.at[ROW])
            ending = advance(held.handle, held.at, count, n, rudder, port, starboard, held.seen)
            if ending != NO_SPACE:
                break
            live, recording = enlarged_run(held.live, held.recording, int(held.at[USED]))
            self._held = Held.of((held.setup, live, recording, held.times), held.at, held.seen)

    def result(self) -> xr.Dataset:
        """Return the run so far as `subzero.simulate` does: channels with units, forces, the cable's shape."""
        from subzero.results.dataset import plain_run

        row, used, ending = self._held.at.tolist()
        run = Run(
            times=self._held.times[: row + 1].copy(),
            recording=cut(self._held.recording, row + 1, used),
            completed=ending in WELL,
            message=self._message(),
        )
        return plain_run(self.trial, self.model, self._tethered, run).labelled()

    def _checked(self, command: Command) -> list[float]:
        """Return a command as floats: four, and one for each channel if any of them is given."""
        given = self._by_name(command) if isinstance(command, Mapping) else command
        every = len(FOUR) + len(self._channels)
        try:
            numbers = [float(value + 0.0) for value in islice(given, every + 1)]  # no text is a number
        except (TypeError, ValueError, OverflowError):
            numbers = []
        if len(numbers) in (len(FOUR), every) and all(map(isfinite, numbers)):
            self._check_station(numbers)
            return numbers
        listed = f"; or these and those of {', '.join(self._channels)}" if self._channels else ""
        raise CommandError(
            f"At t = {self.time:g} s the command is {short(command)}. Allowed: four finite numbers,"
            f" {', '.join(COMMANDED)}{listed}."
        )

    def _by_name(self, command: Mapping[str, float]) -> list[float]:
        """Return a command that is given by name as numbers in their order."""
        known = (*FOUR, *self._channels)
        for name in command:
            if name not in known:
                raise CommandError(
                    f"At t = {self.time:g} s the command names {short(name)}, and this vehicle has no such actuator."
                    f"{suggestion(str(name), known)} It has {', '.join(known)}."
                )
        return [command.get(name, 0.0) for name in known]

    def _check_station(self, numbers: Sequence[float]) -> None:
        """Raise an error for commands to thrusters that keep a station: they would not be heard."""
        if self.trial.station is not None and any(numbers[len(FOUR) :]):
            raise CommandError(
                f"At t = {self.time:g} s thrusters are commanded that keep the station of '{self.trial.name}'. Give"
                " four numbers, or take dataclasses.replace(trial, station=None)."
            )

    def _command_at(self, time: float) -> list[float]:
        """Return the command of the scenario at a time [s]."""
        return list(held(self._orders.time, self._orders.values, time).tolist())

    def _message(self) -> str:
        """Return how the last step ended."""
        ending = int(self._held.at[ENDING])
        return WENT_WELL if ending in WELL else in_words(ending, self.time, self._held.setup, self._held.live)

    def _check_on(self) -> None:
        """Raise an error if a step has failed before."""
        if self._held.at[ENDING] not in WELL:
            raise RunStoppedError(self._message())


def _with_rows(held: Held, goal: int) -> Held:
    """Return a run with space for rows up to `goal`, and for twice as many as there were."""
    old, times = held.recording, held.times
    rows = max(2 * times.size, goal + 1)
    new = new_recording(rows, old.tension.size, entries=old.state.shape[1])
    for name, values in old._asdict().items():
        getattr(new, name)[: values.shape[0]] = values
    further = whole_steps(times[1], rows)[times.size :]
    arrays = held.setup, held.live, new, np.concatenate([times, further])
    return Held.of(arrays, held.at, held.seen)


def _times(trial: scenarios.Trial) -> np.ndarray:
    """Return times of rows (n,), whole cable steps; as far as the trial goes, those of `subzero.simulate` [s]."""
    times = trial.times()
    even = np.allclose(np.diff(times), trial.cable_step, rtol=0.0, atol=1e-9)
    return times if even else whole_steps(trial.cable_step, times.size + 1)


def _exchanges(trial: scenarios.Trial, sample_time: float | None, tethered: bool) -> int:
    """Return the number of exchanges in a sample; raise an error for a trial that cannot be stepped."""
    if trial.motion is not None:
        raise UserError(
            f"'{trial.name}' prescribes its motion, so there is nothing to command. Use subzero.simulate."
        )
    if tethered and trial.scheme != "moving_end":
        raise UserError(f"'{trial.name}' has the scheme '{trial.scheme}'; only 'moving_end' can be stepped.")
    count = 1.0 if sample_time is None else (real(sample_time) or 0.0) / trial.cable_step
    if not (0.5 < count < MOST_EXCHANGES and abs(count - round(count)) < 1e-6):
        raise UserError(
            f"A sample time of {short(sample_time)} s does not fit. Allowed: a whole number of cable steps,"
            f" {trial.cable_step:g} s each."
        )
    return round(count)


class SteppingGroup:
    """Simulators of one trial, one model and one sample time.

    The thread that calls does not wait for the others to wake, which takes as long as some steps: it begins, and they
    take the remaining ones. Nor do they sleep at once: the next steps may come before they would be awake again.

    Args:
        simulators: none of them has stopped; nothing else steps them in the meantime.
        threads: how many step them, the one that calls among them.
    """

    def __init__(self, simulators: Sequence[Simulator], threads: int) -> None:
        self._simulators, self._exchanges = simulators, simulators[0]._exchanges
        self._orders, self._held = np.zeros((len(simulators), 4)), list[Held]()
        self._shown = np.zeros((len(simulators), len(Observation._fields)))
        self._reached = np.zeros((len(simulators), 2), np.int64)
        self._others = 0 if numba.config.DISABLE_JIT else threads - 1
        self._batch: Any = None
        self._is_stepping = False
        self._asked: SimpleQueue[Any] = SimpleQueue()
        for _ in range(self._others):
            Thread(target=_help, args=(self._asked, self._exchanges), daemon=True).start()
        self.close = weakref.finalize(self, _end, self._asked, self._others)

    def hold(self, orders: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Hold a command in each, as `Simulator.hold` does.

        Args:
            orders: propeller [rev/s], rudder, port and starboard stern-plane [rad] of each (simulators, 4).

        Returns:
            which of them cannot go on, and `Simulator.seen` of all (simulators, 27).
        """
        if self._is_stepping:
            self._finish()  # what an interrupt has broken off
        self._take([each._held for each in self._simulators])
        self._orders[:] = orders
        self._is_stepping = True
        begin(self._batch)
        for _ in range(self._others - self._asked.qsize()):
            self._asked.put(self._batch)
        self._finish()
        goals, endings = self._reached.T
        for i in np.flatnonzero(endings == NO_SPACE).tolist():
            each = self._simulators[i]
            each._reach(int(goals[i]), *self._orders[i].tolist())
            endings[i], self._shown[i] = each._held.at[ENDING], each.seen
        return endings != coupling.FINE, self._shown.copy()

    def _take(self, held: list[Held]) -> None:
        """Take the runs as they are now: after a reset, or with space for more rows, they are other arrays."""
        if self._held and all(map(is_, held, self._held)):
            return
        handles, at, seen = zip(*((each.handle, each.at, each.seen) for each in held), strict=True)
        batch = hold_batch(handles, at, seen, self._orders, self._shown, self._reached)
        self._held, self._batch = held, batch

    def _finish(self) -> None:
        """Take what no other thread has taken, and wait for what the others have."""
        while not share(self._batch, self._exchanges, False):
            time.sleep(0.0)
        self._is_stepping = False


def _help(asked: SimpleQueue[Any], exchanges: int) -> None:
    """Share the batches of a group, as they come."""
    while (batch := asked.get()) is not None:
        share(batch, exchanges, True)


def _end(asked: SimpleQueue[Any], threads: int) -> None:
    for _ in range(threads):
        asked.put(None)
