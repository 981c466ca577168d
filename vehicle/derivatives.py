"""A hull stated by its table of derivatives: full 6×6 matrices of added mass, linear and quadratic damping.

    τ_i = − (M_A)_ij ν'_j  + Σ_j D_ij ν_j + Σ_j Q_ij |ν_j| ν_j            (SNAME 1950; Fossen 2021, eqs. 6.47, 6.65)

A derivative is named by its force and its velocity: X_u = ∂X/∂u, X_uu for X_u|u|, X_udot = ∂X/∂u̇ = −A11. They carry
SNAME signs: what brakes, and added mass, is negative. They add to what the other sections of a file say: a file of
derivatives alone takes ``base = "open_frame"``, whose other forces are zero.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from subzero.errors import real, short
from subzero.jit import inlined
from vehicle.parameters import Problem, VehicleError

FORCES, SPEEDS = "XYZKMN", "uvwpqr"
NAME = re.compile(r"([XYZKMN])_([uvwpqr])(?:(dot)|\|?(\2)\|?)?")
"""``X_u``, ``X_uu`` or ``X_u|u|``, ``X_udot``."""


def place_of(name: str) -> tuple[str, int, int] | None:
    """Return kind ("added_mass", "linear", "quadratic"), row and column of a derivative; None if it is none."""
    found = NAME.fullmatch(name)
    if found is None:
        return None
    kind = "added_mass" if found[3] else "quadratic" if found[4] else "linear"
    return kind, FORCES.index(found[1]), SPEEDS.index(found[2])


def is_table(value: object) -> bool:
    """Return whether a value is a tuple of pairs, each of a name and something."""
    return isinstance(value, tuple) and all(
        isinstance(pair, tuple) and len(pair) == 2 and isinstance(pair[0], str) for pair in value
    )


@dataclass(frozen=True)
class Derivatives:
    """Derivatives of a hull by name, such as ("X_u", -13.7); none for a hull that is stated otherwise.

    Raises:
        VehicleError: a name that is none, a value that is no number, damping that drives, an added mass that is none.
    """

    table: tuple[tuple[str, float], ...] = ()

    def __post_init__(self) -> None:
        """Raise an error for derivatives that cannot be."""
        if not is_table(self.table):
            why, allowed = "this is no table of numbers", 'pairs such as ("X_u", -13.7)'
            raise VehicleError((_problem("table", short(self.table), why, allowed),))
        problems = []
        for name, value in self.table:
            place, number = place_of(name), real(value)
            if place is None:
                allowed = "X_u, X_uu, X_udot, with X Y Z K M N and u v w p q r"
                problems.append(_problem(name, "this key", "no such derivative", allowed))
            elif number is None:
                problems.append(
                    _problem(name, short(value), "this is not a finite number", "a finite number")
                )
            elif place[1] == place[2] and number > 0.0:
                why = "on the diagonal it would drive the hull, or be a negative mass"
                problems.append(_problem(name, f"{number:g}", why, "0 or below: SNAME signs"))
        if problems:
            raise VehicleError(tuple(problems))
        A = self.added_mass
        if not np.allclose(A, A.T):
            i, j = (int(index[0]) for index in np.nonzero(~np.isclose(A, A.T)))
            name = f"{FORCES[i]}_{SPEEDS[j]}dot"
            why = "added mass is symmetric, and its mirror is another"
            mirror = f"equal to {FORCES[j]}_{SPEEDS[i]}dot"
            raise VehicleError((_problem(name, f"{-A[i, j]:g}", why, mirror),))

    def __bool__(self) -> bool:
        """Return whether there are any."""
        return bool(self.table)

    @cached_property
    def added_mass(self) -> np.ndarray:
        """M_A (6, 6), of the derivatives alone. [kg, kg m, kg m2]"""
        return -self._matrix("added_mass")

    @cached_property
    def linear(self) -> np.ndarray:
        """D (6, 6). [kg/s, kg m/s, kg m2/s]"""
        return self._matrix("linear")

    @cached_property
    def quadratic(self) -> np.ndarray:
        """Q (6, 6). [kg/m, kg, kg m, kg m2]"""
        return self._matrix("quadratic")

    def _matrix(self, kind: str) -> np.ndarray:
        matrix = np.zeros((6, 6))
        for name, value in self.table:
            place = place_of(name)
            if place is not None and place[0] == kind:
                matrix[place[1], place[2]] = value
        return matrix


def _problem(name: str, found: str, why: str, allowed: str) -> Problem:
    return Problem(key=f"derivatives.{name}", found=found, why=why, allowed=allowed)


NO_DERIVATIVES = Derivatives()


def derivatives_of(values: Mapping[str, float]) -> Derivatives:
    """Return derivatives by name → value."""
    return Derivatives(tuple((name.replace("|", ""), value) for name, value in values.items()))


@inlined
def add_damping(
    nu_r: np.ndarray, linear: np.ndarray, quadratic: np.ndarray, a: np.ndarray, b: np.ndarray
) -> None:
    """Add D ν_r to a (6,) and Q |ν_r| ν_r to b (6,) [N, N m]; nu_r relative to the water."""
    for i in range(6):
        for j in range(6):
            a[i] += linear[i, j] * nu_r[j]
            b[i] += quadratic[i, j] * abs(nu_r[j]) * nu_r[j]
