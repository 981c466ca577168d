"""Is the model near at all? For each channel what the best explanation leaves; how large the unknown inputs have to be;
how far parameters that it does not name are from their nominal values.

    R = rms(residual) / level of the sensor     after the unknown inputs, and in a free simulation without them
    size / declared size                            of every unknown input that no term names
    |θ − c| / τ                                     of every parameter that no term names
    rms(residual), histories of unknown inputs at 0         of a channel that another unit makes small

Where one of them is large, no cause and no error in the data is named, whatever its probability: evidence compares
explanations with each other, not with the truth (Kennedy & O'Hagan 2001; Brynjarsdóttir & O'Hagan 2014).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from subzero.identification.explanation import CLOCK, kinds_of
from subzero.identification.fit import Fit, Linear
from subzero.identification.problem import Problem

NEAR_RATIO = 1.4
"""Largest ratio of the residual, after the unknown inputs, to the most that a sensor errs; and of an unknown input's
size to the declared one: where a model misses more than its author says, its parameters suit that, too. [-]"""
NEAR_BEND = 4.0
"""Farthest that a parameter which is not named may be from its nominal value, in tolerances. [-]"""

EXPLAINED = 0.5
"""A model that leaves a larger share of the squares of a channel does not explain it. [-]"""
QUIET = 3.0
"""A channel that shows no more than noise is not so many times quieter than its sensor. [-]"""

SOFT_KINDS = ("offset", "scale", "drift")
"""Kinds of errors in the data that an error of a model looks like."""


@dataclass(frozen=True)
class Left:
    """What an explanation leaves of a channel, root mean squares. [unit of the channel]

    Attributes:
        channel: its name.
        unit: as it is shown.
        level: of its sensor.
        most: that it errs, as well as that is known.
        free: left by a free simulation, unknown inputs at 0.
        followed: left where the unknown inputs follow the record.
    """

    channel: str
    unit: str
    level: float
    most: float
    free: float
    followed: float

    @property
    def ratio(self) -> float:
        """R of the free simulation."""
        return self.free / self.level


@dataclass(frozen=True)
class Nearness:
    """How near the best explanation is to the records.

    Attributes:
        left: of every channel.
        sizes: unknown input that is part of every explanation → (its size, the declared one). [unit of the input]
        bends: parameter that is not named → its deviation, in tolerances; the farthest first.
        reasons: why the model is not near; () if it is.
    """

    left: tuple[Left, ...]
    sizes: dict[str, tuple[float, float]]
    bends: dict[str, float]
    reasons: tuple[str, ...]

    @property
    def near(self) -> bool:
        """Whether causes and errors in the data may be named."""
        return not self.reasons


def nearness(problem: Problem, fitted: Fit, free: Fit) -> Nearness:
    """Return how near an explanation is, given its fit, and that in free simulation."""
    left = left_by(problem, fitted, free)
    sizes = {
        unknown.name: (fitted.linear.levels.sizes[unknown.name] * unknown.size, unknown.size)
        for unknown in problem.model.always
    }
    bends = _bends(problem, fitted)
    reasons = [
        f"{each.channel}: {each.followed:.3g} {each.unit} are left, {each.followed / each.most:.1f} times what its "
        f"sensor may err ({each.most:.3g})"
        for each in left
        if each.followed > NEAR_RATIO * each.most
    ]
    reasons += [
        f"the model misses an input {name!r} of {size:.3g}, {size / declared:.1f} times the declared size"
        for name, (size, declared) in sizes.items()
        if size > NEAR_RATIO * declared
    ]
    reasons += [
        f"{name} has to be {bend:.1f} tolerances off its nominal value"
        for name, bend in bends.items()
        if bend > NEAR_BEND
    ]
    reasons += [
        f"{name} is not explained, however small another unit makes it" for name in _unlike(problem, fitted)
    ]
    if _errs_everywhere(problem, fitted):
        reasons.append(
            "every sensor has to be off (by an offset, a scale or a drift): none agrees with the model"
        )
    return Nearness(tuple(left), sizes, bends, tuple(reasons))


def _errs_everywhere(problem: Problem, fitted: Fit) -> bool:
    """Return whether an explanation leaves none of several sensors as it is: then no reading bears witness to the
    model, and an error of the model looks the same.
    """
    soft = {term.target for term in fitted.terms if term.kind in SOFT_KINDS}
    return len(problem.channels) > 1 and soft >= set(problem.channels)


def _unlike(problem: Problem, fitted: Fit) -> Iterator[str]:
    """Yield the channels that an explanation divides by a factor, and that the model then does not explain by itself,
    histories of unknown inputs and drifts at 0: whatever is made small enough is near any simulation.

    What shows no more than noise must then have the noise that its sensor has, with another channel that shows more.
    """
    moves = {name for name in problem.channels if _moves(problem, fitted, name)}
    found = _without_histories(problem, fitted)
    for term in fitted.terms:
        if term.kind not in ("unit", "affine") or abs(term.factor) <= 1.0:
            continue
        name, each = term.target, problem.readings_of(term.target, fitted.terms)
        at = problem.where(each, term) & problem.used(name, fitted.terms)
        level, left = problem.levels(fitted.terms)[name], rms(found[name][at])
        most = most_left(problem, name, level)
        shown = problem.recorded(name, fitted.terms)[at]
        if problem.model.channels[name].angle or term.offset:  # its zero says nothing
            shown = shown - np.mean(shown)
        drifts = any(other.kind == "drift" and other.target == name for other in fitted.terms)
        shows_noise, is_missed = rms(shown) <= most, not left**2 < EXPLAINED * rms(shown) ** 2
        if (left > most and (drifts or is_missed)) or (
            shows_noise and (QUIET * left < level or not moves - {name})
        ):
            yield name


def _moves(problem: Problem, fitted: Fit, name: str) -> bool:
    """Return whether a channel shows more than noise about its mean."""
    shown = problem.recorded(name, fitted.terms)[problem.used(name, fitted.terms)]
    return float(np.std(shown)) > most_left(problem, name, problem.levels(fitted.terms)[name])


def _without_histories(problem: Problem, fitted: Fit) -> dict[str, np.ndarray]:
    """Return channel → what an explanation leaves (m,) with unknown inputs and drifts at 0, all else as it is."""
    x = np.where([entry.kind in ("unknown", "drift") for entry in fitted.entries], 0.0, fitted.x)
    found, _ = problem.residuals(fitted.terms, fitted.entries, [x])
    return {name: e[:, 0] for name, e in found.items()}


def rests_on_histories(problem: Problem, fitted: Fit) -> bool:
    """Return whether there is a channel of which a model explains less than half without unknown inputs and drifts."""
    return any(
        share > EXPLAINED and left > most_left(problem, name, problem.levels(fitted.terms)[name])
        for name, left, share in _unexplained(problem, fitted)
    )


def witnesses(problem: Problem, fitted: Fit) -> set[str]:
    """Return the channels of which a model explains more than half without unknown inputs and drifts, with no error in
    their data but a known unit: none if their clock has one, which moves all of them to suit the model.
    """
    soft = {term.target for term in fitted.terms if term.is_data_error and term.kind != "unit"}
    if CLOCK in soft:
        return set()
    return {
        name
        for name, _, share in _unexplained(problem, fitted)
        if share < EXPLAINED and name not in soft and _moves(problem, fitted, name)
    }


def _unexplained(problem: Problem, fitted: Fit) -> Iterator[tuple[str, float, float]]:
    """Yield every channel with what an explanation leaves of it without unknown inputs and drifts, root mean square,
    and which share of the squares of the readings about their mean that is.
    """
    for name, e in _without_histories(problem, fitted).items():
        used = problem.used(name, fitted.terms)
        left = rms(e[used])
        variance = float(np.var(problem.recorded(name, fitted.terms)[used]))
        yield name, left, left**2 / variance if variance > 0.0 else np.inf


def follows(problem: Problem, fitted: Fit) -> bool:
    """Return whether an explanation leaves no more of a channel than its sensor may err."""
    levels = problem.levels(fitted.terms)
    return all(
        rms(fitted.linear.e[name][problem.used(name, fitted.terms)]) <= most_left(problem, name, level)
        for name, level in levels.items()
        if name in problem.channels
    )


def most_left(problem: Problem, name: str, level: float) -> float:
    """Return the most that an explanation leaves of a channel if it is near, root mean square. [unit of the channel]"""
    return NEAR_RATIO * _most(problem, name, level)


def _most(problem: Problem, name: str, level: float) -> float:
    """Return the most that a sensor errs, as well as its level is known. [unit of the channel]"""
    return level * float(np.exp(problem.prior(name).spread))


def levels_left(problem: Problem, linear: Linear, levels: Mapping[str, float]) -> float:
    """Return the remainder of all channels together, root mean square, in levels of their sensors."""
    e = linear.e
    return rms(np.concatenate([e[name][problem.used(name, linear.terms)] / levels[name] for name in e]))


def left_by(problem: Problem, fitted: Fit, free: Fit) -> list[Left]:
    """Return what an explanation leaves of every channel."""
    levels = problem.levels(fitted.terms)
    return [
        Left(
            name,
            problem.model.channels[name].unit,
            levels[name],
            _most(problem, name, levels[name]),
            rms(free.linear.e[name][used]),
            rms(fitted.linear.e[name][used]),
        )
        for name in problem.channels
        for used in [problem.used(name, fitted.terms)]
    ]


def rms(values: np.ndarray) -> float:
    """Return the root mean square of values (m,); infinite if one is not finite."""
    return float(np.sqrt(np.mean(values**2))) if np.isfinite(values).all() else float("inf")


def _bends(problem: Problem, fitted: Fit) -> dict[str, float]:
    """Return how far parameters that no term names are from their nominal values, in tolerances."""
    tolerance = {("number", number.name): number.tolerance for number in problem.model.shared}
    for name, sensor in problem.model.channels.items():
        tolerance |= {
            ("offset", name): sensor.zero,
            ("gain", name): sensor.scale,
            ("delay", name): sensor.late,
        }
    named = {
        ("number", name)
        for cause in problem.model.causes
        for name in cause.changes
        if cause.id in {t.target for t in fitted.terms}
    }
    named |= {(kind, term.target) for term in fitted.terms for kind in kinds_of(term)}
    calibrated = any(term.kind == "tolerances" for term in fitted.terms)
    found = {
        entry.name if entry.kind == "number" else f"{entry.kind} of {entry.name}": abs(value - entry.centre)
        / (entry.sd if calibrated or entry.name in problem.model.tuned_on else tolerance[key])
        for entry, value in zip(fitted.entries, fitted.x.tolist(), strict=True)
        for key in [(entry.kind, entry.name)]
        if tolerance.get(key, 0.0) > 0.0 and key not in named
    }
    return dict(sorted(found.items(), key=lambda pair: -pair[1]))
