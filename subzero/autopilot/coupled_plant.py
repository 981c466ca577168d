"""Plants for python-control: the hull alone in continuous time, and hull with cable in discrete time.

The hull alone is x' = f(x, u) of `hull_state_space`, with servos and motor as they are: limits, dead bands, sag. With
the cable it is the coupled simulation itself, one exchange of hull and cable per step: an update depends on its
arguments only, so it can be repeated, interconnected and linearised like any other system.

The vector of its state starts with the hull's 16 states and goes on with everything the cable remembers, as one flat
array (`Memory`): what a step leaves for the next. The state of a cable is everything in its line but the work space of
a step, and the pull at the last two times. As a flat array it can be the state vector of a discrete-time system:
stored, restored and stepped again from anywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from math import remainder, tau
from typing import TYPE_CHECKING, Any

import numpy as np

from cable.moving_end import enlarged
from scenarios import Start, Trial
from subzero.channels import Observation
from subzero.engine.coupling import FINE, forget
from subzero.engine.initial_conditions import RUN_IN, prepare
from subzero.engine.recording import new_recording
from subzero.engine.run_state import Live, Orders
from subzero.engine.time_loop import NO_SPACE, SPARE, run_rows
from subzero.errors import UserError, checked
from subzero.model import Model
from subzero.simulation.run import in_words
from subzero.steady_motion.hull_state_space import (
    INPUT_NAMES,
    PLACE,
    STATE_NAMES,
    from_vehicle,
    rate,
    to_vehicle,
)
from subzero.steady_motion.trim_point import Trim
from vehicle import rotation
from vehicle.state import CHARGE, LINKAGE

if TYPE_CHECKING:
    import control


CABLE_OUTPUTS = Observation._fields[Observation._fields.index("cable_length") :]
"""Outputs of the tethered plant in addition to its hull's states, as channels of `subzero.channels` [m, N, N m]."""

HIDDEN = ("battery_charge", "rudder_linkage", "stern_plane_port_linkage", "stern_plane_starboard_linkage")
"""States of the hull that only the tethered plant has [C, rad]."""
HULL_SIZE = len(STATE_NAMES) + len(HIDDEN)
EXACT = 1e-12
"""Tolerance of a step whose differences are taken: remaining error of cable forces, and between hull and cable.
[-]"""


def blank_trial(model: Model, x: np.ndarray, wet_length: float, steps: dict[str, float]) -> Trial:
    """Return a trial that says only how the hull lies, how much cable is out, and the steps."""
    heading = remainder(float(x[5]), tau)
    start = Start(roll=x[3], pitch=x[4], heading=heading, depth=x[2], surge_speed=x[6], wet_length=wet_length)
    nothing: dict[str, Any] = {
        "vehicle": {},
        "cable": {},
        "drum": {},
        "text": "",
        "source": "",
        "description": "",
    }
    duration = steps["cable_step"]
    return Trial(name="plant", duration=duration, start=start, current=model.current, **(nothing | steps))


class NoSpaceError(UserError):
    """A start or a step needs more cable than was allocated."""


