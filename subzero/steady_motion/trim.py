"""Trim: the steady motion that holds the requested speeds and turn, with the cable as a formula or as the cable
itself.

The formula is that of `subzero.steady_motion.trim_point`. Where the cable is heavy, or cuts the corner of a turn, the
cable itself is pulled along the way that the tow point came, and hull and cable are solved in turn.

On station (`station_trim`), thrusts hold a place and a heading over ground, in the water of the trial and on its
tether. The vehicle moves through the water as the water does past it, v_r = −Rᵀ J. The tether hangs at rest between the
tow point and the drum of the trial (`cable.hold`); hull and tether are solved in turn, as the attitude moves the tow
point.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from math import cos, sin

import numpy as np

import scenarios
from cable import MovingEnd, hold, pull_out
from subzero.errors import UserError, short
from subzero.model import Model, model_of
from subzero.steady_motion.asked import Asked
from subzero.steady_motion.hull_state_space import HEADING, VELOCITY, to_vehicle
from subzero.steady_motion.thruster_motion import is_on_thrusters
from subzero.steady_motion.trim_point import Trim, steady_motion
from vehicle import rotation

CABLES = ("formula", "model")


def trim(
    model: Model,
    *,
    speed: float,
    depth_rate: float = 0.0,
    turn_rate: float = 0.0,
    wet_length: float = 0.0,
    roll: float = 0.0,
    sway_speed: float = 0.0,
    cable: str = "formula",
) -> Trim:
    """Return the steady motion of a model at a speed.

    Args:
        model: vehicle and cable.
        speed: u, forward speed through the water. [m/s]
        depth_rate: z', positive down. [m/s]
        turn_rate: ψ', positive to starboard. [rad/s]
        wet_length: cable in the water; its pull is taken as steady although it grows. [m]
        roll: φ, held by unlike stern-planes, or by thrusters. [rad]
        sway_speed: v, to starboard through the water, held by thrusters. [m/s]
        cable: "formula", ½ρπdC_t U² S and friction along the way of the tow point; or "model", the cable itself,
            pulled along a way of that length. (In a turn less of it remains in the water: it cuts the corner.)

    Raises:
        NoTrimError: there is none: which limit is hit, and how far one can go.
        UserError: a number that means nothing here; the cable could not be solved along this way.
    """
    motion = {"speed": speed, "depth_rate": depth_rate, "turn_rate": turn_rate, "sway_speed": sway_speed}
    asked = Asked(**motion, wet_length=wet_length, roll=roll)
    if not isinstance(cable, str) or cable not in CABLES:
        raise UserError(f"trim: cable is {short(cable)}; it must be one of {', '.join(CABLES)}.")
    return steady_motion(model, asked, partial(cable_pull, model) if cable == "model" else None)


def cable_pull(model: Model, x: np.ndarray, asked: Asked) -> np.ndarray:
    """Return the pull of the cable itself at the end of a steady way of the tow point, as long as the cable is.

    Args:
        model: whose cable, drum and tow point.
        x: state (16,) of the steady motion.
        asked: which motion it is.

    Returns:
        wrench on the hull (6,), body axes. [N, N m]

    Raises:
        UserError: the cable could not be solved along this way.
    """
    nu, r_c = x[VELOCITY], model.vehicle.tow_point.position()
    V, R = nu[:3] + np.cross(nu[3:], r_c), np.empty((3, 3))
    duration = asked.wet_length / float(np.linalg.norm(V))
    rotation(to_vehicle(x)[3:7], R)

    def attitude(time: float) -> np.ndarray:
        c, s = cos(asked.turn_rate * time), sin(asked.turn_rate * time)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ R

    scheme = MovingEnd(time_step=min(0.1, duration / 20.0))
    way = pull_out(lambda t: attitude(t) @ V, duration, cable=model.cable, drum=model.drum, scheme=scheme)
    if not way.outcome.completed:
        raise UserError(f"The cable has no steady pull along this way. {way.outcome.message}")
    F = attitude(duration).T @ way.tow_force[-1]
    return np.concatenate([F, np.cross(r_c, F)])


def station_trim(trial: scenarios.Trial, model: Model | None = None, *, tethered: bool = True) -> Trim:
    """Return the steady state in which thrusters keep the first place and heading of a trial's [station].

    Args:
        trial: with a station; its start says where the drum is and how much tether is in the water.
        model: another model than the trial's.
        tethered: with the tether.

    Returns:
        the trim; its speeds are those through the water, its heading is that of the station.

    Raises:
        NoTrimError: thrusters that cannot hold it: which limit is hit.
        UserError: a trial without a station, a vehicle without thrusters, a tether that lies straight behind.
    """
    model, station = model_of(trial, model), trial.station
    if station is None or not is_on_thrusters(model.vehicle):
        why = "it has no [station]" if station is None else "its vehicle has no thrusters that drive it"
        raise UserError(f"'{trial.name}' has no trim on station: {why}. rov_hover shows how.")
    wet = trial.start.wet_length if tethered else 0.0
    if wet > 0.0 and trial.start.drum is None:
        raise UserError(
            f"'{trial.name}' has no trim on station: its tether is laid straight behind the vehicle. Say where the drum"
            " is, with drum_north_m, drum_east_m and drum_down_m in [start]; or take tethered=False."
        )
    heading, place = station.heading[0], np.array(station.place[0])
    past = -model.water().at(tuple(place)) @ _earth_axes(np.zeros(16), heading)
    asked = Asked(speed=float(past[0]), sway_speed=float(past[1]), depth_rate=float(past[2]), wet_length=wet)
    pull = partial(_held_pull, model, trial, place, heading)
    steady = steady_motion(model, asked, pull)
    state = steady.state.copy()
    state[HEADING] = heading
    return replace(steady, state=state)


def _earth_axes(x: np.ndarray, heading: float) -> np.ndarray:
    """Return R_nb (3, 3) of a state, turned to a heading [rad]."""
    turned, R = x.copy(), np.empty((3, 3))
    turned[HEADING] = heading
    rotation(to_vehicle(turned)[3:7], R)
    return R


def _held_pull(
    model: Model, trial: scenarios.Trial, place: np.ndarray, heading: float, x: np.ndarray, asked: Asked
) -> np.ndarray:
    """Return the wrench (6,) of the tether at rest between drum and tow point of a state, body axes. [N, N m]"""
    start, arm = trial.start, model.vehicle.tow_point.position()
    begins = np.zeros(16)
    begins[3:5] = start.roll, start.pitch
    tow_at_start = np.array([0.0, 0.0, start.depth]) + _earth_axes(begins, start.heading) @ arm
    R = _earth_axes(x, heading)
    ends = np.array([place + R @ arm, tow_at_start + np.array(start.drum)])
    held = hold(
        ends,
        asked.wet_length,
        model.water(),
        cable=model.cable,
        segment_length=trial.segment_length,
        bed=model.bed,
    )
    F = R.T @ held.tow_force
    return np.concatenate([F, np.cross(arm, F)])
