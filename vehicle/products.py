"""Products of velocities, angles of fins, shaft speed and race: the derivatives that no matrix holds, and their forces.

    X = ½ρL² X_uu_rudder2' u|u| δ²   and the like: a coefficient times the values of its factors

The race of the propeller is a factor of its own: what a fin in it, or the stern, feels more than in steady motion
straight ahead. Behind a disc of thrust loading C_T the water moves at u √(1 + C_T) (momentum theory); with the
advance a = u/n of self-propulsion, where the loading is C_T1, and η = a n/u,

    race = −1 + sign(η) (√(1 + C_T1 η²) − 1)/(√(1 + C_T1) − 1)             (Healey and Lienard 1993, their ε)

which is 0 in self-propulsion, −1 with a stopped propeller and about η² − 1 for a small loading. Departs from source:
the loading is taken with the size of η|η|, so the root is real with the propeller astern.

A product with n is booked with the propeller, one with the angle of a fin with that fin, one with the race alone with
the propeller, every other with the quadratic damping.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from subzero.derivative_names import FIN_NAMES, RACE, DerivativeName
from subzero.errors import short
from subzero.jit import Record, compiled, gated_inlined, scratch
from vehicle.derivatives import Derivatives, factor_names
from vehicle.parameters import Problem, Section, parameter

if TYPE_CHECKING:
    from vehicle.vehicle import VehicleNumbers

MOST_PRODUCTS = 160
"""The compiled numbers hold so many products: one layout, so that all vehicles share one machine code."""
MOST_FACTORS = 8
"""Factors of a product, with those that a prime brings. [-]"""
LETTERS = ("1", "u", "v", "w", "p", "q", "r", "U", "n")
FIRST_FIN = len(LETTERS) + len(FIN_NAMES) + 1
FACTORS = 32
"""So many values of factors there may be: letters, fins, the race, listed fins; behind them, their absolute values."""
VALUES = 2 * FACTORS
SLOWEST = 1e-6
"""Below this speed the race is that at it: products of it, which have u as a factor, are finite at rest. [m/s]"""
TERMS = {"quadratic_damping": 8, "propeller": 10} | {name: 11 + i for i, name in enumerate(FIN_NAMES)}
"""Places of the terms that products are booked with, in `vehicle.terms`."""


class RaceNumbers(Record):
    """Advance a = u/n of self-propulsion, its loading C_T1, and 1/(√(1 + C_T1) − 1)."""

    advance: float
    loading: float
    per_excess: float


@dataclass(frozen=True, kw_only=True)
class Race(Section):
    """The race of the propeller, as a factor of derivatives."""

    advance: float = parameter("speed per shaft speed in self-propulsion, a = u/n", "m", above=0.0)
    thrust_loading: float = parameter("thrust loading of the disc in self-propulsion, C_T1", "1", above=0.0)

    def numbers(self) -> RaceNumbers:
        """Return the numbers of the compiled race."""
        return RaceNumbers(
            self.advance, self.thrust_loading, 1.0 / (math.sqrt(1.0 + self.thrust_loading) - 1.0)
        )


NO_RACE = RaceNumbers(0.0, 0.0, 0.0)


def product_problems(derivatives: Derivatives, fins: Sequence[str], race: Race | None) -> list[Problem]:
    """Return the problems of derivatives of a vehicle: too many products, fins or a race that it does not have."""
    if race is not None and not isinstance(race, Race):
        return [Problem(key=RACE, found=short(race), why="this is no such part", allowed="a Race, or None")]
    count = count_of(derivatives.derivatives)
    if count > MOST_PRODUCTS:
        why = "that is more than the compiled equations hold"
        allowed = f"up to {MOST_PRODUCTS}, besides those of a single velocity"
        return [Problem(key="derivatives", found=f"{count} products", why=why, allowed=allowed)]
    used = derivatives.factors
    missing = [name for name in derivatives.named if name in used - {*factor_names(fins)}]
    if missing:
        why, allowed = "this vehicle has no fin of this name", ", ".join(factor_names(fins))
        return [Problem(key="derivatives", found=f"the factor {missing[0]}", why=why, allowed=allowed)]
    if RACE in used and race is None:
        why, allowed = "this vehicle has no section of its race", "[race] with advance and thrust_loading"
        return [Problem(key="derivatives", found="the factor race", why=why, allowed=allowed)]
    return []


@gated_inlined
def race_excess(n: float, u: float, race: RaceNumbers) -> float:
    """Return the excess of the race over that of self-propulsion, at n [rev/s] and surge speed u [m/s]. [-]"""
    eta = race.advance * n / math.copysign(max(abs(u), SLOWEST), u)
    jet = (math.sqrt(1.0 + race.loading * eta * eta) - 1.0) * race.per_excess
    return math.copysign(jet, eta) - 1.0


def table_of(rows: list[tuple[DerivativeName, float]], named: Sequence[str]) -> np.ndarray:
    """Return the compiled table (MOST_PRODUCTS, 3 + MOST_FACTORS): coefficient, term, force, places of the factors.

    Args:
        rows: names and values in SI units; those of matrices are left out.
        named: names of factors, of `derivatives.factor_names`.
    """
    places = {name: i for i, name in enumerate((*LETTERS, *named))}  # of fins in the order of their list
    places |= {f"|{name}|": FACTORS + i for name, i in places.items()}
    table = np.zeros((MOST_PRODUCTS, 3 + MOST_FACTORS))
    products = [(name, value) for name, value in rows if name.kind == "product"]
    for row, (name, value) in zip(table, products, strict=False):
        factors = [*name.factors, *["U"] * (name.is_primed * (2 - len(name.velocities)))]
        row[:3] = value, TERMS[term_of(name)], name.force
        row[3 : 3 + len(factors)] = [places[factor] for factor in factors]
    return table


def count_of(rows: list[tuple[DerivativeName, float]]) -> int:
    """Return how many rows of the compiled table are in use."""
    return sum(name.kind == "product" for name, _ in rows)


def term_of(name: DerivativeName) -> str:
    """Return the term that a product is booked with."""
    factors = [factor.strip("|") for factor in name.factors]
    fins = [factor for factor in factors if len(factor) > 1 and factor != RACE]
    if "n" in factors or (RACE in factors and not fins):
        return "propeller"
    if fins:
        return fins[0] if fins[0] in FIN_NAMES else "rudder"
    return "quadratic_damping"


@compiled
def add_products(
    nu_r: np.ndarray,
    n: float,
    angles: tuple[float, float, float],
    own: np.ndarray,
    numbers: VehicleNumbers,
    terms: np.ndarray,
) -> None:
    """Add all products to terms (terms, 6) [N, N m].

    Args:
        nu_r: velocity relative to the water (u, v, w, p, q, r). [m/s, rad/s]
        n: shaft speed. [rev/s]
        angles: rudder, port plane, starboard plane in the water. [rad]
        own: angles of the listed fins. [rad]
        numbers: VehicleNumbers.
        terms: added to.
    """
    values, table = scratch(1, VALUES)[0], numbers.products
    values[0] = 1.0
    for i in range(6):
        values[1 + i] = nu_r[i]
    values[7] = math.sqrt(nu_r[0] * nu_r[0] + nu_r[1] * nu_r[1] + nu_r[2] * nu_r[2])
    values[8] = n
    values[9], values[10], values[11] = angles[0], angles[1], angles[2]
    values[12] = race_excess(n, nu_r[0], numbers.race)
    for i in range(numbers.fin_count):
        values[FIRST_FIN + i] = own[i]
    for i in range(FIRST_FIN + numbers.fin_count):
        values[FACTORS + i] = abs(values[i])
    for i in range(numbers.product_count):
        product = table[i, 0]
        for k in range(MOST_FACTORS):
            product *= values[int(table[i, 3 + k])]
        terms[int(table[i, 1]), int(table[i, 2])] += product
