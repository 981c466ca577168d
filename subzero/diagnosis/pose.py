"""From records to the problem: settings in economical steps, noise from the data, all that is free."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from subzero.diagnosis.effect import Effect
from subzero.diagnosis.effects import START, catalogue
from subzero.diagnosis.effects.sensors import SPECS
from subzero.diagnosis.noise import estimate
from subzero.diagnosis.problem import Observed, Problem, entries_of
from subzero.diagnosis.records import Logged
from subzero.diagnosis.response import economical, respond
from subzero.errors import UserError


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
    effects = [effect for effect in catalogue(channels, more).values() if _possible(effect, observed)]
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
    noise = {
        name: estimate(time, column - simulated[name], SPECS[name].noise, one.noise.get(name))
        for name, column in values.items()
    }
    return Observed(name=one.name, time=time, values=dict(values), noise=noise, setting=setting)
