"""Probabilities of all hypotheses from their evidence, and the decision rule for the verdict.

nothing_wrong      p(none) ≥ 0.5, or the named size is within the practical one
calibrated         the same, but numbers had to move by more than 4 tolerances, or tolerances 4 times as wide explain
                   the records best: the model wants calibration
nothing_near       nothing is named, and what the best fit leaves is no noise; or the best explanation, whatever it
                   names, moves what it does not name beyond any calibration; or the name holds only with tolerances
                   four times as wide (κ = 4): the declared vehicle is another one
cause_named        one hypothesis, or one cause that begins in mid-trial, with p ≥ 0.9, D ≥ 9 to its closest rival,
                   its size beyond 4 tolerances
outside_catalogue  a latent force or a drift that no cause explains has p ≥ 0.9
undecided          everything else: the smallest set with p ≥ 0.95

Hypotheses with a fit have Laplace's evidence; all others that of the screening, never higher than that of the best
fit. A further cause counts only if it could be named (Occam fold).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from subzero.diagnosis.hypothesis.hypotheses import PRACTICAL_TOLERANCES, Entry, Ids, columns_of
from subzero.diagnosis.inference.linear_gaussian import KAPPAS, log_sum
from subzero.diagnosis.results import (
    CALIBRATED,
    CAUSE_NAMED,
    NOTHING_NEAR,
    NOTHING_WRONG,
    OUTSIDE,
    UNDECIDED,
)

if TYPE_CHECKING:
    from subzero.diagnosis.inference.map_fit import Candidate
    from subzero.diagnosis.inference.problem import Problem
    from subzero.diagnosis.inference.screening import Screening

Key = TypeVar("Key")
NAMED_PROBABILITY, HEALTHY_PROBABILITY, CREDIBLE_SET_PROBABILITY = 0.9, 0.5, 0.95
"""Probabilities from which on a cause, a force, a drift or an error in the data is named (one in ten may be wrong
there), nothing is called wrong, and a credible set is complete. [-]
"""
MIN_DISCRIMINATION = 9.0
"""No cause is named with less than this squared distance to a rival, however the noise of this record happens to
fall.
"""
REFUTED_NATS = 16.0
"""A rival with a log posterior this far below the best is refuted: where D is 9, the noise would have to be off by 3
σ.
"""


def sizes_in_tolerances(entries: Sequence[Entry], ids: Ids, z: np.ndarray, kappa: float) -> dict[str, float]:
    """Return cause → its size in tolerances, of its largest parameter."""
    found: dict[str, float] = {}
    for cause_id in ids:
        at = columns_of(entries, (cause_id,))
        found[cause_id] = max(abs(float(z[k])) / (kappa * entries[k].parameter.tolerance) for k in at)
    return found


def practical_causes(entries: Sequence[Entry], ids: Ids, z: np.ndarray, kappa: float) -> Ids:
    """Return the causes that are of a practical size: beyond calibration."""
    found = sizes_in_tolerances(entries, ids, z, kappa)
    return tuple(cause_id for cause_id in ids if found[cause_id] > PRACTICAL_TOLERANCES)


def credible_set(probabilities: Mapping[Key, float], total: float = CREDIBLE_SET_PROBABILITY) -> list[Key]:
    """Return the most probable hypotheses that together have a probability."""
    found: list[Key] = []
    have = 0.0
    for ids, p in sorted(probabilities.items(), key=lambda pair: -pair[1]):
        found.append(ids)
        have += p
        if have >= total:
            break
    return found


class ChangePointSummary(NamedTuple):
    """The most probable cause that begins in mid-trial: probability, of a practical size, D to its closest rival."""

    probability: float = 0.0
    practical: bool = False
    apart: float = 0.0

    @property
    def is_named(self) -> bool:
        """It may be named."""
        return self.practical and self.apart >= MIN_DISCRIMINATION and self.probability >= NAMED_PROBABILITY


def decide(
    probabilities: Mapping[Ids, float],
    outside: float,
    practical: bool,
    apart: float,
    late: ChangePointSummary | None = None,
) -> str:
    """Return the verdict.

    Args:
        probabilities: hypothesis → probability; with those of explanations out of the catalogue they sum to 1.
        outside: probability of a force or a drift that no cause explains.
        practical: the most probable hypothesis' causes are all of a practical size.
        apart: D of the most probable hypothesis against its closest rival.
        late: the most probable change point.
    """
    late = late or ChangePointSummary()
    best = max(probabilities, key=lambda ids: probabilities[ids])
    if outside >= NAMED_PROBABILITY:
        return OUTSIDE
    if late.is_named:
        return CAUSE_NAMED
    if probabilities.get((), 0.0) >= HEALTHY_PROBABILITY:
        return NOTHING_WRONG
    if best and not practical and probabilities[best] >= HEALTHY_PROBABILITY:
        return NOTHING_WRONG
    if best and practical and apart >= MIN_DISCRIMINATION and probabilities[best] >= NAMED_PROBABILITY:
        return CAUSE_NAMED
    return UNDECIDED


EXCESS_SIGMAS = 6.0
"""A whitened residual whose sum of squares is so many standard deviations above that of noise is no noise. [-]"""


def has_moved(entries: Sequence[Entry], z: np.ndarray, kappa: float) -> bool:
    """Say whether a fit z (k,) is no longer the vehicle that was declared: a number that all records share is more
    than PRACTICAL_TOLERANCES off, or the widest scale κ of the tolerances is the most probable.
    """
    shared = [k for k, entry in enumerate(entries) if entry.record < 0]
    sizes = [abs(float(z[k])) / entries[k].parameter.tolerance for k in shared]
    return kappa == max(KAPPAS) or max(sizes, default=0.0) > PRACTICAL_TOLERANCES


FARTHEST_TOLERANCES = PRACTICAL_TOLERANCES * max(KAPPAS)
"""A number that is not named and is off by more than this is no calibration, at any scale of the tolerances. [τ]"""
AT_BOUND = 0.99
"""A sensor's number at this share of its bound was stopped there by the fit. [-]"""


