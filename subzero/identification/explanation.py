"""An explanation is a set of terms: each brings free numbers with a prior, changes the record or a prior, and has a
sentence.

    cause                numbers of an effect that is off by default, or a parameter that moves beyond its tolerance
    cause from a time    the same, with the time as a free number
    unknown              an input that is 0 in a healthy model has some history, throughout or for a time
    tolerances           every parameter may move four times as far as its tolerance: a calibration, no cause
    data error           y = a + b x of a channel, with free a and b or at known values, throughout or from a time on
    drift                of a channel, a line in time
    delay                another clock, of a channel or of all of them
    rate                 a clock of all channels that runs fast or slow; of one channel, an error of the model's speed
                         looks the same, and would be named
    swapped              two channels have each other's readings
    input, exchanged     an input is recorded with the other sign or in another unit; two have each other's columns
    stuck                runs of equal readings say nothing
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from subzero.identification.model import Cause, Model

CLOCK = "clock"
"""Target of an error of the clock of all channels together."""
CLOCK_KINDS = ("delay", "rate")
"""Kinds of such errors, and of those of the times of one channel."""
AFFINE = "y = a + b x"
"""Of such errors an explanation has only one for each channel."""
WIDER = 4.0
"""How much wider the tolerances of a calibration are. [-]"""
TUNED_WIDER = 10.0
"""How much farther a parameter may be off that was tuned through a channel which is not trusted: it is no independent
evidence on that channel. [-]"""
GAIN_SCALE = 0.1
"""Usual error of the scale of a sensor (one standard deviation). [-]"""
BEYOND, OFFSET_LEVELS, RATE_SCALE = 10.0, 30.0, 0.03
"""Usual error of an offset or a drift, in tolerances of the sensor's zero, or in its levels where none is declared; of
the rate of a clock. [-]"""

PRIOR_CAUSE, MOST_LIKELY, PRIOR_TOLERANCES, PRIOR_DATA, PRIOR_NEXT_DATA = 0.5, 0.05, 0.1, 0.1, 0.3
"""Prior odds that any one cause acts, and most of a single one; that tolerances are too narrow; that the readings of a
channel have any one error; and of such an error in a logger that has one already. [-]"""
PRIOR_UNKNOWN = 0.02
"""Prior odds that any one input acts that is 0 in a healthy model. [-]"""

ONSET_ODDS = 0.2
"""Odds that a cause, or an error in the data, begins in the middle of a record, over those that it holds throughout.
[-]"""
ONSET_SHARES = tuple(np.arange(0.1, 0.95, 0.1).tolist())
"""Where a search for an onset begins, over the duration of a record. [-]"""

KNOWN: tuple[tuple[float, float, str, str], ...] = (
    (-1.0, 0.0, "the other sign", ""),
    (180.0 / math.pi, 0.0, "degrees for radians", r"rad"),
    (math.pi / 180.0, 0.0, "radians for degrees", r"deg|°"),
    (1.0 / 0.3048, 0.0, "feet for metres", r"m(/s)?$|dbar"),
    (0.3048, 0.0, "metres for feet", r"ft|feet"),
    (3.6 / 1.852, 0.0, "knots for m/s", r"m/s$"),
    (1.852 / 3.6, 0.0, "m/s for knots", r"kn"),
    (3.6, 0.0, "km/h for m/s", r"m/s$"),
    (10.0, 0.0, "ten times too large", ""),
    (0.1, 0.0, "ten times too small", ""),
    (100.0, 0.0, "a hundred times too large", ""),
    (0.01, 0.0, "a hundred times too small", ""),
    (1000.0, 0.0, "a thousand times too large", ""),
    (0.001, 0.0, "a thousand times too small", ""),
    (10.055, 0.0, "kPa for metres of sea water", r"m$|dbar"),
    (60.0, 0.0, "per minute for per second", r".*/s$"),
    (1.0 / 60.0, 0.0, "per second for per minute", r".*/min$"),
    (30.0 / math.pi, 0.0, "revolutions per minute for rad/s", r"rad/s$"),
    (math.pi / 30.0, 0.0, "rad/s for revolutions per minute", r"rpm|rev/min"),
    (2.0 * math.pi, 0.0, "rad/s for revolutions per second", r"rev/s$"),
)
"""Errors of a logger that people make: factor, offset in turns, words, and of which units (a regular expression; "" is
any). Each is a peak of the prior."""
OF_ACTUATORS = 5.0
"""A smaller factor of an input may be the gain of its actuator. [-]"""
KNOWN_ANGLES: tuple[tuple[float, float, str, str], ...] = (
    (1.0, 0.25, "a quarter of a turn too large", ""),
    (1.0, -0.25, "a quarter of a turn too small", ""),
    (1.0, 0.5, "half a turn off", ""),
    (-1.0, 0.25, "counted from east, against the clock", ""),
    (-1.0, 0.5, "counted from south, against the clock", ""),
    (-1.0, -0.25, "counted from west, against the clock", ""),
)
"""The same for angles."""


Identity = tuple[str, str, int, int, int]
"""What a free number is: its kind, name, record, knot and intervals."""


@dataclass(frozen=True)
class Entry:
    """A free number of an explanation.

    Attributes:
        kind: number, start, cause, change, since, unknown; of a sensor offset, step, gain, drift, delay, rate.
        name: of the parameter, cause and number ("overflow.lip"), unknown input, or channel.
        record: which it belongs to; −1 if all share it.
        centre, sd: mean and standard deviation of its prior. [its unit]
        low, high: bounds. [its unit]
        knot: of an unknown input.
        intervals: between the knots of that input in the record.
    """

    kind: str
    name: str
    centre: float
    sd: float
    record: int = -1
    low: float = -math.inf
    high: float = math.inf
    knot: int = 0
    intervals: int = 0

    @property
    def identity(self) -> Identity:
        """What it is, whatever its prior."""
        return (self.kind, self.name, self.record, self.knot, self.intervals)


@dataclass(frozen=True)
class Term:
    """A term of an explanation.

    Attributes:
        id: such as "overflow", "overflow@12", "scale:depth", "unit:depth".
        sentence: what it says, in words.
        kind: cause, unknown, tolerances, offset, scale, affine, unit, drift, delay, rate, swapped, stuck, input,
            exchanged.
        target: the cause, the channel, or the input.
        partner: the other one of two that are swapped or exchanged, or have both the other sign.
        odds: prior odds that it holds.
        begins: time from which it holds; −∞ throughout. [s]
        ends: time until which it holds. [s]
        spans: first and last times of the readings that are stuck. [s]
        intervals: between the knots of an unknown input in its record; as many as its time asks for if 0.
        record: in which it holds; −1 in all.
        factor, offset: known values of y = offset + factor x. [-], [unit of the channel]
        size: where a search begins, in standard deviations of its numbers.
        centre: mean of the prior of its number, where the readings have shown it. [s], or [-] of a rate
    """

    id: str
    sentence: str
    kind: str
    target: str = ""
    partner: str = field(default="", kw_only=True)
    odds: float = 0.01
    begins: float = -math.inf
    ends: float = math.inf
    record: int = -1
    factor: float = 1.0
    offset: float = 0.0
    size: float = 0.0
    centre: float = 0.0
    spans: tuple[tuple[float, float], ...] = ()
    intervals: int = 0

    @property
    def is_data_error(self) -> bool:
        """Whether it is about the record, not about the model."""
        return self.kind not in ("cause", "unknown", "tolerances")

    def about(self, target: str) -> Term:
        """Return the same error of another channel."""
        own = rf"\b{re.escape(self.target)}\b"
        id, sentence = (re.sub(own, target, words, count=1) for words in (self.id, self.sentence))
        return replace(self, id=id, sentence=sentence, target=target)

    @property
    def slot(self) -> tuple[str, str]:
        """What an explanation can have only one of: a channel's y = a + b x, one cause."""
        affine = ("offset", "scale", "affine", "unit")
        return (AFFINE if self.kind in affine else self.kind, "" if self.partner else self.target)


