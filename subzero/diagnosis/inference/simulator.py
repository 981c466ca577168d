"""A simulation for a diagnosis: a compiled loop that records the measured quantities, resumed where simulations start
to differ, cached.

It does the same as `subzero.engine.time_loop`, without forces, energies and shapes, but with the hull's states inside
an exchange: a rudder moves faster than cable and hull exchange their forces.

A force that begins at 20 s changes nothing before: its sensitivity needs the last 10 of 30 s only. Simulations are
cached: fits return to former points, and errors of sensors change no simulation.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from threading import Lock
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import vehicle
from cable.moving_end import enlarged, paid_out
from scenarios.steps import fitting_step
from subzero.diagnosis.hypothesis.configuration import (
    COLUMNS,
    LENGTH,
    RUDDER,
    TENSION,
    VOLTAGE,
    WATER,
    sensed,
    truth,
)
from subzero.engine import coupling
from subzero.engine.coupling import FINE, exchange, hull_steps
from subzero.engine.external_wrench import row_at, sample_current
from subzero.engine.initial_conditions import go_on_with, most_hull_steps, prepare
from subzero.engine.time_loop import NO_SPACE, SPARE
from subzero.jit import compiled, inner
from vehicle import STATE_SIZE

if TYPE_CHECKING:
    from subzero.diagnosis.hypothesis.configuration import Setting
    from subzero.engine.run_state import Live, Setup
    from subzero.model import Model


TOO_LONG = NO_SPACE + 1
"""Ending of a simulation that exceeds its limit of work, in addition to the endings of `coupling` and `NO_SPACE`."""
USUAL_WORK = 25 * 60
"""Work allowed to any simulation for an exchange, on average: iterations of the cable's solver times nodes. Usual
simulations take 2 to 5 iterations, those of a cause of any size up to 18, for 15 to 60 nodes. Where several numbers
are absurd at once a cable may whip about, take 200, and seconds: such a simulation counts as failed.
"""
TIMES_NOMINAL = 10
"""... and a simulation may take so many times the work of the nominal one: a heavy cable, slack behind a vehicle that
stops, takes 25 to 120 iterations for an exchange, and is valid.
"""


@compiled
def record_track(
    setup: Setup, live: Live, times: np.ndarray, first: int, last: int, track: np.ndarray, most_work: float
) -> tuple[int, int]:
    """Fill the rows of a track that belong to the exchanges first … last − 1.

    Args:
        setup: constants of the simulation.
        live: its state; at times[first − 1] when called.
        times: of the exchanges, evenly spaced (n,). [s]
        first: exchange to begin with, from 1.
        last: exchange to end before.
        track: (1 + (n − 1) · hull steps, COLUMNS); row 0 is filled when first is 1.
        most_work: allowed since the start of the simulation, as in `work`.

    Returns:
        the exchanges that are done, and how it ended (`coupling.FINE` …, `NO_SPACE`, `TOO_LONG`).
    """
    steps = hull_steps(setup, times[1] - times[0])
    if first == 1:
        _write(setup, live, 0.0, live.state, track[0])
    for row in range(first, last):
        if live.line.ends.count + 1 + SPARE > live.line.length.size:
            return row, NO_SPACE
        span = times[row] - times[row - 1]
        ending = exchange(setup, live, times[row - 1], span)
        if ending != FINE:
            return row, ending
        if work(live) > most_work:
            return row, TOO_LONG
        whole, pull, length = (
            live.now.last_step > 0.999 * span,
            track[(row - 1) * steps, TENSION],
            track[(row - 1) * steps, LENGTH],
        )
        for i in range(1, steps + 1):
            at, share = track[(row - 1) * steps + i], i / steps
            _write(setup, live, times[row - 1] + share * span, live.path[i] if whole else live.state, at)
            at[TENSION] = share * at[TENSION] + (1.0 - share) * pull
            at[LENGTH] = share * at[LENGTH] + (1.0 - share) * length
            if not whole:
                for j in range(STATE_SIZE):
                    at[j] = share * live.state[j] + (1.0 - share) * track[(row - 1) * steps, j]
    return last, FINE


@compiled
def work(live: Live) -> float:
    """Return the work of a simulation so far: iterations times the nodes of its cable as it is now."""
    return live.now.iterations * live.line.ends.count


@inner
def _write(setup: Setup, live: Live, time: float, state: np.ndarray, out: np.ndarray) -> None:
    """Write a state and the other measured quantities; tension and length as they are at the end of the exchange."""
    command, force = setup.orders.values[row_at(setup.orders.time, time)], live.now.force
    sample_current(setup, state, time, live.now.hull)
    for j in range(STATE_SIZE):
        out[j] = state[j]
    for j in range(3):
        out[WATER + j] = live.now.hull.current[j]
    out[RUDDER] = vehicle.deflections(state, command, setup.fixed.vehicle)[0]
    out[VOLTAGE] = vehicle.battery_voltage(state, command, live.now.hull.current, setup.fixed.vehicle)
    out[TENSION] = np.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2])
    out[LENGTH] = paid_out(live.line) if setup.fixed.tethered else 0.0


HULL_STEP_S, CABLE_STEP_S, SEGMENT_M = 0.05, 0.2, 1.0
"""Steps of a diagnosis: errors of 1e-4 m/s and 0.03 degrees on fig6, a twentieth of the sensors' noise, in a third of
the time."""
FINE_STEPS = (0.025, 0.1, 0.25)
"""Hull step, cable step [s] and segment length [m] to measure the error of the economical steps with."""
ROUGH_HULL_STEP_S, ROUGH_SEGMENT_M = 0.1, 2.0
"""Steps of the hull and segments for the sensitivities to forces and onsets, with the cable steps of a diagnosis: in
six tenths of the time, half of the sensitivities err by less than 1 %, nine of ten by less than 2 to 6 % (12 % where
a current drags a long cable, where those in the steps of a diagnosis err by 3 %).
"""
AGREEMENT = 1e-6
"""Fraction within which the forces of hull and cable agree, instead of 1e-9: a quarter faster, with no visible
change. With 1e-5, and the cable's balances to 1e-6, a fit of 12 m more cable ended 122 nats lower: sensitivities need
it.
"""
FASTEST_PAY_OUT = 2.0
"""Memory for nodes is allocated for this speed, and doubled when that is not enough. [m/s]"""
Track = tuple[np.ndarray, np.ndarray]
"""Times (m,) [s] and the tracked quantities (m, COLUMNS), NaN from where the simulation failed."""


class Stop(NamedTuple):
    """A simulation as it was after some exchanges; `track` has its rows so far (rows, COLUMNS)."""

    exchanges: int
    setup: Setup
    live: Live
    track: np.ndarray


def simulate_track(setting: Setting) -> Track:
    """Return the track of a setting."""
    return with_stops(setting, ())[0]


def with_limit(setting: Setting) -> tuple[Setting, Track]:
    """Return a nominal setting with a limit of work for simulations of it and of all settings derived from it; and
    its track.
    """
    begin, grid, steps = _prepared(setting)
    _run(setting, begin, grid, steps, ())
    nominal = work(begin.live) / (grid.size - 1)
    limited = replace(setting, most_work=max(USUAL_WORK, TIMES_NOMINAL * nominal))
    return limited, (_spread(grid, begin), begin.track)


def with_stops(setting: Setting, times: Collection[float]) -> tuple[Track, dict[float, Stop]]:
    """Return the track of a setting, and the simulation as it was at times [s], or at the last exchange
    before each.
    """
    begin, grid, steps = _prepared(setting)
    done = {time: int(time / setting.trial.cable_step + 1e-6) for time in times}
    stops = _run(setting, begin, grid, steps, set(done.values()))
    kept = {time: stops[count] for time, count in done.items() if count in stops}
    return (_spread(grid, begin), begin.track), kept


def _prepared(setting: Setting) -> tuple[Stop, np.ndarray, int]:
    """Return the simulation of a setting before its first exchange, the times of exchanges, and the hull's steps in
    one.
    """
    trial = setting.trial
    # Even segments, whatever the initial length: with a mesh that changes with the length the response has no slope.
    nodes = 16 + int(FASTEST_PAY_OUT * trial.duration / trial.segment_length)
    setup, live = prepare(
        trial, setting.model, setting.tethered, longest_exchange=trial.cable_step, run_in=0.0, spare=nodes
    )
    _ease(setup)
    grid, steps = _exchanges(setting)
    track = np.full((1 + (grid.size - 1) * steps, COLUMNS), np.nan)
    return Stop(0, setup, live, track), grid, steps


def _spread(grid: np.ndarray, run: Stop) -> np.ndarray:
    """Return the times of the rows of a simulation's track. [s]"""
    return np.linspace(0.0, grid[-1], run.track.shape[0])


