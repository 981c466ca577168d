"""What no open measurement is at hand for, against formulas: the steady pull of the paper, and towing angles."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np

import cable

SPEEDS = (1.0, 2.0, 4.0)


class Compared(NamedTuple):
    """A quantity, its unit and source, and its value by the formula and computed."""

    what: str
    source: str
    formula: float
    computed: float


def straight_pull() -> Compared:
    """Return the tow tension at 30 s of case (i) of the paper, T = ½ρπdC_t U² S at U = 1 m/s. [N]"""
    run = cable.pull_out(lambda t: (1.0, 0.0, 0.0), 30.0)
    exact = cable.CableProperties().tangential_drag * 30.0
    return Compared(
        "cable drag at 30 s [N]",
        "Feng and Allen, 2004, equation (37), the line of Fig. 4",
        exact,
        float(run.tow_tension[-1]),
    )


def towing_angles() -> list[Compared]:
    """Return the declinations at the tow point of a long wire, twenty minutes after its speed has doubled. [degrees]"""
    wire, rows = cable.line_type("wire", 0.01), []
    for speed in SPEEDS:
        run = cable.tow(
            partial(_doubled, speed=speed), 300.0, 1230.0, cable=wire, scheme=cable.MovingEnd(time_step=0.5)
        )
        chord = run.shapes[-1][1] - run.shapes[-1][0]
        angle, exact = np.degrees(np.arctan2(chord[2], -chord[0])), np.degrees(wire.critical_angle(speed))
        what = f"angle of 10 mm wire in tow at {speed:g} m/s [°]"
        rows.append(Compared(what, "½ρdC_n U² sin²φ = w_c cosφ", float(exact), float(angle)))
    return rows


def _doubled(t: float, speed: float) -> tuple[float, float, float]:
    """Return the velocity of a tow point that doubles its speed within half a minute. [m/s]"""
    return speed * min(0.5 + t / 60.0, 1.0), 0.0, 0.0
