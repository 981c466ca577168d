"""A taut cable between two held points: waves travel at √(T/m1), and it sounds at f_n = n/(2L) √(T/m1).

m1 = m + ρA: across itself the cable moves water too. It is neutral, without drag, and elastic: a strain of 0.1 holds
the tension. Deflections are 1e-4 of the length, so that the tension changes by less than 1e-6. Both T and m1 are per
unstretched metre; in stretched metres c = √(T (1 + eT)/m1). N segments give f_n too high by (nπ/2N)²/3, 8.2e-5 n² for a
hundred: waves of finite length on a finite number of segments, so only f1 can be within 1e-4 there.
"""

from __future__ import annotations

import numpy as np

from cable import CableProperties

from .row import Row, Setting, order_row
from .spectra import frequencies
from .stepped import Stepped

SPAN = 20.0
"""Distance of the two ends. [m]"""
TENSION = 2.0
"""[N]"""
STRAIN = 0.1
DEFLECTION = 1e-4
"""Share of the span."""
STRING = CableProperties(
    tangential_drag_coefficient=0.0, normal_drag_coefficient=0.0, compliance=STRAIN / TENSION
)
SPEED = float(np.sqrt(TENSION * (1.0 + STRAIN) / STRING.virtual_mass_per_length))
"""Of waves. [m/s]"""
SOURCE = "n/(2L) √(T/m1)"


def taut(segments: int, cable: CableProperties = STRING) -> Stepped:
    """Return the straight cable, from the tow point in the north to the drum."""
    north = np.linspace(SPAN, 0.0, segments + 1)
    position = np.column_stack([north, 0.0 * north, 0.0 * north])
    length = np.full(segments, SPAN / (1.0 + STRAIN) / segments)
    return Stepped.at_rest(position, length, np.full(segments, TENSION), cable)


def natural_frequencies(
    segments: int, steps: int, modes: int = 3, cable: CableProperties = STRING
) -> np.ndarray:
    """Return the first frequencies (modes,) of a cable that is let go deflected, `steps` in the first period. [Hz].

    The amplitude of a mode is the projection on its sine, which those of other modes do not enter, on these nodes just
    as on the line.
    """
    string, period = taut(segments, cable), 2.0 * SPAN / SPEED
    sines = np.sin(np.pi * np.outer(np.arange(1, modes + 1), np.linspace(0.0, 1.0, segments + 1)))
    sines[:, [0, -1]] = 0.0
    shape = (sines / np.arange(1, modes + 1)[:, None]).sum(axis=0)
    string.line.position[:, :, 1] += DEFLECTION * SPAN * shape
    string.line.position[:, :, 2] -= 0.5 * DEFLECTION * SPAN * shape
    tow, amplitudes = string.positions[0], []
    for _ in range(2 * steps):
        string.step(period / steps, tow)
        amplitudes.append(sines @ string.positions[:, 1])
    apart = max(1, steps // (12 * modes))
    samples = np.array(amplitudes)[::apart]
    found = [frequencies(samples[:, n], apart * period / steps)[0] for n in range(modes)]
    return np.array(found) / (2.0 * np.pi)


def exact_frequencies(modes: int = 3) -> np.ndarray:
    """Return n/(2L) √(T/m1) (modes,). [Hz]."""
    return np.arange(1, modes + 1) * SPEED / (2.0 * SPAN)


def rows(quick: bool) -> list[Row]:
    """Compare the frequencies of 100 segments, and their orders in space and in time."""
    modes, exact = (1, 2, 3), exact_frequencies()
    steps = 800 if quick else 3200
    counts = (25, 50, 100) if quick else (25, 50, 100, 200)
    measured = {n: natural_frequencies(n, steps) for n in counts}
    found = [
        Setting(f"100 segments, {steps} steps a period: f{n}", SOURCE, 1e-4 if n == 1 else np.inf, "Hz").row(
            float(measured[100][n - 1]), float(exact[n - 1])
        )
        for n in modes
    ]
    if not quick:
        limit = (4.0 * measured[100][2] - measured[50][2]) / 3.0
        setting = Setting("f3, from 50 and 100 segments to Δs = 0", SOURCE, 1e-4, "Hz")
        found.append(setting.row(float(limit), float(exact[2])))
    errors = [abs(float(measured[n][2] / exact[2]) - 1.0) for n in counts]
    found.append(order_row("f3", [1.0 / n for n in counts], errors, "Δs", SOURCE))
    sizes = (40, 80, 160) if quick else (40, 80, 160, 320)
    errors = [abs(float(natural_frequencies(400, n)[1] / exact[1]) - 1.0) for n in sizes]
    found.append(order_row("f2, 400 segments", [1.0 / n for n in sizes], errors, "Δt", SOURCE))
    return found
