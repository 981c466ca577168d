"""A verdict in words: sentences that the terminal and the report share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache

import numpy as np

from subzero.channels import BY_NAME
from subzero.diagnosis.hypothesis.catalogue import all_effects, listed
from subzero.diagnosis.hypothesis.effect import plain_id
from subzero.diagnosis.results import (
    CALIBRATED,
    CAUSE_NAMED,
    DATA_ERROR,
    MAX_NAMED,
    NOTHING_NEAR,
    NOTHING_WRONG,
    OUT_OF_CATALOGUE,
    UNDECIDED,
    WAVE,
    Cause,
    Estimate,
    FoundError,
    NextTrial,
    Unknown,
    Verdict,
    worth_naming,
)
from subzero.external_force import FEATURES

HEADLINES = {
    NOTHING_WRONG: "Nothing is wrong beyond tolerance",
    CALIBRATED: "No cause, but the model wants calibration",
    NOTHING_NEAR: "Nothing comes near these records",
    CAUSE_NAMED: "The cause is named",
    UNDECIDED: "Undecided: several causes explain the records as well",
    OUT_OF_CATALOGUE: "Something real that is not in the catalogue",
    DATA_ERROR: "An error in the data",
}

NOTHING = "–"
FORCE, DRIFT = "unknown_force:", "sensor_drift:"
"""Prefixes of the ids of explanations out of the catalogue."""

ERRORS = {
    "affine": "has another scale or zero",
    "sign": "has the other sign",
    "unit": "is in another unit",
    "reference": "has another reference",
    "step": "jumps",
    "frozen": "is frozen",
    "dropout": "repeats a value in place of measurements",
    "swapped": "have each other's values",
    "latency": "is late or early",
}
"""Kind of an error in the data of a column → words, where its sizes are not known."""
PUSHES = {
    "X": ("pushes the hull forward", "holds the hull back", "pushes the hull forward and back"),
    "Y": ("pushes the hull to starboard", "pushes the hull to port", "pushes the hull from side to side"),
    "Z": ("pushes the hull down", "lifts the hull", "pushes the hull up and down"),
    "K": ("rolls the hull to starboard", "rolls the hull to port", "rolls the hull"),
    "M": ("raises the nose", "lowers the nose", "pitches the hull up and down"),
    "N": ("turns the hull to starboard", "turns the hull to port", "turns the hull from side to side"),
}
"""Axis of a force or a moment → its effect where it is positive, where it is negative, and where it is both."""
ONE_SIDED = 0.25
"""A force counts as one of one sign if it is never as large with the other one, as a share."""

UNCHANGED = "No file was changed. All that follows is said of the records as they are once that is put right."

ALTERNATIVE_PROBABILITY = 0.1
"""A feature that is at least as probable, and not in the reported formula, is reported too."""


def number(value: float, unit: str = "") -> str:
    """Return a number in three digits with its unit; a share in per cent."""
    if not math.isfinite(value):
        return NOTHING
    if unit == "1":
        return f"{100.0 * value:+.3g} %"
    return f"{value + 0.0:.3g} {unit}".strip()


def estimate(name: str, estimate: Estimate) -> str:
    """Return a parameter in words: value, interval, value of the model."""
    value, low, high = (number(x, estimate.unit) for x in (estimate.value, estimate.low, estimate.high))
    return f"{name.replace('_', ' ')} {value} (95 %: {low} to {high}; model: {number(estimate.nominal, estimate.unit)})"


def cause(cause: Cause) -> str:
    """Return a cause in words, with its parameters and its probability."""
    numbers = "; ".join(estimate(name, parameter) for name, parameter in cause.parameters.items())
    return (
        f"{_capital(cause.sentence)}{_since(cause)}: {numbers}. Probability {probability(cause.probability)}."
    )


def cause_in_short(cause: Cause) -> str:
    """Return a cause in words, with its value compared with that of the model."""
    numbers = "; ".join(_against_model(name, parameter) for name, parameter in cause.parameters.items())
    return f"{_capital(cause.sentence)}{_since(cause)}{': ' if numbers else ''}{numbers}."


def _against_model(name: str, estimate: Estimate) -> str:
    """Return a parameter compared with that of the model; a share as an excess or a deficit."""
    if name == "share" and estimate.unit == "1" and estimate.nominal == 0.0:
        return f"{100.0 * abs(estimate.value):.3g} % {'more' if estimate.value > 0.0 else 'less'} than in the model"
    value, nominal = number(estimate.value, estimate.unit), number(estimate.nominal, estimate.unit)
    return f"{name.replace('_', ' ')} {value}, where the model has {nominal}"


def _since(cause: Cause) -> str:
    return (
        ""
        if cause.start_time is None
        else f", since t = {cause.start_time:.3g} ± {1.96 * cause.start_sd:.2g} s"
    )


def something(axis: str, force: np.ndarray | None = None) -> str:
    """Return the effect of a latent force or moment, such as "something rolls the hull to port"."""
    forward, back, both = PUSHES[axis]
    if force is None:
        return f"something {both}"
    high, low = max(float(np.max(force)), 0.0), max(float(-np.min(force)), 0.0)
    if min(high, low) > ONE_SIDED * max(high, low):
        return f"something {both}"
    return f"something {forward if high >= low else back}"


def explanation(name: str, known: Mapping[str, str] | None = None) -> str:
    """Return a hypothesis of a verdict in words.

    Args:
        name: as in `Verdict.probabilities`: "none", "rudder_lag", "a + b", "hull_drag@12.5", "unknown_force:X".
        known: id → sentence of causes that are not in the catalogue.
    """
    return " and ".join(_explained(each, known or {}) for each in name.split(" + "))


def without_errors(name: str, verdict: Verdict) -> str:
    """Return a hypothesis without the reported errors in the data."""
    reported = {error.id for error in verdict.data_errors} if verdict.then else set()
    return " + ".join(each for each in name.split(" + ") if each not in reported) or "none"


def with_errors(name: str, verdict: Verdict) -> str:
    """Return a hypothesis in words, without the reported errors in the data."""
    rest = without_errors(name, verdict)
    if rest == "none" and name != "none":
        return "nothing else is wrong"
    return explanation(rest, sentences(verdict))


def _explained(name: str, known: Mapping[str, str]) -> str:
    """Return a single cause, force or drift in words."""
    if name in known:
        return known[name]
    if name in ("none", ""):
        return "nothing is wrong"
    if name.startswith(FORCE) and name.removeprefix(FORCE) in PUSHES:
        return something(name.removeprefix(FORCE))
    if name.startswith(DRIFT):
        return f"the sensor of the {_spaced(name.removeprefix(DRIFT))} drifts"
    kind, _, where = name.partition("=")[0].partition(":")
    if kind in ERRORS:
        return f"{' and '.join(map(column, where.split('/')))} {ERRORS[kind]}"
    what, _, since = name.partition("@")
    sentence = known.get(what) or description_of(name).get("sentence", _spaced(what))
    return f"from {since} s on {sentence}" if since else sentence


effects = cache(all_effects)
"""Every effect of the catalogue, by id."""


def description_of(name: str) -> dict[str, str]:
    """Return sentence and slot of a cause by its id, with or without an onset; empty for one that is not known."""
    effect = effects().get(plain_id(name))
    if effect is None:
        return listed.description_of(plain_id(name))
    return {"sentence": effect.sentence, "slot": effect.slot}


def _spaced(name: str) -> str:
    return name.replace("_", " ").replace(":", ": ")


def sentences(verdict: Verdict) -> dict[str, str]:
    """Return the verdict's own descriptions of its causes and rivals: hypothesis → sentence."""
    reported = {" + ".join(rival.ids) or "none": rival.sentence for rival in verdict.rivals}
    reported = {name: said for name, said in reported.items() if not name.startswith(FORCE)}
    reported |= {each.id: each.sentence for each in verdict.causes if each.start_time is None}
    reported |= {error.id: error.sentence for error in verdict.data_errors}
    if verdict.unknown is not None and not verdict.unknown.is_drift:
        reported[f"{FORCE}{verdict.unknown.axis}"] = something(verdict.unknown.axis, verdict.unknown.force)
    return reported


