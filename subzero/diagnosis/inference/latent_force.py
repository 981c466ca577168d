"""A latent force on one axis: as further parameters of the problem, and as short formulas; and the drift of a sensor.

    w(t) = Σ f_k Λ((t − t_k)/Δ) on one axis,   f ~ a Gaussian process        (Λ: hat function)

An effect like any other: its parameters are the knots f_k, or modes x of the process (f = L x, x ~ N(0, I)), so that
sensitivities and fits are those of `problem` and `map_fit`. Records have histories of their own. A drift is the same
in one channel, without a simulation. `input_estimation` estimates both.

A Gaussian process costs evidence for every second in which it is free to change; a drag that grows all the time, or a
push that lasts for some seconds, has one number. So there is a dictionary of formulas, with prior probabilities:

    φ(t) = feature(state(t)) · window(t),     window = 1,  [t ≥ t₀],  [t₀ ≤ t < t₁],  Λ(t₀ … t₁),  exp(−t/T);
    or  cos ωt, sin ωt                        (Λ: rising to the middle, and falling)

Features are those of `external_force`, along a fitted track; those that usually act along an axis have a larger
prior.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

import vehicle
from subzero.diagnosis.hypothesis.configuration import LENGTH, RUDDER, WATER
from subzero.diagnosis.hypothesis.effect import Effect, Parameter
from subzero.diagnosis.hypothesis.hypotheses import Entry
from subzero.diagnosis.inference.simulator import simulate_track
from subzero.diagnosis.results import WAVE
from subzero.external_force import AXES, FACTORS, FEATURES, MissingForce, feature_value, fill_factors
from vehicle.dynamics import relative_velocity
from vehicle.kinematics import rotation
from vehicle.motor import shaft_speed
from vehicle.state import CHARGE, SHAFT

if TYPE_CHECKING:
    from subzero.diagnosis.hypothesis.configuration import Setting
    from subzero.diagnosis.inference.problem import Problem

COARSE_SPACING_S, FINE_SPACING_S = 2.0, 1.0
"""Spacing of the knots: to screen forces, and to estimate a history. [s]"""
AXIS_WORDS = {
    "X": "forward force",
    "Y": "force to starboard",
    "Z": "downward force",
    "K": "moment that rolls it to starboard",
    "M": "moment that raises the nose",
    "N": "moment that turns it to starboard",
}
"""Effect of a positive force or moment on the vehicle."""
FORCE, DRIFT = "unknown_force:", "sensor_drift:"
MAX_DRIFT_LEVELS = 20.0
"""Largest drift, in usual noise levels of the sensor; a wander of one level is noise."""
SHAPE_STEP_S = 0.1
"""Sampling step of shapes. [s]"""
DECAY_TIMES_S = (3.0, 6.0, 12.0)
"""Times in which a force dies away. [s]"""
WAVE_PERIODS_S = (1.5, 12.0)
"""Shortest and longest period of waves; frequencies in between are a quarter of a turn of the trial apart. [s]"""
SWITCHED = ("constant", "u|u|", "n|n|", "n u", "rudder_angle*u2", "stern_plane*u2")
"""Features that may begin, end or die away; features that grow by themselves (time, length, depth) or respond (sway)
do not.
"""
EDGE_NUDGES_S = (-0.8, -0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6, 0.8)
"""By how much edges of windows are moved in the end. [s]"""
MIN_WINDOW_S = 1.0
"""No window is shorter. [s]"""
ZERO_SIZE = 1e-9
"""A shape that is nowhere larger is zero."""


class Knots(NamedTuple):
    """Where histories have their knots: record and time [s] of each (n,), and their spacing. [s]"""

    record: np.ndarray
    time: np.ndarray
    spacing: float


def knots_of(problem: Problem, spacing: float = COARSE_SPACING_S) -> Knots:
    """Return knots over all records, from start to end of each."""
    ends = [float(each.time[-1]) for each in problem.records]
    times = [np.linspace(0.0, end, max(round(end / spacing), 1) + 1) for end in ends]
    record = np.repeat(np.arange(len(times)), [time.size for time in times])
    return Knots(record, np.concatenate(times), spacing)


def typical_force(setting: Setting, axis: str) -> float:
    """Return the size of a usual force on an axis: the hull's drag at 1 m/s; a moment by a lever. [N, N m]"""
    hull = setting.model.vehicle.numbers()
    drag = hull.axial_drag or _drag_of_damping(hull)
    lever = {"K": 0.02, "M": 0.1, "N": 0.1}.get(axis, 1.0)
    return drag * lever


