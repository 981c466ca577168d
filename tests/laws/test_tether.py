"""Laws that a tether obeys whatever a host does with it: signs, weight, work, other axes, other steps, slack.

Verifies: `cable.Tether`. Configuration: in each test. Tolerance: in each test, with its reason.
"""

import numpy as np
import pytest

import cable

ELASTIC = cable.CableProperties(compliance=1e-4)
HEAVY = cable.CableProperties(mass_per_length=0.02, compliance=1e-4)
LIGHT = cable.CableProperties(mass_per_length=0.002, compliance=1e-4)
REST = np.zeros(3)


def test_a_taut_tether_pulls_each_end_towards_the_other():
    first, second = np.array([8.0, -5.0, 3.0]), np.array([1.0, 2.0, 1.0])
    towards = (second - first) / np.linalg.norm(second - first)
    tether = cable.Tether(ELASTIC, length=0.99 * np.linalg.norm(second - first), ends=[first, second])
    forces = tether.step(0.1, [first, second])
    assert forces[0] @ towards > 0.99 * np.linalg.norm(forces[0]) > 50.0
    assert forces[1] @ towards < -0.99 * np.linalg.norm(forces[1])


@pytest.mark.parametrize("way", np.vstack([np.eye(3), -np.eye(3)]))
def test_a_current_drags_both_ends_downstream(way):
    """The cable lies east and west, so a current along it drags less, but never upstream."""
    ends = [(0.0, 10.0, 20.0), (0.0, -10.0, 20.0)]
    tether = cable.Tether(ELASTIC, length=22.0, ends=ends, current=0.5 * way)
    total = tether.step(1.0, ends).sum(axis=0)
    assert total @ way > 0.9 * np.linalg.norm(total) > 0.1


@pytest.mark.parametrize(("properties", "sign"), [(HEAVY, 1.0), (LIGHT, -1.0)])
def test_at_rest_the_ends_carry_the_weight_in_water(properties, sign):
    """The forces of a heavy cable on its ends add up to its weight, down; of a buoyant one to its buoyancy, up.

    Tolerance: balances are solved to 1e-9 of the tension; 1e-6 of the weight is left for the start.
    """
    ends = [(12.0, 3.0, 6.0), (0.0, 0.0, 5.0)]
    tether = cable.Tether(properties, length=15.0, ends=ends)
    total = tether.step(0.5, ends).sum(axis=0)
    weight = properties.weight_in_water * 15.0
    assert total == pytest.approx([0.0, 0.0, weight], abs=1e-6 * abs(weight))
    assert sign * total[2] > 0.0


def test_a_current_is_felt_at_the_depth_of_each_node():
    """Only the deep half of the water moves, so the deep end feels more of the drag."""
    shear = cable.Current.profile([0.0, 9.9, 10.1, 20.0], [[0, 0, 0], [0, 0, 0], [0, 0.5, 0], [0, 0.5, 0]])
    ends = [(0.0, 0.0, 20.0), (0.0, 0.0, 0.0)]
    tether = cable.Tether(HEAVY, length=21.0, ends=ends, current=shear)
    forces = tether.step(0.5, ends)
    assert forces[0, 1] > 1.5 * forces[1, 1] > 0.0


def circle(time, radius=0.6, rate=1.3):
    """Return place and velocity on a circle, upright and tilted."""
    s, c = np.sin(rate * time), np.cos(rate * time)
    place = np.array([radius * s, 0.4 * radius * (1.0 - c), 0.5 * radius * s * c])
    return place, rate * np.array([radius * c, 0.4 * radius * s, 0.5 * radius * (c * c - s * s)])


def ends_at(time, first=(18.0, 0.0, 8.0)):
    """Return the states of both ends: one circles, the other heaves."""
    place, velocity = circle(time)
    heave = np.array([0.0, 0.0, 0.3 * np.sin(time)]), np.array([0.0, 0.0, 0.3 * np.cos(time)])
    return np.array([[np.array(first) + place, velocity], heave])


def driven(dt, seconds=6.0, rtol=5e-3, **more):
    """Return the forces over time of a tether whose ends move as `ends_at` says, and the tether."""
    tether = cable.Tether(HEAVY, length=20.5, ends=ends_at(0.0), rtol=rtol, **more)
    steps = [tether.step(dt, ends_at(k * dt)) for k in range(1, round(seconds / dt) + 1)]
    return np.array(steps), tether


def test_the_forces_do_not_depend_on_the_steps_of_the_host():
    """Steps of 0.01, 0.1 and 0.5 s give the same forces at the same times.

    Tolerance: 2 % of the largest force, in every sample: an inner step may err by 0.5 % of it (rtol), and errors of
    second order at the far end are about twice as large.
    """
    fine, _ = driven(0.01, rtol=1e-3)
    largest = np.linalg.norm(fine, axis=2).max()
    assert largest > 1.0
    for dt in (0.01, 0.1, 0.5):
        every = round(dt / 0.01)
        forces, _ = driven(dt)
        assert np.linalg.norm(forces - fine[every - 1 :: every], axis=2).max() < 0.02 * largest


