"""Where a cable comes to rest between two places: the equations of `assembly` without any motion.

Three methods, each the start of the next:

1. With given loads (weight, and drag as it was) the force in segment j is f_j = F + c_j, F the force at the first
   end and c_j the loads up to there. An unstretchable or elastic chain then minimises its complementary energy, a
   convex function of three numbers,

       Φ(F) = Σ ℓ_j (√(|f_j|² + ε²) + ½e |f_j|²) − F·(x_N − x_0),   ∂Φ/∂F = 0: the chain closes

   so Newton's method with a line search always ends, from anywhere; ε → 0 rounds off a segment without tension. The
   drag is taken again for the new shape, a few times.
2. Newton's method on all nodes and tensions (`time_step.solve_step`, every weight of time zero): drag, stretch, bending
   and slack law as in a run. Water and arc corrections are taken again until nothing moves.
3. Where that fails, steps of time from rest, backward and implicit, each forgetting its motion: with m1 and a step h a
   way downhill that cannot miss when h is short, and becomes 2. when h has grown (pseudo-transient continuation; Kelley
   & Keyes, SIAM J. Numer. Anal. 35, 1998).
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from cable.current import Water
from cable.drum import DrumNumbers
from cable.moving_end.bdf2 import Weights
from cable.moving_end.chord_correction import correct_for_arc
from cable.moving_end.composition import carried_weight
from cable.moving_end.remeshing import fill_node_tensions
from cable.moving_end.segment_load import Load, evaluate_load, measured_chord, segment_momentum, take_segment
from cable.moving_end.state import BEFORE, NEW, NOW, Line, length_at, sample_water, select_section
from cable.moving_end.time_step import solve_softened, solve_step
from cable.properties import CableNumbers
from cable.schemes import TOLERANCE
from subzero.jit import allocating, compiled, inner

DRAG_ROUNDS = 12
"""How often the convex problem takes the drag of its new shape."""
NEWTON_ROUNDS = 60
"""Iterations of the convex problem at one ε, at most."""
ROUNDINGS = 5
"""ε falls to this power of a tenth of all loads."""
STILL = 1e-11
"""A cable at rest has moved by no more than this share of its length since water and arcs were last looked at."""
WAVERS = 0.9
"""A step that moves the cable by more than this share of the motion of the step before oscillates: try a shorter
one."""
LOOSER = 1e-7
"""Where a cable is so taut that rounding does not let it be solved to `schemes.TOLERANCE`, this will do."""
LOOKS = 400
"""So many steps of continuation, at most."""
FIRST, LONGEST, SHORTEST = 0.1, 1e4, 1e-7
"""The first, longest and shortest step of continuation; beyond the longest inertia is left out. [s]"""


@allocating
def hang(line: Line, water: Water, c: CableNumbers, work: Load) -> float:
    """Lay the line as a chain under loads that do not turn with it, and compute the drag again a few times.

    Args:
        line: with the places of its first and last node, and the lengths of its segments.
        water: how the water moves; at rest, it is that of the line's time.
        c: cable.
        work: work space.

    Returns:
        the largest tension. [N]
    """
    N, F, whole, largest = line.ends.count, np.zeros(3), 0.0, 0.0
    # A straight line between the ends is the first shape; its water gives the first drag.
    for j in range(N + 1):
        share = j / N
        for i in range(3):
            x = line.position[NOW]
            line.position[NEW, j, i] = x[0, i] + share * (x[N, i] - x[0, i])
            line.velocity[NEW, j, i] = 0.0
    sample_water(line, water, line.ends.time)
    # The direction of the cable is not known yet: the largest drag, square to the water, is the first load.
    for j in range(1, N + 1):
        _load_across(line, j, c, work)
        whole += length_at(line, NOW, j)
    for _ in range(DRAG_ROUNDS):
        _close(line, F, c.compliance, whole)
        _lay(line, F, c.compliance)
        sample_water(line, water, line.ends.time)
        for j in range(1, N + 1):
            take_segment(line.position[NEW], line.velocity[NEW], line.water[NEW], j, work)
            work.square, work.chord_length, work.shorter = measured_chord(
                line.position[NEW], j, length_at(line, NOW, j)
            )
            select_section(line, c, j)
            evaluate_load(line.tension[NEW, j], 0.0, 1.0, 0.0, c, work)
            for i in range(3):
                # Half of the change, so that shape and drag settle instead of alternating.
                line.load[j, i] += 0.5 * (length_at(line, NOW, j) * work.q[i] - line.load[j, i])
            line.load[j, 2] -= 0.5 * carried_weight(line, c, j)
    _keep(line, c, work)
    for j in range(1, N + 1):
        largest = max(largest, line.tension[NOW, j])
    return largest


@inner
def _load_across(line: Line, j: int, c: CableNumbers, work: Load) -> None:
    """Fill the load of segment j as if it stood square to the water."""
    take_segment(line.position[NEW], line.velocity[NEW], line.water[NEW], j, work)
    select_section(line, c, j)
    J, square = work.water, 0.0
    for i in range(3):
        square += J[i] * J[i]
    for i in range(3):
        line.load[j, i] = -length_at(line, NOW, j) * c.normal_drag * sqrt(square) * J[i]
    line.load[j, 2] -= length_at(line, NOW, j) * c.weight
    line.load[j, 2] -= carried_weight(line, c, j)


@allocating
def _close(line: Line, F: np.ndarray, e: float, whole: float) -> None:
    """Find F (3,) that closes the chain: Newton's method on Φ, for ε that falls."""
    gradient, hessian, step, trial = np.zeros(3), np.zeros((3, 3)), np.zeros(3), np.zeros(3)
    load, size = np.zeros(3), 0.0
    for j in range(1, line.ends.count + 1):
        square = 0.0
        for i in range(3):
            square += line.load[j, i] ** 2
        size += sqrt(square)
    # A cable without any load would have no scale for ε.
    size = max(size, 1e-9)
    # ε → 0 is approached in stages: Newton's method converges from the minimum of the stage before.
    for level in range(ROUNDINGS):
        soft = size * 0.1 ** (1 + level)
        for _ in range(NEWTON_ROUNDS):
            value = _complementary(line, F, e, soft, load, gradient, hessian)
            # The gradient of Φ is the gap by which the chain does not close. [m]
            if _norm(gradient) < 1e-9 * whole or not _solve_three(hessian, gradient, step):
                break
            slope = step[0] * gradient[0] + step[1] * gradient[1] + step[2] * gradient[2]
            fraction = 1.0
            for _ in range(40):
                for i in range(3):
                    trial[i] = F[i] - fraction * step[i]
                # Φ is convex, so a step along Newton's direction always lowers it if it is short enough.
                if _complementary(line, trial, e, soft, load, gradient, hessian) <= (
                    value - 1e-4 * fraction * slope
                ):
                    break
                fraction *= 0.5
            F[:] = trial


