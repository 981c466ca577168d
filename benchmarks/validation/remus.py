"""The hull of another vehicle: REMUS 100 from its published table against Fossen's `remus100`, in one manoeuvre.

From rest with 1525 rpm, rudder 5° and stern-planes 5° nose up, planes central after 50 s. Our vehicle is the file
`scenarios/vehicles/remus100.toml`, Prestero's adjusted set (2001); the other simulator's class of the same name keeps
the shape and takes every force from elsewhere. So both differ, by up to six times in the turn, and each difference has
a name: the rows put the other's numbers into our table of terms, one term after another. Drag alone explains the
speed: bare hull C_D 0.11 here, towed 0.42 there. The turn is nearly all Munk moment: full here, where the adjusted
N_rr alone (ten times its strip integral) holds it, and absent there, with a yaw damping of one second instead. With
all terms exchanged nothing is left beyond 5 % of the steady value. (The other's fins feel no incidence and its strips
are 21 of L/20; both are put in as numbers. Its reaction torque is divided by ten and rolls to starboard.)

What changes quickly shows one more: the other's strips feel sway and yaw only, v + x r, ours the whole flow across,
heave and pitch with it. So the nose falls faster there when the planes go central, and rises faster at the start. No
parameter takes that from our term; a moment and a force against it, at every step, do, and with them the pitch rate is
the other's all the way. The gate of 2 % of its largest is well below the third that the missing term makes, and above
what the other remaining differences (5 % in the yaw rate) do to pitch, which they reach in second order only.
"""

from __future__ import annotations

import csv
import math
import tomllib
from pathlib import Path

import numpy as np

import vehicle
from vehicle.cross_flow import cross_flow_drag

from .row import Row, Setting

ROOT = Path(__file__).parents[2]
FILE = ROOT / "scenarios" / "vehicles" / "remus100.toml"
RECORD = ROOT / "tests" / "data" / "pvs_remus100" / "step.csv"
SOURCE = "PythonVehicleSimulator c717e07, dt 0.0005 s"

RHO, HALF, RADIUS = 1026.0, 0.8, 0.095
MASS = 4.0 / 3.0 * math.pi * RHO * HALF * RADIUS**2
INERTIA, ROLL_INERTIA = 0.2 * MASS * (HALF**2 + RADIUS**2), 0.4 * MASS * RADIUS**2
LAMB = vehicle.geometry.lamb_factors(HALF / RADIUS)
RIGHTING = MASS * 9.81 * 0.02
M44, M55 = 1.3 * ROLL_INERTIA + MASS * 4e-4, (1.0 + LAMB.k_prime) * INERTIA + MASS * 4e-4
WING = 0.7 * 1.6 * 0.19
"""Lifting area of the other's hull. [m2]"""
WING_ASPECT = 0.19**2 / WING
WING_SLOPE = math.pi * WING_ASPECT / (1.0 + math.sqrt(1.0 + (WING_ASPECT / 2.0) ** 2))

