"""Hull and cable, step by step together: both must agree on force and motion at the end of every exchange.

In an exchange of length h the hull is pulled by a force that ends at F_{n+1}, with the slope of the exchange before;
the cable is solved for the place to which that takes the tow point; F_{n+1} is right when the cable answers with it:

    G(F) = F_cable(x_tow(F)) − F = 0

Newton's method solves it, with the cable's own ∂F/∂x (`cable.moving_end.time_step.impedance`) and the hull's ∂x/∂F
= (h²/2) A, A the inverse mass at the tow point, corrected by how the hull gave way in the exchanges before: mostly, two
evaluations do. An exchange that does not converge is tried again in halves; one in which a cable comes taut is taken in
parts that follow it (`_follow_snaps`).

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
from subzero.engine.run_state import IMPULSE, OVERLOAD, PEAK, Fixed, Live, Now, Setup
from subzero.engine.vehicle_step import advance_hull, follow_track
from subzero.jit import compiled, expanded, inlined, inner, scratch

MOST_EXCHANGES = 60
ROUNDING = 1e-14
"""Places are known to this fraction, and forces to this times the cable's stiffness. [-]"""
NOTABLE = 0.01
"""Smaller forces need agree no closer than this one does: where a slack cable floats near a drifting vehicle,
exchanges hardly make its ten thousandths of a newton agree to six digits of themselves. [N]"""
MOST_HALVINGS = 8
LAG = 1e-3
"""Where a cable comes taut, exchanges are shortened until the speed of the tow point errs by less in each. [m/s]"""
WAVE_SHARE = 0.25
"""They get no shorter than this share of the time of a stretch wave, see `shortest_part`, … [-]"""
MORE_HALVINGS = 6
"""… unless Newton's method on a cable between slack and taut finds nothing: then up to so many times. [-]"""
FASTEST = 50.0
"""Speed beyond which a run is stopped as absurd. [m/s]"""

FINE, CABLE_FAILED, DISAGREED, ABSURD = range(4)
"""How an exchange ended."""


@expanded
def exchange(setup: Setup, live: Live, start: float, span: float) -> int:
    """Take one exchange from `start`, in parts where needed; the live state moves on only as far as it went well."""
    if setup.fixed.prescribed and setup.fixed.tethered:
        take_jolt_of_motion(setup, live, start)
    if setup.fixed.snaps:
        return _follow_snaps(setup, live, start, span)
    done, step = 0.0, span
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


@expanded
def _follow_snaps(setup: Setup, live: Live, start: float, span: float) -> int:
    """Take one exchange in parts that follow the jumps of the pull; the next one goes on with parts as long.

    Where none that is short enough has a solution, the next longer one that has is taken as it is.
    """
    done, now, finest = 0.0, live.now, min(span * 0.5**MOST_HALVINGS, shortest_part(setup, live))
    is_stuck = False
    while True:
        left = span - done
        step = left / np.ceil(left / min(now.pace, left) - 1e-9)  # evenly, so that the last one is not tiny
        mode = live.line.ends.drum_mode
        ending = _agree(setup, live, start + done, step)
        lag = unforeseen_speed(now, live.line.ends.tow.force, step) if ending == FINE else np.inf
        if ending == FINE and (lag <= LAG or step <= 2.0 * finest or is_stuck):
            _accept(setup, live, start + done, step)
            _note_tug(now, step, setup.fixed)
            done, is_stuck = done + step, False
            now.pace = 2.0 * step if 8.0 * lag <= LAG else step  # the lag grows with the cube of the step
            if now.pace > span:
                now.pace = np.inf
            if done >= span * (1.0 - 1e-9):
                return FINE
            continue
        live.line.ends.drum_mode = mode
        now.pace = (2.0 if is_stuck else 0.5) * step
        if is_stuck and step >= left:
            return ending
        if now.pace < finest * 0.5**MORE_HALVINGS:
            is_stuck, now.pace = True, finest


@compiled
def _note_tug(now: Now, span: float, fixed: Fixed) -> None:
    """Enter an accepted part of length `span` [s] in the peak and the impulse since the last row.

    Within it the pull goes in a straight line. That of a joint means nothing when it comes taut: its impulse does.
    """
    first, last, strength = _size(now.force_before), _size(now.force), fixed.strength
    now.tug[IMPULSE] += 0.5 * span * (first + last)
    if fixed.joint:
        return
    now.tug[PEAK] = max(now.tug[PEAK], last)
    if last > strength:
        now.tug[OVERLOAD] += span * (last - strength) / (last - min(first, strength))
    elif first > strength:
        now.tug[OVERLOAD] += span * (first - strength) / (first - last)


@inlined
def _size(F: np.ndarray) -> float:
    """Return |F|. [N]."""
    return np.sqrt(F[0] * F[0] + F[1] * F[1] + F[2] * F[2])


@inlined
def shortest_part(setup: Setup, live: Live) -> float:
    """Return a share of L/2c, the time in which a stretch wave, c = √(EA/m), runs along half of the cable. [s].

    A pull cannot come to the vehicle's notice faster than that. Infinite for a cable that does not stretch.
    """
    c = setup.fixed.cable
    return (
        WAVE_SHARE * 0.5 * live.now.length * np.sqrt(c.mass * c.compliance) if c.compliance > 0.0 else np.inf
    )


@compiled
def unforeseen_speed(now: Now, F: np.ndarray, span: float) -> float:
    """Return by how much an exchange may err in the speed of the tow point: ½h |A ΔF|. [m/s].

    ΔF is what the pull ended with other than straight on from the exchange before. The pull within an exchange is a
    straight line, so its impulse errs by ½h ΔF at most.
    """
    ratio = span / now.last_step if now.last_step > 0.0 else 0.0
    A, R, square = now.mobility, now.hull.rotation, 0.0
    for i in range(3):
        speed = 0.0
        for k in range(3):
            for m in range(3):
                speed += A[i, k] * R[m, k] * (F[m] - _straight_on(now, ratio, m))
        square += speed * speed
    return 0.5 * span * np.sqrt(square)


@inner
def hull_steps(setup: Setup, span: float) -> int:
    """Return how many hull steps an exchange takes."""
    return max(1, int(np.ceil(span / setup.fixed.hull_step - 1e-6)))


@inner
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


@expanded
def _move(setup: Setup, live: Live, start: float, span: float) -> bool:
    """Move the hull through an exchange; fill the tow point, relative to the drum; False if the speed is absurd."""
    steps = hull_steps(setup, span)
    for i in range(live.state.size):
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


@inner
def _accept(setup: Setup, live: Live, start: float, span: float) -> None:
    """Make the exchange real: state, forces, cable, energies."""
    steps = hull_steps(setup, span)
    ratio = span / live.now.last_step if live.now.last_step > 0.0 else 0.0
    for i in range(3):
        force = live.line.ends.tow.force[i] if setup.fixed.tethered else 0.0
        live.now.missed[i] = force - _straight_on(live.now, ratio, i)
        live.now.force_before[i], live.now.force[i] = live.now.force[i], force
    for i in range(live.state.size):
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
