"""What the drum can do: turn with the cable, stand and hold it, or spin ahead of it.

    turning    T(S) R_d = I_d dΩ/dt + C_f      (11); the cable is taut at the drum
    standing   dS/dt = 0                        nothing pulls; cable is never taken up
    spinning   0 = I_d dΩ/dt + C_f              the drum overruns: its inertia throws cable out, slack at the drum

Coulomb friction is rounded off at rest: C_f U/√(U² + U_c²) with the pay-out rate U and U_c = 1 mm/s (`CREEP`). A drum
that friction holds therefore creeps by less than that, and a taut cable always has an answer.

A winch instead of the free drum either follows a prescribed length S(t) (a brake: a constant one), or keeps the tension
T(S) at a prescribed value, paying out and reeling in as needed.

Departs from source: the paper writes (11) for a drum that always turns with a taut cable. A frictionless drum without
inertia turns whenever it is pulled, and cannot overrun.
"""

from __future__ import annotations

from math import sqrt

from cable.properties import DrumNumbers
from subzero.jit import inner

TURNING, STANDING, SPINNING = 0, 1, 2

FREE, LENGTH, TENSION = 0, 1, 2
"""Who decides on the pay-out (`DrumNumbers.control`): the cable, a winch for the length, or a winch for T(S)."""

CREEP = 1e-3
"""Pay-out rate at which friction has come to 0.7 of its full size. [m/s]"""
HELD = 1e-12
"""A tension or pay-out rate below this is none. [N], [m/s]"""


@inner
def next_mode(mode: int, converged: bool, payout: float, pull: float, drum: DrumNumbers) -> int:
    """Return what the drum does, given the answer found by supposing that it does `mode`; the same if consistent.

    A drum that stands while a taut cable must get longer leaves no solution at all (`converged` is false); nor does a
    frictionless drum that turns while a current drags slack cable past the vehicle: nothing bounds its speed, the
    problem is ill-posed, and the drum is taken to stand.

    Args:
        mode: what was supposed.
        converged: whether a solution was found with it.
        payout: dS/dt of that solution. [m/s]
        pull: T(S) of that solution. [N]
        drum: the drum.
    """
    if mode == STANDING:
        return TURNING if not converged or pull > HELD else STANDING
    if converged and payout < 0.0:
        return STANDING
    if mode == SPINNING:
        return TURNING if not converged or pull > HELD else SPINNING
    if not converged:
        return STANDING
    return SPINNING if drum.inertia > 0.0 and pull < -HELD else TURNING


@inner
def friction(drum: DrumNumbers, payout: float) -> tuple[float, float]:
    """Return the friction of the drum as a tension [N] and its slope by the pay-out rate [N s/m]; never a push."""
    if payout <= 0.0:
        return 0.0, 0.0
    size = sqrt(payout * payout + CREEP * CREEP)
    return drum.friction * payout / size, drum.friction * (CREEP / size) ** 2 / size
