"""Nature has no favourite direction and no clock, and what goes out can come in again.

A cable is pulled out for 10 s through a swaying manoeuvre at about 1 m/s, and again with everything turned, mirrored
or begun 4 s later. The force on the vehicle must be the same, turned, mirrored or 4 s later. A neutral cable in still
water knows no direction; with weight, current, friction and inertia everything is turned about the vertical.

A straight line that a winch holds at 0.6 N goes out and comes in with u = sin(πt/20 s) m/s, and

    T(0) = 0.6 N + (½ρπdC_t u|u| + m u′) S,        S = 1e-6 m + ∫u dt,  back to 1e-6 m

At last a hanging cable of 10 m is paid out by 2 m and reeled in again: force and shape must be those of before.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import cable

from .held_cable import going_to, share_per_second
from .row import Row, Setting, order_row

HEAVY = cable.CableProperties(mass_per_length=0.02)
TABLE_1 = cable.CableProperties()
DRUM = cable.DrumProperties(inertia=1e-4, friction_torque=0.01)
STREAM = np.array([0.1, -0.05, 0.0])
AHEAD = np.array([0.81, 0.55, -0.2])
SWAY = 0.2 * np.array([[0.9, -0.4, 0.6], [0.3, 0.8, -0.7], [-0.5, 0.6, 0.4]])
PERIOD, WINCH_TENSION = 40.0, 0.6


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
    return worst_vector(f"begun {wait:g} s later", late.tow_force[skipped + 1 :], prompt.tow_force[1:], 1e-6)


def to_and_fro(step: float) -> tuple[cable.History, np.ndarray]:
    """Pull a line out and let it in on a winch of constant tension; return T(0) of the closed form as well."""
    rate = 2.0 * np.pi / PERIOD
    run = cable.pull_out(
        lambda t: (np.sin(rate * t), 0.0, 0.0),
        PERIOD,
        step,
        segment_length=0.127,
        drum=cable.ConstantTension(tension=WINCH_TENSION),
    )
    u, length = np.sin(rate * run.time), (1.0 - np.cos(rate * run.time)) / rate + 1e-6
    load = TABLE_1.tangential_drag * u * np.abs(u) + TABLE_1.mass_per_length * rate * np.cos(rate * run.time)
    return run, WINCH_TENSION + load * length


def line_rows(quick: bool) -> list[Row]:
    """Compare a straight line that goes out to 12.7 m, in 100 segments, and comes in again."""
    steps, source = (0.2, 0.1, 0.05) if quick else (0.4, 0.2, 0.1, 0.05), "(7), straight"
    refined, setting = [], Setting("out and in on a line", source, 1e-4)
    for step in steps:
        run, exact = to_and_fro(step)
        refined.append(setting.worst(run.tow_tension[1:], exact[1:], WINCH_TENSION, f"T(0), {step:g} s"))
    back = Setting("out and in on a line", "start", 1e-7, "m").row(
        float(run.length[-1]), 1e-6, float(run.length.max()), "length at the end, per longest"
    )
    slope = order_row("out and in on a line", steps, [row.error for row in refined], "Δt", source)
    return [refined[-1], slope, back]


def hanging_rows() -> list[Row]:
    """Compare a hanging cable before and after two metres more have hung there for a while."""

    def rate(t: float) -> float:
        out, back = (
            share_per_second(t - 60.0) if t > 60.0 else 0.0,
            share_per_second(t - 120.0) if t > 120.0 else 0.0,
        )
        return 10.0 * share_per_second(t) + 2.0 * (out - back)

    run = cable.pull_out(
        going_to((9.0, 0.0, 0.0)),
        200.0,
        0.5,
        segment_length=0.1,
        cable=HEAVY,
        drum=cable.PayOutRate(rate=rate),
    )
    before = int(np.searchsorted(run.time, 59.75))
    force = worst_vector(
        "a hanging cable, out and in", run.tow_force[-1:], run.tow_force[before : before + 1], 1e-4
    )
    deepest = [run.shapes[k][:, 2].max() for k in (-1, before)]
    sag = Setting("a hanging cable, out and in", "before", 1e-4, "m").row(*map(float, deepest), what="sag")
    return [force, sag]


def rows(quick: bool) -> list[Row]:
    """Compare turned, mirrored and later manoeuvres, and what comes back to where it was."""
    any_turn = (
        about_down(1.1) @ np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]) @ about_down(-0.4)
    )
    found = [
        turned("neutral cable, turned about all axes", any_turn, False),
        turned("neutral cable, mirrored upside down", np.diag([1.0, 1.0, -1.0]), False),
        turned("weight, current and drum, turned about the vertical", about_down(2.3), True),
        turned("weight, current and drum, port for starboard", np.diag([1.0, -1.0, 1.0]), True),
        later(),
    ]
    return [*found, *line_rows(quick), *hanging_rows()]
