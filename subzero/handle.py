"""A run held by one reference, so that a step from Python costs microseconds.

Compiled functions take a named tuple apart, array by array, each time Python calls them: with some fifty arrays that
costs more than the step itself. A `Handle` is taken apart once and then passed as one pointer.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np
from numba import types
from numba.experimental import structref

from cable.newton import Solved
from subzero.compiled import allocating
from subzero.loop import run_rows
from subzero.recording import Recording, record_row
from subzero.run_state import Live, Setup

FIELDS = ("setup", "live", "recording", "times")


@structref.register
class _HandleType(types.StructRef):
    """What compiled code takes a handle for."""

    def preprocess_fields(self, fields: Any) -> Any:
        """Let fields have no literal types."""
        return tuple((name, types.unliteral(kind)) for name, kind in fields)


class _Reference(structref.StructRefProxy):
    """A run as one pointer; the arrays must be kept alive by whoever made it."""


class _Interpreted(NamedTuple):
    """The same for code that is not compiled."""

    setup: Setup
    live: Live
    recording: Recording
    times: np.ndarray


structref.define_boxing(_HandleType, _Reference)
structref.define_constructor(_Reference, _HandleType, FIELDS)
Handle: Any = _Interpreted if numba.config.DISABLE_JIT else _Reference


@allocating
def hold(setup: Setup, live: Live, recording: Recording, times: np.ndarray) -> Any:
    """Return a handle of a run and the times of its rows (n,) [s]."""
    return Handle(setup, live, recording, times)


@allocating
def advance(
    handle: Any,
    row: int,
    count: int,
    used: int,
    n: float,
    rudder: float,
    port: float,
    starboard: float,
    seen: np.ndarray,
) -> tuple[int, int, int, Solved]:
    """Take some exchanges under one command, from a row that is written anew with that command.

    Args:
        handle: the run; its orders have one row.
        row: the present row.
        count: how many exchanges.
        used: nodes of the recording in use, those of the present row included.
        n: propeller command. [rev/s]
        rudder: rudder command. [rad]
        port: command of the port plane. [rad]
        starboard: command of the starboard plane. [rad]
        seen: filled with the new present row, in the order of `subzero.simulator.Observation`.

    Returns:
        the new present row, nodes in use, how it ended, and the cable's last solution.
    """
    command = handle.setup.orders.values
    command[0, 0], command[0, 1], command[0, 2], command[0, 3] = n, rudder, port, starboard
    before = used - handle.recording.nodes[row]
    used = record_row(handle.setup, handle.live, handle.recording, row, handle.times[row], before)
    after, used, ending, solved = run_rows(
        handle.setup, handle.live, handle.recording, handle.times, row + 1, row + 1 + count, used
    )
    observe(handle, after - 1, used, seen)
    return after - 1, used, ending, solved


@allocating
def observe(handle: Any, row: int, used: int, seen: np.ndarray) -> None:
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
