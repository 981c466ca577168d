"""A motion is chosen, and the cable is pushed by the force per metre f(s, t) that it needs: then it has to follow.

All terms of (7) take part: inertia with m and ρA, drag along and across, weight in water, a sheared current that grows
in time, stretch (T = 2 … 6 N, strains of 0.1 to 0.3), in three dimensions; a winch pays out meanwhile, and new segments
are made. `invented_motion` has the formulas, with f written by SymPy, and `line.forcing` takes it, averaged
over each segment. Compared at the end of 3 s: places of all nodes (relative to the cable's length), tensions at
all nodes, the force on the vehicle and the tension at the winch (relative to the largest tension).
"""

from __future__ import annotations

from functools import cache

import numpy as np
from matplotlib.figure import Figure

from cable import Current

from .invented_motion import CABLE, SHEAR, START, motion
from .row import Row, order, order_row
from .stepped import Stepped

DURATION = 3.0
GAUSS = ((-np.sqrt(0.15), 5.0 / 18.0), (0.0, 8.0 / 18.0), (np.sqrt(0.15), 5.0 / 18.0))
WHAT = ("place", "tension", "tow force", "winch tension")
SOURCE = "(7)"


def exact(name: str, sigma: np.ndarray | float, time: float) -> np.ndarray:
    """Return what `invented_motion` says, one row a place σ: (n, 3) or (n,)."""
    values = motion()[name](np.atleast_1d(sigma), time)
    if isinstance(values, list):
        return np.column_stack([np.broadcast_to(v, np.shape(np.atleast_1d(sigma))) for v in values])
    return np.broadcast_to(values, np.shape(np.atleast_1d(sigma)))


def current() -> Current:
    """Return the sheared, growing current; bilinear in depth and time, so the grid's four corners hold it exactly."""
    drum, depth, growth = (np.array(row) for row in SHEAR)

    def water(_north: float, _east: float, down: float, time: float) -> np.ndarray:
        return drum + depth * down + growth * time + 0.1 * depth * down * time

    return Current.sampled(water, down=(-50.0, 50.0), time=(0.0, 2.0 * DURATION))


def start(segment_length: float) -> Stepped:
    """Return the cable at t = 0, moving as it should."""
    count = round(START / segment_length)
    sigma = START - segment_length * np.arange(count + 1)
    sigma[-1] = 0.0
    cable = Stepped.at_rest(
        exact("place", sigma, 0.0),
        -np.diff(sigma),
        exact("tension", 0.5 * (sigma[1:] + sigma[:-1]), 0.0),
        CABLE,
        room=round(4.0 * DURATION / segment_length),
        current=current(),
    )
    cable.line.velocity[:, : count + 1] = exact("velocity", sigma, 0.0)
    cable.line.ends.payout[:] = float(motion()["payout"](0.0, 0.0))
    cable.begin()
    return cable


def middles(cable: Stepped, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Return σ of the segments' middles (n,) and the segments' lengths (n,), when the cable has a length. [m]."""
    ends = cable.nodes(length)
    return 0.5 * (ends[1:] + ends[:-1]), -np.diff(ends)


def push(cable: Stepped, time: float) -> None:
    """Set the force per length on all segments at a time, averaged over each by three-point quadrature."""
    sigma, size = middles(cable, float(motion()["length"](0.0, time)))
    n = sigma.size
    cable.line.forcing[1 : n + 1] = sum(w * exact("forcing", sigma + a * size, time) for a, w in GAUSS)


@cache
def errors(segment_length: float, step: float) -> tuple[float, ...]:
    """Return the largest errors (4,) at the end: places, tensions, tow force, tension at the winch. [-]."""
    cable, steps = start(segment_length), round(DURATION / step)
    for k in range(1, steps + 1):
        time = DURATION * k / steps
        length = float(motion()["length"](0.0, time))
        push(cable, time)
        cable.drum.setpoint = length
        cable.step(DURATION / steps, exact("place", length, time)[0])
    sigma = cable.nodes(length)
    tensions = exact("tension", sigma, DURATION)
    scale = tensions.max()
    pull = exact("pull", np.array([length, 0.0]), DURATION)
    return (
        float(np.abs(cable.positions - exact("place", sigma, DURATION)).max() / length),
        float(np.abs(cable.tensions - tensions).max() / scale),
        float(np.abs(cable.line.ends.tow.force - pull[0]).max() / scale),
        float(abs(cable.line.ends.drum_pull - np.linalg.norm(pull[1])) / scale),
    )


def refinements(quick: bool) -> dict[str, list[tuple[float, float, float]]]:
    """Return, by what is refined, lists of size, Δs [m] and Δt [s]."""
    n = 3 if quick else 5
    together = [(1.0 / 2**k, 0.4 / 2**k, 0.1 / 2**k) for k in range(n)]
    in_space = [(0.8 / 2**k, 0.8 / 2**k, 0.01 if quick else 0.0025) for k in range(n)]
    in_time = [(0.1 / 2**k, 0.05 if quick else 0.0125, 0.1 / 2**k) for k in range(n)]
    return {"Δs": in_space, "Δt": in_time, "both": together}


def rows(quick: bool) -> list[Row]:
    """Compare the orders in space, in time and of both together, of all that is measured."""
    found = []
    for of, sizes in refinements(quick).items():
        measured = [errors(ds, dt) for _, ds, dt in sizes]
        for name, column in zip(WHAT, zip(*measured, strict=True), strict=True):
            found.append(order_row(name, [size for size, _, _ in sizes], column, of, SOURCE))
    return found


def draw(figure: Figure) -> None:
    """Draw the errors over what is refined, with lines of slope two."""
    for axes, (of, sizes) in zip(figure.subplots(1, 3, sharey=True), refinements(False).items(), strict=True):
        size = np.array([size for size, _, _ in sizes])
        measured = np.array([errors(ds, dt) for _, ds, dt in sizes])
        for name, column in zip(WHAT, measured.T, strict=True):
            axes.loglog(size, column, ".-", linewidth=1, label=f"{name}, {order(size, column):.2f}")
        axes.loglog(size, measured.max() * (size / size[0]) ** 2, color="0.7", zorder=0)
        unit = {"Δs": "Δs [m]", "Δt": "Δt [s]", "both": "Δs/0.4 m = Δt/0.1 s"}[of]
        axes.set(xlabel=unit, ylim=(1e-6, 0.1))
        axes.legend(frameon=False, fontsize=6)
    figure.axes[0].set_ylabel("error")
