"""The compiled time loop: exchange after exchange, row after row, no Python inside.

Stepped from outside (`subzero.simulation.stepper`), a run is held by one reference, so that a step from Python costs
microseconds: compiled functions unpack a named tuple, array by array, each time Python calls them, and with some fifty
arrays that costs more than the step itself. A `Handle` is unpacked once and then passed as one pointer.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np
from numba import types
from numba.experimental import structref

from subzero.engine.coupling import FINE, exchange
from subzero.engine.recording import Recording, note, record_row, row_of
from subzero.engine.run_state import Live, Setup
from subzero.jit import allocating, compiled, deferred_signals, expanded
from subzero.jit.intrinsics import add
from subzero.jit.intrinsics import exchange as exchange_number

NO_SPACE = 4
"""The allocated memory is nearly full: enlarge it and go on. The other endings are in `coupling`."""
SPARE = 8
"""Nodes that one exchange may add. (A tow point at 40 segments a second would need more: `coupling.FASTEST`.)"""


@compiled
def run_rows(
    setup: Setup,
    live: Live,
    recording: Recording,
    times: np.ndarray,
    first: int,
    last: int,
    used: int,
    parts: int,
    stride: int,
) -> tuple[int, int, int]:
    """Advance from times[first − 1] to times[last − 1], and fill the rows of a recording on the way.

    Args:
        setup: the constants.
        live: the state; at times[first − 1] when called.
        recording: filled.
        times: of the run (n,). [s]
        first: time to begin with; 0 writes the row of the start, too.
        last: time to end before.
        used: nodes of the recording in use, in rows that are kept.
        parts: exchanges from a time to the next.
        stride: every so many times are kept as a row, see `recording`.

    Returns:
        number of times that are done, nodes in use in rows that are kept, and the ending (`coupling.FINE` …);
        `line.ends.solved` holds how the cable's last step was solved.
    """
    for at in range(first, last):
        ending = _reach(setup, live, recording, times, at, used, parts) if at > 0 else FINE
        if ending != FINE:
            return at, used, ending
        row = row_of(at, stride)
        after = record_row(setup, live, recording, row, times[at], used)
        note(recording, row, at, live.now)
        if at % stride == 0:  # the row is kept; else the next one is written over it
            used = after
    return last, used, FINE


@expanded
def _reach(
    setup: Setup, live: Live, recording: Recording, times: np.ndarray, at: int, used: int, parts: int
) -> int:
    """Go from times[at − 1] to times[at]; return how that ended.

    Arrays cannot grow in here: stop before they are full, so that Python can enlarge them and call again.
    """
    nodes, space = live.line.ends.count + 1 + SPARE * parts, live.line.length.size
    if setup.fixed.tethered and (nodes > space or used + space > recording.tension.size):
        return NO_SPACE
    span = (times[at] - times[at - 1]) / parts
    for part in range(parts):
        ending = exchange(setup, live, times[at - 1] + part * span, span)
        if ending != FINE:
            return ending
    return FINE


FIELDS = ("setup", "live", "recording", "times")


@structref.register
class _HandleType(types.StructRef):
    """What compiled code takes a handle for."""

    def preprocess_fields(self, fields: Any) -> Any:
        """Declare that fields have no literal types."""
        return tuple((name, types.unliteral(kind)) for name, kind in fields)


class _Reference(structref.StructRefProxy):
    """A run as one pointer; the caller that made it must keep the arrays alive."""


class _Batch(structref.StructRefProxy):
    """Some runs as one pointer."""


class _Interpreted(NamedTuple):
    """The same for code that is not compiled."""

    setup: Setup
    live: Live
    recording: Recording
    times: np.ndarray


class _InterpretedBatch(NamedTuple):
    """The same of some runs, see `hold_batch`."""

    handles: tuple[Any, ...]
    at: tuple[np.ndarray, ...]
    seen: tuple[np.ndarray, ...]
    orders: np.ndarray
    shown: np.ndarray
    reached: np.ndarray
    taken: np.ndarray
    done: np.ndarray


structref.define_boxing(_HandleType, _Reference)
structref.define_constructor(_Reference, _HandleType, FIELDS)
structref.define_constructor(_Batch, _HandleType, _InterpretedBatch._fields)
Handle: Any = _Interpreted if numba.config.DISABLE_JIT else _Reference
Batch: Any = _InterpretedBatch if numba.config.DISABLE_JIT else _Batch


ROW, USED, ENDING = range(3)
"""The position of a held run (3,): the present row, nodes of the recording in use, and how the last step ended.