def _drag_of_damping(hull: vehicle.VehicleNumbers) -> float:
    """Return the drag at 1 m/s of a hull whose drag is all stated as damping. [N]"""
    linear = abs(hull.linear_damping[0]) + abs(hull.linear_table[0, 0])
    return float(linear + abs(hull.quadratic_damping[0]) + abs(hull.quadratic_table[0, 0]))


def with_missing_force(setting: Setting, force: MissingForce) -> Setting:
    """Return a setting with a missing force, from the start to the end."""
    later = tuple((time, replace(model, missing=force + model.missing)) for time, model in setting.later)
    return replace(setting.with_model(missing=force + setting.model.missing), later=later)


def history(axis: str, times: np.ndarray, force: np.ndarray) -> MissingForce:
    """Return a missing force with a history (n,) on one axis only. [N, N m]"""
    wrench = np.zeros((times.size, len(AXES)))
    wrench[:, AXES.index(axis)] = force
    return MissingForce(time=tuple(times.tolist()), wrench=tuple(map(tuple, wrench.tolist())))


def _push(axis: str, times: np.ndarray, L: np.ndarray, setting: Setting, *amounts: float) -> Setting:
    return with_missing_force(setting, history(axis, times, L @ np.array(amounts)))


def force_effect(axis: str, times: np.ndarray, L: np.ndarray, size: float) -> Effect:
    """Return the effect of a force with history L x at knots, L lower triangular; parameters x (n,), of a size."""
    begins = [0.0, *times[:-1].tolist()]
    parameters = tuple(
        Parameter(name=f"knot_{i}", unit="1", tolerance=size, scale=size, begins=begins[i])
        for i in range(L.shape[1])
    )
    sentence = f"a {AXIS_WORDS[axis]} acts that no cause explains"
    return Effect(
        id=FORCE + axis,
        sentence=sentence,
        slot="hull",
        parameters=parameters,
        apply=partial(_push, axis, times, L),
    )


def with_force(problem: Problem, axis: str, knots: Knots, L: np.ndarray, size: float) -> Problem:
    """Return the problem with a force's knots appended to its entries, L (n, n) within each record."""
    added: list[Entry] = []
    for record in range(len(problem.records)):
        own = knots.record == record
        effect = force_effect(axis, knots.time[own], L[np.ix_(own, own)], size)
        added += [Entry(effect, i, record) for i in range(int(own.sum()))]
    return replace(problem, entries=(*problem.entries, *added))


def force_columns(
    problem: Problem, z: np.ndarray, axes: Iterable[str], knots: Knots
) -> dict[str, np.ndarray]:
    """Return axis → whitened sensitivities (m, n) of the simulation to a force of 1 N (1 N m) at each knot, in coarse
    steps.
    """
    axes, more, eye = list(axes), problem.roughly(z), np.eye(knots.time.size)
    for axis in axes:
        more = with_force(more, axis, knots, eye, 0.5 * typical_force(problem.records[0].setting, axis))
    there = np.concatenate([z, np.zeros(len(axes) * knots.time.size)])
    J = more.jacobian(there, range(z.size, there.size))[:, z.size :]
    return dict(zip(axes, np.split(J, len(axes), axis=1), strict=True))


def drift_columns(problem: Problem, channel: str, knots: Knots) -> np.ndarray:
    """Return the whitened sensitivities (m, n) to a drift of one unit at each knot; of one channel, without runs."""
    rows: list[np.ndarray] = []
    for record, each in enumerate(problem.records):
        own = np.where(knots.record == record, 1.0, 0.0)
        apart = np.abs(np.subtract.outer(each.time, knots.time)) / knots.spacing
        hats = np.maximum(1.0 - apart, 0.0) * own
        rows += [noise.whiten(hats if name == channel else 0.0 * hats) for name, noise in each.noise.items()]
    return np.concatenate(rows)


@dataclass(frozen=True, kw_only=True, eq=False)
class Shape:
    """One term of a formula.

    Attributes:
        feature: of FEATURES, or WAVE.
        words: its description.
        columns: φ at the samples (n, 1), or (n, 2) for a wave.
        start, end: of its window; None if it holds throughout. [s]
        decay: time in which it dies away; 0 if it does not. [s]
        is_gradual: it rises and falls between start and end.
        log_prior: relative to its plain feature, by the number of its windows.
    """

    feature: str
    words: str
    columns: np.ndarray
    start: float | None = None
    end: float | None = None
    decay: float = 0.0
    is_gradual: bool = False
    log_prior: float = 0.0

    @property
    def is_plain(self) -> bool:
        """Whether it is a feature that holds throughout, and so can be a term of a model."""
        return self.feature in FEATURES and self.start is None and self.decay == 0.0


