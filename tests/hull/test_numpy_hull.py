"""The hull that others are timed against is the same hull: `benchmarks.peers.numpy_hull` is `vehicle.derivative`.

Verifies: every entry of the rate of the state, at random states and commands. Configuration: Subzero II, and Subzero II
with a changed Munk moment, free motor, dead band and backlash. Tolerance: 1e-11, rounding of sums in another order.
"""

import numpy as np
import pytest

import subzero
from benchmarks.peers import numpy_hull
from vehicle.dynamics import derivative
from vehicle.state import LINKAGE, SERVO

CHANGED = {
    "added_mass.munk_factor": 0.6, "motor.lag": 0.0, "motor.voltage_sensitivity": 1.0, "rudder_servo.dead_band": 0.05,
    "rudder_servo.half_backlash": 0.02, "stern_plane_port_servo.position_feedback": 0.7,
    "quadratic_damping.yaw_per_yaw": -2.0,
    "linear_damping.heave": -1.0, "propeller.reaction_torque_factor": 0.5, "buoyancy.centre_of_buoyancy_y": 0.01,
}  # fmt: skip


@pytest.mark.parametrize("changes", [{}, CHANGED])
def test_the_plain_hull_is_the_compiled_one(changes):
    vehicle = subzero.Model.of(subzero.load_scenario("fig6")).vehicle
    for name, value in changes.items():
        vehicle = vehicle.with_parameter(name, value)
    numbers, rng = vehicle.numbers(), np.random.default_rng(1)
    for _ in range(20):
        state = rng.standard_normal(21)
        state[SERVO : SERVO + 3] *= 0.2
        state[LINKAGE : LINKAGE + 3] = state[SERVO : SERVO + 3] + 0.02 * rng.standard_normal(3)
        command = np.array([20.0, 0.2, 0.2, 0.2]) * rng.standard_normal(4)
        rates = np.zeros(21)
        derivative(state, command, np.zeros(3), np.zeros(6), numbers, rates)
        np.testing.assert_allclose(
            numpy_hull.derivative(state, command, numbers), rates, rtol=1e-11, atol=1e-11
        )
