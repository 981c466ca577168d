"""Where the energy of a moving cable goes, per unit time.

Relative to the water, U = V − J, the balance of `segment_load` times U gives

    −F·U(0) = dE/dt + L − G + D_S + M + C + B

with F the force on the vehicle, E = ∫(½mU² + ½ρA U_⊥² + ½eT²) ds (and bending) the energy in the water, L = ∫D·U ds the
loss to drag (and to internal damping; then ε⁺/e, the pull of the stretch alone, takes the place of T in E),
G = ∫w_c U_k ds the work of gravity, and

    D_S = −F_S·U(S) − (dS/dt) e(S)       work on the drum, F_S = T_N t_N + ½Q_N, less the energy that enters with new
                                         cable; at a free end, the loss of the drogue
    B   = −Σ F_B·U                       what the sea bed takes: it is pressed in, damps, and rubs
    M   = −ρA ∫ U_t U_⊥·(∂t/∂t) ds       (the paper's added mass is no gradient of an energy when the cable turns)
    C   = ∫ m U·dJ/dt ds − ∫ T t·∂J/∂s ds    what a current that changes along the cable's way does; 0 in a uniform one,
                                         and what a surface takes with the water that is wetted (`moving_end.surface`)

M is the vector form of −(m1 − m)∫V_t V_n β̇ ds. It follows from U·∂(P U)/∂t = ∂(½U_⊥²)/∂t − U_t U_⊥·∂t/∂t, because
U_⊥ has no component along t; and ∂t/∂t = ∂V/∂s across.
"""

from __future__ import annotations

import numpy as np

from cable.moving_end.bending import bending_energy, clamp_energy
from cable.moving_end.composition import body_flow
from cable.moving_end.contact import power_to_bed
from cable.moving_end.segment_load import Load, evaluate_load, mass_along, measured_chord, take_segment
from cable.moving_end.slack_law import KNOWN
from cable.moving_end.state import BEFORE, NOW, Line, select_section
from cable.moving_end.surface import surface_energy, wetted_power
from cable.properties import CableNumbers
from subzero.jit import compiled, inlined, inner

LOSS, STORED, GRAVITY_WORK, AT_DRUM, ADDED_MASS, STRAINED, CARRIED, TOWED, DAMPED, TO_BED = range(10)
"""Entries that `energy_flow` fills: L to drag, E [J], G, D_S, M, −∫T t·∂J/∂s ds, ∫m U·dJ/dt ds (mean over a step),
−F·U(0), L to internal damping, B. [W]"""
FLOWS = 10


@inner
def energy_flow(line: Line, c: CableNumbers, work: Load, out: np.ndarray) -> None:
    """Fill out (FLOWS,) with the powers and the stored energy of the cable at level NOW."""
    N, t, across, V, J = line.ends.count, work.tangent, work.across, work.velocity, work.water
    loss, energy, sunk, added, strained, carried, damped = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(1, N + 1):
        length = line.ends.last_length[NOW] if j == N else line.length[j]
        T = line.tension[NOW, j]
        select_section(line, c, j)
        take_segment(line.position[NOW], line.velocity[NOW], line.water[NOW], j, work)
        work.square, work.chord_length, work.shorter = measured_chord(line.position[NOW], j, length)
        evaluate_load(T, line.slip[j], line.normal_gain[j], 0.0, c, work)
        square, turn = 0.0, 0.0
        for i in range(3):
            # Energies are those relative to the water: a cable that drifts with a uniform current has none.
            speed = V[i] - J[i]
            square += speed * speed
            loss += length * work.drag[i] * speed
            turn += across[i] * (line.velocity[NOW, j, i] - line.velocity[NOW, j - 1, i])
            strained -= T * t[i] * (line.water[NOW, j, i] - line.water[NOW, j - 1, i])
        elastic = T
        if c.retardation > 0.0:
            elastic = max(np.sqrt(work.square) - 1.0, 0.0) / c.compliance
            damped += length * _damping_power(line, j, T, elastic, c)
        stored = c.mass * square + c.added_mass * work.side * work.side + c.compliance * elastic * elastic
        energy += 0.5 * length * stored
        sunk += length * c.weight * (V[2] - J[2])
        added -= c.added_mass * work.along * turn * length / work.chord_length
        carried += length * (c.mass - mass_along(line, c)) * _carried(line, j)
    lost, held, fallen = body_flow(line, c)
    out[LOSS], out[STORED], out[GRAVITY_WORK] = loss + lost, energy + held, sunk + fallen
    out[ADDED_MASS], out[STRAINED], out[CARRIED] = added, strained, carried + wetted_power(line, c)
    out[AT_DRUM], out[TOWED], out[DAMPED], out[TO_BED] = 0.0, 0.0, damped, power_to_bed(line, c)
    out[STORED] += bending_energy(line, c) + clamp_energy(line, c) + surface_energy(line, c)
    _flow_at_ends(line, c, out)


