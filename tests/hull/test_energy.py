"""Every joule of the propeller is found again in losses, motion and height."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import vehicle


@pytest.mark.parametrize("current", [(0.0, 0.0, 0.0), (0.4, -0.3, 0.0)])
def test_propeller_work_is_losses_plus_change_of_energy(subzero2, current):
    """A hard manoeuvre of a heavy hull: residual below 1e-6 of the propeller's work, kinks included."""
    hull = subzero2.with_parameter("buoyancy.net_buoyancy", -0.2).numbers()
    start = vehicle.initial_state(pitch=0.1, heading=0.5)
    run = vehicle.free_run(hull, start, (24.0, 0.2, 0.15, -0.05), 30.0, 0.01, current_n=current)
    water = np.array(current)

    def total(state):
        return vehicle.kinetic_energy(state, water, hull) + vehicle.potential_energy(state, hull)

    change = total(run.states[-1].copy()) - total(run.states[0].copy())
    propeller, loss, restoring, external = run.work[-1]
    residual = propeller + loss + external - change
    assert propeller > 10.0
    assert loss < -5.0
    assert external == 0.0
    assert abs(residual) < 1e-6 * propeller
    potential = vehicle.potential_energy(run.states[-1].copy(), hull) - vehicle.potential_energy(start, hull)
    assert restoring == pytest.approx(-potential, abs=1e-6 * propeller)


def test_work_from_outside_is_booked_as_such(subzero2):
    """A towed hull: pulled forward by half a newton, it gains what the pull gives, less its losses."""
    numbers = subzero2.numbers()
    run = vehicle.free_run(
        numbers, vehicle.initial_state(), (0, 0, 0, 0), 20.0, wrench_b=(0.5, 0.05, 0, 0, 0, 0.02)
    )
    energy = vehicle.kinetic_energy(run.states[-1].copy(), np.zeros(3), numbers)
    energy += vehicle.potential_energy(run.states[-1].copy(), numbers)
    energy -= vehicle.potential_energy(run.states[0].copy(), numbers)
    assert_allclose(run.work[-1].sum() - run.work[-1, 2], energy, rtol=1e-6)
    assert run.work[-1, 0] < 0.0  # the stopped propeller drags


def test_a_vehicle_left_to_coast_only_loses_energy(subzero2):
    numbers = subzero2.numbers()
    start = vehicle.initial_state(roll=0.5, pitch=0.3, velocity=(1.0, 0.4, -0.3, 1.0, 0.5, -0.5))
    run = vehicle.free_run(numbers, start, (0.0, 0.2, 0.1, -0.2), 20.0)
    energy = [
        vehicle.kinetic_energy(state.copy(), np.zeros(3), numbers)
        + vehicle.potential_energy(state.copy(), numbers)
        for state in run.states
    ]
    assert np.all(np.diff(energy) < 1e-9)
    assert energy[-1] < 0.1 * energy[0] or energy[-1] < energy[0] - 1.0


def test_the_propeller_never_gives_more_than_its_shaft(subzero2):
    """T u_a ≤ 2π n Q in all four quadrants: efficiency below one, and a windmill that only brakes."""
    from vehicle.propeller import thrust, torque

    P = subzero2.propeller
    numbers = P.numbers(subzero2.water.density)
    for n in np.linspace(-40, 40, 33):
        for u in np.linspace(-2, 2, 41):
            useful = thrust(n, u, numbers) / (1 - P.thrust_deduction) * (1 - P.wake_fraction) * u
            shaft = 2 * np.pi * n * torque(n, u, numbers)
            assert useful <= shaft + 1e-12


def test_rates_and_powers_taken_together_are_those_taken_apart(subzero2):
    """One look at the forces gives what two give, to the last bit: the arithmetic is the same, so no tolerance."""
    numbers, command, current = (
        subzero2.numbers(),
        np.array([20.0, 0.1, -0.05, 0.02]),
        np.array([0.1, -0.2, 0.05]),
    )
    state = vehicle.initial_state(
        roll=0.3, pitch=-0.2, heading=1.0, velocity=(0.8, 0.1, -0.1, 0.2, 0.1, -0.1)
    )
    wrench = np.array([-1.0, 0.5, 0.2, 0.01, 0.1, -0.1])
    rates, powers = np.empty(vehicle.STATE_SIZE), np.empty(len(vehicle.POWERS))
    together = np.empty(vehicle.STATE_SIZE), np.empty(len(vehicle.POWERS))
    vehicle.derivative(state, command, current, wrench, numbers, rates)
    vehicle.power(state, command, current, wrench, numbers, powers)
    vehicle.derivative_and_power(state, command, current, wrench, numbers, *together)
    assert np.array_equal(together[0], rates)
    assert np.array_equal(together[1], powers)
