"""Every peer beside ours, accuracy beside time: one table, all of it in one run.

    python -m benchmarks.peers                          # the table: some minutes
    python -m benchmarks.peers --json performance.json  # and all its numbers
    python -m benchmarks.peers --repeats 1 --quick      # does it run at all?

Each row is a peer with a setting, its error and its time; beside it stands the cheapest of our settings that is as
accurate, and how many times as long the peer takes. Where none of ours is as accurate, the row has our most accurate
one, marked. Errors are of the force on the vehicle, as a vector, against a run of ours with far smaller segments and
steps, to which the peers converge, too (`benchmarks.validation`); of the end of a track for hulls; of an exact
solution at rest. Times are those of the processor, medians, in ms per simulated second, behind a first run that
compiles or loads.

PythonVehicleSimulator is on no package index: install it from its repository, or leave it out. It has a hull of its
own, so its error is that of its step, and ours that of ours.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache, partial
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from time import process_time

import numpy as np
from scipy.optimize import brentq

import cable
import subzero
from benchmarks.cable import DURATION, dive
from benchmarks.peers import fsolve, lines, moordyn_wire, numpy_hull
from vehicle import free_run, initial_state


@dataclass(frozen=True, kw_only=True)
class Measured:
    """A setting, the error that it leaves [-], and what it costs: ms per simulated second, or ms of a call."""

    setting: str
    error: float
    cost: float


@dataclass(frozen=True, kw_only=True)
class Row:
    """A peer beside ours."""

    case: str
    peer: str
    theirs: Measured
    ours: Measured

    @property
    def ratio(self):
        """How many times as long the peer takes."""
        return self.theirs.cost / self.ours.cost

    @property
    def is_fair(self):
        """Whether ours is as accurate."""
        return bool(self.ours.error <= self.theirs.error)


@dataclass
class Bench:
    """How often, and how much."""

    repeats: int
    quick: bool

    def timed(self, call: Callable, seconds: float):
        """Return what a call gives, and the median of its cost. [ms per second]"""
        result, times = call(), []
        for _ in range(self.repeats):
            started = process_time()
            call()
            times.append(process_time() - started)
        return result, 1e3 * statistics.median(times) / seconds

    def some(self, settings):
        """Return the settings that are tried."""
        return settings[:1] if self.quick else settings


def beside(case, peer, theirs, ours):
    """Return the row of a peer beside the cheapest of ours that is as accurate, else the most accurate."""
    able = [one for one in ours if one.error <= theirs.error]
    best = min(able, key=lambda one: one.cost) if able else min(ours, key=lambda one: one.error)
    return Row(case=case, peer=peer, theirs=theirs, ours=best)


def apart(time, force, exact, after=1.0):
    """Return the largest error of a force behind the start and away from the dive's kinks, of the largest force."""
    there = np.stack([np.interp(time, exact.time, exact.tow_force[:, i]) for i in range(3)], axis=1)
    calm = (time > after) & (np.abs(time - 10.0) > 0.6) & (np.abs(time - 20.0) > 0.6)
    return float(np.linalg.norm(force - there, axis=1)[calm].max() / exact.tow_tension.max())


def scheme(segment, step):
    return cable.MovingEnd(time_step=step, segment_length=segment)


def named(segment, step):
    return f"segments of {segment:g} m, steps of {step:.3g} s"


def towed(bench):
    """Yield rows: 30 m of neutral cable in tow through the dive of section 4.1."""
    if not find_spec("moordyn"):
        return
    run = partial(cable.tow, dive, 30.0, DURATION, cable=moordyn_wire.NEUTRAL)
    exact, ours = run(scheme=scheme(0.05, 0.0125)), []
    for grid in (
        (3.0, 0.5),
        (1.0, 0.5),
        (1.0, 0.25),
        (0.5, 0.25),
        (0.3, 0.25),
        (0.3, 0.1),
        (0.15, 0.1),
        (0.1, 0.05),
    ):
        done, cost = bench.timed(partial(run, scheme=scheme(*grid)), DURATION)
        ours.append(Measured(setting=named(*grid), error=apart(done.time, done.tow_force, exact), cost=cost))
    for segments in bench.some((10, 30, 100)):
        done, cost = bench.timed(partial(moordyn_wire.tow, dive, 30.0, DURATION, segments), DURATION)
        error = apart(done.time, done.force, exact)
        theirs = Measured(setting=f"{segments} segments", error=error, cost=cost)
        yield beside("30 m in tow, dive", f"MoorDyn {version('moordyn')}", theirs, ours)


