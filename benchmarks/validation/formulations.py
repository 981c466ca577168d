"""The same manoeuvres with three formulations that share no line of physics.

    moving_end   the default: Cartesian, tension in segments, backward differences
    equation7    the paper's six unknowns with two angles, box rule, SDIRK2; uniform water, free drums
    lumped       masses and springs (1e-6 per newton), velocities as unknowns, TR-BDF2

A vehicle at 1 m/s pulls cable of Table 1 off a drum that rubs with 0.05 N, with soft ends to each manoeuvre: a 60° dive
and a 180° turn at 6°/s, a helix of 5 m radius. A heavy umbilical is paid out by a winch at 60 N while its vehicle goes
down and turns back through 180° in a sheared current. Converged means extrapolated from 12.5 and 6.25 cm. Errors are
those of the force on the vehicle as a vector, the worst of all times, over its largest size.

A drum without any friction has no converged answer to a helix that begins at once: where T → 0 the cable may fold as
finely as segments allow. From 50 to 6 cm all three agree within 1e-3; at 3 cm a kink grows at the drum.
A bending stiffness of 1e-5 N m² takes it away.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import cable
from cable.lumped_history import pull_out_lumped

from .row import Row, order_row
from .stepped import STILL

SOURCE = "each other"


def ramp(x: float) -> float:
    """Return a ramp from 0 to 1 over 0 ≤ x ≤ 1 with three continuous derivatives."""
    y = float(np.clip(x, 0.0, 1.0))
    return y**4 * (35.0 - 84.0 * y + 70.0 * y**2 - 20.0 * y**3)


def ramp_integral(x: float) -> float:
    """Return the integral of `ramp`, a straight line beyond 1."""
    y = float(np.clip(x, 0.0, 1.0))
    return 7.0 * y**5 - 14.0 * y**6 + 10.0 * y**7 - 2.5 * y**8 + max(x - 1.0, 0.0)


def turned(t: float, total: float, start: float = 4.0, soft: float = 2.0) -> float:
    """Return an angle [rad] that turns by `total` [rad] at 6°/s from `start` on, with ends of `soft`. [s]."""
    rate = np.radians(6.0)
    begun, ended = (t - start) / soft, (t - start - total / rate) / soft
    return float(rate * soft * (ramp_integral(begun) - ramp_integral(ended)))


def heading_for(pitch: float, heading: float) -> tuple[float, float, float]:
    """Return the velocity of 1 m/s with this pitch and heading [rad]. [m/s]."""
    return (
        float(np.cos(pitch) * np.cos(heading)),
        float(np.cos(pitch) * np.sin(heading)),
        float(-np.sin(pitch)),
    )


UMBILICAL = cable.CableProperties(
    mass_per_length=0.2,
    cross_section_area=1.13e-4,
    diameter=0.012,
    tangential_drag_coefficient=0.02,
    normal_drag_coefficient=1.2,
    compliance=2e-6,
)
"""12 mm thick; weighs 0.85 N/m in water; EA = 5e5 N."""
SHEARED = cable.Current.sampled(
    lambda _n, _e, down, t: (0.0, 0.02 * t * (1.0 - 0.02 * down), -0.01 * t * (1.0 - 0.02 * down)),
    down=(-10.0, 50.0),
    time=(0.0, 60.0),
)
"""Grows to 0.5 m/s at the surface in the course of the dive, and is gone at 50 m of depth."""


def dive_and_return(t: float) -> tuple[float, float, float]:
    """Return the velocity of an ROV that goes down, then ahead, and turns back through 180°. [m/s]."""
    down = 0.8 * (1.0 - ramp((t - 8.0) / 6.0))
    ahead, heading = 0.6 * ramp((t - 6.0) / 6.0), np.pi * ramp((t - 14.0) / 8.0)
    return float(ahead * np.cos(heading)), float(ahead * np.sin(heading)), down


@dataclass(frozen=True)
class Manoeuvre:
    """A prescribed motion of the vehicle: velocity by time [m/s], how long [s], and settings of `cable.pull_out`."""

    velocity: Callable[[float], tuple[float, float, float]]
    duration: float
    settings: dict[str, Any]


ON_SHORE = {"drum": cable.DrumProperties(friction_torque=0.005)}
MANOEUVRES = {
    "dive": Manoeuvre(lambda t: heading_for(-turned(t, np.pi / 3.0), 0.0), 24.0, ON_SHORE),
    "helix": Manoeuvre(
        lambda t: heading_for(-0.2 * ramp((t - 1.0) / 4.0), 0.8 * ramp_integral((t - 1.0) / 4.0)),
        24.0,
        ON_SHORE,
    ),
    "U-turn": Manoeuvre(lambda t: heading_for(0.0, turned(t, np.pi)), 40.0, ON_SHORE),
    "umbilical": Manoeuvre(
        dive_and_return,
        28.0,
        {
            "cable": UMBILICAL,
            "current": SHEARED,
            "drum": cable.ConstantTension(tension=60.0),
            "wet_length": 4.0,
        },
    ),
}


def history(way: Manoeuvre, scheme: str, segment_length: float, step: float) -> cable.History:
    """Return the run of a manoeuvre with a formulation."""
    if scheme == "lumped":
        missing = {"cable": cable.CableProperties(), "current": STILL, "wet_length": 0.0}
        return pull_out_lumped(
            way.velocity, way.duration, step, segment_length=segment_length, **missing | way.settings
        )
    settings = {"segment_length": segment_length, "scheme": scheme, **way.settings}
    return cable.pull_out(way.velocity, way.duration, step, **settings)


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
        sizes = [1.0 / n for n in (2, 4, 8)]
        errors = [distance(force(name, "moving_end", 0.5 * q, 0.1 * q), reference) for q in sizes]
        found.append(order_row(f"{name}, from 0.25 m on", sizes, errors, "both", others(name)[-1]))
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
