"""The hull of Subzero II from its file, and a second, independent writing of its equations of motion."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

import vehicle

FILE = Path(__file__).parents[2] / "scenarios" / "vehicles" / "subzero2.toml"


@pytest.fixture(scope="session")
def entries():
    """Every entry of the vehicle's file: section → key → value, unit, range, source."""
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def mapping(entries):
    """The plain values of the file."""
    return {
        section: {key: entry["value"] for key, entry in keys.items()} for section, keys in entries.items()
    }


@pytest.fixture(scope="session")
def subzero2(mapping):
    return vehicle.from_mapping(mapping)


@pytest.fixture(scope="session")
def rate():
    """Return the rate of a state as a new array, from a vehicle or its numbers."""

    def call(hull, state, command=(0.0,) * 4, current=(0.0,) * 3, wrench=(0.0,) * 6):
        numbers = hull.numbers() if isinstance(hull, vehicle.Vehicle) else hull
        out = np.empty(vehicle.STATE_SIZE)
        vehicle.derivative(
            np.array(state, dtype=float), np.array(command, dtype=float), np.array(current, dtype=float),
            np.array(wrench, dtype=float), numbers, out,
        )  # fmt: skip
        return out

    return call


def cross(a):
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def textbook_coriolis(M, nu):
    """C(ν) of Fossen (2021), eq. 3.46, from the blocks of M."""
    C = np.zeros((6, 6))
    linear, angular = M[:3] @ nu, M[3:] @ nu
    C[:3, 3:] = C[3:, :3] = -cross(linear)
    C[3:, 3:] = -cross(angular)
    return C


def textbook_fin(values, place, normal, angle, nu_r, density):
    """Wrench of a fin by vectors in three dimensions: turn the chord, find the incidence, add forces."""
    forward, normal = np.array([1.0, 0.0, 0.0]), np.asarray(normal, dtype=float)
    velocity = nu_r[:3] + np.cross(nu_r[3:], place)
    flow = velocity @ forward * forward + velocity @ normal * normal
    speed = np.linalg.norm(flow)
    if speed == 0.0:
        return np.zeros(6)
    chord_angle = np.arctan2(velocity @ normal, velocity @ forward)
    alpha = angle - chord_angle
    sin, cos = np.sin(alpha), np.cos(alpha)
    attached = 1.0 / (1.0 + (sin / np.sin(values["stall_angle"])) ** 8)
    potential = values["lift_slope"] * sin * cos
    induced = potential**2 / (np.pi * values["span_efficiency"] * values["aspect_ratio"])
    plate = (1.0 - attached) * values["normal_force_coefficient"] * sin
    CL = attached * potential + plate * cos
    CD = values["profile_drag_coefficient"] + attached * induced + plate * sin
    along = flow / speed
    across = -(along @ normal) * forward + (along @ forward) * normal
    force = 0.5 * density * values["area"] * speed**2 * (CL * across - CD * along)
    return np.concatenate([force, np.cross(place, force)])


