"""What happens to vehicles and is in no catalogue: forces to hide in a record, none of which a cause can name.

The kinds are those of `subzero.diagnosis.outside_kinds`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from subzero.diagnosis.other_code import Truth
from subzero.diagnosis.setting import Setting
from subzero.environment import water_of
from subzero.external_force import AXES, FACTORS, MissingForce, feature_value, fill_factors, history_at


@dataclass(frozen=True, kw_only=True)
class Outside:
    """A force outside the catalogue.

    Attributes:
        name: of its kind.
        sentence: what happened.
        axis: where it acts, at most.
        feature: of its formula, "" for one that is a function of time alone.
        missing: the force.
        window: from when to when its formula holds; all the time if None. [s]
    """

    name: str
    sentence: str
    axis: str
    feature: str = ""
    missing: MissingForce
    window: tuple[float, float] | None = None

    def apply(self, setting: Setting) -> Setting:
        """Return the setting with the force."""
        without = setting.model
        with_it = replace(without, missing=self.missing + without.missing)
        if self.window is None:
            later = tuple((t, replace(m, missing=self.missing + m.missing)) for t, m in setting.later)
            return replace(setting, model=with_it, later=later)
        first, last = self.window
        return replace(setting, later=((first, with_it), (last, without)))


def force_along(outside: Outside, setting: Setting, truth: Truth) -> np.ndarray:
    """Return the force (n, 6) at the times of a truth of the setting: what a diagnosis should recover. [N, N m]"""
    times, factors = truth.run.times, factors_of(setting, truth)
    total = history_at(outside.missing, times)
    for term in outside.missing.terms:
        total[:, AXES.index(term.axis)] += term.coefficient * feature_value(term.feature, factors)
    if outside.window is not None:
        inside = (times >= outside.window[0] - 1e-9) & (times <= outside.window[1] + 1e-9)
        total[~inside] = 0.0
    return total


def factors_of(setting: Setting, truth: Truth) -> np.ndarray:
    """Return the factors of features (n, len(FACTORS)) along a truth, see `subzero.external_force`."""
    r, water, out = (
        truth.run.recording,
        water_of(setting.model),
        np.zeros((truth.run.times.size, len(FACTORS))),
    )
    for row, time in enumerate(truth.run.times):
        nu_r = r.state[row, 7:13].copy()
        nu_r[:3] -= r.rotation[row].T @ water.at(r.state[row, :3], time)
        rudder, port, starboard = r.fins[row]
        n, length, depth = r.state[row, 13], truth.length[row], r.state[row, 2]
        fill_factors(nu_r, n, rudder, 0.5 * (port + starboard), length, time, depth, out[row])
    return out
