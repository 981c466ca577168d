"""A cable with a bending stiffness EI and hinged ends, under a tension T: the tensioned beam.

At rest under its weight w_c, sagging by a thousandth of its length; the winch holds T(S), and with H the pull along it

    y = w_c/H [x (L − x)/2 − l² (1 − cosh((x − L/2)/l)/cosh(L/2l))],          l = √(EI/H)

which is a parabola for l → 0 and the curve of a beam for l → ∞. Vibrating, without drag, let go with a deflection of
1e-4 of its length in three modes, with k = nπ/L per stretched metre and the strain ε = eT = 0.1:

    f_n = n/(2L) √(T (1 + ε)/m1) √(1 + EI (1 + ε) k²/T)

In the first mode bending gives half as much stiffness as tension, in the third 4.5 times as much. Modes above the first
are not within 1e-4 with 100 segments: a wave of finite length on a finite number of segments.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

import cable

from .row import Row, Setting, order_row
from .taut_string import SPAN, STRAIN, STRING, TENSION, exact_frequencies, natural_frequencies

LENGTH, HELD = 10.0, 500.0
"""[m], T(S) [N]"""
STIFFNESSES = {"l = L/10": 500.0, "l = L/3": 5000.0}
"""EI. [N m²]"""
STIFF_STRING = replace(STRING, bending_stiffness=0.5 * TENSION * (SPAN / np.pi) ** 2 / (1.0 + STRAIN))
AT_REST, VIBRATING = "tensioned beam", "tensioned beam, m1"


def beam(stiffness: float) -> cable.CableProperties:
    """Return a cable that weighs 0.15 N per metre in water."""
    return cable.CableProperties(mass_per_length=0.02, bending_stiffness=stiffness)


def exact(x: np.ndarray, c: cable.CableProperties) -> np.ndarray:
    """Return the deflection at x (n,). [m]."""
    w = c.weight_in_water
    H = float(np.sqrt(HELD**2 - (0.5 * w * LENGTH) ** 2))
    l2 = max(c.bending_stiffness / H, 1e-6)
    from_middle, half = np.abs(x - 0.5 * LENGTH) / np.sqrt(l2), 0.5 * LENGTH / np.sqrt(l2)
    # cosh a/cosh b, written so that neither overflows
    share = np.exp(from_middle - half) * (1.0 + np.exp(-2.0 * from_middle)) / (1.0 + np.exp(-2.0 * half))
    return w / H * (0.5 * x * (LENGTH - x) - l2 * (1.0 - share))


def at_rest(stiffness: float, segments: int) -> cable.History:
    """Return a run that ends at rest, after steps so long that they damp what swings."""
    run = cable.pull_out(
        lambda _t: (0.0, 0.0, 0.0),
        100.0,
        cable=beam(stiffness),
        start=LENGTH,
        drum=cable.ConstantTension(tension=HELD),
        scheme=cable.MovingEnd(time_step=0.5, segment_length=LENGTH / segments),
    )
    if not run.outcome.completed:
        raise RuntimeError(run.outcome.message)
    return run


def deflection(name: str, segments: int) -> Row:
    """Compare the deflection of the node that is worst, relative to the largest."""
    nodes = at_rest(STIFFNESSES[name], segments).shapes[-1]
    wanted = exact(nodes[:, 0], beam(STIFFNESSES[name]))
    setting = Setting(f"{name}, {segments} segments", AT_REST, 1e-4, "m")
    return setting.worst(nodes[:, 2], wanted, float(wanted.max()), "deflection, worst node, of the largest")


def frequency_errors(segments: int, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the frequencies of the vibrating beam (3,) [Hz], and the closed form."""
    k = np.arange(1, 4) * np.pi / SPAN
    bent = np.sqrt(1.0 + STIFF_STRING.bending_stiffness * (1.0 + STRAIN) * k**2 / TENSION)
    return natural_frequencies(segments, steps, cable=STIFF_STRING), exact_frequencies() * bent


def rows(quick: bool) -> list[Row]:
    """Compare beams at rest and vibrating, and their order in space."""
    found, sizes = [], (25, 50, 100) if quick else (25, 50, 100, 200)
    for name in STIFFNESSES:
        refined = [deflection(name, segments) for segments in sizes]
        found.append(refined[2])
        errors = [row.error for row in refined]
        found.append(order_row(f"{name}, deflection", [LENGTH / n for n in sizes], errors, "Δs", AT_REST))
    steps = 1600 if quick else 3200
    measured = {n: frequency_errors(n, steps) for n in (25, 50, 100)}
    for n, gate in enumerate((1e-4, np.inf, np.inf)):
        setting = Setting(f"100 segments, {steps} steps a period: f{n + 1}", VIBRATING, gate, "Hz")
        found.append(setting.row(float(measured[100][0][n]), float(measured[100][1][n])))
    errors = [abs(float(f[0] / wanted[0]) - 1.0) for f, wanted in measured.values()]
    found.append(order_row("vibrating, f1", [1.0 / n for n in measured], errors, "Δs", VIBRATING))
    return found


def draw(figure: Figure) -> None:
    """Draw the beams at rest, exact and with 25 segments, next to a cable that does not resist bending."""
    axes, x = figure.subplots(), np.linspace(0.0, LENGTH, 200)
    for k, (name, stiffness) in enumerate({"EI = 0": 0.0, **STIFFNESSES}.items()):
        axes.plot(x, 1e3 * exact(x, beam(stiffness)), f"C{k}", linewidth=1, label=name)
        nodes = at_rest(stiffness, 25).shapes[-1]
        axes.plot(nodes[:, 0], 1e3 * nodes[:, 2], f"C{k}o", markersize=3)
    axes.invert_yaxis()
    axes.set(xlabel="place [m]", ylabel="deflection [mm]", title="tensioned beam (lines), 25 segments (dots)")
    axes.title.set_fontsize(9)
    axes.legend(frameon=False)
