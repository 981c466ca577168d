"""A buoyant body on a tether whose lower end is led away, then stopped: ours and MoorDyn, both coupled.

`python -m benchmarks.coupled_body` prints the largest differences of its path and of the tension at it. The body is a
free point in MoorDyn, with mass, volume, drag and added mass alike in all directions; ours is an open frame with the
same by its table of derivatives (X_Uu = Y_Uv = Z_Uw), a hull that is coupled to its cable in the usual way. Led away in
still water is moored in a current, by the principle of relativity. Neither line has added mass, as in
`peers.moordyn_wire`.

`pip install 'subzero-auv[peers]'` brings MoorDyn.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

import subzero
from benchmarks.peers.moordyn_wire import DAMPING, EXCHANGE, SAFETY, UPWARD, silence

DEEP, DEPTH, GRAVITY, DENSITY = 1000.0, 40.0, 9.81, 1025.0
"""Depth of the water and of the body at first [m]; g [m/s²]; ρ [kg/m³]."""
DURATION_S = 50.0
LED_S, LED_M_S = (0.0, 4.0, 24.0, 28.0), (0.0, 0.6, 0.6, 0.0)
"""Velocity of the lower end to the north, linear between the times. [s], [m/s]"""
PLANES = ("stern_plane_port_deg", "stern_plane_starboard_deg")
SECONDS = np.linspace(1.0, DURATION_S, 491)
"""Times of the comparison, every 0.1 s."""


class Body(NamedTuple):
    """A buoyant body [kg, N, m², 1] on a tether [m, m, kg/m, N, 1]."""

    mass: float = 12.0
    buoyancy: float = 30.0
    drag_area: float = 0.12
    added_mass: float = 0.5
    length: float = 20.0
    diameter: float = 0.0075
    mass_per_length: float = 0.06
    stiffness: float = 5000.0
    drag_coefficient: float = 1.2

    @property
    def volume(self) -> float:
        """Of the body. [m³]"""
        return (self.mass + self.buoyancy / GRAVITY) / DENSITY

    @property
    def weight(self) -> float:
        """Of the tether in water. [N/m]"""
        return (self.mass_per_length - DENSITY * 0.25 * np.pi * self.diameter**2) * GRAVITY

    @property
    def stretched(self) -> float:
        """Length of the tether at rest, upright. [m]"""
        return self.length * (1.0 + (self.buoyancy - 0.5 * self.weight * self.length) / self.stiffness)


class Run(NamedTuple):
    """Place of the body, north and down from its start (n, 2) [m], and the tension at it (n,) [N], at `SECONDS`."""

    place: np.ndarray
    tension: np.ndarray


def vehicle_text(body: Body) -> str:
    """Return our vehicle file."""
    added, drag = -body.added_mass * DENSITY * body.volume, -0.5 * DENSITY * body.drag_area
    rows = [
        "\n".join(
            [
                f'{force}_{speed}dot = {{ value = {added}, unit = "kg" }}',
                f'{force}_U{speed} = {{ value = {drag}, unit = "kg/m" }}',
            ]
        )
        for force, speed in ("Xu", "Yv", "Zw")
    ]
    place = "\n".join(f'{axis} = {{ value = 0.0, unit = "m" }}' for axis in "xyz")
    return "\n".join(
        [
            'base = "open_frame"', "[rigid_body]", f'mass = {{ value = {body.mass}, unit = "kg" }}', "[buoyancy]",
            f'net_buoyancy = {{ value = {body.buoyancy}, unit = "N" }}', "[tow_point]", place,
            "[derivatives]", *rows, "",
        ]
    )  # fmt: skip


def trial_text(body: Body, segment: float) -> str:
    """Return our trial file."""
    cable = {
        "added_mass_coefficient": 0.0, "mass_per_length": body.mass_per_length, "diameter": body.diameter,
        "cross_section_area": 0.25 * np.pi * body.diameter**2, "compliance": 1.0 / body.stiffness,
        "normal_drag_coefficient": body.drag_coefficient, "water_density": DENSITY, "strength": 1e4,
    }  # fmt: skip
    return "\n".join(
        [
            'description = "a buoyant body on a tether"', 'vehicle = "body.toml"', 'cable = "rov_tether"',
            "[run]", f"duration_s = {DURATION_S}", "hull_step_s = 0.01", "cable_step_s = 0.05",
            f"segment_length_m = {segment}", "rtol = 0.0",
            "[start]", f"depth_m = {DEPTH}", f"wet_length_m = {body.length}", f"drum_down_m = {body.stretched}",
            "[winch]", 'control = "brake"',
            "[vessel]", f"time_s = {list(LED_S)}", f"velocity_north_m_s = {list(LED_M_S)}",
            "[commands]", "time_s = [0.0]",
            *[f"{name} = [0.0]" for name in ("propeller_rps", "rudder_deg", *PLANES)],
            "[changes]", *[f'"cable.{key}" = {float(value)}' for key, value in cable.items()], "",
        ]
    )  # fmt: skip


def our_run(body: Body, segment: float = 0.25) -> Run:
    """Return our body's run, with segments of a length [m]."""
    with TemporaryDirectory() as folder:
        Path(folder, "body.toml").write_text(vehicle_text(body))
        Path(folder, "trial.toml").write_text(trial_text(body, segment))
        run = subzero.simulate(Path(folder, "trial.toml"))
    columns = [np.interp(SECONDS, run["time"], run[name]) for name in ("north", "depth", "cable_tension")]
    return Run(np.column_stack([columns[0], columns[1] - DEPTH]), columns[2])


