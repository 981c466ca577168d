"""A hull stated by its table of derivatives: matrices of added mass and damping, products of velocities and angles.

    τ_i = − (M_A)_ij ν'_j  + Σ_j D_ij ν_j + Σ_j Q_ij |ν_j| ν_j + Σ products        (SNAME 1950; Fossen 2021, 6.47, 6.65)

`subzero.derivative_names` says how a derivative is named: X_u = ∂X/∂u, X_uu for X_u|u|, X_udot = ∂X/∂u̇ = −A11, Y_uv,
Y_uu_rudder. They carry SNAME signs: what brakes, and added mass, is negative. They add to what the other sections of a
file say: a file of derivatives alone takes ``base = "open_frame"``, whose other forces are zero.

A name with a prime, Y_v', is without dimensions (SNAME): with ρ of the water and L the length of the hull,

    force  ½ρL² · ,     moment  ½ρL³ · ,     each rate p, q, r, n times L,     accelerations ½ρL³ ·  and so on;
    a derivative per one velocity, or per none, is times U or U², the speed through the water: Y = ½ρL² Y_v' U v.

Written as a product it is times what its name says: Y = ½ρL² Y_uv' u v.

Tables of a towing tank hold in their products what the added mass of a turning hull makes: X_wq, Y_wp, N_uv and others.
With ``complete = 1`` a table says so, and the Coriolis forces of the added mass are left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from subzero.derivative_names import (
    COMPLETE,
    FIN_NAMES,
    FORCES,
    RACE,
    SPEEDS,
    DerivativeName,
    complaint,
    parsed,
)
from subzero.errors import real, short
from subzero.jit import inlined
from vehicle.parameters import Problem, VehicleError


def place_of(name: str) -> tuple[str, int, int] | None:
    """Return kind ("added_mass", "linear", "quadratic"), row and column of a derivative; None if no matrix has it."""
    found = parsed(name, ())
    if found is None or found.kind == "product":
        return None
    return found.kind, found.force, SPEEDS.index(found.factors[0])


def is_table(value: object) -> bool:
    """Return whether a value is a tuple of pairs, each of a name and something."""
    return isinstance(value, tuple) and all(
        isinstance(pair, tuple) and len(pair) == 2 and isinstance(pair[0], str) for pair in value
    )


def factor_names(fins: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the names that may be factors of a derivative besides the letters: of fins, and the propeller's race.

    Args:
        fins: names of further fins, each with an angle of its own.
    """
    return (*FIN_NAMES, RACE, *fins)


