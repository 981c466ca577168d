"""Steady motion: which propeller speed, fins and attitude hold a speed, a depth rate and a turn.

    ν'(n, δ_r, δ_e, δ_d, θ, v, w) = 0,   z' = depth rate,   (p, q, r) = J⁻¹ (0, 0, ψ')

Seven equations, seven unknowns; the roll angle is asked for (0) and held by unlike stern-planes. Propeller and fins
are solved for without their limits first, if necessary in steps from straight level motion to the requested one: a
motion that is impossible is then reported with the limit that excludes it. Speeds are through the water; a uniform
current only carries the track.

A motion that is impossible is refused with the reason, and the largest motion that is possible (`NoTrimError`).

The force of the cable in steady motion is (`SteadyPull`)

    F_c = −(½ρπdC_t |V|² S + C_f/R_d) V/|V|,   M_c = r_c × F_c          (37), with the drum's friction

V is the velocity of the tow point through the water, v + ω × r_c. The cable lies along the way that the tow point
came: exact for a straight way (the discrete cable has this solution at every step); in a turn it is the limit of a
cable that cannot be dragged sideways, C_n ≫ C_t, and the real one cuts the corner. A cable with weight is not in the
formula. Where that matters, `subzero.steady_motion.trim` pulls the cable itself along the way.

A vehicle that speeds up takes its cable along: m S more of mass at the tow point, along V.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from math import ceil, cos, degrees, floor, radians, sin, sqrt
from typing import NoReturn

import numpy as np

from subzero.errors import UserError, real, short
from subzero.files.text_repr import Overview
from subzero.model import Model
from subzero.steady_motion.hull_state_space import (
    DEPTH,
    PITCH,
    ROLL,
    STATE_NAMES,
    SURGE,
    VELOCITY,
    commands,
    demands,
    ideal,
    rate,
)
from vehicle import Vehicle, VehicleNumbers

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


RESIDUAL = 1e-9
"""Tolerances of accelerations and depth rate. [m/s2, rad/s2, m/s]"""
FARTHEST = 1.2
"""Fin and pitch angles beyond this are another balance than the one that is looked for. [rad]"""


FASTEST = 50.0
"""A run that is faster is stopped as absurd, `subzero.engine.coupling.FASTEST`. [m/s]"""
STEEPEST = radians(80.0)
"""Pitch beyond which Euler angles are no use any more. [rad]"""


class NoTrimError(UserError):
    """There is no such steady motion; the message names the limit that is hit."""


@dataclass(frozen=True, kw_only=True)
class Asked:
    """Which steady motion.

    Attributes:
        speed: u, forward speed through the water. [m/s]
        depth_rate: z', positive down. [m/s]
        turn_rate: ψ', positive to starboard. [rad/s]
        wet_length: cable in the water; its pull is taken as steady although it grows. [m]
        roll: φ, held by unlike stern-planes. [rad]

    Raises:
        NoTrimError: a depth rate that is too steep at this speed.
        UserError: a number that means nothing here.
    """

    speed: float
    depth_rate: float = 0.0
    turn_rate: float = 0.0
    wet_length: float = 0.0
    roll: float = 0.0

    def __post_init__(self) -> None:
        """Raise an error for a request that is not valid."""
        for field in fields(self):
            number = real(value := getattr(self, field.name))
            if number is None:
                raise UserError(f"trim: {field.name} is {short(value)}; it must be a finite number.")
            object.__setattr__(self, field.name, number)
        if self.speed <= 0.0:
            raise UserError(f"trim: speed is {self.speed:g} m/s; fins need a flow, so it must be above 0.")
        if self.speed > FASTEST:
            raise UserError(
                f"trim: speed is {self.speed:g} m/s; it must be at most {FASTEST:g}, as runs are stopped beyond."
            )
        if self.wet_length < 0.0:
            raise UserError(f"trim: wet_length is {self.wet_length:g} m; it must be 0 or more.")
        most = self.speed * sin(STEEPEST)
        if abs(self.depth_rate) > most:
            raise NoTrimError(
                f"There is no steady motion at {self.speed:g} m/s with a depth rate of {self.depth_rate:g} m/s: the"
                f" pitch angle would pass {degrees(STEEPEST):.0f} degrees. At this speed ±{most:.2g} m/s is the most."
            )

    def part(self, share: float) -> Asked:
        """Return the same with a share of everything that is not straight and level."""
        asked = {name: share * getattr(self, name) for name in ("depth_rate", "turn_rate", "roll")}
        return replace(self, **asked)


@dataclass(frozen=True, kw_only=True)
class Motion:
    """The requested motion, of which hull (its numbers without limits), with which pull beyond the formula's."""

    asked: Asked
    numbers: VehicleNumbers
    pull: SteadyPull
    extra: np.ndarray

    def part(self, share: float) -> Motion:
        """Return the same with a share of everything that is not straight and level."""
        return replace(self, asked=self.asked.part(share), extra=share * self.extra)

    def state(self, y: np.ndarray) -> np.ndarray:
        """Return x (16,) for the unknowns n, δ_r, δ_e, δ_d, θ, v, w."""
        n, rudder, together, unlike, pitch, v, w = y
        x, roll = np.zeros(16), self.asked.roll
        x[ROLL], x[PITCH] = roll, pitch
        spin = (-sin(pitch), cos(pitch) * sin(roll), cos(pitch) * cos(roll))
        x[VELOCITY] = self.asked.speed, v, w, *(self.asked.turn_rate * part for part in spin)
        x[12:] = n, rudder, together - unlike, together + unlike
        return x

    def left(self, y: np.ndarray) -> np.ndarray:
        """Return the residual of the seven equations."""
        x = self.state(y)
        rates = rate(x, x[12:], self.numbers, self.pull.wrench(x[VELOCITY]) + self.extra)
        return np.append(rates[VELOCITY], rates[DEPTH] - self.asked.depth_rate)

    def solved(self, y: np.ndarray) -> np.ndarray | None:
        """Return the unknowns from a guess; None if they are not found."""
        from scipy.optimize import root

        found = root(self.left, y, tol=1e-13).x
        near = np.max(np.abs(found[1:5])) < FARTHEST
        return found if near and np.max(np.abs(self.left(found))) < RESIDUAL else None


