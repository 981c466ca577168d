"""From records to the least-squares problem, and its refinements: noise from the residual of a fit, finer steps.

    Logged → Problem: settings in economical steps, usual noise, all effects free
    with_residual_noise: the noise in the residual of a fit;   with_finer_steps: h(z) corrected for its discretisation
    sensitive_runs: records of a motion that is unstable, where that is not possible

Measured values are not changed: a correction is added to the simulation. Only whole turns of a heading are taken off.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scenarios.heading import turned
from subzero.channels import HEADING
from subzero.diagnosis.hypothesis.catalogue import ONSETS, SAMPLED, START, catalogue
from subzero.diagnosis.hypothesis.catalogue.sensors import CLOCK, SPECS
from subzero.diagnosis.hypothesis.effect import with_free_onset
from subzero.diagnosis.hypothesis.hypotheses import (
    Entry,
    entries_of,
    is_absent,
    moves_nothing,
    with_tolerances,
)
from subzero.diagnosis.hypothesis.noise import (
    Noise,
    as_noise,
    level_of,
    prior_of,
    sensor_prior,
    spikes,
)
from subzero.diagnosis.inference.map_fit import Fit, objective
from subzero.diagnosis.inference.problem import Observed, Problem
from subzero.diagnosis.inference.simulator import economical, finer, read, respond, with_limit
from subzero.errors import UserError
from subzero.identification import noise as general
from subzero.identification.noise import NoisePrior, log_times, most_probable, visible

if TYPE_CHECKING:
    from subzero.diagnosis.hypothesis.effect import Effect
    from subzero.diagnosis.hypothesis.logged import Logged

VISIBLE_STEP_ERROR = 1.0
"""Squared whitened size of an error of the steps that is worth correcting."""
LITTLE_CLOSER, SENSITIVE_LEVELS = 0.9, 1.0
"""The share of z at which the error of the steps is computed again, and the change of that error, in noise levels,
from which on a run is sensitive. On a REMUS 100 that is steered from outside it is seven; on a dozen records of real
vehicles 0.0 to 0.7. [-]
"""
EARLIEST_CLOCK_S = -CLOCK.parameters[0].low
"""The earliest clock: simulations continue beyond the last sample, which was taken later than its time says, under
the last command.
"""
NOISE_LEVEL_CHANGE = 0.1
"""Change of the logarithm of a noise level that is worth a new fit; of its slow part, SLOW_NOISE_FACTOR times as
much.
"""
SLOW_NOISE_FACTOR = 2.0
NOISE_ROUNDS, FEWEST_SAMPLES = 2, 8
"""How often the noise of each channel is estimated, given that of the others; from fewer samples it is not. [-]"""


def pose(records: Sequence[Logged], more: Iterable[Effect] = ()) -> Problem:
    """Return the problem of some records of one vehicle.

    Args:
        records: what was measured, with the trials.
        more: causes besides the catalogue.

    Raises:
        UserError: the nominal model cannot be run through a trial.
    """
    observed = tuple(_observed(record) for record in records)
    channels = list(dict.fromkeys(name for trial in observed for name in trial.noise))
    nominal = observed[0].setting
    effects = [
        replace(effect, parameters=tuple(parameter.within(nominal) for parameter in effect.parameters))
        for effect in (with_tolerances(trial, nominal) for trial in catalogue(channels, more).values())
        if _possible(effect, observed)
        and not is_absent(effect, nominal)
        and not moves_nothing(effect, nominal)
    ]
    onsets = tuple(
        effect for effect in ONSETS if _possible(effect, observed) and not is_absent(effect, nominal)
    )
    own = (*START, SAMPLED) if any(trial.setting.intervals for trial in observed) else START
    return Problem(records=observed, entries=entries_of(effects, own, len(observed)), onsets=onsets)


def with_change_point(problem: Problem, effect: Effect, time: float, record: int) -> Problem:
    """Return the problem with the parameters of an effect that begins at a time [s] of a record, and its onset,
    appended to its entries.
    """
    begins = with_free_onset(effect, time, float(problem.records[record].time[-1]))
    more = tuple(Entry(begins, i, record) for i in range(len(begins.parameters)))
    return replace(problem, entries=(*problem.entries, *more))


def _possible(effect: Effect, observed: Sequence[Observed]) -> bool:
    """Say whether a cause is possible in these trials: without a cable or a free drum, some are not."""
    tethered = any(trial.setting.tethered for trial in observed)
    winch = any(trial.setting.model.winch is not None for trial in observed)
    return (effect.slot not in ("cable", "drum") or tethered) and not (effect.slot == "drum" and winch)


def _observed(trial: Logged) -> Observed:
    """Return a record with its noise."""
    time = trial.record.time
    setting = economical(trial.setting, min(float(time[-1]), trial.setting.trial.duration) + EARLIEST_CLOCK_S)
    values = {
        name: column
        for name, column in trial.record.values.items()
        if name in SPECS and np.isfinite(column).any()
    }
    if not values:
        raise UserError(f"'{trial.name}' has no measured sample in any channel that can be diagnosed.")
    setting, run = with_limit(setting)
    simulated = read(setting, run, time, values)
    if not all(np.isfinite(column).all() for column in simulated.values()):
        raise UserError(
            f"The nominal model cannot be run through '{trial.name}'. Try `subzero simulate` on its scenario."
        )
    if HEADING in values:
        values[HEADING] = turned(values[HEADING], simulated[HEADING])
    noise = {
        name: _usual(
            time, column, column - simulated[name], sensor_prior(name, time, column, trial.noise, trial.steps)
        )
        for name, column in values.items()
    }
    return Observed(
        name=trial.name, time=time, values=values, noise=noise, setting=setting, known=trial.noise
    )


def _usual(time: np.ndarray, values: np.ndarray, difference: np.ndarray, usual: NoisePrior) -> Noise:
    """Return a usual sensor's noise, without the outliers of measured − simulated (n,)."""
    return as_noise(usual.usual(), usual, time, _used(values, difference, usual))


