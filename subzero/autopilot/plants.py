"""Plants for python-control: the hull alone in continuous time, and hull and cable together in discrete time.

The hull alone is x' = f(x, u) of `states`, with the servos and the motor as they are: limits, dead bands, sag. With the
cable it is the coupled simulation itself, one exchange of hull and cable a step: the vector of its state starts with
the hull's 16 states and goes on with everything the cable remembers (`memory`), so that an update depends on nothing
but its arguments, and may be repeated, interconnected and linearised like any other system.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import vehicle
from cable.line import enlarged
from scenarios import Start, Trial
from subzero.autopilot.memory import Memory
from subzero.autopilot.states import INPUT_NAMES, PLACE, STATE_NAMES, from_vehicle, rate, to_vehicle
from subzero.autopilot.steady import Trim
from subzero.coupling import FINE
from subzero.errors import UserError
from subzero.loop import NO_ROOM, SPARE, run_rows
from subzero.model import Model
from subzero.recording import new_recording
from subzero.simulation import in_words
from subzero.start import prepare
from vehicle.state import CHARGE, LINKAGE

if TYPE_CHECKING:
    import control

CABLE_OUTPUTS = (
    "cable_length",
    "cable_tension",
    "drum_tension",
    "cable_force_forward",
    "cable_force_starboard",
    "cable_force_down",
    "cable_moment_roll",
    "cable_moment_pitch",
    "cable_moment_yaw",
)
"""What the tethered plant gives beside its hull's states, as channels of `subzero.channels` [m, N, N m]."""

HIDDEN = ("battery_charge", "rudder_linkage", "stern_plane_port_linkage", "stern_plane_starboard_linkage")
"""States of the hull that only the tethered plant has [C, rad]."""
HULL_SIZE = len(STATE_NAMES) + len(HIDDEN)


def plant(
    model: Model,
    *,
    tethered: bool = False,
    start: Trim | None = None,
    depth: float = 0.0,
    heading: float = 0.0,
    sample_time: float = 0.1,
    hull_step: float = 0.02,
    segment_length: float = 0.5,
    longest: float = 50.0,
) -> control.NonlinearIOSystem:
    """Return a model as a system for python-control, with named inputs, outputs and states (`INPUTS`, `STATES`).

    Its attribute `initial_state` is where a run begins. Everything is SI, rad and rev/s (`UNITS`). The water has the
    model's current; what a profile adds to it, a winch and a vessel are in the tethered plant only.

    Args:
        model: vehicle, cable, drum and current.
        tethered: the coupled simulation, in discrete time, with `CABLE_OUTPUTS`; else the hull alone in continuous
            time, with its states as outputs.
        start: the steady motion to begin with, its length of cable laid straight behind; at rest by default.
        depth: to begin at. [m]
        heading: to begin with. [rad]
        sample_time: of the tethered plant: one exchange of hull and cable. [s]
        hull_step: of the tethered plant. [s]
        segment_length: of the cable. [m]
        longest: length of cable that there is room for. [m]

    Raises:
        UserError: a sample time shorter than the hull's step; a start with more cable than `longest`.
    """
    x = np.zeros(len(STATE_NAMES)) if start is None else start.state.copy()
    x[PLACE["depth"]], x[PLACE["heading"]] = depth, heading
    if not tethered:
        return _hull(model, x)
    if sample_time < hull_step:
        raise UserError(
            f"plant: a sample time of {sample_time:g} s is shorter than the hull's step of {hull_step:g} s. Allowed:"
            " at least one hull step."
        )
    wet = 0.0 if start is None else start.wet_length
    if wet > longest:
        raise UserError(f"plant: {wet:g} m of cable to begin with are more than longest = {longest:g} m.")
    steps = {"cable_step": sample_time, "hull_step": hull_step, "segment_length": segment_length}
    return Tethered(model, x, wet, steps, longest).system()


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


def _blank_trial(model: Model, x: np.ndarray, wet_length: float, steps: dict[str, float]) -> Trial:
    """Return a trial that says only how the hull lies, how much cable is out, and the steps."""
    start = Start(roll=x[3], pitch=x[4], heading=x[5], depth=x[2], surge_speed=x[6], wet_length=wet_length)
    nothing: dict[str, Any] = {
        "vehicle": {},
        "cable": {},
        "drum": {},
        "text": "",
        "source": "",
        "description": "",
    }
    return Trial(name="plant", duration=0.0, start=start, current=model.current, **(nothing | steps))


class Tethered:
    """The coupled simulation as a function from state and command to the next state."""

    def __init__(
        self, model: Model, x: np.ndarray, wet_length: float, steps: dict[str, float], longest: float
    ) -> None:
        trial = _blank_trial(model, x, wet_length, steps)
        self._setup, live = prepare(trial, model, True)
        room = int(longest / trial.segment_length) + SPARE + 4
        self._live = live._replace(line=enlarged(live.line, max(room, live.line.length.size)))
        self._memory = Memory(self._live)
        self._recording = new_recording(2, 4 * self._live.line.length.size)
        self._r_c = model.vehicle.tow_point.position()
        self._step, self._longest = trial.cable_step, longest
        self._initial = np.concatenate([x, np.zeros(len(HIDDEN)), self._memory.read()])
        self._initial[len(STATE_NAMES) + 1 : HULL_SIZE] = x[13:]

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
            dt=self._step,
            name="tethered",
        )
        system.initial_state = self._initial
        return system

    def update(self, t: float, x: np.ndarray, u: np.ndarray, params: dict[str, Any]) -> np.ndarray:
        """Return the state one step after x under a command u (4,)."""
        live = self._live
        live.state[:] = to_vehicle(x[: len(STATE_NAMES)])
        live.state[CHARGE], live.state[LINKAGE : LINKAGE + 3] = x[16], x[17:HULL_SIZE]
        self._memory.write(x[HULL_SIZE:])
        self._setup.orders.values[0] = u
        times = np.array([t, t + self._step])
        _, _, ending, solved = run_rows(self._setup, live, self._recording, times, 1, 2, 0)
        if ending != FINE:
            raise UserError(self._trouble(ending, solved, t))
        hull = from_vehicle(live.state, heading_near=float(x[5]))
        hidden = (live.state[CHARGE], *live.state[LINKAGE : LINKAGE + 3])
        return np.concatenate([hull, hidden, self._memory.read()])

    def output(self, t: float, x: np.ndarray, u: np.ndarray, params: dict[str, Any]) -> np.ndarray:
        """Return hull states and cable channels of a state."""
        flat, places = x[HULL_SIZE:], self._memory.places
        count = round(float(flat[places["count"]][0]))
        levels = flat[places["last_length"]]
        length = levels[1] + flat[places["length"]][1:count].sum()
        F, R = flat[places["force"]], np.empty((3, 3))
        vehicle.rotation(to_vehicle(x[: len(STATE_NAMES)])[3:7], R)
        pull = R.T @ F
        tensions = (np.linalg.norm(F), flat[places["node_tension"]][count])
        return np.concatenate([x[: len(STATE_NAMES)], [length, *tensions], pull, np.cross(self._r_c, pull)])

    def _trouble(self, ending: int, solved: Any, time: float) -> str:
        """Say why there is no next state."""
        if ending == NO_ROOM:
            return f"plant: at t = {time:g} s there is no room for more than longest = {self._longest:g} m of cable."
        return in_words(ending, solved, time, self._setup, self._live)
