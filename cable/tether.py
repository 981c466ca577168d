"""A tether that another simulator steps: the host moves its ends, the tether answers with the forces on them.

    >>> elastic = CableProperties(compliance=1e-4)                       # EA = 10 kN, all else as in Table 1
    >>> tether = Tether(elastic, length=12.0, ends=[(10.0, 0.0, 5.0), (0.0, 0.0, 0.0)])    # north, east, down [m]
    >>> forces = tether.step(0.1, [(10.05, 0.0, 5.0), (0.0, 0.0, 0.0)])  # where the ends are 0.1 s later
    >>> forces.shape, tether.time, round(tether.length, 6)
    ((2, 3), 0.1, 12.0)

In a step of the host the ends move along the cubic through their places and velocities at its beginning and its end.
The tether takes as many inner steps as the error of the force asks for (`moving_end.time_loop.cover`). It is the cable
of `cable.pull_out` and `cable.tow`: where a host makes their steps it gives their numbers to the last bit.

A force is that of the tether on its end: a taut tether pulls its first end towards its second one, and back. The first
end is a point of the cable; at the second one it may be paid out and reeled in, as at a drum. A tether with one end
only is towed, and its tail is free.

Tethers share nothing, and a step runs without Python's lock: many threads may step at once, each a tether of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any
from uuid import uuid4

import numpy as np

from cable.clamps import Clamps
from cable.current import Current
from cable.drum import LENGTH, DrumNumbers, DrumProperties
from cable.drum_motion import PLACE, SETPOINT, VELOCITY
from cable.history import Equilibrium
from cable.hold import hold
from cable.modes import Modes, find_modes
from cable.moving_end.energy import LOSS, STORED
from cable.moving_end.host_step import (
    EMPTY,
    FINE,
    JUMP,
    JUMPED,
    NO_NUMBER,
    TIME,
    TOO_FAR,
    Stepped,
    advance,
    attempt,
    begin,
    handle_of,
    in_one_piece,
    laid,
    make_real,
)
from cable.moving_end.initial_shape import (
    lay_held,
    straight_between,
    towed,
    trail,
)
from cable.moving_end.state import NOW, Line, enlarged, new_line
from cable.moving_end.stops import Names, describe_bad_number, describe_jump, describe_reach, describe_stop
from cable.properties import CableProperties
from cable.schemes import COARSEST, FINEST, SHORTEST_S, TOLERANCE
from cable.sea_bed import SeaBed
from cable.sections import AnyCable
from cable.task import START_LENGTH, Drum, current_of
from cable.tow_path import segments_needed
from cable.winch import SHORTEST, Brake, ConstantTension, PayOutRate
from subzero.arguments import checked_arguments, numbers_in
from subzero.errors import BadValueError, UserError, checked, short, whole

Ends = Sequence[Any] | np.ndarray
"""(place, velocity) of each end, or its place only; north, east, down. [m], [m/s]"""

SEGMENTS = 50
"""Number of segments if none is given."""
RTOL = 5e-3
"""Error of the force that an inner step may make if none is given, as a share of the largest force so far. [-]"""
ATOL = 0.01
"""The same in newtons: what a slack tether does below it is of no account. [N]"""
STRAIGHT = 1e-9
"""A cable that is as long as the way between its ends, but for this share, is laid straight. [-]"""
SPARE = 8
"""Segments that are allocated for a cable that grows, beyond those that the next step needs."""
SUDDEN = 2.0
"""An end whose places alone are given may take up so much speed within a step. [m/s]"""
MOVED = 1e-6
"""Displacement of an end in `Tether.linearise`, as a share of the cable's length. [-]"""


class TetherError(UserError, ValueError):
    """A step that is refused, or has no solution: what, where, why, the advice. The tether is as it was before."""


@dataclass(frozen=True, kw_only=True)
class TetherState:
    """A state that the tether which saved it can return to.

    Attributes:
        time: at which it was saved. [s]
        owner: identity of the tether.
        winch: the command that held.
        capacity: number of segments that `memory` has space for.
        memory: all numbers of the tether.
    """

    time: float
    owner: str
    winch: Drum
    capacity: int
    memory: np.ndarray = field(repr=False)


