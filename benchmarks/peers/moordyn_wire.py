"""MoorDyn 2 (lumped masses, explicit) on what it shares with `cable`: towing a fixed length, and its way to pay out.

Its axes have z up; the wire hangs far below a calm surface and far above the sea bed. A wire is made twice with the
same numbers: mass m, weight (m − ¼πρd²)g, drag ½ρdC_n and ½ρπdC_t per length, stretch 1/(EA).

Inertia is where the two differ by intention: MoorDyn moves (m I + C_a ρA P)·a, the cable of Feng and Allen carries the
momentum m V + ρA P V, which for a wire that slides along its own curve is another tension, by ρA U². Where they are
compared there is no added mass: C_a = 0 there; here `Bare`, a wire that displaces nothing but weighs as if it did.

`pip install 'subzero-auv[peers]'` brings it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

import cable

DEPTH = 1000.0
STIFFNESS = 1e3
"""EA. [N]"""
UPWARD = np.array([1.0, 1.0, -1.0])
"""From north, east, down to MoorDyn's axes and back."""
EXCHANGE = 0.01
"""Time between two positions of the tow point that MoorDyn is told; in between it goes straight. [s]"""
DAMPING = 0.3
"""Internal damping as a fraction of the critical: with less than 0.2, MoorDyn's stretch waves grow at this step."""
SAFETY = 0.7
"""MoorDyn's step as a fraction of the time that a stretch wave takes for a segment: about the longest stable one."""
NOTHING = 1e-12
"""Cross section of a wire without added mass. [m²]"""


class Bare(cable.CableProperties):
    """A wire without added mass; its weight in water is that of a round one."""

    @property
    def weight_in_water(self) -> float:
        """(m − ¼πρd²) g. [N/m]."""
        return (self.mass_per_length - 0.25 * np.pi * self.water_density * self.diameter**2) * 9.81


NEUTRAL = Bare(
    mass_per_length=0.25 * np.pi * 1000.0 * 0.0025**2, cross_section_area=NOTHING, compliance=1.0 / STIFFNESS
)
HEAVY = Bare(
    mass_per_length=2.0 * NEUTRAL.mass_per_length, cross_section_area=NOTHING, compliance=1.0 / STIFFNESS
)
"""Wires to compare with: d = 2.5 mm as in Table 1, neutral, and twice as heavy as the water."""


class Towed(NamedTuple):
    """What MoorDyn says: times (n,) [s], force on the tow point (n, 3) north, east, down, and end tension (n,). [N]"""

    time: np.ndarray
    force: np.ndarray
    end_tension: np.ndarray


def input_text(
    tail: Sequence[float], length: float, segments: int, far: str, step: float, wire: cable.CableProperties
) -> str:
    """Return MoorDyn's input file for one straight wire that starts at `tail`, its second point led by us."""
    ratios = f"{wire.normal_drag_coefficient} 0.0 {wire.tangential_drag_coefficient} 0.0"
    return "\n".join(
        [
            "One wire.",
            "--- LINE TYPES ---",
            "TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx",
            "- - - - - - - - - -",
            f"wire {wire.diameter} {wire.mass_per_length} {1.0 / wire.compliance} {-DAMPING} 0.0 {ratios}",
            "--- POINTS ---",
            "ID Attachment X Y Z Mass Volume CdA Ca",
            "- - - - - - - - -",
            f"1 {far} {tail[0]} {tail[1]} {tail[2]} 0 0 0 0",
            f"2 Coupled 0 0 {-DEPTH} 0 0 0 0",
            "--- LINES ---",
            "ID LineType AttachA AttachB UnstrLen NumSegs LineOutputs",
            "- - - - - - -",
            f"1 wire 1 2 {length} {segments} -",
            "--- OPTIONS ---",
            f"{step} dtM",
            "rk2 tScheme",
            "0 writeLog",
            "9.81 g",
            f"{wire.water_density} WtrDnsty",
            f"{3.0 * DEPTH} WtrDpth",
            "0 TmaxIC",
            "1 disableOutput",
            "1 disableOutTime",
            "--- END ---",
            "",
        ]
    )


def internal_step(length: float, segments: int, wire: cable.CableProperties) -> float:
    """Return the step of MoorDyn's own integration. [s]."""
    wave = np.sqrt(1.0 / (wire.compliance * wire.mass_per_length))
    return SAFETY * length / (segments * wave)


def tow(
    tow_velocity: Callable[[float], Sequence[float]],
    length: float,
    duration: float,
    segments: int,
    *,
    wire: cable.CableProperties = NEUTRAL,
    ahead: Sequence[float] = (1.0, 0.0, 0.0),
    payout: float = 0.0,
    held: bool = False,
) -> Towed:
    """Tow a wire with MoorDyn, from rest and straight.

    Args:
        tow_velocity: function of time [s] that gives the velocity north, east, down (3,). [m/s]
        length: L at the start. [m]
        duration: how long. [s]
        segments: how many, of equal length.
        wire: the wire.
        ahead: direction from the tail to the tow point at the start, north, east, down, a unit vector (3,).
        payout: dL/dt, told to MoorDyn's line. [m/s]
        held: the far end is held in place, instead of free.
    """
    place = np.array([0.0, 0.0, -DEPTH])
    tail = place - length * UPWARD * ahead
    step = internal_step(length, segments, wire)
    text = input_text(tail, length, segments, "Fixed" if held else "Free", step, wire)
    with TemporaryDirectory() as folder, silence():
        file = Path(folder, "wire.txt")
        file.write_text(text)
        return _follow(str(file), tow_velocity, duration, place, payout)


def _follow(
    file: str,
    tow_velocity: Callable[[float], Sequence[float]],
    duration: float,
    place: np.ndarray,
    payout: float,
) -> Towed:
    """Lead the second point of MoorDyn's system along a path."""
    import moordyn

    system = moordyn.Create(file)
    moordyn.Init(system, list(place), list(UPWARD * tow_velocity(0.0)))
    line = moordyn.GetLine(system, 1)
    moordyn.SetLineUnstretchedLengthVel(line, payout)
    count = round(duration / EXCHANGE)
    force, tension = np.zeros((count, 3)), np.zeros(count)
    for k in range(count):
        velocity = UPWARD * tow_velocity((k + 0.5) * EXCHANGE)
        force[k] = UPWARD * moordyn.Step(system, list(place), list(velocity), k * EXCHANGE, EXCHANGE)
        tension[k] = moordyn.GetLineFairTen(line)
        place = place + EXCHANGE * velocity
    moordyn.Close(system)
    return Towed(EXCHANGE * np.arange(1, count + 1), force, tension)


@contextmanager
def silence() -> Iterator[None]:
    """Keep compiled code from printing."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [os.dup(1), os.dup(2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for stream in (1, 2):
            os.dup2(nowhere, stream)
        yield
    finally:
        for stream, old in zip((1, 2), kept, strict=True):
            os.dup2(old, stream)
            os.close(old)
        os.close(nowhere)