class Tethered:
    """The coupled simulation as a function from state and command to the next state.

    Args:
        trial: where it starts, and its steps; its commands are not used.
        model: vehicle, cable, drum and water.
        longest: length of cable to allocate. [m]
        x: state of the hull to start with (16,), other than the trial's.
        exact: solve every step to rounding, for derivatives by differences.

    Attributes:
        initial: the state to start with, `HULL_SIZE` numbers of the hull and those of `Memory`.
        sample_time: of a step. [s]
    """

    def __init__(
        self, trial: Trial, model: Model, longest: float, *, x: np.ndarray | None = None, exact: bool = False
    ) -> None:
        self._setup, live = prepare(trial, model, True)
        self._setup = self._setup._replace(orders=Orders(np.zeros(1), np.zeros((1, 4))))
        if exact:
            live.line.ends.solver.tolerance, self._setup.fixed.agreement = EXACT, EXACT
        capacity = int((longest + RUN_IN) / trial.segment_length) + SPARE + 4
        self._live = live._replace(line=enlarged(live.line, max(capacity, live.line.length.size)))
        self._memory = Memory(self._live)
        self._recording = new_recording(2, 4 * self._live.line.length.size, entries=self._live.state.size)
        self._r_c = model.vehicle.tow_point.position()
        self.sample_time, self._longest = trial.cable_step, longest
        x = from_vehicle(live.state, heading_near=trial.start.heading) if x is None else x
        self.initial = np.concatenate([x, np.zeros(len(HIDDEN)), self._memory.read()])
        self.initial[len(STATE_NAMES) + 1 : HULL_SIZE] = x[13:]

    def system(self) -> control.NonlinearIOSystem:
        """Return the discrete-time system."""
        import control

        cable = [f"cable[{i}]" for i in range(self._memory.size)]
        system = control.NonlinearIOSystem(
            self.update,
            self.output,
            inputs=list(INPUT_NAMES),
            outputs=[*STATE_NAMES, *CABLE_OUTPUTS],
            states=[*STATE_NAMES, *HIDDEN, *cable],
            dt=self.sample_time,
            name="tethered",
        )
        system.initial_state = self.initial
        return system

    def update(self, t: float, x: np.ndarray, u: np.ndarray, params: dict[str, Any]) -> np.ndarray:
        """Return the state one step after x under a command u (4,)."""
        live = self._live
        live.state[:] = to_vehicle(x[: len(STATE_NAMES)])
        live.state[CHARGE], live.state[LINKAGE : LINKAGE + 3] = x[16], x[17:HULL_SIZE]
        self._memory.write(x[HULL_SIZE:])
        forget(self._setup, live)
        self._setup.orders.values[0] = u
        times = np.array([t, t + self.sample_time])
        _, _, ending = run_rows(self._setup, live, self._recording, times, 1, 2, 0, 1, 1)
        if ending == NO_SPACE:
            raise NoSpaceError(
                f"plant: at t = {t:g} s there is no room for more than longest = {self._longest:g} m of cable."
            )
        if ending != FINE:
            raise UserError(in_words(ending, t, self._setup, self._live))
        hull = from_vehicle(live.state, heading_near=float(x[5]))
        hidden = (live.state[CHARGE], *live.state[LINKAGE : LINKAGE + 3])
        return np.concatenate([hull, hidden, self._memory.read()])

    def events(self, x: np.ndarray) -> tuple[float, float]:
        """Return the discrete state of a cable: the number of its segments, and the state of its drum."""
        flat, places = x[HULL_SIZE:], self._memory.places
        return float(flat[places["count"]][0]), float(flat[places["drum_mode"]][0])

    def output(self, t: float, x: np.ndarray, u: np.ndarray, params: dict[str, Any]) -> np.ndarray:
        """Return hull states and cable channels of a state."""
        flat, places = x[HULL_SIZE:], self._memory.places
        count = round(float(flat[places["count"]][0]))
        levels = flat[places["last_length"]]
        length = levels[1] + flat[places["length"]][1:count].sum() + flat[places["loose"]][1]
        F, R = flat[places["force"]], np.empty((3, 3))
        rotation(to_vehicle(x[: len(STATE_NAMES)])[3:7], R)
        pull = R.T @ F
        tensions = (np.linalg.norm(F), flat[places["node_tension"]][count])
        return np.concatenate([x[: len(STATE_NAMES)], [length, *tensions], pull, np.cross(self._r_c, pull)])


NOT_KEPT = ("blocks", "pivots", "rows", "load", "slip", "normal_gain", "forcing", "solved")
"""Fields of `cable.moving_end.state.Line` and its ends that a step fills before it reads them, or that remain
zero."""
OF_NOW = ("force", "force_before", "last_step")
"""Fields of `subzero.engine.run_state.Now` that a step leaves for the next."""


class Memory:
    """Views of all the numbers that a step leaves for the next, in one order.

    Attributes:
        places: name → its slice of the flat array.
        size: numbers in all.
    """

    def __init__(self, live: Live) -> None:
        self._views: dict[str, np.ndarray] = dict(_views(live))
        ends = np.cumsum([view.size for view in self._views.values()])
        self.places = {
            name: slice(int(end) - view.size, int(end))
            for (name, view), end in zip(self._views.items(), ends, strict=True)
        }
        self.size = int(ends[-1])

    def read(self) -> np.ndarray:
        """Return the numbers, packed (size,)."""
        return np.concatenate([view.ravel().astype(float) for view in self._views.values()])

    def write(self, flat: np.ndarray) -> None:
        """Put numbers (size,) back; whole numbers are rounded."""
        for name, view in self._views.items():
            values = flat[self.places[name]].reshape(view.shape)
            view[...] = values if view.dtype.kind == "f" else np.rint(values).astype(view.dtype)