Terms = tuple[Term, ...]
"""An explanation; () is "nothing is wrong"."""


def with_term(terms: Terms, term: Term) -> Terms:
    """Return an explanation with one more term, in the place of one that says something about the same.

    What was said of two channels goes with their readings if these are exchanged.
    """
    kept = [_exchanged(other, term) for other in terms if other.slot != term.slot]
    return tuple(sorted([*kept, term], key=lambda other: other.id))


def without(terms: Terms, term: Term) -> Terms:
    """Return an explanation without a term."""
    return tuple(_exchanged(other, term) for other in terms if other.id != term.id)


def _exchanged(term: Term, swap: Term) -> Term:
    """Return a term about the other of two channels whose readings are exchanged."""
    pair = (swap.target, swap.partner)
    if swap.kind not in ("swapped", "exchanged") or not term.is_data_error or term.target not in pair:
        return term
    if term.partner:  # of two, which have both the same error
        return term
    return term.about(pair[term.target == pair[0]])


def log_prior(terms: Terms, loggers: dict[str, str]) -> float:
    """Return the log prior odds of an explanation over "nothing is wrong".

    Errors of one logger come together: every one after the first has the odds of the next, whatever its channel.
    """
    total, before = 0.0, set[str]()
    for term in sorted(terms, key=lambda term: -term.odds):
        if term.is_data_error:
            logger = loggers.get(term.target, "")
            total += math.log(term.odds * (PRIOR_NEXT_DATA / PRIOR_DATA if logger in before else 1.0))
            before.add(logger)
        else:
            total += math.log(term.odds)
    return total


