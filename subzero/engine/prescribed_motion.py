"""A smooth prescribed motion as a table of knots: where the hull is and how it lies at every sample, and the slopes.

The cable feels nothing of the vehicle but the place of the tow point and its velocity R (V + Ω × r_c), equation (8):
place and attitude are functions of time whose slopes are the speeds, cubic Hermite polynomials through

    (x, y, z, φ, θ, ψ)(t_i)   with the slopes   (R V, J⁻¹ Ω)(t_i)

Between samples h apart a cubic errs by h⁴/384 of the fourth derivative; at the samples it is exact, in place and speed.
Speeds and rates of a run that follows it are its derivatives, so all nine states belong together at every time.

What is not given is filled in: angles slope as parabolas through three samples do; so do the coordinates, where sway
or heave is not given; a coordinate that is not given is the integral of R V, by the same cubics.
"""

from __future__ import annotations

import numpy as np

import scenarios
from subzero.engine.run_state import KNOT_ROWS, PLACE, SLOPE, TIME
from subzero.errors import UserError, printable

FAR_OFF = 0.5
"""Places and speeds do not belong together if they differ by more than this share of the speed … [-]"""
FAR_OFF_AT_REST = 0.05
"""… and this, root mean squares over the motion. [m/s]"""

COORDINATES = ("north", "east", "depth")


def knots(motion: scenarios.Motion, depth: float) -> np.ndarray:
    """Return the table of a smooth motion, rows as in `subzero.engine.run_state`. Shape (KNOT_ROWS, samples).

    Args:
        motion: at least two samples.
        depth: of the hull centre at the start, for a motion that does not say it, positive down. [m]

    Raises:
        UserError: places and speeds that do not belong together.
    """
    t = motion.time
    table = np.zeros((KNOT_ROWS, t.size))
    angles, rates = _attitude(motion)
    velocity = rotated(
        angles, *(_or_zero(motion, name) for name in ("surge_speed", "sway_speed", "heave_speed"))
    )
    table[TIME] = t
    table[PLACE + 3 : PLACE + 6], table[SLOPE + 3 : SLOPE + 6] = angles, rates
    complete = motion.sway_speed is not None and motion.heave_speed is not None
    for i, name in enumerate(COORDINATES):
        way, given = _integral(t, velocity[i]), getattr(motion, name)
        table[PLACE + i] = (depth if name == "depth" else 0.0) + way if given is None else given
        table[SLOPE + i] = velocity[i] if given is None or complete else _slope(t, given)
    _refuse_contradiction(motion, velocity, table)
    return table


def rotated(angles: np.ndarray, u: np.ndarray, v: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Return R(φ, θ, ψ) (u, v, w), equation (2), in earth axes. Shape (3, samples). [m/s]."""
    (sr, sp, sh), (cr, cp, ch) = np.sin(angles), np.cos(angles)
    along, aside, below = u, cr * v - sr * w, sr * v + cr * w  # turned back by the roll
    level, down = cp * along + sp * below, cp * below - sp * along  # and by the pitch
    return np.stack([ch * level - sh * aside, sh * level + ch * aside, down])


def _attitude(motion: scenarios.Motion) -> tuple[np.ndarray, np.ndarray]:
    """Return roll, pitch and heading [rad], and how fast they change [rad/s]. Shapes (3, samples)."""
    angles = np.stack([_or_zero(motion, name) for name in ("roll", "pitch", "heading")])
    slopes = np.stack([_slope(motion.time, angle) for angle in angles])
    (roll_slope, pitch_slope, turn), (sr, sp, _), (cr, cp, _) = slopes, np.sin(angles), np.cos(angles)
    p, q, r = roll_slope - turn * sp, pitch_slope * cr + turn * cp * sr, turn * cp * cr - pitch_slope * sr
    p, q, r = (
        known if (known := getattr(motion, name)) is not None else found
        for name, found in (("roll_rate", p), ("pitch_rate", q), ("yaw_rate", r))
    )
    turning = (q * sr + r * cr) / cp
    rates = np.stack([p + sp * turning, q * cr - r * sr, turning])
    if motion.roll is None:
        rates[0] = 0.0
    return angles, rates


def _or_zero(motion: scenarios.Motion, name: str) -> np.ndarray:
    given = getattr(motion, name)
    return np.zeros(motion.time.size) if given is None else np.asarray(given, dtype=float)


def _slope(t: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the slopes of parabolas through three neighbours. Shape (samples,)."""
    slopes: np.ndarray = np.gradient(y, t, edge_order=2 if t.size > 2 else 1)
    return slopes


def _integral(t: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Return the integral of a rate from the first sample on, exact for cubics. Shape (samples,)."""
    h, slope = np.diff(t), _slope(t, rate)
    parts = 0.5 * h * (rate[:-1] + rate[1:]) + h * h / 12.0 * (slope[:-1] - slope[1:])
    return np.concatenate([[0.0], np.cumsum(parts)])


def _refuse_contradiction(motion: scenarios.Motion, velocity: np.ndarray, table: np.ndarray) -> None:
    """Raise an error for places that contradict the speeds: a wrong sign or unit, or nothing but noise."""
    h = np.diff(motion.time)
    usual = float(np.sqrt(np.mean(np.sum(velocity**2, axis=0))))
    for i, name in enumerate(COORDINATES):
        if getattr(motion, name) is None:
            continue
        moved, said = np.diff(table[PLACE + i]), np.diff(_integral(motion.time, velocity[i]))
        gap = float(np.sqrt(np.mean(((moved - said) / h) ** 2)))
        if gap > FAR_OFF * usual + FAR_OFF_AT_REST:
            raise UserError(
                f"The motion contradicts itself: its {printable(name)} moves otherwise than speeds and angles say, by "
                f"{gap:.3g} m/s (root mean square; the speed is {usual:.3g} m/s). Look at signs, units and columns, or "
                f"leave out {name}, or smooth it: its noise would be noise in the speed of the tow point."
            )