HELD_GRIDS = (
    (1.0, 0.25), (0.5, 0.25), (0.5, 0.1), (0.45, 0.1), (0.3, 0.1), (0.2, 0.1), (0.15, 0.05), (0.11, 0.04), (0.1, 0.025)
)  # fmt: skip


def held(bench):
    """Yield rows: a cable held at its far end, led in a circle with heave at the other."""
    if not find_spec("cabledyn"):
        return
    from benchmarks.peers import cabledyn_wire

    exact, ours = cabledyn_wire.ours(0.05, 0.0125, DURATION), []
    for grid in HELD_GRIDS:
        done, cost = bench.timed(partial(cabledyn_wire.ours, *grid, DURATION), DURATION)
        ours.append(Measured(setting=named(*grid), error=apart(done.time, done.tow_force, exact), cost=cost))
    for segments, step in bench.some(((30, 0.25), (30, 0.1), (100, 0.1), (100, 0.05))):
        led = cabledyn_wire.Led(segments, step, DURATION)
        force, cost = bench.timed(led.run, DURATION)
        theirs = Measured(
            setting=f"{segments} elements, steps of {step:g} s",
            error=apart(led.time, force, exact),
            cost=cost,
        )
        yield beside("held, circle and heave", f"CableDyn {version('cabledyn')}", theirs, ours)


def paid_out(bench):
    """Yield rows: paying out through the dive, the paper's equations in a dense solver."""

    def run(segment, step):
        return cable.pull_out(dive, DURATION, scheme=scheme(segment, step))

    exact, ours = run(0.0625, 0.0125), []

    def error(time, tension):
        calm = (time > 1.0) & (np.abs(time - 10.0) > 0.6) & (np.abs(time - 20.0) > 0.6)
        gap = np.abs(tension - np.interp(time, exact.time, exact.tow_tension))[calm]
        return float(gap.max() / exact.tow_tension.max())

    for grid in ((3.0, 1.0), (2.0, 1.0), (1.0, 1.0), (1.0, 0.5), (0.5, 0.25)):
        done, cost = bench.timed(partial(run, *grid), DURATION)
        ours.append(Measured(setting=named(*grid), error=error(done.time, done.tow_tension), cost=cost))
    for boxes in bench.some((fsolve.vectorised, fsolve.box_by_box)):
        tension, cost = bench.timed(partial(fsolve.pull_out, dive, DURATION, 1.0, boxes=boxes), DURATION)
        words = f"one node a second, {boxes.__name__.replace('_', ' ')}"
        theirs = Measured(setting=words, error=error(np.arange(1.0, tension.size + 1.0), tension), cost=cost)
        yield beside("pay-out, dive", "the paper's way: scipy.optimize.fsolve", theirs, ours)


HANGING = moordyn_wire.Bare(mass_per_length=0.02, cross_section_area=moordyn_wire.NOTHING, compliance=1e-4)
SPAN, ARC = 9.0, 10.0


def exact_catenary():
    """Return the tension at an end of a heavy, elastic cable between two ends of one height. [N]"""
    weight, e = HANGING.weight_in_water * ARC, HANGING.compliance
    across = brentq(
        lambda H: ARC * (2.0 * H / weight * np.arcsinh(0.5 * weight / H) + e * H) - SPAN, 1e-3, 1e3
    )
    return np.hypot(across, 0.5 * weight)


def at_rest(bench):
    """Yield rows: a catenary, found from nothing."""
    if not find_spec("cabledyn"):
        return
    from benchmarks.peers import cabledyn_wire

    exact, ours, far = exact_catenary(), [], (-SPAN, 0.0, 0.0)
    for segment in (2.0, 1.0, 0.5, 0.2, 0.1, 0.05):
        hang = partial(cable.hold, ((0.0, 0.0, 0.0), far), ARC, cable=HANGING, segment_length=segment)
        found, cost = bench.timed(hang, 1.0)
        error = abs(np.linalg.norm(found.tow_force) / exact - 1.0)
        ours.append(Measured(setting=f"segments of {segment:g} m", error=float(error), cost=cost))
    for segments in bench.some((10, 100)):
        tension, cost = bench.timed(partial(cabledyn_wire.rest, HANGING, ARC, far, segments), 1.0)
        theirs = Measured(setting=f"{segments} elements", error=float(abs(tension / exact - 1.0)), cost=cost)
        yield beside("catenary, ms in all", f"CableDyn {version('cabledyn')}", theirs, ours)


LINES = {"chain on a floor": lines.ON_FLOOR, "wire and chain": lines.SECTIONS}


