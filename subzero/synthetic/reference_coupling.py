"""The hull and the lumped cable, exchange by exchange: the loop of `reference_run`.

In an exchange of length h the hull is pulled by a force that ends at F, with the slope of the exchange before; the
lumped cable is led to where that takes the tow point, on a cubic; F is right when the cable answers with it. Broyden's
method finds it, and keeps what it learns of ∂F_cable/∂F from exchange to exchange. What does not settle, as where a
slack cable jerks, is tried in halves, and at last taken as it is, the jerk spread over the exchange.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cable.drum_motion import lead_drum
from cable.lumped import GAMMA, OLD, REST, STATE, Rope, accept_step, try_step
from subzero.engine.coupling import _move, _solve_three, hull_steps
from subzero.engine.recording import Recording, record_row
from subzero.engine.run_state import Live, Setup
from subzero.jit import allocating, compiled
from vehicle import STATE_SIZE

MAX_ITERATIONS = 40
AGREED_SHARE = 1e-7
"""Hull and cable agree when their forces differ by less than this share of them, and 1e-9 N."""
NEARLY_AGREED_N = 1e-3
"""In the smallest piece of an exchange, they need not agree better than this. [N]"""
SMALLEST_SHARE = 0.5**10
RATE_STEP_S = 1e-4
"""Time step of the difference that gives the rate of a winch's setpoint. [s]"""

FINE, CABLE, NOT_AGREED = range(3)
"""How an exchange ended."""


class Led(NamedTuple):
    """Work space: tow point at the start and the end of an exchange, both legs, Broyden's matrix, the springs' states.

    Attributes:
        ends: place and velocity, relative to the drum, at start and end (2, 6). [m], [m/s]
        legs: inputs of the ends for `cable.lumped.step` (2, 15).
        matrix: I − ∂F_cable/∂F (3, 3).
        states: of the springs at the start of an exchange.
        history: pull of the cable, earth axes, its tension at the drum and its length, by rows (n, 5). [N], [m]
    """

    ends: np.ndarray
    legs: np.ndarray
    matrix: np.ndarray
    states: np.ndarray
    history: np.ndarray


@compiled
def follow_rope(
    setup: Setup,
    live: Live,
    rope: Rope,
    led: Led,
    recording: Recording,
    times: np.ndarray,
    first: int,
    last: int,
    segment: float,
) -> tuple[int, int]:
    """Fill rows first … last − 1 of a recording and of led.history; return the row that was reached, and the ending."""
    for row in range(first, last):
        start, span = times[row - 1], times[row] - times[row - 1]
        done, step = 0.0, span
        while done < span * (1.0 - 1e-9):
            ending = _exchange(setup, live, rope, led, start + done, step, step < 1.5 * SMALLEST_SHARE * span)
            if ending == FINE:
                _accept(setup, live, rope, step, segment)
                done += step
                step = min(2.0 * step, span - done)
            else:
                step *= 0.5
                for i in range(3):
                    for k in range(3):
                        led.matrix[i, k] = 1.0 if i == k else 0.0
                if step < 0.9 * SMALLEST_SHARE * span:
                    return row, ending
        record_row(setup, live, recording, row, times[row], 0)
        _note(live, rope, led.history[row])
    return last, FINE


@allocating
def _exchange(setup: Setup, live: Live, rope: Rope, led: Led, start: float, span: float, last: bool) -> int:
    """Find the pull at the end of an exchange; nothing is made real yet. The `last` try need not agree to the last."""
    now, fixed, F = live.now, setup.fixed, rope.ends.tow_force
    ratio = span / now.last_step if now.last_step > 0.0 else 0.0
    for i in range(3):
        now.guess[i] = now.force[i] + ratio * (now.force[i] - now.force_before[i])
    for j in range(rope.ends.count + 1):
        led.states[j] = rope.spring[STATE, j]
    _tow_point(setup, live, live.state, led.ends[0])
    gap, before, step = np.zeros(3), np.zeros(3), np.zeros(3)
    for attempt in range(MAX_ITERATIONS):
        if not _move(setup, live, start, span):
            return NOT_AGREED
        _tow_point(setup, live, live.path[hull_steps(setup, span)], led.ends[1])
        for j in range(rope.ends.count + 1):
            rope.spring[STATE, j] = led.states[j]
        for stage in range(2):
            _lead(setup, led, start, span, GAMMA if stage == 0 else 1.0, led.legs[stage])
        if not try_step(rope, span, led.legs, fixed.cable, fixed.drum, setup.water).converged:
            for j in range(rope.ends.count + 1):
                rope.spring[STATE, j] = led.states[j]
            return CABLE
        size, off = 0.0, 0.0
        for i in range(3):
            before[i], gap[i] = gap[i], F[i] - now.guess[i]
            size, off = max(size, abs(F[i])), max(off, abs(gap[i]))
        if off <= AGREED_SHARE * size + 1e-9 or (
            last and attempt >= MAX_ITERATIONS // 2 and off <= NEARLY_AGREED_N
        ):
            return FINE
        if attempt > 0:
            _learn(led.matrix, gap, before, step)
        _newton(led.matrix, gap, step)
        for i in range(3):
            now.guess[i] += step[i]
    for j in range(rope.ends.count + 1):
        rope.spring[STATE, j] = led.states[j]
    return FINE if last and off < 100.0 * NEARLY_AGREED_N else NOT_AGREED


