"""MoorDyn 2, another code by other people, tows the same wire of 30 m without added mass (`benchmarks.peers_moordyn`).

What is compared is the force on the tow point, as a vector, at all times from 2 s on but for 0.6 s about each kink of
the motion, where MoorDyn's stretch waves ring. Lumped masses with a tangent averaged over two segments are a coarse
model; what counts is where they go: with the square of the segment length to our force. Ours is a run with segments
of 0.1 m, both have EA = 1 kN. The tension that MoorDyn reports for its *end segment* is another thing: it leaves out
the drag on half a segment.

Paying out, MoorDyn rescales all segments: the material at s moves at U s/L instead of at U, and the drag, ∫(s/L)² ds,
comes to a third. Nor can one say what the drum's tension shall be. That is shown without a verdict.

Where MoorDyn is not installed (`pip install 'subzero[peers]'`), this section stays as it was last measured.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from importlib.util import find_spec

import numpy as np
from matplotlib.figure import Figure

import cable
from benchmarks.cable import dive
from benchmarks.peers_moordyn import HEAVY, NEUTRAL, Bare, Towed, tow

from .row import NotAvailableError, Row, Setting, order_row

LENGTH, DURATION = 30.0, 30.0
SOURCE = "MoorDyn 2"
LEAD_IN = 90.0
"""How long the heavy wire is towed straight first: MoorDyn starts it on a catenary. [s]"""
GATES = {10: np.inf, 30: 5e-2, 100: 5e-3}
"""Errors allowed at so many of MoorDyn's segments: its own."""
STIFF = replace(NEUTRAL, compliance=1e-5)
"""For the straight tow: the drag grows with √(1 + eT) in our equations (7), and not in MoorDyn's."""

Motion = Callable[[float], tuple[float, float, float]]


def spiral(t: float) -> tuple[float, float, float]:
    """Go straight, then turn at 0.3 rad/s and pitch down to 30 degrees, from 10 s to 20 s. [m/s]."""
    heading = 0.3 * min(max(t - 10.0, 0.0), 10.0)
    pitch = np.radians(-30.0) * min(max(0.2 * (t - 10.0), 0.0), 1.0)
    return np.cos(heading) * np.cos(pitch), np.sin(heading) * np.cos(pitch), -np.sin(pitch)


MOTIONS = {"dive": dive, "spiral": spiral}


def straight(_t: float) -> tuple[float, float, float]:
    """Go north at 1 m/s."""
    return 1.0, 0.0, 0.0


def delayed(motion: Motion, delay: float) -> Motion:
    """Return the same motion, begun later."""
    return lambda t: motion(max(t - delay, 0.0))


@cache
def ours(name: str, wire: Bare, delay: float = 0.0, step: float = 0.025) -> cable.History:
    """Return our run of a motion."""
    motion = delayed(MOTIONS[name], delay)
    return cable.tow(motion, LENGTH, delay + DURATION, step, segment_length=0.1, cable=wire)


@cache
def theirs(name: str, wire: Bare, segments: int, delay: float = 0.0) -> Towed:
    """Return MoorDyn's run of a motion."""
    shape = ours(name, wire, delay).shapes[0]
    ahead = (shape[0] - shape[-1]) / np.linalg.norm(shape[0] - shape[-1])
    motion = delayed(MOTIONS[name], delay)
    return tow(motion, LENGTH, delay + DURATION, segments, wire=wire, ahead=ahead)


def towed(name: str, wire: Bare, segments: int, delay: float = 0.0) -> Row:
    """Compare the tow force over a run."""
    a, b = ours(name, wire, delay), theirs(name, wire, segments, delay)
    force = np.stack([np.interp(b.time, a.time, a.tow_force[:, i]) for i in range(3)], axis=1)
    late = b.time - delay > 2.0
    for kink in (10.0, 20.0):
        late &= np.abs(b.time - delay - kink) > 0.6
    error = np.where(late, np.linalg.norm(b.force - force, axis=1), 0.0)
    k = int(error.argmax())
    kind = "heavy" if wire is HEAVY else "neutral"
    return Row(
        name=f"{name}, {kind} wire, {segments} of MoorDyn's segments",
        ours=float(np.linalg.norm(force[k])),
        reference=float(np.linalg.norm(b.force[k])),
        error=float(error[k] / a.tow_tension.max()),
        gate=GATES[segments],
        source=SOURCE,
        unit="N",
        measure="vector, worst of the run, of the largest force",
    )