def moordyn_text(body: Body, count: int) -> str:
    """Return MoorDyn's input file, with so many segments."""
    step = SAFETY * body.length / count * np.sqrt(body.mass_per_length / body.stiffness)
    low, high = -DEPTH - body.stretched, -DEPTH
    return "\n".join(
        [
            "--- LINE TYPES ---", "TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx", "-",
            f"tether {body.diameter} {body.mass_per_length} {body.stiffness} {-DAMPING} 0.0 "
            f"{body.drag_coefficient} 0.0 0.01 0.0",
            "--- POINTS ---", "ID Attachment X Y Z Mass Volume CdA Ca", "-",
            f"1 Coupled 0 0 {low} 0 0 0 0",
            f"2 Free 0 0 {high} {body.mass} {body.volume} {body.drag_area} {body.added_mass}",
            "--- LINES ---", "ID LineType AttachA AttachB UnstrLen NumSegs LineOutputs", "-",
            f"1 tether 1 2 {body.length} {count} -",
            "--- OPTIONS ---", f"{step} dtM", "rk2 tScheme", "0 writeLog", f"{GRAVITY} g", f"{DENSITY} WtrDnsty",
            f"{DEEP} WtrDpth", "1 ICgenDynamic", "0.5 dtIC", "60 TmaxIC", "1e-6 threshIC", "1 disableOutput",
            "1 disableOutTime", "--- END ---", "",
        ]
    )  # fmt: skip


def led(t: float) -> tuple[float, float]:
    """Return place and velocity of the lower end, to the north. [m], [m/s]"""
    fine = np.append(np.array(LED_S)[np.array(LED_S) < t], t)
    speeds = np.interp(fine, LED_S, LED_M_S)
    return float(np.trapezoid(speeds, fine)), float(speeds[-1])


def moordyn_run(body: Body, count: int = 80) -> Run:
    """Return MoorDyn's run, with so many segments."""
    import moordyn

    rows = []
    with TemporaryDirectory() as folder, silence():
        file = Path(folder, "body.txt")
        file.write_text(moordyn_text(body, count))
        system, first = moordyn.Create(str(file)), np.array([0.0, 0.0, -DEPTH - body.stretched])
        moordyn.Init(system, list(first), [0.0, 0.0, 0.0])
        point, line = moordyn.GetPoint(system, 2), moordyn.GetLine(system, 1)
        for k in range(round(DURATION_S / EXCHANGE)):
            here, there = (led(n * EXCHANGE)[0] for n in (k, k + 1))
            place, velocity = first + np.array([here, 0.0, 0.0]), [(there - here) / EXCHANGE, 0.0, 0.0]
            moordyn.Step(system, list(place), velocity, k * EXCHANGE, EXCHANGE)
            rows.append([*(UPWARD * moordyn.GetPointPos(point)), moordyn.GetLineFairTen(line)])
        moordyn.Close(system)
    time, found = EXCHANGE * np.arange(1, len(rows) + 1), np.array(rows)
    columns = [np.interp(SECONDS, time, found[:, i]) for i in (0, 2, 3)]
    return Run(np.column_stack([columns[0], columns[1] - DEPTH]), columns[2])


def differences(ours: Run, theirs: Run) -> dict[str, float]:
    """Return the largest differences as shares: of the path, of the depth gone through, and of the tension. [-]"""
    led_by = np.array([led(t)[0] for t in SECONDS])
    lag = [led_by - run.place[:, 0] for run in (ours, theirs)]
    pairs = {
        "north, behind the lower end": lag,
        "depth": [run.place[:, 1] for run in (ours, theirs)],
        "tension at the body": [run.tension for run in (ours, theirs)],
    }
    return {
        name: float(np.abs(one - other).max() / np.abs(other).max()) for name, (one, other) in pairs.items()
    }


def main() -> None:
    """Print the differences, and how far each code is from itself with twice the segments."""
    body = Body()
    ours, theirs = our_run(body), moordyn_run(body)
    print(
        f"behind by up to {np.abs(led(DURATION_S)[0] - theirs.place[:, 0]).max():.2f} m, deeper by up to",
        end=" ",
    )
    print(
        f"{theirs.place[:, 1].max():.2f} m, tension {theirs.tension.min():.1f} to {theirs.tension.max():.1f} N"
    )
    for title, one, other in (
        ("ours and MoorDyn", ours, theirs),
        ("ours, segments of 0.25 and 0.5 m", ours, our_run(body, 0.5)),
        ("MoorDyn, 80 and 40 segments", theirs, moordyn_run(body, 40)),
    ):
        found = differences(one, other)
        print(f"{title}: " + ", ".join(f"{name} {100.0 * share:.2f} %" for name, share in found.items()))


if __name__ == "__main__":
    main()
