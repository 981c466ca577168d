"""Steady motion: which propeller speed, fins and attitude hold a speed, a depth rate and a turn.

    ν'(n, δ_r, δ_e, δ_d, θ, v, w) = 0,   z' = depth rate,   (p, q, r) = J⁻¹ (0, 0, ψ')

Seven equations, seven unknowns; the roll angle is asked for (0) and held by unlike stern-planes. Propeller and fins
are solved for without their limits first, if need be in steps from straight level motion to what is asked for: so a
motion that cannot be had is told with the limit that is in its way. Speeds are through the water; a uniform current
only carries the track.

A motion that cannot be had is refused with what is in the way, and how far one can go (`NoTrimError`).

The force of the cable in steady motion is (`SteadyPull`)

    F_c = −(½ρπdC_t |V|² S + C_f/R_d) V/|V|,   M_c = r_c × F_c          (37), with the drum's friction

V is the velocity of the tow point through the water, v + ω × r_c. The cable lies along the way that the tow point
came: exact for a straight way (the discrete cable has this solution at every step); in a turn it is the limit of a
cable that cannot be dragged sideways, C_n ≫ C_t, and the real one cuts the corner. A cable with weight is not in the
formula. Where that matters, `from_cable_model` pulls the cable itself along the way.

A vehicle that speeds up takes its cable along: m S more of mass at the tow point, along V.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import cos, degrees, floor, radians, sin, sqrt
from typing import NoReturn

import numpy as np

import cable
from subzero.errors import UserError, real, short
from subzero.model import Model
from subzero.steady_motion.hull_state_space import (
    DEPTH,
    PITCH,
    ROLL,
    STATE_NAMES,
    VELOCITY,
    commands,
    demands,
    ideal,
    rate,
    to_vehicle,
)
from vehicle import Vehicle, VehicleNumbers, rotation

NO_WAY = 1e-9
"""Below this speed of the tow point there is no direction to pull against. [m/s]"""


@dataclass(frozen=True, kw_only=True)
class SteadyPull:
    """The cable of a model at a fixed length.

    Attributes:
        drag: ½ρπdC_t S. [kg/m]
        friction: C_f/R_d. [N]
        mass: m S. [kg]
        tow_point: r_c, body axes (3,). [m]
    """

    drag: float
    friction: float
    mass: float
    tow_point: np.ndarray

    @classmethod
    def of(cls, model: Model, wet_length: float) -> SteadyPull:
        """Return the cable of a model with `wet_length` metres in the water; none pulls with none."""
        pulls = 1.0 if wet_length > 0.0 else 0.0
        return cls(
            drag=model.cable.tangential_drag * wet_length,
            friction=pulls * model.drum.friction_torque / model.drum.radius,
            mass=model.cable.mass_per_length * wet_length,
            tow_point=model.vehicle.tow_point.position(),
        )

    def wrench(self, nu: np.ndarray) -> np.ndarray:
        """Return force and moment on the hull (6,), body axes [N, N m], at nu (6,) through the water."""
        V = nu[:3] + np.cross(nu[3:], self.tow_point)
        speed = float(np.linalg.norm(V))
        if speed < NO_WAY:
            return np.zeros(6)
        F = -(self.drag * speed + self.friction / speed) * V
        return np.concatenate([F, np.cross(self.tow_point, F)])


def from_cable_model(
    model: Model, velocity_n: Callable[[float], np.ndarray], R_nb: np.ndarray, duration: float
) -> np.ndarray:
    """Return the pull of the cable itself, wrench (6,) in body axes [N, N m], at the end of a way.

    Args:
        model: whose cable, drum and tow point.
        velocity_n: velocity of the tow point through the water at a time, earth axes. [m/s]
        R_nb: attitude of the hull at the end of the way (3, 3).
        duration: how long cable has been paid out. [s]

    Raises:
        UserError: the cable could not be solved along this way.
    """
    from subzero.errors import UserError

    step = min(0.1, duration / 20.0)
    run = cable.pull_out(
        velocity_n, duration, cable=model.cable, drum=model.drum, scheme=cable.MovingEnd(time_step=step)
    )
    if not run.outcome.completed:
        raise UserError(f"The cable has no steady pull along this way. {run.outcome.message}")
    F = R_nb.T @ run.tow_force[-1]
    return np.concatenate([F, np.cross(model.vehicle.tow_point.position(), F)])


RESIDUAL = 1e-9
"""What may be left of accelerations and depth rate. [m/s2, rad/s2, m/s]"""
FARTHEST = 1.2
"""Fin and pitch angles beyond this are another balance than the one that is looked for. [rad]"""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """What is asked for, of which hull (its numbers without limits), with which pull beyond the formula's."""

    numbers: VehicleNumbers
    pull: SteadyPull
    speed: float
    depth_rate: float
    turn_rate: float
    roll: float
    extra: np.ndarray

    def part(self, share: float) -> Motion:
        """Return the same with a share of everything that is not straight and level."""
        asked = {name: share * getattr(self, name) for name in ("depth_rate", "turn_rate", "roll", "extra")}
        return replace(self, **asked)

    def state(self, y: np.ndarray) -> np.ndarray:
        """Return x (16,) for the unknowns n, δ_r, δ_e, δ_d, θ, v, w."""
        n, rudder, together, unlike, pitch, v, w = y
        x = np.zeros(16)
        x[ROLL], x[PITCH] = self.roll, pitch
        spin = (-sin(pitch), cos(pitch) * sin(self.roll), cos(pitch) * cos(self.roll))
        x[VELOCITY] = self.speed, v, w, *(self.turn_rate * part for part in spin)
        x[12:] = n, rudder, together - unlike, together + unlike
        return x

    def left(self, y: np.ndarray) -> np.ndarray:
        """Return what is left of the seven equations."""
        x = self.state(y)
        rates = rate(x, x[12:], self.numbers, self.pull.wrench(x[VELOCITY]) + self.extra)
        return np.append(rates[VELOCITY], rates[DEPTH] - self.depth_rate)

    def solved(self, y: np.ndarray) -> np.ndarray | None:
        """Return the unknowns from a guess; None if they are not found."""
        from scipy.optimize import root

        found = root(self.left, y, tol=1e-13).x
        near = np.max(np.abs(found[1:5])) < FARTHEST
        return found if near and np.max(np.abs(self.left(found))) < RESIDUAL else None


def level_propeller(motion: Motion) -> float:
    """Return n at which thrust balances drag and pull straight ahead with central fins, a n² − b n u − c u² = R."""
    p, u = motion.numbers.propeller, motion.speed
    x = motion.part(0.0).state(np.zeros(7))
    rates = rate(x, x[12:], motion.numbers, motion.pull.wrench(x[VELOCITY]))
    brake = -float(motion.numbers.mass_matrix[0] @ rates[VELOCITY])  # with the propeller standing still
    if p.thrust_nn == 0.0:
        return 0.0
    return (p.thrust_nu * u + sqrt((p.thrust_nu * u) ** 2 + 4.0 * p.thrust_nn * brake)) / (2.0 * p.thrust_nn)


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
"""A run that is faster is stopped as absurd, `subzero.engine.coupling.FASTEST`. [m/s]"""
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
