"""What a manoeuvre moves: a rudder and stern-planes, or the thrusters in their place.

A manoeuvre asks for a rudder, for stern-planes, or for the propulsion astern. On a vehicle that thrusters drive, a
rudder is a yaw moment and stern-planes are a pitch moment, so that 35 degrees, a rudder hard over, is half of the most
that its thrusters make; the wrench of the straight run is added, and allocated with it (`vehicle.thrusters`).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import Protocol

import numpy as np

from subzero.steady_motion.hull_state_space import CHANNELS
from subzero.steady_motion.thruster_motion import unheld, working
from subzero.steady_motion.trim_point import Trim
from vehicle import Vehicle
from vehicle.thrusters import AXES, allocation, commands_of_wrench, table_of

HARD_OVER, SHARE_OF_HARD_OVER = radians(35.0), 0.5
"""A rudder hard over, and the share of the largest moment that it stands for. [rad, 1]"""


class Helm(Protocol):
    """The command of a vehicle for a rudder and stern-planes."""

    @property
    def straight(self) -> tuple[float, ...]:
        """Command of the straight run."""

    def command(
        self, *, rudder: float | None = None, planes: float = 0.0, propulsion: float = 1.0
    ) -> tuple[float, ...]:
        """Return the command with a rudder [rad], both stern-planes moved [rad], the propulsion times a factor."""


@dataclass(frozen=True)
class FinHelm:
    """Propeller, rudder and stern-planes, as they are."""

    straight: tuple[float, ...]

    def command(
        self, *, rudder: float | None = None, planes: float = 0.0, propulsion: float = 1.0
    ) -> tuple[float, ...]:
        """Return the straight command with some of it changed."""
        n, own, port, starboard, *listed = self.straight
        return propulsion * n, own if rudder is None else rudder, port + planes, starboard + planes, *listed


@dataclass(frozen=True)
class ThrusterHelm:
    """Moments of thrusters in place of fins.

    Attributes:
        straight: command of the straight run.
        hull: whose thrusters.
        wrench: of the thrusters in the straight run, at rest. [N, N m]
    """

    straight: tuple[float, ...]
    hull: Vehicle
    wrench: np.ndarray

    @classmethod
    def of(cls, hull: Vehicle, steady: Trim) -> ThrusterHelm:
        """Return the helm of a vehicle in a steady motion."""
        total = np.zeros(6)
        for thruster, share in zip(hull.thruster_list, steady.state[CHANNELS], strict=False):
            total += thruster.thrust_at(float(share)) * thruster.wrench
        return cls(tuple(steady.command.tolist()), hull, total)

    def moment(self, axis: str, angle: float) -> float:
        """Return the moment about an axis that stands for a fin's angle [rad]. [N m]"""
        most = sum(
            min(each.thrust_ahead, each.thrust_astern) * abs(each.wrench[AXES.index(axis)])
            for each in working(self.hull)
        )
        return float(SHARE_OF_HARD_OVER * most * angle / HARD_OVER)

    def command(
        self, *, rudder: float | None = None, planes: float = 0.0, propulsion: float = 1.0
    ) -> tuple[float, ...]:
        """Return the commands of the thrusters; where one would pass its limit, all are reduced alike."""
        wrench = self.wrench.copy()
        wrench[0] *= propulsion
        wrench[5] += self.moment("yaw", rudder or 0.0)
        wrench[4] += self.moment("pitch", planes)
        held = tuple(axis for axis in AXES if axis not in (unheld(self.hull) or ()))
        thrusters, out = self.hull.thruster_list, np.zeros(len(self.straight))
        commands_of_wrench(wrench, allocation(thrusters, held), table_of(thrusters), len(thrusters), out)
        return tuple(out.tolist())

    def angles(self, axis: str, commands: np.ndarray) -> np.ndarray:
        """Return the angles (n,) of a fin that commands of the thrusters (n, thrusters) stand for [rad], 0 for those of
        the straight run.
        """
        at, full = AXES.index(axis), self.moment(axis, 1.0)
        arms = [each.wrench[at] for each in self.hull.thruster_list]
        thrusters = self.hull.thruster_list
        thrusts = [
            [each.thrust_at(share) for each, share in zip(thrusters, row, strict=True)] for row in commands
        ]
        made = np.array(thrusts) @ np.array(arms)
        off = (made - self.wrench[at]) / full
        return np.where(np.abs(off) < LITTLE, 0.0, off)


LITTLE = 1e-6
"""Rounding of commands. [rad]"""
