"""The six equations of one box between two nodes, and the conditions at both ends, with exact slopes.

With Δy = y_j − y_{j−1}, ȳ their mean, h the state from which a node's change is measured, a the rate (1/Δt)
and Σ over the two nodes:

    w [M(ȳ) Δy − ΔS q(ȳ)] + K − ½ΔS a Σ N(z) (y − h) = 0,        z = φ y + (1 − φ) h

is equation (22) of Feng and Allen (2004), multiplied by ΔS/2, for w = φ = ½, h = y(t_k) and K half of
M Δy − ΔS q at t_k; it is fully implicit for w = φ = 1, K = 0; and a stage of any method with ẏ = a (y − h)
looks the same. Multiplied by ΔS, the equations remain well scaled for a short box. A box whose right node is no
material point but the moving end s = S(t), dS/dt = −Vt (``rule.moves``), sees the change at fixed s:
a (y − h) + Vt ∂y/∂s there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from cable.feng_allen.box_solver import CARRIED, RIGHT, SIZE
from cable.feng_allen.equation7 import (
    Equation7Numbers,
    load,
    load_slope,
    space_matrix,
    space_slope,
    time_matrix,
    time_slope,
    to_local,
)
from subzero.jit import compiled


class BoxRule(NamedTuple):
    """How a time step turns (7) into box equations; see the module's first words."""

    weight: float
    """w, of the new time."""
    mix: float
    """φ, where between h and y the matrix N is taken."""
    rate: float
    """a [1/s]."""
    moves: bool
    """The last node is the moving end."""
    end_history: float
    """L_h, from which the length L = L_h − Vt/a of the last box is measured when its end moves [m]."""


class Ends(NamedTuple):
    """The conditions at the vehicle (8) and at the drum (9)-(11)."""

    north: float
    """Velocity of the tow point, earth axes [m/s]."""
    east: float
    down: float
    inertia: float
    """I_d/R_d² [kg]."""
    friction: float
    """C_f/R_d [N]."""
    stands: bool
    """The drum stands still: Vt = 0 there instead of (26)."""


class BoxScratch(NamedTuple):
    """Small arrays for the equations of one box, zero where M, N, q and their slopes are zero."""

    M: np.ndarray
    N: np.ndarray
    M_slope: np.ndarray
    N_slope: np.ndarray
    q_slope: np.ndarray
    q: np.ndarray
    mean: np.ndarray
    difference: np.ndarray
    change: np.ndarray


def box_scratch() -> BoxScratch:
    """Return zeroed scratch arrays."""
    return BoxScratch(*(np.zeros((6, 6)) for _ in range(5)), *(np.zeros(6) for _ in range(4)))


@compiled
def fill_middle(left: np.ndarray, right: np.ndarray, k: BoxScratch) -> None:
    """Fill the mean and the difference of two nodes (21)."""
    for i in range(SIZE):
        k.mean[i] = 0.5 * (left[i] + right[i])
        k.difference[i] = right[i] - left[i]


@compiled
def known_part(
    left: np.ndarray,
    right: np.ndarray,
    length: float,
    weight: float,
    c: Equation7Numbers,
    k: BoxScratch,
    out: np.ndarray,
) -> None:
    """Fill (1 − w) [M(ȳ) Δy − ΔS q(ȳ)] of the old time, K: half of it for the trapezoidal rule."""
    fill_middle(left, right, k)
    space_matrix(k.mean, k.M)
    load(k.mean, c, k.q)
    for i in range(SIZE):
        value = -length * k.q[i]
        for n in range(SIZE):
            value += k.M[i, n] * k.difference[n]
        out[i] = (1.0 - weight) * value


@compiled
def add_space_part(
    window: np.ndarray,
    left: np.ndarray,
    right: np.ndarray,
    length: float,
    rule: BoxRule,
    c: Equation7Numbers,
    k: BoxScratch,
) -> None:
    """Add w [M(ȳ) Δy − ΔS q(ȳ)] and its slopes to the six rows of a box."""
    fill_middle(left, right, k)
    space_matrix(k.mean, k.M)
    load(k.mean, c, k.q)
    space_slope(k.mean, k.difference, k.M_slope)
    load_slope(k.mean, c, k.q_slope)
    w = rule.weight
    for i in range(SIZE):
        row = window[CARRIED + i]
        value = -length * k.q[i]
        for n in range(SIZE):
            value += k.M[i, n] * k.difference[n]
            both = 0.5 * (k.M_slope[i, n] - length * k.q_slope[i, n])
            row[n] += w * (both - k.M[i, n])
            row[SIZE + n] += w * (both + k.M[i, n])
        row[RIGHT] -= w * value
        if rule.moves:
            row[SIZE + 1] += w * k.q[i] / rule.rate  # ΔS shrinks by Vt/a


