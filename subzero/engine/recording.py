"""The results of a run: one row per time of the run, or per so many, shapes packed one after another.

Every time writes its row. Where only every so many are kept (`stride`), the next one writes over it: so the rows that
are kept are the same to the last bit as without, and the last one is where the run ended.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf
from time import perf_counter
from typing import NamedTuple

import numpy as np

from cable.moving_end import NOW, paid_out
from subzero.engine.external_wrench import row_at, sample_current, tow_wrench
from subzero.engine.run_state import IMPULSE, OVERLOAD, PEAK, Live, Now, Setup
from subzero.engine.station_keeping import steer
from subzero.jit import compiled
from vehicle import BREAKDOWN, STATE_SIZE, battery_voltage, breakdown, deflections, euler_angles
from vehicle.channels import FIRST_COMMAND

BREATH_S = 0.1
"""Compiled code computes for about so long before Python moves the progress bar and handles an interrupt. [s]"""
TUG, TUG_SIZE = 4, 3
"""First column of `Now.tug` in the trace, and how many there are."""
SNAP_SHARE = 0.1
"""A pull lasts as long as it is, on average from one result to the next, more than this share of the strongest. [-]"""
MOST_QUICKER = 4.0
"""So many times as many rows are filled at a time as the last time, at most: with more cable, later ones take longer.
[-]"""


class Recording(NamedTuple):
    """The rows of a run, filled up to some row.

    Attributes:
        trace: force of the cable on the hull, body axes [N], number of nodes, and `Now.tug` since the time before, at
            every time of the run, of rows that are not kept, too (times, 7).
        state: as in `Live` (n, entries of the state).
        attitude: roll, pitch, heading (n, 3). [rad]
        rotation: R_nb (n, 3, 3).
        fins: rudder, port and starboard plane in the water (n, 3). [rad]
        command: (n, 4 and one for each channel). [rev/s, rad; units of the channels]
        voltage: of the battery (n,). [V]
        tow_force: pull of the cable, earth axes (n, 3). [N]
        wrench: the same on the hull, body axes, with its moment (n, 6). [N, N m]
        drum_tension, length: (n,). [N, m]
        courant: √(T/m1) Δt/ℓ, how many segments a transverse wave crosses in an exchange, at most (n,). [-]
        iterations: of Newton's method on the cable since the start (n,).
        breakdown: every term of the hull (n, terms, 6). [N, N m]
        energy: rows of `subzero.engine.energy` (n, 7). [J]
        nodes: how many (n,), 0 without a cable.
        position, tension: nodes of all rows, relative to the drum (all, 3) [m]; tension there (all,). [N]
        arc_length: s of those nodes, unstretched cable between the tow point and the node (all,). [m]
    """

    trace: np.ndarray
    state: np.ndarray
    attitude: np.ndarray
    rotation: np.ndarray
    fins: np.ndarray
    command: np.ndarray
    voltage: np.ndarray
    tow_force: np.ndarray
    wrench: np.ndarray
    drum_tension: np.ndarray
    length: np.ndarray
    courant: np.ndarray
    iterations: np.ndarray
    breakdown: np.ndarray
    energy: np.ndarray
    nodes: np.ndarray
    position: np.ndarray
    tension: np.ndarray
    arc_length: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Run:
    """A finished run in plain arrays.

    Attributes:
        times: of the rows that are kept (n,). [s]
        recording: these rows.
        all_times: of the recording's trace, with rows that are not kept; empty where it has none. [s]
        completed: it reached its end.
        message: how it ended, in words.
    """

    times: np.ndarray
    recording: Recording
    all_times: np.ndarray = field(default_factory=lambda: np.zeros(0))
    completed: bool
    message: str

    @property
    def snap(self) -> dict[str, float]:
        """How hard the cable pulled between the results, of a run whose cable can come taut; else empty.

        peak_tension_N, and when, time_of_peak_s, within the time between two results; impulse_N_s ∫|F|dt of the
        strongest pull, from when it begins until it is over; time_above_strength_s of all the run. Exchanges follow a
        snap with steps of their own, so the peak is not missed between samples. A cable that does not stretch has an
        impulse only: what it pulls with when it comes taut is a force only as far as one says in what time.
        """
        tug = self.recording.trace[:, TUG:]
        if self.all_times.size < 2 or tug.shape != (self.all_times.size, TUG_SIZE) or not tug.any():
            return {}
        mean, peak = tug[1:, IMPULSE] / np.diff(self.all_times), int(tug[:, PEAK].argmax())
        low, strongest = np.flatnonzero(mean < SNAP_SHARE * mean.max()), int(mean.argmax())
        first = low[low < strongest].max(initial=-1) + 1
        last = low[low > strongest].min(initial=mean.size)
        impulse = {"impulse_N_s": float(tug[1 + first : 1 + last, IMPULSE].sum())}
        if not tug[peak, PEAK] > 0.0:
            return impulse
        return {
            "peak_tension_N": float(tug[peak, PEAK]),
            "time_of_peak_s": float(self.all_times[peak]),
            **impulse,
            "time_above_strength_s": float(tug[:, OVERLOAD].sum()),
        }


class Grid(NamedTuple):
    """The times of a run and the rows to keep.

    Attributes:
        times: (n,). [s]
        parts: in how many exchanges it goes from one to the next.
        stride: every so many of them one is kept as a row.
        booked: energies are summed up.
        iterations: of Newton's method on the cable, after which it is given up.
    """

    times: np.ndarray
    parts: int = 1
    stride: int = 1
    booked: bool = True
    iterations: float = inf


class RunState(NamedTuple):
    """The position of a run between two calls of `subzero.engine.time_loop.run_rows`.

    Attributes:
        setup, live, recording: the run.
        behind: how many of its times are done.
        used: nodes of the recording in use, in rows that are kept.
        ending: how the last call ended.
    """

    setup: Setup
    live: Live
    recording: Recording
    behind: int
    used: int
    ending: int


class Pace:
    """How many rows compiled code fills at a time, from one on to as many as it fills within `BREATH_S`.

    Attributes:
        rows: how many; measured again each time that it is entered and left.
    """

    def __init__(self) -> None:
        """Begin with one row."""
        self.rows, self._begin = 1, 0.0

    def __enter__(self) -> None:
        """Begin to fill rows."""
        self._begin = perf_counter()

    def __exit__(self, *_: object) -> None:
        """See how long it took."""
        share = BREATH_S / max(perf_counter() - self._begin, 1e-6)
        self.rows = max(1, int(self.rows * min(share, MOST_QUICKER)))


def new_recording(rows: int, nodes: int, times: int = 0, entries: int = STATE_SIZE) -> Recording:
    """Return an empty recording of `rows` rows of states with so many entries, with space for `nodes` nodes in all, and
    a trace of `times` times.
    """
    shapes = {
        "trace": (times, TUG + TUG_SIZE),
        "state": (rows, entries),
        "attitude": (rows, 3),
        "rotation": (rows, 3, 3),
        "fins": (rows, 3),
        "command": (rows, FIRST_COMMAND + entries - STATE_SIZE),
        "tow_force": (rows, 3),
        "wrench": (rows, 6),
        "breakdown": (rows, len(BREAKDOWN), 6),
        "energy": (rows, 7),
        "position": (nodes, 3),
    }
    flat = dict.fromkeys(("voltage", "drum_tension", "length", "courant"), rows)
    flat |= dict.fromkeys(("tension", "arc_length"), nodes)
    arrays = {name: np.zeros(shape) for name, shape in (shapes | flat).items()}
    return Recording(**arrays, nodes=np.zeros(rows, np.int64), iterations=np.zeros(rows, np.int64))


@compiled
def record_row(setup: Setup, live: Live, recording: Recording, row: int, time: float, used: int) -> int:
    """Write a row for the present state; return how many nodes are in use after it (`used` before)."""
    state, r = live.state, recording
    command = setup.orders.values[row_at(setup.orders.time, time)]
    if setup.station.track.shape[0] > 0:
        steer(setup.station, setup.fixed.vehicle, state, time, command)
    tow_wrench(state, live.now.force, setup.fixed.r_c, live.now.hull)  # fills hull.rotation, too
    for i in range(state.size):
        r.state[row, i] = state[i]
    for i in range(min(command.size, r.command.shape[1])):
        r.command[row, i] = command[i]
    angles = euler_angles(state[3:7])
    for i in range(3):
        r.attitude[row, i] = angles[i]
        r.tow_force[row, i] = live.now.force[i]
        for k in range(3):
            r.rotation[row, i, k] = live.now.hull.rotation[i, k]
    for i in range(6):
        r.wrench[row, i] = live.now.hull.wrench[i]
    for i in range(7):
        r.energy[row, i] = live.now.ledger.total[i]
    r.fins[row, 0], r.fins[row, 1], r.fins[row, 2] = deflections(state, command, setup.fixed.vehicle)
    if not setup.fixed.prescribed:
        water, wrench = live.now.hull.current, live.now.hull.wrench
        sample_current(setup, state, time, live.now.hull)
        breakdown(state, command, water, wrench, setup.fixed.vehicle, r.breakdown[row])
        r.voltage[row] = battery_voltage(state, command, water, setup.fixed.vehicle)
    r.iterations[row] = live.now.iterations
    m1 = setup.fixed.cable.mass + setup.fixed.cable.added_mass
    return _record_cable(live, r, row, used, m1) if setup.fixed.tethered else used


@compiled
def _record_cable(live: Live, r: Recording, row: int, used: int, m1: float) -> int:
    """Write the cable's part of a row."""
    line = live.line
    N, step = line.ends.count, line.ends.previous_step
    r.courant[row] = 0.0
    r.drum_tension[row] = line.node_tension[N]
    r.length[row] = paid_out(line)
    r.arc_length[used] = 0.0
    for j in range(N + 1):
        for i in range(3):
            r.position[used + j, i] = line.position[NOW, j, i]
        r.tension[used + j] = line.node_tension[j]
        if j > 0:
            piece = line.length[j] if j < N else line.ends.last_length[NOW]
            r.arc_length[used + j] = r.arc_length[used + j - 1] + piece
        if 0 < j < N:
            # speed √(T/m₁) of a transverse wave; m₁ with the water that moves along
            wave = np.sqrt(max(line.tension[NOW, j], 0.0) / m1)
            r.courant[row] = max(r.courant[row], wave * step / line.length[j])
    r.nodes[row] = N + 1
    return used + N + 1


