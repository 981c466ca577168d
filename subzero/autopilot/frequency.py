"""How far a loop is from instability: gain and phase margin, read off its frequency response."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import control


@dataclass(frozen=True, kw_only=True)
class Margins:
    """How far a loop is from instability, opened at the plant's input.

    Attributes:
        gain: factor that the gain may grow by; infinite where none is too much.
        gain_down: factor that it may shrink to; 0 where none is too little.
        phase: lag that may be added. [rad]
        delay: delay that may be added. [s]
        crossover: frequency of gain 1. [rad/s]
    """

    gain: float
    gain_down: float
    phase: float
    delay: float
    crossover: float


def margins(loop: control.StateSpace, *, delay: float = 0.0) -> Margins:
    """Return gain and phase margin of a loop, from its frequency response at 4000 frequencies.

    Args:
        loop: L, from the command to minus the command, such as `Gains.loop`; continuous or sampled.
        delay: beside it, of computing and sensors. [s]
    """
    sampled = loop.dt not in (None, 0)
    w = np.geomspace(1e-3, np.pi / loop.dt if sampled else 1e3, 4000)
    L = np.squeeze(np.asarray(loop(np.exp(1j * w * loop.dt) if sampled else 1j * w))) * np.exp(
        -1j * w * delay
    )
    size, phase = np.abs(L), np.unwrap(np.angle(L))
    crossing = np.flatnonzero((size[:-1] >= 1.0) & (size[1:] < 1.0))
    real = np.flatnonzero((np.imag(L[:-1]) * np.imag(L[1:]) <= 0.0) & (np.real(L[:-1]) < 0.0))
    factors = 1.0 / size[real]
    up, down = factors[factors > 1.0], factors[factors < 1.0]
    last = int(crossing[-1]) if crossing.size else 0
    left = float((phase[last] + np.pi) % (2.0 * np.pi)) if crossing.size else np.inf
    return Margins(
        gain=float(up.min()) if up.size else np.inf,
        gain_down=float(down.max()) if down.size else 0.0,
        phase=left,
        delay=left / float(w[last]),
        crossover=float(w[last]) if crossing.size else 0.0,
    )