PEER: dict[str, dict[str, float]] = {
    "axial_drag": {"axial_drag.drag_coefficient": 0.42, "hull.diameter": 0.19, "water.density": RHO},
    "restoring": {"buoyancy.net_buoyancy": 0.0, "rigid_body.centre_of_gravity_z": 0.02},
    "rudder": {"rudder.lift_slope": 0.5, "rudder.station": -HALF},
    "stern_planes": {"stern_planes.lift_slope": 0.7, "stern_planes.station": -HALF},
    "munk_correction": {"added_mass.munk_factor": 0.0},
    "masses": {
        "rigid_body.mass": MASS,
        "rigid_body.roll_inertia": ROLL_INERTIA,
        "rigid_body.pitch_inertia": INERTIA,
        "rigid_body.yaw_inertia": INERTIA,
        "added_mass.surge": LAMB.k1 * MASS,
        "added_mass.sway": LAMB.k2 * MASS,
        "added_mass.heave": LAMB.k2 * MASS,
        "added_mass.roll": 0.3 * ROLL_INERTIA,
        "added_mass.pitch": LAMB.k_prime * INERTIA,
        "added_mass.yaw": LAMB.k_prime * INERTIA,
        "added_mass.sway_yaw": 0.0,
        "added_mass.heave_pitch": 0.0,
    },
    "body_lift": {
        "body_lift.sway_per_sway": 0.0,
        "body_lift.yaw_per_sway": 0.0,
        "body_lift.pitch_per_heave": 0.0,
        "body_lift.heave_per_heave": -0.5 * RHO * WING * WING_SLOPE,
    },
    "damping": {
        **{
            f"quadratic_damping.{name}": 0.0
            for name in (
                "sway_per_sway", "sway_per_yaw", "yaw_per_sway", "yaw_per_yaw", "heave_per_heave",
                "heave_per_pitch", "pitch_per_heave", "pitch_per_pitch", "roll_per_roll",
            )
        },
        "linear_damping.heave": -(1.0 + LAMB.k2) * MASS / 20.0,
        "linear_damping.roll": -0.6 * math.sqrt(RIGHTING * M44),
        "linear_damping.pitch": -1.6 * math.sqrt(RIGHTING * M55),
        "linear_damping.yaw": -(1.0 + LAMB.k_prime) * INERTIA,
        "cross_flow_drag.drag_coefficient": 1.2 * 21.0 / 20.0,
        "hull.length": 2.0 * HALF,
        "hull.nose_station": HALF,
        "hull.nose_length": 1e-3,
        "hull.tail_length": 1e-3,
    },
    "propeller": {"propeller.reaction_torque_factor": -0.1},
}  # fmt: skip
"""The other's numbers in our table of terms, in the order in which they are put in."""


def ours() -> vehicle.Vehicle:
    """Return the vehicle of our file."""
    sections = tomllib.loads(FILE.read_text(encoding="utf-8"))
    return vehicle.from_mapping(
        {name: {key: leaf["value"] for key, leaf in leaves.items()} for name, leaves in sections.items()}
    )


def without_incidence(hull: vehicle.Vehicle) -> vehicle.VehicleNumbers:
    """Return the hull's numbers with its fins' lift by incidence (not by deflection) taken out again."""
    numbers = hull.numbers()
    for first, fins in ((0, hull.rudder), (4, hull.stern_planes)):
        slope, x = RHO * fins.area * fins.lift_slope, fins.station
        turn = x if first == 0 else -x
        for k, value in enumerate((slope, turn * slope, turn * slope, x * x * slope)):
            numbers.body_lift[first + k] += value
    return numbers


STEP = 0.02
"""Of the manoeuvre. [s]"""
SECOND = round(1.0 / STEP)
"""Steps between two rows of the record."""
CENTRAL = 50
"""When the planes go central. [s]"""
UPSTANDING = (2, 4)
"""Heave and pitch rate among the velocities."""


def commands() -> np.ndarray:
    """Return the manoeuvre's commands, one a step (n, 4): shaft [rev/s], rudder and planes [rad]."""
    time = STEP * np.arange(60 * SECOND)
    planes = np.where(time < CENTRAL, np.radians(5.0), 0.0)
    rudder = np.full_like(time, np.radians(5.0))
    return np.column_stack([np.full_like(time, 1525.0 / 60.0), rudder, planes, planes])


def flown(hull: vehicle.Vehicle | vehicle.VehicleNumbers) -> np.ndarray:
    """Return the states of the manoeuvre (n+1, state)."""
    return vehicle.free_run(hull, vehicle.initial_state(), commands(), 60.0, STEP).states


def vertical_cross_flow(nu: np.ndarray, numbers: vehicle.VehicleNumbers) -> np.ndarray:
    """Return what heave and pitch rate add to the cross-flow drag of the strips (6,). [N, N m]."""
    level, whole, sideways = np.array(nu), np.zeros(6), np.zeros(6)
    level[list(UPSTANDING)] = 0.0
    cross_flow_drag(np.array(nu), numbers.strips, whole)
    cross_flow_drag(level, numbers.strips, sideways)
    return whole - sideways