@compiled
def note(recording: Recording, row: int, time: int, now: Now) -> None:
    """Enter a row that was just written in the trace, as that of time number `time`; if there is a trace."""
    if time < recording.trace.shape[0]:
        for i in range(3):
            recording.trace[time, i] = recording.wrench[row, i]
        for i in range(TUG_SIZE):
            recording.trace[time, TUG + i] = now.tug[i]
            now.tug[i] = 0.0
        recording.trace[time, 3] = recording.nodes[row]


@compiled
def row_of(time: int, stride: int) -> int:
    """Return the row that time number `time` is written to, where every `stride` times one is kept."""
    return (time + stride - 1) // stride


BY_NODE, BY_TIME = ("position", "tension", "arc_length"), ("trace",)
"""Fields that have one line a node, or one a time of the run; the others have one a row."""


def cut(recording: Recording, rows: int, used: int) -> Recording:
    """Return the part of a recording that is filled; its trace is not changed."""
    return _part(recording, slice(rows), slice(used))


def thinned(run: Run, stride: int) -> Run:
    """Return every so many rows of a run, and its last one."""
    rows = np.arange(run.times.size)
    keep = (rows % stride == 0) | (rows == rows[-1])
    part = _part(run.recording, keep, np.repeat(keep, run.recording.nodes))
    return replace(run, times=run.times[keep], recording=part)


def _part(recording: Recording, rows: slice | np.ndarray, nodes: slice | np.ndarray) -> Recording:
    """Return some rows and some nodes of a recording, and its whole trace."""
    which = dict.fromkeys(BY_NODE, nodes) | dict.fromkeys(BY_TIME, slice(None))
    return Recording(*(values[which.get(name, rows)] for name, values in recording._asdict().items()))


def run_so_far(
    grid: Grid, recording: Recording, behind: int, used: int, message: str, *, completed: bool
) -> Run:
    """Return a run with so many times done, and `used` nodes in the rows that are kept for good."""
    times, last = grid.times[:behind], row_of(behind - 1, grid.stride)
    if (behind - 1) % grid.stride:
        used += int(recording.nodes[last])
    rows = cut(recording, last + 1, used)
    return Run(
        times=np.append(times[: -1 : grid.stride], times[-1:]),
        recording=rows._replace(trace=recording.trace[:behind]),
        all_times=times,
        completed=completed,
        message=message,
    )
