"""A heavy cable hangs at rest between the drum and a vehicle that waits 9 m away, level with it or deeper. A winch
has paid out 10 m. Reference: the elastic catenary. With the pull H across, and the part V of the weight that hangs on
the vehicle, at the unstretched distance s from it

    x(s) = H e s + (H/w_c) (asinh(V/H) − asinh((V − w_c s)/H))
    z(s) = e (V s − ½w_c s²) + (√(H² + V²) − √(H² + (V − w_c s)²))/w_c                    e = 1/(EA)

which for e = 0 is the catenary; weight is per unstretched metre. What is left is the error of straight segments.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import brentq, root

import cable
from subzero.figures.style import CYCLE, INK, NORMAL, SMALL, TINY

from .held_cable import held
from .row import Row, Setting, order_row

LENGTH, SPAN = 10.0, 9.0
SOURCE = "elastic catenary"
SIZES = (25, 50, 100, 200)
STRETCH = {
    0.0: "inextensible",
    0.02: "e = 0.02/N, stretched by 2 %",
    0.2: "e = 0.2/N, stretched by up to 18 %",
}


def heavy(compliance: float) -> cable.CableProperties:
    """Return a cable that weighs 0.15 N per metre in water."""
    return cable.CableProperties(mass_per_length=0.02, compliance=compliance)


def places(H: float, V: float, s: np.ndarray, c: cable.CableProperties) -> tuple[np.ndarray, np.ndarray]:
    """Return how far north of s the vehicle is, and how far below it s is. [m]."""
    w, e = c.weight_in_water, c.compliance
    x = H * (e * s + (np.arcsinh(V / H) - np.arcsinh((V - w * s) / H)) / w)
    return x, e * (V * s - 0.5 * w * s * s) + (np.hypot(H, V) - np.hypot(H, V - w * s)) / w


def ends(length: float, depth: float, c: cable.CableProperties) -> tuple[float, float]:
    """Return H and V of a cable between the drum and a vehicle SPAN away and `depth` below it. [N]."""

    def miss(HV: np.ndarray) -> list[float]:
        x, z = places(HV[0], HV[1], np.array(length), c)
        return [float(x) - SPAN, float(z) + depth]

    chord, w = float(np.hypot(SPAN, depth)), c.weight_in_water
    a = brentq(lambda a: 2.0 * a * np.sinh(0.5 * chord / a) - length, 0.1 * chord, 30.0 * chord)
    found = root(miss, [w * a, 0.5 * w * length], tol=1e-13)
    if np.abs(found.fun).max() > 1e-10:
        raise RuntimeError(found.message)
    return float(found.x[0]), float(found.x[1])


def compare(segments: int, compliance: float, depth: float) -> list[Row]:
    """Compare the force on the vehicle, the tension at the drum and the shape."""
    c = heavy(compliance)
    run = held(c, (SPAN, 0.0, depth), LENGTH, segments)
    S = float(run.length[-1])
    H, V = ends(S, depth, c)
    name = f"{STRETCH[compliance]}, {'level' if depth == 0.0 else f'{depth:g} m deeper'}"
    setting = Setting(name, SOURCE, 1e-4)
    s = np.append(np.arange(len(run.shapes[-1]) - 1) * LENGTH / segments, S)
    below = run.shapes[-1][:, 2] - depth
    return [
        setting.vector(run.tow_force[-1], [-H, 0.0, V], "tow force"),
        setting.row(run.drum_tension[-1], float(np.hypot(H, V - c.weight_in_water * S)), what="T(S)"),
        Setting(name, SOURCE, 1e-4, "m").worst(
            below, places(H, V, s, c)[1], S, "depth of a node below the vehicle"
        ),
    ]


def rows(quick: bool) -> list[Row]:
    """Compare inextensible and elastic catenaries at 100 segments, and their order."""
    found, sizes = [], SIZES[:3] if quick else SIZES
    for compliance, depth in ((0.0, 0.0), (0.02, 0.0), (0.02, 3.0), (0.2, 0.0)):
        refined = [compare(segments, compliance, depth) for segments in sizes]
        found += refined[sizes.index(100)]
        errors = [rows[0].error for rows in refined]
        found.append(order_row(refined[0][0].name, [LENGTH / n for n in sizes], errors, "Δs", SOURCE))
    return found


def draw(figure: Any) -> None:
    """Draw shapes, and how the errors of the tow force fall."""
    shapes, slopes = figure.subplots(1, 2)
    for (compliance, name), colour in zip(STRETCH.items(), CYCLE, strict=False):
        c = heavy(compliance)
        nodes = held(c, (SPAN, 0.0, 0.0), LENGTH, 25).shapes[-1]
        x, z = places(*ends(LENGTH, 0.0, c), np.linspace(0.0, LENGTH, 200), c)
        shapes.plot(SPAN - x, z, color=colour, linewidth=1.0, label=name)
        shapes.plot(nodes[:, 0], nodes[:, 2], "o", color=colour, markersize=2.5)
        errors = [compare(n, compliance, 0.0)[0].error for n in SIZES]
        slopes.loglog([LENGTH / n for n in SIZES], errors, "o-", color=colour, markersize=3, linewidth=1.0)
    guide = np.array([LENGTH / SIZES[-1], LENGTH / SIZES[0]])
    slopes.loglog(guide, 1e-3 * guide**2, ":", color=INK, linewidth=1.0, label="order 2")
    slopes.xaxis.set_minor_formatter("")
    shapes.invert_yaxis()
    shapes.set_title("catenary (lines), 25 segments (dots)", fontsize=NORMAL)
    slopes.set_title("error of the tow force", fontsize=NORMAL)
    for axes, across, up in ((shapes, "north [m]", "down [m]"), (slopes, "Δs [m]", "relative error")):
        axes.set_xlabel(across, fontsize=SMALL)
        axes.set_ylabel(up, fontsize=SMALL)
        axes.tick_params(labelsize=TINY)
        axes.legend(fontsize=TINY, frameon=False)
