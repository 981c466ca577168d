"""One step of a tether whose ends a host moves, compiled, and the one piece of memory that it changes.

    advance      a whole step of the host: `time_loop.cover` along the way of both ends
    attempt      one inner step to trial places of the ends, as often as the host likes
    make_real    the last attempt becomes the present state, by `remeshing.accept`

All that changes stands in `Stepped.memory`: a copy of it is the state, and copying it back undoes a step. A step is
refused, with nothing changed, where an end jumps, where a place is no number, and where the ends are farther apart than
the cable between them can be.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numba
import numpy as np
from numba import types
from numba.experimental import structref

from cable.current import Water
from cable.drum import LENGTH, DrumNumbers
from cable.drum_motion import PLACE, SETPOINT, VELOCITY
from cable.moving_end.energy import book_step, energy_flow
from cable.moving_end.initial_shape import start_in_water
from cable.moving_end.remeshing import accept
from cable.moving_end.segment_load import Load, new_load
from cable.moving_end.state import NEW, Line
from cable.moving_end.time_loop import FIRST_STEP, Record, cover, new_record, note_force
from cable.moving_end.time_step import try_step
from cable.properties import CableNumbers
from cable.tow_path import TowPath
from subzero.jit import Record as Numbers
from subzero.jit import allocating, deferred_signals, inner

JUMP = 1.0
"""An end may miss the way of its mean velocity by this, and by as much as that way is long. [m]"""
NEARLY = 1e-9
"""Share of its length by which rounding may part the ends of a cable that cannot stretch. [-]"""
MOST_STRAIN = 1.0
"""A cable that is pulled to more than twice its length is a mistake. [-]"""

FINE, NO_NUMBER, JUMPED, TOO_FAR, EMPTY, FAILED = range(6)
"""How a step ended."""
SUGGESTED, TIME = range(2)
"""Entries of `now`: the next inner step [s], and the time [s]."""


class Stepped(NamedTuple):
    """All that a tether's step takes.

    Attributes:
        line: the cable, relative to the place of the second end at the start.
        path, led: motion of the first end, and of the second one with its winch, in the last step.
        record: the ledger of energies, and the count of inner steps.
        drum: the second end at the end of the inner step.
        now: `SUGGESTED` and `TIME`.
        memory, kept: the numbers of all of these, and a copy from before the step.
        water: how the water moves.
        cable: the cable's numbers.
        work: work space.
        origin: place of the second end at the start (3,). [m]
    """

    line: Line
    path: TowPath
    led: np.ndarray
    record: Record
    drum: DrumNumbers
    now: np.ndarray
    memory: np.ndarray
    kept: np.ndarray
    water: Water
    cable: CableNumbers
    work: Load
    origin: np.ndarray


@structref.register
class _HandleType(types.StructRef):
    """What compiled code takes a tether for."""

    def preprocess_fields(self, fields: Any) -> Any:
        """Declare that fields have no literal types."""
        return tuple((name, types.unliteral(kind)) for name, kind in fields)


class _Reference(structref.StructRefProxy):
    """A tether as one pointer, not forty arrays that each call would unpack; `Stepped` keeps them alive."""


structref.define_boxing(_HandleType, _Reference)
structref.define_constructor(_Reference, _HandleType, Stepped._fields)
Handle: Any = Stepped if numba.config.DISABLE_JIT else _Reference


@allocating
def make_handle(stepped: Stepped) -> Any:
    """Return the handle of a tether; `handle_of` makes it safely."""
    return Handle(*stepped)


def handle_of(stepped: Stepped) -> Any:
    """Return the handle of a tether. No signal breaks in: numba builds it by Python code and dies of an interrupt."""
    with deferred_signals():
        return make_handle(stepped)


@allocating
def begin(held: Any) -> None:
    """Fill the water around a cable that is laid out, its momenta, and the first row of the ledger."""
    start_in_water(held.line, held.water, held.cable, held.work)
    note_force(held.line)
    energy_flow(held.line, held.cable, held.work, held.record.ledger[1])


@allocating
def advance(
    held: Any, dt: float, ends: np.ndarray, control: int, asked: np.ndarray, most: float, rtol: float
) -> int:
    """Take one step of the host, in inner steps.

    Args:
        held: the tether.
        dt: how long. [s]
        ends: places and velocities of the ends after the step (ends, 2, 3). [m], [m/s]
        control: what decides on the pay-out (`cable.drum`).
        asked: of the winch, before and after the step (2,): length [m] or tension [N].
        most: all cable that there can be after the step. [m]
        rtol: error of an inner step. [-]

    Returns:
        how it ended; `FAILED` and `EMPTY` have to be taken back, by copying `kept` to `memory`.
    """
    refused = _refusal(held, dt, ends, most)
    if refused != FINE:
        return refused
    held.kept[:] = held.memory
    ending = _reach(held, dt, ends, control, asked, most, rtol)
    # Of a slack cable in very short steps there may be no solution, while the step of the host has one.
    if ending == FAILED and rtol > 0.0:
        held.memory[:] = held.kept
        ending = _reach(held, dt, ends, control, asked, most, 0.0)
    return ending


@allocating
def _reach(
    held: Any, dt: float, ends: np.ndarray, control: int, asked: np.ndarray, most: float, rtol: float
) -> int:
    """Go to the end of a step, in inner steps that err by `rtol`; return how it ended."""
    _lead(held, dt, ends, control, asked)
    _turn_winch(held.line, dt, control, asked)
    now, path, line = held.now, held.path, held.line
    suggested = now[SUGGESTED] if now[SUGGESTED] > 0.0 else FIRST_STEP * dt
    suggested = cover(
        line, path, 1, held.led, held.water, held.cable, held.drum, rtol, suggested, held.work, held.record
    )
    if not line.ends.solved.converged:
        return FAILED
    if _empty(line, control, most):
        return EMPTY
    now[SUGGESTED], now[TIME] = suggested, path.times[1]
    return FINE


@allocating
def attempt(
    held: Any, dt: float, ends: np.ndarray, control: int, asked: np.ndarray, most: float, again: bool
) -> int:
    """Solve one inner step of length dt, which `make_real` may accept; the arguments are those of `advance`.

    `again`: there was such an attempt before, for ends close by.
    """
    refused = _refusal(held, dt, ends, most)
    if refused != FINE:
        return refused
    if not again:
        held.kept[:] = held.memory
    _turn_winch(held.line, dt, control, asked)
    drum, line, tow = held.drum, held.line, np.empty(3)
    drum.control, drum.setpoint = control, asked[1]
    for i in range(3):
        tow[i] = ends[0, 0, i] - held.origin[i]
        if ends.shape[0] > 1:
            drum.place[i], drum.velocity[i] = ends[1, 0, i] - held.origin[i], ends[1, 1, i]
    mode = line.ends.drum_mode
    if try_step(line, dt, tow, held.water, held.cable, drum, held.work, again):
        return EMPTY if _empty(line, control, most) else FINE
    line.ends.drum_mode = mode
    return FAILED


@allocating
def make_real(held: Any, dt: float, ends: np.ndarray, control: int, asked: np.ndarray) -> None:
    """Make the last attempt the present state."""
    _lead(held, dt, ends, control, asked)
    accept(held.line, dt, held.cable, held.work)
    note_force(held.line)
    book_step(held.line, dt, held.cable, held.work, held.record.ledger)
    held.record.steps[1] += 1
    held.now[TIME] = held.path.times[1]


@inner
def _empty(line: Line, control: int, most: float) -> bool:
    """Return whether more cable has left the drum than there is."""
    free = control != LENGTH and not line.ends.layout.free_end
    return free and line.ends.settled + line.ends.last_length[NEW] > most


@allocating
def _refusal(held: Any, dt: float, ends: np.ndarray, most: float) -> int:
    """Return why the ends cannot be where they are asked to be; `most` is the cable between them, unstretched [m]."""
    for end in range(ends.shape[0]):
        miss, before, after = 0.0, 0.0, 0.0
        for i in range(3):
            x, v = held.path.place[1, i], held.path.arriving[1, i]
            if end == 1:
                x, v = held.led[1, PLACE + i], held.led[1, VELOCITY + i]
            miss += (ends[end, 0, i] - held.origin[i] - x - 0.5 * dt * (v + ends[end, 1, i])) ** 2
            before, after = before + v * v, after + ends[end, 1, i] ** 2
        if not miss < np.inf:
            return NO_NUMBER
        if np.sqrt(miss) > JUMP + 0.5 * dt * (np.sqrt(before) + np.sqrt(after)):
            return JUMPED
    if ends.shape[0] > 1:
        way = 0.0
        for i in range(3):
            way += (ends[0, 0, i] - ends[1, 0, i]) ** 2
        if np.sqrt(way) > most * (1.0 + (MOST_STRAIN if held.cable.compliance > 0.0 else NEARLY)):
            return TOO_FAR
    return FINE


@allocating
def _lead(held: Any, dt: float, ends: np.ndarray, control: int, asked: np.ndarray) -> None:
    """Write the motion of both ends in a step, and what the winch is asked for."""
    path, led = held.path, held.led
    path.times[0] = path.times[1]
    path.times[1] = path.times[0] + dt
    led[0, 0], led[1, 0] = path.times[0], path.times[1]
    for i in range(3):
        path.place[0, i], path.leaving[0, i] = path.place[1, i], path.arriving[1, i]
        path.place[1, i], path.arriving[1, i] = ends[0, 0, i] - held.origin[i], ends[0, 1, i]
        if ends.shape[0] > 1:
            led[0, PLACE + i], led[0, VELOCITY + i] = led[1, PLACE + i], led[1, VELOCITY + i]
            led[1, PLACE + i], led[1, VELOCITY + i] = ends[1, 0, i] - held.origin[i], ends[1, 1, i]
    led[0, SETPOINT], led[1, SETPOINT] = asked[0], asked[1]
    held.drum.control = control


@inner
def _turn_winch(line: Line, dt: float, control: int, asked: np.ndarray) -> None:
    """Let a winch that turns from the start on have turned before."""
    if control == LENGTH and line.ends.time == 0.0 and line.ends.previous_step == 0.0:
        for level in range(3):
            line.ends.payout[level] = (asked[1] - asked[0]) / dt


def packed(parts: Sequence[Any]) -> tuple[np.ndarray, list[Any]]:
    """Return one piece of memory, and arrays and records in it that are like the given ones, with their values."""
    sizes = [-(-part.nbytes // 8) for part in parts]
    memory, first, views = np.zeros(sum(sizes)), 0, []
    for part, size in zip(parts, sizes, strict=True):
        view = memory.view(np.uint8)[8 * first : 8 * first + part.nbytes].view(part.dtype)
        view = view if isinstance(part, Numbers) else view.reshape(part.shape)
        view[...] = part
        views.append(view[0] if isinstance(part, Numbers) else view)
        first += size
    return memory, views


def laid(
    line: Line,
    states: np.ndarray,
    origin: np.ndarray,
    drum: DrumNumbers,
    length: float,
    cable: CableNumbers,
    water: Water,
) -> Stepped:
    """Return what a tether's step takes, for a line that is laid out."""
    path = TowPath(*(np.zeros(shape) for shape in (2, (2, 3), (2, 3), (2, 3))))
    path.place[:], path.leaving[:], path.arriving[:] = states[0, 0] - origin, states[0, 1], states[0, 1]
    away, velocity = (states[1, 0] - origin, states[1, 1]) if len(states) > 1 else (np.zeros(3), np.zeros(3))
    rows = [[0.0, *away, *velocity, length]] * 2
    stepped = Stepped(
        line=line,
        path=path,
        led=np.array(rows),
        record=new_record(2, 1),
        drum=drum,
        now=np.zeros(2),
        memory=np.zeros(0),
        kept=np.zeros(0),
        water=water,
        cable=cable,
        work=new_load(),
        origin=np.array(origin),
    )
    return in_one_piece(stepped)


def in_one_piece(stepped: Stepped) -> Stepped:
    """Return the same with all that changes in one piece of memory."""
    line, path, record = stepped.line, stepped.path, stepped.record
    kept = ("steps", "ledger", "impulse")
    parts = [*line, *path, *(getattr(record, name) for name in kept), stepped.led, stepped.drum, stepped.now]
    memory, views = packed(parts)
    lines, ways = len(line), len(line) + len(path)
    return stepped._replace(
        line=Line(*views[:lines]),
        path=TowPath(*views[lines:ways]),
        record=record._replace(**dict(zip(kept, views[ways:], strict=False))),
        led=views[-3],
        drum=views[-2],
        now=views[-1],
        memory=memory,
        kept=memory.copy(),
    )