def cause_terms(model: Model, durations: Sequence[float]) -> list[Term]:
    """Return a term of every cause, and of those that may begin in the middle of one of the records.

    Args:
        model: whose causes they are.
        durations: of the records. [s]
    """
    odds = min(PRIOR_CAUSE / max(len(model.causes), 1), MOST_LIKELY)
    found = []
    for cause in model.causes:
        throughout = Term(cause.id, cause.sentence, "cause", cause.id, odds)
        sizes = cause.sizes if cause.numbers else _sizes_of_change(cause, model)
        found += [replace(throughout, size=size) for size in sizes if cause.throughout]
        for k, duration in enumerate(durations if cause.onset else ()):
            late = replace(
                throughout,
                id=f"{cause.id}@{k if len(durations) > 1 else ''}",
                sentence=f"from some time on, {cause.sentence}",
                odds=ONSET_ODDS * odds / len(durations),
                ends=duration,
                record=k,
            )
            found += [replace(late, begins=share * duration) for share in ONSET_SHARES]
    return found


def _sizes_of_change(cause: Cause, model: Model) -> tuple[float, ...]:
    """Return where a search for the size of a change begins: also far from a nominal value at which a number is
    bounded, as friction, play or a limit may do nothing near it.
    """
    changed = [number for number in model.shared if number.name in cause.changes]
    sides = {1.0 for each in changed if each.low == each.nominal}
    sides |= {-1.0 for each in changed if each.high == each.nominal}
    return (0.0, *sorted(sides))


def unknown_terms(model: Model) -> list[Term]:
    """Return a term of every input that is 0 in a healthy model, and may act all the same."""
    odds = 0.5 * PRIOR_UNKNOWN / max(len(model.offered), 1)  # throughout; the rest is that it acts for a time
    return [
        Term(
            f"unknown:{each.name}",
            each.sentence or f"something acts on {each.name} that no cause of the list explains",
            "unknown",
            each.name,
            odds,
        )
        for each in model.offered
    ]


def tolerance_term(model: Model) -> Term:
    """Return the term of wider tolerances."""
    return Term(
        "tolerances",
        "the parameters are farther off than their tolerances say",
        "tolerances",
        "",
        PRIOR_TOLERANCES,
    )


