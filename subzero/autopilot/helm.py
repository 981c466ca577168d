"""What a manoeuvre moves: a rudder and stern-planes, or the thrusters in their place.

A manoeuvre asks for a rudder, for stern-planes, or for the propulsion astern. On a vehicle that thrusters drive, a
rudder is a yaw moment and stern-planes are a pitch moment, so that 35 degrees, a rudder hard over, is half of the most
that its thrusters make; the wrench of the straight run is added, and allocated with it (`vehicle.thrusters`).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np

from subzero.steady_motion.hull_state_space import CHANNELS
from subzero.steady_motion.thruster_motion import unheld
from subzero.steady_motion.trim_point import Trim
from vehicle import Vehicle
from vehicle.thrusters import AXES, allocation, commands_of_wrench, table_of, thrust_at_rest

HARD_OVER, SHARE_OF_HARD_OVER = radians(35.0), 0.5
"""A rudder hard over, and the share of the largest moment that it stands for. [rad, 1]"""


@dataclass(frozen=True)
class FinHelm:
    """Propeller, rudder and stern-planes, as they are."""

    straight: tuple[float, ...]

    def command(
        self, *, rudder: float | None = None, planes: float = 0.0, propulsion: float = 1.0
    ) -> tuple[float, ...]:
        """Return the straight command with a rudder [rad], both stern-planes moved [rad], the propulsion times a
        factor.
        """
        n, own, port, starboard, *listed = self.straight
        return propulsion * n, own if rudder is None else rudder, port + planes, starboard + planes, *listed


@dataclass(frozen=True, eq=False)
class ThrusterHelm:
    """Moments of thrusters in place of fins.

    Attributes:
        straight: command of the straight run.
        names: of the thrusters.
        wrench: of the thrusters in the straight run, at rest. [N, N m]
        most: largest wrench by axis, each alone (6,). [N, N m]
        table: of the thrusters, as the compiled functions take it.
        arms: wrench of each per newton (thrusters, 6). [N/N, m]
        allocate: thrusts per wrench (thrusters, 6). [N/N, 1/m]
    """

    straight: tuple[float, ...]
    names: tuple[str, ...]
    wrench: np.ndarray
    most: np.ndarray
    table: np.ndarray
    arms: np.ndarray
    allocate: np.ndarray

    @classmethod
    def of(cls, hull: Vehicle, steady: Trim) -> ThrusterHelm:
        """Return the helm of a vehicle in a steady motion."""
        thrusters, table = hull.thruster_list, table_of(hull.thruster_list)
        arms = np.array([each.wrench for each in thrusters])
        strength = [min(each.thrust_ahead, each.thrust_astern) for each in thrusters]
        held = tuple(axis for axis in AXES if axis not in (unheld(hull) or ()))
        return cls(
            straight=tuple(steady.command.tolist()),
            names=tuple(name for name, _ in hull.thrusters),
            wrench=_thrusts(steady.state[CHANNELS][: len(thrusters)], table) @ arms,
            most=strength @ np.abs(arms),
            table=table,
            arms=arms,
            allocate=allocation(thrusters, held),
        )

    def moment(self, axis: str, angle: float) -> float:
        """Return the moment about an axis that stands for a fin's angle [rad]. [N m]"""
        return float(SHARE_OF_HARD_OVER * self.most[AXES.index(axis)] * angle / HARD_OVER)

    def command(
        self, *, rudder: float | None = None, planes: float = 0.0, propulsion: float = 1.0
    ) -> tuple[float, ...]:
        """Return the commands of the thrusters; where one would pass its limit, all are reduced alike."""
        wrench, out = self.wrench.copy(), np.zeros(len(self.straight))
        wrench[0] *= propulsion
        wrench[5] += self.moment("yaw", rudder or 0.0)
        wrench[4] += self.moment("pitch", planes)
        commands_of_wrench(wrench, self.allocate, self.table, len(self.names), out)
        return tuple(out.tolist())

    def angles(self, axis: str, commands: np.ndarray) -> np.ndarray:
        """Return the angles (n,) of a fin that commands of the thrusters (n, thrusters) stand for [rad], 0 for those of
        the straight run.
        """
        at = AXES.index(axis)
        made = np.array([_thrusts(row, self.table) @ self.arms[:, at] for row in commands])
        off = (made - self.wrench[at]) / self.moment(axis, 1.0)
        return np.where(np.abs(off) < LITTLE, 0.0, off)


Helm = FinHelm | ThrusterHelm
"""The command of a vehicle for a rudder and stern-planes."""


def _thrusts(shares: np.ndarray, table: np.ndarray) -> np.ndarray:
    """Return the thrusts at rest at lagged commands (thrusters,). [N]"""
    return np.array([thrust_at_rest(float(share), row) for share, row in zip(shares, table, strict=False)])


LITTLE = 1e-6
"""Rounding of commands. [rad]"""
