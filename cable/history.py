"""What a cable did, over time or at rest: tensions, forces, lengths and shapes, with units and how the solving went."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import nan

import numpy as np

from cable.current import Current
from cable.properties import CableProperties
from subzero.errors import BadValueError, real, short


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a run ended, in words.

    Attributes:
        completed: the run reached its end.
        message: what happened, when and where, and what to try; one sentence when all went well.
        iterations: Newton iterations in all.
        worst_residual: residual left in the last step, as a multiple of its tolerance.
        steps: how many steps were taken, with those that were made smaller than the time between two results.
        largest_courant_number: √(T/m1) Δt/Δs, how many segments a transverse wave crosses in a step, at most.
        energy_residual: what is missing in the balance of `moving_end.energy`, as a share of the work and the loss in
            all.
    """

    completed: bool
    message: str
    iterations: int
    worst_residual: float
    steps: int = 0
    largest_courant_number: float = nan
    energy_residual: float = nan


@dataclass(frozen=True, kw_only=True)
class History:
    """The record of a cable run.

    Attributes:
        time: (n,). [s]
        tow_force: force of the cable on the vehicle, earth axes north, east, down (n, 3). [N]
        tow_tension: tension at the tow point T(0) (n,). [N]
        drum_tension: tension at the drum T(S) (n,). [N]
        length: length of the cable in the water S (n,). [m]
        tow_point: position of the tow point relative to the drum (n, 3). [m]
        shapes: node positions relative to the drum, tow point first, one array (nodes, 3) per time. [m]
        tensions: tensions at the nodes, one array (nodes,) per time. [N]
        outcome: how the run ended; a stopped run keeps what it has.
        scheme: the scheme that was used.
        tow_impulse: impulse of the cable on the vehicle just after each time, where the tow point changes its
            velocity at once (n, 3), zero elsewhere; the tow forces do not show it (`moving_end.jolt`). Empty for other
            schemes. [N s]
    """

    time: np.ndarray
    tow_force: np.ndarray
    tow_tension: np.ndarray
    drum_tension: np.ndarray
    length: np.ndarray
    tow_point: np.ndarray
    shapes: tuple[np.ndarray, ...]
    tensions: tuple[np.ndarray, ...]
    outcome: Outcome
    scheme: str
    tow_impulse: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    def shape(self, t: float) -> np.ndarray:
        """Return the node positions (nodes, 3) relative to the drum at the recorded time nearest to t. [m].

        Raises:
            subzero.UserError: t lies outside the run.
        """
        return self.shapes[self._row(t)]

    def tension(self, t: float) -> np.ndarray:
        """Return the tensions at the nodes (nodes,) at the recorded time nearest to t. [N].

        Raises:
            subzero.UserError: t lies outside the run.
        """
        return self.tensions[self._row(t)]

    @property
    def closure_error(self) -> np.ndarray:
        """Distance between the tow point and the end of the cable summed up from the drum (n,). [m]."""
        return np.array(
            [np.linalg.norm(shape[0] - x) for shape, x in zip(self.shapes, self.tow_point, strict=True)]
        )

    def diagnostics(self) -> Mapping[str, float]:
        """Return the numbers that tell how far to trust the run, by name."""
        return {
            "closure_error_m": float(self.closure_error.max()),
            "smallest_tension_N": float(min(tension.min() for tension in self.tensions)),
            "newton_iterations": float(self.outcome.iterations),
            "worst_residual": self.outcome.worst_residual,
            "steps": float(self.outcome.steps),
            "largest_courant_number": self.outcome.largest_courant_number,
            "energy_residual": self.outcome.energy_residual,
        }

    def _row(self, t: float) -> int:
        """Return the row whose time is nearest to t."""
        first, last = self.time[0], self.time[-1]
        time = real(t)
        if time is None or not first - 1e-9 <= time <= last + 1e-9:
            message = f"There is no shape at t = {short(t)} s: the run covers {first:g} to {last:g} s."
            raise BadValueError(message)
        return int(np.abs(self.time - t).argmin())


@dataclass(frozen=True, kw_only=True)
class Equilibrium:
    """A cable at rest between two ends.

    Attributes:
        cable: what it is made of.
        current: how the water moves.
        length: unstretched. [m]
        shape: node positions from the first end to the second, in the axes of `ends` (nodes, 3). [m]
        tensions: at the nodes (nodes,). [N]
        tow_force: force of the cable on the first end, north, east, down (3,). [N]
        drum_force: force of the cable on the second end (3,). [N]
        segment_lengths: unstretched (nodes − 1,). [m]
        segment_tensions: in the segments (nodes − 1,). [N]
        steps: how many steps the search took; 2 or 3 where Newton's method came through at once.
    """

    cable: CableProperties
    current: Current
    length: float
    shape: np.ndarray
    tensions: np.ndarray
    tow_force: np.ndarray
    drum_force: np.ndarray
    segment_lengths: np.ndarray
    segment_tensions: np.ndarray
    steps: int

    @property
    def slack_length(self) -> float:
        """How much of the cable is folded up without tension: its shape there means nothing. [m]."""
        chords = np.linalg.norm(np.diff(self.shape, axis=0), axis=1)
        stretched = self.segment_lengths * (1.0 + self.cable.compliance * self.segment_tensions)
        return float(self.segment_lengths[chords < (1.0 - 1e-6) * stretched].sum())
