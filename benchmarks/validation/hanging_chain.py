"""A heavy cable hangs in still water from a point and swings: ω_n = (j_0n/2) √(w_c/(m1 L)), j_0n the zeros of J_0.

Its tension is the weight in water of what hangs below, w_c (L − s), and what swings is m1 = m + ρA:
m1 ÿ = (w_c (L − s) y′)′, y ∝ J_0(j_0n √(1 − s/L)). It is let go at rest, deflected by 1e-4 L in three modes at once;
drag is off. Towards the tail waves get shorter and segments do not: as on the taut string, a wave of finite length
on N segments sounds too high by 1/N², and of 100 segments only ω_1 is within 1e-4.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from matplotlib.figure import Figure
from scipy.special import j0, jn_zeros

from cable import CableProperties

from .row import Row, Setting, order_row
from .spectra import frequencies, nearest
from .stepped import Stepped

LENGTH = 10.0
"""[m]"""
CHAIN = CableProperties(mass_per_length=0.02, tangential_drag_coefficient=0.0, normal_drag_coefficient=0.0)
ZEROS = jn_zeros(0, 3)
EXACT = 0.5 * ZEROS * np.sqrt(CHAIN.weight_in_water / (CHAIN.virtual_mass_per_length * LENGTH))
"""ω_1, ω_2, ω_3. [rad/s]"""
DEFLECTION = 1e-4 * LENGTH
SOURCE = "(j_0n/2) √(w_c/(m1 L))"


def modes(place: np.ndarray) -> np.ndarray:
    """Return the three shapes at distances from the tow point (3, n); 1 at the tail."""
    return np.array([j0(zero * np.sqrt(1.0 - place / LENGTH)) for zero in ZEROS])


def hanging(segments: int) -> Stepped:
    """Return the chain at rest, deflected east; its segments keep their lengths."""
    place = np.linspace(0.0, LENGTH, segments + 1)
    length = np.full(segments, LENGTH / segments)
    east = DEFLECTION * (modes(place) / np.arange(1, 4)[:, None]).sum(axis=0)
    down = np.concatenate([[0.0], np.cumsum(np.sqrt(length**2 - np.diff(east) ** 2))])
    position = np.column_stack([0.0 * east, east, down])
    tension = CHAIN.weight_in_water * (LENGTH - 0.5 * (place[1:] + place[:-1]))
    return Stepped.at_rest(position, length, tension, CHAIN, free_end=True)


@cache
def swing(segments: int, steps: int, periods: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """Return times (n,) [s] and eastward positions of the nodes (n, nodes) [m], with so many steps a first period."""
    chain, step = hanging(segments), 2.0 * np.pi / EXACT[0] / steps
    tow, east = chain.positions[0], []
    for _ in range(round(periods * steps)):
        chain.step(step, tow)
        east.append(chain.positions[:, 1])
    return step * np.arange(1, len(east) + 1), np.array(east)


def natural_frequencies(segments: int, steps: int) -> np.ndarray:
    """Return ω_1, ω_2, ω_3 (3,) of the swinging chain, from projections on the three shapes. [rad/s]."""
    times, east = swing(segments, steps)
    apart = max(1, steps // 40)
    samples = east[::apart] @ modes(np.linspace(0.0, LENGTH, segments + 1)).T
    return nearest(frequencies(samples, apart * (times[1] - times[0])), EXACT)


def without_steps(segments: int, steps: int) -> np.ndarray:
    """Return the frequencies (3,) with the error of the time step taken out, from `steps` and half as many. [rad/s]."""
    return (4.0 * natural_frequencies(segments, steps) - natural_frequencies(segments, steps // 2)) / 3.0


def rows(quick: bool) -> list[Row]:
    """Compare the frequencies of 100 segments, and their orders in space and in time."""
    steps, counts = (400, (50, 100, 200)) if quick else (1600, (50, 100, 200, 400))
    measured = {n: natural_frequencies(n, steps) for n in counts}
    found = []
    for n in (1, 2, 3):
        name, gate = f"100 segments, {steps} steps a period: ω{n}", 1e-4 if n == 1 else np.inf
        found.append(
            Setting(name, SOURCE, gate, "rad/s").row(float(measured[100][n - 1]), float(EXACT[n - 1]))
        )
    if not quick:
        limit = (4.0 * measured[200][1] - measured[100][1]) / 3.0
        setting = Setting("ω2, from 100 and 200 segments to Δs = 0", SOURCE, 1e-4, "rad/s")
        found.append(setting.row(float(limit), float(EXACT[1])))
    errors = [float(abs(without_steps(n, steps)[2] / EXACT[2] - 1.0)) for n in counts]
    found.append(order_row("ω3, Δt → 0", [1.0 / n for n in counts], errors, "Δs", SOURCE))
    sizes = (50, 100, 200) if quick else (40, 80, 160, 320)
    errors = [float(abs(natural_frequencies(400, n)[1] / EXACT[1] - 1.0)) for n in sizes]
    found.append(order_row("ω2, 400 segments", [1.0 / n for n in sizes], errors, "Δt", SOURCE))
    return found


def draw(figure: Figure) -> None:
    """Draw the spectrum of the tail's motion with the exact frequencies, and the chain at some instants."""
    spectrum, shapes = figure.subplots(1, 2, width_ratios=(2.0, 1.0))
    times, east = swing(100, 400, 8.0)
    power = np.abs(np.fft.rfft(east[:, -1] * np.hanning(times.size)))
    omega = 2.0 * np.pi * np.fft.rfftfreq(times.size, times[1] - times[0])
    spectrum.semilogy(omega, power / power.max(), linewidth=1)
    for n, exact in enumerate(EXACT, 1):
        spectrum.axvline(exact, color="0.7", zorder=0)
        spectrum.text(exact, 1.6, f"$\\omega_{n}$", ha="center")
    spectrum.set(
        xlim=(0.0, 6.0), ylim=(1e-5, 1.4), xlabel="frequency [rad/s]", ylabel="tail's motion, relative"
    )
    for east_now in east[:200:25]:
        shapes.plot(1e3 * east_now, -np.linspace(0.0, LENGTH, 101), linewidth=1)
    shapes.set(xlabel="deflection [mm]", ylabel="below the tow point [m]")
