"""Records whose simulation is led along what was measured: where the search for the numbers begins.

    M ν̇ = … + (m / lag) (ν_measured(t) − ν)          on surge, roll, pitch and yaw

Left to itself, a vehicle whose numbers are off by 40 % is soon far from the record: what it leaves grows with time, is
curved in the numbers, and has minima that say nothing. Led back within `lag`, it stays close, and what is left says
what force is missing there and then, nearly linear in the numbers; they come near from anywhere. A longer and longer
lag leads on to the simulation as it is. Such a correction is that of an observer (Peng, Li and Grebogi 2008 and
Abarbanel and others 2009 call it synchronisation; Vyasarayani and others 2012 lower it as a homotopy).

Sway and heave are not measured, and follow. Nothing of this is in the fit that counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.interpolate import make_smoothing_spline
from scipy.spatial.transform import Rotation

from subzero.channels import BY_NAME, DEGREE
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.inference import Observed, Problem
from subzero.external_force import AXES, MissingForce

LED = {"X": "surge", "K": "roll", "M": "pitch", "N": "yaw"}
"""Axis of the correction → its name in the numbers of a vehicle."""
ATTITUDE = {"N": "heading", "M": "pitch", "K": "roll_angle"}
"""Axis that an angle turns about, in the order of the turns → its channel."""
STEP_S = 0.1
"""Time between two values of what is measured, made smooth. [s]"""
FEWEST = 8
"""A channel with fewer samples leads nothing."""


def led(problem: Problem, lag: float) -> Problem:
    """Return the problem of records whose simulation is led back to what was measured within a lag. [s]"""
    records = tuple(replace(one, setting=_led(one, lag)) for one in problem.records)
    return replace(problem, records=records)


def _led(one: Observed, lag: float) -> Setting:
    """Return the setting of a record with the correction: a linear damping, and a force that keeps up what it takes."""
    setting, duration = one.setting, one.setting.trial.duration
    time = np.linspace(0.0, duration, max(int(duration / STEP_S), 1) + 1)
    inertia = _inertia(setting)
    wrench, damping = np.zeros((time.size, 6)), {}
    for axis, speed in velocities(one, time).items():
        gain = inertia[axis] / lag
        wrench[:, AXES.index(axis)] = gain * speed
        damping[f"linear_damping__{LED[axis]}"] = _less(gain)
    force = MissingForce(time=tuple(time.tolist()), wrench=tuple(map(tuple, wrench.tolist())))
    return setting.with_vehicle(**damping).with_model(missing=force + setting.model.missing)


def _less(gain: float) -> Callable[[float], float]:
    return lambda old: old - gain


def _inertia(setting: Setting) -> dict[str, float]:
    """Return axis → mass [kg] or inertia [kg m2], with that of the water."""
    body, water = setting.model.vehicle.rigid_body, setting.model.vehicle.added_mass
    return {"X": body.mass + water.surge, "K": body.roll_inertia + water.roll,
            "M": body.pitch_inertia + water.pitch, "N": body.yaw_inertia + water.yaw}  # fmt: skip


def velocities(one: Observed, time: np.ndarray) -> dict[str, np.ndarray]:
    """Return axis → velocity or rate of the body (n,) at times (n,), as a record has it, made smooth. [m/s, rad/s]

    Rates are those of the attitude as a rotation, so that a vehicle may roll over; an angle that was not measured is 0,
    and what turns about its axis is not led.
    """
    found = {}
    if "surge_speed" in one.noise:
        found["X"] = _smooth(*_measured(one, "surge_speed"), time)
    angles = {axis: _measured(one, name) for axis, name in ATTITUDE.items() if name in one.noise}
    if angles:
        at = np.unique(np.concatenate([times for times, _ in angles.values()]))
        rows = [_between(angles.get(axis), at) for axis in "NMK"]
        attitude = Rotation.from_euler("ZYX", np.stack(rows, axis=1))
        rates = (attitude[:-1].inv() * attitude[1:]).as_rotvec() / np.diff(at)[:, None]
        middle = 0.5 * (at[1:] + at[:-1])
        found |= {axis: _smooth(middle, rates[:, "KMN".index(axis)], time) for axis in angles}
    if "yaw_rate" in one.noise:
        found["N"] = _smooth(*_measured(one, "yaw_rate"), time)
    return {axis: values for axis, values in found.items() if values is not None}


def _measured(one: Observed, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return when a channel was measured, and what, in SI units; without outliers."""
    used = one.noise[name].used
    in_si = 1.0 / DEGREE if BY_NAME[name].unit.startswith("degree") else 1.0
    return one.time[used], one.values[name][used] * in_si


def _between(measured: tuple[np.ndarray, np.ndarray] | None, time: np.ndarray) -> np.ndarray:
    """Return an angle at other times (n,), linear between samples, jumps of whole turns taken out; 0 of none."""
    if measured is None:
        return np.zeros(time.size)
    between: np.ndarray = np.interp(time, measured[0], np.unwrap(measured[1]))
    return between


def _smooth(time: np.ndarray, values: np.ndarray, at: np.ndarray) -> np.ndarray | None:
    """Return values as a smooth curve at other times, constant outside; None if they are too few."""
    if time.size < FEWEST:
        return None
    smooth: np.ndarray = make_smoothing_spline(time, values)(np.clip(at, time[0], time[-1]))
    return smooth