def lines_at_rest(bench):
    """Yield rows: a chain on a hard floor, and a line of two sections, found from nothing."""
    for name, line in LINES.items():
        line = line._replace(modulus=lines.HARD if line.modulus else 0.0)
        exact, ours = lines.exact(line), []

        def measured(setting, pull, exact=exact):
            found, cost = bench.timed(pull, 1.0)
            return Measured(setting=setting, error=float(abs(found / exact - 1.0)), cost=cost)

        for segment in (2.0, 1.0, 0.9, 0.8, 0.5, 0.4, 0.2, 0.1, 0.05):
            hang = partial(lines.our_pull, line, segment)
            ours.append(measured(f"segments of {segment:g} m", hang))
        for peer, pull in (("cabledyn", lines.cabledyn_rest), ("moordyn", lines.moordyn_rest)):
            for count in bench.some((20, 80)) if find_spec(peer) else ():
                theirs = measured(f"{count} elements", partial(pull, line, lines.divided(line, count)))
                yield beside(f"{name}, at rest, ms in all", f"{NAMES[peer]} {version(peer)}", theirs, ours)
        if find_spec("moorpy"):
            theirs = measured("closed form", partial(lines.moorpy_rest, line))
            yield beside(f"{name}, at rest, ms in all", f"MoorPy {version('moorpy')}", theirs, ours)


NAMES = {"moordyn": "MoorDyn", "cabledyn": "CableDyn", "moorpy": "MoorPy"}
LINE_GRIDS = (
    (2.0, 0.2), (1.0, 0.1), (1.0, 0.05), (0.5, 0.05), (0.4, 0.025), (0.2, 0.02), (0.2, 0.01), (0.1, 0.01), (0.1, 0.007),
    (0.1, 0.005),
)  # fmt: skip


def off_by(run, exact):
    """Return the largest error of a force (time, force) after the start, of the largest force."""
    (time, force), (times, forces) = run, exact
    there = np.stack([np.interp(time, times, forces[:, i]) for i in range(3)], axis=1)
    error = np.linalg.norm(force - there, axis=1)[time > 0.5].max()
    return float(error / np.linalg.norm(forces, axis=1).max())


def led_lines(bench):
    """Yield rows: the same two lines, their first ends led round a circle, with their search for rest."""
    for name, line in LINES.items():
        exact, ours = lines.our_run(line, 0.05, 0.0025), []

        def measured(setting, run, exact=exact):
            found, cost = bench.timed(run, lines.DURATION_S)
            return Measured(setting=setting, error=off_by(found, exact), cost=cost)

        ours += [measured(named(*grid), partial(lines.our_run, line, *grid)) for grid in LINE_GRIDS]
        for count in bench.some((20, 40, 80)) if find_spec("moordyn") else ():
            theirs = measured(
                f"{count} segments", partial(lines.moordyn_run, line, lines.divided(line, count))
            )
            yield beside(f"{name}, led in a circle", f"MoorDyn {version('moordyn')}", theirs, ours)
        for count, step in (
            bench.some(((20, 0.05), (40, 0.02), (80, 0.02), (80, 0.005))) if find_spec("cabledyn") else ()
        ):
            run = partial(lines.cabledyn_run, line, lines.divided(line, count), step)
            theirs = measured(f"{count} elements, steps of {step:g} s", run)
            yield beside(f"{name}, led in a circle", f"CableDyn {version('cabledyn')}", theirs, ours)


START = initial_state(velocity=(0.5, 0.0, 0.0, 0.0, 0.0, 0.0))
COMMAND = np.array([25.0, 0.05, 0.0, 0.0])
TURN_S = 10.0


def of_track(state, exact):
    """Return the largest error of place and heading's quaternion, as a share of the way made."""
    return float(np.abs(state[:7] - exact[:7]).max() / np.linalg.norm(exact[:3] - START[:3]))


@cache
def hulls_of_ours(bench_repeats):
    """Return what our hull costs, and leaves."""
    bench, numbers = (
        Bench(bench_repeats, False),
        subzero.Model.of(subzero.load_scenario("fig6")).vehicle.numbers(),
    )
    exact, ours = free_run(numbers, START, COMMAND, TURN_S, 0.001).states[-1], []
    for step in (0.1, 0.05, 0.02, 0.01, 0.005):
        done, cost = bench.timed(partial(free_run, numbers, START, COMMAND, TURN_S, step), TURN_S)
        ours.append(Measured(setting=f"RK4, {step:g} s", error=of_track(done.states[-1], exact), cost=cost))
    return numbers, exact, ours


