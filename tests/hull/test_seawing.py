"""The glider Seawing: its published spiral.

Verifies: the steady spiral of the shipped file against the one that Zhang et al. (2013) print, and against their
equations written out here; a dive and a climb in words.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import fsolve

import subzero
from scenarios.parameters import with_vehicle
from vehicle import derivative, euler_angles, free_run, from_mapping, initial_state

SEAWING = from_mapping(with_vehicle(subzero.load_scenario("fig6"), "seawing")[0].vehicle)
BATTERY_AT, TURNED, BALLAST = 0.4216, np.pi / 4, 0.3
"""Place of the battery [m], its turn [rad], net weight [kg]."""
COMMAND = (
    BATTERY_AT - dict(SEAWING.moving_masses)["battery"].x,
    TURNED,
    -BALLAST / SEAWING.water.density,
)
PRINTED = {"speed": 0.490, "pitch": -35.641, "roll": -13.703, "incidence": 1.267, "sideslip": -1.283}
NEAR = (np.radians(-13.7), np.radians(-35.6), 0.49, -0.011, 0.0108, 0.0039)


def spin(unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The third row of R_nb, v and ω of roll, pitch, u, v, w and a turn rate."""
    roll, pitch, u, v, w, rate = unknowns
    down = np.array([-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)])
    return down, np.array([u, v, w]), rate * down


def residual(unknowns: np.ndarray) -> np.ndarray:
    """Accelerations of the shipped vehicle in a spiral."""
    _, V, omega = spin(unknowns)
    state = initial_state(roll=unknowns[0], pitch=unknowns[1], velocity=(*V, *omega))
    out = np.empty(SEAWING.state_size)
    command = np.array([0.0, 0.0, 0.0, 0.0, *COMMAND])
    derivative(np.append(state, COMMAND), command, np.zeros(3), np.zeros(6), SEAWING.numbers(), out)
    return out[7:13]


def written_out(unknowns: np.ndarray) -> np.ndarray:
    """Rates of momentum by equations (8) to (31) of Zhang et al., with their numbers."""
    down, V, omega = spin(unknowns)
    hull, battery = 54.28, 11.0
    at_hull = np.array([-0.0814, 0.0, 0.0032])
    at = np.array([BATTERY_AT, -0.014 * np.sin(TURNED), 0.014 * np.cos(TURNED)])
    speed2 = V @ V
    alpha, beta = np.arctan2(V[2], V[0]), np.arcsin(V[1] / np.sqrt(speed2))
    force = np.array([-(7.19 + 386.29 * alpha**2), -115.65 * beta, -(-0.36 + 440.99 * alpha)])
    moment = np.array(
        [
            -58.27 * beta - 19.83 * omega[0],
            0.28 - 65.84 * alpha - 205.64 * omega[1],
            34.10 * beta - 389.30 * omega[2],
        ]
    )
    ca, sa, cb, sb = np.cos(alpha), np.sin(alpha), np.cos(beta), np.sin(beta)
    to_body = np.array([[ca * cb, -ca * sb, -sa], [sb, cb, 0.0], [sa * cb, -sa * sb, ca]]) * speed2
    P = np.array([1.48, 49.58, 65.92]) * V + (hull + battery + BALLAST) * V
    L = np.array([0.53 + 0.62, 7.88 + 25.43, 10.18 + 15.49]) * omega
    for mass, place in ((hull, at_hull), (battery, at)):
        P += mass * np.cross(omega, place)
        L += mass * np.cross(place, V + np.cross(omega, place))
    weight = 9.81 * (hull * at_hull + battery * at)
    return np.concatenate(
        [
            np.cross(P, omega) + BALLAST * 9.81 * down + to_body @ force,
            np.cross(L, omega) + np.cross(P, V) + np.cross(weight, down) + to_body @ moment,
        ]
    )


def told(unknowns: np.ndarray) -> dict[str, float]:
    speed = float(np.linalg.norm(unknowns[2:5]))
    return {
        "speed": speed,
        "pitch": np.degrees(unknowns[1]),
        "roll": np.degrees(unknowns[0]),
        "incidence": np.degrees(np.arctan2(unknowns[4], unknowns[2])),
        "sideslip": np.degrees(np.arcsin(unknowns[3] / speed)),
    }


def test_the_printed_spiral_within_a_percent():
    spiral = fsolve(residual, NEAR, xtol=1e-12)
    assert told(spiral) == pytest.approx(PRINTED, rel=0.01)
    assert spiral[5] == pytest.approx(0.0039, rel=0.01)


def test_the_equations_of_the_paper_have_the_same_spiral():
    spiral, theirs = (fsolve(equations, NEAR, xtol=1e-12) for equations in (residual, written_out))
    # 0.3 kg of ballast has inertia with them, 0.5 % of the mass; both couplings of added mass are left out there.
    np.testing.assert_allclose(spiral, theirs, rtol=2e-3)


def test_the_spiral_is_stable_and_reached_by_the_integration():
    start = np.append(initial_state(pitch=-0.5, velocity=(0.4, 0, 0, 0, 0, 0)), np.zeros(3))
    end = free_run(SEAWING, start, [0, 0, 0, 0, *COMMAND], 3000.0, 0.1).states[-1]
    roll, pitch, _ = np.degrees(euler_angles(end[3:7]))
    assert (np.linalg.norm(end[7:10]), pitch, roll) == pytest.approx(
        tuple(told(fsolve(residual, NEAR, xtol=1e-12))[name] for name in ("speed", "pitch", "roll")), rel=1e-4
    )


def test_a_dive_and_a_climb_in_words():
    level = np.append(initial_state(position=(0, 0, 50.0)), np.zeros(3))
    dive = free_run(SEAWING, level, [0, 0, 0, 0, 0.02, 0.0, -3e-4], 300.0, 0.1).states[-1]
    climb = free_run(SEAWING, level, [0, 0, 0, 0, -0.02, 0.0, 3e-4], 300.0, 0.1).states[-1]
    assert dive[2] > 100.0  # heavy: down, and ahead on its wings
    assert dive[0] > 50.0
    assert climb[2] < 0.0  # light: up, and ahead
    assert climb[0] > 50.0
    assert abs(dive[1]) < 1e-6 > abs(climb[1])  # nothing turns it
