"""What a missing force is made of: a short sum of shapes, w(t) = Σ c_j φ_j(t), as a value and as a part of a model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from subzero.diagnosis.shapes import SAMPLE, Shape
from subzero.diagnosis.unknown import history
from subzero.external_force import MissingForce, Term

NORMAL = 1.96


@dataclass(frozen=True, kw_only=True, eq=False)
class Formula:
    """A short sum.

    Attributes:
        axis: it acts on.
        shapes: its terms, the largest first.
        coefficients: of each (columns of its shape,), with covariance, in the order of all columns.
        covariance: of them (columns, columns).
        log_gain: log evidence over that of no force; with what prior says of features.
        features: feature → probability that it belongs to the formula, most probable first.
    """

    axis: str
    shapes: tuple[Shape, ...]
    coefficients: tuple[np.ndarray, ...]
    covariance: np.ndarray
    log_gain: float
    features: Mapping[str, float]

    def terms(self) -> tuple[tuple[str, str, float, float, float], ...]:
        """Return (words, feature, coefficient, low, high) of every term; of a wave its amplitude."""
        found, at = [], 0
        for shape, c in zip(self.shapes, self.coefficients, strict=True):
            own = self.covariance[at : at + c.size, at : at + c.size]
            size = float(c[0]) if c.size == 1 else float(np.linalg.norm(c))
            along = c / size if size else np.eye(c.size)[0]
            sd = float(np.sqrt(along @ own @ along))
            found.append((shape.words, shape.feature, size, size - NORMAL * sd, size + NORMAL * sd))
            at += c.size
        return tuple(found)

    def force(self) -> np.ndarray:
        """Return the force at the samples (n,). [N, N m]"""
        return np.sum([s.columns @ c for s, c in zip(self.shapes, self.coefficients, strict=True)], axis=0)


def as_missing(formula: Formula) -> MissingForce:
    """Return a formula as a part of a model: plain features as terms, all others as a history of this very trial."""
    terms, rest = [], np.zeros(formula.shapes[0].columns.shape[0])
    for shape, c in zip(formula.shapes, formula.coefficients, strict=True):
        if shape.is_plain:
            terms.append(Term(formula.axis, shape.feature, float(c[0])))
        else:
            rest = rest + shape.columns @ c
    told = history(formula.axis, SAMPLE * np.arange(rest.size), rest) if np.any(rest) else MissingForce()
    return told + MissingForce(terms=tuple(terms))


def samples_of(end: float) -> np.ndarray:
    """Return the times that shapes are sampled at. [s]"""
    return np.arange(0.0, end + 0.5 * SAMPLE, SAMPLE)


def at_knots(times: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Return the matrix (knots, times) that turns values at times into those of the hat functions closest to them."""
    spacing = knots[1] - knots[0]
    hats = np.maximum(1.0 - np.abs(np.subtract.outer(times, knots)) / spacing, 0.0)
    return np.linalg.pinv(hats)