def probability(value: float) -> str:
    """Return a probability in words, never as a certainty."""
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


def is_reported(name: str, verdict: Verdict) -> bool:
    """Say whether a hypothesis is the reported one: its causes, whatever their onsets, or its force or drift."""
    parts = [error for error in without_errors(name, verdict).split(" + ") if error != "none"]
    if verdict.on_model == UNDECIDED:
        return False
    if verdict.on_model == OUT_OF_CATALOGUE and verdict.unknown is not None:
        return parts == [f"{DRIFT if verdict.unknown.is_drift else FORCE}{verdict.unknown.axis}"]
    ids = sorted(part.partition("@")[0] for part in parts)
    begins = any(cause.start_time is not None for cause in verdict.causes)
    return ids == sorted(cause.id for cause in verdict.causes) and ("@" in name) == begins


def title(verdict: Verdict) -> str:
    """Return the title of a page: the explanation where one is named, else the headline."""
    if verdict.data_errors and verdict.then:
        return headline(verdict)
    if verdict.on_model == CAUSE_NAMED and verdict.causes:
        return _capital(" and ".join(each.sentence for each in verdict.causes))
    if verdict.on_model == OUT_OF_CATALOGUE and verdict.unknown is not None:
        return on_model(verdict).rstrip(".")
    return headline(verdict)


def data_error(error: FoundError) -> str:
    """Return an error in the data in words: place, description, remedy, and alternatives."""
    alike = "".join(f" Or, which these records cannot tell from it: {other}." for other in error.alike)
    what = f"{error.sentence}: {error.remedy}. Probability {probability(error.probability)}."
    return f"{error.record}: {what}{alike}"