def level_propeller(motion: Motion) -> float:
    """Return n at which thrust balances drag and pull straight ahead with central fins, a n² − b n u − c u² = R."""
    p, u = motion.numbers.propeller, motion.asked.speed
    x = motion.part(0.0).state(np.zeros(7))
    rates = rate(x, x[12:], motion.numbers, motion.pull.wrench(x[VELOCITY]))
    brake = -float(motion.numbers.mass_matrix[0] @ rates[VELOCITY])  # with the propeller standing still
    if p.thrust_nn == 0.0:
        return 0.0
    return (p.thrust_nu * u + sqrt((p.thrust_nu * u) ** 2 + 4.0 * p.thrust_nn * brake)) / (2.0 * p.thrust_nn)


STEPS = 20
"""A motion that is not found at once is approached in so many steps."""
SLOWEST = 1e-2
"""Speeds that can be held are not looked for below this. [m/s]"""
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

    def __repr__(self) -> str:
        """Return the motion in a few lines."""
        rudder, port, starboard = np.degrees(self.command[1:])
        roll, pitch = (np.degrees(self.named()[name]) for name in ("roll", "pitch"))
        motion = [f"{self.speed:.4g} m/s", f"{self.depth_rate:.4g} m/s down"]
        rows = [
            ("motion", *motion, f"{np.degrees(self.turn_rate):.4g} degree/s to starboard"),
            ("attitude", f"pitch {pitch:.4g} degree", f"roll {roll:.4g} degree"),
            ("propeller", f"{self.propeller_rps:.4g} rev/s"),
            ("fins", f"rudder {rudder:.4g} degree", f"stern-planes {port:.4g} and {starboard:.4g} degree"),
            ("cable", f"{self.wet_length:.4g} m", f"pulls {np.linalg.norm(self.wrench[:3]):.4g} N"),
        ]
        return Overview("Steady motion", rows).text()


Pull = Callable[[np.ndarray, Asked], np.ndarray]
"""(state (16,), requested motion) → wrench of the cable (6,), body axes [N, N m]."""


