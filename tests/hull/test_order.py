"""The order of the time steps, and what the quaternion loses in between."""

import numpy as np
from numpy.testing import assert_allclose

import vehicle
from vehicle.cross_flow import CrossFlowDrag, cross_flow_drag


def test_halving_the_step_divides_the_error_by_sixteen(subzero2):
    """Fourth order on a smooth manoeuvre: slope of log error over log step at least 3.8 over four steps.

    Smooth means that no local cross flow passes zero, where v|v| has a kink: half a second of a hard drift.
    """
    start = vehicle.initial_state(
        roll=0.2, pitch=0.1, velocity=(1.2, 0.6, 0.3, 0.2, 0.1, 0.3), propeller_speed=20.0
    )
    start[14:17] = start[18:21] = 0.1, 0.05, 0.08
    command = (28.0, 0.15, 0.05, 0.1)

    def end(step):
        return vehicle.free_run(subzero2, start, command, 0.48, step).states[-1]

    steps = np.array([0.04, 0.02, 0.01, 0.005])
    reference = end(0.000625)
    errors = [np.abs(end(step) - reference).max() for step in steps]
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 3.8 <= slope <= 4.6, (slope, errors)


def test_twenty_strips_are_enough_for_the_cross_flow(subzero2):
    """Against two thousand strips: force and moment within 0.7 % of the largest, in drift, yaw and both."""
    for nu in ([1, 0.3, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0.5], [1, 0.2, -0.1, 0, 0.3, 0.4]):
        results = []
        for strips in (20, 2000):
            table = CrossFlowDrag(drag_coefficient=1.1).numbers(subzero2.hull, 1000.0, strips)
            out = np.empty(6)
            cross_flow_drag(np.array(nu, dtype=float), table, out)
            results.append(out)
        assert_allclose(results[0], results[1], rtol=0, atol=7e-3 * np.abs(results[1]).max())
