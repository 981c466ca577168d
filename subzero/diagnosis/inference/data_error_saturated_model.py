"""The saturated model of a record: all parameters free at once, the most that physics may explain of it, or of one
without an error.

All parameters are free at once under wide priors, each as far as a cause may go, in the linear problem at the nominal
model; and every channel has a free scale of its noise, so that a misfit which a linear model cannot follow gives its
channel less weight, instead of distorting the parameters:

    G = max over s of  log N(W y; W h, s² I + J D Jᵀ) − Σ n_c log s_c,      D = (max(size of a cause, 4 τ))²

In addition there is the evidence of no cause and of single causes within wide tolerances. Only other commands are
simulated: at first the nominal model alone, and with all sensitivities where they may be the true ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotri

from scenarios.heading import turned
from subzero.channels import HEADING
from subzero.diagnosis.hypothesis.configuration import Setting, sensed, truth
from subzero.diagnosis.hypothesis.data_error import REPEATED, DataError, corrected, places
from subzero.diagnosis.hypothesis.hypotheses import PRIOR, columns_of, nameable, variances
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.hypothesis.noise import (
    Between,
    Noise,
    SensorPrior,
    innovations_between,
    level_of,
    log_of_outlier,
    log_of_outliers,
    prior_noise,
    sensor_prior,
    spikes,
)
from subzero.diagnosis.inference.linear_gaussian import KAPPAS, Posterior, each_freed, log_sum, precision
from subzero.diagnosis.inference.posing import pose
from subzero.diagnosis.inference.problem import Problem
from subzero.diagnosis.inference.simulator import Track, simulate_track

KAPPA_NARROW = 2.0
"""Widening κ of the declared tolerances where a single cause is free: the linear problem is no more accurate."""
LEAST_SCALE, MOST_SCALE, ROUNDS, SETTLED = 0.3, 1e4, 5, 0.01
"""Bounds of the scale of a channel's noise; most re-estimates of the scales after the parameters; the relative change
below which they have converged: a hundredth costs less than 0.1 nats, as the best scales are stationary. The scale of
a rounded channel is never so small that a sample has a density above 1/q, which is a probability of 1.
"""
LOUD = 2.5
"""Noise of more than this many usual levels hides a misfit. [-]"""
BESIDE_JUMP = 10
"""Number of samples before and after a jump that its size is measured from."""
CAUSES_TRIED = 3
"""Number of causes, the best in the linear problem, for which the scales of the noise are estimated."""


class Term(NamedTuple):
    """A channel's whitened information on the parameters: JᵀJ, Jᵀr, |r|²; number of samples; ½ log det of their noise
    with the cost of outliers; the least scale of its noise; and the number of measured samples, with outliers.
    """

    A: np.ndarray
    b: np.ndarray
    rr: float
    samples: int
    fixed: float
    least: float
    measured: int


class Evidence(NamedTuple):
    """The evidence of the saturated model, the parameters (k,) and their covariance, and the scale of the noise of
    each channel.
    """

    log: float
    z: np.ndarray
    M: np.ndarray
    scales: dict[str, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class SaturatedModel:
    """The nominal model and its sensitivities along a record: its predictions at any time, with all parameters free.

    Attributes:
        logged: the record as it is assumed to be, but for the errors that are corrected in it.
        written: the record as it is.
        step: between times of the prediction, from 0 on. [s]
        nominal: channel → prediction of the nominal model (g,), by the linearisation at z. [display unit]
        slopes: channel → sensitivities to all parameters (g, k).
        D: wide prior variances: every cause at once (k,).
        narrow: prior variances of wide tolerances (k,).
        causes: places of the parameters of each cause.
        scales: channel → the place of the scale of its sensor, if that is a cause.
        z: the linearisation point (k,).
        setting: of its simulations there.
        repeated: values that it repeats, which may be a channel that is rounded and stands still.
        corrected: errors that are corrected in it already.
        place: among those, where a further error is corrected; after them all if not given.
        clock: a clock that is late by less than an error, if any: a cause, which is corrected after all errors.
        kept: predictions under other commands.
        others: commands → the saturated model under them, with sensitivities of its own.
    """

    logged: Logged
    written: Logged
    step: float
    nominal: Mapping[str, np.ndarray]
    slopes: Mapping[str, np.ndarray]
    D: np.ndarray
    narrow: np.ndarray
    causes: Sequence[Sequence[int]]
    scales: Mapping[str, int]
    z: np.ndarray
    setting: Setting
    repeated: tuple[DataError, ...] = ()
    corrected: tuple[DataError, ...] = ()
    place: int | None = None
    clock: tuple[DataError, ...] = ()
    kept: dict[str, Mapping[str, np.ndarray]] = field(default_factory=dict)
    others: dict[bytes, SaturatedModel] = field(default_factory=dict)

    def without(self, error: DataError) -> Logged:
        """Return the record without a further error: the times of a value that it repeats are those that were
        written.
        """
        if self.is_last(error):
            return error.corrected(self.logged)
        return corrected(self.written, (*self.corrected[: self.place], error, *self._later))

    def after(self, errors: Sequence[DataError], place: int | None = None) -> SaturatedModel:
        """Return the saturated model of the written record without some errors, where a further one is corrected at a
        place among them; with other commands it has sensitivities of its own.
        """
        every, here = (*errors, *self.clock), len(errors) if place is None and self.clock else place
        base = self.under(corrected(self.written, every))
        return replace(
            base, written=self.written, repeated=self.repeated, corrected=every, place=here, clock=self.clock
        )

    def with_scale_held(self, channels: Iterable[str]) -> SaturatedModel:
        """Return the same with the scales of some sensors within tolerances: a unit and a scale that undoes it are no
        error at all.
        """
        D, at = self.D.copy(), [self.scales[name] for name in channels if name in self.scales]
        D[at] = self.narrow[at]
        return replace(self, D=D)

    def is_last(self, error: DataError) -> bool:
        """Say whether a further error is corrected after all others."""
        return not self._later and not (error.kind in REPEATED and self.corrected)

    @property
    def _later(self) -> tuple[DataError, ...]:
        """Return the errors that are corrected after a further one."""
        return () if self.place is None else self.corrected[self.place :]

    @property
    def time(self) -> np.ndarray:
        """Return the times of the samples at the place of a further error (n,). [s]"""
        return corrected(self.written, self.corrected[: self.place]).record.time

    def under(self, logged: Logged) -> SaturatedModel:
        """Return the saturated model under the commands of a record, if they differ from this one's."""
        commands = logged.setting.trial.commands
        if commands is self.logged.setting.trial.commands or commands is None:
            return replace(self, logged=logged)
        key = commands.values.tobytes()
        if key not in self.others:
            self.others[key] = saturated_model_of(pose([logged]), 0, logged)
        return replace(self.others[key], logged=logged, others=self.others)

    def terms(self, logged: Logged, channels: Iterable[str]) -> dict[str, Term]:
        """Return the information of channels of a record, or of a corrected one, on the parameters."""
        nominal = self.nominal_of(logged)
        return {name: self._term(logged, name, nominal[name]) for name in channels}

    def nominal_of(self, logged: Logged) -> Mapping[str, np.ndarray]:
        """Return the prediction under a record's commands, simulated once if they are others."""
        commands, own = logged.setting.trial.commands, self.logged.setting.trial.commands
        if commands is own or commands is None or own is None:
            return self.nominal
        key = commands.values.tobytes().hex()
        if key not in self.kept:
            setting = replace(self.setting, trial=replace(self.setting.trial, commands=commands))
            shown = shown_on_grid(setting, simulate_track(setting), self.nominal)
            self.kept[key] = {name: shown[name] - self.slopes[name] @ self.z for name in shown}
        return self.kept[key]

    def at(self, rows: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Return rows of the grid (g, …) at times (n,): linear between, held at the ends."""
        low, share = self._places(time, rows.shape[0])
        share = share.reshape(-1, *(1,) * (rows.ndim - 1))
        return (1.0 - share) * rows[low] + share * rows[low + 1]

    def _places(self, time: np.ndarray, count: int) -> Between:
        """Return the rows, of `count`, between which times (n,) lie."""
        x = np.clip(time / self.step, 0.0, count - 1.000001)
        low = x.astype(np.int64)
        return Between(low, x - low)

    def _term(self, logged: Logged, name: str, nominal: np.ndarray) -> Term:
        time, values = logged.record.time, logged.record.values[name]
        usual = sensor_prior(name, values, logged.noise, logged.steps)
        left, used = self._left(logged, name, nominal, usual)
        measured = int(np.count_nonzero(np.isfinite(left)))
        noise, slopes = prior_noise(time, used, usual), self.slopes[name]
        r, J = noise.whiten(left), np.empty((noise.count, slopes.shape[1]))
        places = self._places(noise.time, slopes.shape[0])
        innovations_between(slopes, places, *noise.filter, J, np.empty(slopes.shape[1]))
        out = log_of_outliers(measured - noise.count, measured, usual.level)
        fixed, least = out - noise.log_scale, least_scale(noise)
        return Term(J.T @ J, J.T @ r, float(r @ r), noise.count, fixed, least, measured)

    def _left(
        self, logged: Logged, name: str, nominal: np.ndarray, usual: SensorPrior
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return measured − predicted of a channel (n,), and which samples are measured and no outliers (n,)."""
        values, expected = logged.record.values[name], self.at(nominal, logged.record.time)
        left = (turned(values, expected) if name == HEADING else values) - expected
        used = np.isfinite(left)
        used[used] = ~spikes(left[used], max(usual.level, usual.resolution))
        return left, used

    @cached_property
    def used(self) -> dict[str, np.ndarray]:
        """Channel → which samples of the record as it is are measured, and no outliers (n,)."""
        nominal, values = self.nominal_of(self.logged), self.logged.record.values
        usual = {
            name: sensor_prior(name, values[name], self.logged.noise, self.logged.steps) for name in self.own
        }
        return {name: self._left(self.logged, name, nominal[name], usual[name])[1] for name in self.own}

    @cached_property
    def own(self) -> dict[str, Term]:
        """The information of the record as it is, channel by channel."""
        return self.terms(self.logged, self.logged.record.values)

    @cached_property
    def as_is(self) -> Evidence:
        """The evidence of the saturated model for the record as it is."""
        return evidence_of_terms(stacked(self.own), self.D)

    @cached_property
    def log_sparse(self) -> float:
        """The log evidence of no cause and of single causes, mixed, for the record as it is."""
        return self.sparse(self.own)

    @property
    def log_none(self) -> float:
        """The log evidence of no cause, for the record as it is."""
        return evidence_of_terms(stacked(self.own), self.narrow).log + float(np.log(PRIOR["none"]))

    def deviations(self, name: str, z: np.ndarray) -> np.ndarray:
        """Return measured − predicted of a channel (n,), with parameters in the linear problem. [display unit]"""
        time, values = self.logged.record.time, self.logged.record.values[name]
        expected = self.at(self.nominal_of(self.logged)[name], time)
        values = turned(values, expected) if name == HEADING else values
        return values - expected - self.at(self.slopes[name], time) @ z

    def by_whole_steps(self, error: DataError) -> list[DataError]:
        """Return a step in a rounded sensor, known but for whole steps, with amounts about as large as the jump of
        the residual.
        """
        (name,) = error.channels
        deviations, time = self.deviations(name, self.as_is.z), self.logged.record.time
        known = np.isfinite(deviations)
        at, left = int(np.searchsorted(time[known], error.since)), deviations[known]
        jump = np.median(left[at : at + BESIDE_JUMP]) - np.median(left[max(at - BESIDE_JUMP, 0) : at])
        step = sensor_prior(name, self.logged.record.values[name], self.logged.noise).resolution
        near = float(np.round((jump - error.amount) / step))
        return [replace(error, amount=error.amount + step * (near + k)) for k in (-1.0, 0.0, 1.0)]

    def generous(self, terms: Mapping[str, Term]) -> float:
        """Return the log evidence of the saturated model."""
        return evidence_of_terms(stacked(terms), self.D).log

    def added(self, name: str, rest: Term, as_is: Evidence) -> float:
        """Return the contribution to the log density of the record as it is of the samples of a channel that are not
        in `rest`.
        """
        own, scale = self.own[name], as_is.scales[name]
        square = _square(own, as_is.z) - _square(rest, as_is.z)
        lost = own.samples - rest.samples
        return own.fixed - rest.fixed - lost * float(np.log(scale)) - 0.5 * square / scale**2

    def lost_by(self, error: DataError) -> dict[str, np.ndarray]:
        """Return channel → which samples of the record as it is are no measurements without a further error (n,)."""
        there = (*self.corrected[: self.place], error, *self._later)
        after, here = places(self.written, there), places(self.written, self.corrected)
        lost = {name: np.isfinite(here[name]) & ~np.isin(here[name], after[name]) for name in self.own}
        return {name: some & np.isfinite(self.logged.record.values[name]) for name, some in lost.items()}

    def of_lost(self, name: str, lost: np.ndarray, as_is: Evidence) -> float:
        """Return the contribution of samples of a channel (n,) to the log density of the record as it is: each counts
        as the average of its kind, a measurement or an outlier. That one of few more is an outlier is worth as much
        as ten others.
        """
        own, used = self.own[name], self.used[name]
        said = own.measured - own.samples, own.measured, level_of(name, self.logged.noise)
        of_outlier, fixed = log_of_outlier(*said), own.fixed - log_of_outliers(*said)
        mean = fixed / max(own.samples, 1) - float(np.log(as_is.scales[name])) - 0.5
        return np.count_nonzero(lost & used) * mean + np.count_nonzero(lost & ~used) * of_outlier

    def sparse(self, terms: Mapping[str, Term]) -> float:
        """Return the log evidence of no cause and of single causes, mixed; within wide tolerances."""
        return log_sum([log for log, _ in self._each(terms)])

    @cached_property
    def likeliest(self) -> Evidence:
        """The evidence of the most probable of no cause and single causes, for the record as it is."""
        return max(self._each(self.own), key=lambda pair: pair[0])[1]

    def _each(self, terms: Mapping[str, Term]) -> list[tuple[float, Evidence]]:
        """Return the evidence of no cause and of the best causes, with their log posteriors."""
        said = stacked(terms)
        none = evidence_of_terms(said, self.narrow)
        base = Posterior(z=none.z, M=none.M, log_evidence=none.log, log_det=0.0)
        gains = each_freed(base, self.narrow, self.causes, self.D)
        best = sorted(range(len(gains)), key=lambda i: -gains[i])[:CAUSES_TRIED]
        each = [evidence_of_terms(said, self._freed(self.causes[i])) for i in best]
        prior = float(np.log(PRIOR["single"] / max(len(self.causes), 1)))
        return [
            (none.log + float(np.log(PRIOR["none"])), none),
            *((error.log + prior, error) for error in each),
        ]

    def _freed(self, at: Sequence[int]) -> np.ndarray:
        D = self.narrow.copy()
        D[list(at)] = self.D[list(at)]
        return D


class Stacked(NamedTuple):
    """The terms of channels, stacked: their names (c,), JᵀJ (c, k²), Jᵀr (c, k), and (c,) each of the other fields of
    a `Term`.
    """

    names: tuple[str, ...]
    A: np.ndarray
    b: np.ndarray
    rr: np.ndarray
    samples: np.ndarray
    fixed: np.ndarray
    least: np.ndarray


def stacked(terms: Mapping[str, Term]) -> Stacked:
    """Return the terms of channels, stacked."""
    A, b, rr, samples, fixed, least, _ = (np.array(column) for column in zip(*terms.values(), strict=True))
    return Stacked(tuple(terms), A.reshape(len(A), -1), b, rr, np.maximum(samples, 1), fixed, least)


def evidence_of_terms(said: Stacked, D: np.ndarray) -> Evidence:
    """Return the evidence of the saturated model from the terms of channels."""
    names, A, b, rr, samples, fixed, least = said
    root = np.sqrt(D)
    scales = _scales(rr, samples, least)
    for turn in range(ROUNDS + 1):
        weights = scales**-2.0
        here = weights @ b
        factor, M = _covariance((weights @ A).reshape(D.size, -1), root)
        z = M @ here
        square = rr - 2.0 * (b @ z) + A @ (np.outer(z, z) + M).ravel()  # expected: parameters are uncertain
        before, scales = scales, _scales(square, samples, least)
        if turn == ROUNDS or np.all(np.abs(scales - before) < SETTLED * before):
            break
    log = -0.5 * float(weights @ rr - here @ z) - float(np.sum(np.log(np.diag(factor))))
    log += float(np.sum(fixed - samples * np.log(before)))
    return Evidence(log, z, M, dict(zip(names, before.tolist(), strict=True)))


def _covariance(A: np.ndarray, root: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return L and M = (D⁻¹ + A)⁻¹, L Lᵀ = I + √D A √D, given A (k, k) and √D (k,)."""
    factor, _ = dpotrf(precision(A, root).T, lower=1, overwrite_a=1)
    half, _ = dpotri(factor, lower=1)
    inverse = half + half.T  # above its diagonal, half is 0
    inverse.ravel(order="K")[:: root.size + 1] *= 0.5
    return factor, root[:, None] * inverse * root


def _square(term: Term, z: np.ndarray) -> float:
    """Return the squared whitened residual of a channel with parameters (k,)."""
    return term.rr - 2.0 * float(term.b @ z) + float(z @ term.A @ z)


def _scales(square: np.ndarray, samples: np.ndarray, least: np.ndarray) -> np.ndarray:
    """Return the scales of the noise of channels from their squared residuals (c,)."""
    return np.clip(np.sqrt(np.maximum(square, 0.0) / samples), least, MOST_SCALE)


def least_scale(noise: Noise) -> float:
    """Return the least scale of a channel's noise."""
    level = float(np.exp(noise.log_scale / max(noise.count, 1)))
    return max(LEAST_SCALE, noise.resolution / np.sqrt(2.0 * np.pi) / level)


def saturated_model_of(
    problem: Problem, record: int, logged: Logged, z: np.ndarray | None = None
) -> SaturatedModel:
    """Return the saturated model of a record; its simulations are those of the sensitivities at the nominal model, or
    at another linearisation point.

    Args:
        problem: all records and parameters.
        record: its number.
        logged: the record.
        z: deviations of the linearisation point (k,); the nominal model if not given.
    """
    z, found = np.zeros(len(problem.entries)) if z is None else z, problem.records[record]
    names = [name for name in logged.record.values if name in found.noise]
    (base,), setting = problem.tracks([(record, z)]), problem.setting(record, z)
    shown = shown_on_grid(setting, base, names)
    ks = [k for k, entry in enumerate(problem.entries) if entry.record in (-1, record)]
    moved = {k: to_usual_sizes(problem, k, z) for k in ks}
    tracks = problem.tracks([(record, moved[k]) for k in ks])
    slopes = {name: np.zeros((shown[name].size, z.size)) for name in names}
    for k, track in zip(ks, tracks, strict=True):
        there = shown_on_grid(problem.setting(record, moved[k]), track, names)
        for name in names:
            slopes[name][:, k] = np.nan_to_num((there[name] - shown[name]) / (moved[k][k] - z[k]))
    nominal = {name: shown[name] - slopes[name] @ z for name in names}
    grid, causes = base[0], [columns_of(problem.entries, (name,)) for name in nameable(problem.entries)]
    scales = {name: k for name in names for k in columns_of(problem.entries, (f"sensor_scale:{name}",))}
    return SaturatedModel(
        logged=logged,
        written=logged,
        step=float(grid[1] - grid[0]),
        nominal=nominal,
        slopes=slopes,
        D=generous_variances(problem),
        narrow=variances(problem.entries, (), KAPPA_NARROW),
        causes=causes,
        scales=scales,
        z=z,
        setting=setting,
    )


def generous_variances(problem: Problem) -> np.ndarray:
    """Return the wide prior variances, with every cause free at once (k,)."""
    return np.array(
        [max(e.parameter.scale, max(KAPPAS) * e.parameter.tolerance) ** 2 for e in problem.entries]
    )


def to_usual_sizes(problem: Problem, k: int, z: np.ndarray) -> np.ndarray:
    """Return deviations z (k,) with an entry moved for a finite difference: to a usual size if it does nothing while
    it is small.
    """
    parameter, moved = problem.entries[k].parameter, z.copy()
    if parameter.low < 0.0 or z[k] > 0.0 or problem.entries[k].effect.slot == "sensors":
        return problem.moved(z, k)
    moved[k] = min(parameter.scale, parameter.high)
    return moved


def shown_on_grid(setting: Setting, track: Track, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Return the sensors' readings at the times of a track: channel → (g,), in its display unit."""
    grid, states = track
    shown = {name: sensed(setting.sensing.get(name), grid, truth(setting, states, name)) for name in names}
    if setting.clock_offset:
        shown = {name: np.interp(grid - setting.clock_offset, grid, error) for name, error in shown.items()}
    return shown
