"""The drum: its properties and its three states: it turns with the cable, is held, or overruns the cable.

    turning    T(S) R_d = I_d dΩ/dt + C_f      (11); the cable is taut at the drum
    standing   dS/dt = 0                        it is held; cable is never taken up
    spinning   0 = I_d dΩ/dt + C_f, T(S) = 0    the drum overruns: by its inertia it gives more cable than is pulled

The extra cable lies loose in front of the drum, outside the water, and does not resist any pull; when it is used up,
the cable takes the drum along again with a jerk. Beyond the drum the cable is taut, as with a drum without inertia:
an overrun in the water, of a whole segment, would take its drag from the tow force, and a fit from jump to jump.

Coulomb friction is rounded off at rest: C_f U/√(U² + U_c²) with the pay-out rate U and U_c = 1 mm/s (`CREEP`). A drum
that friction holds therefore creeps by less than that, and a taut cable always has a solution. A drum that has come
to rest remains at rest until the pull exceeds the friction at U_c: where a slack cable moves slowly, an equation that
is so steep at rest, and flat at any speed, often has no solution that Newton's method finds.

A winch instead of the free drum either follows a prescribed length S(t) (a brake: a constant one), or keeps the tension
T(S) at a prescribed value, paying out and reeling in as needed.

Departs from source: the paper writes (11) for a drum that always turns with a taut cable. A frictionless drum without
inertia turns whenever it is pulled, and cannot overrun.

Symbols are those of Feng & Allen (2004), section 2.2; defaults are their section 4. The moment of inertia I_d is not
printed there: 0 makes the tension at a frictionless drum exactly zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, sqrt

import numpy as np

from subzero.errors import BadValueError, checked
from subzero.jit import Record, inner

TURNING, STANDING, SPINNING = 0, 1, 2

FREE, LENGTH, TENSION = 0, 1, 2
"""Who decides on the pay-out (`DrumNumbers.control`): the cable, a winch for the length, or a winch for T(S)."""

CREEP = 1e-3
"""Pay-out rate at which friction has come to 0.7 of its full size. [m/s]"""
TINY_SPEED = 1e-12
"""Friction is taken at this speed at least. [m/s]"""
MOST_COASTING = 60
"""Most iterations for the speed of a coasting drum."""
HELD = 1e-12
"""A tension or pay-out rate below this counts as zero. [N], [m/s]"""


class DrumNumbers(Record):
    """The drum as compiled code sees it, at the cable.

    Attributes:
        inertia: I_d/R_d². [kg]
        friction: C_f/R_d. [N]
        control: the quantity that determines the pay-out, `FREE`, `LENGTH` or `TENSION`.
        setpoint: commanded value at the new time: length [m] or tension [N]; without meaning for a free drum.
        place, velocity: of the drum at the new time, relative to its place at the start (3,). [m], [m/s]
    """

    inertia: float = 0.0
    friction: float = 0.0
    control: int = FREE
    setpoint: float = 0.0
    place: np.ndarray = np.zeros(3)
    velocity: np.ndarray = np.zeros(3)


@dataclass(frozen=True, kw_only=True)
class DrumProperties:
    """The drum on the shore that the cable is pulled off, equation (11).

    Attributes:
        radius: R_d. [m]
        inertia: I_d; acts like an extra towed mass I_d/R_d². [kg m²]
        friction_torque: C_f, Coulomb friction between drum and pivot, while it turns; when the drum stands it
            holds the cable up to the tension C_f/R_d. [N m]

    Raises:
        subzero.UserError: a value that is not a finite number, or not in its physical range (a ValueError, too).
    """

    radius: float = 0.1
    inertia: float = 0.0
    friction_torque: float = 0.0

    def __post_init__(self) -> None:
        """Raise an error if the fields do not describe a possible drum."""
        for name in ("radius", "inertia", "friction_torque"):
            above = 0.0 if name == "radius" else None
            value = checked("DrumProperties", name, getattr(self, name), least=0.0, above=above)
            object.__setattr__(self, name, value)

    def numbers(self) -> DrumNumbers:
        """Return the plain numbers that compiled code takes."""
        inertia, friction = self.inertia / self.radius / self.radius, self.friction_torque / self.radius
        if not isfinite(inertia + friction):
            raise BadValueError(
                f"DrumProperties: radius is {self.radius:g}; so small that inertia and friction are not finite."
            )
        return DrumNumbers(inertia=inertia, friction=friction)


@inner
def next_mode(mode: int, converged: bool, payout: float, loose: float, pull: float, drum: DrumNumbers) -> int:
    """Return what the drum does, given the answer found by supposing that it does `mode`; the same if consistent.

    A drum that stands while a taut cable must get longer leaves no solution at all (`converged` is false); nor does a
    frictionless drum that turns while a current drags slack cable past the vehicle: nothing bounds its speed, the
    problem is ill-posed, and the drum is taken to stand.

    Args:
        mode: the assumed state.
        converged: whether a solution was found with it.
        payout: rate at which the water takes cable in that solution. [m/s]
        loose: length that lies loose before the drum then. [m]
        pull: T(S) of that solution. [N]
        drum: the drum.
    """
    if mode == STANDING:
        holds = 0.0 if loose > 0.0 else friction(drum, CREEP)[0]
        if converged and pull <= max(HELD, holds):
            return STANDING
        return SPINNING if loose > 0.0 else TURNING
    if converged and payout < 0.0:
        return STANDING
    if mode == SPINNING:
        return TURNING if not converged or loose < 0.0 else SPINNING
    if not converged:
        return STANDING
    return SPINNING if drum.inertia > 0.0 and pull < -HELD else TURNING


@inner
def coasting(drum: DrumNumbers, alpha: float, past: float) -> float:
    """Return the speed U of a drum that nothing pulls, I_d/R_d² (α U + `past`) + friction(U) = 0; never backwards.

    Friction bends one way only, so that Newton's method from rest never goes too far.
    """
    if drum.inertia <= 0.0 or past >= 0.0:
        return 0.0
    U = 0.0
    for _ in range(MOST_COASTING):
        held, slope = friction(drum, max(U, TINY_SPEED))
        step = -(drum.inertia * (alpha * U + past) + held) / (drum.inertia * alpha + slope)
        U += step
        if step < 1e-12:
            break
    return max(U, 0.0)


@inner
def friction(drum: DrumNumbers, payout: float) -> tuple[float, float]:
    """Return the friction of the drum as a tension [N] and its slope by the pay-out rate [N s/m]; never a push."""
    if payout <= 0.0:
        return 0.0, 0.0
    size = sqrt(payout * payout + CREEP * CREEP)
    return drum.friction * payout / size, drum.friction * (CREEP / size) ** 2 / size
