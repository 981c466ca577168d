"""A chain on a floor, and a line of wire and chain: at rest, and led at one end, by ours and by every peer.

At rest the exact solution is the elastic catenary, piece by piece, on a hard floor without friction. In motion the
first end goes round a small vertical circle; ours, refined, is what errors are measured against. No line carries added
mass, as in `moordyn_wire`; all codes have the same floor. What each needs to find its state of rest is in its time.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from scipy.optimize import fsolve

import cable
from benchmarks.peers.moordyn_wire import DAMPING, EXCHANGE, NOTHING, SAFETY, UPWARD, Bare, silence

DEEP = 1000.0
"""Depth of the water where there is no floor. [m]"""
PERIOD_S, RADIUS, EAST, EASE_S = 3.0, 0.05, 0.03, 3.0
"""The circle of the first end, its share to the side, and how long it grows. [s], [m], [m], [s]"""
DURATION_S = 12.0
SETTLED = 1e-6
"""Change of MoorDyn's tensions at which its search for rest ends. [-]"""


class Line(NamedTuple):
    """A line between two ends: sections (length [m], properties) from the first on, and the floor's modulus [N/m³].

    The second end lies on the floor if there is one.
    """

    sections: tuple[tuple[float, Bare], ...]
    ends: tuple[tuple[float, float, float], tuple[float, float, float]]
    modulus: float = 0.0

    @property
    def depth(self) -> float:
        """Of the water. [m]"""
        return self.ends[1][2] if self.modulus else DEEP

    @property
    def length(self) -> float:
        """Unstretched. [m]"""
        return sum(length for length, _ in self.sections)


CHAIN = Bare(
    mass_per_length=0.0818, cross_section_area=NOTHING, diameter=0.0022, compliance=1e-4,
    normal_drag_coefficient=2.5, tangential_drag_coefficient=0.5 / np.pi,
)  # fmt: skip
WIRE = Bare(mass_per_length=0.02, cross_section_area=NOTHING, diameter=0.003, compliance=1e-4)
HARD, FIRM = 1e9, 1e7
"""Moduli of the floor at rest, where the exact one is rigid, and in motion. [N/m³]"""
ON_FLOOR = Line(((33.0, CHAIN),), ((32.554, 0.0, 6.7), (0.0, 0.0, 10.0)), FIRM)
SECTIONS = Line(((20.0, WIRE), (13.0, CHAIN)), ((28.0, 0.0, 20.0), (0.0, 0.0, 24.0)))


def divided(line: Line, count: int) -> list[int]:
    """Return how many of so many elements each section gets."""
    return [max(round(count * length / line.length), 1) for length, _ in line.sections]


def exact(line: Line) -> float:
    """Return the pull at the first end of a line at rest. [N]"""
    away = line.ends[0][0] - line.ends[1][0]
    down = line.ends[1][2] - line.ends[0][2]

    def apart(force: np.ndarray) -> list[float]:
        H, V, x, z = *force, 0.0, 0.0
        for length, part in line.sections:
            w, e = part.weight_in_water, part.compliance
            hangs = min(length, V / w) if line.modulus else length
            x += H / w * (np.arcsinh(V / H) - np.arcsinh((V - w * hangs) / H)) + H * e * hangs
            z += (np.hypot(H, V) - np.hypot(H, V - w * hangs)) / w + e * hangs * (V - 0.5 * w * hangs)
            x += (length - hangs) * (1.0 + e * H)
            V -= w * hangs
        return [x - away, z - down]

    weight = sum(length * part.weight_in_water for length, part in line.sections)
    return float(np.hypot(*fsolve(apart, [weight, 0.6 * weight], xtol=1e-13)))


def motion(t: float) -> np.ndarray:
    """Return displacement, velocity and acceleration of the first end, north, east, down (3, 3)."""
    w, u = 2.0 * np.pi / PERIOD_S, min(t / EASE_S, 1.0)
    ease = np.array([10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5, 0.0, 0.0])
    if u < 1.0:
        ease[1] = 30.0 * u**2 * (1.0 - u) ** 2 / EASE_S
        ease[2] = 60.0 * u * (1.0 - 3.0 * u + 2.0 * u**2) / EASE_S**2
    size, turn = np.array([RADIUS, EAST, RADIUS]), w * t + np.array([0.0, 0.0, 0.5 * np.pi])
    wave = size * np.array([np.sin(turn), w * np.cos(turn), -(w**2) * np.sin(turn)])
    return np.array(
        [
            ease[0] * wave[0],
            ease[1] * wave[0] + ease[0] * wave[1],
            ease[2] * wave[0] + 2.0 * ease[1] * wave[1] + ease[0] * wave[2],
        ]
    )