Compiled code writes it, so that it is true whenever Python code runs, an interrupt's handler among it.
"""


def hold(setup: Setup, live: Live, recording: Recording, times: np.ndarray) -> Any:
    """Return a handle of a run and the times of its rows (n,) [s].

    No signal breaks in: numba builds the object by Python code and dies of an interrupt in there.
    """
    with deferred_signals():
        return make_handle(setup, live, recording, times)


@allocating
def make_handle(setup: Setup, live: Live, recording: Recording, times: np.ndarray) -> Any:
    """Return a handle of a run; `hold` makes it safely."""
    return Handle(setup, live, recording, times)


def hold_batch(
    handles: Any, at: Any, seen: Any, orders: np.ndarray, shown: np.ndarray, reached: np.ndarray
) -> Any:
    """Return a handle of some runs at once, which any number of threads advance together: `begin`, `share`.

    Args:
        handles: of the runs, a tuple.
        at: where each stands, a tuple of arrays; changed, with its ending.
        seen: what each fills, a tuple of arrays.
        orders: command of each (runs, 4), in the units of `advance`.
        shown: filled with `seen` of all (runs, entries).
        reached: filled with the row that each was to reach, and how that ended (runs, 2).
    """
    counts = np.full(1, len(handles)), np.full(1, len(handles))
    with deferred_signals():
        return make_batch(handles, at, seen, orders, shown, reached, *counts)


@allocating
def make_batch(
    handles: Any,
    at: Any,
    seen: Any,
    orders: np.ndarray,
    shown: np.ndarray,
    reached: np.ndarray,
    taken: np.ndarray,
    done: np.ndarray,
) -> Any:
    """Return a handle of some runs, of which so many are taken and done; `hold_batch` makes it safely."""
    return Batch(handles, at, seen, orders, shown, reached, taken, done)


@allocating
def advance(
    handle: Any,
    at: np.ndarray,
    count: int,
    n: float,
    rudder: float,
    port: float,
    starboard: float,
    seen: np.ndarray,
) -> int:
    """Take some exchanges under one command, from a row that is written again with that command.

    Args:
        handle: the run; its orders have one row.
        at: where the run stands (ROW, USED, ENDING); changed.
        count: how many exchanges.
        n: propeller command. [rev/s]
        rudder: rudder command. [rad]
        port: command of the port plane. [rad]
        starboard: command of the starboard plane. [rad]
        seen: filled with the new present row, in the order of `subzero.simulation.stepper.Observation`.

    Returns:
        how it ended, which at[ENDING] says, too.
    """
    command = handle.setup.orders.values
    command[0, 0], command[0, 1], command[0, 2], command[0, 3] = n, rudder, port, starboard
    row = at[ROW]
    before = at[USED] - handle.recording.nodes[row]  # the present row is written again, under the new command
    used = record_row(handle.setup, handle.live, handle.recording, row, handle.times[row], before)
    after, used, ending = run_rows(
        handle.setup, handle.live, handle.recording, handle.times, row + 1, row + 1 + count, used, 1, 1
    )
    at[ROW], at[USED], at[ENDING] = after - 1, used, ending
    observe(handle, after - 1, seen)
    return ending


@allocating
def begin(batch: Any) -> None:
    """Let threads take the runs of a batch, whose orders are written, and which no thread advances."""
    exchange_number(batch.done, 0)
    exchange_number(batch.taken, 0)


LOOKS = 20_000
"""So often `share` looks for what other threads have done: for some 0.1 ms, about as long as a thread takes to wake."""


@allocating
def share(batch: Any, count: int, waits: bool) -> bool:
    """Take so many exchanges of each run of a batch that no thread has taken yet, one after another.

    A thread that is late has less to do, or nothing; the lock of Python is let go of once. One that `waits` looks for
    the next `begin` for a while, the others for the end of this one.

    Returns:
        whether all runs are done; another thread may still be busy with one.
    """
    runs, looks = len(batch.handles), 0
    _take(batch, count)
    while looks < LOOKS and (waits or add(batch.done, 0) < runs):
        looks += 1
        if waits and add(batch.taken, 0) < runs:
            _take(batch, count)
            looks = 0
    return bool(add(batch.done, 0) == runs)


@allocating
def _take(batch: Any, count: int) -> None:
    """Advance runs that no thread has taken, as long as there are any; one without rows for that has `NO_SPACE`."""
    orders, i = batch.orders, add(batch.taken, 1)
    while i < len(batch.handles):
        handle, at, goal = batch.handles[i], batch.at[i], batch.at[i][ROW] + count
        n, rudder, port, starboard = orders[i, 0], orders[i, 1], orders[i, 2], orders[i, 3]
        if goal < handle.times.size:
            advance(handle, at, count, n, rudder, port, starboard, batch.seen[i])
        else:
            at[ENDING] = NO_SPACE
        batch.reached[i, 0], batch.reached[i, 1] = goal, at[ENDING]
        batch.shown[i] = batch.seen[i]
        add(batch.done, 1)
        i = add(batch.taken, 1)


@allocating
def observe(handle: Any, row: int, seen: np.ndarray) -> None:
    """Fill `seen` with a row; the heading goes on from the one that stands there, without jumps."""
    r, before = handle.recording, seen[6]
    seen[0] = handle.times[row]
    for i in range(3):
        seen[1 + i] = r.state[row, i]
        seen[4 + i] = r.attitude[row, i]
        seen[14 + i] = r.fins[row, i]
    seen[6] += 2.0 * np.pi * np.round((before - seen[6]) / (2.0 * np.pi))
    for i in range(6):
        seen[7 + i] = r.state[row, 7 + i]
        seen[21 + i] = r.wrench[row, i]
    seen[13] = r.state[row, 13]
    seen[17] = r.voltage[row]
    seen[18] = r.length[row]
    size = 0.0
    for i in range(3):
        size += r.tow_force[row, i] * r.tow_force[row, i]
    seen[19] = np.sqrt(size)
    seen[20] = r.drum_tension[row]
