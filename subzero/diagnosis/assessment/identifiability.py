"""Identifiability before records are searched: signal and discrimination of every cause.

    G = information of two causes with all other tolerances free
    signal² = sᵀ G_aa s,    D(a|b) = sᵀ (G_aa − G_ab (G_bb + 1/s_b²)⁻¹ G_ba) s,    D = min over b

D is twice the expected log evidence by which the data prefer a to b: below 9 they cannot be distinguished, from 16 on
they can. A cause of another size v has (v/s)² times as much.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from subzero.diagnosis.hypothesis.hypotheses import Entry, columns_of, is_flat, nameable
from subzero.diagnosis.results import Detectability

if TYPE_CHECKING:
    from subzero.diagnosis.inference.problem import Problem

SEEN_SIGNAL = 4.0
"""Least detectable signal."""


def with_whole_effects(problem: Problem, J: np.ndarray, z: np.ndarray | None = None) -> np.ndarray:
    """Return sensitivities at z (the nominal model, if none); for causes that have no effect when small, those of a
    whole effect without any other: they would act instead of others, not in addition to them.
    """
    zero = np.zeros(len(problem.entries))
    here, J = zero if z is None else z, J.copy()
    flat = [k for k, entry in enumerate(problem.entries) if _is_flat(entry, here[k], J[:, k])]
    scales = [problem.entries[k].parameter.scale for k in flat]
    moved = [
        np.concatenate([zero[:k], [scale], zero[k + 1 :]]) for k, scale in zip(flat, scales, strict=True)
    ]
    r, *there = problem.residuals([zero, *moved])
    for k, scale, r_k in zip(flat, scales, there, strict=True):
        J[:, k] = np.nan_to_num(r - r_k) / scale
    return J


def _is_flat(entry: Entry, value: float, column: np.ndarray) -> bool:
    """Say whether a parameter at its bound seems to have no effect."""
    parameter = entry.parameter
    at_rest = entry.record < 0 and parameter.low == 0.0 and value < parameter.tolerance
    return at_rest and is_flat(entry, column)


def marginal(problem: Problem, J: np.ndarray, kappa: float = 1.0) -> np.ndarray:
    """Return the covariance of all entries under data and tolerances (k, k)."""
    tolerance = np.array([kappa * entry.parameter.tolerance for entry in problem.entries])
    scaled = tolerance[:, None] * (J.T @ J) * tolerance + np.eye(tolerance.size)
    return tolerance[:, None] * np.linalg.inv(scaled) * tolerance


def information(problem: Problem, M: np.ndarray, at: list[int], kappa: float = 1.0) -> np.ndarray:
    """Return the information of the data alone on some entries (n, n), all others within tolerance, from the
    covariance M of all under the same κ.
    """
    tolerance = np.array([kappa * problem.entries[k].parameter.tolerance for k in at])
    return np.linalg.inv(M[np.ix_(at, at)]) - np.diag(1.0 / tolerance**2)


def against(
    problem: Problem, M: np.ndarray, own: list[int], step: np.ndarray, other: list[int], kappa: float = 1.0
) -> tuple[float, float]:
    """Return D of a step (n,) of its own entries against other entries, and how similar they are (0 to 1)."""
    G = information(problem, M, own + other, kappa)
    n = len(own)
    scale = np.array([problem.entries[k].parameter.scale for k in other])
    cross = step @ G[:n, n:]
    answer = np.linalg.solve(G[n:, n:] + np.diag(1.0 / scale**2), cross)
    whole = float(step @ G[:n, :n] @ step)
    alike = np.linalg.lstsq(G[n:, n:], cross, rcond=None)[0] @ cross
    return max(whole - float(cross @ answer), 0.0), float(np.sqrt(max(alike, 0.0) / max(whole, 1e-300)))


def detectability(problem: Problem, J: np.ndarray) -> tuple[Detectability, ...]:
    """Return the detectability of every cause, at one effect scale, the weakest first."""
    M = marginal(problem, J)
    found = [_of(problem, M, J, each, nameable(problem.entries)) for each in nameable(problem.entries)]
    return tuple(sorted(found, key=lambda each: each.discrimination))


def _of(problem: Problem, M: np.ndarray, J: np.ndarray, name: str, others: list[str]) -> Detectability:
    """Return the detectability of a cause: of its parameter with the greatest signal."""
    at = columns_of(problem.entries, (name,))
    signals = {k: _signal(problem, M, k) for k in at}
    step = np.array(
        [problem.entries[k].parameter.scale if signals[k] == max(signals.values()) else 0.0 for k in at]
    )
    ranked = sorted(
        (
            (*against(problem, M, at, step, columns_of(problem.entries, (other,))), other)
            for other in others
            if other != name
        ),
        key=lambda triple: triple[0],
    )
    D, cosine, rival = ranked[0] if ranked else (max(signals.values()) ** 2, 0.0, "none")
    return Detectability(
        id=name,
        signal=max(signals.values()),
        smallest={
            problem.entries[k].parameter.name: SEEN_SIGNAL
            * problem.entries[k].parameter.scale
            / max(signals[k], 1e-9)
            for k in at
        },
        rival=rival,
        discrimination=D,
        cosine=cosine,
        units={problem.entries[k].parameter.name: problem.entries[k].parameter.unit for k in at},
    )


def _signal(problem: Problem, M: np.ndarray, k: int) -> float:
    """Return the size of one effect scale of an entry, in standard deviations."""
    scale = problem.entries[k].parameter.scale
    return float(scale * np.sqrt(max(information(problem, M, [k])[0, 0], 0.0)))


def separation(
    problem: Problem,
    J: np.ndarray,
    z: np.ndarray,
    ids: tuple[str, ...],
    kappa: float = 1.0,
    refuted: Collection[str] = (),
) -> tuple[float, str]:
    """Return D of causes as they are in z against their closest rival, and that rival ("none": the tolerances),
    without those that are `refuted`.
    """
    M = marginal(problem, J, kappa)
    own = columns_of(problem.entries, ids)
    whole = float(z[own] @ information(problem, M, own, kappa) @ z[own])
    best, who = whole, "none"
    for other in nameable(problem.entries):
        if other not in ids and other not in refuted:
            D = against(problem, M, own, z[own], columns_of(problem.entries, (other,)), kappa)[0]
            best, who = (D, other) if best > D else (best, who)
    return best, who
