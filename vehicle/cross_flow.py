"""Cross-flow drag of the hull, strip by strip.

    dF = −½ ρ C_d 2R(x) |V⊥| V⊥ dx,   V⊥ = (v + x r, w − x q)           (Hoerner 1965; Fossen 2021, eq. 6.90)

Each slice is a cylinder in its own local cross flow: sway and heave share one flow, so a drag to the side
feels the flow from below. Acts along V⊥ at the slice, so it can only brake. Each of
`STRIPS` slices acts at its centroid.

Of a hull that is no body of revolution, sections of a breadth and a height along its axis:

    dF = −½ρ [C_y h(x) (v + x r)² + C_z b(x) (w − x q)²] V/|V| dx,   V = (v + x r, w − x q)
                                                            (Healey and Lienard 1993; Gertler and Hagen 1967)

h is the height that a flow from the side meets, with its coefficient C_y, b the breadth that a flow from below meets,
with C_z. All are linear in x between two sections. The drag acts along the local cross flow V, so it can only brake,
and the moment is that of the forces about the hull centre. With C_y h = C_z b both are the same.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from subzero.errors import short
from subzero.jit import compiled, gated_inlined, scratch
from vehicle.derivatives import is_table
from vehicle.geometry import Hull, slices
from vehicle.parameters import Problem, Section, parameter

STRIPS = 20
"""Slices over the length; force and moment differ by less than 0.7 % from those of 2 000 (tests/hull)."""


@dataclass(frozen=True, kw_only=True)
class CrossFlowDrag(Section):
    """Drag of the hull in flow across its axis."""

    drag_coefficient: float = parameter("cross-flow drag coefficient of a slice, C_d", "1", low=0.0)

    def numbers(self, hull: Hull, density: float, strips: int = STRIPS) -> np.ndarray:
        """Return (2, strips): centroid x from the hull centre [m], and ½ρ C_d ∫2R dx [kg/m]."""
        centroid, area = slices(hull, strips)
        return np.stack([centroid, density * self.drag_coefficient * area])


@gated_inlined
def cross_flow_drag(nu_r: np.ndarray, strips: np.ndarray, out: np.ndarray) -> None:
    """Fill out (6,) with the cross-flow drag of all strips [N, N m]; nu_r relative to the water."""
    v, w, q, r = nu_r[1], nu_r[2], nu_r[4], nu_r[5]
    Y = Z = M = N = 0.0
    forces = scratch(4, STRIPS)
    for first in range(0, strips.shape[1], STRIPS):
        count = min(STRIPS, strips.shape[1] - first)
        for i in range(count):  # apart from the sums: so the processor takes several strips at a time
            x = strips[0, first + i]
            vx, wx = v + x * r, w - x * q
            drag = strips[1, first + i] * math.sqrt(vx * vx + wx * wx)
            forces[0, i], forces[1, i] = drag * vx, drag * wx
            forces[2, i], forces[3, i] = x * drag * wx, x * drag * vx
        for i in range(count):
            Y -= forces[0, i]
            Z -= forces[1, i]
            M += forces[2, i]
            N -= forces[3, i]
    out[0] = out[3] = 0.0
    out[1] = Y
    out[2] = Z
    out[4] = M
    out[5] = N


@dataclass(frozen=True, kw_only=True)
class HullSection(Section):
    """One section across the hull; two or more make a hull, linear between them."""

    x: float = parameter("station, forward of the hull centre", "m")
    breadth: float = parameter("breadth, met by a flow from below, b", "m", low=0.0)
    height: float = parameter("height, met by a flow from the side, h", "m", low=0.0)
    lateral_drag_coefficient: float = parameter("drag coefficient in a flow from the side, C_y", "1", low=0.0)
    vertical_drag_coefficient: float = parameter("drag coefficient in a flow from below, C_z", "1", low=0.0)


def section_problems(sections: tuple[tuple[str, HullSection], ...]) -> list[Problem]:
    """Return the problems of the pairs of name and section of a hull, each section valid by itself."""
    if not is_table(sections) or not all(isinstance(each, HullSection) for _, each in sections):
        why, allowed = "this is no such part", "pairs of a name and a vehicle.cross_flow.HullSection"
        return [Problem(key="sections", found=short(sections), why=why, allowed=allowed)]
    if (sections and len({section.x for _, section in sections}) < len(sections)) or len(sections) == 1:
        found, why = f"{len(sections)} of them", "a hull reaches from one section to another"
        return [Problem(key="sections", found=found, why=why, allowed="two or more, each at an x of its own")]
    return []


def strips_of(sections: tuple[HullSection, ...], density: float) -> np.ndarray:
    """Return (3, STRIPS) equal strips between the first and the last section, aft to forward.

    Rows: middle x [m], ½ρ C_y h dx and ½ρ C_z b dx [kg/m]; zeros for fewer than two sections.
    """
    strips = np.zeros((3, STRIPS))
    if len(sections) < 2:
        return strips
    ordered = sorted(sections, key=lambda section: section.x)
    x = np.array([section.x for section in ordered])
    step = (x[-1] - x[0]) / STRIPS
    strips[0] = x[0] + step * (np.arange(STRIPS) + 0.5)
    side = [section.lateral_drag_coefficient * section.height for section in ordered]
    below = [section.vertical_drag_coefficient * section.breadth for section in ordered]
    for row, widths in ((1, side), (2, below)):
        strips[row] = 0.5 * density * step * np.interp(strips[0], x, widths)
    return strips


@compiled
def add_section_drag(nu_r: np.ndarray, strips: np.ndarray, out: np.ndarray) -> None:
    """Add the cross-flow drag of all strips to out (6,) [N, N m]; nu_r relative to the water."""
    v, w, q, r = nu_r[1], nu_r[2], nu_r[4], nu_r[5]
    for i in range(strips.shape[1]):
        x = strips[0, i]
        vx, wx = v + x * r, w - x * q
        speed = math.sqrt(vx * vx + wx * wx)
        if speed > 0.0:
            drag = (strips[1, i] * vx * vx + strips[2, i] * wx * wx) / speed
            out[1] -= drag * vx
            out[2] -= drag * wx
            out[4] += x * drag * wx
            out[5] -= x * drag * vx
