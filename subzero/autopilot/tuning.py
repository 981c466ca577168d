"""The gain schedule of the standard autopilots: gains, trim and fin effectiveness of a vehicle at several speeds.

The design is for the bare hull. The cable is not part of it, so the feedback remains valid when the cable is cut.
`WEIGHTS` are the largest acceptable deviations of each loop (Bryson's rule); give others to `tune`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from subzero.autopilot.design import WEIGHTS, Gains, Schedule, Weights, checked, design_gains, reduced
from subzero.autopilot.linear import linearise, subsystem
from subzero.model import Model
from subzero.steady_motion.trim import trim
from subzero.steady_motion.trim_point import Trim, held_speeds
from vehicle.propeller import thrust

if TYPE_CHECKING:
    import control

SPEEDS = (0.4, 0.6, 0.8, 1.0, 1.2, 1.4)
"""Speeds that gains are designed at, if the hull holds them; else as many over the range that it holds. [m/s]"""


@dataclass(frozen=True, kw_only=True, eq=False)
class Tuning:
    """Models, gains and trim of a vehicle, scheduled on its speed.

    Attributes:
        model: the hull that was designed for.
        speeds: [m/s]
        linear: the linear model of the bare hull at each speed.
        designs: loop → the design at each speed.
        gains: loop → (k of each measured, k_I, b) over speed.
        hull_drag: thrust that the bare hull needs, over speed. [N]
        planes: trim of the planes, mean and half difference, over speed (2,). [rad]
        rudder_for: rudder per external sway force and yaw moment that it cancels (2,). [rad/N, rad/(N m)]
        planes_for: mean of the planes per external heave force and pitch moment (2,). [rad/N, rad/(N m)]
        sway_per_yaw: sway speed of a steady turn over its yaw rate. [m]
        rudder_per_yaw: rudder of a steady turn over its yaw rate. [s]
    """

    model: Model
    speeds: tuple[float, ...]
    linear: tuple[control.StateSpace, ...]
    designs: Mapping[str, tuple[Gains, ...]]
    gains: Mapping[str, Schedule]
    hull_drag: Schedule
    planes: Schedule
    rudder_for: Schedule
    planes_for: Schedule
    sway_per_yaw: Schedule
    rudder_per_yaw: Schedule


def tune(
    model: Model, *, speeds: tuple[float, ...] | None = None, weights: Mapping[str, Weights] | None = None
) -> Tuning:
    """Return the gain schedule of a vehicle: linear models and gains at several speeds.

    Args:
        model: of the vehicle; its cable is not used.
        speeds: increasing; beyond them the gains of the ends hold; by default those of `speeds_of`. [m/s]
        weights: loop → weights that replace those of `WEIGHTS`.

    Raises:
        NoTrimError: the vehicle has no steady motion at one of the speeds.
        UserError: there is no such loop or weight, or a weight is not above 0.
    """
    weights = WEIGHTS | checked(dict(weights or {}))
    speeds = speeds_of(model) if speeds is None else speeds
    trims = [trim(model, speed=speed) for speed in speeds]
    lines = [linearise(model, steady) for steady in trims]
    designs = {name: tuple(design_loop(line, weight) for line in lines) for name, weight in weights.items()}

    def over_speed(values: list[np.ndarray]) -> Schedule:
        return Schedule(np.array(speeds, dtype=float), np.array(values))

    inverse = model.vehicle.numbers().inverse_mass
    return Tuning(
        model=model,
        speeds=speeds,
        linear=tuple(lines),
        designs=designs,
        gains={name: over_speed([each.numbers() for each in found]) for name, found in designs.items()},
        hull_drag=over_speed([np.array(_thrust(model, steady)) for steady in trims]),
        planes=over_speed([_mixed_planes(steady) for steady in trims]),
        rudder_for=over_speed(
            [_against(line, "yaw_sway", inverse[np.ix_((1, 5), (1, 5))]) for line in lines]
        ),
        planes_for=over_speed(
            [_against(line, "pitch_heave", inverse[np.ix_((2, 4), (2, 4))]) for line in lines]
        ),
        sway_per_yaw=over_speed([_steady_turn(line)[0] for line in lines]),
        rudder_per_yaw=over_speed([_steady_turn(line)[1] for line in lines]),
    )


def speeds_of(model: Model) -> tuple[float, ...]:
    """Return `SPEEDS`, or where the hull holds one of them not, as many that it holds. [m/s]"""
    slowest, fastest = held_speeds(model)
    if slowest <= SPEEDS[0] and SPEEDS[-1] <= fastest:
        return SPEEDS
    return tuple(np.linspace(max(slowest, SPEEDS[0]), fastest, len(SPEEDS)).tolist()) if fastest else SPEEDS


def design_loop(linear: control.StateSpace, weights: Weights) -> Gains:
    """Return the gains of one loop on a linear model of the whole hull."""
    part = reduced(subsystem(linear, weights.part), weights.measured)
    steady = -np.linalg.lstsq(np.asarray(part.B), np.asarray(part.A), rcond=None)[0][0, -1]
    return design_gains(
        part,
        tracked=weights.measured[-1],
        largest=weights.largest,
        largest_command=weights.largest_command,
        ahead=float(steady) if weights.foreseen else 0.0,
    )


def _thrust(model: Model, steady: Trim) -> float:
    """Return the thrust on the hull of a steady motion [N]."""
    return float(
        thrust(
            steady.propeller_rps, steady.speed, model.vehicle.propeller.numbers(model.vehicle.water.density)
        )
    )


def _mixed_planes(steady: Trim) -> np.ndarray:
    """Return mean and half difference of the planes. [rad]"""
    port, starboard = steady.state[14], steady.state[15]
    return np.array([0.5 * (starboard + port), 0.5 * (starboard - port)])


def _against(linear: control.StateSpace, name: str, inverse_mass: np.ndarray) -> np.ndarray:
    """Return the fin angle per external force and moment (2,) that keeps the turn rate at 0 in steady sway (heave).

    A = [a_v  a_vr; a_rv  a_r], b by the fin: with v' = 0 and r = 0, r' = (1, −a_rv/a_v)·(d_r + b_r δ, d_v + b_v δ).
    """
    part = subsystem(linear, name)
    A, labels = np.asarray(part.A), list(part.state_labels)
    fin = labels[-1]
    v, r, f = 0, 1, labels.index(fin)
    row = np.array([-A[r, v] / A[v, v], 1.0])
    shares: np.ndarray = -(row @ inverse_mass) / float(row @ A[[v, r], f])
    return shares


def _steady_turn(linear: control.StateSpace) -> np.ndarray:
    """Return sway speed [m] and rudder [s] of a steady turn, over its yaw rate."""
    part = subsystem(linear, "yaw_sway")
    A = np.asarray(part.A)
    return np.linalg.solve(A[:2][:, [0, 3]], -A[:2, 1])