@dataclass(frozen=True)
class Derivatives:
    """Derivatives of a hull by name, such as ("X_u", -13.7); none for a hull that is stated otherwise.

    Attributes:
        table: pairs of name and value.
        named: the names that may be factors, of `factor_names`.

    Raises:
        VehicleError: a name that is none, a value that is no number, damping that drives, an added mass that is none.
    """

    table: tuple[tuple[str, float], ...] = ()
    named: tuple[str, ...] = factor_names()

    def __post_init__(self) -> None:
        """Raise an error for derivatives that cannot be."""
        if not is_table(self.table):
            why, allowed = "this is no table of numbers", 'pairs such as ("X_u", -13.7)'
            raise VehicleError((_problem("table", short(self.table), why, allowed),))
        problems = [found for row in self.table for found in self._problems(*row)] or self._asymmetries()
        if problems:
            raise VehicleError(tuple(problems))

    def _problems(self, name: str, value: object) -> list[Problem]:
        """Return the problem of one row, if it has one."""
        number = real(value)
        if name == COMPLETE:
            is_said = number in (0.0, 1.0)
            why, allowed = "its products hold those of added mass or they do not", "0 or 1"
            return [] if is_said else [_problem(name, short(value), why, allowed)]
        if said := complaint(name, self.named):
            return [_problem(name, "this key", *said)]
        if number is None:
            why = "this is not a finite number"
            return [_problem(name, short(value), why, "a finite number")]
        if name.endswith("'") and name[:-1] in dict(self.table):
            why, allowed = "the same derivative stands there with a unit", "one of the two"
            return [_problem(name, "this key", why, allowed)]
        derivative = self.parsed(name)
        kinds = ("added_mass", "linear", "quadratic")
        diagonal = derivative.factors[0] == SPEEDS[derivative.force] and (
            derivative.kind in kinds or len(derivative.factors) == 1
        )
        if diagonal and number > 0.0:
            why = "on the diagonal it would drive the hull, or be a negative mass"
            return [_problem(name, f"{number:g}", why, "0 or below: SNAME signs")]
        return []

    def _asymmetries(self) -> list[Problem]:
        """Return the problem of an added mass whose mirror is another, with units or without."""
        for prime in ("", "'"):
            A = self._matrix(
                "added_mass", [row for row in self.derivatives if row[0].is_primed == bool(prime)]
            )
            if not np.allclose(A, A.T, rtol=1e-5, atol=1e-8):
                i, j = (int(index[0]) for index in np.nonzero(~np.isclose(A, A.T)))
                name = f"{FORCES[i]}_{SPEEDS[j]}dot{prime}"
                why = "added mass is symmetric, and its mirror is another"
                mirror = f"equal to {FORCES[j]}_{SPEEDS[i]}dot{prime}"
                return [_problem(name, f"{A[i, j]:g}", why, mirror)]
        return []

    def __bool__(self) -> bool:
        """Return whether there are any."""
        return bool(self.table)

    @property
    def is_complete(self) -> bool:
        """Whether the products hold those that added mass makes."""
        return dict(self.table).get(COMPLETE) == 1.0

    def parsed(self, name: str) -> DerivativeName:
        """Return what a name of the table says."""
        found = parsed(name, self.named)
        if found is None:  # of a table that was not checked
            raise VehicleError((_problem(name, "this key", *(complaint(name, self.named) or ("", ""))),))
        return found

    @cached_property
    def derivatives(self) -> list[tuple[DerivativeName, float]]:
        """What the names say, and the values as they stand in the file."""
        return [(self.parsed(name), value) for name, value in self.table if name != COMPLETE]

    @property
    def factors(self) -> frozenset[str]:
        """The factors of all derivatives, without bars: letters, and names of fins."""
        return frozenset(factor.strip("|") for name, _ in self.derivatives for factor in name.factors)

    def with_dimensions(self, density: float, length: float) -> list[tuple[DerivativeName, float]]:
        """Return the derivatives in SI units, those with a prime times what belongs to it.

        Args:
            density: ρ of the water. [kg/m3]
            length: L of the hull. [m]
        """
        scale = 0.5 * density * length**2
        return [
            (name, value * scale * length ** (name.lengths + name.is_rate) if name.is_primed else value)
            for name, value in self.derivatives
        ]

    def matrix(self, kind: str, density: float, length: float) -> np.ndarray:
        """Return the matrix (6, 6) of a kind, of the derivatives alone: M_A, D or Q, in SI units.

        Args:
            kind: "added_mass", "linear" or "quadratic".
            density: ρ of the water. [kg/m3]
            length: L of the hull. [m]
        """
        matrix = self._matrix(kind, self.with_dimensions(density, length))
        return -matrix if kind == "added_mass" else matrix

    def _matrix(self, kind: str, rows: list[tuple[DerivativeName, float]]) -> np.ndarray:
        matrix = np.zeros((6, 6))
        for name, value in rows:
            if name.kind == kind:
                matrix[name.force, SPEEDS.index(name.factors[0])] += value
        return matrix


def _problem(name: str, found: str, why: str, allowed: str) -> Problem:
    return Problem(key=f"derivatives.{name}", found=found, why=why, allowed=allowed)


NO_DERIVATIVES = Derivatives()


def derivatives_of(values: Mapping[str, float], fins: Sequence[str] = ()) -> Derivatives:
    """Return derivatives by name → value; `fins` are the names of further fins."""
    return Derivatives(tuple((_usual(name), value) for name, value in values.items()), factor_names(fins))


def _usual(name: str) -> str:
    """Return the usual spelling of a derivative of a matrix: X_uu for X_u|u|."""
    place = place_of(name)
    return name.replace("|", "") if place and place[0] == "quadratic" else name


@inlined
def add_damping(
    nu_r: np.ndarray, linear: np.ndarray, quadratic: np.ndarray, a: np.ndarray, b: np.ndarray
) -> None:
    """Add D ν_r to a (6,) and Q |ν_r| ν_r to b (6,) [N, N m]; nu_r relative to the water."""
    for i in range(6):
        for j in range(6):
            a[i] += linear[i, j] * nu_r[j]
            b[i] += quadratic[i, j] * abs(nu_r[j]) * nu_r[j]
