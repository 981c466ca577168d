"""A lazy wave at rest, 1:70 (Holcombe and others, 2025): 3.67 m of cable, lifted by twenty small floats between 2.14
and 3.23 m, from a fixed hang-off to a tethered end. Measured are seven marker centres, digitised from fig. 7 of the
article; the last one is the tethered end, and is given.

All numbers are printed ones, as `SMI-Lab-Inha/CableDyn` (Apache-2.0) sorted them out of article and thesis: 12.7 g/m,
2.3 mm, EA = 65.5 kN; a float of 1.36 g with 27.3 mN of buoyancy, a marker of 1.1 g with 14.1 mN. None is fitted. Floats
are spread evenly over their section here, markers are bodies, and the hang-off is a hinge. The bending stiffness of
0.6 mN m² is left out, as a line of sections has none: CableDyn, which has it, misses the markers by the same.
"""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np

import cable

DATA = Path(__file__).with_name("holcombe_markers.csv")
DENSITY, GRAVITY = 1000.0, 9.80665
DIAMETER, LENGTH, FLOATS = 0.0023, 3.67, (2.14, 3.23)
HANG_OFF = (0.075561, 0.0, 0.290105)
"""North (away), east, down. [m]"""


@cache
def markers() -> np.ndarray:
    """Return place along the cable, distance and depth of the measured markers (7, 3). [m]"""
    lines = [line for line in DATA.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    rows = [[float(row["arc"]), float(row["x"]), -float(row["z"])] for row in csv.DictReader(lines)]
    return np.array(rows)


def section(length: float, mass: float = 0.0, buoyancy: float = 0.0) -> cable.Section:
    """Return a section with floats of so much mass [kg/m] and buoyancy [N/m]."""
    area = 0.25 * np.pi * DIAMETER**2 + buoyancy / (DENSITY * GRAVITY)
    bare = cable.CableProperties(
        water_density=DENSITY, mass_per_length=0.0127 + mass, cross_section_area=area, diameter=DIAMETER,
        compliance=1.0 / 65.5e3,
    )  # fmt: skip
    return cable.Section(length, bare)


def line() -> cable.SectionedCable:
    """Return the cable with its floats and markers."""
    start, end = FLOATS
    span = end - start
    return cable.SectionedCable(
        sections=[
            section(start),
            section(span, 20 * 1.36e-3 / span, 20 * 27.3e-3 / span),
            section(LENGTH - end),
        ],
        bodies=[
            cable.Body(arc, mass=1.1e-3, volume=14.1e-3 / (DENSITY * GRAVITY)) for arc in markers()[:, 0]
        ],
    )


def computed(segment_length: float = 0.02) -> np.ndarray:
    """Return distance and depth of the markers (7, 2). [m]"""
    arc, away, down = markers().T
    rest = cable.hold(
        [HANG_OFF, (away[-1], 0.0, down[-1])], LENGTH, cable=line(), segment_length=segment_length
    )
    nodes = np.concatenate([[0.0], np.cumsum(rest.segment_lengths)])
    return np.stack([np.interp(arc, nodes, rest.shape[:, i]) for i in (0, 2)], axis=1)


def mean_miss(places: np.ndarray) -> float:
    """Return the root of the mean square of how far the free markers are from the measured ones. [m]"""
    apart = np.linalg.norm(places - markers()[:, 1:], axis=1)[:-1]
    return float(np.sqrt((apart**2).mean()))


def curvatures(places: np.ndarray) -> np.ndarray:
    """Return one over the radius of the circle through each three neighbouring markers (5,). [1/m]"""
    a, b, c = places[1:-1] - places[:-2], places[2:] - places[1:-1], places[2:] - places[:-2]
    sides = np.prod([np.linalg.norm(side, axis=1) for side in (a, b, c)], axis=0)
    curvature: np.ndarray = 2.0 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / sides
    return curvature