@compiled
def _learn(M: np.ndarray, gap: np.ndarray, before: np.ndarray, step: np.ndarray) -> None:
    """Update M so that it fits the last step, gap − before = −M step, with the smallest change of M."""
    square = step[0] * step[0] + step[1] * step[1] + step[2] * step[2]
    for i in range(3):
        error = before[i] - gap[i]
        for k in range(3):
            error -= M[i, k] * step[k]
        for k in range(3):
            M[i, k] += error * step[k] / max(square, 1e-300)


@allocating
def _newton(M: np.ndarray, gap: np.ndarray, step: np.ndarray) -> None:
    """Fill step = M⁻¹ gap; plainly the gap where M is of no use."""
    work = M.copy()
    for i in range(3):
        step[i] = gap[i]
    _solve_three(work, step)
    size, plain = 0.0, 0.0
    for i in range(3):
        size, plain = max(size, abs(step[i])), max(plain, abs(gap[i]))
    if not size < 20.0 * plain:
        for i in range(3):
            step[i] = 0.5 * gap[i]
            for k in range(3):
                M[i, k] = 2.0 if i == k else 0.0


@compiled
def _tow_point(setup: Setup, live: Live, state: np.ndarray, out: np.ndarray) -> None:
    """Fill out (6,) with place, relative to the drum, and velocity of the tow point; the rotation is left in live."""
    R, r = live.now.hull.rotation, setup.fixed.r_c
    q0, q1, q2, q3 = state[3], state[4], state[5], state[6]
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (q2 * q2 + q3 * q3), 2 * (q1 * q2 - q0 * q3), 2 * (q1 * q3 + q0 * q2)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (q1 * q2 + q0 * q3), 1 - 2 * (q1 * q1 + q3 * q3), 2 * (q2 * q3 - q0 * q1)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1), 1 - 2 * (q1 * q1 + q2 * q2)
    x = state[7] + state[11] * r[2] - state[12] * r[1]
    y = state[8] + state[12] * r[0] - state[10] * r[2]
    z = state[9] + state[10] * r[1] - state[11] * r[0]
    for i in range(3):
        arm = R[i, 0] * r[0] + R[i, 1] * r[1] + R[i, 2] * r[2]
        out[i] = state[i] + arm - setup.fixed.drum_place[i]
        out[3 + i] = R[i, 0] * x + R[i, 1] * y + R[i, 2] * z


@compiled
def _lead(setup: Setup, led: Led, start: float, span: float, x: float, leg: np.ndarray) -> None:
    """Fill a leg (15,) a fraction x into an exchange: time, tow point on a cubic, drum, winch, and their rates."""
    a, b, y = led.ends[0], led.ends[1], 1.0 - x
    leg[0] = start + x * span
    for i in range(3):
        u, v = a[3 + i], b[3 + i]
        leg[1 + i] = (
            (1.0 + 2.0 * x) * y * y * a[i] + (3.0 - 2.0 * x) * x * x * b[i] + span * x * y * (y * u - x * v)
        )
        leg[8 + i] = 6.0 * x * y * (b[i] - a[i]) / span + y * (1.0 - 3.0 * x) * u + x * (3.0 * x - 2.0) * v
    drum = setup.fixed.drum
    lead_drum(setup.led, leg[0] - RATE_STEP_S, drum)
    earlier = drum.setpoint
    lead_drum(setup.led, leg[0], drum)
    for i in range(3):
        leg[4 + i], leg[11 + i] = drum.place[i], drum.velocity[i]
    leg[7], leg[14] = drum.setpoint, (drum.setpoint - earlier) / RATE_STEP_S


@compiled
def _accept(setup: Setup, live: Live, rope: Rope, span: float, segment: float) -> None:
    """Make an exchange real: hull, force, cable."""
    now, steps = live.now, hull_steps(setup, span)
    for i in range(STATE_SIZE):
        live.state[i] = live.path[steps, i]
    for i in range(3):
        now.force_before[i] = rope.ends.tow_force[i] if now.last_step == 0.0 else now.force[i]
        now.force[i] = rope.ends.tow_force[i]
    now.last_step = span
    accept_step(rope, span, segment, setup.fixed.cable)
    now.length = 0.0
    for j in range(1, rope.ends.count + 1):
        now.length += rope.spring[REST, j]


@compiled
def _note(live: Live, rope: Rope, out: np.ndarray) -> None:
    """Fill out (5,) with pull, tension at the drum and length."""
    for i in range(3):
        out[i] = live.now.force[i]
    out[3], out[4] = max(rope.ends.drum_pull, 0.0), live.now.length + rope.ends.loose[OLD]
