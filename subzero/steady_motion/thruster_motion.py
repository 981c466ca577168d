"""Steady motion of a vehicle that thrusters drive: which thrusts and attitude hold its speeds, depth rate and turn.

    ν'(τ, φ, θ, v, w) = 0,   z' = depth rate,   (p, q, r) = J⁻¹ (0, 0, ψ'),   thrusts = W (B W)⁺ τ

Seven equations. The unknowns are a wrench τ along the axes that the thrusters hold, and the heave speed w. Of an axis
that they do not hold, the motion itself is unknown instead: pitch, roll, or sway, as few as will do. Surge, heave and
yaw must be held. The wrench goes to the thrusters by `vehicle.thrusters.allocation`, the least thrusts that make it;
dead ones are left out. Inflow into the thrusters is in the equations, so that its loss is made up for. Limits are left
out here and looked at afterwards, as of fins (`trim_point`).
"""

from __future__ import annotations

from functools import cached_property
from math import pi

import numpy as np

from subzero.steady_motion.asked import Asked
from subzero.steady_motion.hull_state_space import (
    CHANNELS,
    HEADING,
    PITCH,
    ROLL,
    VELOCITY,
    resting_state,
)
from subzero.steady_motion.motion import Motion
from vehicle import Vehicle
from vehicle.thrusters import AHEAD, ASTERN, AXES, DEAD_BAND, EXPONENT, Thruster, allocation

LEFT_TO_THE_HULL = (
    (),
    ("pitch",),
    ("roll",),
    ("roll", "pitch"),
    ("sway",),
    ("sway", "pitch"),
    ("sway", "roll"),
    ("sway", "roll", "pitch"),
)
"""Axes that thrusters need not hold: the first of these that will do is taken."""
SWAY, HEAVE, ROLLED, PITCHED = (AXES.index(axis) for axis in ("sway", "heave", "roll", "pitch"))


def is_on_thrusters(hull: Vehicle) -> bool:
    """Return whether thrusters drive a vehicle, and not a propeller with fins."""
    return bool(hull.thrusters) and not hull.propeller.thrust_constant > 0.0


def working(hull: Vehicle) -> tuple[Thruster, ...]:
    """Return the thrusters of a vehicle, those that are dead without any effect on the allocation."""
    return tuple(thruster for thruster in hull.thruster_list if thruster.lost_command < 1.0)


def unheld(hull: Vehicle) -> tuple[str, ...] | None:
    """Return the axes that the thrusters of a vehicle leave to its hull; None if they do not hold the others either."""
    thrusters = working(hull)
    if not thrusters:
        return None
    B = np.column_stack([thruster.wrench for thruster in thrusters])
    for left in LEFT_TO_THE_HULL:
        held = [i for i, axis in enumerate(AXES) if axis not in left]
        if np.linalg.matrix_rank(B[held], tol=INDEPENDENT) == len(held):
            return left
    return None


INDEPENDENT = 1e-3
"""Thrusters whose lever arms differ by less do not hold an axis. [m]"""


def shares_of_wrench(hull: Vehicle, wrench: np.ndarray, free: tuple[str, ...]) -> np.ndarray:
    """Return the states of the thrusters (thrusters,) that make a wrench (6,) at rest, beyond ±1 if need be; along axes
    that are free they make whatever comes of it. [-]
    """
    alive = [i for i, thruster in enumerate(hull.thruster_list) if thruster.lost_command < 1.0]
    shares = np.zeros(len(hull.thrusters))
    held = tuple(axis for axis in AXES if axis not in free)
    thrusts = allocation(working(hull), held) @ wrench
    for i, thrust in zip(alive, thrusts, strict=True):
        row = hull.thruster_list[i].row()
        c = (abs(thrust) / (row[AHEAD] if thrust > 0.0 else row[ASTERN])) ** (1.0 / row[EXPONENT])
        shares[i] = np.sign(thrust) * (row[DEAD_BAND] + (1.0 - row[DEAD_BAND]) * c)
    return shares


class ThrusterMotion(Motion):
    """The requested motion of a hull on thrusters."""

    @cached_property
    def free(self) -> tuple[str, ...]:
        """Axes that its thrusters do not hold: the motion along them is unknown."""
        return unheld(self.hull) or ()

    def guess(self) -> np.ndarray:
        """Return the unknowns (7,) to begin with: no thrust, level, sinking as asked."""
        return np.array([0.0] * 6 + [self.asked.depth_rate])

    def state(self, y: np.ndarray) -> np.ndarray:
        """Return x for the unknowns: the wrench, the motion in its place along axes that are free, and w."""
        asked, x = self.asked, resting_state(self.hull)
        is_free = [axis in self.free for axis in AXES]
        roll = y[ROLLED] if is_free[ROLLED] else asked.roll
        pitch = y[PITCHED] if is_free[PITCHED] else 0.0
        sway = y[SWAY] if is_free[SWAY] else asked.sway_speed
        x[ROLL], x[PITCH], x[HEADING] = roll, pitch, 0.0
        x[VELOCITY] = self.velocity(roll, pitch, sway, y[6])
        wrench = np.where(is_free, 0.0, y[:6])
        x[CHANNELS.start : CHANNELS.start + len(self.hull.thrusters)] = shares_of_wrench(
            self.hull, wrench, self.free
        )
        return x

    def is_near(self, y: np.ndarray) -> bool:
        """Return whether unknowns are those of an upright hull, not of another balance."""
        x = self.state(y)
        return bool(max(abs(x[ROLL]), abs(x[PITCH])) < 0.5 * pi)


def _lacking(hull: Vehicle) -> list[str]:
    """Return the axes that must be held and along which thrusters do not push."""
    needed = [axis for axis in AXES if axis not in LEFT_TO_THE_HULL[-1]]
    thrusters = working(hull)
    if not thrusters:
        return needed
    B = np.column_stack([thruster.wrench for thruster in thrusters])
    made = (B @ allocation(thrusters, tuple(needed))).diagonal()
    return [axis for axis in needed if made[AXES.index(axis)] < 1.0 - INDEPENDENT]


def refusal(hull: Vehicle, asked: Asked) -> str:
    """Return why a motion cannot be asked of a vehicle on thrusters; empty if it can."""
    free, count = unheld(hull), len(working(hull))
    if free is None:
        return f"its {count} working thrusters cannot push along {' and '.join(_lacking(hull))}"
    for axis, value in (("sway", asked.sway_speed), ("roll", asked.roll)):
        if axis in free and value:
            return f"its {count} working thrusters do not hold {axis}, so none can be asked for"
    return ""
