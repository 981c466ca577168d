"""CableDyn (implicit finite elements) on what it shares with `cable`: a cable between two held ends, one of them led.

It has no pay-out, and refuses a cable without weight: this one weighs a hundredth more than its water. It carries no
added mass, as in `moordyn_wire`. `pip install 'subzero-auv[peers]'` brings it.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import cable
from benchmarks.peers.moordyn_wire import DEPTH, NEUTRAL, NOTHING, STIFFNESS, UPWARD, Bare

LENGTH = 30.0
DRUM = (-20.0, 0.0, 10.0)
"""Where the far end is held, from the vehicle at the start: north, east, down. [m]"""
WIRE = Bare(
    mass_per_length=1.01 * NEUTRAL.mass_per_length, cross_section_area=NOTHING, compliance=1.0 / STIFFNESS
)
RADIUS, PERIOD_S, HEAVE, HEAVE_PERIOD_S, EASE_S = 3.0, 15.0, 0.5, 5.0, 5.0
"""A circle with heave on it, begun from rest. [m], [s]"""


def kinematics(t):
    """Return velocity and acceleration of the vehicle's end, north, east, down (3,). [m/s, m/s²]"""
    x = min(max(t / EASE_S, 0.0), 1.0)
    ease, slope = x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) / EASE_S
    w, h = 2.0 * np.pi / PERIOD_S, 2.0 * np.pi / HEAVE_PERIOD_S
    steady = np.array([RADIUS * w * np.cos(w * t), RADIUS * w * np.sin(w * t), HEAVE * h * np.cos(h * t)])
    change = np.array(
        [-RADIUS * w**2 * np.sin(w * t), RADIUS * w**2 * np.cos(w * t), -HEAVE * h**2 * np.sin(h * t)]
    )
    return ease * steady, slope * steady + ease * change


def places(step, count):
    """Return where the vehicle's end is at every step (count + 1, 3), by Gauss's rule of eight points. [m]"""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    middle = step * (np.arange(count)[:, None] + 0.5 + 0.5 * nodes)
    ways = np.array([[kinematics(t)[0] for t in row] for row in middle])
    return np.vstack([np.zeros(3), np.cumsum(0.5 * step * np.einsum("k,nki->ni", weights, ways), axis=0)])


def deck(file, wire, length, far, segments):
    """Write CableDyn's input file for one line, its first point led by us."""
    from cabledyn import DeckWriter

    one = DeckWriter(title="one cable between two ends")
    one.add_line_type(
        "cable", diam=wire.diameter, mass=wire.mass_per_length, ea=1.0 / wire.compliance,
        cdn=wire.normal_drag_coefficient, cdt=wire.tangential_drag_coefficient,
    )  # fmt: skip
    one.add_point(1, "Coupled", 0.0, 0.0, -DEPTH)
    one.add_point(2, "Fixed", *(UPWARD * far + [0.0, 0.0, -DEPTH]))
    one.add_line(1, node_a=2, node_b=1)
    one.add_section(line_id=1, line_type="cable", length=length, num_segs=segments)
    for value, name in ((9.81, "g"), (wire.water_density, "rhoW"), (3.0 * DEPTH, "WtrDpth")):
        one.set_option(value, name)
    one.write(file)


class Led:
    """CableDyn's run of the circle, ready to go: what is written and read once is no part of what is timed.

    Args:
        segments: elements.
        step: [s]
        duration: [s]
    """

    def __init__(self, segments, step, duration):
        self._folder = TemporaryDirectory()
        self._file = Path(self._folder.name, "cable.dat")
        deck(self._file, WIRE, LENGTH, DRUM, segments)
        self.time = step * np.arange(round(duration / step) + 1)
        self._step, self._places = step, places(step, self.time.size - 1)
        self._rates = [kinematics(t) for t in self.time]

    def run(self):
        """Return the force on the vehicle's end (n, 3), north, east, down. [N]"""
        from cabledyn import CableDyn

        with CableDyn(self._file) as model:
            q, v, a = model.get_coupled_motion()
            force = [UPWARD * model.calc_output()[:3]]
            for place, (velocity, acceleration) in zip(self._places[1:], self._rates[1:], strict=True):
                q[:3] = UPWARD * place + [0.0, 0.0, -DEPTH]
                v[:3], a[:3] = UPWARD * velocity, UPWARD * acceleration
                model.step(self._step, q, v, a)
                force.append(UPWARD * model.calc_output()[:3])
        return np.array(force)


def ours(segment, step, duration):
    """Return our run of the circle."""
    held = cable.hold(((0.0, 0.0, 0.0), DRUM), LENGTH, cable=WIRE, segment_length=segment)
    scheme = cable.MovingEnd(time_step=step, segment_length=segment)
    return cable.pull_out(
        lambda t: kinematics(t)[0], duration, start=held, drum=cable.Brake(), cable=WIRE, scheme=scheme
    )


def rest(wire, length, far, segments):
    """Return the tension at the vehicle's end of a cable at rest, as CableDyn finds it. [N]"""
    from cabledyn import CableDyn

    with TemporaryDirectory() as folder:
        file = Path(folder, "cable.dat")
        deck(file, wire, length, far, segments)
        with CableDyn(file) as model:
            return float(np.linalg.norm(model.calc_output()[:3]))
