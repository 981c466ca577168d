"""Thrusters: propellers in a duct or free, anywhere on the hull and along any direction.

    c  = sign(s) max(0, |s| − b)/(1 − b)                              dead band b of the lagged command s
    T  = T_ahead |c|^e  or  −T_astern |c|^e                           thrust curve, at rest in the water
    F  = (T − k |c| u_a) d,   u_a = d · (v_r + ω × r)                 inflow along the direction d
    M  = r × F + h T d                                                h > 0: the motor's reaction, along d
    s' = (clip((1 − lost) command, ±1) − s)/lag                       its channel (`vehicle.channels`)

A command is a share, −1 full astern to 1 full ahead. Thrust acts along d, a unit vector of the body's axes: it pushes
the hull that way when ahead. The curve is that of the thruster on its stand; `loss_per_inflow` is how much of full
thrust an inflow takes, as of a propeller's K_T that falls with J. What is left out: thrusters that blow at one another,
swirl, and the load on the battery (their current is not booked).

`allocation` turns a wrench that is asked for into commands: the weighted pseudo-inverse with its limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from subzero.jit import compiled, inlined
from vehicle.channels import Channel
from vehicle.parameters import Section, parameter
from vehicle.state import STATE_SIZE

MOST_THRUSTERS = 12
"""The compiled numbers hold so many thrusters: one layout, so that all vehicles share one machine code."""

(PX, PY, PZ, DX, DY, DZ, AHEAD, ASTERN, EXPONENT, DEAD_BAND, INFLOW, REACTION) = range(12)
COLUMNS = 12
"""Columns of the compiled table: place, direction, curve, dead band, inflow, reaction arm."""


@dataclass(frozen=True, kw_only=True)
class Thruster(Section):
    """One thruster; its name is that of its table in the file."""

    x: float = parameter("place, forward of the hull centre", "m")
    y: float = parameter("place, to starboard", "m")
    z: float = parameter("place, downward", "m")
    direction_x: float = parameter("direction of thrust ahead, forward", "1")
    direction_y: float = parameter("direction of thrust ahead, to starboard", "1")
    direction_z: float = parameter("direction of thrust ahead, downward", "1")
    thrust_ahead: float = parameter("thrust at full command ahead, at rest, T_ahead", "N", above=0.0)
    thrust_astern: float = parameter("thrust at full command astern, at rest, T_astern", "N", above=0.0)
    curve_exponent: float = parameter("exponent of the thrust curve, e; 2: n squared", "1", low=0.5, high=4.0)
    dead_band: float = parameter("share of the command that does nothing, b", "1", low=0.0, high=0.9)
    loss_per_inflow: float = parameter(
        "thrust lost per speed of the inflow at full command, k", "kg/s", low=0.0
    )
    reaction_arm: float = parameter("reaction torque over thrust, h; negative: left-handed", "m")
    lag: float = parameter("time constant", "s", low=0.0)
    lost_command: float = parameter("share of the command that is lost; 1: dead", "1", low=0.0, high=1.0)

    @property
    def direction(self) -> np.ndarray:
        """d, of length 1 (3,). [-]"""
        d = np.array([self.direction_x, self.direction_y, self.direction_z])
        size = float(np.linalg.norm(d))
        return d / size if size > 0.0 else d

    @property
    def wrench(self) -> np.ndarray:
        """Force and moment about the hull centre per newton of thrust (6,): a column of the allocation. [N/N, m]"""
        arm = np.cross([self.x, self.y, self.z], self.direction) + self.reaction_arm * self.direction
        return np.concatenate([self.direction, arm])

    def row(self) -> np.ndarray:
        """Return the row of the compiled table (COLUMNS,)."""
        curve = (self.thrust_ahead, self.thrust_astern, self.curve_exponent, self.dead_band)
        rest = (self.loss_per_inflow, self.reaction_arm)
        return np.array([self.x, self.y, self.z, *self.direction, *curve, *rest])

    def channels(self, name: str) -> tuple[Channel, ...]:
        """Return its command: the share of full thrust."""
        meaning = f"command of the thruster {name}, -1 full astern to 1 full ahead"
        lag, lost = self.lag, self.lost_command
        return (
            Channel(name=name, meaning=meaning, unit="1", low=-1.0, high=1.0, lag=lag, lost_command=lost),
        )


def table_of(thrusters: tuple[Thruster, ...]) -> np.ndarray:
    """Return the compiled table of all thrusters (MOST_THRUSTERS, COLUMNS), zeros after the last."""
    table = np.zeros((MOST_THRUSTERS, COLUMNS))
    for row, thruster in zip(table, thrusters, strict=False):
        row[:] = thruster.row()
    return table


@inlined
def thruster_force(share: float, inflow: float, row: np.ndarray) -> tuple[float, float]:
    """Return thrust without and with its inflow [N], at a lagged command and an inflow along the direction [m/s]."""
    over = abs(share) - row[DEAD_BAND]
    if over <= 0.0:
        return 0.0, 0.0
    c = over / (1.0 - row[DEAD_BAND])
    most = row[AHEAD] if share > 0.0 else -row[ASTERN]
    bollard = most * c ** row[EXPONENT]
    return bollard, bollard - row[INFLOW] * c * inflow


@compiled
def thrust_at_rest(share: float, row: np.ndarray) -> float:
    """Return the thrust at a lagged command, without inflow. [N]"""
    return thruster_force(share, 0.0, row)[0]


@compiled
def add_thrusters(
    state: np.ndarray, nu_r: np.ndarray, table: np.ndarray, count: int, out: np.ndarray
) -> None:
    """Add the wrench of all thrusters to out (6,) [N, N m].

    Args:
        state: of the vehicle; the lagged commands stand behind entry STATE_SIZE.
        nu_r: velocity relative to the water (u, v, w, p, q, r). [m/s, rad/s]
        table: `table_of` the thrusters.
        count: how many there are.
        out: the six components, added to.
    """
    u, v, w, p, q, r = nu_r[0], nu_r[1], nu_r[2], nu_r[3], nu_r[4], nu_r[5]
    for i in range(min(count, state.size - STATE_SIZE)):  # a state without them has thrusters at rest
        row = table[i]
        x, y, z, a, b, c = row[PX], row[PY], row[PZ], row[DX], row[DY], row[DZ]
        inflow = a * (u + q * z - r * y) + b * (v + r * x - p * z) + c * (w + p * y - q * x)
        bollard, T = thruster_force(state[STATE_SIZE + i], inflow, row)
        X, Y, Z, torque = T * a, T * b, T * c, row[REACTION] * bollard
        out[0] += X
        out[1] += Y
        out[2] += Z
        out[3] += y * Z - z * Y + torque * a
        out[4] += z * X - x * Z + torque * b
        out[5] += x * Y - y * X + torque * c


AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")


def allocation(thrusters: tuple[Thruster, ...], axes: tuple[str, ...] = AXES) -> np.ndarray:
    """Return W B⁺ (thrusters, 6): thrusts of least Σ(T/T_max)² that make a wrench. [N/N, 1/m]

    B (6, thrusters) has the wrench per newton of each as columns, W = diag(T_max):

        T = W (B W)⁺ τ                                          (Fossen 2021, section 11.2.1, weighted pseudo-inverse)

    Components of τ that no thruster makes are made as nearly as possible; those along other than the given axes are
    left to what comes of it.
    """
    B = np.column_stack([thruster.wrench for thruster in thrusters])
    W = np.diag([min(thruster.thrust_ahead, thruster.thrust_astern) for thruster in thrusters])
    made = np.zeros((len(thrusters), len(AXES)))
    rows = [AXES.index(axis) for axis in axes]
    made[:, rows] = W @ np.linalg.pinv(B[rows] @ W)
    return made


def unheld_axes(thrusters: tuple[Thruster, ...], axes: tuple[str, ...]) -> list[str]:
    """Return those of some axes, names of `AXES`, that thrusters cannot push along without pushing along others."""
    if not thrusters:
        return list(axes)
    B = np.column_stack([thruster.wrench for thruster in thrusters])
    wanted = [AXES.index(axis) for axis in axes]
    made = B @ allocation(thrusters)
    return [axis for axis, i in zip(axes, wanted, strict=True) if not abs(made[i, i] - 1.0) < 1e-6]


@compiled
def command_of_thrust(thrust: float, row: np.ndarray) -> float:
    """Return the command that gives a thrust at rest [N], within ±1: the curve undone, dead band skipped. [-]"""
    if thrust == 0.0:
        return 0.0
    most = row[AHEAD] if thrust > 0.0 else row[ASTERN]
    c = min(1.0, (abs(thrust) / most) ** (1.0 / row[EXPONENT]))
    return math.copysign(row[DEAD_BAND] + (1.0 - row[DEAD_BAND]) * c, thrust)


@compiled
def commands_of_wrench(
    wrench: np.ndarray, allocate: np.ndarray, table: np.ndarray, count: int, out: np.ndarray
) -> float:
    """Fill out[4 …] with the commands that make a wrench (6,) on the hull, as far as the thrusters go.

    Where one would pass its limit, all are reduced alike: the wrench keeps its direction. Returns the share of it that
    is made, 1 where no limit is met.

    Args:
        wrench: asked for, body axes. [N, N m]
        allocate: `allocation` of the thrusters (count, 6).
        table: `table_of` them.
        count: how many.
        out: the command of the vehicle, its thrusters behind the first four entries.
    """
    share = 1.0
    for i in range(count):
        thrust = 0.0
        for j in range(6):
            thrust += allocate[i, j] * wrench[j]
        out[4 + i] = thrust
        most = table[i, AHEAD] if thrust > 0.0 else table[i, ASTERN]
        if abs(thrust) > most:
            share = min(share, most / abs(thrust))
    for i in range(count):
        out[4 + i] = command_of_thrust(share * out[4 + i], table[i])
    return share