@pytest.fixture(scope="session")
def textbook(mapping):
    """Return the independent forces: (nu_r, down, n, (rudder, port, starboard)) → (their sum (6,), M (6, 6)).

    `down` is the unit vector of gravity in body axes. Written with numpy vectors and matrices from the
    mapping alone, sharing nothing with the package but the values.
    """
    m = mapping
    density = m["water"]["density"]
    body, added, D = m["rigid_body"], m["added_mass"], m["hull"]["diameter"]
    r_G = np.array([body[f"centre_of_gravity_{axis}"] for axis in "xyz"])
    r_B = np.array([m["buoyancy"][f"centre_of_buoyancy_{axis}"] for axis in "xyz"])
    H = np.eye(6)
    H[:3, 3:] = cross(r_G).T
    about_G = np.diag([body["mass"]] * 3 + [body[f"{axis}_inertia"] for axis in ("roll", "pitch", "yaw")])
    M_RB = H.T @ about_G @ H
    M_A = np.diag([added[name] for name in ("surge", "sway", "heave", "roll", "pitch", "yaw")])
    M_A[1, 5] = M_A[5, 1] = added["sway_yaw"]
    M_A[2, 4] = M_A[4, 2] = added["heave_pitch"]

    def hull_forces(nu):
        u, v, w, p, q, r = nu
        L = m["body_lift"]
        lift = [
            0.0,
            L["sway_per_sway"] * abs(u) * v + L["sway_per_yaw"] * u * r,
            L["heave_per_heave"] * abs(u) * w + L["heave_per_pitch"] * u * q,
            m["quadratic_damping"]["roll_per_roll"] * p * abs(p),
            L["pitch_per_heave"] * u * w + L["pitch_per_pitch"] * abs(u) * q,
            L["yaw_per_sway"] * u * v + L["yaw_per_yaw"] * abs(u) * r,
        ]
        total = np.array(lift)
        total[0] -= 0.5 * density * np.pi * D**2 / 4.0 * m["axial_drag"]["drag_coefficient"] * u * abs(u)
        x = 0.5 - (np.arange(1000) + 0.5) / 1000
        nose, tail = m["hull"]["nose_length"], m["hull"]["tail_length"]
        tan = np.tan(m["hull"]["tail_angle"])
        aft = 0.5 - x
        s = np.clip(aft - (1.0 - tail), 0.0, None)
        radius = D / 2 - (1.5 * D / tail**2 - tan / tail) * s**2 + (D / tail**3 - tan / tail**2) * s**3
        bow = aft < nose
        radius[bow] = D / 2 * np.sqrt(1.0 - ((aft[bow] - nose) / nose) ** 2)
        x = np.average(x.reshape(20, 50), axis=1, weights=radius.reshape(20, 50))
        radius = radius.reshape(20, 50).mean(axis=1)
        flow = np.column_stack([np.zeros(20), v + x * r, w - x * q])
        size = np.linalg.norm(flow, axis=1, keepdims=True)
        drag = (
            -0.5 * density * m["cross_flow_drag"]["drag_coefficient"] * 2 * radius[:, None] / 20 * size * flow
        )
        arms = np.column_stack([x, np.zeros(20), np.zeros(20)])
        return total + np.concatenate([drag.sum(axis=0), np.cross(arms, drag).sum(axis=0)])

    def propeller_forces(nu, n):
        P = m["propeller"]
        d, advance = P["diameter"], (1.0 - P["wake_fraction"]) * nu[0]
        J = advance / (n * d)
        KT = P["thrust_constant"] - P["thrust_slope"] * J - P["thrust_curvature"] * J**2
        KQ = P["torque_constant"] - P["torque_slope"] * J - P["torque_curvature"] * J**2
        thrust = (1.0 - P["thrust_deduction"]) * density * n**2 * d**4 * KT
        return np.array([thrust, 0, 0, -P["reaction_torque_factor"] * density * n**2 * d**5 * KQ, 0, 0])

    def forces(nu, down, n, angles):
        nu = np.asarray(nu, dtype=float)
        weight = body["mass"] * m["water"]["gravity"]
        buoyancy = weight + m["buoyancy"]["net_buoyancy"]
        pull, lift = weight * np.asarray(down), -buoyancy * np.asarray(down)
        total = np.concatenate([pull + lift, np.cross(r_G, pull) + np.cross(r_B, lift)])
        total -= (textbook_coriolis(M_RB, nu) + textbook_coriolis(M_A, nu)) @ nu
        total += hull_forces(nu) + propeller_forces(nu, n)
        x, arm = m["rudder"]["station"], m["rudder"]["arm"]
        for side in (-1.0, 1.0):
            place = np.array([x, 0.0, side * arm])
            total += textbook_fin(m["rudder"], place, (0, 1, 0), -angles[0], nu, density)
            place = np.array([x, side * arm, 0.0])
            angle = angles[1] if side < 0 else angles[2]
            total += textbook_fin(m["stern_planes"], place, (0, 0, 1), angle, nu, density)
        return total, M_RB + M_A

    return forces
