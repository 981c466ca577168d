"""Moving masses: a battery that slides along the hull and turns about its axis, as gliders pitch and roll by.

    r(s, φ) = (x + s, y cos φ − z sin φ, y sin φ + z cos φ)

r is the centre of the mass, (x, y, z) that at rest, s how far it has slid and φ how far it has turned (starboard goes
down), each a channel of its own. The mass is part of `rigid_body.mass`, and its place at rest part of the centre of
gravity there. So a move adds the difference of a point mass m at r and at r₀,

    ΔM = M_m(r) − M_m(r₀),   Δg = m g (r − r₀) × k_b,        (M + ΔM) ν' = Σ terms − C_ΔM(ν) ν + Δg

with the mass matrix of a point (Fossen 2021, eq. 3.47). Booked on the hull of the mass at rest, the reaction is

    F = Δg − C_ΔM(ν) ν − ΔM ν'

so that M ν' is the sum of all terms and every joule is found again. A mass that moves is taken to move slowly: the
momentum m ds/dt that it has relative to the hull is left out, and the inertia of the mass itself does not turn with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from subzero.jit import Record, compiled, inlined, scratch
from vehicle.channels import Channel
from vehicle.parameters import Section, parameter
from vehicle.rigid_body import coriolis
from vehicle.state import STATE_SIZE

MOST_MASSES = 2


class MovingMassNumbers(Record):
    """A moving mass as the compiled functions take it: its first channel, its mass [kg] and weight [N], its place."""

    channel: int
    mass: float
    weight: float
    x: float
    y: float
    z: float


@dataclass(frozen=True, kw_only=True)
class MovingMass(Section):
    """One moving mass; its name is that of its table in the file."""

    mass: float = parameter("mass that moves", "kg", above=0.0)
    x: float = parameter("its centre at rest, forward of the hull centre", "m")
    y: float = parameter("its centre at rest, to starboard", "m")
    z: float = parameter("its centre at rest, downward", "m")
    travel_aft: float = parameter("how far it slides aft", "m", low=0.0)
    travel_forward: float = parameter("how far it slides forward", "m", low=0.0)
    slide_rate: float = parameter("fastest slide", "m/s", above=0.0, unlimited=True)
    turn_limit: float = parameter("how far it turns about the axis, either way", "rad", low=0.0)
    turn_rate: float = parameter("fastest turn", "rad/s", above=0.0, unlimited=True)
    lag: float = parameter("time constant of both", "s", low=0.0)
    lost_command: float = parameter("share of the command that is lost; 1: stuck", "1", low=0.0, high=1.0)

    def channels(self, name: str) -> tuple[Channel, ...]:
        """Return its two commands: how far it slides and turns."""
        common = {"lag": self.lag, "lost_command": self.lost_command}
        slide = Channel(
            name=f"{name}_slide",
            meaning=f"how far the mass {name} has slid forward",
            unit="m",
            low=-self.travel_aft,
            high=self.travel_forward,
            rate_limit=self.slide_rate,
            **common,
        )
        turn = Channel(
            name=f"{name}_turn",
            meaning=f"how far the mass {name} has turned about the axis, starboard down",
            unit="rad",
            low=-self.turn_limit,
            high=self.turn_limit,
            rate_limit=self.turn_rate,
            **common,
        )
        return slide, turn

    def numbers(self, channel: int, gravity: float) -> MovingMassNumbers:
        """Return what the compiled mass needs; `channel` counts the first of its two commands."""
        return MovingMassNumbers(channel, self.mass, self.mass * gravity, self.x, self.y, self.z)


@inlined
def _add_point(mass: float, x: float, y: float, z: float, matrix: np.ndarray) -> None:
    """Add to a matrix (6, 6) the mass matrix of a point, without m I: where it is does not change that."""
    matrix[0, 4] += mass * z
    matrix[0, 5] -= mass * y
    matrix[1, 3] -= mass * z
    matrix[1, 5] += mass * x
    matrix[2, 3] += mass * y
    matrix[2, 4] -= mass * x
    matrix[3, 3] += mass * (y * y + z * z)
    matrix[4, 4] += mass * (z * z + x * x)
    matrix[5, 5] += mass * (x * x + y * y)
    matrix[3, 4] -= mass * x * y
    matrix[3, 5] -= mass * x * z
    matrix[4, 5] -= mass * y * z


@compiled
def moved_masses(
    state: np.ndarray,
    R: np.ndarray,
    masses: tuple[MovingMassNumbers, ...],
    count: int,
    change: np.ndarray,
    out: np.ndarray,
) -> None:
    """Fill `change` (6, 6) with ΔM and out (6,) with the force and moment of gravity Δg [N, N m]; R is R_nb."""
    change[:, :] = 0.0
    out[:] = 0.0
    for i in range(count):
        body = masses[i]
        at = STATE_SIZE + body.channel
        slid, turned = (state[at], state[at + 1]) if at + 1 < state.size else (0.0, 0.0)
        c, s = math.cos(turned), math.sin(turned)
        x, y, z = body.x + slid, body.y * c - body.z * s, body.y * s + body.z * c
        _add_point(body.mass, x, y, z, change)
        _add_point(-body.mass, body.x, body.y, body.z, change)
        dx, dy, dz = slid, y - body.y, z - body.z
        out[3] += body.weight * (dy * R[2, 2] - dz * R[2, 1])
        out[4] += body.weight * (dz * R[2, 0] - dx * R[2, 2])
        out[5] += body.weight * (dx * R[2, 1] - dy * R[2, 0])
    for row in range(6):
        for column in range(row):
            change[row, column] = change[column, row]


@compiled
def solve_symmetric(matrix: np.ndarray, right: np.ndarray) -> None:
    """Put the solution of a positive definite system (6, 6) in the place of its right side (6,); fills the matrix."""
    for j in range(6):
        for i in range(j + 1, 6):
            factor = matrix[i, j] / matrix[j, j]
            for k in range(j, 6):
                matrix[i, k] -= factor * matrix[j, k]
            right[i] -= factor * right[j]
    for j in range(5, -1, -1):
        for k in range(j + 1, 6):
            right[j] -= matrix[j, k] * right[k]
        right[j] /= matrix[j, j]


@compiled
def add_moving_masses(
    state: np.ndarray,
    R: np.ndarray,
    masses: tuple[MovingMassNumbers, ...],
    count: int,
    mass_matrix: np.ndarray,
    terms: np.ndarray,
    out: np.ndarray,
) -> None:
    """Add the reaction of moving masses on the hull, Δg − C_ΔM(ν) ν − ΔM ν', to out (6,) [N, N m].

    Args:
        state: of the vehicle; those of the channels stand behind entry STATE_SIZE.
        R: R_nb.
        masses: MOST_MASSES of them.
        count: how many count.
        mass_matrix: M, with all masses at rest (6, 6).
        terms: all other terms (terms, 6), complete; `out` is a row of them.
        out: the six components, added to.
    """
    change, total, reaction, rate = scratch(6, 6), scratch(6, 6), scratch(1, 6)[0], scratch(1, 6)[0]
    centripetal = scratch(1, 6)[0]
    moved_masses(state, R, masses, count, change, reaction)
    coriolis(change, state[7:13], centripetal)
    for i in range(6):
        reaction[i] += centripetal[i]
        rate[i] = reaction[i]
        for n in range(terms.shape[0]):
            rate[i] += terms[n, i]
        for j in range(6):
            total[i, j] = mass_matrix[i, j] + change[i, j]
    solve_symmetric(total, rate)
    for i in range(6):
        out[i] += reaction[i]
        for j in range(6):
            out[i] -= change[i, j] * rate[j]


NO_MASS = MovingMass(**dict.fromkeys(MovingMass.__dataclass_fields__, 1.0)).numbers(0, 0.0)
"""Fills the compiled list behind the last mass."""
