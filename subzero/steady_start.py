"""The vehicle's state at the start of a trial: what it says, or the steady motion that its speed asks for.

A start in trim is the level motion of `autopilot.steady` at the start's speed over ground, with its wet cable in steady
tow: pitch, heave, propeller and fins are those that hold it. The water around the vehicle is taken as uniform.
"""

from __future__ import annotations

from math import degrees

import numpy as np

import scenarios
import vehicle
from subzero.errors import UserError, printable
from subzero.model import Model
from vehicle.state import LINKAGE, POSITION, SERVO, VELOCITY

PASSES = 4
"""The speed through the water depends on the pitch, and that on the speed: three digits a pass."""
FINS = ("rudder", "stern_plane_port", "stern_plane_starboard")


def first_state(trial: scenarios.Trial, model: Model, tethered: bool) -> np.ndarray:
    """Return the vehicle's state at t = 0, as in `vehicle.STATE` (of a prescribed run, its place only).

    Raises:
        UserError: a fin that stands where its servo cannot take it; no steady motion (`autopilot.NoTrimError`).
    """
    start = trial.start
    if start.at_trim:
        return _steady(trial, model, tethered)
    _check_fins(start, model)
    state = vehicle.initial_state(
        position=(0.0, 0.0, start.depth),
        roll=start.roll,
        pitch=start.pitch,
        heading=start.heading,
        velocity=start.velocity,
        propeller_speed=start.propeller_speed,
    )
    state[SERVO : SERVO + 3] = state[LINKAGE : LINKAGE + 3] = start.fins
    return state


def _check_fins(start: scenarios.Start, model: Model) -> None:
    """Refuse fins beyond what their servos reach."""
    for fin, angle in zip(FINS, start.fins, strict=True):
        most = getattr(model.vehicle, f"{fin}_servo").deflection_limit
        if abs(angle) > most * (1.0 + 1e-12):
            raise UserError(
                f"The run starts with {fin}_angle at {degrees(angle):.4g} degrees; its servo reaches "
                f"{degrees(most):.4g} degrees either way. Allowed: an angle within that."
            )


def _steady(trial: scenarios.Trial, model: Model, tethered: bool) -> np.ndarray:
    """Return the state of a trial that starts in trim."""
    from subzero.steady_motion.hull_state_space import to_vehicle
    from subzero.steady_motion.trim_point import trim

    start, water = trial.start, _water_at_the_start(model, trial.start.depth)
    wet, speed, R = start.wet_length if tethered else 0.0, start.surge_speed, np.empty((3, 3))
    for _ in range(PASSES if water.any() else 1):
        try:
            x = trim(model, speed=speed, wet_length=wet, roll=start.roll).state.copy()
        except UserError as error:
            what = f"'{printable(trial.name)}' cannot start in trim at {start.surge_speed:g} m/s over ground"
            raise type(error)(f"{what}: {error}") from None
        x[5] = start.heading
        state = to_vehicle(x)
        vehicle.rotation(state[3:7], R)
        speed = start.surge_speed - float(R[:, 0] @ water)
    state[POSITION : POSITION + 3] = 0.0, 0.0, start.depth
    state[VELOCITY : VELOCITY + 3] += R.T @ water
    return state


def _water_at_the_start(model: Model, depth: float) -> np.ndarray:
    """Return the velocity of the water at the vehicle, north, east, down (3,). [m/s]."""
    water = np.array(model.current, dtype=float)
    if model.profile is not None:
        water += [
            np.interp(depth, model.profile.depth, axis) for axis in np.transpose(model.profile.velocity)
        ]
    return water
