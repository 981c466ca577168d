"""The numbers that are free in a calibration, with their priors; and other numbers that may deviate a little.

A number of the vehicle's (or the cable's) file becomes an effect, in the terms of a diagnosis: a deviation z of the
number in its own unit, with a prior N(0, σ²), σ the width of the range of the file and no less than `LEAST_PRIOR_SHARE`
of the number. All effects of the catalogue that move none of them remain free within their tolerances.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from scenarios.parts import changeable
from subzero.diagnosis.hypothesis.catalogue import START
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter
from subzero.diagnosis.hypothesis.hypotheses import Entry, entries_of, number_of, small_deviation
from subzero.diagnosis.inference import Problem
from subzero.errors import UserError, suggestion

USUAL = (
    "vehicle.axial_drag.drag_coefficient",
    "vehicle.rigid_body.yaw_inertia",
    "vehicle.rigid_body.centre_of_gravity_z",
    "vehicle.added_mass.munk_factor",
    "vehicle.body_lift.sway_per_sway",
    "vehicle.propeller.thrust_constant",
    "vehicle.propeller.thrust_slope",
    "vehicle.propeller.reaction_torque_factor",
    "vehicle.motor.lag",
    "vehicle.rudder.lift_slope",
    "vehicle.rudder_servo.lag",
    "vehicle.stern_planes.lift_slope",
)
"""What a rudder and a plane manoeuvre with a change of speed determine within 20 % on both shipped vehicles. The mass
is none of them: masses and forces that all scale together move nothing, and a vehicle can be weighed."""

LEAST_PRIOR_SHARE = 0.4
"""A prior is no narrower than this share of the number, since ranges are estimates of an author. [-]"""
STEP_SHARE = 0.03
"""A number has moved if it has by this share of itself, or of its range if it is 0: the unit of fits and steps. [-]"""
LOWEST_SHARE, HIGHEST_SHARE = -0.9, 5.0
"""A number may change by these shares of itself: coefficients, masses and lags keep their sign. [-]"""
WIDEST_RANGES = 5.0
"""A number that is zero may move this many widths of its range. [-]"""
MOVED = 1e-12
"""An effect that changes a number by less than this share does not touch it. [-]"""


@dataclass(frozen=True, kw_only=True)
class Number:
    """A number that is free.

    Attributes:
        name: dotted.
        unit: of its file.
        nominal: the number in the file.
        prior_sd: standard deviation of its deviation, beforehand.
        tolerance: how far a healthy vehicle may be from a number that is known.
        step: a deviation that is noticeable.
        low, high: deviations that are possible.
    """

    name: str
    unit: str
    nominal: float
    prior_sd: float
    tolerance: float
    step: float
    low: float
    high: float

    def effect(self) -> Effect:
        """Return the deviation of the number as an effect."""
        parameter = Parameter(
            name="deviation",
            unit=self.unit,
            tolerance=self.step,
            scale=self.prior_sd,
            low=self.low,
            high=self.high,
        )
        return Effect(
            id=self.name,
            sentence=f"{self.name} is another",
            slot="hull",
            parameters=(parameter,),
            apply=partial(with_deviation, self.name),
        )


def with_deviation(name: str, setting: Setting, deviation: float) -> Setting:
    """Return a setting with a number of its vehicle, cable or drum changed by a deviation, in the unit of the file."""
    part, _, key = name.partition(".")
    if part == "vehicle":
        return setting.with_vehicle(**{key.replace(".", "__"): lambda old: old + deviation})
    change = setting.with_cable if part == "cable" else setting.with_drum
    return change(**{key: getattr(getattr(setting.model, part), key) + deviation})


def full_name(name: str) -> str:
    """Return the dotted name of a number, for which "vehicle." may be left out.

    Raises:
        UserError: there is no such number.
    """
    known = changeable()
    for number in (name, f"vehicle.{name}"):
        if number in known:
            return number
    last = [each for each in known if each.rpartition(".")[2] == name.rpartition(".")[2]]
    hint = f" Did you mean '{last[0]}'?" if last else suggestion(name, known)
    raise UserError(
        f"Nothing is called '{name}' in a vehicle or a cable, so it cannot be free.{hint} Write "
        "section.key as in its file, such as axial_drag.drag_coefficient, or cable.key."
    )


def numbers_of(
    problem: Problem, names: Sequence[str], ranges: Mapping[str, tuple[float, float]]
) -> list[Number]:
    """Return the numbers that are free.

    Args:
        problem: of the records, with the whole catalogue.
        names: dotted, as `full_name` gives them.
        ranges: dotted name → least and greatest plausible value, of the files.

    Raises:
        UserError: nothing says how far a number that is zero may be off.
    """
    return [_number(problem, name, ranges.get(name)) for name in names]


def _number(problem: Problem, name: str, declared: tuple[float, float] | None) -> Number:
    nominal, leaf = number_of(name, problem.records[0].setting), changeable()[name]
    low, high = declared if declared is not None else (nominal, nominal)
    width = high - low
    if nominal == 0.0 and not width > 0.0:
        raise UserError(
            f"'{name}' is 0 and its file gives no range, so nothing says how far it may be off. Add "
            "range = [least, greatest] to it, or leave it out of the free ones."
        )
    step = STEP_SHARE * (abs(nominal) or width)
    at_least, at_most = _bounds(nominal, low, high)
    limits = leaf.get("limits", (-math.inf, math.inf))
    prior = max(width, LEAST_PRIOR_SHARE * abs(nominal))
    return Number(
        name=name,
        unit=str(leaf["unit"]),
        nominal=nominal,
        prior_sd=prior,
        step=step,
        tolerance=_tolerance(problem, name) or step,
        low=max(at_least, limits[0] - nominal),
        high=min(at_most, limits[1] - nominal),
    )


def _tolerance(problem: Problem, name: str) -> float:
    """Return by how much a number may deviate in a diagnosis: its declared tolerance, or that of causes that move
    it.
    """
    setting = problem.records[0].setting
    if name in setting.trial.tolerances:
        return float(setting.trial.tolerances[name])
    effects = dict.fromkeys(entry.effect for entry in problem.entries if entry.record < 0)
    return max(
        (abs(number_of(name, _moved(effect, setting)) - number_of(name, setting)) for effect in effects),
        default=0.0,
    )


def _moved(effect: Effect, setting: Setting) -> Setting:
    """Return a setting with an effect as large as its tolerance."""
    return effect.apply(setting, *map(small_deviation, effect.parameters))


def _bounds(nominal: float, low: float, high: float) -> tuple[float, float]:
    """Return the least and the greatest possible deviation: a number with a sign keeps it."""
    if nominal != 0.0:
        ends = (LOWEST_SHARE * nominal, HIGHEST_SHARE * nominal)
        return min(ends), max(ends)
    far = WIDEST_RANGES * (high - low)
    return (0.0 if low == 0.0 else -far), (0.0 if high == 0.0 else far)


def with_free_numbers(problem: Problem, numbers: Sequence[Number]) -> tuple[Problem, np.ndarray]:
    """Return the problem in which numbers are free, and the prior variances of all its entries (k,).

    In addition to the numbers, those causes of the catalogue that move none of them remain free, within tolerance.
    """
    setting = problem.records[0].setting
    effects = list(dict.fromkeys(entry.effect for entry in problem.entries if entry.record < 0))
    nuisances = [
        effect for effect in effects if not _touches(effect, setting, [number.name for number in numbers])
    ]
    free = [number.effect() for number in numbers]
    entries = entries_of((*free, *nuisances), START, len(problem.records))
    made = Problem(records=problem.records, entries=entries, pool=problem.pool)
    return made, prior_variances(entries, numbers)


def prior_variances(entries: Sequence[Entry], numbers: Sequence[Number]) -> np.ndarray:
    """Return the prior variance of every entry (k,): that of its number, or its squared tolerance."""
    own = {number.name: number.prior_sd for number in numbers}
    return np.array([own.get(entry.effect.id, entry.parameter.tolerance) ** 2 for entry in entries])


def _touches(effect: Effect, setting: Setting, names: Sequence[str]) -> bool:
    """Return whether an effect moves one of some numbers."""
    before, after = (
        [number_of(name, number) for name in names] for number in (setting, _moved(effect, setting))
    )
    return any(abs(b - a) > MOVED * max(abs(a), abs(b)) for a, b in zip(before, after, strict=True))
