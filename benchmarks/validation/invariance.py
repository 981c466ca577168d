"""Nature has no favourite direction, no clock, and no place at rest.

A cable is pulled out for 10 s through a swaying manoeuvre at about 1 m/s, and again with everything turned, mirrored
or started 4 s later. The force on the vehicle must be the same, turned, mirrored or 4 s later. A neutral cable in still
water knows no direction; with weight, current, friction and inertia everything is turned about the vertical.

At last everything drifts: drum, water and vehicle have the velocity (0.7, −0.4, 0.2) m/s on top, without effect on
the force. Only the first step remembers it, for momenta are then differenced to first order; it is left out.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import cable

from .row import Row, Setting

HEAVY = cable.CableProperties(mass_per_length=0.02)
DRUM = cable.DrumProperties(inertia=1e-4, friction_torque=0.01)
STREAM = np.array([0.1, -0.05, 0.0])
AHEAD = np.array([0.81, 0.55, -0.2])
SWAY = 0.2 * np.array([[0.9, -0.4, 0.6], [0.3, 0.8, -0.7], [-0.5, 0.6, 0.4]])
DRIFT = np.array([0.7, -0.4, 0.2])


def manoeuvre(t: float) -> np.ndarray:
    """Return a smooth motion that starts from rest and sways in all directions (3,). [m/s]."""
    start = np.sin(0.5 * np.pi * np.clip(t, 0.0, 1.0)) ** 4
    return start * (AHEAD + SWAY @ np.sin(np.array([0.2, 0.37, 0.53]) * t + np.array([0.3, 1.1, 2.0])))


def about_down(angle: float) -> np.ndarray:
    """Return the rotation about the vertical (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def turned(name: str, matrix: np.ndarray, loaded: bool) -> Row:
    """Compare the forces of a manoeuvre with those of the same seen through `matrix` (3, 3)."""

    def run(look: np.ndarray) -> cable.History:
        extra: dict[str, Any] = {"cable": HEAVY, "drum": DRUM, "current": look @ STREAM} if loaded else {}
        return cable.pull_out(lambda t: look @ manoeuvre(t), 10.0, **extra)

    return worst_vector(name, run(matrix).tow_force, run(np.eye(3)).tow_force @ matrix.T, 1e-9)


def worst_vector(name: str, ours: np.ndarray, reference: np.ndarray, gate: float) -> Row:
    """Compare two series of forces (n, 3) where they differ most, relative to the largest force."""
    k = int(np.linalg.norm(ours - reference, axis=1).argmax())
    largest = float(np.linalg.norm(reference, axis=1).max())
    sizes = np.linalg.norm(ours[k]), np.linalg.norm(reference[k])
    row = Setting(f"{name}: force", "symmetry of (7)", gate).row(float(sizes[0]), float(sizes[1]), largest)
    return replace(
        row, error=float(np.linalg.norm(ours[k] - reference[k])) / largest, measure="of the vector"
    )


def later(wait: float = 4.0) -> Row:
    """Compare a manoeuvre with the same, begun later by a vehicle that waits at the drum."""
    prompt = cable.pull_out(manoeuvre, 10.0)
    late = cable.pull_out(lambda t: manoeuvre(t - wait) if t > wait else np.zeros(3), 10.0 + wait)
    skipped = round(wait / 0.1)
    return worst_vector(
        f"started {wait:g} s later", late.tow_force[skipped + 1 :], prompt.tow_force[1:], 1e-6
    )


def drifting(name: str, drum: cable.DrumProperties | cable.ConstantTension, gate: float) -> Row:
    """Compare the forces of a manoeuvre with those of the same on a drum that drifts with the water."""
    rest, moved = (
        cable.pull_out(lambda t, V=V: manoeuvre(t) + V, 10.0, cable=HEAVY, drum=held, current=STREAM + V)
        for V, held in (
            (np.zeros(3), drum),
            (DRIFT, cable.MovingDrum(velocity=lambda _t: DRIFT, drum=drum)),
        )
    )
    what = f"everything drifts at {np.linalg.norm(DRIFT):.2f} m/s, {name}"
    row = worst_vector(what, moved.tow_force[2:], rest.tow_force[2:], gate)
    return replace(row, source="Galilean invariance")


def rows(quick: bool) -> list[Row]:
    """Compare turned, mirrored, later and drifting manoeuvres."""
    any_turn = (
        about_down(1.1) @ np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]) @ about_down(-0.4)
    )
    return [
        turned("neutral cable, turned about all axes", any_turn, False),
        turned("neutral cable, mirrored upside down", np.diag([1.0, 1.0, -1.0]), False),
        turned("weight, current and drum, turned about the vertical", about_down(2.3), True),
        turned("weight, current and drum, port for starboard", np.diag([1.0, -1.0, 1.0]), True),
        later(),
        drifting("free drum", DRUM, 1e-9),
        drifting("winch at 0.5 N", cable.ConstantTension(tension=0.5), 1e-7),
    ]