def sentence(verdict: Verdict) -> str:
    """Return the verdict in a sentence without ids; errors in the data come before the verdict on the model."""
    if not verdict.then:
        return on_model(verdict)
    return " ".join([*map(data_error, verdict.data_errors), "Without that:", on_model(verdict)])


def on_model(verdict: Verdict) -> str:
    """Return the verdict on the model; of indistinguishable explanations only the first few."""
    if verdict.on_model == UNDECIDED:
        return _undecided(verdict)
    if verdict.on_model == OUT_OF_CATALOGUE and verdict.unknown is not None:
        unknown = verdict.unknown
        said = (
            f"the sensor of the {_spaced(unknown.axis)} drifts"
            if unknown.is_drift
            else something(unknown.axis, unknown.force)
        )
        return f"{_capital(said)}, and no cause of the catalogue explains it."
    if verdict.on_model == NOTHING_WRONG:
        return f"Nothing is wrong beyond the tolerances of the model.{_within(verdict)}"
    if verdict.on_model == CALIBRATED:
        return "No part is at fault, but numbers of the model are off beyond their tolerances: it wants calibration."
    if verdict.on_model == NOTHING_NEAR:
        return "Nothing explains these records: what the best explanation leaves of them is more than noise."
    return verdict.sentence


def _within(verdict: Verdict) -> str:
    """Return the cause of the most probable hypothesis in words, if it is no larger than calibration allows."""
    first = max(verdict.probabilities, key=lambda name: verdict.probabilities[name], default="none")
    first = without_errors(first, verdict)
    if first == "none":
        return ""
    return (
        f" The best fit has that {explanation(first, sentences(verdict))}, by no more than calibration may."
    )


def _undecided(verdict: Verdict) -> str:
    """Return the explanations that the records allow, the most probable first."""
    known, chances = sentences(verdict), verdict.probabilities
    shown = "; ".join(
        f"{explanation(name, known)} ({probability(chances[name])})" for name in worth_naming(chances)
    )
    more = len(verdict.rivals) - MAX_NAMED
    rest = f"; and {more} more that are less probable" if more > 0 else ""
    return f"These records cannot tell apart: {shown}{rest}."


def unknown(unknown: Unknown) -> str:
    """Return a latent force in words: its effect, its size, its formula; or the drift of a sensor."""
    most = max(range(len(unknown.force)), key=lambda at: abs(unknown.force[at]))
    size = (
        f"{unknown.force[most]:.3g} ± {1.96 * unknown.band[most]:.2g} {unknown.unit} "
        f"at t = {unknown.time[most]:.3g} s, where it is largest."
    )
    if unknown.is_drift:
        what = f"The sensor of the {_spaced(unknown.axis)} drifts as no cause explains: {size}"
    else:
        kind = "force" if unknown.unit == "N" else "moment"
        what = f"{_capital(something(unknown.axis, unknown.force))} that no cause explains, with a {kind} of {size}"
    if not unknown.formula:
        return what
    formula = " + ".join(map(formula_term, unknown.formula))
    return f"{what} It looks like {formula}.{_other_features(unknown)}"


def _other_features(unknown: Unknown) -> str:
    """Return the features that may be in the formula instead, in words; "" if none is probable enough."""
    reported = {feature for _, feature, *_ in unknown.formula}
    others = [
        f"{name} ({_described(name)}; probability {p:.2f})"
        for name, p in unknown.features.items()
        if name not in reported and p >= ALTERNATIVE_PROBABILITY
    ]
    return f" What is not ruled out: {', '.join(others)}." if others else ""


def _described(feature: str) -> str:
    return FEATURES[feature].words if feature in FEATURES else "an oscillation of its own"


def formula_term(term: tuple[str, str, float, float, float]) -> str:
    """Return a term of a formula in words, with the interval of its coefficient."""
    words, feature, value, low, high = term
    size = f"{value:.3g} ({low:.3g} to {high:.3g})"
    if feature == "constant":
        return f"{size}, constant{words.removeprefix(FEATURES['constant'].words)}"
    if feature == WAVE:
        return f"a wave of {size}{words.removeprefix('a wave')}"
    return f"{size} × {feature}, {words}"


def next_trial(trial: NextTrial) -> str:
    """Return the recommended next trial in words."""
    adds = f" Log {column(trial.channel)} too." if trial.channel else ""
    sentence = trial.sentence.rstrip(".")
    return f"Next trial: {sentence} ({trial.name}); it decides with probability {trial.decides:.2f}.{adds}"


def channel(name: str) -> str:
    """Return a channel in words with its unit."""
    return f"{_spaced(name)} [{BY_NAME[name].unit}]" if name in BY_NAME else _spaced(name)


def column(name: str) -> str:
    """Return a channel as the column of a record."""
    return BY_NAME[name].column if name in BY_NAME else name


def _capital(sentence: str) -> str:
    return sentence[:1].upper() + sentence[1:]


def _uncapital(sentence: str) -> str:
    return sentence[:1].lower() + sentence[1:]
