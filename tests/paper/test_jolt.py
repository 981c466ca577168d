"""A tow point that changes its velocity at once: Fig. 5 (c) at 20 s, where the pitch rate ends.

Verifies: the impulse of `cable.moving_end.jolt` on a straight cable, by hand; that Fig. 5 (c) is the same at steps of
0.1 and 0.02 s, where a dip at 20 s used to grow with shorter steps (0.557 and 0.463 N); and that a cable is not pushed
for long. Tolerance: rounding for the impulse; 1 % of the tension for the steps, and 0.3 % of it a second behind the
jolt.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable
import subzero


@cache
def tensions(name, step):
    """Return times and tow tensions of a prescribed scenario with another step."""
    trial = replace(subzero.load_scenario(name), cable_step=step, hull_step=min(step, 0.02))
    run = subzero.simulate(trial)
    assert run.attrs["outcome"] == "completed", run.attrs["outcome_message"]
    return run["time"].values, run["cable_tension"].values


@pytest.mark.parametrize("name", ["fig5", "fig5_turn"])
def test_the_tension_after_the_jolt_does_not_depend_on_the_step(name):
    (coarse_time, coarse), (fine_time, fine) = tensions(name, 0.1), tensions(name, 0.02)
    at = np.searchsorted(fine_time, coarse_time - 1e-9)
    assert_allclose(fine_time[at], coarse_time, atol=1e-9)
    later = coarse_time > 1.0  # a cable of centimetres is all start
    assert_allclose(coarse[later], fine[at][later], rtol=1e-2)
    calm = (coarse_time > 21.0) | ((coarse_time > 11.0) & (coarse_time < 20.05))
    assert_allclose(coarse[calm], fine[at][calm], rtol=3e-3)


def test_there_is_no_dip_left():
    """The tension falls by what the drag of the slower sideways motion took with it, and goes on smoothly."""
    time, tension = tensions("fig5", 0.02)
    behind = tension[(time > 20.01) & (time < 20.5)]
    assert behind.min() > 0.95 * tension[np.argmin(np.abs(time - 20.0))]
    assert (np.diff(behind) > -1e-3).all()


def jerked(jump, when=10.0):
    """Straight ahead at 1 m/s, faster by `jump` from `when` on."""
    return lambda t: (1.0 if t < when else 1.0 + jump, 0.0, 0.0)


@pytest.mark.parametrize("inertia", [0.0, 1e-3])
def test_a_straight_cable_takes_the_impulse_of_its_mass_and_the_drums(inertia):
    """(m S + I_d/R_d²) Δu, against the motion; behind it, on a light drum, the tension is the steady one at once."""
    drum = cable.DrumProperties(inertia=inertia)
    run = cable.pull_out(jerked(0.5), 12.0, drum=drum)
    k = 100
    assert run.time[k] == pytest.approx(10.0)
    expected = -(0.0049 * run.length[k] + inertia / 0.1**2) * 0.5
    assert_allclose(run.tow_impulse[k], [expected, 0.0, 0.0], rtol=1e-6, atol=1e-12)
    assert not np.delete(run.tow_impulse, k, axis=0).any()
    if inertia == 0.0:
        steady = cable.CableProperties().tangential_drag * 1.5**2 * run.length[k + 1 :]
        assert_allclose(run.tow_tension[k + 1 :], steady, rtol=1e-5)


def test_a_cable_that_would_have_to_push_for_long_gets_slack_instead():
    """Half as fast at once: drag at 1 m/s, 0.039 N/m, would take 0.06 s for 0.5 m/s of 0.0049 kg/m."""
    run = cable.pull_out(jerked(-0.5), 10.2, scheme=cable.MovingEnd(time_step=0.02))
    assert not run.tow_impulse.any()
    assert run.tow_tension[501] < 0.2 * run.tow_tension[500]
    assert min(tension.min() for tension in run.tensions) >= 0.0


def test_a_cable_that_stretches_takes_no_impulse():
    run = cable.pull_out(jerked(0.5), 11.0, cable=cable.CableProperties(compliance=1e-3))
    assert not run.tow_impulse.any()