def factors_along(setting: Setting, times: np.ndarray) -> np.ndarray:
    """Return the factors of features (n, len(FACTORS)) along the run of a setting, at times (n,). [s]"""
    grid, track = simulate_track(setting)
    rows = track[np.searchsorted(grid, times + 1e-9, side="right") - 1]
    commands = setting.trial.commands
    assert commands is not None
    reported = commands.at(times)
    found, numbers = np.zeros((times.size, len(FACTORS))), setting.model.vehicle.numbers()
    R, nu_r = np.zeros((3, 3)), np.zeros(6)
    for out, row, command, time in zip(found, rows, reported, times, strict=True):
        state = np.ascontiguousarray(row[: vehicle.STATE_SIZE])
        rotation(state[3:7], R)
        relative_velocity(state, R, np.ascontiguousarray(row[WATER : WATER + 3]), nu_r)
        n = shaft_speed(state[SHAFT], state[CHARGE], command[0], nu_r[0], numbers.motor, numbers.propeller)
        _, port, starboard = vehicle.deflections(state, command, numbers)
        fill_factors(nu_r, n, row[RUDDER], 0.5 * (port + starboard), row[LENGTH], time, state[2], out)
    return found


def plain_shapes(factors: np.ndarray) -> list[Shape]:
    """Return every feature, as it holds throughout; without those that are 0."""
    found = [
        Shape(feature=name, words=feature.words, columns=feature_value(name, factors)[:, None])
        for name, feature in FEATURES.items()
    ]
    return _acting(found)


def windowed(shape: Shape, times: np.ndarray, edges: np.ndarray) -> list[Shape]:
    """Return a plain shape from every edge on, and between any two of them [s]: at once, or rising and falling."""
    pairs = [(a, b) for a in edges for b in edges if b - a >= MIN_WINDOW_S]
    log_prior = -float(np.log(2.0 * edges.size + 2.0 * len(pairs)))
    found = [
        _between(shape, times, a, None, log_prior + np.log(len(pairs) / edges.size)) for a in edges if a > 0.0
    ]
    each = log_prior - np.log(2.0)
    found += [kind(shape, times, a, b, each) for a, b in pairs for kind in (_between, _gradual)]
    return _acting(found)


def shifted(shape: Shape, plain: Shape, times: np.ndarray) -> list[Shape]:
    """Return a windowed shape with its edges moved by less than the grid that they were found on, where it is
    not 0.
    """
    if shape.start is None or shape.decay:
        return [shape]
    starts = [shape.start + by for by in EDGE_NUDGES_S]
    if shape.end is None:
        return _acting([_between(plain, times, start, None, shape.log_prior) for start in starts])
    kind, ends = _gradual if shape.is_gradual else _between, [shape.end + by for by in EDGE_NUDGES_S]
    return _acting([kind(plain, times, a, b, shape.log_prior) for a in starts for b in ends if b > a])


def _acting(shapes: list[Shape]) -> list[Shape]:
    """Return the shapes that are not 0 throughout."""
    return [shape for shape in shapes if np.abs(shape.columns).max() > ZERO_SIZE]


def _between(shape: Shape, times: np.ndarray, start: float, end: float | None, log_prior: float) -> Shape:
    last = np.inf if end is None else end
    inside = np.where((times >= start - 1e-9) & (times < last - 1e-9), 1.0, 0.0)
    when = f"from {start:g} s on" if end is None else f"from {start:g} to {end:g} s"
    return Shape(
        feature=shape.feature,
        words=f"{shape.words}, {when}",
        columns=shape.columns * inside[:, None],
        start=float(start),
        end=None if end is None else float(end),
        log_prior=float(log_prior),
    )


def _gradual(shape: Shape, times: np.ndarray, start: float, end: float, log_prior: float) -> Shape:
    """Return a shape that rises to the middle between two times and falls: few pushes begin and end abruptly."""
    apart = np.abs(times - 0.5 * (start + end)) / (0.5 * (end - start))
    when = f"rising and falling from {start:g} to {end:g} s"
    return Shape(
        feature=shape.feature,
        words=f"{shape.words}, {when}",
        start=float(start),
        end=float(end),
        columns=shape.columns * np.maximum(1.0 - apart, 0.0)[:, None],
        is_gradual=True,
        log_prior=float(log_prior),
    )