def _used(values: np.ndarray, difference: np.ndarray, usual: NoisePrior) -> np.ndarray:
    """Return which samples are measured, and no outliers (n,)."""
    used = np.isfinite(values)
    used[used] = ~spikes(difference[used], max(usual.level, usual.resolution))
    return used


def with_residual_noise(problem: Problem, z: np.ndarray, D: np.ndarray) -> Problem | None:
    """Return the problem with the noise estimated from the residual at deviations z; None if it hardly differs from
    the present one.

    Args:
        problem: records and parameters.
        z: the best fit so far (k,).
        D: prior variances of the parameters in it (k,).
    """
    records = tuple(_without_outliers(problem, i, z) for i in range(len(problem.records)))
    plain = replace(problem, records=tuple(replace(each, noise=_unit(each)) for each in records))
    r, J = plain.residual(z), plain.jacobian(z)
    rest, F, at, found = r + J @ z, J * np.sqrt(D), 0, []
    for record in records:
        columns = {}
        for name, old in record.noise.items():
            columns[name] = np.column_stack([F, rest])[at : at + old.count]
            at += old.count
        found.append(replace(record, noise=_behind(record, columns)))
    if all(
        _alike(each.noise[name], new.noise[name])
        for each, new in zip(problem.records, found, strict=True)
        for name in each.noise
    ):
        return None
    return replace(problem, records=tuple(found))


def whitened_again(before: Problem, after: Problem, white: np.ndarray) -> np.ndarray:
    """Return columns (m, …) that are whitened with the noise of a problem, whitened with that of another, of the same
    samples.
    """
    found, at = [], 0
    for old, new in zip(before.records, after.records, strict=True):
        for name, noise in old.noise.items():
            found.append(new.noise[name].whiten_again(white[at : at + noise.count], noise))
            at += noise.count
    return np.concatenate(found)


def rewhitened(fit: Fit, before: Problem, after: Problem) -> Fit:
    """Return a fit under the noise of another problem: its residual and its sensitivities whitened with that."""
    r, J = whitened_again(before, after, fit.r), whitened_again(before, after, fit.J)
    return replace(fit, r=r, J=J, objective=objective(r, fit.z, fit.D))


def _without_outliers(problem: Problem, record: int, z: np.ndarray) -> Observed:
    """Return a record without the outliers of its residual at deviations z."""
    found = problem.records[record]
    shown = respond(problem.setting(record, z), found.time, found.noise)
    noise = {}
    for name, old in found.noise.items():
        used = _used(found.values[name], found.values[name] - shown[name], sensor_of(found, name))
        noise[name] = replace(old, used=used, time=found.time[used])
    return replace(found, noise=noise)