def simulate_on(setting: Setting, stop: Stop) -> Track:
    """Return the track of a setting that is the same as another until a stop of that one's simulation."""
    grid, steps = _exchanges(setting)
    time, track = grid[stop.exchanges], np.full((1 + (grid.size - 1) * steps, COLUMNS), np.nan)
    track[: stop.track.shape[0]] = stop.track
    live = _copied(stop.live)
    setup = go_on_with(
        _model_from(setting, time), stop.setup, live, setting.trial, setting.tethered, float(time)
    )
    _ease(setup)
    later = tuple((begin, model) for begin, model in setting.later if begin > time + SAME_TIME_S)
    _run(replace(setting, later=later), Stop(stop.exchanges, setup, live, track), grid, steps, ())
    return np.linspace(0.0, grid[-1], track.shape[0]), track


def _run(
    setting: Setting, begin: Stop, times: np.ndarray, steps: int, wanted: Collection[int]
) -> Mapping[int, Stop]:
    """Fill the rows of a track from `begin` on, and return the simulation as it was after the wanted exchanges."""
    trial, (done, setup, live, track), stops = setting.trial, begin, dict[int, Stop]()
    changes = {round(time / trial.cable_step): model for time, model in setting.later}
    row, ending = done + 1, coupling.FINE
    while row < times.size and ending in (coupling.FINE, NO_SPACE):
        if row - 1 in wanted and row - 1 not in stops:
            stops[row - 1] = Stop(row - 1, setup, _copied(live), track[: 1 + (row - 1) * steps])
        if row - 1 in changes:
            setup = go_on_with(
                changes.pop(row - 1), setup, live, trial, setting.tethered, float(times[row - 1])
            )
            _ease(setup)
        ahead = (count + 1 for count in (*changes, *wanted) if count + 1 > row)
        most = math.inf if setting.most_work is None else setting.most_work * (times.size - 1)
        row, ending = record_track(setup, live, times, row, min([times.size, *ahead]), track, most)
        if ending == NO_SPACE:
            live = live._replace(line=enlarged(live.line, 2 * live.line.length.size))
    return stops