def is_near(entries: Sequence[Entry], z: np.ndarray, named: Ids) -> bool:
    """Say whether an explanation z (k,) is near the records: it moves no number of the vehicle and its sensors that
    it does not name farther than any calibration may, and none of a sensor that it names to the bound of a possible
    sensor.
    """
    for entry, value in zip(entries, z.tolist(), strict=False):
        parameter = entry.parameter
        if entry.record >= 0:
            continue
        if entry.effect.id not in named and abs(value) > FARTHEST_TOLERANCES * parameter.tolerance:
            return False
        is_sensor = entry.effect.id in named and entry.effect.slot == "sensors"
        if is_sensor and (
            value >= AT_BOUND * parameter.high or value <= min(AT_BOUND * parameter.low, -parameter.tolerance)
        ):
            return False
    return True


def is_noise(r: np.ndarray) -> bool:
    """Say whether a whitened residual (m,) is no larger than noise."""
    return bool(r @ r <= r.size + EXCESS_SIGMAS * np.sqrt(2.0 * r.size))


def qualified(verdict: str, entries: Sequence[Entry], best: Candidate) -> str:
    """Return a verdict that names nothing, qualified by the best fit: if the vehicle's numbers had to move far, the
    verdict is not "nothing wrong", and where the best fit leaves more than noise, no explanation is near the records.
    """
    if verdict in (NOTHING_WRONG, UNDECIDED) and not is_noise(best.fit.r):
        return NOTHING_NEAR
    if verdict == NOTHING_WRONG and has_moved(entries, best.fit.z, best.kappa):
        return CALIBRATED
    return verdict


UNTRIED_LOG_POSTERIOR = 2.0
"""The log posterior of a hypothesis without a fit of its own is at least this far below the best."""
FURTHER_CAUSE_ODDS = NAMED_PROBABILITY / (1.0 - NAMED_PROBABILITY)
"""A further cause has to be this many times as probable as none: then it could be named."""


