"""Energy and power of the hull alone, so that every joule of the propeller can be found again.

    d/dt (½ ν_rᵀ M ν_r + V) = P_propeller + P_loss + P_external        (P_restoring = −dV/dt)

reckoned in the frame that moves with the steady, uniform current: there all terms are those of still water
and "turning_current" is absent. P is the wrench of a term times ν_r. The kinetic energy holds that of the
added mass. V is the potential of weight and buoyancy; in a vertical current its depth is that relative to the
water, so use P_restoring, not V, there.
"""

from __future__ import annotations

from subzero.jit import compiled, scratch
from vehicle.dynamics import evaluate, relative_velocity
from vehicle.kinematics import rotation
from vehicle.restoring import potential
from vehicle.terms import POWER_OF_TERM, TERM_COUNT

POWERS = ("propeller", "loss", "restoring", "external")
"""What `power` fills: thrust and reaction torque; fins, lift and drag; weight and buoyancy; from outside."""


@compiled
def power(state, command, current_n, wrench_b, numbers, out):
    """Fill out (len(POWERS),) with the powers on the hull relative to the water [W].

    Args:
        state: as for `derivative`.
        command: as for `derivative`.
        current_n: as for `derivative`.
        wrench_b: as for `derivative`.
        numbers: as for `derivative`.
        out: the powers; losses are negative, whatever the motion.
    """
    R, nu_r, terms = scratch(3, 3), scratch(1, 6)[0], scratch(TERM_COUNT, 6)
    evaluate(state, command, current_n, wrench_b, numbers, R, nu_r, terms)
    for i in range(len(POWERS)):
        out[i] = 0.0
    for i in range(TERM_COUNT):
        which = POWER_OF_TERM[i]
        if which >= 0:
            for j in range(6):
                out[which] += terms[i, j] * nu_r[j]


@compiled
def kinetic_energy(state, current_n, numbers):
    """Return ½ ν_rᵀ M ν_r, hull and added mass together [J]."""
    R, nu_r = scratch(3, 3), scratch(1, 6)[0]
    rotation(state[3:7], R)
    relative_velocity(state, R, current_n, nu_r)
    total = 0.0
    for i in range(6):
        for j in range(6):
            total += nu_r[i] * numbers.mass_matrix[i, j] * nu_r[j]
    return 0.5 * total


@compiled
def potential_energy(state, numbers):
    """Return the potential energy of weight and buoyancy [J]."""
    R = scratch(3, 3)
    rotation(state[3:7], R)
    return potential(state[2], R, numbers.restoring)
