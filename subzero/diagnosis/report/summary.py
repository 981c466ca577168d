"""The first questions of a reader of a diagnosis, answered in words that need no glossary.

Five questions: the fault, its certainty, its cost, the next step, and a trial that would settle it. The terminal, the
page, ``report.md`` and ``diagnosis.json`` give the same answers; ids and tables follow below.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from subzero.channels import BY_NAME
from subzero.diagnosis.report import words
from subzero.diagnosis.report.tables import CLEAR_FROM, CONFUSED_BELOW, SEEN_SIGNAL, WORTH_A_LINE
from subzero.diagnosis.results import (
    CALIBRATED,
    CAUSE_NAMED,
    NOTHING_NEAR,
    NOTHING_WRONG,
    OUT_OF_CATALOGUE,
    UNDECIDED,
    Cause,
    Verdict,
)
from subzero.identification.verdict import UNSEEN

IN_EVERY = 0.9
"""A cause is known if explanations with this total probability share it; a cause is named from the same one on. [-]
"""

SURE = {
    0.999: "As sure as records can make one",
    0.95: "Very sure",
    0.8: "Fairly sure",
    0.5: "More likely than not",
}
"""Least probability → words for it."""
WITHIN_NOISE = 1.2
"""Largest root mean square error, in noise levels, that the noise alone may leave. [-]"""
MOST_CHANNELS, MOST_EXPLANATIONS = 2, 4
"""Most channels, and most explanations, in a sentence."""
MOST_HIDDEN = 5
"""Most undetectable causes that are named."""

LOOK_AT = {
    "propulsion": "the propeller, its motor and the battery",
    "thrusters": "the thruster: its propeller, its motor and its electronics",
    "fins": "the fins, their servos and linkages",
    "cable": "the cable",
    "drum": "the drum and its bearings",
    "water": "the current: measure it, or log the speed over ground too",
    "hull": "the hull: its skin, its weight and where that lies",
    "sensors": "the sensor and its calibration",
    "clock": "the clocks of the commands and of the sensors",
    "start": "how the trial began",
}
"""Slot of a cause → things to inspect."""


class Answer(NamedTuple):
    """A question, sentences that answer it, and a line of the shell that acts on it, if there is one."""

    question: str
    words: tuple[str, ...]
    command: str = ""


def summary(
    verdict: Verdict, scenario: str = "SCENARIO", extended: str = "extended.toml"
) -> tuple[Answer, ...]:
    """Return the answers to the first questions of a reader.

    Args:
        verdict: of `subzero.diagnose`.
        scenario: the trial as the user named it, a name or a path, for lines of the shell.
        extended: path of the extended model, likewise.
    """
    return (
        Answer("What is wrong", tuple(_wrong(verdict))),
        Answer("How sure is that", tuple(_sure(verdict))),
        Answer("What it costs", tuple(_costs(verdict))),
        Answer("What to do next", tuple(_next(verdict)), _command(verdict, scenario, extended)),
        Answer("What would settle it", tuple(_settles(verdict))),
    )


def _command(verdict: Verdict, scenario: str, extended: str) -> str:
    """Return the line of the shell for the next step, "" if there is none."""
    scenario = shlex.quote(scenario)
    if verdict.on_model in (CALIBRATED, NOTHING_NEAR):
        return f"subzero calibrate RECORDS --scenario {scenario} --out my_vehicle.toml"
    return f"subzero simulate {scenario} --with {extended}" if _is_new(verdict) else ""


def _is_new(verdict: Verdict) -> bool:
    """Say whether the extended model has anything that the nominal one has not."""
    return verdict.on_model in (CAUSE_NAMED, OUT_OF_CATALOGUE) and (
        bool(verdict.extended.deviations) or verdict.extended.missing is not None
    )


def _wrong(verdict: Verdict) -> Iterator[str]:
    """Yield the faults: errors in the data first, then those of the model on records without them."""
    if verdict.then or verdict.verdict == UNDECIDED:
        yield from (words.data_error(error) for error in verdict.data_errors)
    if verdict.then:
        yield words.UNCHANGED
    if verdict.on_model == CAUSE_NAMED:
        yield from (words.cause_in_short(cause) for cause in verdict.causes)
    elif verdict.on_model == OUT_OF_CATALOGUE and verdict.unknown is not None:
        said = words.unknown(verdict.unknown)
        own, _ = _unknown_shares(verdict)
        yield said if own >= IN_EVERY else f"Most probably: {said[:1].lower()}{said[1:]}"
    else:
        if verdict.on_model == UNDECIDED:
            yield from _in_every_explanation(verdict)
        yield words.on_model(verdict)


def _in_every_explanation(verdict: Verdict) -> Iterator[str]:
    """Yield the causes that hardly any probable explanation lacks: they are known, however undecided the rest is."""
    parts = {
        name: without.split(" + ")
        for name in verdict.probabilities
        if (without := words.without_errors(name, verdict)) != "none"
    }
    for cause in dict.fromkeys(part for ids in parts.values() for part in ids):
        probability = sum(verdict.probabilities[name] for name, ids in parts.items() if cause in ids)
        if probability < IN_EVERY:
            continue
        fitted = next((rival.parameters[cause] for rival in verdict.rivals if cause in rival.parameters), {})
        sentence = words.explanation(cause, words.sentences(verdict))
        known = Cause(id=cause, sentence=sentence, probability=probability, parameters=fitted)
        yield f"In every explanation (probability {words.probability(probability)}): {words.cause_in_short(known)}"


def _sure(verdict: Verdict) -> Iterator[str]:
    """Yield the probability of the verdict, the runner-up, and whether these records can tell the two apart."""
    probability = _probability(verdict)
    for error in verdict.data_errors if verdict.then else ():
        yield f"That {error.sentence}: {_in_words(error.probability).lower()}."
    if verdict.on_model == UNDECIDED:
        yield "Not sure enough to name one of them."
    elif verdict.on_model == OUT_OF_CATALOGUE:
        yield from _sure_of_unknown(verdict)
    elif probability is not None:
        sure = f"{_in_words(probability)} (probability {words.probability(probability)})."
        nothing = f"That nothing {'else ' if verdict.then else ''}is wrong: {sure[:1].lower()}{sure[1:]}"
        yield nothing if verdict.on_model == NOTHING_WRONG else sure
    if verdict.on_model == NOTHING_NEAR:
        yield "No probability says anything here: all are of explanations that do not fit."
    elif verdict.on_model in (NOTHING_WRONG, CALIBRATED):
        yield from _undetectable(verdict)
    elif verdict.on_model != UNDECIDED:
        yield from _runner_up(verdict)
    for record in verdict.unstable:
        yield (
            f"The motion of '{record}' is unstable, and no simulation follows it for long: what the best one leaves "
            "says little, and a force least of all."
        )
    if not verdict.complete:
        yield "The diagnosis was interrupted: this is as far as it came."


def _probability(verdict: Verdict) -> float | None:
    """Return the probability of the reported explanation; of several causes the lowest; None if it is not known."""
    if verdict.on_model == CAUSE_NAMED and verdict.causes:
        return min(cause.probability for cause in verdict.causes)
    if verdict.on_model in (OUT_OF_CATALOGUE, NOTHING_WRONG):
        reported = [p for name, p in verdict.probabilities.items() if words.is_reported(name, verdict)]
        return sum(reported) if reported else None
    return None


def _sure_of_unknown(verdict: Verdict) -> Iterator[str]:
    """Yield how sure it is that anything acts which no cause explains, and that it is the one that is reported."""
    anything = sum(p for name, p in _seen(verdict).items() if _unknown_in(name))
    yield (
        f"That something acts which is no cause of the catalogue: {_in_words(anything).lower()} "
        f"(probability {words.probability(anything)})."
    )
    own, others = _unknown_shares(verdict)
    if own < IN_EVERY and others:
        listed = "; ".join(f"{words.explanation(id)} ({p:.2f})" for id, p in others.items())
        yield f"That it is this: {words.probability(own)}. In its place may be: {listed}."


def _unknown_shares(verdict: Verdict) -> tuple[float, dict[str, float]]:
    """Return the probability of the reported force or drift, over all explanations; and those of others that may be in
    its place, the most probable first.
    """
    unknown, found = verdict.unknown, dict[str, float]()
    assert unknown is not None
    reported = f"{words.DRIFT if unknown.is_drift else words.FORCE}{unknown.axis}"
    own = 0.0
    for name, p in _seen(verdict).items():
        ids = _unknown_in(name)
        if reported in ids:
            own += p
        else:
            found |= {id: found.get(id, 0.0) + p for id in ids}
    others = sorted(found.items(), key=lambda pair: -pair[1])
    return own, {id: p for id, p in others if p >= WORTH_A_LINE}


def _seen(verdict: Verdict) -> dict[str, float]:
    """Return the probabilities of explanations, whatever may be added to each that these records do not show."""
    seen = {name: p for name, p in verdict.probabilities.items() if name != UNSEEN}
    return {name: p / sum(seen.values()) for name, p in seen.items()}


def _unknown_in(name: str) -> list[str]:
    """Return the forces and drifts of an explanation."""
    return [id for id in name.split(" + ") if id.startswith((words.FORCE, words.DRIFT))]


def _in_words(probability: float) -> str:
    """Return a probability in words."""
    return next((said for least, said in SURE.items() if probability >= least), "Not sure")


def _undetectable(verdict: Verdict) -> Iterator[str]:
    """Yield the undetectable causes, on which "nothing is wrong" makes no statement."""
    rows = verdict.detectable
    hidden = [words.explanation(row.id) for row in rows if row.signal < SEEN_SIGNAL]
    if not rows:
        return
    yield (
        f"These records would have shown {len(rows) - len(hidden)} of the {len(rows)} causes of the catalogue at "
        "their usual size."
    )
    if hidden:
        more = f", and {len(hidden) - MOST_HIDDEN} more" if len(hidden) > MOST_HIDDEN else ""
        yield f"They could not have shown: {'; '.join(hidden[:MOST_HIDDEN])}{more}."


def _runner_up(verdict: Verdict) -> Iterator[str]:
    """Yield the most probable explanation after the reported one, and its distance where that is known."""
    others = [name for name in verdict.probabilities if not words.is_reported(name, verdict)]
    if not others:
        return
    first = max(others, key=lambda name: verdict.probabilities[name])
    said, ids = words.with_errors(first, verdict), words.without_errors(first, verdict)
    said = f"What comes next: {said} (probability {words.probability(verdict.probabilities[first])})"
    D = next(
        (rival.discrimination for rival in verdict.rivals if (" + ".join(rival.ids) or "none") == ids),
        math.nan,
    )
    yield f"{said}{_apart(D)}."


def _apart(D: float) -> str:
    """Return whether these records can tell two explanations apart; "" where that is not known."""
    if not math.isfinite(D):
        return ""
    apart = (
        "cannot tell the two apart"
        if D < CONFUSED_BELOW
        else "can hardly tell the two apart"
        if D < CLEAR_FROM
        else "can tell the two apart"
    )
    return f"; these records {apart} (D {D:.3g})"


def _costs(verdict: Verdict) -> Iterator[str]:
    """Yield the error of the simulation, on data that were not fitted if there are such, and the gain."""
    if verdict.gain is not None and (verdict.gain.held_out or verdict.gain.fitted):
        yield from _gained(verdict)
        return
    rows = {
        (record, name): channel
        for record, channels in verdict.misfit.items()
        for name, channel in channels.items()
    }
    worst = sorted(rows, key=lambda key: -_finite(rows[key].nrmse))[:MOST_CHANNELS]
    if not worst:
        yield "That was not measured."
    elif rows[worst[0]].nrmse < WITHIN_NOISE:
        yield "Nothing: what the simulation leaves unexplained is the noise of the sensors."
    else:
        misses = _joined(
            [_miss(name, rows[record, name].rmse, rows[record, name].nrmse) for record, name in worst]
        )
        yield f"Root mean square, the simulation misses {misses}."
        yield from _best_misses(verdict, worst)


def _best_misses(verdict: Verdict, worst: list[tuple[str, str]]) -> Iterator[str]:
    """Yield the remaining errors where the model is not extended: of the calibrated or the most probable model."""
    first = max(verdict.probabilities, key=lambda name: verdict.probabilities[name], default="none")
    known = {
        f"rival: {first}": "the most probable explanation",
        "tolerance": "numbers bent within their tolerances",
    }
    for model, said in known.items():
        left = [_left(verdict, record, name, model) for record, name in worst]
        if all(math.isfinite(each) for each in left):
            sizes = [words.number(each, _unit(name)) for each, (_, name) in zip(left, worst, strict=True)]
            yield f"With {said} that is {_joined(sizes)}."
            return


def _left(verdict: Verdict, record: str, channel: str, model: str) -> float:
    """Return the root mean square residual of a model at the used samples; NaN if that is not known."""
    curves = verdict.curves.get(record)
    if curves is None or model not in curves.models or channel not in curves.measured:
        return math.nan
    residual = curves.measured[channel] - curves.models[model][channel]
    residual = residual[curves.used.get(channel, np.isfinite(residual))]
    return float(np.sqrt(np.mean(residual**2))) if residual.size else math.nan


def _gained(verdict: Verdict) -> Iterator[str]:
    """Yield the error before and after; a gain of zero is stated as such."""
    gain = verdict.gain
    if gain is None:
        return
    rows = gain.held_out or gain.fitted
    ratio: Callable[[str], float] = lambda name: _finite(rows[name].before / rows[name].floor)  # noqa: E731
    worst = sorted(rows, key=lambda name: -ratio(name))[:MOST_CHANNELS]
    misses = _joined([_miss(name, rows[name].before, ratio(name)) for name in worst])
    after = _joined([words.number(rows[name].after, _unit(name)) for name in worst])
    yield f"Root mean square, the simulation misses {misses}; with the extended model it is {after}."
    if not gain.total > 0.0:
        yield "On data that were not fitted the extended model is no better than the nominal one: predict with neither."
        return
    share = f"{100.0 * gain.total:.1f} %"
    yield f"The extended model explains {share} of what can be explained of data that were not fitted ({gain.how})."
    if not gain.owed_low > 0.0:
        yield (
            "Over a model without it, whose numbers are bent as far as that takes, the gain is not significant (95 % "
            "bound below 0): it is told because far less has to be bent with it."
        )


def _miss(channel: str, error: float, levels: float) -> str:
    times = f", {_times(levels)} times the noise of its sensor" if math.isfinite(levels) else ""
    return f"the {channel.replace('_', ' ')} by {words.number(error, _unit(channel))}{times}"


def _times(levels: float) -> str:
    return f"{levels:.0f}" if levels >= 9.5 else f"{levels:.2g}"


def _next(verdict: Verdict) -> Iterator[str]:
    """Yield the next steps with the records, the vehicle and the model."""
    for error in verdict.data_errors if verdict.then else ():
        yield f"In {error.record}, {' and '.join(error.columns)}: {error.remedy}."
    if verdict.on_model == CAUSE_NAMED:
        places = list(dict.fromkeys(filter(None, (_place(cause.id) for cause in verdict.causes))))
        yield from (f"Look at {place}." for place in places)
    elif verdict.on_model == OUT_OF_CATALOGUE and verdict.unknown is not None:
        unknown = verdict.unknown
        yield (
            "Look at that sensor: its drift is corrected in the comparison, not in the record."
            if unknown.is_drift
            else f"Look for what {words.something(unknown.axis, unknown.force).partition(' ')[2]}; "
            "the figure below says when."
        )
    elif verdict.on_model == UNDECIDED:
        yield (
            "Fly one more trial, below, before anything is changed."
            if verdict.next_trial
            else ("Look at what the explanations have in common, or log another channel.")
        )
    elif verdict.on_model == CALIBRATED:
        yield "Calibrate the vehicle with these records and others, and diagnose them again with the calibrated one:"
    elif verdict.on_model == NOTHING_NEAR:
        yield (
            "Hold the record against its trial: units, signs, commands, the clock, the vehicle, the cable. If they are "
            "right, numbers of the vehicle may be far off; estimate them:"
        )
    elif not verdict.then:
        yield "Nothing has to be done."
    if _is_new(verdict):
        yield "Until it is repaired, simulate with the extended model:"


def _place(cause: str) -> str:
    return LOOK_AT.get(words.description_of(cause).get("slot", ""), "")


def _settles(verdict: Verdict) -> Iterator[str]:
    """Yield the trial or channel that would decide the open questions."""
    if verdict.next_trial is not None:
        yield words.next_trial(verdict.next_trial)
    elif verdict.on_model == OUT_OF_CATALOGUE:
        yield (
            "Another trial of the same kind: what comes again belongs to the vehicle, what does not was an event. "
            "A trial with other commands says what it goes with."
        )
    elif verdict.on_model == CAUSE_NAMED:
        yield "A trial with other commands: the extended model has to explain it without another fit."
    elif verdict.on_model == NOTHING_WRONG:
        yield "A manoeuvre or a sensor that shows what these records could not have shown, in the last table."
    elif verdict.on_model == CALIBRATED:
        yield "`subzero calibrate` tells which numbers it is, how far, and which trial would determine the rest."
    else:
        yield (
            "A longer look: the verdict is of the first one."
            if not verdict.complete
            else "Another manoeuvre, or another sensor."
        )


def _unit(channel: str) -> str:
    return BY_NAME[channel].unit if channel in BY_NAME else ""


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def _joined(parts: list[str]) -> str:
    return " and ".join(parts)