@compiled
def fill_change(y: np.ndarray, history: np.ndarray, length: float, rule: BoxRule, k: BoxScratch) -> None:
    """Fill z into ``k.mean`` and ½ΔS a (y − h) into ``k.change``."""
    for i in range(SIZE):
        k.mean[i] = rule.mix * y[i] + (1.0 - rule.mix) * history[i]
        k.change[i] = 0.5 * length * rule.rate * (y[i] - history[i])


@compiled
def add_time_part(
    window: np.ndarray, side: int, length: float, rule: BoxRule, c: Equation7Numbers, k: BoxScratch
) -> None:
    """Subtract N(z) x of one node (side 0 or 6 of the window), x being ``k.change``, and its slopes."""
    time_matrix(k.mean, c, k.N)
    time_slope(k.mean, k.change, c, k.N_slope)
    factor = 0.5 * length * rule.rate
    for i in range(SIZE):
        row = window[CARRIED + i]
        for n in range(SIZE):
            row[side + n] -= factor * k.N[i, n] + rule.mix * k.N_slope[i, n]
            row[RIGHT] += k.N[i, n] * k.change[n]


@compiled
def add_moving_end(
    window: np.ndarray,
    left: np.ndarray,
    right: np.ndarray,
    history: np.ndarray,
    side: int,
    rule: BoxRule,
    k: BoxScratch,
) -> None:
    """Add what the moving end changes in the slopes of one node's time part.

    The node's x is ½[ΔS a (y − h) + Vt Δy] at the right node, ½ΔS a (y − h) at the left; ∂ΔS/∂Vt = −1/a.
    ``k.N`` is the node's; the residual has been seen to by `add_time_part`.
    """
    node = right if side == SIZE else left
    speed = right[1]
    for i in range(SIZE):
        row = window[CARRIED + i]
        for n in range(SIZE):
            entry = k.N[i, n]
            row[SIZE + 1] += 0.5 * entry * (node[n] - history[n])
            if side == SIZE:
                row[SIZE + 1] -= 0.5 * entry * (right[n] - left[n])
                row[SIZE + n] -= 0.5 * entry * speed
                row[n] += 0.5 * entry * speed


@compiled
def box_rows(
    window: np.ndarray,
    left: np.ndarray,
    right: np.ndarray,
    left_history: np.ndarray,
    right_history: np.ndarray,
    known: np.ndarray,
    length: float,
    rule: BoxRule,
    c: Equation7Numbers,
    k: BoxScratch,
) -> None:
    """Fill rows 3-8 of the window with the Newton rows of a box; column 12 is minus the residual."""
    for i in range(SIZE):
        window[CARRIED + i, RIGHT] = -known[i]
    add_space_part(window, left, right, length, rule, c, k)
    fill_change(left, left_history, length, rule, k)
    add_time_part(window, 0, length, rule, c, k)
    if rule.moves:
        add_moving_end(window, left, right, left_history, 0, rule, k)
    fill_change(right, right_history, length, rule, k)
    if rule.moves:
        for i in range(SIZE):
            k.change[i] += 0.5 * right[1] * (right[i] - left[i])
    add_time_part(window, SIZE, length, rule, c, k)
    if rule.moves:
        add_moving_end(window, left, right, right_history, SIZE, rule, k)


@compiled
def tow_rows(window: np.ndarray, y: np.ndarray, ends: Ends) -> None:
    """Fill rows 0-2: the first node has the velocity of the tow point, (8) and (23)."""
    vt, vn, vb = to_local(y[4], y[5], ends.north, ends.east, ends.down)
    sb, cb = math.sin(y[5]), math.cos(y[5])
    for i in range(CARRIED):
        for n in range(2 * SIZE):
            window[i, n] = 0.0
        window[i, 1 + i] = 1.0
    window[0, 4], window[0, 5], window[0, RIGHT] = vb * cb, -vn, vt - y[1]
    window[1, 4], window[1, 5], window[1, RIGHT] = -vb * sb, vt, vn - y[2]
    window[2, 4], window[2, 5], window[2, RIGHT] = -(vt * cb - vn * sb), 0.0, vb - y[3]


@compiled
def drum_rows(window: np.ndarray, y: np.ndarray, history: np.ndarray, rate: float, ends: Ends) -> None:
    """Fill rows 3-5 for the last node: Vn = Vb = 0 (24)-(25), and the turning drum (26) over R_d²."""
    window[3, 2], window[3, RIGHT] = 1.0, -y[2]
    window[4, 3], window[4, RIGHT] = 1.0, -y[3]
    if ends.stands:
        window[5, 1], window[5, RIGHT] = 1.0, -y[1]
        return
    window[5, 0], window[5, 1] = 1.0, ends.inertia * rate
    window[5, RIGHT] = ends.friction - y[0] - ends.inertia * rate * (y[1] - history[1])
