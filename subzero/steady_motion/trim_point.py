"""Steady motion: which propeller speed, fins and attitude hold a speed, a depth rate and a turn.

    ν'(n, δ_r, δ_e, δ_d, θ, v, w) = 0,   z' = depth rate,   (p, q, r) = J⁻¹ (0, 0, ψ')

Seven equations, seven unknowns; the roll angle is asked for (0) and held by unlike stern-planes. Propeller and fins
are solved for without their limits first, if necessary in steps from straight level motion to the requested one: a
motion that is impossible is then reported with the limit that excludes it. Speeds are through the water; a uniform
current only carries the track.

A motion that is impossible is refused with the reason, and the largest motion that is possible (`NoTrimError`).

The force of the cable is that of `subzero.steady_motion.steady_pull`. A vehicle on thrusters has other unknowns
(`thruster_motion`), and may stand still; a glider has, too, and must sink or rise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, floor
from typing import NoReturn

import numpy as np

from subzero.files.text_repr import Overview
from subzero.model import Model
from subzero.steady_motion.asked import FASTEST, Asked, NoTrimError
from subzero.steady_motion.hull_state_space import (
    ACTUATORS,
    STATE_NAMES,
    SURGE,
    VELOCITY,
    Demand,
    commands,
    demands,
    ideal,
    listed_commands,
    thruster_demands,
)
from subzero.steady_motion.motion import (
    GliderMotion,
    Motion,
    PropellerMotion,
    channel_demands,
    glider_refusal,
    is_glider,
)
from subzero.steady_motion.steady_pull import SteadyPull
from subzero.steady_motion.thruster_motion import ThrusterMotion, is_on_thrusters, refusal
from vehicle import Vehicle

RESIDUAL = 1e-9
"""Tolerances of accelerations and depth rate. [m/s2, rad/s2, m/s]"""


def solved(motion: Motion, y: np.ndarray) -> np.ndarray | None:
    """Return the unknowns of a motion from a guess; None if they are not found."""
    from scipy.optimize import root

    found: np.ndarray = root(motion.left, y, tol=1e-13).x
    return found if motion.is_near(found) and np.max(np.abs(motion.left(found))) < RESIDUAL else None


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
        state: x (16 and one for each channel,), as in `states_of`, at the origin with heading 0.
        command: propeller [rev/s], rudder, port and starboard plane [rad], and that of each channel.
        listed: names of the channels.
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
    listed: tuple[str, ...] = ()

    @property
    def propeller_rps(self) -> float:
        """Propeller speed [rev/s]."""
        return float(self.state[12])

    @property
    def command_angles(self) -> np.ndarray:
        """Command (4 and more,) of actuators without offset, dead band and sag, as linear models have them."""
        return np.concatenate([self.state[ACTUATORS], self.command[4:]])

    @property
    def time_scale(self) -> float:
        """L/U, of a vehicle at rest over 1 m/s. [s]"""
        return self.length / (abs(self.speed) or 1.0)

    def named(self) -> dict[str, float]:
        """Return the state by name, SI and radians."""
        names = STATE_NAMES + tuple(f"{name}_state" for name in self.listed)
        return dict(zip(names, self.state.tolist(), strict=True))

    def __repr__(self) -> str:
        """Return the motion in a few lines."""
        rudder, port, starboard = np.degrees(self.command[1:4])
        roll, pitch = (np.degrees(self.named()[name]) for name in ("roll", "pitch"))
        motion = [f"{self.speed:.4g} m/s", f"{self.depth_rate:.4g} m/s down"]
        rows = [
            ("motion", *motion, f"{np.degrees(self.turn_rate):.4g} degree/s to starboard"),
            ("attitude", f"pitch {pitch:.4g} degree", f"roll {roll:.4g} degree"),
            ("propeller", f"{self.propeller_rps:.4g} rev/s"),
            ("fins", f"rudder {rudder:.4g} degree", f"stern-planes {port:.4g} and {starboard:.4g} degree"),
            ("cable", f"{self.wet_length:.4g} m", f"pulls {np.linalg.norm(self.wrench[:3]):.4g} N"),
        ]
        listed = [
            f"{name} {x:.4g}"
            for name, x in zip(self.listed, self.command[4:], strict=True)
            if abs(x) > RESIDUAL
        ]
        rows += [("listed", *listed)] if listed else []
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
    if is_on_thrusters(model.vehicle) or is_glider(model.vehicle):
        is_driven = is_on_thrusters(model.vehicle)
        if refused := refusal(model.vehicle, asked) if is_driven else glider_refusal(asked):
            raise NoTrimError(f"There is no steady motion of this vehicle: {refused}.")
    elif not model.vehicle.propeller.thrust_constant > 0.0:
        raise NoTrimError("There is no steady motion of this vehicle: it has no propeller and no thrusters.")
    else:
        asked.check_flow()
    try:
        return _trim(model, asked, pull_of)
    except NoTrimError as error:
        slowest, most = (0.0, 0.0) if is_glider(model.vehicle) else held_speeds(model, asked.wet_length)
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
    motion = _motion(hull, asked, pull)
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
        command=_commands(hull, x),
        wrench=pull.wrench(x[VELOCITY]) + motion.extra,
        listed=tuple(channel.name for channel in hull.channels),
    )


def _motion(hull: Vehicle, asked: Asked, pull: SteadyPull) -> Motion:
    """Return the requested motion of a hull by what drives it."""
    kind = ThrusterMotion if is_on_thrusters(hull) else GliderMotion if is_glider(hull) else PropellerMotion
    return kind(asked=asked, hull=hull, numbers=ideal(hull).numbers(), pull=pull)


def _commands(hull: Vehicle, x: np.ndarray) -> np.ndarray:
    """Return the commands that lead to the actuators of a state."""
    if is_on_thrusters(hull) or is_glider(hull):
        return np.array([0.0] * 4 + listed_commands(hull, x))
    return commands(hull, x)


def _demands(hull: Vehicle, x: np.ndarray) -> list[Demand]:
    """Return the demands of a state on the actuators that drive a vehicle."""
    if is_glider(hull):
        return channel_demands(hull, x)
    return thruster_demands(hull, x) if is_on_thrusters(hull) else demands(hull, x)


def _balanced(hull: Vehicle, motion: Motion) -> np.ndarray:
    """Return the state of a steady motion, at once from straight level motion, or in steps."""
    guess = motion.guess()
    direct = solved(motion, guess)
    if direct is not None:
        return motion.state(direct)
    reached = 0.0
    for share in np.linspace(0.0, 1.0, STEPS + 1):
        found = solved(motion.part(share), guess)
        if found is None:
            raise_no_trim(hull, motion.part(reached).state(guess), reached)
        guess, reached = found, share
    return motion.state(guess)


def check_limits(hull: Vehicle, x: np.ndarray) -> None:
    """Raise an error for a steady motion that some actuator cannot hold."""
    beyond = [demand for demand in _demands(hull, x) if demand.value > demand.limit]
    if beyond:
        if is_on_thrusters(hull):  # one says it for all: they share a wrench
            beyond = [max(beyond, key=lambda demand: demand.value / demand.limit)]
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
    most = max(_demands(hull, x), key=lambda demand: demand.value / demand.limit)
    raise NoTrimError(
        f"There is no such steady motion: there is no balance beyond {share:.0%} of the asked depth rate, turn rate and"
        f" roll, where the {most.name} stands at {most.value:.3g} {most.unit} (limit {most.limit:.3g}): they stall."
        " Ask for less, or for more speed."
    )
