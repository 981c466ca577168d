"""A cable by itself says why its numbers may be wrong, as a trial with a vehicle does, and says nothing of sound ones.

Configuration: a straight pull, whose solution is known; a tow point that is shaken five times a second on steps of a
tenth of a second, two to a period; a winch that pays out faster than the tow point goes; ends that are closer than the
cable is long.
"""

import numpy as np
import pytest

import cable


def straight(t):
    return (1.0, 0.0, 0.0)


def shaken(t):
    return (1.0 + 3.0 * np.cos(2.0 * np.pi * 5.0 * t), 0.0, 0.0)


HEAVY = cable.CableProperties(mass_per_length=0.5, diameter=0.01, bending_stiffness=1e-3)


def test_a_straight_pull_has_no_warnings():
    run = cable.pull_out(straight, 10.0)
    assert run.warnings == ()
    assert "warning" not in repr(run)


@pytest.mark.long
def test_a_shake_that_steps_do_not_follow_is_warned_of():
    """It ended in "completed", and nothing else was said."""
    run = cable.pull_out(shaken, 10.0, cable=HEAVY, scheme=cable.MovingEnd(time_step=0.1))
    assert run.outcome.completed
    assert any("the steps do not" in words for words in run.warnings)
    assert all(words[:30] in repr(run) for words in run.warnings)


def test_cable_that_is_paid_out_faster_than_it_is_taken_is_warned_of_with_its_share():
    """Half as fast as it is paid out: half of what is new is slack."""
    run = cable.pull_out(lambda t: (0.5, 0.0, 0.0), 20.0, drum=cable.PayOutRate(rate=1.0), start=5.0)
    assert any("of the cable is slack" in words for words in run.warnings)


WEIGHTY = cable.CableProperties(mass_per_length=0.5)


@pytest.mark.parametrize("properties, warns", [(WEIGHTY, False), (cable.CableProperties(), True)])
def test_a_cable_at_rest_that_nothing_pulls_says_that_it_has_no_shape(properties, warns):
    """Twice as long as the way between its ends: it hangs in its weight, or, without any, nothing says where it is."""
    found = cable.hold(((0.0, 0.0, 0.0), (10.0, 0.0, 0.0)), 20.0, cable=properties)
    assert bool(found.warnings) == warns
    assert ("slack" in repr(found)) == warns


BUOYANT = cable.CableProperties(mass_per_length=0.4, cross_section_area=4.91e-4, diameter=0.025)
"""A quarter lighter than the water that it displaces."""


def test_a_buoyant_cable_that_arches_out_of_the_water_says_how_high_it_is():
    """Ends 1 m deep and 20 m apart, 30 m of cable: it floats up to 9 m above the surface."""
    found = cable.hold(((0.0, 0.0, 1.0), (20.0, 0.0, 1.0)), 30.0, cable=BUOYANT)
    (said,) = found.warnings
    assert f"by up to {-found.shape[:, 2].min():.3g} m" in said
    assert "in the air" in repr(found)
    deep = cable.hold(((0.0, 0.0, 50.0), (20.0, 0.0, 50.0)), 30.0, cable=BUOYANT)
    assert deep.warnings == ()


@pytest.mark.parametrize("properties, warns", [(BUOYANT, True), (cable.CableProperties(), False)])
def test_a_cable_that_floats_above_its_drum_and_tow_point_is_warned_of(properties, warns):
    for run in (
        cable.pull_out(straight, 10.0, cable=properties, start=10.0),
        cable.tow(lambda t: (max(1.0 - 0.2 * t, 0.1), 0.0, 0.0), 10.0, 10.0, cable=properties),
    ):
        assert any("is above down = 0" in words for words in run.warnings) == warns