def data_terms(model: Model) -> list[Term]:
    """Return terms of the errors that the data of every channel may have throughout, but for trusted channels."""
    found: list[Term] = []
    suspects = [name for name, sensor in model.channels.items() if not sensor.trusted]
    odds = PRIOR_DATA
    for name in suspects:
        sensor = model.channels[name]
        known = [
            (f, sensor.turn * turns, words)
            for f, turns, words, units in (*KNOWN, *(KNOWN_ANGLES if sensor.angle else ()))
            if not sensor.unit or re.match(units, sensor.unit)
        ]
        soft = [
            ("offset", "has an offset"),
            ("scale", "has an error of scale"),
            ("drift", "drifts"),
            ("delay", "is late or early against the inputs"),
        ]
        found += [
            Term(f"{kind}:{name}", f"{name} {words}", kind, name, odds / len(soft)) for kind, words in soft
        ]
        both = odds / len(soft) * PRIOR_NEXT_DATA / len(soft)  # an offset, and then an error of scale
        found.append(Term(f"affine:{name}", f"{name} has another scale and zero", "affine", name, both))
        found += [
            Term(
                f"unit:{name}",
                f"{name}: {words}",
                "unit",
                name,
                odds / len(known),
                factor=factor,
                offset=offset,
            )
            for factor, offset, words in known
        ]
    every = len(suspects) == len(model.channels)
    if every and len(suspects) > 1:
        sentence = "all channels are late or early, or the inputs early or late"
        found.append(Term(f"delay:{CLOCK}", sentence, "delay", CLOCK, PRIOR_DATA / 5.0))
    if every and len(suspects) > 2:  # two may as well show a model that is too slow
        sentence = "the clock of all channels runs fast or slow against that of the inputs"
        found.append(Term(f"rate:{CLOCK}", sentence, "rate", CLOCK, PRIOR_DATA / 5.0))
    pairs = list(combinations(suspects, 2))
    return found + [
        Term(
            f"swapped:{a}/{b}",
            f"{a} and {b} have each other's readings",
            "swapped",
            a,
            odds / len(pairs),
            partner=b,
        )
        for a, b in pairs
    ]


def input_terms(model: Model) -> list[Term]:
    """Return terms of the errors that the inputs of a record may have."""
    inputs = [name for name in model.inputs if name not in model.trusted_inputs]
    odds, pairs = PRIOR_DATA / max(len(inputs), 1), list(combinations(inputs, 2))
    known = [(f, words) for f, _, words, _ in KNOWN if f < 0.0 or max(f, 1.0 / f) > OF_ACTUATORS]
    units = [
        Term(f"input:{name}", f"the input {name}: {words}", "input", name, odds / len(known), factor=factor)
        for name in inputs
        for factor, words in known
    ]
    of_two = (
        ("input", -1.0, "have both the other sign"),
        ("exchanged", 1.0, "have each other's columns"),
    )
    return units + [
        Term(
            f"{kind}:{a}/{b}",
            f"the inputs {a} and {b} {words}",
            kind,
            a,
            odds / len(pairs),
            partner=b,
            factor=factor,
        )
        for kind, factor, words in of_two
        for a, b in pairs
    ]


def from_time(term: Term, record: int, time: float, share: float) -> Term:
    """Return a data error that begins at a time of a record [s], one of several: each has a share of the odds."""
    return replace(
        term,
        id=f"{term.id}@{record}",
        sentence=f"from {time:.4g} s on, {term.sentence}",
        begins=time,
        record=record,
        odds=ONSET_ODDS * share * term.odds,
    )