def _exchanges(setting: Setting) -> tuple[np.ndarray, int]:
    """Return the times of the exchanges (n,), evenly spaced to the end of the trial or beyond [s], and the hull's
    steps between two of them.
    """
    trial = setting.trial
    count = max(1, math.ceil(trial.duration / trial.cable_step - 1e-6))
    end = (
        trial.duration if abs(count * trial.cable_step - trial.duration) < 1e-6 else count * trial.cable_step
    )
    return np.linspace(0.0, end, count + 1), most_hull_steps(trial.cable_step, trial.hull_step)


SAME_TIME_S = 1e-6
"""Times that are closer are the same. [s]"""


def _model_from(setting: Setting, time: float) -> Model:
    """Return the model that holds from a time on."""
    return [setting.model, *(model for begin, model in setting.later if begin <= time + SAME_TIME_S)][-1]


def _ease(setup: Setup) -> None:
    """Make a simulation quicker, at less accuracy than a user's: forces agree less closely, and energies are not
    computed.
    """
    fixed: Any = setup.fixed  # a record in memory
    fixed.agreement, fixed.booked = AGREEMENT, False


def _copied(value: Any) -> Any:
    """Return arrays and records, in named tuples or not, as they are now."""
    return type(value)(*map(_copied, value)) if hasattr(value, "_fields") else value.copy()


def economical(setting: Setting, duration: float) -> Setting:
    """Return a setting in the steps of a diagnosis, with a given duration; commands keep their times, and the last
    one holds to the end.
    """
    trial = setting.trial
    on_grid = trial.commands is None or multiples(trial.commands.time, HULL_STEP_S)
    hull_step = max(trial.hull_step, HULL_STEP_S) if on_grid else trial.hull_step
    cable_step = max(trial.cable_step, CABLE_STEP_S)
    steps = int(np.ceil(duration / cable_step - 1e-9))
    made = replace(
        trial,
        hull_step=fitting_step(cable_step, hull_step),
        cable_step=cable_step,
        duration=steps * cable_step,
        segment_length=max(trial.segment_length, SEGMENT_M),
        every=0.0,
    )
    return replace(setting, trial=made)


def rougher(setting: Setting) -> Setting:
    """Return a setting in the steps of a diagnosis, with coarser ones for the hull and the cable's shape."""
    trial = setting.trial
    on_grid = trial.commands is None or multiples(trial.commands.time, ROUGH_HULL_STEP_S)
    hull_step = max(trial.hull_step, ROUGH_HULL_STEP_S) if on_grid else trial.hull_step
    made = replace(
        trial,
        hull_step=fitting_step(trial.cable_step, hull_step),
        segment_length=max(trial.segment_length, ROUGH_SEGMENT_M),
    )
    return replace(setting, trial=made)