def _numbers_of(name: str, memory: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    """Walk through the numbers in a field: the field itself, or those of the record that it is."""
    if memory.dtype.names is None:
        yield name, memory
    for part in memory.dtype.names or ():
        yield f"{name}.{part}", memory[part]


def _views(live: Live) -> Iterator[tuple[str, np.ndarray]]:
    """Iterate over the kept state: name, view of the memory."""
    for name in OF_NOW:
        yield name, live.now.memory_of(name)
    for name in live.line.ends.names:
        if name not in NOT_KEPT:
            yield from _numbers_of(name, live.line.ends.memory_of(name))
    for name, values in zip(live.line._fields[1:], live.line[1:], strict=True):
        if name not in NOT_KEPT:
            yield name, values


@dataclass(frozen=True, kw_only=True)
class Discretisation:
    """How a tethered plant is made discrete.

    Attributes:
        sample_time: of the plant: one exchange of hull and cable. [s]
        hull_step: time step of the hull. [s]
        segment_length: of the cable. [m]
        longest: length of cable to allocate. [m]

    Raises:
        UserError: a value that is not a positive number; a sample time shorter than the hull's step.
    """

    sample_time: float = 0.1
    hull_step: float = 0.02
    segment_length: float = 0.5
    longest: float = 50.0

    def __post_init__(self) -> None:
        """Raise an error for a step or a length that is not valid, and for a sample shorter than a step of the
        hull.
        """
        for field in fields(self):
            value = checked("Discretisation", field.name, getattr(self, field.name), above=0.0)
            object.__setattr__(self, field.name, value)
        if self.sample_time < self.hull_step:
            raise UserError(
                f"plant: a sample time of {self.sample_time:g} s is shorter than the hull's step of"
                f" {self.hull_step:g} s. Allowed: at least one hull step."
            )

    @property
    def steps(self) -> dict[str, float]:
        """The steps by the names of a trial."""
        return {
            "cable_step": self.sample_time,
            "hull_step": self.hull_step,
            "segment_length": self.segment_length,
        }


AS_USUAL = Discretisation()


def plant(
    model: Model,
    *,
    tethered: bool = False,
    start: Trim | None = None,
    depth: float = 0.0,
    heading: float = 0.0,
    discretisation: Discretisation = AS_USUAL,
) -> control.NonlinearIOSystem:
    """Return a model as a system for python-control, with named inputs, outputs and states (`INPUTS`, `STATES`).

    Its attribute `initial_state` is where a run begins. Everything is SI, rad and rev/s (`UNITS`). The water has the
    model's current; what a profile adds to it, a winch and a vessel are in the tethered plant only.

    Args:
        model: vehicle, cable, drum and current.
        tethered: the coupled simulation, in discrete time, with `coupled_plant.CABLE_OUTPUTS`; else the hull alone in
            continuous time, with its states as outputs.
        start: the steady motion to begin with, its length of cable laid straight behind; at rest by default.
        depth: to begin at. [m]
        heading: to begin with. [rad]
        discretisation: steps of the tethered plant, and the length of cable to allocate.

    Raises:
        UserError: a start with more cable than was allocated.
    """
    x = np.zeros(len(STATE_NAMES)) if start is None else start.state.copy()
    x[PLACE["depth"]], x[PLACE["heading"]] = depth, heading
    if not tethered:
        return _hull(model, x)
    wet, longest = 0.0 if start is None else start.wet_length, discretisation.longest
    if wet > longest:
        raise UserError(f"plant: {wet:g} m of cable to begin with are more than longest = {longest:g} m.")
    return Tethered(blank_trial(model, x, wet, discretisation.steps), model, longest, x=x).system()


def _hull(model: Model, initial: np.ndarray) -> control.NonlinearIOSystem:
    """Return the hull alone, in continuous time."""
    import control

    numbers, current = model.vehicle.numbers(), np.array(model.current, dtype=float)

    def update(t: float, x: np.ndarray, u: np.ndarray, params: dict[str, Any]) -> np.ndarray:
        return rate(np.asarray(x, dtype=float), np.asarray(u, dtype=float), numbers, current_n=current)

    system = control.NonlinearIOSystem(
        update,
        lambda t, x, u, params: x,
        inputs=list(INPUT_NAMES),
        outputs=list(STATE_NAMES),
        states=list(STATE_NAMES),
        name="hull",
    )
    system.initial_state = initial
    return system