class Added(NamedTuple):
    """Gain in log posterior of a further cause, over the hypothesis without it: with another noise both log
    posteriors change, but their difference hardly does.
    """

    beside: Ids
    log_gain: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Beliefs:
    """The posterior over all hypotheses, as far as it is known.

    Attributes:
        candidates: hypothesis → its fit by simulations.
        screen: linear evidence at the wide fit.
        one_more: hypothesis → gain of its further cause, estimated at the fit of one with a cause less.
        behind: hypothesis → log posterior of its fit relative to the best when it was given up.
    """

    candidates: Mapping[Ids, Candidate]
    screen: Screening
    one_more: Mapping[Ids, Added]
    behind: Mapping[Ids, float] = field(default_factory=dict)

    def log_posteriors(self) -> dict[Ids, float]:
        """Return the log posterior of every hypothesis, but for a common constant: by its fit, or estimated."""
        log = self._fitted()
        best, untried = max(log.values()), [ids for ids in self.screen.log_posterior if ids not in log]
        return log | {ids: min(self._estimated(ids, log), best - UNTRIED_LOG_POSTERIOR) for ids in untried}

    def _fitted(self) -> dict[Ids, float]:
        """Return the log posterior of every hypothesis that has been fitted, now or before it was given up."""
        log = {ids: candidate.log_posterior for ids, candidate in self.candidates.items()}
        best = max(log.values())
        return {ids: best + behind for ids, behind in self.behind.items()} | log

    def log_total(self) -> float:
        """Return the log of the sum of all posteriors."""
        return log_sum(list(self.log_posteriors().values()))

    def probabilities(self, problem: Problem) -> dict[Ids, float]:
        """Return the probability of every hypothesis as it is reported, the most probable first."""
        log, total = self.log_posteriors(), self.log_total()
        found = {ids: float(np.exp(value - total)) for ids, value in log.items()}
        return occam_folded(self._without_small(problem, found))

    def _estimated(self, ids: Ids, fitted: Mapping[Ids, float]) -> float:
        """Return the log posterior of a hypothesis without a fit: that of the best fit of a part of it, plus the
        predicted gain of the rest by the linear problem there, or else by the screening; less the excess of that
        prediction for causes whose own fits gained less.
        """
        seen = self.one_more.get(ids)
        if seen and seen.beside in fitted:
            return fitted[seen.beside] + seen.log_gain
        parts = [
            combination
            for size in range(len(ids))
            for combination in combinations(ids, size)
            if combination in fitted
        ]
        part = max(parts, key=lambda each: fitted[each], default=())
        excess = sum(
            self._excess_of_prediction((cause_id,), fitted) for cause_id in ids if cause_id not in part
        )
        return fitted[part] + self.screen.adds(ids, part) - excess

    def _excess_of_prediction(self, ids: Ids, fitted: Mapping[Ids, float]) -> float:
        """Return by how much the predicted gain of single causes over no cause exceeds the gain of their fits."""
        if ids not in fitted or () not in fitted:
            return 0.0
        return max(self.screen.adds(ids, ()) - (fitted[ids] - fitted[()]), 0.0)

    def _without_small(self, problem: Problem, probabilities: Mapping[Ids, float]) -> dict[Ids, float]:
        """Return probabilities where causes below a practical size are not reported together with causes above it."""
        found = dict(probabilities)
        for ids, candidate in self.candidates.items():
            kept = practical_causes(problem.entries, ids, candidate.fit.z, candidate.kappa)
            if kept and kept != ids:
                found[kept] = found.get(kept, 0.0) + found.pop(ids)
        return found


def occam_folded(probabilities: Mapping[Ids, float]) -> dict[Ids, float]:
    """Return probabilities, the most probable first, where a further cause that is not needed is not reported: the
    probability of a hypothesis that is not FURTHER_CAUSE_ODDS times as probable as a part of it is added to that
    part.
    """
    found = dict(probabilities)
    for ids in sorted(probabilities, key=len, reverse=True):
        if len(ids) > 1:
            part = max(
                combinations(ids, len(ids) - 1), key=lambda combination: probabilities.get(combination, 0.0)
            )
            if probabilities.get(part, 0.0) * FURTHER_CAUSE_ODDS > probabilities[ids]:
                found[part] += found.pop(ids)
    return dict(sorted(found.items(), key=lambda pair: -pair[1]))


def tolerance_scale(candidates: Collection[Candidate]) -> dict[float, float]:
    """Return κ → probability, over all candidates."""
    top = max(each.log_posterior for each in candidates)
    weight = dict.fromkeys(KAPPAS, 0.0)
    for candidate in candidates:
        parts = {kappa: np.log(prior) + candidate.log_evidence[kappa] for kappa, prior in KAPPAS.items()}
        mixed = log_sum(list(parts.values()))
        for kappa, value in parts.items():
            weight[kappa] += float(np.exp(candidate.log_posterior - top + value - mixed))
    total = sum(weight.values())
    return {kappa: value / total for kappa, value in weight.items()}