def steady_motion(model: Model, asked: Asked, pull_of: Pull | None = None) -> Trim:
    """Return the steady motion of a model.

    Args:
        model: vehicle and cable.
        asked: which motion.
        pull_of: the pull of the cable in it, if not that of the formula.

    Raises:
        NoTrimError: there is none: which limit is hit, and how far one can go.
        UserError: the pull cannot be had.
    """
    try:
        return _trim(model, asked, pull_of)
    except NoTrimError as error:
        slowest, most = held_speeds(model, asked.wet_length)
        if slowest <= asked.speed <= most or not most:
            raise
        behind = f" on {asked.wet_length:g} m of cable" if asked.wet_length else ""
        held = f"{floor(1e3 * most) / 1e3:g} m/s at most"
        if asked.speed < slowest:
            held = f"{ceil(1e3 * slowest) / 1e3:g} m/s at least"
        raise NoTrimError(f"{error} Straight ahead{behind} the hull holds {held}.") from None


def held_speeds(model: Model, wet_length: float = 0.0) -> tuple[float, float]:
    """Return the slowest and the fastest speed that can be held straight and level, (0, 0) if there is none. [m/s]

    Planes too small for the net buoyancy set the slowest, the propeller the fastest. A range that does not reach from
    a speed to its double may be missed.
    """
    speeds = [SLOWEST]
    while 2.0 * speeds[-1] < FASTEST:
        speeds.append(2.0 * speeds[-1])
    held = [_is_held(model, speed, wet_length) for speed in speeds]
    if not any(held):
        return 0.0, 0.0
    first, last = held.index(True), len(held) - 1 - held[::-1].index(True)
    slowest = _edge(model, wet_length, speeds[first], speeds[first - 1]) if first else speeds[0]
    return slowest, _edge(model, wet_length, speeds[last], (*speeds, FASTEST)[last + 1])


def _is_held(model: Model, speed: float, wet_length: float) -> bool:
    """Whether a speed can be held straight and level."""
    try:
        _trim(model, Asked(speed=speed, wet_length=wet_length))
    except NoTrimError:
        return False
    return True


def _edge(model: Model, wet_length: float, held: float, beyond: float) -> float:
    """Return the last speed that is held on the way from one that is to one that is not, by halving. [m/s]"""
    while abs(beyond - held) > 1e-3 * held:
        middle = 0.5 * (held + beyond)
        held, beyond = (middle, beyond) if _is_held(model, middle, wet_length) else (held, middle)
    return held


def _trim(model: Model, asked: Asked, pull_of: Pull | None = None) -> Trim:
    """Return the steady motion; refused with the limit alone."""
    hull, pull = model.vehicle, SteadyPull.of(model, asked.wet_length)
    motion = Motion(asked=asked, numbers=ideal(hull).numbers(), pull=pull, extra=np.zeros(6))
    x = _balanced(hull, motion)
    if pull_of is not None and asked.wet_length > 0.0:
        for _ in range(PASSES):
            motion = replace(motion, extra=pull_of(x, asked) - pull.wrench(x[VELOCITY]))
            x = _balanced(hull, motion)
    check_limits(hull, x)
    return Trim(
        speed=asked.speed,
        depth_rate=asked.depth_rate,
        turn_rate=asked.turn_rate,
        wet_length=asked.wet_length,
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
            raise_no_trim(hull, motion.part(reached).state(guess), reached)
        guess, reached = found, share
    return motion.state(guess)


def check_limits(hull: Vehicle, x: np.ndarray) -> None:
    """Raise an error for a steady motion that some actuator cannot hold."""
    beyond = [demand for demand in demands(hull, x) if demand.value > demand.limit]
    if beyond:
        said = "; ".join(
            f"the {each.name} would need {each.value:.3g} {each.unit}, its limit is {each.limit:.3g}"
            for each in beyond
        )
        raise NoTrimError(
            f"There is no such steady motion: {said}. Ask for less turn or depth rate, or another speed."
        )


def raise_no_trim(hull: Vehicle, x: np.ndarray, share: float) -> NoReturn:
    """Raise the error of a motion that has no balance."""
    check_limits(hull, x)
    if share == 0.0:
        raise NoTrimError(
            f"There is no such steady motion: not even straight and level do the forces balance at {x[SURGE]:g} m/s."
        )
    most = max(demands(hull, x), key=lambda demand: demand.value / demand.limit)
    raise NoTrimError(
        f"There is no such steady motion: there is no balance beyond {share:.0%} of the asked depth rate, turn rate and"
        f" roll, where the {most.name} stands at {most.value:.3g} {most.unit} (limit {most.limit:.3g}): they stall."
        " Ask for less, or for more speed."
    )
