"""Headings as they are measured: angles on a circle, of which a log loses the whole turns and, now
and then, the truth.

    ψ_k continuous = ψ_k + 360° n_k,   n_k − n_(k−1) = −round((Δψ_k − Δp_k) / 360°)

Δψ is the step between two samples that can be believed, Δp the one that is expected: the integral of a measured yaw
rate, else what a simulation does, else none. So the turns of a vehicle in a gap are not lost.

A sample that was averaged or interpolated across north, or shows the other end of the needle, leads away from its
neighbours, and back. Such samples are found as those between two that join one another directly.

Pure functions, in degrees unless another unit is named. Whether a heading that is shifted for good is right is not
decided here.
"""

from __future__ import annotations

import math

import numpy as np

TURN = 360.0
FIRST = 9
"""Samples that say where a record begins: a few of them may be outliers."""
USUAL_STEPS = 15.0
"""A step that is so many times the median one is a jump: ten standard deviations of normal noise. [-]"""
COMMON_STEPS = 0.9, 2.0
"""A step is no jump that is less than twice what nine of ten steps are below: a vehicle turns now and then. [-]"""
LOOKED_BACK = 1000
"""A sample is held against the ends of so many stretches before it: work grows no faster than the record. [-]"""


def shortest(angle: float) -> float:
    """Return an angle [rad] without whole turns, within half a turn either way; one that is there is not changed."""
    return angle if abs(angle) <= math.pi else math.remainder(angle, math.tau)


def turned(heading: np.ndarray, like: np.ndarray | float) -> np.ndarray:
    """Return a heading (n,) with the whole turns more or less that bring its first samples close to those of another,
    (n,) or one. [degree]
    """
    apart = np.asarray(like - heading)
    first = apart[np.isfinite(apart)][:FIRST]
    return heading + TURN * np.round(np.median(first) / TURN) if first.size else heading


def expected(
    time: np.ndarray, rate: np.ndarray | None = None, simulated: np.ndarray | None = None
) -> np.ndarray:
    """Return how a heading is expected to go on, but for a constant.

    Args:
        time: of the samples (n,). [s]
        rate: measured yaw rate, NaN in gaps (n,). [degree/s]
        simulated: heading of a simulation, which is taken where the rate has a gap (n,). [degree]
    """
    steps = np.zeros(time.size - 1) if simulated is None else np.nan_to_num(np.diff(simulated))
    known = np.zeros(time.size, dtype=bool) if rate is None else np.isfinite(rate)
    if rate is not None and known.any():
        filled, span = np.interp(time, time[known], rate[known]), np.diff(time)
        is_measured = known[1:] & known[:-1] & (span < 2.0 * np.median(span))
        by_rate = 0.5 * (filled[1:] + filled[:-1]) * span
        steps = by_rate if simulated is None else np.where(is_measured, by_rate, steps)
    return np.concatenate([[0.0], np.cumsum(steps)])


def continuous(heading: np.ndarray, like: np.ndarray | None = None, turn: float = TURN) -> np.ndarray:
    """Return a heading without jumps of whole turns; gaps and implausible samples keep their places.

    Args:
        heading: as it was measured, NaN in gaps (n,).
        like: how it is expected to go on, `expected` (n,); as it stands if None.
        turn: a whole turn in the unit of both.
    """
    away = heading - (0.0 if like is None else like)
    sound = np.flatnonzero(np.isfinite(heading) & ~contradicted(heading, like, turn))
    if not sound.size:
        return heading
    turns = np.concatenate([[0.0], np.cumsum(-np.round(np.diff(away[sound]) / turn))])
    known = np.flatnonzero(np.isfinite(heading))
    before = np.maximum(np.searchsorted(sound, known, side="right") - 1, 0)
    extra = -np.round((away[known] - away[sound[before]]) / turn)
    found = heading.copy()
    found[known] += turn * (turns[before] + np.where(known == sound[before], 0.0, extra))
    return found


