"""The same manoeuvres with three formulations that share no line of physics.

    moving_end   the default: Cartesian, tension in segments, backward differences
    equation7    the paper's six unknowns with two angles, box rule, SDIRK2; uniform water, free drums
    lumped       masses and springs (1e-6 per newton), velocities as unknowns, TR-BDF2

A vehicle at 1 m/s pulls cable of Table 1 off a drum that rubs with 0.05 N, with soft ends to each manoeuvre: a 60° dive
and a 180° turn at 6°/s, a helix of 5 m radius. A heavy umbilical is paid out by a winch at 60 N while its vehicle goes
down and turns back through 180° in a sheared current. Converged means extrapolated from 12.5 and 6.25 cm (6.25 and
3.125 cm for orders). Errors are those of the force on the vehicle as a vector, the worst of all times, over its largest
size. Orders are those from 25 cm on: the helix comes to its own late, with 1.8 from 50 to 25 cm.

A drum without any friction has no converged answer to a helix that begins at once: where T → 0 the cable may fold as
finely as segments allow. Halved from 25 to 6 cm, they change the force by 2e-3; at 3 cm a kink grows at the drum, and
it changes by a tenth. "equation7" stops there. A bending stiffness of 1e-5 N m² takes the kink away (5e-4).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from matplotlib.figure import Figure

import cable

from .manoeuvres import MANOEUVRES, Manoeuvre
from .row import Row, order_row


def history(way: Manoeuvre, scheme: str, segment_length: float, step: float) -> cable.History:
    """Return the run of a manoeuvre with a formulation."""
    kind = type(cable.SCHEMES[scheme].options)
    options = kind(time_step=step, segment_length=segment_length)
    return cable.pull_out(way.velocity, way.duration, scheme=options, **way.settings)


@cache
def force(name: str, scheme: str, segment_length: float, step: float) -> np.ndarray:
    """Return the force on the vehicle every 0.8 s but at the start (n, 3). [N]."""
    run = history(MANOEUVRES[name], scheme, segment_length, step)
    if not run.outcome.completed:
        raise RuntimeError(run.outcome.message)
    return run.tow_force[:: round(0.8 / step)][1:]


@cache
def converged(name: str, scheme: str, finest: int = 8) -> np.ndarray:
    """Return the force extrapolated from the finest and half as fine a resolution (n, 3). [N]."""
    coarse, fine = (force(name, scheme, 0.5 / n, 0.1 / n) for n in (finest // 2, finest))
    return fine + (fine - coarse) / 3.0


def distance(ours: np.ndarray, reference: np.ndarray) -> float:
    """Return the worst distance of two force histories (n, 3), over the largest force. [-]."""
    return float(np.linalg.norm(ours - reference, axis=1).max() / np.linalg.norm(reference, axis=1).max())


def compare(what: str, ours: np.ndarray, reference: np.ndarray, source: str, gate: float) -> Row:
    """Return the row of two force histories (n, 3): sizes where they differ most, and how far apart the vectors are."""
    k = int(np.argmax(np.linalg.norm(ours - reference, axis=1)))
    a, b = (float(np.linalg.norm(pull[k])) for pull in (ours, reference))
    error = distance(ours, reference)
    return Row(name=what, ours=a, reference=b, error=error, gate=gate, source=source, unit="N")


def others(name: str) -> tuple[str, ...]:
    """Return the formulations that can do a manoeuvre, besides the default."""
    return ("lumped",) if name == "umbilical" else ("equation7", "lumped")


def rows(quick: bool) -> list[Row]:
    """Compare at 0.5 m and 0.1 s with what others converge to, the converged with each other, and the order."""
    found, finest = [], 4 if quick else 8
    for name in MANOEUVRES:
        for other in others(name)[-1:] if quick else others(name):
            reference = converged(name, other, finest)
            ours = force(name, "moving_end", 0.5, 0.1)
            found.append(compare(f"{name}, 0.5 m, 0.1 s", ours, reference, f"{other}, converged", 1e-3))
            limit = converged(name, "moving_end", finest)
            gate = 5e-5 if quick else 1e-5
            found.append(compare(f"{name}, converged", limit, reference, f"{other}, converged", gate))
        if quick:
            continue
        reference = converged(name, "lumped", 16)
        sizes = [1.0 / n for n in (2, 4, 8)]
        errors = [distance(force(name, "moving_end", 0.5 * q, 0.1 * q), reference) for q in sizes]
        found.append(order_row(f"{name}, from 0.25 m on", sizes, errors, "both", "lumped"))
    return found


def draw(figure: Figure) -> None:
    """Draw the umbilical at some times, with two formulations, and the errors of all over the segments' length."""
    side, errors = figure.subplots(1, 2)
    ours, lumped = (history(MANOEUVRES["umbilical"], scheme, 0.5, 0.1) for scheme in ("moving_end", "lumped"))
    for t in (5.0, 10.0, 15.0, 20.0, 28.0):
        x, y = ours.shape(t), lumped.shape(t)
        side.plot(x[:, 1], -x[:, 2], "C0", linewidth=1)
        side.plot(y[::3, 1], -y[::3, 2], "C1.", markersize=3)
        side.plot(x[0, 1], -x[0, 2], "ks", markersize=3)
    side.set(xlabel="east [m]", ylabel="up [m]", title="umbilical at 5, 10, 15, 20, 28 s; dots: lumped")
    side.title.set_fontsize(8)
    sizes = 0.5 / np.array([1, 2, 4, 8])
    for k, name in enumerate(MANOEUVRES):
        for scheme, mark in (("moving_end", ".-"), ("lumped", ".:")):
            reference = converged(name, others(name)[0])
            error = [distance(force(name, scheme, ds, 0.2 * ds), reference) for ds in sizes]
            label = name if scheme == "moving_end" else None
            errors.loglog(sizes, error, f"C{k}{mark}", linewidth=1, label=label)
    errors.loglog(sizes, 1e-3 * (sizes / 0.5) ** 2, color="0.7", zorder=0)
    errors.set(
        xlabel="Δs [m], Δt = 0.2 s/m Δs",
        ylabel="error of the tow force",
        title="dotted: lumped; grey: order 2",
    )
    errors.set_xticks(sizes, [f"{size:g}" for size in sizes])
    errors.minorticks_off()
    errors.title.set_fontsize(8)
    errors.legend(frameon=False, fontsize=7)
