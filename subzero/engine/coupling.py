"""Hull and cable, step by step together: both must agree on force and motion at the end of every exchange.

In an exchange of length h the hull is pulled by a force that ends at F_{n+1}, with the slope of the exchange before;
the cable is solved for the place to which that takes the tow point; F_{n+1} is right when the cable answers with it:

    G(F) = F_cable(x_tow(F)) − F = 0

Newton's method solves it, with the cable's own ∂F/∂x (`cable.moving_end.time_step.impedance`) and the hull's ∂x/∂F
= (h²/2) A, A the inverse mass at the tow point, corrected by how the hull gave way in the exchanges before: mostly, two
evaluations do. An exchange that does not converge is tried again in halves.

The exchange is of second order, and stable for a cable of any weight. A loose one (the force of the step before) is not
for a cable heavier than the vehicle; nor is a force that goes linearly from F_n to F_{n+1}: a heavy cable then answers
with z² + 4z + 1 = 0, root −3.73. With the slope of the exchange before, the largest root remains below 0.73.
"""

from __future__ import annotations

import numpy as np

from cable.drum_motion import lead_drum
from cable.moving_end import accept, energy_flow, impedance, in_water, try_step
from subzero.engine.energy import book, take_jolt_of_motion
from subzero.engine.external_wrench import tow_point
from subzero.engine.run_state import Live, Now, Setup
from subzero.engine.vehicle_step import advance_hull, follow_track
from subzero.jit import compiled, inlined, inner, scratch
from vehicle import STATE_SIZE

MOST_EXCHANGES = 60
ROUNDING = 1e-14
"""Places are known to this fraction, and forces to this times the cable's stiffness. [-]"""
NOTABLE = 0.01
"""Smaller forces need agree no closer than this one does: where a slack cable floats near a drifting vehicle,
exchanges hardly make its ten thousandths of a newton agree to six digits of themselves. [N]"""
MOST_HALVINGS = 8
FASTEST = 50.0
"""Speed beyond which a run is stopped as absurd. [m/s]"""

FINE, CABLE_FAILED, DISAGREED, ABSURD = range(4)
"""How an exchange ended."""


@inner
def exchange(setup: Setup, live: Live, start: float, span: float) -> int:
    """Take one exchange from `start`, in halves where needed; the live state moves on only as far as it went well."""
    done, step = 0.0, span
    if setup.fixed.prescribed and setup.fixed.tethered:
        take_jolt_of_motion(setup, live, start)
    while True:
        last = done + step >= span * (1.0 - 1e-9)
        # A failed try may have let the drum go or stopped it; the next, shorter one must begin from what was true.
        mode = live.line.ends.drum_mode
        ending = _agree(setup, live, start + done, step)
        if ending == FINE:
            _accept(setup, live, start + done, step)
            done += step
            if last:
                return FINE
            step = min(
                2.0 * step, span - done
            )  # the difficult time may have passed: short steps are not kept for good
        else:
            live.line.ends.drum_mode = mode
            step *= 0.5
            if step < span * 0.5**MOST_HALVINGS or ending == ABSURD:
                return ending


@inner
def hull_steps(setup: Setup, span: float) -> int:
    """Return how many hull steps an exchange takes."""
    return max(1, int(np.ceil(span / setup.fixed.hull_step - 1e-6)))


@inlined
def _agree(setup: Setup, live: Live, start: float, span: float) -> int:
    """Find the force at the end of an exchange with which hull and cable agree; nothing is made real yet."""
    # First guess: the force goes on with the slope of the exchange before, and bends as it did there.
    ratio = span / live.now.last_step if live.now.last_step > 0.0 else 0.0
    for i in range(3):
        live.now.guess[i] = _straight_on(live.now, ratio, i) + ratio * ratio * live.now.missed[i]
    lead_drum(setup.led, start + span, setup.fixed.drum)
    size = np.inf
    if live.now.last_step == 0.0:
        forget(setup, live)
    for evaluation in range(MOST_EXCHANGES):
        for i in range(3):
            live.now.tow_before[i] = live.now.tow[i]
        if not _move(setup, live, start, span):
            return ABSURD
        if evaluation == 1:
            _learn(live.now, span)
        if not setup.fixed.tethered:
            return FINE
        converged = try_step(
            live.line,
            span,
            live.now.tow,
            setup.water,
            setup.fixed.cable,
            setup.fixed.drum,
            live.load,
            evaluation > 0,
        )
        live.now.iterations += live.line.ends.solved.iterations
        if not converged:
            return CABLE_FAILED
        # Before the test of agreement: how stiff the cable is says how well two forces can agree at all.
        impedance(live.line, live.now.Z)
        # A first guess is never believed, however good: what errors it takes over differs from exchange to exchange.
        if setup.fixed.prescribed or (
            evaluation > 0 and _forces_agree(live.now, live.line.ends.tow.force, setup.fixed.agreement)
        ):
            return FINE
        size = _improve(span, live.now, live.line.ends.tow.force, size)
    return DISAGREED