def flown_without_vertical_cross_flow(numbers: vehicle.VehicleNumbers) -> np.ndarray:
    """Return the states (n+1, state) of the manoeuvre with that part taken out, held over each step."""
    states = [vehicle.initial_state()]
    for command in commands():
        against = -vertical_cross_flow(states[-1][7:13], numbers)
        states.append(
            vehicle.free_run(numbers, states[-1], command, STEP, STEP, wrench_b=tuple(against)).states[-1]
        )
    return np.array(states)


def steady(states: np.ndarray) -> dict[str, float]:
    """Return the steady values before the planes go central, and at 60 s, SI and radians."""
    roll, _, _ = vehicle.euler_angles(states[-1, 3:7])
    _, climb, _ = vehicle.euler_angles(states[CENTRAL * SECOND - 1, 3:7])
    u, v, r = states[-1, [7, 8, 12]]
    return {"surge speed": u, "yaw rate": r, "sway speed": v, "roll": roll, "pitch with planes": climb}


def manoeuvre(hull: vehicle.Vehicle | vehicle.VehicleNumbers) -> dict[str, float]:
    """Run the manoeuvre and return its steady values."""
    return steady(flown(hull))


def record() -> list[dict[str, float]]:
    """Return the other simulator's record, one row a second."""
    with RECORD.open(encoding="utf-8") as file:
        return [{key: float(cell) for key, cell in row.items()} for row in csv.DictReader(file)]


def reference() -> dict[str, float]:
    """Return the same of the other simulator's record."""
    end, climb = record()[60], record()[CENTRAL]
    return {
        "surge speed": end["u_m_s"],
        "yaw rate": end["r_rad_s"],
        "sway speed": end["v_m_s"],
        "roll": end["phi_rad"],
        "pitch with planes": climb["theta_rad"],
    }


UNITS = {
    "surge speed": "m/s",
    "yaw rate": "rad/s",
    "sway speed": "m/s",
    "roll": "rad",
    "pitch with planes": "rad",
}


def compared(name: str, found: dict[str, float], gates: dict[str, float]) -> list[Row]:
    """Compare some steady values with the other's; without a verdict where there is no gate."""
    wanted = reference()
    return [
        Setting(name, SOURCE, gate, UNITS[what]).row(found[what], wanted[what], what=what)
        for what, gate in gates.items()
    ]


def pitching(name: str, states: np.ndarray, gate: float) -> list[Row]:
    """Compare the pitch rate a second after the planes went central, and where it differs most from the record."""
    wanted, ours = np.array([row["q_rad_s"] for row in record()]), states[::SECOND, 11]
    setting, k = Setting(name, SOURCE, gate, "rad/s"), CENTRAL + 1
    return [
        setting.row(float(ours[k]), float(wanted[k]), what="pitch rate 1 s after the planes are central"),
        setting.worst(ours, wanted, float(np.abs(wanted).max()), "pitch rate of 60 s, of its largest"),
    ]


def rows(quick: bool) -> list[Row]:
    """Compare the published hull, then with the other's terms put in one after another."""
    shown = dict.fromkeys(("surge speed", "yaw rate"), np.inf)
    hull = ours()
    found = compared("Prestero's table", manoeuvre(hull), dict.fromkeys(UNITS, np.inf))
    for term, changes in PEER.items():
        for key, value in changes.items():
            hull = hull.with_parameter(key, value)
        if not quick or term == "munk_correction":
            found += compared(f"+ its {term}", manoeuvre(hull), shown)
    last = without_incidence(hull)
    name, states = "+ its fins without incidence: all terms", flown(last)
    found += compared(name, steady(states), dict.fromkeys(UNITS, 0.05)) + pitching(name, states, np.inf)
    name, states = "+ no cross-flow in the vertical plane", flown_without_vertical_cross_flow(last)
    return found + compared(name, steady(states), {"pitch with planes": 0.02}) + pitching(name, states, 0.02)
