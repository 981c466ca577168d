"""NPS AUV II as a file against its published equations of motion, integrated beside it.

Card: coefficients and equations of Healey and Lienard, IEEE J. Oceanic Eng. 18 (1993) 327, as MSS `npsauv.m` lists
them, in plain numpy with Euler angles; no number is read from our file. Signs of rudder and stern-planes are turned
at the border. Commands: straight run, steps of rudder, stern-planes and bow planes, and all together in a current.
Tolerance 1e-6 of the largest value; found 5e-11: both take Runge-Kutta steps of 0.02 s, of quaternions and of angles.

Departs from npsauv.m: the forces of a rigid body in heave, m(uq − vp + …), and in pitch, (Iz − Ix) p r, have there the
other sign (they would do work: the first test), and the pitch moment of its cross flow is not that of its force,
w + xq for w − xq. Strips are 20 midpoints over the length, not 11 stations over 1.1 lengths.
"""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.files import read_toml, shipped_path
from scenarios.parts import nested, part_of
from vehicle import euler_angles, free_run, from_mapping, initial_state

AGREE = 1e-6
STEP = 0.02
L, RHO, G, WEIGHT = 5.3, 1025.0, 9.81, 53400.0
MASS, ZG = WEIGHT / G, 0.061
r2, r3, r4, r5 = (0.5 * RHO * L**power for power in (2, 3, 4, 5))
INERTIA = np.array([[2038, 13.58, 13.58], [13.58, 13587, 13.58], [13.58, 13.58, 13587]])


def mass_matrix():
    """M_RB about the origin, and M_A."""
    S = ZG * np.array([[0, -1, 0], [1, 0, 0], [0, 0, 0]])
    M_RB = np.block([[MASS * np.eye(3), -MASS * S], [MASS * S, INERTIA]])
    A = np.zeros((6, 6))
    A[0, 0], A[1, 1], A[2, 2], A[3, 3], A[4, 4], A[5, 5] = 7.6e-3, 5.5e-2, 2.4e-1, 1.0e-3, 1.7e-2, 3.4e-3
    A[1, 3] = A[3, 1] = -1.2e-4
    A[1, 5] = A[5, 1] = -1.2e-3
    A[2, 4] = A[4, 2] = 6.8e-3
    A[3, 5] = A[5, 3] = 3.4e-5
    lengths = np.diag([1, 1, 1, L, L, L])
    return M_RB, r3 * lengths @ A @ lengths


def rigid_body(nu):
    """−C_RB ν: what momentum and angular momentum about the origin say."""
    v, omega, arm = nu[:3], nu[3:], np.array([0, 0, ZG])
    P = MASS * (v + np.cross(omega, arm))
    return -np.concatenate(
        [np.cross(omega, P), np.cross(v, P) + np.cross(omega, MASS * np.cross(arm, v) + INERTIA @ omega)]
    )


def hull(nu):
    """The products of velocities."""
    u, v, w, p, q, r = nu
    X = r2 * (5.3e-2 * v**2 + 1.7e-1 * w**2) + r3 * (2.0e-2 * v * r - 2.0e-1 * w * q - 3.0e-3 * v * p)
    X += r4 * (-1.5e-2 * q**2 + 4.0e-3 * r**2 + 7.5e-4 * p * r + 7.0e-3 * p**2)
    Y = r2 * (-1.0e-1 * u * v + 6.8e-2 * v * w)
    Y += r3 * (3.0e-3 * u * p + 3.0e-2 * u * r + 2.4e-2 * v * q + 2.3e-1 * w * p - 1.9e-2 * w * r)
    Y += r4 * (4.0e-3 * p * q - 6.5e-3 * q * r)
    Z = r2 * (-3.0e-1 * w * u - 6.8e-2 * v**2) + r3 * (-1.4e-1 * u * q - 4.8e-2 * v * p + 4.5e-2 * v * r)
    Z += r4 * (1.3e-4 * p**2 + 6.7e-3 * p * r - 7.4e-3 * r**2)
    K = r3 * (3.1e-3 * u * v - 1.9e-1 * v * w) + r5 * (-6.9e-5 * p * q + 1.7e-2 * q * r)
    K += r4 * (-1.1e-2 * u * p - 8.4e-4 * u * r - 5.1e-3 * v * q - 1.3e-4 * w * p + 1.4e-2 * w * r)
    M = r3 * (1.0e-1 * u * w - 2.6e-2 * v**2) + r4 * (-6.8e-2 * u * q + 1.2e-3 * v * p + 1.7e-2 * v * r)
    M += r5 * (5.3e-5 * p**2 + 5.0e-3 * p * r + 2.9e-3 * r**2)
    N = r3 * (-7.4e-3 * u * v - 2.7e-2 * v * w) + r5 * (-2.1e-2 * p * q + 2.7e-3 * q * r)
    N += r4 * (-8.4e-4 * u * p - 1.6e-2 * u * r - 1.0e-2 * v * q - 1.7e-2 * w * p + 7.4e-3 * w * r)
    return np.array([X, Y, Z, K, M, N])