@compiled
def forget(setup: Setup, live: Live) -> None:
    """Discard all that only improves guesses: where a state is set again, it belongs to another one."""
    for i in range(3):
        live.now.missed[i] = 0.0
    _mobility(setup.fixed.r_c, setup.fixed.vehicle.inverse_mass, live.now.mobility)
    live.line.ends.solver.factored = False


@inlined
def _straight_on(now: Now, ratio: float, i: int) -> float:
    """Return a component of F_n + h F', F' = (F_n − F_{n−1})/h_n, for h = `ratio` h_n. [N]."""
    return now.force[i] + ratio * (now.force[i] - now.force_before[i])


@inlined
def _move(setup: Setup, live: Live, start: float, span: float) -> bool:
    """Move the hull through an exchange; fill the tow point, relative to the drum; False if the speed is absurd."""
    steps = hull_steps(setup, span)
    for i in range(STATE_SIZE):
        live.path[0, i] = live.state[i]
    if setup.fixed.prescribed:
        follow_track(start, span, steps, setup.track, live.path)
    else:
        advance_hull(setup, live, start, span, steps)
    new = live.path[steps]
    speed = new[7] * new[7] + new[8] * new[8] + new[9] * new[9]
    if not speed < FASTEST * FASTEST:
        return False
    tow_point(new, setup.fixed.r_c, live.now.hull.rotation, live.now.tow)
    for i in range(3):
        live.now.tow[i] -= setup.fixed.drum_place[i]
    return True


@compiled
def _forces_agree(now: Now, F: np.ndarray, agreement: float) -> bool:
    """Return whether the cable responds with the force that the hull was pulled by, as far as rounding allows."""
    size, gap, stiffness, reach = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        size = max(size, abs(F[i]))
        gap = max(gap, abs(F[i] - now.guess[i]))
        reach = max(reach, abs(now.tow[i]))
        for k in range(3):
            stiffness = max(stiffness, abs(now.Z[i, k]))
    # A taut cable is stiff: the last digit of the tow point's place (ROUNDING · reach) is already this much force. No
    # iteration can do better, and a stricter test would halve the step for nothing.
    return gap <= agreement * (size + NOTABLE) + ROUNDING * stiffness * reach


@compiled
def _improve(span: float, now: Now, F: np.ndarray, last_size: float) -> float:
    """Take one Newton step on the force, (I − (h²/2) Z A) δ = F_cable − guess, or go back half of the last one.

    A cable between slack and taut is a stiff and bent spring: a step after which the next one would be longer than
    itself (`last_size`) went too far. Returns the size of the step that stands. [N]
    """
    # G(F + δ) ≈ G + (Z ∂x/∂F − I) δ = 0. The pull of the whole exchange is moved by δ, for its slope is known: so the
    # tow point moves by ½h²A δ, and the cable answers with Z times that.
    M, b, A, Z, R = scratch(3, 3), scratch(1, 3)[0], scratch(3, 3), now.Z, now.hull.rotation
    _turn(R, now.mobility, A)
    for i in range(3):
        b[i] = F[i] - now.guess[i]
        for k in range(3):
            total = 0.0
            for m in range(3):
                total += Z[i, m] * A[m, k]
            M[i, k] = (1.0 if i == k else 0.0) - 0.5 * span * span * total
    _solve_three(M, b)
    size = max(abs(b[0]), abs(b[1]), abs(b[2]))
    too_far = not size < last_size  # written so that NaN counts as too far
    for i in range(3):
        now.change[i] = 0.5 * now.change[i] if too_far else b[i]
        now.guess[i] += -now.change[i] if too_far else b[i]
    return last_size if too_far else size