@inlined
def _damping_power(line: Line, j: int, T: float, elastic: float, c: CableNumbers) -> float:
    """Return the loss (T − ε⁺/e) dε⁺/dt per length of segment j, whose stretch alone pulls with `elastic`. [N/s]."""
    if T > KNOWN:
        return (T - elastic) * (T - elastic) * c.compliance / c.retardation
    # A segment that does not pull although it is stretched goes back on its own; its rate is that of the last step.
    if elastic == 0.0 or line.ends.previous_step <= 0.0 or line.ends.last_length[BEFORE] <= 0.0:
        return 0.0
    length = line.ends.last_length[BEFORE] if j == line.ends.count else line.length[j]
    square, _, _ = measured_chord(line.position[BEFORE], j, length)
    change = elastic * c.compliance - max(np.sqrt(square) - 1.0, 0.0)
    return -elastic * change / line.ends.previous_step


@inlined
def _carried(line: Line, j: int) -> float:
    """Return U·dJ/dt in the middle of segment j, over the last step. [m²/s³]."""
    if line.ends.previous_step <= 0.0:
        return 0.0
    power, V, J = 0.0, line.velocity, line.water
    # Means over the step, as the change of the water is known between its two levels only.
    for i in range(3):
        change = J[NOW, j - 1, i] + J[NOW, j, i] - J[BEFORE, j - 1, i] - J[BEFORE, j, i]
        now = V[NOW, j - 1, i] + V[NOW, j, i] - J[NOW, j - 1, i] - J[NOW, j, i]
        before = V[BEFORE, j - 1, i] + V[BEFORE, j, i] - J[BEFORE, j - 1, i] - J[BEFORE, j, i]
        power += 0.125 * (now + before) * change
    return power / line.ends.previous_step


@compiled
def _flow_at_ends(line: Line, c: CableNumbers, out: np.ndarray) -> None:
    """Fill −F·U(0) and D_S."""
    T, N = max(line.ends.drum_pull, 0.0), line.ends.count
    along, square, size = 0.0, 0.0, 0.0
    for i in range(3):
        d = line.position[NOW, N, i] - line.position[NOW, N - 1, i]
        U = line.velocity[NOW, N, i] - line.water[NOW, N, i]
        along += d * U
        size += d * d
        square += U * U
        out[TOWED] -= line.ends.tow.force[i] * (line.velocity[NOW, 0, i] - line.water[NOW, 0, i])
    # At a free tail the pull of the drogue, times its speed through the water, is lost.
    if line.ends.layout.free_end:
        out[AT_DRUM] = T * np.sqrt(square)
        return
    along /= np.sqrt(max(size, 1e-30))
    # Cable enters with kinetic and strain energy relative to the water.
    entering = 0.5 * (c.mass * square + c.added_mass * (square - along * along) + c.compliance * T * T)
    out[AT_DRUM] = -line.ends.payout[NOW] * entering
    for i in range(3):
        out[AT_DRUM] -= line.ends.drum_force[i] * (line.velocity[NOW, N, i] - line.water[NOW, N, i])


@inlined
def damping_loss(old: np.ndarray, new: np.ndarray, step: float) -> float:
    """Return the loss to internal damping in a step [s], of the flows at its ends. [J].

    By the trapezoidal rule, but for the step in which a slack cable comes taut: a dashpot pulls fully at once.
    """
    return 0.5 * step * (old[DAMPED] + new[DAMPED]) if old[DAMPED] > 0.0 else step * new[DAMPED]


@inner
def book_step(line: Line, step: float, c: CableNumbers, work: Load, ledger: np.ndarray) -> None:
    """Add an accepted step to a ledger (3, FLOWS): flows before, flows now, and the sums of work, terms and residual.

    The third row holds the work of the tow point, the sum of the sizes of all terms, and the residual of the balance
    at TOWED, LOSS and STORED. [J]
    """
    for i in range(FLOWS):
        ledger[0, i] = ledger[1, i]
    energy_flow(line, c, work, ledger[1])
    # The trapezoidal rule for powers, of second order like the steps.
    old, new, total, half = ledger[0], ledger[1], ledger[2], 0.5 * step
    stored = new[STORED] - old[STORED]
    spent = half * (old[LOSS] + new[LOSS]) + half * (old[AT_DRUM] + new[AT_DRUM])
    spent += half * (old[ADDED_MASS] + new[ADDED_MASS] + old[STRAINED] + new[STRAINED])
    spent += step * new[CARRIED] - half * (old[GRAVITY_WORK] + new[GRAVITY_WORK])
    damped = damping_loss(old, new, step)
    spent += damped + half * (old[TO_BED] + new[TO_BED])
    towed = half * (old[TOWED] + new[TOWED])
    total[TOWED] += towed
    total[LOSS] += abs(towed) + half * (old[LOSS] + new[LOSS]) + damped
    total[STORED] += towed - stored - spent
