"""Steady motion: which propeller speed, fins and attitude hold a speed, a depth rate and a turn.

    ν'(n, δ_r, δ_e, δ_d, θ, v, w) = 0,   z' = depth rate,   (p, q, r) = J⁻¹ (0, 0, ψ')

Seven equations, seven unknowns; the roll angle is asked for (0) and held by unlike stern-planes. Propeller and fins
are solved for without their limits first, if need be in steps from straight level motion to what is asked for: so a
motion that cannot be had is told with the limit that is in its way. Speeds are through the water; a uniform current
only carries the track.

A motion that cannot be had is refused with what is in the way, and how far one can go (`NoTrimError`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, degrees, floor, radians, sin
from typing import NoReturn

import numpy as np

from subzero.errors import UserError, real, short
from subzero.model import Model
from subzero.steady_motion.actuators import commands, demands, ideal
from subzero.steady_motion.equilibrium import Motion, level_propeller
from subzero.steady_motion.hull_state_space import STATE_NAMES, VELOCITY, to_vehicle
from subzero.steady_motion.steady_cable_force import SteadyPull, from_cable_model
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


CABLES = ("formula", "model")
FASTEST = 50.0
"""A run that is faster is stopped as absurd, `subzero.coupling.FASTEST`. [m/s]"""
STEEPEST = radians(80.0)
"""Pitch beyond which Euler angles are no use any more. [rad]"""


class NoTrimError(UserError):
    """There is no such steady motion; the message names the limit that is hit."""


def check_request(
    speed: float, depth_rate: float, turn_rate: float, wet_length: float, roll: float, cable: str
) -> tuple[float, float, float, float, float]:
    """Return the numbers of a request as floats; refuse what cannot be asked for."""
    asked = {
        "speed": speed,
        "depth_rate": depth_rate,
        "turn_rate": turn_rate,
        "wet_length": wet_length,
        "roll": roll,
    }
    numbers = {name: real(value) for name, value in asked.items()}
    for name, number in numbers.items():
        if number is None:
            raise UserError(f"trim: {name} is {short(asked[name])}; it must be a finite number.")
    speed, depth_rate, turn_rate, wet_length, roll = (number or 0.0 for number in numbers.values())
    if speed <= 0.0:
        raise UserError(f"trim: speed is {speed:g} m/s; fins need a flow, so it must be above 0.")
    if speed > FASTEST:
        raise UserError(
            f"trim: speed is {speed:g} m/s; it must be at most {FASTEST:g}, as runs are stopped beyond."
        )
    if wet_length < 0.0:
        raise UserError(f"trim: wet_length is {wet_length:g} m; it must be 0 or more.")
    if not isinstance(cable, str) or cable not in CABLES:
        raise UserError(f"trim: cable is {short(cable)}; it must be one of {', '.join(CABLES)}.")
    if abs(depth_rate) > speed * sin(STEEPEST):
        raise NoTrimError(
            f"There is no steady motion at {speed:g} m/s with a depth rate of {depth_rate:g} m/s: the pitch angle would"
            f" pass {degrees(STEEPEST):.0f} degrees. At this speed ±{speed * sin(STEEPEST):.2g} m/s is the most."
        )
    return speed, depth_rate, turn_rate, wet_length, roll


def check_limits(hull: Vehicle, x: np.ndarray) -> None:
    """Refuse a steady motion that some actuator cannot hold."""
    beyond = [one for one in demands(hull, x) if one.value > one.limit]
    if beyond:
        said = "; ".join(
            f"the {one.name} would need {one.value:.3g} {one.unit}, its limit is {one.limit:.3g}"
            for one in beyond
        )
        raise NoTrimError(f"There is no such steady motion: {said}. Ask for less speed, turn or depth rate.")


def say_how_far(hull: Vehicle, x: np.ndarray, share: float) -> NoReturn:
    """Raise the error of a motion that has no balance."""
    check_limits(hull, x)
    most = max(demands(hull, x), key=lambda one: one.value / one.limit)
    raise NoTrimError(
        f"There is no such steady motion: there is no balance beyond {share:.0%} of the asked depth rate, turn rate and"
        f" roll, where the {most.name} stands at {most.value:.3g} {most.unit} (limit {most.limit:.3g}): they stall."
        " Ask for less, or for more speed."
    )
