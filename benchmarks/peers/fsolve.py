"""The paper's way, plainly: the box equations (20)-(26) for all nodes at once, handed to `scipy.optimize.fsolve`.

No Jacobian is given, and every step starts from the last one's answer: what an engineer would write first. The same
equations as `cable.pull_out(..., scheme=cable.Paper())`, for a cable without stretch in still water and a drum without
inertia. Unknowns of a node: T, V_t, V_n, V_b, α, β. The residual comes in two kinds: box by box with the matrices of
(7), as it is printed, and written out and vectorised over the boxes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import fsolve

import cable
from cable.feng_allen.equation7 import angles_of, equation7_numbers, load, space_matrix, time_matrix

SOLVED = 1e-6
"""Largest residual that counts as solved; fsolve's own verdict is "no good progress" where its guess is the answer."""

Boxes = Callable[[np.ndarray, np.ndarray, np.ndarray, float, cable.CableProperties], np.ndarray]


def space_part(
    left: np.ndarray, right: np.ndarray, length: np.ndarray, c: cable.CableProperties
) -> np.ndarray:
    """Return M Δy − ΔS q of the boxes (boxes, 6), with M and q taken at the boxes' middles."""
    T, Vt, Vn, Vb, _, beta = (0.5 * (left + right)).T
    dT, dVt, dVn, dVb, dalpha, dbeta = (right - left).T
    cos, sin, across = np.cos(beta), np.sin(beta), np.hypot(Vn, Vb)
    rows = [
        dT - length * (c.weight_in_water * sin + c.tangential_drag * Vt * np.abs(Vt)),
        dVt + Vb * cos * dalpha - Vn * dbeta,
        dVn + Vt * dbeta - Vb * sin * dalpha,
        dVb - Vt * cos * dalpha + Vn * sin * dalpha,
        -T * cos * dalpha - length * c.normal_drag * Vb * across,
        T * dbeta - length * (c.weight_in_water * cos + c.normal_drag * Vn * across),
    ]
    return np.stack(rows, axis=1)


def time_part(new: np.ndarray, old: np.ndarray, c: cable.CableProperties) -> np.ndarray:
    """Return N (y − y_old) of the nodes (nodes, 6), with N taken half-way between."""
    _, Vt, Vn, Vb, _, beta = (0.5 * (new + old)).T
    _, dVt, dVn, dVb, dalpha, dbeta = (new - old).T
    cos, sin, m, m1 = np.cos(beta), np.sin(beta), c.mass_per_length, c.virtual_mass_per_length
    rows = [
        m * dVt + m1 * Vb * cos * dalpha - m1 * Vn * dbeta,
        np.zeros_like(dVt),
        dbeta,
        -cos * dalpha,
        m1 * dVb + (m1 * Vn * sin - m * Vt * cos) * dalpha,
        m1 * dVn - m1 * Vb * sin * dalpha + m * Vt * dbeta,
    ]
    return np.stack(rows, axis=1)


def vectorised(
    y: np.ndarray, old: np.ndarray, length: np.ndarray, step: float, c: cable.CableProperties
) -> np.ndarray:
    """Return (22) of all boxes (boxes, 6) at once."""
    half = 0.5 * (space_part(y[:-1], y[1:], length, c) + space_part(old[:-1], old[1:], length, c))
    change = time_part(y, old, c)
    return half - 0.5 * (length / step)[:, None] * (change[:-1] + change[1:])


def box_by_box(
    y: np.ndarray, old: np.ndarray, length: np.ndarray, step: float, c: cable.CableProperties
) -> np.ndarray:
    """Return (22) of all boxes (boxes, 6), one after another, with the matrices M and N and the vector q of (7)."""
    numbers = equation7_numbers(c, (0.0, 0.0, 0.0))
    out, M, N, q = np.zeros((length.size, 6)), np.zeros((6, 6)), np.zeros((6, 6)), np.zeros(6)
    for j, size in enumerate(length):
        for now in (y, old):
            middle = 0.5 * (now[j] + now[j + 1])
            space_matrix(middle, M)
            load(middle, numbers, q)
            out[j] += 0.5 * (M @ (now[j + 1] - now[j]) - size * q)
        for k in (j, j + 1):
            time_matrix(0.5 * (y[k] + old[k]), numbers, N)
            out[j] -= 0.5 * size / step * (N @ (y[k] - old[k]))
    return out


def residual(
    unknowns: np.ndarray,
    old: np.ndarray,
    length: np.ndarray,
    step: float,
    velocity: Sequence[float],
    c: cable.CableProperties,
    boxes: Boxes,
) -> np.ndarray:
    """Return (22) of all boxes, (23) at the tow point and (24)-(26) at the drum, as one vector."""
    y = unknowns.reshape(-1, 6)
    alpha, beta = y[0, 4:]
    t = np.array([np.cos(alpha) * np.cos(beta), -np.sin(alpha) * np.cos(beta), -np.sin(beta)])
    b = np.array([np.sin(alpha), np.cos(alpha), 0.0])
    tow = y[0, 1:4] - np.array([t, np.cross(b, t), b]) @ velocity
    return np.concatenate([tow, boxes(y, old, length, step, c).ravel(), y[-1, [2, 3, 0]]])


def pull_out(
    tow_velocity: Callable[[float], Sequence[float]],
    duration: float,
    step: float,
    c: cable.CableProperties | None = None,
    boxes: Boxes = box_by_box,
) -> np.ndarray:
    """Return T(0) after every step (n,), starting without cable; one new node a step. [N]."""
    c = c or cable.CableProperties()
    start = np.array(tow_velocity(0.0))
    alpha, beta = angles_of(*-start)
    y, length = np.array([[0.0, -np.linalg.norm(start), 0.0, 0.0, alpha, beta]]), np.zeros(0)
    tensions = []
    for k in range(1, round(duration / step) + 1):
        length = np.append(length, -y[-1, 1] * step)
        old = np.vstack([y, y[-1] * [1.0, 1.0, 0.0, 0.0, 1.0, 1.0]])
        args = (old, length, step, tow_velocity(k * step), c, boxes)
        found, info, _, _ = fsolve(residual, old.ravel(), args=args, full_output=True)
        if not np.abs(info["fvec"]).max() < SOLVED:
            message = f"fsolve leaves a residual of {np.abs(info['fvec']).max():.1e} at t = {k * step:g} s."
            raise RuntimeError(message)
        y = found.reshape(-1, 6)
        tensions.append(y[0, 0])
    return np.array(tensions)
