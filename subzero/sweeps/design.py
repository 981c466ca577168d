"""Which points a sweep visits: grids, Latin hypercubes, Sobol points, Monte Carlo, and the designs of sensitivities.

Each parameter has a *spread*, values or a distribution; a design gives u in the unit cube, and the quantile function of
each spread makes values of it, x = F⁻¹(u). So every design serves every distribution. The same plan and seed give the
same points, whatever runs them.

    [0.0, 0.1, 0.2]                         these values
    { from = 0, to = 40 }                   uniform; with count = 5 a grid's values too; log = true in the logarithm
    { normal = [1.2, 0.1] }                 mean, standard deviation
    "declared"                              uniform over the range that the vehicle's or the cable's file declares

Sources: McKay, Beckman, Conover (1979), Latin hypercube; Owen (1998), scrambled Sobol points, both of scipy.stats.qmc;
Morris (1991), Saltelli (2010), of SALib.
"""

from __future__ import annotations

import fnmatch
import hashlib
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import scenarios
from scenarios.parameters import declared_ranges, parameter, parameter_unit, with_parameters
from subzero.arguments import checked_arguments
from subzero.errors import UserError, chosen, missing_extra, real, short, suggestion, whole

MOST_MEMBERS = 20_000_000
"""More points than this are a slip of the pen: they would take months on a thousand cores. [-]"""

DISTRIBUTION_KEYS = ("values", "from", "to", "count", "log", "normal")


