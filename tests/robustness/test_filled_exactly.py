"""A step may pay out a whole segment exactly, or several, and nothing happens.

Verifies: T(0) of a straight pull, ½ρπdC_t U² S (37), where the growing segment is filled to the last bit when a step
ends; the same with a winch that pays out more than the vehicle takes. Tolerance: 1e-6 of the tension, the gate of a
straight pull, whose discrete equations have the exact solution; nothing but rounding is left.
"""

import numpy as np
import pytest

import cable


@pytest.mark.parametrize("segments_a_step", [1, 2, 3, 7])
@pytest.mark.parametrize("wet_length", [0.0, 20.0])
def test_filling_segments_exactly_leaves_the_tension_exact(segments_a_step, wet_length):
    speed = 1.0 * segments_a_step
    run = cable.pull_out(
        lambda _: (speed, 0.0, 0.0),
        10.0,
        start=wet_length,
        scheme=cable.MovingEnd(time_step=0.5, segment_length=0.5),
    )
    assert run.outcome.completed, run.outcome.message
    exact = cable.CableProperties().tangential_drag * speed**2 * run.length
    np.testing.assert_allclose(run.tow_tension[1:], exact[1:], rtol=1e-6)


@pytest.mark.parametrize("rate", [1.0, 1.3, 2.0])
def test_a_winch_may_pay_out_several_segments_a_step_to_a_vehicle_at_rest(rate):
    winch = cable.PayOutRate(rate=rate)
    run = cable.pull_out(
        lambda _: (0.0, 0.0, 0.0),
        15.0,
        start=10.0,
        drum=winch,
        scheme=cable.MovingEnd(time_step=0.5, segment_length=0.25),
    )
    assert run.outcome.completed, run.outcome.message
    np.testing.assert_allclose(run.length[-1], 10.0 + 15.0 * rate, rtol=1e-9)
