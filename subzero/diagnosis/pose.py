"""From records to the problem: settings in economical steps, noise from the data, all that is free."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from subzero.diagnosis.effect import Effect
from subzero.diagnosis.effects import START, catalogue
from subzero.diagnosis.effects.sensors import SPECS
from subzero.diagnosis.entries import entries_of
from subzero.diagnosis.logged import Logged
from subzero.diagnosis.noise import Noise, estimate
from subzero.diagnosis.problem import Observed, Problem
from subzero.diagnosis.response import economical, finer, respond
from subzero.errors import UserError
from subzero.records.heading import HEADING, turned

VISIBLE = 1.0
"""Squared size, in noise, of an error of the steps that is worth correcting."""
ANOTHER = 0.1
"""Change of a noise level, as a logarithm, that is worth beginning again."""


def pose(records: Sequence[Logged], more: Iterable[Effect] = ()) -> Problem:
    """Return the problem of some records of one vehicle.

    Args:
        records: what was measured, with the trials.
        more: causes besides the catalogue.

    Raises:
        UserError: the nominal model cannot be run through a trial.
    """
    observed = tuple(_observed(one) for one in records)
    channels = list(dict.fromkeys(name for one in observed for name in one.noise))
    nominal = observed[0].setting
    effects = [
        replace(effect, parameters=tuple(one.within(nominal) for one in effect.parameters))
        for effect in catalogue(channels, more).values()
        if _possible(effect, observed)
    ]
    return Problem(records=observed, entries=entries_of(effects, START, len(observed)))


def _possible(effect: Effect, observed: Sequence[Observed]) -> bool:
    """Say whether a cause can be in these trials: without a cable or a free drum, some cannot."""
    tethered = any(one.setting.tethered for one in observed)
    winch = any(one.setting.model.winch is not None for one in observed)
    return (effect.slot not in ("cable", "drum") or tethered) and not (effect.slot == "drum" and winch)


def _observed(one: Logged) -> Observed:
    """Return a record with its noise."""
    time = one.record.time
    setting = economical(one.setting, float(time[-1]))
    values = {name: column for name, column in one.record.values.items() if name in SPECS}
    simulated = respond(setting, time, values)
    if not all(np.isfinite(column).all() for column in simulated.values()):
        raise UserError(
            f"The nominal model cannot be run through '{one.name}'. Try `subzero simulate` on its scenario."
        )
    if HEADING in values:
        values[HEADING] = turned(values[HEADING], simulated[HEADING])
    noise = noise_of(time, values, simulated, one.noise)
    return Observed(name=one.name, time=time, values=values, noise=noise, setting=setting, known=one.noise)


def noise_of(
    time: np.ndarray,
    values: Mapping[str, np.ndarray],
    simulated: Mapping[str, np.ndarray],
    known: Mapping[str, float],
) -> dict[str, Noise]:
    """Return channel → noise, from what is left of a simulation."""
    return {
        name: estimate(time, column - simulated[name], SPECS[name].noise, known.get(name))
        for name, column in values.items()
    }


def with_noise_behind(problem: Problem, z: np.ndarray) -> Problem | None:
    """Return the problem with the noise that is left behind deviations z; None if that is as good as known.

    Behind the nominal model, what a lag does in quick manoeuvres looks like noise: it is only left out behind a fit.
    """
    records, changed = [], False
    for i, one in enumerate(problem.records):
        noise = noise_of(one.time, one.values, respond(problem.setting(i, z), one.time, one.noise), one.known)
        ratios = [noise[name].sd / one.noise[name].sd for name in noise]
        changed = changed or max(np.abs(np.log(ratios))) > ANOTHER
        records.append(replace(one, noise=noise))
    return replace(problem, records=tuple(records)) if changed else None


def with_finer_steps(problem: Problem, z: np.ndarray) -> Problem | None:
    """Return the problem with records freed from the error of economical steps at z; None if that is not seen."""
    records, size = [], 0.0
    for i, one in enumerate(problem.records):
        setting = problem.setting(i, z)
        coarse, fine = (respond(made, one.time, one.noise) for made in (setting, finer(setting)))
        wrong = {name: fine[name] - coarse[name] for name in one.noise}
        size += sum(float(np.sum(one.noise[name].whiten(column) ** 2)) for name, column in wrong.items())
        records.append(
            replace(one, values={name: one.values[name] - column for name, column in wrong.items()})
        )
    return replace(problem, records=tuple(records)) if VISIBLE < size < np.inf else None