@dataclass(frozen=True, kw_only=True)
class Spread:
    """The distribution of the values of a parameter.

    Attributes:
        name: of the parameter, dotted.
        unit: of its values.
        levels: the values of a list or a grid (n,); empty for a distribution without a count.
        quantile: u (n,) in (0, 1) → values (n,).
        ends: its least and greatest value, or for a normal one those of three standard deviations.
    """

    name: str
    unit: str
    levels: tuple[float, ...]
    quantile: Callable[[np.ndarray], np.ndarray] = field(compare=False)
    ends: tuple[float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Points:
    """The points of a sweep.

    Attributes:
        spreads: the parameters that change.
        values: (members, parameters), in the units of the files.
        design: its name.
        samples: number that was requested: points, trajectories, or base points of Saltelli's scheme.
        seed: of the points.
        unit: the same points in the unit cube, for a sensitivity; else empty.
    """

    spreads: tuple[Spread, ...]
    values: np.ndarray
    design: str
    samples: int
    seed: int
    unit: np.ndarray

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(spread.name for spread in self.spreads)

    @property
    def digest(self) -> str:
        """SHA-256 of the points, to the last bit."""
        return hashlib.sha256(np.ascontiguousarray(self.values).tobytes()).hexdigest()


def spreads_of(trial: scenarios.Trial, parameters: Mapping[str, Any]) -> tuple[Spread, ...]:
    """Return the spreads that a plan asks for; ``vehicle.*`` stands for all of that name that are declared.

    Raises:
        UserError: a name that the trial does not have, or an invalid spread.
    """
    if not isinstance(parameters, Mapping) or not parameters:
        raise UserError(
            f"A sweep needs parameters, name → values or distribution; it has {short(parameters)}."
        )
    named = dict(_expanded(trial, parameters))
    for name in named:
        parameter(trial, name)  # refuses it with the nearest name
    return tuple(_spread(trial, name, said) for name, said in named.items())


# Spreads.


def _expanded(trial: scenarios.Trial, parameters: Mapping[str, Any]) -> Any:
    """Return names and their values, with patterns such as ``vehicle.*`` expanded."""
    for name, said in parameters.items():
        if not isinstance(name, str):
            raise UserError(f"A parameter is named {short(name)}. Allowed: a name such as 'cable.diameter'.")
        if "*" not in name:
            yield name, said
            continue
        declared = declared_ranges(trial)
        known = [item for item in fnmatch.filter(declared, name) if item not in parameters]
        if said != "declared" or not known:
            raise UserError(
                f'{name} stands for several parameters, and is {short(said)}. Allowed: "declared", and names of'
                f" parameters whose file declares a range.{suggestion(name, declared)}"
            )
        for each in known:
            low, high = declared[each]
            if low < high:
                yield each, "declared"


def _spread(trial: scenarios.Trial, name: str, said: Any) -> Spread:
    """Return a spread as it is said."""
    unit = parameter_unit(trial, name)
    if isinstance(said, str) and said == "declared":
        ranges = declared_ranges(trial)
        if name not in ranges:
            raise UserError(
                f"{name}: no file declares a range for it.{suggestion(name, ranges)}"
                " Allowed: { from = ..., to = ... } or a list of values."
            )
        return _uniform(name, unit, *ranges[name], count=0, log=False)
    if isinstance(said, Mapping):
        return _distribution(name, unit, said)
    values = [said] if real(said) is not None else said
    if isinstance(values, Sequence | np.ndarray) and not isinstance(values, str):
        return _listed(name, unit, values)
    raise UserError(f"{name}: {short(said)} is no spread. {ALLOWED}")


ALLOWED = (
    "Allowed: a list of values, { from = a, to = b } with or without count = n and log = true, "
    '{ normal = [mean, deviation] }, or "declared".'
)


def _distribution(name: str, unit: str, said: Mapping[str, Any]) -> Spread:
    """Return the spread of a table."""
    for key in said:
        if key not in DISTRIBUTION_KEYS:
            raise UserError(
                f"{name}: a spread has no {short(key)}.{suggestion(key, DISTRIBUTION_KEYS)} {ALLOWED}"
            )
    if set(said) == {"values"}:
        return _listed(name, unit, said["values"])
    if set(said) == {"normal"}:
        return _normal(name, unit, said["normal"])
    if {"from", "to"} <= set(said) <= {"from", "to", "count", "log"}:
        count = _at_most(f"{name}: count", whole(f"{name}: count", said.get("count", 0)))
        low, high = (_number(name, said[key]) for key in ("from", "to"))
        return _uniform(name, unit, low, high, count=count, log=bool(said.get("log", False)))
    raise UserError(f"{name}: {short(dict(said))} is no spread. {ALLOWED}")


def _number(name: str, value: Any) -> float:
    number = real(value)
    if number is None:
        raise UserError(f"{name}: {short(value)} is no finite number. {ALLOWED}")
    return number


def _listed(name: str, unit: str, values: Any) -> Spread:
    """Return a list of values, each as likely as the others."""
    try:
        _at_most(f"{name}: the number of values", len(values))  # before there are so many
    except (TypeError, OverflowError):  # an array of no axis; a range of more than 2**63 numbers
        raise UserError(
            f"{name}: {short(values)} is no list of at most {MOST_MEMBERS} values. {ALLOWED}"
        ) from None
    levels = tuple(_number(name, value) for value in values)
    if not levels:
        raise UserError(f"{name}: the list is empty. {ALLOWED}")
    table = np.array(levels)
    return Spread(
        name=name,
        unit=unit,
        levels=levels,
        quantile=lambda u: table[np.minimum((u * table.size).astype(int), table.size - 1)],
        ends=(min(levels), max(levels)),
    )


def _uniform(name: str, unit: str, low: float, high: float, *, count: int, log: bool) -> Spread:
    """Return a uniform distribution, in the logarithm if asked for."""
    if not low < high:
        raise UserError(f"{name}: from = {low:g} is not below to = {high:g}. {ALLOWED}")
    if log and low <= 0.0:
        raise UserError(f"{name}: from = {low:g} has no logarithm. Allowed: above 0, or log = false.")
    lo, hi = (math.log(low), math.log(high)) if log else (low, high)

    def quantile(u: np.ndarray) -> np.ndarray:
        inside = lo + u * (hi - lo)
        return np.clip(np.exp(inside) if log else inside, low, high)

    levels = tuple(quantile(np.linspace(0.0, 1.0, count)).tolist()) if count > 1 else (low,) * count
    return Spread(name=name, unit=unit, levels=levels, quantile=quantile, ends=(low, high))


def _normal(name: str, unit: str, numbers: Any) -> Spread:
    """Return a normal distribution."""
    if not isinstance(numbers, Sequence) or isinstance(numbers, str) or len(numbers) != 2:
        raise UserError(f"{name}: normal is {short(numbers)}. Allowed: [mean, standard deviation].")
    mean, deviation = (_number(name, number) for number in numbers)
    if not deviation > 0.0:
        raise UserError(f"{name}: the standard deviation is {deviation:g}. Allowed: above 0.")
    from scipy.special import ndtri

    return Spread(
        name=name,
        unit=unit,
        levels=(),
        quantile=lambda u: mean + deviation * ndtri(np.clip(u, 1e-12, 1.0 - 1e-12)),
        ends=(mean - 3.0 * deviation, mean + 3.0 * deviation),
    )


def _check_ends(trial: scenarios.Trial, spreads: tuple[Spread, ...]) -> None:
    """Raise an error for a parameter with an extreme value that the trial refuses; tails of a normal one may fail
    later.
    """
    for spread in spreads:
        for end in spread.levels or spread.ends:
            with_parameters(trial, {spread.name: end})


def _samples(design: str, samples: int | None) -> int:
    """Return how many samples a design has; grids count themselves."""
    if design in COUNT_THEMSELVES:
        if samples is not None:
            raise UserError(
                f'samples = {samples}: a "{design}" design has as many points as its values say. Leave it out.'
            )
        return 0
    if samples is None:
        raise UserError(f'A "{design}" design needs samples, how many points it has.')
    return _at_most("samples", whole("samples", samples, least=1))


def _at_most(name: str, count: int) -> int:
    """Return a number of points, or refuse more than a sweep can have."""
    if count > MOST_MEMBERS:
        raise UserError(f"{name} is {short(count)}. Allowed: up to {MOST_MEMBERS}.")
    return count


# Designs: (spreads, samples, seed) → points in the unit cube, where they are needed later, and values.

Made = tuple[np.ndarray, np.ndarray]


def _values(spreads: tuple[Spread, ...], unit: np.ndarray) -> np.ndarray:
    """Return the values (n, k) of points in the unit cube."""
    return np.column_stack([spread.quantile(unit[:, i]) for i, spread in enumerate(spreads)])


def _levels(spreads: tuple[Spread, ...], design: str) -> list[tuple[float, ...]]:
    """Return the values of each parameter of a grid; refuse a distribution that has none."""
    for spread in spreads:
        if not spread.levels:
            raise UserError(
                f'{spread.name}: a "{design}" design needs values. Give a list, or {{ from, to, count }}; or another'
                " design:"
                f" {', '.join(name for name in DESIGNS if name not in COUNT_THEMSELVES)}."
            )
    return [spread.levels for spread in spreads]


def _grid(spreads: tuple[Spread, ...], _: int, seed: int) -> Made:
    """Every value of each with every value of the others; the last parameter changes first."""
    levels = _levels(spreads, "grid")
    if math.prod(map(len, levels)) > MOST_MEMBERS:
        raise UserError(f"A grid of {math.prod(map(len, levels))} points. Allowed: up to {MOST_MEMBERS}.")
    mesh = np.meshgrid(*map(np.array, levels), indexing="ij")
    return np.empty((0, 0)), np.column_stack([each.ravel() for each in mesh])


def _together(spreads: tuple[Spread, ...], _: int, seed: int) -> Made:
    """The first values of all, the second values of all, and so on: rows that belong together."""
    levels = _levels(spreads, "together")
    if len(set(map(len, levels))) > 1:
        counts = ", ".join(f"{spread.name} {len(spread.levels)}" for spread in spreads)
        raise UserError(f'A "together" design needs lists of the same length; they have {counts} values.')
    return np.empty((0, 0)), np.column_stack([np.array(level) for level in levels])


def _monte_carlo(spreads: tuple[Spread, ...], samples: int, seed: int) -> Made:
    """Independent random points."""
    unit = np.random.default_rng(seed).random((samples, len(spreads)))
    return np.empty((0, 0)), _values(spreads, unit)


def _latin_hypercube(spreads: tuple[Spread, ...], samples: int, seed: int) -> Made:
    """Random points, one in each of `samples` slices of every parameter."""
    from scipy.stats import qmc

    unit = qmc.LatinHypercube(len(spreads), seed=np.random.default_rng(seed)).random(samples)
    return np.empty((0, 0)), _values(spreads, unit)


def _sobol(spreads: tuple[Spread, ...], samples: int, seed: int) -> Made:
    """Scrambled Sobol points; a power of two of them is balanced best."""
    from scipy.stats import qmc

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # any count may be asked for
        unit = qmc.Sobol(len(spreads), seed=np.random.default_rng(seed)).random(samples)
    return np.empty((0, 0)), _values(spreads, unit)


def _morris(spreads: tuple[Spread, ...], samples: int, seed: int) -> Made:
    """`samples` trajectories that change one parameter after another (Morris 1991): samples·(k + 1) points."""
    sample = salib("sample", "morris")
    unit = sample.sample(salib_problem(spreads), samples, seed=seed)
    low, high = np.array(
        [spread.ends for spread in spreads]
    ).T  # u is 0 or 1 at times, where a normal one has no value
    return unit, np.clip(_values(spreads, unit), low, high)


def _saltelli(spreads: tuple[Spread, ...], samples: int, seed: int) -> Made:
    """Saltelli's scheme for Sobol indices of first and total order: samples·(k + 2) points."""
    if samples & (samples - 1):
        raise UserError(f'samples is {samples}: a "saltelli" design needs a power of two, such as 64 or 256.')
    sample = salib("sample", "sobol")
    unit = sample.sample(salib_problem(spreads), samples, calc_second_order=False, seed=seed)
    return unit, _values(spreads, unit)


def salib_problem(spreads: tuple[Spread, ...]) -> dict[str, Any]:
    """Return the problem in SALib's form: the unit cube, so that any distribution serves."""
    names = [spread.name for spread in spreads]
    return {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}


def salib(kind: str, method: str) -> Any:
    """Return a module of SALib, or say how to get it."""
    from importlib import import_module

    try:
        return import_module(f"SALib.{kind}.{method}")
    except ImportError:
        raise missing_extra("A design for sensitivities", "SALib", "sensitivity") from None


DESIGNS: dict[str, Callable[[tuple[Spread, ...], int, int], Made]] = {
    "grid": _grid,
    "together": _together,
    "latin_hypercube": _latin_hypercube,
    "sobol": _sobol,
    "monte_carlo": _monte_carlo,
    "morris": _morris,
    "saltelli": _saltelli,
}
"""Name → what makes the points."""

COUNT_THEMSELVES = ("grid", "together")
"""Designs whose values say how many points they have."""


@checked_arguments
@dataclass(frozen=True, kw_only=True)
class Design:
    """How the points of a sweep are chosen.

    Attributes:
        kind: one of `DESIGNS`: ``grid``, ``together`` (lists whose values belong together), ``latin_hypercube``,
            ``sobol``, ``monte_carlo``, ``morris`` or ``saltelli`` (sensitivities, extra [sensitivity]).
        samples: how many points; trajectories of ``morris``, a power of two of ``saltelli``. Lists have their own.
        seed: of random designs.

    Raises:
        UserError: there is no such design; a number of samples or a seed that it cannot have.
    """

    kind: str = "grid"
    samples: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        """Raise an error if the fields do not form a design."""
        chosen(DESIGNS, self.kind, "design")
        object.__setattr__(self, "seed", whole("seed", self.seed))
        _samples(self.kind, self.samples)


GRID = Design()


def points_of(trial: scenarios.Trial, parameters: Mapping[str, Any], design: Design = GRID) -> Points:
    """Return the points of a plan.

    Args:
        trial: the trial to sweep.
        parameters: dotted name → spread, as this module says.
        design: which points.

    Raises:
        UserError: what cannot be a plan: no such parameter or value; too many points.
    """
    spreads = spreads_of(trial, parameters)
    _check_ends(trial, spreads)
    count = _samples(design.kind, design.samples)
    unit, values = DESIGNS[design.kind](spreads, count, design.seed)
    return Points(
        spreads=spreads, values=values, design=design.kind, samples=count, seed=design.seed, unit=unit
    )