def our_rest(line: Line, segment: float) -> cable.Equilibrium:
    """Return our line at rest."""
    one = len(line.sections) == 1
    ours = (
        line.sections[0][1]
        if one
        else cable.SectionedCable(sections=[cable.Section(*s) for s in line.sections])
    )
    bed = (
        cable.SeaBed(depth=line.depth, modulus=line.modulus, axial_friction=0.0, lateral_friction=0.0)
        if line.modulus
        else None
    )
    return cable.hold(line.ends, line.length, cable=ours, segment_length=segment, bed=bed)


def our_pull(line: Line, segment: float) -> float:
    """Return our pull at rest. [N]"""
    return float(np.linalg.norm(our_rest(line, segment).tow_force))


def our_run(line: Line, segment: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times, and our forces on the first end (n, 3). [s], [N]"""
    run = cable.pull_out(
        lambda t: motion(t)[1], DURATION_S, start=our_rest(line, segment), drum=cable.Brake(),
        scheme=cable.MovingEnd(time_step=step),
    )  # fmt: skip
    if not run.outcome.completed:
        raise RuntimeError(run.outcome.message)
    return run.time, run.tow_force


def damping_on_floor(line: Line) -> float:
    """Return the critical damping of `SeaBed`, per diameter. [N s/m³]"""
    part = line.sections[-1][1]
    return 2.0 * np.sqrt(line.modulus * part.diameter * part.virtual_mass_per_length) / part.diameter


def moordyn_text(line: Line, segments: Sequence[int]) -> str:
    """Return MoorDyn's input file: one of its lines for each section, free points between them."""
    types, points, lines, step, from_first = [], [], [], np.inf, 0.0
    first, second = (UPWARD * end for end in line.ends)
    for k, ((length, part), count) in enumerate(zip(line.sections, segments, strict=True)):
        ratios = f"{part.normal_drag_coefficient} 0.0 {part.tangential_drag_coefficient} 0.0"
        types.append(
            f"type{k} {part.diameter} {part.mass_per_length} {1.0 / part.compliance} {-DAMPING} 0.0 {ratios}"
        )
        x = first + from_first / line.length * (second - first)
        points.append(f"{k + 1} {'Free' if k else 'Coupled'} {x[0]} {x[1]} {x[2]} 0 0 0 0")
        lines.append(f"{k + 1} type{k} {k + 2} {k + 1} {length} {count} -")
        step = min(step, SAFETY * length / count * np.sqrt(part.compliance * part.mass_per_length))
        from_first += length
    points.append(f"{len(points) + 1} Fixed {second[0]} {second[1]} {second[2]} 0 0 0 0")
    floor = [f"{line.modulus} kBot", f"{damping_on_floor(line)} cBot"] if line.modulus else []
    options = [
        f"{step} dtM", "rk2 tScheme", "0 writeLog", "9.81 g", "1000.0 WtrDnsty", f"{line.depth} WtrDpth", *floor,
        "0.0 FricCoeff", "1 ICgenDynamic",
        "0.5 dtIC", "300 TmaxIC", f"{SETTLED} threshIC", "1 disableOutput", "1 disableOutTime",
    ]  # fmt: skip
    return "\n".join(
        [
            "--- LINE TYPES ---", "TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx", "-", *types,
            "--- POINTS ---", "ID Attachment X Y Z Mass Volume CdA Ca", "-", *points,
            "--- LINES ---", "ID LineType AttachA AttachB UnstrLen NumSegs LineOutputs", "-", *lines,
            "--- OPTIONS ---", *options, "--- END ---", "",
        ]
    )  # fmt: skip


def moordyn_run(
    line: Line, segments: Sequence[int], duration: float = DURATION_S
) -> tuple[np.ndarray, np.ndarray]:
    """Return times, and MoorDyn's forces on the first end (n, 3). [s], [N]"""
    import moordyn

    with TemporaryDirectory() as folder, silence():
        file = Path(folder, "line.txt")
        file.write_text(moordyn_text(line, segments))
        system, first = moordyn.Create(str(file)), UPWARD * line.ends[0]
        moordyn.Init(system, list(first), [0.0, 0.0, 0.0])
        force = []
        for k in range(round(duration / EXCHANGE)):
            here, there = (UPWARD * motion(n * EXCHANGE)[0] for n in (k, k + 1))
            velocity = (there - here) / EXCHANGE
            force.append(
                UPWARD * moordyn.Step(system, list(first + here), list(velocity), k * EXCHANGE, EXCHANGE)
            )
        moordyn.Close(system)
    return EXCHANGE * np.arange(1, len(force) + 1), np.array(force)


def moordyn_rest(line: Line, segments: Sequence[int]) -> float:
    """Return MoorDyn's pull at rest: the force after one exchange without motion to speak of. [N]

    Its explicit steps do not bear the hard floor.
    """
    line = line._replace(modulus=min(line.modulus, FIRM))
    return float(np.linalg.norm(moordyn_run(line, segments, EXCHANGE)[1][0]))


def cabledyn_deck(file: Path, line: Line, segments: Sequence[int]) -> None:
    """Write CableDyn's input file."""
    from cabledyn import DeckWriter

    deck = DeckWriter(title="a line between two ends")
    deck.add_point(1, "Coupled", *(UPWARD * line.ends[0]))
    deck.add_point(2, "Fixed", *(UPWARD * line.ends[1]))
    deck.add_line(1, node_a=1, node_b=2)
    for k, ((length, part), count) in enumerate(zip(line.sections, segments, strict=True)):
        deck.add_line_type(
            f"type{k}", diam=part.diameter, mass=part.mass_per_length, ea=1.0 / part.compliance,
            cdn=part.normal_drag_coefficient, cdt=part.tangential_drag_coefficient,
        )  # fmt: skip
        deck.add_section(line_id=1, line_type=f"type{k}", length=length, num_segs=count)
    options = {"g": 9.81, "rhoW": 1000.0, "WtrDpth": line.depth}
    if line.modulus:
        options |= {"kBot": line.modulus, "cBot": float(damping_on_floor(line)), "frictionMu": 0.0}
    for name, value in options.items():
        deck.set_option(value, name)
    deck.write(file)


def cabledyn_run(
    line: Line, segments: Sequence[int], step: float, duration: float = DURATION_S
) -> tuple[np.ndarray, np.ndarray]:
    """Return times, and CableDyn's forces on the first end (n, 3). [s], [N]"""
    from cabledyn import CableDyn

    time = step * np.arange(round(duration / step) + 1)
    with TemporaryDirectory() as folder:
        file = Path(folder, "line.dat")
        cabledyn_deck(file, line, segments)
        with CableDyn(file) as model:
            q, v, a = model.get_coupled_motion()
            force, first = [UPWARD * model.calc_output()[:3]], np.array(q[:3])
            for t in time[1:]:
                x, velocity, acceleration = motion(t)
                q[:3], v[:3], a[:3] = first + UPWARD * x, UPWARD * velocity, UPWARD * acceleration
                model.step(step, q, v, a)
                force.append(UPWARD * model.calc_output()[:3])
    return time, np.array(force)


def cabledyn_rest(line: Line, segments: Sequence[int]) -> float:
    """Return CableDyn's pull at rest. [N]"""
    return float(np.linalg.norm(cabledyn_run(line, segments, 1.0, 0.0)[1][0]))


def moorpy_rest(line: Line) -> float:
    """Return MoorPy's pull at rest: catenaries, joined at free points. [N]"""
    import moorpy

    system = moorpy.System(depth=line.depth, rho=1000.0, g=9.81)
    system.addPoint(1, UPWARD * line.ends[1])
    at, whole = 0.0, np.array(line.ends, dtype=float)
    for k, (length, part) in enumerate(reversed(line.sections)):
        at += length
        is_last = k + 1 == len(line.sections)
        x = (
            whole[1]
            + at / line.length * (whole[0] - whole[1])
            + (0.0 if is_last else np.array([0.0, 0.0, 1.0]))
        )
        system.lineTypes[f"type{k}"] = {
            "name": f"type{k}", "d_vol": part.diameter, "m": part.mass_per_length, "EA": 1.0 / part.compliance,
            "w": part.weight_in_water, "input_d": part.diameter,
        }  # fmt: skip
        system.addPoint(1 if is_last else 0, UPWARD * x)
        system.addLine(length, f"type{k}", pointA=k + 1, pointB=k + 2, cb=0.0)
    system.initialize()
    system.solveEquilibrium(tol=1e-8)
    return float(np.linalg.norm(system.pointList[-1].getForces(lines_only=True)))
