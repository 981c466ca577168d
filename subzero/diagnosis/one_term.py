"""The simplest formulas that a force may have: one feature of the motion, throughout, in a window, or dying away.

A process over time costs evidence for every second in which it is free to change; a drag that grows all the time, or a
push that lasts for some seconds, is told by one number. Shapes are those of `shapes`, sensible ones for an axis first.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from subzero.diagnosis.evidence import log_sum
from subzero.diagnosis.formula import at_knots, samples_of
from subzero.diagnosis.latent import Terms
from subzero.diagnosis.problem import Problem
from subzero.diagnosis.shape_prior import all_shapes, shape_weight, size_of
from subzero.diagnosis.shapes import factors_along
from subzero.diagnosis.unknown import Knots
from subzero.external_force import AXES


def one_terms(problem: Problem, z: np.ndarray, knots: Knots) -> Mapping[str, Terms]:
    """Return axis → formulas of one term, each in one record, along the runs of z."""
    records = range(len(problem.records))
    parts = [_of_record(problem, z, knots, record) for record in records]
    phi = np.hstack([one for one, _ in parts])
    return {axis: Terms(phi, _normal([weights[axis] for _, weights in parts])) for axis in AXES}


def _of_record(
    problem: Problem, z: np.ndarray, knots: Knots, record: int
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the terms of a record at all knots (n, terms), 0 in other records, and axis → log weights (terms,)."""
    own = knots.record == record
    times = samples_of(float(knots.time[own][-1]))
    shapes = all_shapes(factors_along(problem.setting(record, z), times), times)
    single = [shape for shape in shapes if shape.columns.shape[1] == 1]
    phi = np.zeros((knots.time.size, len(single)))
    phi[own] = at_knots(times, knots.time[own]) @ np.hstack([one.columns / size_of(one) for one in single])
    return phi, {axis: np.array([shape_weight(one, axis) for one in single]) for axis in AXES}


def _normal(weights: list[np.ndarray]) -> np.ndarray:
    """Return log weights that sum to 1 in all."""
    every = np.concatenate(weights)
    return every - log_sum(every)