@inner
def _complementary(
    line: Line,
    F: np.ndarray,
    e: float,
    soft: float,
    load: np.ndarray,
    gradient: np.ndarray,
    hessian: np.ndarray,
) -> float:
    """Return Φ(F), and fill its gradient (3,) [m] and Hessian (3, 3) [m/N]; `load` (3,) is work space."""
    value, x, N = 0.0, line.position[NOW], line.ends.count
    for i in range(3):
        gradient[i] = x[0, i] - x[N, i]
        value += F[i] * gradient[i]
        load[i] = F[i]
        for k in range(3):
            hessian[i, k] = 0.0
    for j in range(1, N + 1):
        square, length = 0.0, length_at(line, NOW, j)
        for i in range(3):
            load[i] += 0.5 * line.load[j, i]
            square += load[i] * load[i]
        size = sqrt(square + soft * soft)
        value += length * (size + 0.5 * e * square)
        for i in range(3):
            gradient[i] += length * load[i] * (1.0 / size + e)
            hessian[i, i] += length * (1.0 / size + e)
            for k in range(3):
                hessian[i, k] -= length * load[i] * load[k] / (size * size * size)
        for i in range(3):
            load[i] += 0.5 * line.load[j, i]
    return value


@inner
def _norm(x: np.ndarray) -> float:
    """Return |x| of a vector (3,)."""
    return sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])


@inner
def _solve_three(A: np.ndarray, b: np.ndarray, out: np.ndarray) -> bool:
    """Fill out (3,) with A⁻¹ b by Cramer's rule; False for a singular matrix."""
    det = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        det += A[0, i] * (A[1, j] * A[2, k] - A[1, k] * A[2, j])
    if not abs(det) > 0.0:
        return False
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        out[i] = 0.0
        for m in range(3):
            n, p = (m + 1) % 3, (m + 2) % 3
            out[i] += b[m] * (A[n, j] * A[p, k] - A[n, k] * A[p, j]) / det
    return True


# A residual gap of the last iteration is spread evenly over the nodes.


@inner
def _lay(line: Line, F: np.ndarray, e: float) -> None:
    """Fill places and tensions of level NEW from the force at the first end; the closing error is spread over the
    nodes.
    """
    N, x = line.ends.count, line.position
    for i in range(3):
        x[NEW, 0, i] = x[NOW, 0, i]
        force = F[i]
        for j in range(1, N + 1):
            force += 0.5 * line.load[j, i]
            x[NEW, j, i] = force
            force += 0.5 * line.load[j, i]
    for j in range(1, N + 1):
        T = sqrt(x[NEW, j, 0] ** 2 + x[NEW, j, 1] ** 2 + x[NEW, j, 2] ** 2)
        line.tension[NEW, j] = T
        for i in range(3):
            x[NEW, j, i] = x[NEW, j - 1, i] + length_at(line, NOW, j) * (1.0 + e * T) * x[NEW, j, i] / max(
                T, 1e-30
            )
    for i in range(3):
        open_by = x[NOW, N, i] - x[NEW, N, i]
        for j in range(1, N + 1):
            x[NEW, j, i] += open_by * j / N