def straight_tow() -> list[Row]:
    """Compare a steady straight tow of a stiff wire, and what MoorDyn calls the tension at its end."""
    run = cable.tow(straight, LENGTH, 10.0, cable=STIFF)
    peer = tow(straight, LENGTH, 10.0, 30, wire=STIFF)
    force = Setting("straight tow, 30 of MoorDyn's segments: force on the tow point", SOURCE, 1e-5)
    end = replace(force, name="the same: tension of MoorDyn's end segment", gate=np.inf)
    drag = STIFF.tangential_drag
    half = replace(end, name="the same: with the drag on half a segment", gate=1e-5)
    return [
        force.row(run.tow_tension[-1], -peer.force[-1, 0]),
        end.row(run.tow_tension[-1], peer.end_tension[-1]),
        half.row(run.tow_tension[-1], peer.end_tension[-1] + drag * 0.5 * LENGTH / 30),
    ]


def paid_out(segments: int) -> Row:
    """Compare a straight pull from 10 m to 30 m, with our free drum and MoorDyn's rate of length."""
    run = cable.pull_out(straight, 20.0, wet_length=10.0)
    peer = tow(straight, 10.0, 20.0, segments, payout=1.0, held=True)
    name = f"paid out straight to 30 m, {segments} of MoorDyn's segments: T(0)/(½ρπdC_tU²S)"
    exact = NEUTRAL.tangential_drag * 30.0
    ours, theirs = run.tow_tension[-1] / exact, -peer.force[-1, 0] / exact
    return Setting(name, SOURCE, np.inf, "").row(ours, theirs, 1.0)


def rows(quick: bool) -> list[Row]:
    """Compare tows and pay-out with MoorDyn 2."""
    if find_spec("moordyn") is None:
        raise NotAvailableError("MoorDyn is not installed (pip install 'subzero[peers]').")
    segments = (10, 30) if quick else (10, 30, 100)
    found = straight_tow()
    for name in ("dive",) if quick else MOTIONS:
        refined = [towed(name, NEUTRAL, count) for count in segments]
        found += refined[1:]
        sizes = [LENGTH / count for count in segments]
        errors = [row.error for row in refined]
        found.append(order_row(f"{name}: MoorDyn comes to us", sizes, errors, "its Δs", SOURCE))
    if not quick:
        found += [towed("dive", HEAVY, count, LEAD_IN) for count in (30, 100)]
    return [*found, *(paid_out(count) for count in segments[1:])]


def draw(figure: Figure) -> None:
    """Draw the force of the dive, and the differences."""
    left, right = figure.subplots(1, 2)
    run = ours("dive", NEUTRAL)
    left.plot(run.time, run.tow_tension, "k", label="ours")
    for segments in (10, 30, 100):
        peer = theirs("dive", NEUTRAL, segments)
        left.plot(
            peer.time, np.linalg.norm(peer.force, axis=1), lw=0.8, label=f"MoorDyn, {segments} segments"
        )
        force = np.stack([np.interp(peer.time, run.time, run.tow_force[:, i]) for i in range(3)], axis=1)
        right.semilogy(peer.time, np.linalg.norm(peer.force - force, axis=1) / run.tow_tension.max(), lw=0.8)
    left.set(xlabel="time [s]", ylabel="force on the tow point [N]", ylim=(0.9, 1.4))
    right.set(xlabel="time [s]", ylabel="difference / largest force", ylim=(1e-5, 1.0))
    left.legend(frameon=False)
