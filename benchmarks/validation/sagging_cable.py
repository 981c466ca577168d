"""A heavy elastic cable hangs between two points at one level, and vibrates as Irvine (1981) says.

With Ω = ωL √(m1/H), H the horizontal pull, its modes are those of a string, Ω = nπ, out of its plane and in it with one
node in the middle (2π); those symmetric in the plane stretch it, and obey

    tan(Ω/2) = Ω/2 − (4/λ²) (Ω/2)³,       λ² = (w_c L/H)² L/(e H L_e),   L_e ≈ L (1 + (w_c L/H)²/8)

which is a string for λ → 0 and crosses the one-node mode at λ = 2π. m1 = m + ρA moves across, and the inertia along the
cable must not matter: w_c L/H = 0.01 here, a sag of 1/800, where the theory's own error is some 1e-5. The cable lies at
rest on an elastic catenary, and is released 1e-7 L away from it: modes exchange energy already at 1e-6. Drag is off. As
for a string, N segments make Ω too high by (Ω/2N)²/3; that is taken out by extrapolation from 100 and 200 segments.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from matplotlib.figure import Figure
from scipy.optimize import brentq

from cable import CableProperties

from .row import Row, Setting, order_row
from .spectra import frequencies, nearest
from .stepped import Stepped

LENGTH = 10.0
"""Of the unstretched cable; the span L is shorter by some 1e-5. [m]"""
SAGGING = 0.01
"""w_c L/H"""
DEFLECTION = 1e-7 * LENGTH
SOURCE = "Irvine (1981)"


def made_of(irvine: float) -> CableProperties:
    """Return a cable with an Irvine parameter λ²."""
    plain = CableProperties(
        mass_per_length=0.02, tangential_drag_coefficient=0.0, normal_drag_coefficient=0.0
    )
    pull = plain.weight_in_water * LENGTH / SAGGING
    e = SAGGING**2 / (irvine * pull * (1.0 + SAGGING**2 / 8.0))
    return CableProperties(
        mass_per_length=0.02, tangential_drag_coefficient=0.0, normal_drag_coefficient=0.0, compliance=e
    )


def catenary(cable: CableProperties, segments: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (n+1, 3) [m] of an elastic catenary with ends at one level, and T of its segments (n,) [N]."""
    w, H = cable.weight_in_water, cable.weight_in_water * LENGTH / SAGGING
    s = np.linspace(-0.5 * LENGTH, 0.5 * LENGTH, segments + 1)
    V = w * s
    north = H * cable.compliance * s + H / w * np.arcsinh(V / H)
    down = -0.5 * cable.compliance * w * s**2 - H / w * np.sqrt(1.0 + (V / H) ** 2)
    middle = 0.5 * (V[1:] + V[:-1])
    return np.column_stack([-(north - north[-1]), 0.0 * s, down - down[-1]]), np.hypot(H, middle)