@inner
def _keep(line: Line, c: CableNumbers, work: Load) -> None:
    """Make level NEW the present one, and the one before, at rest."""
    N = line.ends.count
    for j in range(N + 1):
        # All levels are the same at rest, so that the next step sees no velocity and no acceleration.
        for i in range(3):
            for level in range(3):
                line.position[level, j, i] = line.position[NEW, j, i]
                line.velocity[level, j, i] = 0.0
                line.water[level, j, i] = line.water[NEW, j, i]
        line.tension[NOW, j] = line.tension[NEW, j]
        line.tension[BEFORE, j] = line.tension[NEW, j]
    for level in range(3):
        line.ends.payout[level] = 0.0
        line.ends.last_length[level] = line.ends.last_length[NOW]
    for level in (NOW, BEFORE):
        for j in range(1, N + 1):
            segment_momentum(line, level, j, c, work)


@compiled
def relax(line: Line, water: Water, c: CableNumbers, drum: DrumNumbers, work: Load) -> int:
    """Take steps from rest, the first one without inertia, until nothing moves; return how many, or −1.

    Tensions should be of about 1 N, as those that `time_step` was made for: rest does not depend on the size of
    forces, so weight, drag and stiffness can be divided by any number, and the compliance multiplied by it.

    Args:
        line: with places and tensions at level NOW.
        water: how the water moves.
        c: cable.
        drum: a winch that holds the length.
        work: work space.
    """
    # The first step, beyond `LONGEST`, leaves inertia out.
    step, last = 10.0 * LONGEST, np.inf
    whole = line.ends.settled + line.ends.last_length[NOW]
    for k in range(LOOKS):
        solved = _step_from_rest(line, step, water, c, drum, work)
        if not solved:
            # With inertia and a shorter step, the solution is closer to the present shape.
            step = FIRST if step > LONGEST else 0.2 * step
            last = np.inf
            if step < SHORTEST:
                return -1
            continue
        moved = _moved(line)
        _keep(line, c, work)
        # Only a step without inertia proves rest: with it, a slow motion looks the same.
        if step > LONGEST and moved <= STILL * whole:
            fill_node_tensions(line)
            return k + 1
        # The cable oscillates: a shorter step follows its motion.
        if moved > WAVERS * last and moved > 1e-6 * whole:
            step = 0.3 * min(step, LONGEST)
        elif moved < 0.5 * last or step > LONGEST:
            step *= 2.0
        last = moved
    return -1


@inner
def _step_from_rest(
    line: Line, step: float, water: Water, c: CableNumbers, drum: DrumNumbers, work: Load
) -> bool:
    """Solve for level NEW a step from rest at level NOW; less exactly where rounding asks for it, and with a softened
    slack law where the sharp one fails.
    """
    # Weights of first order without a past: nothing moved before, and a steady state needs no accuracy in time.
    a = 1.0 / step if step <= LONGEST else 0.0
    w = Weights(a, -a, 0.0, a, -a, 0.0, 0.0, a)
    for tolerance in (TOLERANCE, LOOSER):
        _guess(line, water, work)
        line.ends.solver.tolerance = tolerance
        if solve_step(line, w, c, drum, work, False):
            return True
    _guess(line, water, work)
    return solve_softened(line, w, c, drum, work)


@inner
def _guess(line: Line, water: Water, work: Load) -> None:
    """Fill level NEW with the present level, and the water and the arc corrections that a step keeps fixed."""
    for j in range(line.ends.count + 1):
        line.tension[NEW, j] = line.tension[NOW, j]
        for i in range(3):
            line.position[NEW, j, i] = line.position[NOW, j, i]
    line.ends.last_length[NEW] = line.ends.last_length[NOW]
    sample_water(line, water, line.ends.time)
    for j in range(line.ends.count + 1):
        for i in range(3):
            line.water[NOW, j, i] = line.water[NEW, j, i]
    correct_for_arc(line, True, work)


@compiled
def _moved(line: Line) -> float:
    """Return how far a node has moved at most from level NOW to NEW. [m]."""
    most = 0.0
    for j in range(line.ends.count + 1):
        for i in range(3):
            most = max(most, abs(line.position[NEW, j, i] - line.position[NOW, j, i]))
    return most