def finer(setting: Setting) -> Setting:
    """Return a setting in fine steps, to measure the error of economical ones."""
    hull_step, cable_step, segment = FINE_STEPS
    trial = setting.trial
    cable_step = min(trial.cable_step, cable_step)
    made = replace(
        trial,
        hull_step=fitting_step(cable_step, min(trial.hull_step, hull_step)),
        cable_step=cable_step,
        segment_length=min(trial.segment_length, segment),
        every=0.0,
    )
    more, most = setting.trial.segment_length / made.segment_length, setting.most_work
    return replace(setting, trial=made, most_work=most and more * most)


def multiples(times: np.ndarray, step: float) -> bool:
    """Say whether all times are whole multiples of a step."""
    return bool(np.all(np.abs(times / step - np.round(times / step)) < 1e-6))


def respond(setting: Setting, times: np.ndarray, channels: Iterable[str]) -> dict[str, np.ndarray]:
    """Return the readings of the sensors.

    Args:
        setting: of the trial.
        times: when they are read (n,). [s]
        channels: names of `subzero.channels`, of those in `TRUTHS`.

    Returns:
        channel → values (n,) in its display unit; NaN from where the simulation failed. The last values hold after
            its end.
    """
    return read(setting, simulate_track(setting), times, channels)


def read(setting: Setting, run: Track, times: np.ndarray, channels: Iterable[str]) -> dict[str, np.ndarray]:
    """Return the readings of the sensors along a simulation, as `respond`."""
    grid, track = run
    shown = {name: sensed(setting.sensing.get(name), grid, truth(setting, track, name)) for name in channels}
    return {name: np.interp(setting.happened(times, name), grid, values) for name, values in shown.items()}


CACHE_BYTES, SETTINGS_KEPT = 250_000_000, 500
"""Simulations are kept until they take more memory than this [byte], settings up to this number; the oldest go first.
A search requests some 1500 simulations, of 180 kB each where the record lasts a minute; with a quarter of this
memory, one of six was repeated.
"""


@dataclass(kw_only=True, eq=False)
class _Store:
    """Simulations and settings that were made, of `size` bytes, protected by a lock."""

    tracks: OrderedDict[tuple[int, int, bytes], tuple[Track, Any]] = field(default_factory=OrderedDict)
    settings: OrderedDict[tuple[int, int, bytes], tuple[Setting, Any]] = field(default_factory=OrderedDict)
    size: int = 0
    lock: Lock = field(default_factory=Lock)


class RunCache:
    """Tracks by setting and entries (by identity of the objects) and deviations; safe for several threads.

    Attributes:
        asked: how many simulations were requested.
    """

    def __init__(self) -> None:
        """Begin empty."""
        self.asked, self._store = 0, _Store()

    def count(self, runs: int) -> None:
        """Count requested simulations; the search depends on their number, so none may be lost between threads."""
        with self._store.lock:
            self.asked += runs

    def setting(self, nominal: Setting, entries: Any, z: np.ndarray, make: Callable[[], Setting]) -> Setting:
        """Return the setting that was made of a nominal setting, entries (by identity of the objects) and
        deviations.
        """
        key, store = (id(nominal), id(entries), z.tobytes()), self._store
        with store.lock:
            found = store.settings.get(key)
        if found is None:
            found = make(), (nominal, entries)
            with store.lock:
                store.settings[key] = found
                if len(store.settings) > SETTINGS_KEPT:
                    store.settings.popitem(last=False)
        return found[0]

    def get(self, setting: Any, entries: Any, z: np.ndarray) -> Track | None:
        """Return the track that was made of these; None if there is none, or if it was dropped."""
        with self._store.lock:
            found = self._store.tracks.get((id(setting), id(entries), z.tobytes()))
        return found[0] if found else None

    def keep(self, setting: Any, entries: Any, z: np.ndarray, track: Track) -> None:
        """Keep a track with the objects that it was made of, so that no other object can take their identity."""
        key, store = (id(setting), id(entries), z.tobytes()), self._store
        with store.lock:
            if key not in store.tracks:
                store.tracks[key] = (track, (setting, entries))
                store.size += track[1].nbytes
            while store.size > CACHE_BYTES:
                (_, old), _ = store.tracks.popitem(last=False)[1]
                store.size -= old.nbytes