def controls(nu, n, dr, ds, bow):
    """Propeller, its race, rudder, stern-planes and the sum of the bow planes; n in rad/s, signs as published."""
    u, v, w, p, q, _ = nu
    eta = 0.012 * n / u
    race = -1 + (np.sqrt(1 + 0.004 * L**2 * eta * abs(eta)) - 1) / (np.sqrt(1 + 0.004 * L**2) - 1)
    X = r2 * u**2 * 0.00385 * (eta * abs(eta) - 1)
    X += r3 * u * q * (2.5e-2 * ds - 1.3e-3 * bow + 2.0e-3 * ds * race) - r3 * 1.0e-3 * u * nu[5] * dr
    X += r2 * (1.7e-3 * u * v * dr + u * w * (4.6e-2 * ds + 5.0e-3 * bow + 3.5e-3 * ds * race))
    X -= r2 * u**2 * (1.0e-2 * ds**2 + 1.0e-2 * dr**2 + 1.6e-3 * ds**2 * race)
    Z = (
        r2 * u**2 * (-7.3e-2 * ds - 1.3e-2 * bow - 1.0e-2 * ds * race)
        - (r3 * 2.9e-3 * q + r2 * 5.1e-3 * w) * u * race
    )
    M = (
        r3 * u**2 * (-4.1e-2 * ds + 3.5e-3 * bow - 5.2e-3 * ds * race)
        - (r4 * 1.6e-3 * q + r3 * 2.9e-3 * w) * u * race
    )
    return np.array([X, r2 * 2.7e-2 * u**2 * dr, Z, -r4 * 5.7e-4 * u * p * race, M, -r3 * 1.3e-2 * u**2 * dr])


def cross_flow(nu, strips=20):
    """The drag of a box of 0.53 m by 0.53 m, by strips."""
    x = L * ((np.arange(strips) + 0.5) / strips - 0.5)
    side, below = nu[1] + x * nu[5], nu[2] - x * nu[4]
    size = np.hypot(side, below)
    drag = 0.5 * RHO * 0.53 * (0.5 * side**2 + 0.6 * below**2) / np.where(size > 0, size, 1) * L / strips
    Y, Z = -drag * side, -drag * below
    return np.array([0, Y.sum(), Z.sum(), 0, -(x * Z).sum(), (x * Y).sum()])


def rotation(phi, theta, psi):
    """R_nb of Euler angles."""
    (cf, cq, cp), (sf, sq, sp) = np.cos([phi, theta, psi]), np.sin([phi, theta, psi])
    return np.array([
        [cp * cq, -sp * cf + cp * sq * sf, sp * sf + cp * cf * sq],
        [sp * cq, cp * cf + sf * sq * sp, -cp * sf + sq * sp * cf],
        [-sq, cq * sf, cq * cf],
    ])  # fmt: skip


M_RB, M_A = mass_matrix()


def rate(state, command, current):
    """Rates of place, angles, velocities over ground, n [rad/s], dr, ds, and the two bow planes."""
    (phi, theta, _), nu, acts = state[3:6], state[6:12], state[12:]
    R = rotation(*state[3:6])
    water = np.concatenate([R.T @ current, np.zeros(3)])
    nu_r, (p, q, r) = nu - water, nu[3:]
    down = np.array([-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)])
    force = rigid_body(nu_r) + hull(nu_r) + controls(nu_r, *acts[:3], acts[3] + acts[4]) + cross_flow(nu_r)
    force[3:] += np.cross([0, 0, ZG * WEIGHT], down)
    turning = np.concatenate([-np.cross(nu[3:], water[:3]), np.zeros(3)])
    roll = p + (q * np.sin(phi) + r * np.cos(phi)) * np.tan(theta)
    angles = [roll, q * np.cos(phi) - r * np.sin(phi), (q * np.sin(phi) + r * np.cos(phi)) / np.cos(theta)]
    nu_rate = np.linalg.solve(M_RB + M_A, force) + turning
    return np.concatenate([R @ nu[:3], angles, nu_rate, (command - acts) / 0.1])


