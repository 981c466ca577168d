"""Plants for python-control: the hull alone in continuous time, and hull and cable together in discrete time.

The hull alone is x' = f(x, u) of `hull_state_space`, with the servos and the motor as they are: limits, dead bands,
sag. With the cable it is the coupled simulation itself, one exchange of hull and cable a step (`coupled_plant`): an
update depends on nothing but its arguments, and may be repeated, interconnected and linearised like any other system.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.autopilot.coupled_plant import Tethered, blank_trial
from subzero.errors import UserError
from subzero.model import Model
from subzero.steady_motion.hull_state_space import INPUT_NAMES, PLACE, STATE_NAMES, rate
from subzero.steady_motion.trim_point import Trim

if TYPE_CHECKING:
    import control


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
        tethered: the coupled simulation, in discrete time, with `coupled_plant.CABLE_OUTPUTS`; else the hull alone in
            continuous time, with its states as outputs.
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
    return Tethered(blank_trial(model, x, wet, steps), model, longest, x=x).system()


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
