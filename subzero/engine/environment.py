"""Convert plain values to those of compiled code: the motion of the drum, and the control of its winch."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import scenarios
from cable.drum import DrumProperties
from cable.drum_motion import PLACE, SETPOINT, VELOCITY, resting
from cable.winch import Brake, ConstantTension, PayOutRate, Winch
from subzero.model import Model


def drum_of(model: Model) -> DrumProperties | Winch:
    """Return the free drum, or the winch."""
    winch = model.winch
    if winch is None:
        return model.drum
    if winch.control == "brake":
        return Brake()
    follow = _follow(winch.time, winch.setpoint)
    return PayOutRate(rate=follow) if winch.control == "pay_out_rate" else ConstantTension(tension=follow)


def drum_direction(trial: scenarios.Trial, model: Model, wet: float) -> np.ndarray:
    """Return the way of the drum, and the setpoint of its winch, from a length `wet` [m] on, as `cable.drum_motion`.

    The times are those of the exchanges, and of all changes of winch and vessel: between them a velocity is linear, so
    the way is summed up exactly.
    """
    drum, vessel = drum_of(model), model.vessel
    if isinstance(drum, DrumProperties) and vessel is None:
        return resting(np.array([0.0, max(trial.duration, trial.cable_step)]))
    times = _times(trial, model)
    led = resting(times) if isinstance(drum, DrumProperties) else resting(times, drum.setpoints(times, wet))
    if vessel is None:
        return led
    at = np.array(vessel.velocity, dtype=float)
    velocity = np.column_stack([np.interp(times, vessel.time, column) for column in at.T])
    steps = 0.5 * np.diff(times)[:, None] * (velocity[1:] + velocity[:-1])
    led[:, PLACE:VELOCITY] = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    led[:, VELOCITY:SETPOINT] = velocity
    return led


def _times(trial: scenarios.Trial, model: Model) -> np.ndarray:
    """Return the times of the exchanges and of the changes of winch and vessel, increasing. [s]."""
    rows = trial.times()
    changes = [thing.time for thing in (model.winch, model.vessel) if thing is not None]
    times = np.concatenate([rows, *changes])
    times = np.unique(times[times <= rows[-1]])
    return times[np.diff(times, prepend=-np.inf) > 1e-9]  # decimal fractions are not exact in binary


def _follow(time: tuple[float, ...], values: tuple[float, ...]) -> Callable[[float], float]:
    """Return the function that is linear between values at times, and constant after the last."""
    return lambda t: float(np.interp(t, time, values))
