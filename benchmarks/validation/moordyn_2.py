"""MoorDyn 2, another code by other people, tows the same bare wire of 30 m (`benchmarks.peers.moordyn_wire`).

What is compared is the force on the tow point, as a vector, at all times from 2 s on but for 0.6 s about each kink of
the motion, where MoorDyn's stretch waves ring. Lumped masses with a tangent averaged over two segments are a coarse
model (1 % to 6 % at 30 segments, shown without a verdict); what counts is where they go: with the square of the segment
length to our force. Ours is a run with segments of 0.1 m, both have EA = 1 kN. The tension that MoorDyn reports for its
*end segment* is another thing: it leaves out the drag on half a segment.

Paying out, MoorDyn rescales all segments: the material at s moves at U s/L instead of at U, and the drag, ∫(s/L)² ds,
comes to a third. Nor can one say what the drum's tension shall be. That is shown without a verdict.

MoorDyn's forces are those of its version 2.7.2 in `benchmarks/validation/data`; where it is installed
(`pip install 'subzero-auv[peers]'`), this page's command runs it and writes them anew.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from matplotlib.figure import Figure

import cable
from benchmarks.peers.moordyn_wire import NEUTRAL, Towed

from .moordyn_record import LENGTH, STIFF, TRIALS, recorded, straight
from .row import Row, Setting, order_row

SOURCE = "MoorDyn 2"
GATES = {10: np.inf, 30: np.inf, 100: 5e-3}
"""Errors allowed at so many of MoorDyn's segments: its own; at 30 they are shown without a verdict."""


@cache
def ours(name: str) -> cable.History:
    """Return our run of a trial."""
    return TRIALS[name].ours()


def apart(name: str, segments: int) -> tuple[Towed, np.ndarray]:
    """Return MoorDyn's run of a trial, and our force at its times (n, 3). [N]."""
    a, b = ours(name), recorded()[f"{name}, {segments}"]
    times = b.time + TRIALS[name].delay
    return b, np.stack([np.interp(times, a.time, a.tow_force[:, i]) for i in range(3)], axis=1)


def towed(name: str, segments: int) -> Row:
    """Compare the tow force over a run."""
    b, force = apart(name, segments)
    late = b.time > 2.0
    for kink in (10.0, 20.0):
        late &= np.abs(b.time - kink) > 0.6
    error = np.where(late, np.linalg.norm(b.force - force, axis=1), 0.0)
    k = int(error.argmax())
    return Row(
        name=f"{name}, {segments} of MoorDyn's segments",
        ours=float(np.linalg.norm(force[k])),
        reference=float(np.linalg.norm(b.force[k])),
        error=float(error[k] / ours(name).tow_tension.max()),
        gate=GATES[segments],
        source=SOURCE,
        unit="N",
        measure="vector, worst of the run, of the largest force",
    )


def straight_tow() -> list[Row]:
    """Compare a steady straight tow of a stiff wire, and what MoorDyn calls the tension at its end."""
    run = cable.tow(straight, LENGTH, 10.0, cable=STIFF)
    peer = recorded()["straight, 30"]
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
    run = cable.pull_out(straight, 20.0, start=10.0)
    peer = recorded()[f"paid out, {segments}"]
    name = f"paid out straight to 30 m, {segments} of MoorDyn's segments: T(0)/(½ρπdC_tU²S)"
    exact = NEUTRAL.tangential_drag * 30.0
    ours, theirs = run.tow_tension[-1] / exact, -peer.force[-1, 0] / exact
    return Setting(name, SOURCE, np.inf, "").row(ours, theirs, 1.0)


def rows(quick: bool) -> list[Row]:
    """Compare tows and pay-out with MoorDyn 2."""
    segments = (10, 30) if quick else (10, 30, 100)
    found = straight_tow()
    for name, trial in list(TRIALS.items())[: 1 if quick else None]:
        refined = [towed(name, count) for count in (segments[1:] if trial.delay else segments)]
        found += refined[-2:]
        if not trial.delay:
            sizes = [LENGTH / count for count in segments]
            errors = [row.error for row in refined]
            found.append(order_row(f"{name}: MoorDyn comes to us", sizes, errors, "its Δs", SOURCE))
    return [*found, *(paid_out(count) for count in segments[1:])]


def draw(figure: Figure) -> None:
    """Draw the force of the dive, and the differences."""
    left, right = figure.subplots(1, 2)
    name = "dive, neutral wire"
    left.plot(ours(name).time, ours(name).tow_tension, "k", label="ours")
    for segments in (10, 30, 100):
        peer, force = apart(name, segments)
        left.plot(
            peer.time, np.linalg.norm(peer.force, axis=1), lw=0.8, label=f"MoorDyn, {segments} segments"
        )
        difference = np.linalg.norm(peer.force - force, axis=1) / ours(name).tow_tension.max()
        right.semilogy(peer.time, difference, lw=0.8)
    left.set(xlabel="time [s]", ylabel="force on the tow point [N]", ylim=(0.7, 1.4))
    right.set(xlabel="time [s]", ylabel="difference / largest force", ylim=(1e-5, 1.0))
    left.legend(frameon=False)
