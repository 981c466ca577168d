"""A cable stepped by hand (`moving_end.time_step`): for cases whose start, ends or forces no public call offers.

The start is any shape: node positions, a tension for each segment, everything at rest or moving as given. Then the tow
point is put anywhere, step by step, and the far end is a drum, a winch or free.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cable import Brake, CableProperties, Current
from cable.current import Water
from cable.drum import DrumNumbers
from cable.moving_end.initial_shape import start_in_water
from cable.moving_end.remeshing import accept
from cable.moving_end.segment_load import Load, new_load
from cable.moving_end.state import NOW, Line, new_line
from cable.moving_end.time_step import try_step

STILL = Current.uniform((0.0, 0.0, 0.0))


@dataclass
class Stepped:
    """A cable under way.

    Attributes:
        line: its state.
        cable: what it is made of.
        drum: what holds its far end.
        water: how the water moves.
        work: work space.
    """

    line: Line
    cable: CableProperties
    drum: DrumNumbers
    water: Water
    work: Load

    @classmethod
    def at_rest(
        cls,
        position: np.ndarray,
        length: np.ndarray,
        tension: np.ndarray,
        cable: CableProperties,
        *,
        room: int = 0,
        free_end: bool = False,
        current: Current = STILL,
    ) -> Stepped:
        """Return a cable at rest with nodes at `position` (n+1, 3), and n segments of `length` [m] and `tension` [N].

        The last node is the drum's (a brake, until `drum` is changed) or, with `free_end`, a free tail.
        """
        n, brake = length.size, Brake().numbers()
        line, brake.setpoint = new_line(n + room), length.sum()
        line.position[:, : n + 1] = position
        line.length[1 : n + 1] = length
        line.tension[:, 1 : n + 1] = tension
        line.ends.count, line.ends.layout.free_end = n, free_end
        line.ends.last_length[:], line.ends.settled = length[-1], length[:-1].sum()
        line.ends.layout.segment_length = length[0]
        made = cls(line, cable, brake, current.numbers(), new_load())
        made.begin()
        return made

    def begin(self) -> None:
        """Take the velocities that stand there as those of the start."""
        self.line.ends.previous_step = 0.0
        start_in_water(self.line, self.water, self.cable.numbers(), self.work)

    def step(self, step: float, tow: np.ndarray) -> None:
        """Go on by one step [s], with the tow point at `tow` (3,) [m] at its end."""
        c = self.cable.numbers()
        converged = try_step(self.line, step, tow, self.water, c, self.drum, self.work)
        solved = self.line.ends.solved
        if not converged:
            message = f"Not solved: {solved.residual:.1e} tolerances at node {solved.worst_node}."
            raise RuntimeError(message)
        accept(self.line, step, c, self.work)

    def settle(self, seconds: float = 1e4, steps: int = 6) -> None:
        """Come to rest where the forces balance, in steps so long that inertia has no part; then forget the past."""
        tow = self.line.position[NOW, 0].copy()
        for _ in range(steps):
            self.step(seconds, tow)
        self.line.velocity[:] = 0.0
        self.line.ends.payout[:] = 0.0
        self.line.position[:] = self.line.position[NOW]
        self.line.ends.last_length[:] = self.line.ends.last_length[NOW]
        self.begin()

    @property
    def positions(self) -> np.ndarray:
        """Node positions now (nodes, 3). [m]."""
        return self.line.position[NOW, : self.line.ends.count + 1].copy()

    @property
    def tensions(self) -> np.ndarray:
        """Tensions at the nodes now (nodes,). [N]."""
        return self.line.node_tension[: self.line.ends.count + 1].copy()

    def nodes(self, length: float) -> np.ndarray:
        """Return how far the nodes are from the drum along the cable (nodes,), when its length is `length`. [m]."""
        settled = np.cumsum(self.line.length[1 : self.line.ends.count])
        return np.concatenate([[length], length - settled, [0.0]])