def published(command, seconds, current):
    """Return times' states of the published equations, from 1.8 m/s and 23 rev/s."""
    state = np.concatenate([np.zeros(6), [1.8, 0, 0, 0, 0, 0], [2 * np.pi * 23, 0, 0, 0, 0]])
    found = [state]
    for _ in range(round(seconds / STEP)):
        k1 = rate(state, command, current)
        k2 = rate(state + 0.5 * STEP * k1, command, current)
        k3 = rate(state + 0.5 * STEP * k2, command, current)
        k4 = rate(state + STEP * k3, command, current)
        state = state + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        found.append(state)
    return np.array(found)


OURS = from_mapping(
    nested(part_of(read_toml(shipped_path("vehicles", "nps_auv2"), "nps_auv2"), "vehicle")[0].values)
)
STILL, CURRENT = (0.0, 0.0, 0.0), (0.2, -0.3, 0.05)
RUNS = {
    # propeller [rev/s], rudder (ours), stern-planes (ours), bow planes [rad], current
    "straight": (20.0, 0.0, 0.0, (0.0, 0.0), STILL),
    "rudder": (25.0, 0.2, 0.0, (0.0, 0.0), STILL),
    "stern-planes": (25.0, 0.0, 0.1, (0.0, 0.0), STILL),
    "bow planes": (25.0, 0.0, 0.0, (0.15, 0.15), STILL),
    "all": (22.0, -0.15, -0.08, (0.1, -0.05), CURRENT),
}


def test_the_forces_of_a_rigid_body_do_no_work():
    for nu in np.random.default_rng(5).normal(size=(20, 6)):
        force = rigid_body(nu)
        assert abs(force @ nu) < 1e-12 * np.abs(force * nu).sum()
        u, v, _, p, q, _ = nu
        assert force[2] == pytest.approx(MASS * (u * q - v * p + ZG * (p**2 + q**2)))  # not its negative


@pytest.mark.long
@pytest.mark.parametrize("name", RUNS)
def test_the_file_moves_as_the_published_equations(name):
    n, dr, ds, bow, current = RUNS[name]
    theirs = published(np.array([2 * np.pi * n, -dr, -ds, *bow]), 40.0, np.array(current))
    start = initial_state(velocity=(1.8, 0, 0, 0, 0, 0))
    start[13] = 23.0
    state = np.append(start, np.zeros(2))
    run = free_run(OURS, state, (n, dr, ds, ds, *bow), 40.0, STEP, current_n=current).states
    ours = np.column_stack([run[:, :3], [euler_angles(each[3:7]) for each in run], run[:, 7:13]])
    other = theirs[:, :12]
    other[:, 5] = (other[:, 5] + np.pi) % (2 * np.pi) - np.pi
    ours[:, 5] = (ours[:, 5] + np.pi) % (2 * np.pi) - np.pi
    for first in range(0, 12, 3):
        part = slice(first, first + 3)
        worst = np.abs(ours[:, part] - other[:, part]).max() / np.abs(other[:, part]).max().clip(1e-9)
        print(f"{name}: {('place', 'angles', 'velocity', 'rates')[first // 3]} agree to {worst:.1e}")
        assert worst < AGREE


def test_twenty_strips_are_the_integral_within_half_a_percent_and_eleven_stations_are_not():
    """The file of MSS sums 11 stations, ends included, times a tenth of the length."""
    nu = np.array([1.0, 0.3, 0.2, 0.0, 0.1, 0.2])
    exact = cross_flow(nu, 2000)
    np.testing.assert_allclose(cross_flow(nu), exact, rtol=5e-3)
    x = L / 10 * np.arange(-5, 6)
    side, below = nu[1] + x * nu[5], nu[2] - x * nu[4]
    drag = 0.5 * RHO * 0.53 * (0.5 * side**2 + 0.6 * below**2) / np.hypot(side, below) * L / 10
    stations = np.array([-(drag * side).sum(), -(x * drag * side).sum()])
    print("11 stations over the integral: Y, N", stations / exact[[1, 5]])
    assert (stations / exact[[1, 5]] > 1.1).all()


def test_signs_of_the_controls():
    """A positive rudder turns to starboard; positive stern-planes, and positive bow planes, raise the nose."""

    def end(command):
        start = np.append(initial_state(velocity=(1.8, 0, 0, 0, 0, 0)), np.zeros(2))
        start[13] = 23.0
        return free_run(OURS, start, command, 10.0, STEP).states[-1]

    turned = end((23.0, 0.1, 0, 0, 0, 0))
    assert euler_angles(turned[3:7])[2] > 0.05
    assert turned[1] > 0.0
    assert euler_angles(end((23.0, 0, 0.05, 0.05, 0, 0))[3:7])[1] > 0.02
    assert euler_angles(end((23.0, 0, 0, 0, 0.1, 0.1))[3:7])[1] > 0.002
