"""Steady motion: which propeller speed, fins and attitude hold a speed, a depth rate and a turn.

    ν'(n, δ_r, δ_e, δ_d, θ, v, w) = 0,   z' = depth rate,   (p, q, r) = J⁻¹ (0, 0, ψ')

Seven equations, seven unknowns; the roll angle is asked for (0) and held by unlike stern-planes. Propeller and fins
are solved for without their limits first, if need be in steps from straight level motion to what is asked for: so a
motion that cannot be had is told with the limit that is in its way. Speeds are through the water; a uniform current
only carries the track.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, floor, sin

import numpy as np

from subzero.autopilot.actuators import commands, ideal
from subzero.autopilot.balance import Motion, level_propeller
from subzero.autopilot.limits import NoTrimError, check_limits, check_request, say_how_far
from subzero.autopilot.pull import SteadyPull, from_cable_model
from subzero.autopilot.states import STATE_NAMES, VELOCITY, to_vehicle
from subzero.model import Model
from vehicle import Vehicle, rotation

STEPS = 20
"""A motion that is not found at once is approached in so many steps."""
SLOWEST = 1e-2
"""The largest speed that can be held is not looked for below this. [m/s]"""
PASSES = 6
"""How often hull and cable model are solved in turn: the pull hardly changes the attitude, three digits a pass."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Trim:
    """A steady motion.

    Attributes:
        speed: u, forward speed through the water. [m/s]
        depth_rate: z', positive down. [m/s]
        turn_rate: ψ', positive to starboard. [rad/s]
        wet_length: cable in the water. [m]
        length: of the hull, for scales of time L/U. [m]
        state: x (16,), as in `STATES`, at the origin with heading 0.
        command: propeller [rev/s], rudder, port and starboard plane [rad] (4,).
        wrench: of the cable on the hull, body axes (6,). [N, N m]
    """

    speed: float
    depth_rate: float
    turn_rate: float
    wet_length: float
    length: float
    state: np.ndarray
    command: np.ndarray
    wrench: np.ndarray

    @property
    def propeller_rps(self) -> float:
        """Propeller speed [rev/s]."""
        return float(self.state[12])

    @property
    def command_angles(self) -> np.ndarray:
        """Command (4,) of actuators without offset, dead band and sag, as linear models have them."""
        return self.state[12:].copy()

    @property
    def time_scale(self) -> float:
        """L/U [s]."""
        return self.length / self.speed

    def named(self) -> dict[str, float]:
        """Return the state by name, SI and radians."""
        return dict(zip(STATE_NAMES, self.state.tolist(), strict=True))


def trim(
    model: Model,
    *,
    speed: float,
    depth_rate: float = 0.0,
    turn_rate: float = 0.0,
    wet_length: float = 0.0,
    roll: float = 0.0,
    cable: str = "formula",
) -> Trim:
    """Return the steady motion of a model at a speed.

    Args:
        model: vehicle and cable.
        speed: u, forward speed through the water. [m/s]
        depth_rate: z', positive down. [m/s]
        turn_rate: ψ', positive to starboard. [rad/s]
        wet_length: cable in the water; its pull is taken as steady although it grows. [m]
        roll: φ, held by unlike stern-planes. [rad]
        cable: "formula", ½ρπdC_t U² S and friction along the way of the tow point; or "model", the cable itself,
            pulled along a way of that length. (In a turn less of it stays in the water: it cuts the corner.)

    Raises:
        NoTrimError: there is none: which limit is hit, and how far one can go.
        UserError: a number that means nothing here.
    """
    speed, depth_rate, turn_rate, wet_length, roll = check_request(
        speed, depth_rate, turn_rate, wet_length, roll, cable
    )
    try:
        return _trim(model, speed, depth_rate, turn_rate, wet_length, roll, cable)
    except NoTrimError as error:
        most = 0.0 if depth_rate or turn_rate or roll else fastest(model, speed, wet_length)
        if not most:
            raise
        behind = f" on {wet_length:g} m of cable" if wet_length else ""
        raise NoTrimError(
            f"{error} Straight ahead{behind} the hull holds {floor(1e3 * most) / 1e3:g} m/s at most."
        ) from None


def fastest(model: Model, above: float, wet_length: float = 0.0) -> float:
    """Return the largest speed below another that can be held straight and level, by halving; 0 if there is none. [m/s]

    Args:
        model: vehicle and cable.
        above: a speed that cannot be held. [m/s]
        wet_length: of cable. [m]
    """
    low, high = 0.0, above
    while high - low > 1e-3 * high and high > SLOWEST:
        middle = 0.5 * (low + high)
        try:
            _trim(model, middle, 0.0, 0.0, wet_length, 0.0, "formula")
            low = middle
        except NoTrimError:
            high = middle
    return low


def _trim(
    model: Model,
    speed: float,
    depth_rate: float,
    turn_rate: float,
    wet_length: float,
    roll: float,
    cable: str,
) -> Trim:
    """Return the steady motion of a checked request."""
    hull, pull = model.vehicle, SteadyPull.of(model, wet_length)
    motion = Motion(
        numbers=ideal(hull).numbers(),
        pull=pull,
        speed=speed,
        depth_rate=depth_rate,
        turn_rate=turn_rate,
        roll=roll,
        extra=np.zeros(6),
    )
    x = _balanced(hull, motion)
    if cable == "model" and wet_length > 0.0:
        for _ in range(PASSES):
            extra = _cable_pull(model, x, turn_rate, wet_length) - pull.wrench(x[VELOCITY])
            motion = replace(motion, extra=extra)
            x = _balanced(hull, motion)
    check_limits(hull, x)
    return Trim(
        speed=speed,
        depth_rate=depth_rate,
        turn_rate=turn_rate,
        wet_length=wet_length,
        length=hull.hull.length,
        state=x,
        command=commands(hull, x),
        wrench=pull.wrench(x[VELOCITY]) + motion.extra,
    )


def _balanced(hull: Vehicle, motion: Motion) -> np.ndarray:
    """Return the state of a steady motion, at once from straight level motion, or in steps."""
    guess = np.array([level_propeller(motion), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    direct = motion.solved(guess)
    if direct is not None:
        return motion.state(direct)
    reached = 0.0
    for share in np.linspace(0.0, 1.0, STEPS + 1):
        found = motion.part(share).solved(guess)
        if found is None:
            say_how_far(hull, motion.part(reached).state(guess), reached)
        guess, reached = found, share
    return motion.state(guess)


def _cable_pull(model: Model, x: np.ndarray, turn_rate: float, wet_length: float) -> np.ndarray:
    """Return the pull of the cable itself at the end of a steady way of the tow point, `wet_length` long."""
    nu, r_c = x[VELOCITY], model.vehicle.tow_point.position()
    V = nu[:3] + np.cross(nu[3:], r_c)
    duration = wet_length / float(np.linalg.norm(V))
    R = np.empty((3, 3))
    rotation(to_vehicle(x)[3:7], R)

    def turned(time: float) -> np.ndarray:
        c, s = cos(turn_rate * time), sin(turn_rate * time)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ R

    return from_cable_model(model, lambda t: turned(t) @ V, turned(duration), duration)