def decaying(shape: Shape, times: np.ndarray, edges: np.ndarray) -> list[Shape]:
    """Return a plain shape that begins at an edge and dies away, in several times."""
    log_prior = -float(np.log(8.0 * len(DECAY_TIMES_S)))
    found = [_dying(shape, times, 0.0, T, log_prior) for T in DECAY_TIMES_S]
    found += [
        _dying(shape, times, edge, T, log_prior - np.log(edges.size))
        for T in DECAY_TIMES_S
        for edge in edges[1:]
    ]
    return _acting(found)


def _dying(shape: Shape, times: np.ndarray, start: float, T: float, log_prior: float) -> Shape:
    """Return exp(−(t − start)/T) times a shape, 0 before the start."""
    window = np.where(times >= start - 1e-9, np.exp(-np.maximum(times - start, 0.0) / T), 0.0)
    when = f"from {start:g} s on, dying away in {T:g} s" if start else f"dying away in {T:g} s"
    return Shape(
        feature=shape.feature,
        words=f"{shape.words}, {when}",
        columns=shape.columns * window[:, None],
        start=float(start) or None,
        decay=T,
        log_prior=float(log_prior),
    )


def waves(times: np.ndarray) -> list[Shape]:
    """Return waves of several periods, of any phase."""
    apart = 0.25 / (times[-1] - times[0])
    periods = 1.0 / np.arange(1.0 / WAVE_PERIODS_S[1], 1.0 / WAVE_PERIODS_S[0], apart)
    log_prior = -float(np.log(periods.size))
    return [
        Shape(
            feature=WAVE,
            words=f"a wave with a period of {period:.2g} s",
            log_prior=log_prior,
            columns=np.column_stack([trig(2.0 * np.pi * times / period) for trig in (np.cos, np.sin)]),
        )
        for period in periods
    ]


def samples_of(end: float) -> np.ndarray:
    """Return the times that shapes are sampled at. [s]"""
    return np.arange(0.0, end + 0.5 * SHAPE_STEP_S, SHAPE_STEP_S)


def at_knots(times: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Return the matrix (knots, times) that turns values at times into those of the hat functions closest to them."""
    spacing = knots[1] - knots[0]
    hats = np.maximum(1.0 - np.abs(np.subtract.outer(times, knots)) / spacing, 0.0)
    return np.linalg.pinv(hats)


SENSIBLE_FEATURES: Mapping[str, tuple[str, ...]] = {
    "X": ("u|u|", "constant", "n|n|", "n u", "wet_length*u2", "wet_length", "time*u2"),
    "Y": ("uv", "ur", "constant", "rudder_angle*u2", "v|v|", "u|u|"),
    "Z": ("constant", "time", "uw", "uq", "stern_plane*u2", "w|w|", "u|u|", "depth"),
    "K": ("n|n|", "constant", "p|p|", "u|u|"),
    "M": ("uw", "uq", "constant", "stern_plane*u2", "q|q|", "u|u|"),
    "N": ("uv", "ur", "rudder_angle*u2", "r|r|", "constant", "u|u|", "n|n|"),
}
"""Features that usually act along an axis, and therefore have a larger prior."""
ODD_FEATURE_PRIOR, WAVE_PRIOR = 0.25, 0.01
"""Priors of another feature, and of a wave, relative to a usual one. A swell gains 20 nats and more; the noise of a
real sensor that swings a little gains 5.
"""


def all_shapes(factors: np.ndarray, times: np.ndarray) -> list[Shape]:
    """Return every shape that is tried, from the factors of features at times."""
    plain = plain_shapes(factors)
    edges = np.arange(0.0, times[-1], 1.0 if times[-1] < 40.0 else 2.0)
    able = [record for record in plain if record.feature in SWITCHED]
    parts = [[*windowed(record, times, edges), *decaying(record, times, edges)] for record in able]
    return plain + [shape for part in parts for shape in part] + waves(times)


def size_of(shape: Shape) -> float:
    """Return the size of a shape where it is not 0."""
    inside = np.any(shape.columns != 0.0, axis=1)
    return float(np.sqrt(np.mean(shape.columns[inside] ** 2)))


def shape_weight(shape: Shape, axis: str) -> float:
    """Return the log prior of a shape along an axis, up to a common constant."""
    odd = WAVE_PRIOR if shape.feature == WAVE else ODD_FEATURE_PRIOR
    return shape.log_prior + (0.0 if shape.feature in SENSIBLE_FEATURES[axis] else float(np.log(odd)))