def sensor_of(record: Observed, name: str) -> NoisePrior:
    """Return the prior of a channel's sensor, from the user's knowledge of it and from the record as it was posed."""
    level, resolution = level_of(name, record.known), record.noise[name].resolution
    return prior_of(level, resolution, record.time, is_known=name in record.known)


def _unit(record: Observed) -> dict[str, Noise]:
    """Return noise that leaves values in their units, without outliers and gaps."""
    return {name: Noise(white=1.0, used=noise.used, time=noise.time) for name, noise in record.noise.items()}


def _behind(record: Observed, columns: Mapping[str, np.ndarray]) -> dict[str, Noise]:
    """Return the noise of the channels in the residual of a fit.

        y − h(z*) + J z*  ~  N(0, J D Jᵀ + Σ),   z ~ N(0, D)

    The parameters are integrated out, so that a smooth misfit that the model can follow is no noise.

    Args:
        record: as it is posed.
        columns: channel → [J D^½, y − h(z*) + J z*] of the samples that are used (m, k + 1).
    """
    priors = {name: sensor_of(record, name) for name in columns}
    found = {name: prior.usual() for name, prior in priors.items()}
    intervals = [prior.interval for prior in priors.values()]
    for name in [*columns] * NOISE_ROUNDS:
        if record.noise[name].count < FEWEST_SAMPLES:
            continue
        prior, both = priors[name], columns[name]
        directions = np.column_stack([visible(both[:, :-1], prior.level), both[:, -1]])

        def log_more(noise: general.Noise, name: str = name) -> float:
            return log_times([*{**found, name: noise}.values()], intervals)

        found[name] = most_probable(found[name], prior, record.noise[name].time, directions, log_more)
    return {
        name: as_noise(each, priors[name], record.time, record.noise[name].used)
        for name, each in found.items()
    }


def _alike(old: Noise, new: Noise) -> bool:
    """Say whether the difference between two noises of a channel is negligible for a fit."""
    if not np.array_equal(old.used, new.used):
        return False
    level = abs(np.log(new.sd / old.sd))
    lasting = abs(np.log(new.lasting / old.lasting))
    return bool(level < NOISE_LEVEL_CHANGE and lasting < SLOW_NOISE_FACTOR * NOISE_LEVEL_CHANGE)


def with_finer_steps(problem: Problem, z: np.ndarray) -> Problem | None:
    """Return the problem with the error of economical steps at z corrected; None if that is negligible."""
    records, size = [], 0.0
    for i, record in enumerate(problem.records):
        wrong = _error_of_steps(problem, i, z)
        size += sum(float(np.sum(record.noise[name].whiten(column) ** 2)) for name, column in wrong.items())
        records.append(record.corrected(wrong))
    return replace(problem, records=tuple(records)) if VISIBLE_STEP_ERROR < size < np.inf else None


def _error_of_steps(problem: Problem, record: int, z: np.ndarray) -> dict[str, np.ndarray]:
    """Return channel → error of economical steps at z (n,). [display unit]"""
    found, setting = problem.records[record], problem.setting(record, z)
    coarse, fine = (respond(made, found.time, found.noise) for made in (setting, finer(setting)))
    return {name: fine[name] - coarse[name] for name in found.noise}


class SensitiveRun(NamedTuple):
    """A record whose motion no simulation follows for long, and the channel that shows it most: by so many noise
    levels.
    """

    record: str
    channel: str
    levels: float


def sensitive_runs(problem: Problem, z: np.ndarray) -> tuple[SensitiveRun, ...]:
    """Return the records for which the error of the steps changes if the vehicle is a little closer to the nominal
    one than z: where a motion is unstable, errors of a simulation grow without limit, and cannot be corrected.
    """
    found = []
    for i, record in enumerate(problem.records):
        if not record.correction:
            continue
        here, close = _error_of_steps(problem, i, z), _error_of_steps(problem, i, LITTLE_CLOSER * z)
        apart = {
            name: float(np.sqrt(np.mean((close[name] - here[name])[noise.used] ** 2)) / noise.sd)
            for name, noise in record.noise.items()
        }
        channel = max(apart, key=lambda name: apart[name])
        if apart[channel] > SENSITIVE_LEVELS:
            found.append(SensitiveRun(record.name, channel, apart[channel]))
    return tuple(found)