@cache
def vibrations(irvine: float, segments: int, steps: int) -> dict[str, float]:
    """Return Ω of the modes by name; `steps` in a period of the string, and two periods."""
    cable = made_of(irvine)
    position, tension = catenary(cable, segments)
    line = Stepped.at_rest(position, np.full(segments, LENGTH / segments), tension, cable)
    line.settle()
    rest, span = line.positions, position[0, 0]
    H = cable.weight_in_water * LENGTH / SAGGING
    unit = np.sqrt(H / cable.virtual_mass_per_length) / span
    sines = np.sin(np.pi * np.outer((1, 2, 3), np.linspace(0.0, 1.0, segments + 1)))
    sines[:, [0, -1]] = 0.0
    line.line.position[:, : segments + 1, 1] += DEFLECTION * sines[0]
    line.line.position[:, : segments + 1, 2] += DEFLECTION * (sines[0] + 0.5 * sines[1])
    step, moved = 2.0 / unit / steps, []
    for _ in range(2 * steps):
        line.step(step, rest[0])
        moved.append(line.positions - rest)
    apart = max(1, steps // 60)
    samples = np.array(moved)[::apart]
    symmetric = np.column_stack([samples[:, :, 2] @ sine for sine in (sines[0], sines[2])])
    tones = {
        "out of plane": (samples[:, :, 1] @ sines[0], np.pi),
        "one node": (samples[:, :, 2] @ sines[1], 2.0 * np.pi),
        "symmetric": (symmetric, irvine_frequency(irvine)),
    }
    return {
        name: float(nearest(frequencies(values, apart * step) / unit, np.array([near]))[0])
        for name, (values, near) in tones.items()
    }


def irvine_frequency(irvine: float) -> float:
    """Return the lowest Ω of the symmetric modes in the plane, between π and 3π."""

    def misfit(half: float) -> float:
        return np.sin(half) - (half - 4.0 / irvine * half**3) * np.cos(half)

    return 2.0 * brentq(misfit, 0.5 * np.pi + 1e-9, 1.5 * np.pi - 1e-9)


def without_segments(irvine: float, steps: int, name: str) -> float:
    """Return Ω of a mode, from 100 and 200 segments to Δs = 0."""
    coarse, fine = (vibrations(irvine, n, steps)[name] for n in (100, 200))
    return (4.0 * fine - coarse) / 3.0


def without_steps(irvine: float, segments: int, steps: int, name: str) -> float:
    """Return Ω of a mode, from so many steps a period and half as many to Δt = 0."""
    coarse, fine = (vibrations(irvine, segments, n)[name] for n in (steps // 2, steps))
    return (4.0 * fine - coarse) / 3.0


def rows(quick: bool) -> list[Row]:
    """Compare the modes of slack and taut cables, and the order of the symmetric one."""
    steps, found = 1600, []
    for irvine in (20.0,) if quick else (5.0, 20.0, 200.0):
        exact = {"symmetric": irvine_frequency(irvine), "one node": 2.0 * np.pi}
        for name, reference in exact.items():
            setting = Setting(f"λ² = {irvine:g}, {name}, Δs → 0: Ω", SOURCE, 1e-4, "")
            found.append(setting.row(without_segments(irvine, steps, name), reference))
        setting = Setting(f"λ² = {irvine:g}, 100 segments: Ω of the first out-of-plane mode", "π", 1e-4, "")
        found.append(setting.row(vibrations(irvine, 100, steps)["out of plane"], np.pi))
    exact, counts = irvine_frequency(20.0), (25, 50, 100) if quick else (12, 25, 50, 100)
    errors = [abs(without_steps(20.0, n, steps, "symmetric") / exact - 1.0) for n in counts]
    found.append(order_row("λ² = 20, symmetric, Δt → 0", [1.0 / n for n in counts], errors, "Δs", SOURCE))
    sizes = (80, 160, 320) if quick else (80, 160, 320, 640)
    limit = without_steps(20.0, 200, 1600, "symmetric")
    errors = [abs(vibrations(20.0, 200, n)["symmetric"] / limit - 1.0) for n in sizes]
    found.append(order_row("λ² = 20, symmetric", [1.0 / n for n in sizes], errors, "Δt", SOURCE))
    return found


def draw(figure: Figure) -> None:
    """Draw Ω over λ²: Irvine's curves, and what the cable did."""
    axes = figure.subplots()
    line = np.geomspace(0.5, 2000.0, 200)
    axes.semilogx(line, [irvine_frequency(x) / np.pi for x in line], label="symmetric, in its plane")
    axes.axhline(2.0, color="C1", label="one node, in its plane")
    axes.axhline(1.0, color="C2", label="out of its plane")
    for irvine in (1.0, 3.0, 10.0, 30.0, 60.0, 150.0, 400.0, 1000.0):
        found = vibrations(irvine, 100, 800)
        for k, name in enumerate(("symmetric", "one node", "out of plane")):
            axes.plot(irvine, found[name] / np.pi, f"C{k}o", markersize=4)
    axes.set(xlabel="λ²", ylabel="ω L √(m1/H) / π", ylim=(0.0, 3.2))
    axes.legend(frameon=False, title="Irvine's theory; dots: 100 segments")