def entries_of(terms: Terms, model: Model, levels: dict[str, float], delays: dict[str, float]) -> list[Entry]:
    """Return the free numbers that terms bring, and those of the model with the prior that the terms leave them.

    Args:
        terms: of the explanation.
        model: whose parameters they are.
        levels: channel → level of its sensor. [unit]
        delays: channel → usual size of a delay. [s]
    """
    found = [
        Entry(
            "number",
            number.name,
            number.nominal,
            _spread(number.name, number.tolerance, terms, model),
            -1,
            number.low,
            number.high,
        )
        for number in model.shared
    ]
    causes = {cause.id: cause for cause in model.causes}
    for term in terms:
        if term.kind == "cause":
            found += _of_cause(causes[term.target], term, model)
    for name in levels:
        found += _of_sensor(name, model, terms, levels[name], delays[name])
    return found


def _spread(name: str, tolerance: float, terms: Sequence[Term], model: Model) -> float:
    """Return the prior standard deviation of a parameter under some terms."""
    causes = {cause.id: cause for cause in model.causes}
    variance = tolerance**2
    if any(term.kind == "tolerances" for term in terms):
        variance *= WIDER**2
    if any(not model.channels[channel].trusted for channel in model.tuned_on.get(name, ())):
        variance *= TUNED_WIDER**2
    variance += sum(
        causes[term.target].changes.get(name, 0.0) ** 2
        for term in terms
        if term.kind == "cause" and math.isinf(term.begins)
    )
    return math.sqrt(variance)


def _of_cause(cause: Cause, term: Term, model: Model) -> list[Entry]:
    numbers = {number.name: number for number in model.shared}
    found = [
        Entry(
            "cause",
            f"{cause.id}.{name}",
            number.nominal,
            number.tolerance,
            term.record,
            number.low,
            number.high,
        )
        for name, number in cause.numbers.items()
    ]
    if math.isfinite(term.begins):
        found += [
            Entry(
                "change",
                f"{cause.id}.{name}",
                0.0,
                size,
                term.record,
                own.low - own.nominal,
                own.high - own.nominal,
            )
            for name, size in cause.changes.items()
            for own in [numbers[name]]
        ]
        spread = term.ends / math.sqrt(2.0 * math.pi)
        found.append(Entry("since", cause.id, term.begins, spread, term.record, 0.0, term.ends))
    return found


OF_TERM: dict[str, tuple[str, ...]] = {
    "offset": ("offset",),
    "scale": ("gain",),
    "affine": ("offset", "gain"),  # about the regression, which is in the term
    "drift": ("drift",),
    "delay": ("delay",),
    "rate": ("rate",),
}
"""Kind of a term → kinds of the numbers of a sensor that it frees; of an offset from a time on, "step"."""


def kinds_of(term: Term) -> tuple[str, ...]:
    """Return the kinds of the numbers that an error in the data frees."""
    return ("step",) if term.kind == "offset" and math.isfinite(term.begins) else OF_TERM.get(term.kind, ())


def _of_sensor(name: str, model: Model, terms: Terms, level: float, delay: float) -> list[Entry]:
    """Return the numbers of a sensor that are not fixed: within their tolerances, or free."""
    sensor = model.channels.get(name)
    usual = {"offset": sensor.zero, "gain": sensor.scale, "delay": sensor.late} if sensor else {}
    off = BEYOND * sensor.zero if sensor and sensor.zero else OFFSET_LEVELS * level
    free = {kind for term in terms if term.is_data_error and term.target == name for kind in kinds_of(term)}
    wide = {
        "offset": off,
        "step": OFFSET_LEVELS * level,  # a jump has nothing to do with how well the zero is set
        "drift": off,
        "gain": GAIN_SCALE,
        "delay": delay,
        "rate": RATE_SCALE,
    }
    spreads = {kind: math.hypot(usual.get(kind, 0.0), wide[kind] * (kind in free)) for kind in wide}
    centre = {term.kind: term.centre for term in terms if term.target == name and term.kind in CLOCK_KINDS}
    bounds = {"gain": (-0.9, 9.0)}
    return [
        Entry(kind, name, centre.get(kind, 0.0), sd, -1, *bounds.get(kind, (-math.inf, math.inf)))
        for kind, sd in spreads.items()
        if sd > 0.0
    ]