def contradicted(heading: np.ndarray, like: np.ndarray | None = None, turn: float = TURN) -> np.ndarray:
    """Return which samples lead away from those around them that join one another without them (n,); as
    `continuous`.
    """
    found, known = np.zeros(heading.size, dtype=bool), np.flatnonzero(np.isfinite(heading))
    away = (heading - (0.0 if like is None else like))[known]
    if away.size < FIRST:
        return found
    steps = np.abs(_on_circle(np.diff(away), turn))
    common = float(np.quantile(steps, COMMON_STEPS[0]))
    finest = float(np.min(np.abs(np.diff(heading[known])), where=steps > 0.0, initial=turn))
    jump = max(USUAL_STEPS * float(np.median(steps)), COMMON_STEPS[1] * max(common, finest))
    begins = np.flatnonzero(np.r_[True, steps > jump])
    if begins.size > 1:
        believed = _longest_chain(away, begins, jump, common, turn)
        found[known] = ~believed & _is_no_turn(away, heading[known], believed, jump, turn)
    return found


def _is_no_turn(
    away: np.ndarray, written: np.ndarray, believed: np.ndarray, jump: float, turn: float
) -> np.ndarray:
    """Say of doubted samples whether no vehicle did that (m,): a quick turn that a few samples catch is a measurement.

    Between the same two believed samples some point away from both by more than a right angle, as a needle's other end.
    Or numbers around lie on either side of north, where means of numbers are no means of angles, and a sample does not
    lie on the way from the one to the other.
    """
    sound, rows = np.flatnonzero(believed), np.arange(away.size)
    before = np.maximum(np.searchsorted(sound, rows, side="right") - 1, 0)
    after = np.minimum(np.searchsorted(sound, rows), sound.size - 1)
    apart = [np.abs(_on_circle(away - away[sound[side]], turn)) for side in (before, after)]
    way = np.abs(_on_circle(away[sound[after]] - away[sound[before]], turn))
    opposite = (np.minimum(*apart) > 0.25 * turn) & ~believed
    around = np.clip(np.arange(FIRST)[:, None] - FIRST // 2 + after, 0, sound.size - 1)
    crosses = np.ptp(written[sound[around]], axis=0) > 0.5 * turn
    bad: np.ndarray = np.isin(after, after[opposite]) | (crosses & (0.5 * (apart[0] + apart[1] - way) > jump))
    return bad


def _longest_chain(
    away: np.ndarray, begins: np.ndarray, jump: float, common: float, turn: float
) -> np.ndarray:
    """Return which samples are believed: those of the stretches that join one another and hold the most samples, and
    what lies before or behind all of them, unless it is a few samples (m,).
    """
    ends = np.r_[begins[1:], away.size]
    held, before = (ends - begins).astype(float), np.full(begins.size, -1)
    for j in range(1, begins.size):
        low = max(j - LOOKED_BACK, 0)
        apart = np.abs(_on_circle(away[begins[j]] - away[ends[low:j] - 1], turn))
        meanwhile = np.minimum(
            common * (begins[j] - ends[low:j]), 0.125 * turn
        )  # it may go on turning as it does
        joined = np.where(apart <= jump + meanwhile, held[low:j], 0.0)
        if joined.max() > 0.0:
            before[j] = low + int(np.argmax(joined))
            held[j] += joined.max()
    believed, at = np.zeros(away.size, dtype=bool), int(np.argmax(held))
    last = ends[at]
    while at >= 0:
        believed[begins[at] : ends[at]], first = True, begins[at]
        at = before[at]
    few = FIRST // 2
    believed[:first] |= first > few
    believed[last:] |= away.size - last > few
    return believed


def _on_circle(angle: np.ndarray, turn: float) -> np.ndarray:
    """Return angles without whole turns, within half a turn either way."""
    return angle - turn * np.round(angle / turn)
