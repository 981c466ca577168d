"""A free-tail cable of 30 m (Table 1) is towed round a circle at 1 m/s until it turns as a rigid shape. Reference: the
steady turn as an ordinary differential equation (`benchmarks/validation/turn_equation.py`), solved by shooting from the
tail, with tangential and normal drag, centripetal inertia and added mass. Segments of 0.3 m unless said.

No turn can be tighter than R_c: the tail lies further in than the tow point, R_c is where it reaches the centre, and
R_c = 0.197 L for this cable. In a tighter circle only a part of the cable can turn, the longest that has a steady shape
at that radius. It pulls as if the rest were not there. The rest lies slack in the water beyond the centre, left where
it was, with a tail that does not turn with the vehicle: there is no shape to settle to. Both are shown.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

import cable
from subzero.figures.style import BLUE, CYCLE, GREEN, INK, NORMAL, ORANGE, SMALL, TINY

from .row import Row, Setting, order_row
from .turn_equation import critical_radius, from_tail, longest, smallest_tail, steady_turn

LENGTH, SPEED, TABLE_1 = 30.0, 1.0, cable.CableProperties()
SOURCE = "ODE of (7)"


@cache
def turning(radius: float, segments: int = 100, step: float = 1.0 / 300.0) -> cable.History:
    """Tow a cable from straight ahead into a circle, five lengths and once round; `step` is an angle. [rad]."""
    rate = SPEED / radius
    return cable.tow(
        lambda t: (SPEED * np.cos(rate * t), SPEED * np.sin(rate * t), 0.0),
        LENGTH,
        5.0 * LENGTH / SPEED + 2.0 * np.pi / rate,
        scheme=cable.MovingEnd(time_step=step / rate, segment_length=LENGTH / segments),
    )


def seen_turning(run: cable.History, radius: float, k: int = -1) -> tuple[complex, np.ndarray]:
    """Return the force, and the nodes' places, in row k, from axes about the centre that turn with the tow point."""
    angle = SPEED / radius * run.time[k]
    towards_centre = np.array([-np.sin(angle), np.cos(angle)])
    nodes = run.shapes[k][:, :2] - run.shapes[k][0, :2] - radius * towards_centre
    back = 1j * np.exp(-1j * angle)
    return complex(*run.tow_force[k, :2]) * back, (nodes[:, 0] + 1j * nodes[:, 1]) * back


def force_row(name: str, ours: complex, exact: complex, gate: float) -> Row:
    """Compare tow forces, outward + i forward."""
    return Setting(name, SOURCE, gate).vector([ours.real, ours.imag], [exact.real, exact.imag], "tow force")


def steady_rows(radius: float, gate: float) -> list[Row]:
    """Compare force and tail of a steady turn; the tail's place is judged against the length of the cable."""
    run, exact = turning(radius), steady_turn(radius, SPEED, LENGTH, TABLE_1)
    ours, nodes = seen_turning(run, radius)
    tail = Setting(f"R = {radius:g} m", SOURCE, 1e-3, "m").vector(
        [nodes[-1].real, nodes[-1].imag], [exact.place[0].real, exact.place[0].imag], "tail from the centre"
    )
    tail = replace(tail, error=abs(nodes[-1] - exact.place[0]) / LENGTH, measure="of the place, per length")
    return [force_row(f"R = {radius:g} m", ours, exact.force, gate), tail, rate_row(run, radius, 1.0, 1e-3)]


def rate_row(run: cable.History, radius: float, expected: float, gate: float) -> Row:
    """Compare how fast the tail goes round the centre in the last turn with the tow point's rate."""
    last = np.flatnonzero(run.time > run.time[-1] - 2.0 * np.pi * radius / SPEED)
    angles = np.unwrap([np.angle(seen_turning(run, radius, k)[1][-1]) for k in last])
    rate = 1.0 + (angles[-1] - angles[0]) / (2.0 * np.pi)
    setting = Setting(f"R = {radius:g} m", "rigid turn", gate, "")
    return setting.row(rate, expected, 1.0, "turning rate of the tail per rate of the tow point")


def tighter_rows(radius: float) -> list[Row]:
    """Compare the force in a turn tighter than R_c with that of the longest cable that can turn; the tail stays."""
    most = from_tail(smallest_tail(TABLE_1), SPEED / radius, longest(radius, TABLE_1), TABLE_1)
    run = turning(radius, 100, 1.0 / 100.0)
    ours, _ = seen_turning(run, radius)
    return [force_row(f"R = {radius:g} m < R_c", ours, most.force, 1e-3), rate_row(run, radius, 0.0, 0.05)]


def rows(quick: bool) -> list[Row]:
    """Compare turns of several radii, and turns tighter than the tightest."""
    found = [row for radius in ((30.0,) if quick else (60.0, 30.0)) for row in steady_rows(radius, 2e-4)]
    if quick:
        return found + tighter_rows(4.0)
    found += [row for radius in (15.0, 10.0, 8.0) for row in steady_rows(radius, 2e-4)]
    found += [row for radius in (4.0, 2.0) for row in tighter_rows(radius)]
    exact = steady_turn(30.0, SPEED, LENGTH, TABLE_1).force
    sizes = (25, 50, 100, 200)
    errors = [abs(seen_turning(turning(30.0, n, 1.0 / 900.0), 30.0)[0] - exact) / abs(exact) for n in sizes]
    shown = order_row("R = 30 m, tow force", [LENGTH / n for n in sizes], errors, "Δs", SOURCE)
    return [*found, replace(shown, gate=np.inf)]


def draw(figure: Any) -> None:
    """Draw the steady shapes, and what is left of one in a turn that is too tight."""
    steady, tight = figure.subplots(1, 2)
    for radius, colour in zip((30.0, 15.0, 10.0, 8.0), CYCLE, strict=False):
        exact = steady_turn(radius, SPEED, LENGTH, TABLE_1).place
        _, nodes = seen_turning(turning(radius), radius)
        steady.plot(exact.real, exact.imag, color=colour, linewidth=1.0, label=f"R = {radius:g} m")
        steady.plot(nodes.real[::5], nodes.imag[::5], "o", color=colour, markersize=2.5)
    for ago, colour in ((0.0, BLUE), (4.0, ORANGE), (8.0, GREEN)):
        run = turning(4.0, 100, 1.0 / 100.0)
        _, nodes = seen_turning(run, 4.0, -1 - round(ago / (run.time[1] - run.time[0])))
        tight.plot(nodes.real, nodes.imag, color=colour, linewidth=1.0, label=f"{ago:g} s before the end")
    arm = from_tail(smallest_tail(TABLE_1), SPEED / 4.0, longest(4.0, TABLE_1), TABLE_1).place
    tight.plot(arm.real, arm.imag, color=INK, linestyle=":", linewidth=1.5, label="longest steady shape")
    steady.set_title("ODE (lines) and cable (dots)", fontsize=NORMAL)
    tight.set_title(f"R = 4 m, below R_c = {critical_radius(LENGTH, TABLE_1):.2f} m", fontsize=NORMAL)
    for axes in (steady, tight):
        axes.set_aspect("equal", "datalim")
        axes.plot(0.0, 0.0, "+", color=INK)
        axes.legend(fontsize=TINY, frameon=False)
        axes.tick_params(labelsize=TINY)
        axes.set_xlabel("outward [m]", fontsize=SMALL)
        axes.set_ylabel("forward [m]", fontsize=SMALL)
