"""How the coupled simulation answers when it is disturbed a little: what linear models are held against.

Half the difference of two runs of `subzero.simulate` that are disturbed by as much either way: a hundredth of a degree
of a fin, a hundredth of a revolution a second of the propeller. What is quadratic in them is then below 0.5 %.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

import scenarios
import subzero
from scenarios import Commands
from subzero import autopilot

from .trials import trial, tuning

SETTLED, PULSE, LASTS, STEP = 3.0, 2.0, 12.0, 0.1
"""A run is left alone until its propeller has sped up; then a pulse lasts, and is looked at; step of the cable. [s]"""
SMALL = np.array([1e-2, *np.radians([1e-2, 1e-2, 1e-2])])
"""Disturbance of the commands [rev/s, rad]."""
INPUTS = {
    "surge": np.array([1.0, 0.0, 0.0, 0.0]),
    "yaw_sway": np.array([0.0, 1.0, 0.0, 0.0]),
    "pitch_heave": np.array([0.0, 0.0, 1.0, 1.0]),
}
"""Part of the motion → the commands that move it."""
SEEN = {
    "surge": ("surge_speed",), "yaw_sway": ("heading", "yaw_rate"), "pitch_heave": ("pitch", "pitch_rate"),
}  # fmt: skip
"""Part of the motion → what is looked at; the first of them for sines."""


def run_with(speed: float, wet_length: float, values: np.ndarray) -> scenarios.Trial:
    """Return a run that begins at a speed, cable straight behind, with commands for every cable step (n, 4)."""
    fig6 = trial("fig6")
    start = replace(fig6.start, surge_speed=speed, wet_length=wet_length, heading=0.0)
    commands = Commands(time=STEP * np.arange(len(values)), values=values)
    return replace(fig6, start=start, commands=commands, duration=STEP * len(values))


def held(speed: float, wet_length: float) -> np.ndarray:
    """Return the command (4,) that holds a speed; with more than 20 m of cable the vehicle then slows down."""
    return autopilot.trim(tuning().model, speed=speed, wet_length=min(wet_length, 20.0)).command


def deviations(
    speed: float, wet_length: float, command: np.ndarray, change: np.ndarray
) -> Callable[[str], np.ndarray]:
    """Return the deviation of a run, by channel, in SI units and rad, when its command changes (n, 4)."""
    ends = [subzero.simulate(run_with(speed, wet_length, command + s * change)) for s in (1.0, -1.0)]

    def channel(name: str) -> np.ndarray:
        is_angle = ends[0][name].attrs["units"].startswith("degree")
        half = 0.5 * (ends[0][name].values - ends[1][name].values)
        if name == "heading":
            half = (half + 90.0) % 180.0 - 90.0  # headings near north differ by a full turn
        return np.radians(half) if is_angle else half

    return channel


def pulse(part: str, size: np.ndarray = SMALL) -> np.ndarray:
    """Return a change of the commands (n, 4): a pulse of 2 s after the run has settled, 12 s from its begin."""
    change = np.zeros((round((SETTLED + LASTS) / STEP), 4))
    change[round(SETTLED / STEP) : round((SETTLED + PULSE) / STEP)] = INPUTS[part] * size
    return change


def in_the_middle(speed: float, wet_length: float, command: np.ndarray) -> autopilot.Trim:
    """Return the steady motion with the speed and the cable that a run has in the middle of what is looked at."""
    steps = round((SETTLED + 0.5 * LASTS) / STEP)
    run = subzero.simulate(run_with(speed, wet_length, np.tile(command, (steps, 1))))
    there = {"speed": float(run["surge_speed"][-1]), "wet_length": float(run["cable_length"][-1])}
    return autopilot.trim(tuning().model, **there)


def frozen(part: str, steady: autopilot.Trim, change: np.ndarray, **options: float) -> dict[str, np.ndarray]:
    """Return what the linear model of a steady motion does, by state."""
    import control

    system = autopilot.subsystem(autopilot.linearise(tuning().model, steady, **options), part)
    command = np.append(change @ INPUTS[part] / np.sum(INPUTS[part]), 0.0)
    response = control.forced_response(control.c2d(system, STEP), STEP * np.arange(command.size), command)
    return dict(zip(system.state_labels, np.asarray(response.states), strict=True))


def answer(speed: float, wet_length: float, part: str, frequency: float) -> complex:
    """Return the gain of a run for a sine, about where the cable's length passes through `wet_length`.

    A sine whose amplitude changes evenly, and a slow change, are fitted to 1.1 periods; that the command is held over a
    step is taken out.

    Args:
        speed: [m/s]
        wet_length: [m]
        part: one of `INPUTS`.
        frequency: [rad/s]
    """
    half = 1.1 * np.pi / frequency
    lead = min(12.0, (wet_length - 1.0) / speed - half)
    time = STEP * np.arange(int((lead + 2.0 * half) / STEP) + 1)
    phase = frequency * (time - lead - half)
    sine = np.cos(phase) * np.clip((time - 1.5) / 3.0, 0.0, 1.0)
    command = autopilot.trim(tuning().model, speed=speed, wet_length=wet_length).command
    change, size = np.outer(sine[:-1], INPUTS[part] * SMALL), np.max(INPUTS[part] * SMALL)
    seen = deviations(speed, wet_length - speed * (lead + half), command, change)(SEEN[part][0]) / size
    late = time >= lead
    tau, c, s = (time[late] - lead - half) / half, np.cos(phase[late]), np.sin(phase[late])
    basis = np.stack([c, s, tau * c, tau * s, np.ones_like(tau), tau, tau**2], axis=1)
    fitted = np.linalg.lstsq(basis, seen[late], rcond=None)[0]
    holding = np.exp(-0.5j * frequency * STEP) * np.sinc(0.5 * frequency * STEP / np.pi)
    return complex((fitted[0] - 1j * fitted[1]) / holding)


def frozen_answer(speed: float, wet_length: float, part: str, frequency: float) -> complex:
    """Return the gain of the linear model for a sine."""
    model = tuning().model
    steady = autopilot.trim(model, speed=speed, wet_length=wet_length)
    system = autopilot.subsystem(autopilot.linearise(model, steady), part)
    return complex(np.squeeze(system(1j * frequency))[system.state_labels.index(SEEN[part][0])])


def error(found: np.ndarray, expected: np.ndarray) -> float:
    """Return the largest difference as a share of the largest deviation."""
    return float(np.max(np.abs(found - expected)) / np.max(np.abs(expected)))
