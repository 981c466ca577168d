"""A latent force on one axis as further parameters of the problem; and the drift of a sensor.

    w(t) = Σ f_k Λ((t − t_k)/Δ) on one axis,   f ~ a Gaussian process        (Λ: hat function)

An effect like any other: its parameters are the knots f_k, or modes x of the process (f = L x, x ~ N(0, I)), so that
sensitivities and fits are those of `problem` and `map_fit`. Records have histories of their own. A drift is the same in
one channel, without a simulation. How probable either is, `input_estimation` finds.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from subzero.diagnosis.hypothesis.effect import Effect, Parameter
from subzero.diagnosis.hypothesis.hypotheses import Entry
from subzero.external_force import AXES, MissingForce

if TYPE_CHECKING:
    from subzero.diagnosis.hypothesis.configuration import Setting
    from subzero.diagnosis.inference.problem import Problem

COARSE_SPACING_S, FINE_SPACING_S = 2.0, 1.0
"""Of knots: to look for a force, and to tell its history. [s]"""
AXIS_WORDS = {
    "X": "forward force", "Y": "force to starboard", "Z": "downward force",
    "K": "moment that rolls it to starboard", "M": "moment that raises the nose",
    "N": "moment that turns it to starboard",
}  # fmt: skip
"""What a positive force or moment does to the vehicle."""
FORCE, DRIFT = "unknown_force:", "sensor_drift:"
MAX_DRIFT_LEVELS = 20.0
"""A drift can be this many usual noise levels of the sensor; a wander of one level is noise."""


class Knots(NamedTuple):
    """Where histories have their knots: record and time [s] of each (n,), and their spacing. [s]"""

    record: np.ndarray
    time: np.ndarray
    spacing: float


def knots_of(problem: Problem, spacing: float = COARSE_SPACING_S) -> Knots:
    """Return knots over all records, from start to end of each."""
    ends = [float(one.time[-1]) for one in problem.records]
    times = [np.linspace(0.0, end, max(round(end / spacing), 1) + 1) for end in ends]
    record = np.repeat(np.arange(len(times)), [one.size for one in times])
    return Knots(record, np.concatenate(times), spacing)


def usual_force(setting: Setting, axis: str) -> float:
    """Return the size of a usual force on an axis: the hull's drag at 1 m/s; a moment by a lever. [N, N m]"""
    drag = setting.model.vehicle.numbers().axial_drag
    lever = {"K": 0.02, "M": 0.1, "N": 0.1}.get(axis, 1.0)
    return drag * lever


def without_force(setting: Setting, force: MissingForce) -> Setting:
    """Return a setting with a missing force, from the start to the end."""
    later = tuple((time, replace(model, missing=force + model.missing)) for time, model in setting.later)
    return replace(setting.with_model(missing=force + setting.model.missing), later=later)


def history(axis: str, times: np.ndarray, force: np.ndarray) -> MissingForce:
    """Return a missing force with a history (n,) on one axis only. [N, N m]"""
    wrench = np.zeros((times.size, len(AXES)))
    wrench[:, AXES.index(axis)] = force
    return MissingForce(time=tuple(times.tolist()), wrench=tuple(map(tuple, wrench.tolist())))


def _push(axis: str, times: np.ndarray, L: np.ndarray, setting: Setting, *amounts: float) -> Setting:
    return without_force(setting, history(axis, times, L @ np.array(amounts)))


def force_effect(axis: str, times: np.ndarray, L: np.ndarray, size: float) -> Effect:
    """Return the effect of a force with history L x at knots, L lower triangular; parameters x (n,), of a size."""
    begins = [0.0, *times[:-1].tolist()]
    parameters = tuple(
        Parameter(name=f"knot_{i}", unit="1", tolerance=size, scale=size, begins=begins[i])
        for i in range(L.shape[1])
    )
    sentence = f"a {AXIS_WORDS[axis]} acts that no cause explains"
    return Effect(id=FORCE + axis, sentence=sentence, slot="hull", parameters=parameters,
                  apply=partial(_push, axis, times, L))  # fmt: skip


def with_force(problem: Problem, axis: str, knots: Knots, L: np.ndarray, size: float) -> Problem:
    """Return the problem with a force's knots behind its entries, L (n, n) within each record."""
    added: list[Entry] = []
    for record in range(len(problem.records)):
        own = knots.record == record
        effect = force_effect(axis, knots.time[own], L[np.ix_(own, own)], size)
        added += [Entry(effect, i, record) for i in range(int(own.sum()))]
    return replace(problem, entries=(*problem.entries, *added))


def force_columns(
    problem: Problem, z: np.ndarray, axes: Iterable[str], knots: Knots
) -> dict[str, np.ndarray]:
    """Return axis → whitened sensitivities (m, n) of what is simulated to a force of 1 N (1 N m) at each knot, in rough
    steps.
    """
    axes, more, eye = list(axes), problem.roughly(z), np.eye(knots.time.size)
    for axis in axes:
        more = with_force(more, axis, knots, eye, 0.5 * usual_force(problem.records[0].setting, axis))
    there = np.concatenate([z, np.zeros(len(axes) * knots.time.size)])
    J = more.jacobian(there, range(z.size, there.size))[:, z.size :]
    return dict(zip(axes, np.split(J, len(axes), axis=1), strict=True))


def drift_columns(problem: Problem, channel: str, knots: Knots) -> np.ndarray:
    """Return the whitened sensitivities (m, n) to a drift of one unit at each knot; of one channel, without runs."""
    rows: list[np.ndarray] = []
    for record, one in enumerate(problem.records):
        own = np.where(knots.record == record, 1.0, 0.0)
        apart = np.abs(np.subtract.outer(one.time, knots.time)) / knots.spacing
        hats = np.maximum(1.0 - apart, 0.0) * own
        rows += [noise.whiten(hats if name == channel else 0.0 * hats) for name, noise in one.noise.items()]
    return np.concatenate(rows)


def all_columns(problem: Problem, z: np.ndarray, knots: Knots) -> dict[str, np.ndarray]:
    """Return id → columns of a force on every axis and of a drift of every channel."""
    forces = {FORCE + axis: C for axis, C in force_columns(problem, z, AXES, knots).items()}
    channels = problem.records[0].noise
    return {**forces, **{DRIFT + channel: drift_columns(problem, channel, knots) for channel in channels}}
