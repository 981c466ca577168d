"""A tow begins in equilibrium: nothing jolts, whether it hangs at rest, is stretched, or carries a drogue.

Verifies: `cable.tow` at the start, for cables that sink, float or weigh nothing, stiff and stretching, at rest and at
speed; and which way they lie. Tolerance: the force at 0.1 s is within 1e-3 of that at 0. Without stretch the start
solves the discrete equations: 1e-8. A heavy stretching cable at speed is only nearly straight, since its drag grows
with √(1 + eT) and its weight does not: 3e-4. Where nothing pulls, the smoothed slack law leaves 1e-5 N.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable

LENGTH = 20.0
MASSES = {"sinks": 0.0098, "floats": 0.0035, "neutral": 0.0049}


def towed(speed, mass, compliance=0.0, **settings):
    properties = cable.CableProperties(mass_per_length=mass, compliance=compliance)
    run = cable.tow(lambda _: (speed, 0.0, 0.0), LENGTH, 2.0, cable=properties, **settings)
    assert run.outcome.completed, run.outcome.message
    return run, properties


@pytest.mark.parametrize("compliance", [0.0, 0.05], ids=["stiff", "stretching"])
@pytest.mark.parametrize("speed", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("mass", MASSES.values(), ids=MASSES)
def test_nothing_jolts(speed, mass, compliance):
    run, properties = towed(speed, mass, compliance)
    idle = speed == 0.0 and properties.weight_in_water == 0.0
    allowed = 1e-5 if idle else (1e-8 if compliance == 0.0 else 1e-3) * run.tow_tension[0]
    assert np.linalg.norm(run.tow_force[1] - run.tow_force[0]) < allowed
    assert np.abs(run.tow_force - run.tow_force[0]).max() < 5.0 * allowed


@pytest.mark.parametrize("compliance", [0.0, 0.05], ids=["stiff", "stretching"])
def test_at_rest_a_heavy_cable_hangs_with_its_weight_on_the_tow_point(compliance):
    run, properties = towed(0.0, MASSES["sinks"], compliance)
    weight = properties.weight_in_water * LENGTH
    assert_allclose(
        run.tow_force, np.tile([0.0, 0.0, weight], (run.time.size, 1)), rtol=0, atol=1e-6 * weight
    )
    shape = run.shapes[-1] - run.shapes[-1][0]
    assert_allclose(shape[:, :2], 0.0, atol=1e-9)
    assert shape[-1, 2] == pytest.approx(LENGTH * (1.0 + 0.5 * compliance * weight), rel=1e-6)


def test_at_rest_a_light_cable_stands_up():
    run, properties = towed(0.0, MASSES["floats"])
    assert_allclose(run.tow_force[-1], [0.0, 0.0, properties.weight_in_water * LENGTH], atol=1e-8)
    assert run.shapes[-1][-1, 2] < run.shapes[-1][0, 2] - 0.999 * LENGTH


def test_a_cable_in_the_water_that_goes_along_hangs_too():
    """At rest is at rest in the water."""
    sinking = cable.CableProperties(mass_per_length=MASSES["sinks"])
    run = cable.tow(lambda _: (0.4, 0.3, 0.0), LENGTH, 2.0, cable=sinking, current=(0.4, 0.3, 0.0))
    assert_allclose(run.tow_force, np.tile([0.0, 0.0, sinking.weight_in_water * LENGTH], (21, 1)), atol=1e-8)


@pytest.mark.parametrize("drogue", [0.0, 0.01])
def test_a_stretched_straight_tow_starts_at_its_closed_form(drogue):
    """dT/ds = −½ρπdC_t √(1 + eT) U² has √(1 + eT(0)) = √(1 + eT(L)) + ½e ½ρπdC_t U² L.

    The segments take √(1 + eT) in their middles: second order, e²Δs²… of a strain of 0.04, 1e-6 at half a metre.
    """
    e = 0.05
    run, properties = towed(1.0, MASSES["neutral"], e, drogue_drag_area=drogue)
    at_tail = 500.0 * drogue
    root = np.sqrt(1.0 + e * at_tail) + 0.5 * e * properties.tangential_drag * LENGTH
    exact = (root**2 - 1.0) / e
    assert_allclose(run.tow_tension, exact, rtol=5e-6)
    stretched = np.linalg.norm(run.shapes[-1][-1] - run.shapes[-1][0])
    mean = 0.5 * (exact + at_tail)
    assert stretched == pytest.approx(LENGTH * (1.0 + e * mean), rel=1e-3)


@pytest.mark.long
@pytest.mark.parametrize("speed", [0.0, 1.0])
def test_a_stiff_cable_starts_as_quietly(speed):
    """A straight cable does not bend."""
    stiff = cable.CableProperties(mass_per_length=MASSES["sinks"], bending_stiffness=0.01)
    run = cable.tow(lambda _: (speed, 0.0, 0.0), LENGTH, 2.0, cable=stiff)
    assert np.abs(run.tow_force - run.tow_force[0]).max() < 1e-8 * run.tow_tension[0]


@pytest.mark.long
def test_the_lumped_cable_hangs_and_pulls_alike():
    """Masses and springs of the other formulation, `scheme="lumped"`: weight at rest, drag at speed."""
    sinking = cable.CableProperties(mass_per_length=MASSES["sinks"])
    for speed in (0.0, 1.0):
        ours, other = (
            cable.tow(lambda _, U=speed: (U, 0.0, 0.0), LENGTH, 2.0, cable=sinking, scheme=scheme)
            for scheme in ("moving_end", "lumped")
        )
        assert other.outcome.completed, other.outcome.message
        assert other.scheme == "lumped"
        assert_allclose(other.tow_force[-1], ours.tow_force[-1], rtol=0, atol=1e-4 * ours.tow_tension[-1])


@pytest.mark.parametrize("scheme", ["paper", "equation7", "nonsense"])
def test_a_scheme_that_cannot_tow_says_so(scheme):
    said = "is unknown" if scheme == "nonsense" else "cannot tow a free end; choose 'moving_end' or 'lumped'"
    with pytest.raises(ValueError, match=f"scheme '{scheme}.* {said}"):
        cable.tow(lambda _: (1.0, 0.0, 0.0), LENGTH, 1.0, scheme=scheme)


@pytest.mark.parametrize("scheme", ["paper", "equation7"])
@pytest.mark.parametrize(
    "settings",
    [
        {"drum": cable.MovingDrum(velocity=lambda _: (0.1, 0.0, 0.0))},
        {"start": 1.0},
        {"drum": cable.Brake()},
        {"current": cable.Current.profile(down=[0.0, 1.0], velocity=np.zeros((2, 3)))},
    ],
    ids=["moving drum", "wet length", "brake", "profile"],
)
def test_schemes_for_comparison_say_what_they_do_not_know(scheme, settings):
    with pytest.raises(
        ValueError, match=rf"scheme '{scheme}.* does not know .*; use 'moving_end' or 'lumped'"
    ):
        cable.pull_out(lambda _: (1.0, 0.0, 0.0), 1.0, scheme=scheme, **settings)
