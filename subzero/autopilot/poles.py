"""The poles of a linear model, in words: how fast, how damped, in seconds and in the vehicle's own time L/U."""

from __future__ import annotations

from math import inf, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from subzero.autopilot.steady import Trim

if TYPE_CHECKING:
    import control


class Mode(NamedTuple):
    """One pole, or a pair.

    Attributes:
        pole: λ; of a pair the one above the real axis. [1/s]
        scaled: λ L/U; −1 decays to 37 % while the hull moves on by its own length.
        time_constant: −1/Re λ, infinite for an integrator, negative for what grows. [s]
        damping: ζ = −Re λ/|λ|; 1 for a real pole that decays, −1 for one that grows, 0 for an integrator.
        period: of the oscillation, infinite without one. [s]
    """

    pole: complex
    scaled: complex
    time_constant: float
    damping: float
    period: float


INTEGRATOR = 1e-6
"""A pole nearer to zero than this times U/L is an integrator: differences do not know it better."""


def modes(system: control.StateSpace, steady: Trim) -> list[Mode]:
    """Return the modes of a continuous linear model, slowest first.

    Args:
        system: from `linearise` or `subsystem`.
        steady: the motion it belongs to, for L/U.
    """
    scale = steady.time_scale
    poles = [complex(pole) for pole in np.linalg.eigvals(np.asarray(system.A))]
    kept = [pole for pole in poles if pole.imag >= -1e-12 * abs(pole)]
    return [_mode(pole, scale) for pole in sorted(kept, key=abs)]


def _mode(pole: complex, scale: float) -> Mode:
    """Describe a pole."""
    if abs(pole) * scale < INTEGRATOR:
        return Mode(pole, pole * scale, inf, 0.0, inf)
    time_constant = -1.0 / pole.real if pole.real else inf
    period = 2.0 * pi / abs(pole.imag) if pole.imag else inf
    return Mode(pole, pole * scale, time_constant, -pole.real / abs(pole), period)