def hulls(bench):
    """Yield rows: the hull alone, in a turn."""
    numbers, exact, ours = hulls_of_ours(bench.repeats)
    for step in bench.some((0.1, 0.02)):
        run = partial(numpy_hull.rk4, START, COMMAND, numbers, round(TURN_S / step), step)
        states, cost = bench.timed(run, TURN_S)
        theirs = Measured(setting=f"RK4, {step:g} s", error=of_track(states[-1], exact), cost=cost)
        yield beside("our hull in a turn", f"NumPy {version('numpy')}", theirs, ours)
    for method, rtol in bench.some((("RK45", 1e-6), ("LSODA", 1e-6))):
        run = partial(numpy_hull.solved, START, COMMAND, numbers, TURN_S, method, rtol)
        state, cost = bench.timed(run, TURN_S)
        theirs = Measured(setting=f"{method}, rtol {rtol:g}", error=of_track(state, exact), cost=cost)
        yield beside("our hull in a turn", f"scipy {version('scipy')}, solve_ivp", theirs, ours)
    if find_spec("python_vehicle_simulator"):
        yield published_step(bench, ours)


def fossen(step):
    """Return η at the end of a turn of PythonVehicleSimulator's REMUS 100, by the steps of its loop. [m, rad]"""
    from python_vehicle_simulator.lib.gnc import attitudeEuler
    from python_vehicle_simulator.vehicles.remus100 import remus100

    hull, eta, u, nu = remus100("stepInput", 0, 0, 1525, 0, 0), np.zeros(6), np.zeros(3), np.zeros(6)
    nu[0] = 0.5
    for _ in range(round(TURN_S / step)):
        nu, u = hull.dynamics(eta, nu, u, np.array([0.05, 0.0, 1525.0]), step)
        eta = attitudeEuler(eta, nu, step)
    return eta


def published_step(bench, ours):
    """Return the row of PythonVehicleSimulator with the step that it publishes."""
    exact = fossen(0.001)
    eta, cost = bench.timed(partial(fossen, 0.02), TURN_S)
    error = float(np.abs(eta - exact).max() / np.linalg.norm(exact[:3]))
    theirs = Measured(setting="forward Euler, 0.02 s", error=error, cost=cost)
    return beside("its own REMUS 100 in a turn", "PythonVehicleSimulator", theirs, ours)


HEAD = ("case", "peer", "its setting", "its error", "ms/s", "ours", "error", "ms/s", "times ours")


def cells(row):
    """Return a row as it is printed."""
    a, b = row.theirs, row.ours
    mark = "" if row.is_fair else " (none of ours is as accurate)"
    return (row.case, row.peer, a.setting, f"{a.error:.1e}", f"{a.cost:.3g}", b.setting + mark, f"{b.error:.1e}",
            f"{b.cost:.3g}", f"{row.ratio:.0f}" if row.ratio >= 10.0 else f"{row.ratio:.2g}")  # fmt: skip


def machine():
    """Return what it was measured on."""
    packages = {}
    for name in ("numpy", "scipy", "numba", "moordyn", "cabledyn", "moorpy"):
        try:
            packages[name] = version(name)
        except PackageNotFoundError:
            packages[name] = "not installed"
    return {
        "python": platform.python_version(),
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0],
        **packages,
    }


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--quick", action="store_true")
    asked = parser.parse_args()
    bench, rows, about = Bench(asked.repeats, asked.quick), [], machine()
    print(f"{about['cores']} cores, load {about['load']:.1f} before this began, medians of {asked.repeats}\n")
    print(f"| {' | '.join(HEAD)} |\n" + "|---" * len(HEAD) + "|")
    for case in (towed, held, paid_out, at_rest, lines_at_rest, led_lines, hulls):
        for row in case(bench):
            rows.append(row)
            print(f"| {' | '.join(cells(row))} |", flush=True)
    for name, (package, how) in NEEDED.items():
        if not find_spec(package):
            print(f"\n{name} is left out: it is not installed ({how}).")
    if asked.json:
        table = [asdict(row) | {"ratio": row.ratio, "ours_is_as_accurate": row.is_fair} for row in rows]
        asked.json.write_text(
            json.dumps({"machine": about, "repeats": asked.repeats, "rows": table}, indent=1) + "\n"
        )


NEEDED = {
    "MoorDyn": ("moordyn", "pip install 'subzero-auv[peers]'"),
    "CableDyn": ("cabledyn", "pip install 'subzero-auv[peers]'"),
    "MoorPy": ("moorpy", "pip install 'subzero-auv[peers]'"),
    "PythonVehicleSimulator": ("python_vehicle_simulator", "from its repository"),
}

if __name__ == "__main__":
    main()