@compiled
def _turn(R: np.ndarray, body: np.ndarray, out: np.ndarray) -> None:
    """Fill out (3, 3) with R B Rᵀ: in earth axes what `body` (3, 3) is in those of the vehicle."""
    half = scratch(3, 3)
    for i in range(3):
        for k in range(3):
            half[i, k] = R[i, 0] * body[0, k] + R[i, 1] * body[1, k] + R[i, 2] * body[2, k]
    for i in range(3):
        for k in range(3):
            out[i, k] = half[i, 0] * R[k, 0] + half[i, 1] * R[k, 1] + half[i, 2] * R[k, 2]


@compiled
def _mobility(r: np.ndarray, inverse: np.ndarray, out: np.ndarray) -> None:
    """Fill out (3, 3) with A = [I, −r×] M⁻¹ [I, −r×]ᵀ, acceleration of the tow point per force, body axes. [1/kg]."""
    lever = scratch(3, 6)
    for i in range(3):
        for k in range(6):
            lever[i, k] = 1.0 if i == k else 0.0
    lever[0, 4], lever[0, 5] = r[2], -r[1]
    lever[1, 3], lever[1, 5] = -r[2], r[0]
    lever[2, 3], lever[2, 4] = r[1], -r[0]
    for i in range(3):
        for k in range(3):
            out[i, k] = 0.0
            for m in range(6):
                for n in range(6):
                    out[i, k] += lever[i, m] * inverse[m, n] * lever[k, n]


@compiled
def _learn(now: Now, span: float) -> None:
    """Make A such that it gives the last move of the tow point for the last change of the guess (Broyden's update).

    M⁻¹ leaves out what the water does within an exchange, up to a tenth. A move that may be rounding teaches nothing.
    """
    R, A, d, x = now.hull.rotation, now.mobility, scratch(1, 3)[0], scratch(1, 3)[0]
    size, way, reach = 0.0, 0.0, 0.0
    for i in range(3):
        d[i], x[i] = 0.0, 0.0
        for k in range(3):
            d[i] += R[k, i] * now.change[k]
            x[i] += R[k, i] * (now.tow[k] - now.tow_before[k])
        size += d[i] * d[i]
        way, reach = max(way, abs(x[i])), max(reach, abs(now.tow[i]))
    if not way > 1e2 * ROUNDING * reach:
        return
    for i in range(3):
        missed = 2.0 / (span * span) * x[i] - (A[i, 0] * d[0] + A[i, 1] * d[1] + A[i, 2] * d[2])
        for k in range(3):
            A[i, k] += missed * d[k] / size


@compiled
def _solve_three(M: np.ndarray, b: np.ndarray) -> None:
    """Overwrite b (3,) with M⁻¹b by elimination without pivoting: M is the identity plus a stiffness times a mobility,
    whose leading minors are always positive.
    """
    for k in range(3):
        for i in range(k + 1, 3):
            factor = M[i, k] / M[k, k]
            for m in range(k, 3):
                M[i, m] -= factor * M[k, m]
            b[i] -= factor * b[k]
    for k in range(2, -1, -1):
        for m in range(k + 1, 3):
            b[k] -= M[k, m] * b[m]
        b[k] /= M[k, k]


@inlined
def _accept(setup: Setup, live: Live, start: float, span: float) -> None:
    """Make the exchange real: state, forces, cable, energies."""
    steps = hull_steps(setup, span)
    ratio = span / live.now.last_step if live.now.last_step > 0.0 else 0.0
    for i in range(3):
        force = live.line.ends.tow.force[i] if setup.fixed.tethered else 0.0
        live.now.missed[i] = force - _straight_on(live.now, ratio, i)
        live.now.force_before[i], live.now.force[i] = live.now.force[i], force
    for i in range(STATE_SIZE):
        live.state[i] = live.path[steps, i]
    if live.now.last_step == 0.0:
        for i in range(3):  # the force at the start is a guess: it gives no slope
            live.now.force_before[i], live.now.missed[i] = live.now.force[i], 0.0
    # The cable is accepted first: the energies booked below are those of its new time level.
    live.now.last_step = span
    if setup.fixed.tethered:
        accept(live.line, span, setup.fixed.cable, live.load)
    if setup.fixed.booked:
        if setup.fixed.tethered:
            energy_flow(live.line, setup.fixed.cable, live.load, live.now.ledger.cable_new)
        book(setup, live, start, span, steps)
    if setup.fixed.tethered:
        live.now.length = in_water(live.line)
