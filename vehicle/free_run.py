"""A run of the hull alone, in still or flowing water: no cable, no files, one compiled loop.

Classic Runge-Kutta of fourth order with a fixed step; commands are held during a step. The work of each kind
of force (`dynamics.POWERS`) is integrated with the same stages, so the energy balance closes to the order of
the scheme. The coupled simulation has its own loop, because there the pull of the cable changes inside a
step.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from subzero.jit import allocating
from vehicle.dynamics import POWERS, derivative_and_power, finish_step
from vehicle.state import STATE_SIZE
from vehicle.vehicle import Vehicle, VehicleNumbers

WORKS = len(POWERS)


class FreeRun(NamedTuple):
    """History of a free run: time (n,) [s], states (n, entries of the state), work (n, len(POWERS)) since
    the start [J].
    """

    time: np.ndarray
    states: np.ndarray
    work: np.ndarray


@allocating
def march(
    commands: np.ndarray,
    step: float,
    current_n: np.ndarray,
    wrench_b: np.ndarray,
    numbers: VehicleNumbers,
    history: np.ndarray,
) -> None:
    """Fill history (n + 1, entries of the state and behind them the works) from its first row on, one command of
    commands (n, 4 …) a step [s].
    """
    size, n = history.shape[1], history.shape[1] - WORKS
    k, stage = np.empty((4, size)), np.empty(size)
    for row in range(commands.shape[0]):
        y, out, command = history[row], history[row + 1], commands[row]
        derivative_and_power(y[:n], command, current_n, wrench_b, numbers, k[0, :n], k[0, n:])
        for i in range(1, 4):
            part = step if i == 3 else 0.5 * step
            for j in range(size):
                stage[j] = y[j] + part * k[i - 1, j]
            derivative_and_power(stage[:n], command, current_n, wrench_b, numbers, k[i, :n], k[i, n:])
        for j in range(size):
            out[j] = y[j] + step / 6.0 * (k[0, j] + 2.0 * k[1, j] + 2.0 * k[2, j] + k[3, j])
        finish_step(out[:n], command, numbers)


def free_run(
    vehicle: Vehicle | VehicleNumbers,
    state: np.ndarray,
    commands: np.ndarray | Sequence[float],
    duration: float,
    step: float = 0.02,
    *,
    current_n: Sequence[float] = (0.0, 0.0, 0.0),
    wrench_b: Sequence[float] = (0.0,) * 6,
) -> FreeRun:
    """Run the hull alone and return its history.

    Args:
        vehicle: the vehicle, or its numbers.
        state: where it starts, for example from `initial_state`.
        commands: one command (4,) for the whole run, or one a step (n, 4): propeller [rev/s], rudder, port
            plane, starboard plane [rad]; behind them one for each channel.
        duration: how long. [s]
        step: of the Runge-Kutta scheme. [s]
        current_n: velocity of the water, earth axes. [m/s]
        wrench_b: a constant external force and moment, body axes. [N, N m]
    """
    numbers = vehicle.numbers() if isinstance(vehicle, Vehicle) else vehicle
    steps = round(duration / step)
    given, size = np.asarray(commands, dtype=float), STATE_SIZE + int(numbers.channel_count)
    held = np.array(np.broadcast_to(given, (steps, given.shape[-1])))
    history = np.zeros((steps + 1, size + WORKS))
    history[0, : len(state)] = state
    current, wrench = np.array(current_n, dtype=float), np.array(wrench_b, dtype=float)
    march(held, float(step), current, wrench, numbers, history)
    time = step * np.arange(steps + 1)
    return FreeRun(time, history[:, :size], history[:, size:])
