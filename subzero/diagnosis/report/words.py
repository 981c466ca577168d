"""A verdict in words: sentences that the terminal and the report share."""

from __future__ import annotations

import math

from subzero.channels import BY_NAME
from subzero.diagnosis.results import (
    CAUSE_NAMED,
    DATA_ERROR,
    NOTHING_WRONG,
    OUTSIDE,
    UNDECIDED,
    Cause,
    Estimate,
    FoundError,
    NextTrial,
    Unknown,
    Verdict,
)
from subzero.external_force import FEATURES

HEADLINES = {
    NOTHING_WRONG: "Nothing is wrong beyond tolerance",
    CAUSE_NAMED: "The cause is named",
    UNDECIDED: "Undecided: several causes explain the records as well",
    OUTSIDE: "Something real, and outside the catalogue",
    DATA_ERROR: "An error in the data",
}

NOTHING = "–"

UNCHANGED = "No file was changed. All that follows is said of the records as they are once that is put right."

MAX_NAMED = 5
"""So many explanations are named in a sentence."""
ALTERNATIVE_PROBABILITY = 0.1
"""A feature that is as probable in a formula, and not in the one that is told, is told too."""


def number(value: float, unit: str = "") -> str:
    """Return a number in three digits with its unit; a share in per cent."""
    if not math.isfinite(value):
        return NOTHING
    if unit == "1":
        return f"{100.0 * value:+.3g} %"
    return f"{value + 0.0:.3g} {unit}".strip()


def estimate(name: str, one: Estimate) -> str:
    """Return a parameter in words: value, interval, what the model has."""
    value, low, high = (number(x, one.unit) for x in (one.value, one.low, one.high))
    return f"{name.replace('_', ' ')} {value} (95 %: {low} to {high}; model: {number(one.nominal, one.unit)})"


def cause(one: Cause) -> str:
    """Return a cause in words, with its parameters and its probability."""
    since = (
        "" if one.start_time is None else f", since t = {one.start_time:.3g} ± {1.96 * one.start_sd:.2g} s"
    )
    numbers = "; ".join(estimate(name, parameter) for name, parameter in one.parameters.items())
    return f"{_capital(one.sentence)}{since}: {numbers}. Probability {probability(one.probability)}."


def probability(value: float) -> str:
    """Return a probability, without a promise that nothing else is possible."""
    return "> 0.999" if value > 0.999 else "< 0.001" if value < 0.001 else f"{value:.3f}"


def headline(verdict: Verdict) -> str:
    """Return the verdict as a headline."""
    named = HEADLINES[verdict.verdict]
    if verdict.verdict == CAUSE_NAMED and len(verdict.causes) > 1:
        named = f"{len(verdict.causes)} causes are named"
    if verdict.verdict == DATA_ERROR:
        count = len(verdict.data_errors)
        found = f"{count} errors in the data" if count > 1 else named
        named = f"{found}; without {'them' if count > 1 else 'it'}: {_uncapital(HEADLINES[verdict.then])}"
    return named if verdict.complete else f"{named} (interrupted: this is as far as it came)"


def story(verdict: Verdict) -> list[str]:
    """Return the verdict in sentences: what it is, the causes, what is missing, the next trial."""
    told = [data_error(one) for one in verdict.data_errors]
    told += [UNCHANGED] if verdict.then else []
    plain = verdict.sentence and not verdict.causes and verdict.then in ("", UNDECIDED)
    told += [_sentence(verdict)] if plain else []
    told += [cause(one) for one in verdict.causes]
    told += [unknown(verdict.unknown)] if verdict.unknown else []
    if verdict.gain and math.isfinite(verdict.gain.total):
        share = f"{100.0 * verdict.gain.total:.1f} %"
        told.append(
            f"The extended model explains {share} of what can be explained of data that were not fitted "
            f"({verdict.gain.how})."
        )
    told += [next_trial(verdict.next_trial)] if verdict.next_trial else []
    return [*told, *verdict.notes]


def data_error(one: FoundError) -> str:
    """Return an error in the data in words: where, what, what to change, and what else it may be."""
    alike = "".join(f" Or, which these records cannot tell from it: {other}." for other in one.alike)
    what = f"{one.sentence}: {one.remedy}. Probability {probability(one.probability)}."
    return f"{one.record}: {what}{alike}"


def _sentence(verdict: Verdict) -> str:
    """Return the verdict's own sentence; of what cannot be told apart, no more than one can read."""
    if verdict.on_model != UNDECIDED:
        return verdict.sentence
    ranked = sorted(verdict.probabilities.items(), key=lambda item: -item[1])
    shown = ", ".join(f"{name} ({probability(p)})" for name, p in ranked[:MAX_NAMED])
    rest = (
        f", and {len(verdict.rivals) - MAX_NAMED} more that are less probable"
        if len(verdict.rivals) > MAX_NAMED
        else ""
    )
    return f"These records cannot tell apart: {shown}{rest}."


def unknown(one: Unknown) -> str:
    """Return the force outside the catalogue in words: axis, size, formula; or the drift of a sensor."""
    most = max(range(len(one.force)), key=lambda at: abs(one.force[at]))
    kind = f"{'force' if one.unit == 'N' else 'moment'} along {one.axis}"
    kind = f"drift of the {one.axis.replace('_', ' ')}'s sensor" if one.is_drift else kind
    what = (
        f"A {kind} that no cause explains: {one.force[most]:.3g} ± {1.96 * one.band[most]:.2g} {one.unit} "
        f"at t = {one.time[most]:.3g} s, where it is largest."
    )
    if not one.formula:
        return what
    return f"{what} It looks like {' + '.join(formula_term(term) for term in one.formula)}.{_other_features(one)}"


def _other_features(one: Unknown) -> str:
    """Return what may be in the formula instead, in words; empty if nothing is as probable as that."""
    told = {feature for _, feature, *_ in one.formula}
    others = [f"{name} ({_described(name)}; probability {p:.2f})" for name, p in one.features.items()
              if name not in told and p >= ALTERNATIVE_PROBABILITY]  # fmt: skip
    return f" What is not ruled out: {', '.join(others)}." if others else ""


def _described(feature: str) -> str:
    return FEATURES[feature].words if feature in FEATURES else "an oscillation of its own"


def formula_term(term: tuple[str, str, float, float, float]) -> str:
    """Return a term of a formula in words, with the interval of its coefficient."""
    words, feature, value, low, high = term
    size = f"{value:.3g} ({low:.3g} to {high:.3g})"
    if feature == "constant":
        return f"{size}, constant{words.removeprefix(FEATURES['constant'].words)}"
    return f"{size} × {feature}, {words}"


def next_trial(one: NextTrial) -> str:
    """Return what to do next."""
    adds = f" Log {column(one.channel)} too." if one.channel else ""
    sentence = one.sentence.rstrip(".")
    return f"Next trial: {sentence} ({one.name}); it decides with probability {one.decides:.2f}.{adds}"


def column(name: str) -> str:
    """Return a channel as the column of a record."""
    return BY_NAME[name].column if name in BY_NAME else name


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]


def _uncapital(sentence: str) -> str:
    return sentence[:1].lower() + sentence[1:]
