"""A taut cable is shaken at the tow point by g(t): the cable at s then moves by g(t − s/c), with c = √(T/m1).

Until the wave comes to the drum, d'Alembert's solution is exact, whatever g. Deflections are 1e-4 of the length;
still water, drag off. A long wave, g growing as (ct/L)³, shows the speed; a bell of a tenth of the length
shows how its shape converges: short waves are late in space, ahead in time.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import least_squares

from .row import Row, Setting, order_row
from .taut_string import SPAN, SPEED, taut

HEIGHT = 1e-4 * SPAN
CROSSING = SPAN / SPEED
"""Time from end to end. [s]"""
SOURCE = "d'Alembert, (7)"
Shake = Callable[[np.ndarray | float], np.ndarray | float]


def bell(time: np.ndarray | float) -> np.ndarray | float:
    """Return a deflection that comes and goes within some 0.2 of a crossing. [m]."""
    return HEIGHT * np.exp(-((10.0 * time / CROSSING - 3.0) ** 2))


def long_wave(time: np.ndarray | float) -> np.ndarray | float:
    """Return a deflection that grows. [m]."""
    return HEIGHT * np.maximum(time / CROSSING, 0.0) ** 3


def shaken(shake: Shake, segments: int, steps: int, crossings: float) -> tuple[np.ndarray, np.ndarray]:
    """Return where the nodes are (nodes,), from the tow point, and how far east after some crossings. [m]."""
    string = taut(segments)
    tow, step = string.positions[0], crossings * CROSSING / steps
    for k in range(1, steps + 1):
        string.step(step, tow + np.array([0.0, shake(k * step), 0.0]))
    x = string.positions
    return SPAN - x[:, 0], x[:, 1]


def speed_row(segments: int, steps: int) -> Row:
    """Compare the speed that fits the long wave best."""
    place, east = shaken(long_wave, segments, steps, 0.95)
    end = 0.95 * CROSSING

    def misfit(q: np.ndarray) -> np.ndarray:
        return (long_wave(end - place / (q[0] * SPEED)) - east) / HEIGHT

    fit = least_squares(misfit, [1.01], xtol=1e-14)
    setting = Setting(f"{segments} segments, {steps} steps: speed of a long wave", "√(T/m1)", 1e-4, "m/s")
    return setting.row(float(fit.x[0]) * SPEED, SPEED)


def shape_error(segments: int, steps: int) -> float:
    """Return the largest error of the bell after 0.8 crossings, as a share of its height."""
    place, east = shaken(bell, segments, steps, 0.8)
    return float(np.abs(east - bell(0.8 * CROSSING - place / SPEED)).max() / HEIGHT)


def rows(quick: bool) -> list[Row]:
    """Compare the speed, and the order of the shape's error in space and in time."""
    found = [speed_row(100, 400 if quick else 1600)]
    sizes = (150, 300, 600) if quick else (150, 300, 600, 1200)
    steps = 2000 if quick else 6000
    errors = [shape_error(n, steps) for n in sizes]
    found.append(order_row(f"shape of a bell, {steps} steps", [1.0 / n for n in sizes], errors, "Δs", SOURCE))
    segments, counts = (800, (125, 250, 500)) if quick else (1200, (100, 200, 400, 800))
    errors = [shape_error(segments, n) for n in counts]
    found.append(
        order_row(f"shape of a bell, {segments} segments", [1.0 / n for n in counts], errors, "Δt", SOURCE)
    )
    return found


def draw(figure: Figure) -> None:
    """Draw the bell after 0.8 crossings, exact and with too few, few, and 400 segments."""
    axes = figure.subplots()
    exact = np.linspace(0.0, SPAN, 800)
    axes.plot(exact, 1e3 * bell(0.8 * CROSSING - exact / SPEED), color="0.6", linewidth=3, label="exact")
    for segments in (50, 100, 400):
        place, east = shaken(bell, segments, 4000, 0.8)
        axes.plot(place, 1e3 * east, linewidth=1, label=f"{segments} segments")
    axes.set(xlabel="distance from the tow point [m]", ylabel="deflection [mm]")
    axes.legend(frameon=False)