def test_turned_axes_give_turned_forces():
    """North becomes east, east south. Tolerance: rounding, which a step's tolerance of 1e-9 may enlarge."""
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    one = cable.Tether(HEAVY, length=20.5, ends=ends_at(0.0), current=(0.1, 0.2, 0.0), rtol=0.0)
    other = cable.Tether(
        HEAVY, length=20.5, ends=ends_at(0.0) @ turn.T, current=turn @ (0.1, 0.2, 0.0), rtol=0.0
    )
    for k in range(1, 31):
        expected = one.step(0.1, ends_at(0.1 * k)) @ turn.T
        np.testing.assert_allclose(other.step(0.1, ends_at(0.1 * k) @ turn.T), expected, atol=1e-6)


def test_a_moving_host_gains_nothing():
    """All moves with a uniform current, host and water: the forces are those at rest (Galileo).

    Tolerance: 1e-6 of the tension, as at rest.
    """
    ends, drift = np.array([(18.0, 0.0, 8.0), (0.0, 0.0, 0.0)]), np.array([0.4, -0.3, 0.0])
    still = cable.Tether(HEAVY, length=20.5, ends=ends).forces
    states = np.stack([ends, [drift, drift]], axis=1)
    tether = cable.Tether(HEAVY, length=20.5, ends=states, current=drift)
    for k in range(1, 21):
        states[:, 0] = ends + 0.1 * k * drift
        forces = tether.step(0.1, states)
    assert forces == pytest.approx(still, abs=1e-6 * np.linalg.norm(still[0]))


def test_a_cycle_of_the_host_puts_work_in_and_never_gets_any_out():
    """Work of the host over whole cycles is what drag takes, −∮F·v dt > 0; the tether's balance of energy closes.

    Tolerance: the balance to 2 % of work and loss, steps of second order and trapezoidal sums.
    """
    dt, cycle = 0.02, 2.0 * np.pi
    tether = cable.Tether(HEAVY, length=20.5, ends=ends_at(0.0))
    rate = 2.0 * np.pi / cycle

    def at(time):
        place, velocity = circle(time, rate=rate)
        return np.array([[np.array([18.0, 0.0, 8.0]) + place, velocity], [REST, REST]])

    work = [
        -dt * np.sum(tether.step(dt, at(k * dt))[0] * at(k * dt)[0, 1])
        for k in range(1, round(3 * cycle / dt) + 1)
    ]
    thirds = np.add.reduceat(work, [0, len(work) // 3, 2 * len(work) // 3])
    assert (thirds[1:] > 0.0).all()
    assert thirds[2] == pytest.approx(thirds[1], rel=0.05)
    assert tether.energy_residual < 0.02


def test_an_impulse_moves_the_cable_and_nothing_else():
    """Without drag and weight, what the ends are pulled with over time is the momentum that the cable has got.

    A straight neutral cable that cannot feel the water (no drag; its density is that of light water, so added mass is
    a thousandth) is accelerated along itself from rest: −∫ΣF dt = m L v. Tolerance: 1 %, one step of the ramp.
    """
    ghost = cable.CableProperties(
        water_density=1.0,
        tangential_drag_coefficient=0.0,
        normal_drag_coefficient=0.0,
        mass_per_length=4.9e-6,
        compliance=1e-3,
    )
    length, speed, dt = 10.0, 0.5, 0.01
    tether = cable.Tether(ghost, length=length, ends=[(1.001 * length, 0.0, 0.0), REST], atol=0.0)
    impulse, x, v = 0.0, 0.0, 0.0
    for k in range(1, 301):
        new = speed * min(1.0, k * dt / 2.0)
        x += 0.5 * dt * (v + new)
        v = new
        along = np.array([v, 0.0, 0.0])
        forces = tether.step(dt, [((1.001 * length + x, 0.0, 0.0), along), ((x, 0.0, 0.0), along)])
        impulse -= dt * forces.sum(axis=0)[0]
    assert impulse == pytest.approx(ghost.mass_per_length * length * speed, rel=0.01)


def test_a_tether_that_goes_slack_and_taut_never_pushes():
    """The ends come within the length and leave it again, six times: no tension below zero, none while slack, and the
    pull when taut is that of the stretch.

    Tolerance: 5 % on EA·strain at the largest stretch, for the wave that is still in it.
    """
    EA, length = 1e4, 20.0
    tether = cable.Tether(ELASTIC, length=length, ends=[(0.99 * length, 0.0, 0.0), REST])
    dt, period = 0.02, 4.0
    w = 2.0 * np.pi / period
    for k in range(1, round(6 * period / dt) + 1):
        x = length * (1.0 + 0.01 * np.sin(w * k * dt - 0.5 * np.pi))
        v = length * 0.01 * w * np.cos(w * k * dt - 0.5 * np.pi)
        pull = -tether.step(dt, [((x, 0.0, 0.0), (v, 0.0, 0.0)), (REST, REST)])[0, 0]
        assert tether.tension.min() >= 0.0
        if x > 1.009 * length:
            assert pull == pytest.approx(EA * (x / length - 1.0), rel=0.05)
        elif x < 0.998 * length:
            assert abs(pull) < 2.0