class Tether:
    """A cable in water between two ends that a host moves; the module has an example.

    Attributes:
        cable: the cable's properties.
        current: how the water moves, in the axes of the ends.
    """

    @checked_arguments
    def __init__(
        self,
        cable: AnyCable | None = None,
        *,
        ends: Sequence[Any] | np.ndarray,
        length: float | None = None,
        winch: Drum | None = None,
        longest: float | None = None,
        current: Sequence[float] | np.ndarray | Current | None = None,
        segments: int | None = None,
        segment_length: float | None = None,
        drogue_drag_area: float = 0.0,
        bed: SeaBed | None = None,
        clamps: Clamps | None = None,
        surface: float | None = None,
        rtol: float = RTOL,
        atol: float = ATOL,
        tolerance: float = TOLERANCE,
    ) -> None:
        """Lay the cable out: at rest between its ends (`cable.hold`), straight, or, with one end, steadily towed.

        Args:
            cable: the cable; Table 1 of the source when not given.
            ends: places of the ends (2, 3), or with their velocities (2, 2, 3); of one end for a cable with a free
                tail. In earth axes north, east, down. [m], [m/s]
            length: unstretched; the way between the ends when not given, and the cable is then straight. [m]
            winch: at the second end: a winch of `cable.winch` or a free drum; a brake, which is a fixed length, when
                not given.
            longest: all cable that there is, in the water and on the drum; without limit when not given. [m]
            current: velocity of the water (3,) [m/s], or a `cable.Current` of places in the axes of the ends and of
                the tether's time, felt at each node; still water when not given.
            segments: how many; 50 when neither this nor `segment_length` is given.
            segment_length: how long they are, also those of cable that is paid out later. [m]
            drogue_drag_area: C_d A of a drogue at the free tail. [m²]
            bed: the sea bed, in the axes of the ends; none when not given.
            clamps: directions in which a cable with bending stiffness leaves its ends; hinges when not given. The
                second end may be clamped only where a brake holds it.
            surface: depth of a free surface, in the axes of the ends; water everywhere when not given. [m]
            rtol: error of the force that an inner step may make, as a share of the largest force so far; 0 takes the
                steps of the host as they are.
            atol: an error that it may make in any case. [N]
            tolerance: how exactly a step is solved, see `cable.MovingEnd`.

        Raises:
            subzero.UserError: ends, a length or segments that make no sense, or no cable at rest between the ends.
        """
        self._tried: tuple[float, np.ndarray, Drum, np.ndarray] | None = None
        self.cable = CableProperties() if cable is None else cable
        self.current, self._bed, self._owner = current_of(current), bed, uuid4().hex
        self._clamps, self._surface = clamps, surface
        states = _checked_ends("Tether", ends, None)
        self._ends, two = len(states), len(states) == 2
        self._winch: Drum = DrumProperties() if not two else Brake() if winch is None else winch
        if not two and (winch is not None or length is None):
            raise BadValueError(
                "Tether: a tether with one end has a free tail: give its length, and no winch."
            )
        self._rtol = checked("Tether", "rtol", rtol, least=0.0, most=0.5)
        atol = checked("Tether", "atol", atol, least=0.0)
        way = float(np.linalg.norm(states[0, 0] - states[-1, 0]))
        start = max(way, START_LENGTH) if length is None else checked("Tether", "length", length, above=0.0)
        self._longest = (
            inf if longest is None else checked("Tether", "longest", longest, least=start, unit="m")
        )
        each = _segment_length(start, segments, segment_length)
        around: dict[str, Any] = {"bed": bed, "clamps": clamps, "surface": surface}
        drum, c = self._winch.numbers(), self.cable.numbers(**around)
        if clamps is not None and clamps.second is not None and not (two and isinstance(self._winch, Brake)):
            raise BadValueError(
                "Tether: the second end is clamped; only what a cable.Brake holds can be. Leave Clamps.second out."
            )
        if bed is not None:
            bed.refuse_below(states[:, 0], "Tether")
        if not two:
            tail_drag = (
                0.5 * self.cable.water_density * checked("", "drogue_drag_area", drogue_drag_area, least=0.0)
            )
            J = self.current.at(states[0, 0])
            line = towed(self.cable, states[0, 1:], start, each, J, tail_drag)
            origin = line.ends.origin[:] = states[0, 0] - line.position[NOW, 0]
            trail(line, bed, surface)
        elif abs(start - way) <= STRAIGHT * start or way <= START_LENGTH >= start:
            line, origin = straight_between(states, start, each, drum, c), states[1, 0]
        else:
            rate = _rate_at_start(self._winch)
            passing = _passing(self.current, states, rate)
            rest = hold(states[:, 0], start, passing, cable=self.cable, segment_length=each, **around)
            line, origin = _from_rest(rest, states, drum, rate), states[1, 0]
        line.ends.origin[:] = origin
        line.ends.solver.tolerance = checked("Tether", "tolerance", tolerance, least=FINEST, most=COARSEST)
        water = self.current.numbers(origin)
        self._take(laid(line, states, origin, drum, start, c, water))
        if self._rtol > 0.0:
            self._line.ends.tow.largest = atol / self._rtol  # errors are shares of it
        begin(self._held)

    @property
    def time(self) -> float:
        """Time since the start. [s]."""
        return float(self._stepped.now[TIME])

    @property
    def length(self) -> float:
        """Unstretched length between the ends, with what lies loose before a drum that runs ahead. [m]."""
        ends = self._line.ends
        return float(ends.settled + ends.last_length[NOW] + ends.loose[NOW])

    @property
    def shape(self) -> np.ndarray:
        """Places of the nodes, the first end first, earth axes (nodes, 3). [m]."""
        shape: np.ndarray = self._line.position[NOW, : int(self._line.ends.count) + 1] + self._stepped.origin
        return shape

    @property
    def tension(self) -> np.ndarray:
        """Tension at the nodes (nodes,). [N]."""
        return self._line.node_tension[: int(self._line.ends.count) + 1].copy()

    @property
    def forces(self) -> np.ndarray:
        """Force of the tether on each end, earth axes (ends, 3). [N]."""
        forces = np.empty((self._ends, 3))
        forces[0] = self._on_first
        if self._ends > 1:
            np.negative(self._on_second, out=forces[1])
        return forces

    @property
    def winch(self) -> Drum:
        """The command that holds at the second end."""
        return self._winch

    @property
    def inner_steps(self) -> int:
        """Number of inner steps so far."""
        return int(self._stepped.record.steps[1])

    @property
    def energy_residual(self) -> float:
        """Residual of the balance of `moving_end.energy` so far, as a share of the work and the loss. [-]."""
        total = self._stepped.record.ledger[2]
        return float(abs(total[STORED]) / max(total[LOSS], 1e-30))

    def step(self, dt: float, ends: Ends, winch: Drum | None = None) -> np.ndarray:
        """Go on by dt, with the ends where the host has them then; return the forces on them at that time.

        Args:
            dt: how long, any length. [s]
            ends: places and velocities of the ends after the step (ends, 2, 3), or places only (ends, 3), to which
                they then move evenly. [m], [m/s]
            winch: a command that holds from now on; the one before when not given.

        Returns:
            force of the tether on each end, earth axes (ends, 3). [N]

        Raises:
            TetherError: an end that jumps, a place that is no number, ends farther apart than the cable can be, a winch
                beyond its drum, no solution. The tether is as it was before.
        """
        self._forget_attempt()
        dt, states, winch, asked = self._asked(dt, ends, winch)
        numbers = winch.numbers() if winch is not self._winch else None
        kind = self._stepped.drum.control if numbers is None else numbers.control
        most = asked[1] if kind == LENGTH else self._longest
        ending = advance(self._held, dt, states, kind, asked, most, self._rtol)
        if ending != FINE:
            raise TetherError(self._refused(ending, dt, states, most))
        self._winch = winch
        return self.forces

    def attempt(self, dt: float, ends: Ends, winch: Drum | None = None) -> np.ndarray:
        """Return the forces that there would be after one inner step of dt; the tether does not move on.

        For a host that looks for the motion with which both agree: it tries places of the ends, one attempt after the
        other, and makes the last one real by `accept`. Arguments, result and errors are those of `step`.
        """
        dt, states, winch, asked = self._asked(dt, ends, winch)
        kept = self._tried
        again = kept is not None and kept[0] == dt and np.array_equal(kept[1][1:], states[1:])
        if not again:
            self._forget_attempt()
        kind = winch.numbers().control
        most = asked[1] if kind == LENGTH else self._longest
        ending = attempt(self._held, dt, states, kind, asked, most, again)
        if ending != FINE:
            raise TetherError(self._refused(ending, dt, states, most))
        self._tried = dt, states.copy(), winch, asked
        return self.forces

    def accept(self) -> None:
        """Make the last attempt the present state.

        Raises:
            TetherError: there is none.
        """
        if self._tried is None:
            raise TetherError(
                f"At t = {self.time:g} s there is no attempt to accept. Call Tether.attempt first."
            )
        dt, states, self._winch, asked = self._tried
        make_real(self._held, dt, states, self._winch.numbers().control, asked)
        self._tried = None

    def linearise(self, dt: float) -> np.ndarray:
        """Return ∂F/∂x (3 ends, 3 ends): how the forces after a step of dt answer to the places of the ends there.

        Rows and columns: north, east, down of the first end, then of the second. The velocities move along, by
        3/(2 dt) per metre behind a step of dt (`moving_end.bdf2`): so ∂F/∂v = (2 dt/3) ∂F/∂x. A long dt gives the
        static stiffness, a short one the inertia. Central differences of solved steps; the state does not change. [N/m]

        Raises:
            TetherError: no solution next to this state, as for a taut cable that cannot stretch.
        """
        self._forget_attempt()
        before = self.save()
        rate = _weight(dt, float(self._line.ends.previous_step))
        here, size = self._places(), MOVED * self.length
        here[:, 0] += dt * here[:, 1]
        answer = np.empty((3 * self._ends, 3 * self._ends))
        try:
            for column in range(3 * self._ends):
                sides = []
                for sign in (1.0, -1.0):
                    moved = here.copy()
                    moved[column // 3, :, column % 3] += sign * size, sign * size * rate
                    sides.append(self.attempt(dt, moved).ravel())
                    self.restore(before)
                answer[:, column] = (sides[0] - sides[1]) / (2.0 * size)
        finally:
            self.restore(before)
        return answer

    def save(self) -> TetherState:
        """Return the present state, for `restore`."""
        self._forget_attempt()
        stepped = self._stepped
        return TetherState(
            time=self.time,
            owner=self._owner,
            winch=self._winch,
            capacity=self._line.length.size - 1,
            memory=stepped.memory.copy(),
        )

    def restore(self, state: TetherState) -> None:
        """Return to a saved state, to the last bit.

        Raises:
            TetherError: no state of this tether.
        """
        if not isinstance(state, TetherState) or state.owner != self._owner:
            what = "that of another tether" if isinstance(state, TetherState) else short(state)
            raise TetherError(
                f"Tether.restore: the state is {what}; a tether can only return to a state of its own, from its save()."
            )
        if state.capacity != self._line.length.size - 1:
            self._enlarge(state.capacity)
        self._stepped.memory[:] = state.memory
        self._winch, self._tried = state.winch, None

    def modes(self, count: int = 6) -> Modes:
        """Return the natural modes of lowest frequency about where it is now, as if it were at rest: `cable.modes`.

        Its ends are held, or, of a tether with one end, the tail is free. The water passes it as seen from the mean
        velocity of its ends; what else the tether moves is left out.

        Raises:
            subzero.UserError: a slack tether, one that nothing brings back to its shape, or more than 1000 segments.
        """
        line, N = self._line, int(self._line.ends.count)
        lengths = np.append(line.length[1:N], line.ends.last_length[NOW])
        here = Equilibrium(
            cable=self.cable,
            current=_passing(self.current, self._places(), 0.0),
            length=float(lengths.sum()),
            shape=self.shape,
            tensions=self.tension,
            tow_force=self._on_first.copy(),
            drum_force=-self._on_second,
            segment_lengths=lengths,
            segment_tensions=line.tension[NOW, 1 : N + 1].copy(),
            steps=0,
            bed=self._bed,
            clamps=self._clamps,
            surface=self._surface,
        )
        return find_modes(here, count, free_end=self._ends == 1)

    def __repr__(self) -> str:
        """Return where it stands in one line."""
        pulls = " and ".join(f"{np.linalg.norm(force):.4g} N" for force in self.forces)
        return (
            f"Tether at t = {self.time:g} s: {self.length:.4g} m in {int(self._line.ends.count)} segments, pulls with"
            f" {pulls}"
        )

    def __reduce__(self) -> Any:
        """Refuse to be copied: compiled code holds the memory of this one."""
        raise TetherError(
            "A tether can be neither copied nor sent to another process. Make another one there."
        )

    def _take(self, stepped: Stepped) -> None:
        """Keep the arrays, and the forces in them."""
        self._stepped, self._line = stepped, stepped.line
        self._held = handle_of(stepped)
        self._on_first, self._on_second = stepped.line.ends.tow.force, stepped.line.ends.drum_force
        self._tried = None

    def _enlarge(self, capacity: int) -> None:
        """Give the cable space for `capacity` segments; its numbers are those of before where they fit."""
        self._forget_attempt()
        line, old = self._line, self._stepped
        fits = capacity >= line.length.size - 1
        line = enlarged(line, capacity) if fits else new_line(capacity)._replace(ends=line.ends)
        self._take(in_one_piece(old._replace(line=line)))

    def _forget_attempt(self) -> None:
        """Take an attempt back that was not accepted."""
        if self._tried is not None:
            self._stepped.memory[:] = self._stepped.kept
            self._tried = None

    def _places(self) -> np.ndarray:
        """Return places and velocities of the ends now (ends, 2, 3)."""
        path, led, origin = self._stepped.path, self._stepped.led, self._stepped.origin
        states = [[path.place[1] + origin, path.arriving[1]]]
        states += [[led[1, PLACE:VELOCITY] + origin, led[1, VELOCITY:SETPOINT]]] * (self._ends - 1)
        return np.array(states)

    def _asked(self, dt: float, ends: Ends, winch: Drum | None) -> tuple[float, np.ndarray, Drum, np.ndarray]:
        """Return the arguments of a step, checked, and what its winch is asked for before and after it (2,)."""
        dt = checked("Tether.step", "dt", dt, least=SHORTEST_S, unit="s")
        if type(ends) is np.ndarray and ends.shape == (self._ends, 2, 3) and ends.dtype == float:
            states = np.ascontiguousarray(ends)
        else:
            states = _checked_ends("Tether.step", ends, self._ends)
            if np.ndim(ends) == 2:
                self._take_up_speed(dt, states)
        if self._ends == 1:
            return dt, states, self._winch, np.zeros(2)
        winch = self._winch if winch is None else winch
        asked = self._winch_asked(winch, dt)
        return dt, states, winch, asked

    def _take_up_speed(self, dt: float, states: np.ndarray) -> None:
        """Fill the velocities of ends whose places alone are given (ends, 2, 3)."""
        here = self._places()
        way, speed = states[:, 0] - here[:, 0], np.linalg.norm(here[:, 1], axis=1)
        states[:, 1] = way / dt
        if (np.linalg.norm(way - dt * here[:, 1], axis=1) > JUMP + dt * (speed + SUDDEN)).any():
            raise TetherError(describe_jump(self.time, dt, here, states))

    def _winch_asked(self, winch: Drum, dt: float) -> np.ndarray:
        """Return the length [m] or the tension [N] that a winch is asked for before and after a step (2,)."""
        if isinstance(winch, DrumProperties):
            return self._with_space(np.zeros(2), dt)
        if not isinstance(winch, PayOutRate | Brake | ConstantTension):
            raise TetherError(
                f"Tether.step: winch is {short(winch)}; it must be a cable.PayOutRate, Brake, ConstantTension or "
                "DrumProperties."
            )
        now, by_length = self.time, self._stepped.drum.control == LENGTH
        start = float(self._stepped.led[1, SETPOINT]) if by_length else self.length
        if isinstance(winch, Brake):
            return np.array([start, start])
        asked = winch.setpoints(np.array([now, now + dt]), start)
        if isinstance(winch, ConstantTension):
            return self._with_space(np.array([asked[1], asked[1]]), dt)
        if asked[1] > self._longest:
            raise TetherError(
                f"At t = {now:g} s the winch is to pay out to {asked[1]:.6g} m within {dt:g} s; drum and water hold "
                f"{self._longest:.6g} m together (longest). Brake, or pay out {(self._longest - start) / dt:.4g} "
                "m/s at most."
            )
        if asked[1] <= SHORTEST:
            raise TetherError(
                f"At t = {now:g} s the winch is to reel in more than the {start:.6g} m that are in the water, within "
                f"{dt:g} s. Brake, or reel in less than {start / dt:.4g} m/s."
            )
        return self._with_space(asked, dt)

    def _with_space(self, asked: np.ndarray, dt: float) -> np.ndarray:
        """Return what a winch is asked for; allocate space for the segments that the step may add."""
        ends = self._line.ends
        each = float(ends.layout.segment_length)
        more = max(float(asked[1] - asked[0]), 0.0) + dt * self._fastest()
        if int(ends.count) + more / each + 2 > self._line.length.size - 1:
            self._enlarge(2 * int(ends.count) + int(more / each) + SPARE)
        return asked

    def _fastest(self) -> float:
        """Return a speed that the cable does not leave a drum faster at. [m/s]."""
        path, led = self._stepped.path, self._stepped.led
        speeds = np.linalg.norm(path.arriving[1]) + np.linalg.norm(led[1, VELOCITY:SETPOINT])
        return 2.0 * float(speeds) + self.current.fastest + 1.0

    def _refused(self, ending: int, dt: float, states: np.ndarray, most: float) -> str:
        """Return why a step ended so, and take back what it did; `most` is the cable that there can be [m]."""
        now = self.time
        if ending == NO_NUMBER:
            return describe_bad_number(now, states)
        if ending == JUMPED:
            return describe_jump(now, dt, self._places(), states)
        if ending == TOO_FAR:
            return describe_reach(now, states, most, self._stepped.cable)
        if ending == EMPTY:
            words = (
                f"Within {dt:g} s after t = {now:g} s more cable is pulled off than drum and water hold together, "
                f"{most:.6g} m (longest). Brake, or go on with a step that is shorter."
            )
        else:
            names = Names(step="dt", wet="length", segment="segment_length")
            words = describe_stop(now, self._line, self._stepped.drum, self._stepped.cable, names)
        self._stepped.memory[:] = self._stepped.kept
        self._tried = None
        return words


def _weight(step: float, before: float) -> float:
    """Return b₀ of `moving_end.bdf2`: by how much a velocity changes with the place at the end of a step. [1/s]."""
    if before <= 0.0:
        return 2.0 / step
    return (1.0 + 2.0 * step / before) / (step * (1.0 + step / before))


def _checked_ends(owner: str, ends: Ends, count: int | None) -> np.ndarray:
    """Return places and velocities (ends, 2, 3); places alone are at rest."""
    given, counts = numbers_in(ends), (1, 2) if count is None else (count,)
    if given is not None and given.shape[1:] in ((3,), (2, 3)) and len(given) in counts:
        states = np.zeros((len(given), 2, 3))
        states[:, 0], states[:, 1] = (given, 0.0) if given.ndim == 2 else (given[:, 0], given[:, 1])
        if count is not None or np.isfinite(states).all():
            return states
    many = "one or two" if count is None else str(count)
    raise TetherError(
        f"{owner}: ends is {short(ends)}; it must be the finite places of {many} ends, north, east, down in m, each "
        "alone or with its velocity in m/s: [(place, velocity), …]."
    )


def _segment_length(length: float, segments: int | None, segment_length: float | None) -> float:
    """Return how long segments are. [m]."""
    if segments is not None and segment_length is not None:
        raise BadValueError("Tether: give segments, or segment_length, not both.")
    if segment_length is None:
        return length / whole("Tether: segments", SEGMENTS if segments is None else segments, least=1)
    each = checked("Tether", "segment_length", segment_length, above=0.0, unit="m")
    segments_needed(length, each, 0.0)  # refuses a cable of countless ones
    return each


def _rate_at_start(winch: Drum) -> float:
    """Return the rate at which a winch pays out when a tether begins. [m/s]."""
    if not isinstance(winch, PayOutRate):
        return 0.0
    return checked("PayOutRate", "rate", winch.rate(0.0) if callable(winch.rate) else winch.rate, unit="m/s")


def _towards(places: np.ndarray) -> np.ndarray:
    """Return the direction from the second of two places to the first one; zeros where they meet (3,)."""
    apart = places[0] - places[1]
    direction: np.ndarray = apart / max(float(np.linalg.norm(apart)), 1e-12)
    return direction


def _passing(current: Current, states: np.ndarray, rate: float) -> Current:
    """Return the current that a tether which goes on at its mean velocity sees."""
    moving = 0.5 * (states[0, 1] + states[-1, 1] + rate * _towards(states[[0, -1], 0]))
    return replace(current, velocity=current.velocity - moving) if moving.any() else current


def _from_rest(rest: Equilibrium, states: np.ndarray, drum: DrumNumbers, rate: float) -> Line:
    """Return a line that hangs or streams between its ends (`_passing`).

    A winch that pays out from the start on at `rate` [m/s] feeds cable that moves along itself already.
    """
    first, second = states[:, 1]
    line = new_line(rest.segment_lengths.size + SPARE)
    line.ends.layout.segment_length = float(rest.segment_lengths[0])
    drum.velocity[:] = states[1, 1]
    fed = second + rate * _towards(rest.shape[[-2, -1]])
    lay_held(line, rest, first, fed, rate)
    line.ends.drum_force[:] = -rest.drum_force
    return line
