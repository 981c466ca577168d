"""A cable that resists bending: a hinged beam under tension, and short stiff segments that stay quiet.

Verifies: `CableProperties.bending_stiffness` against the small sag of a beam of length L, weight w per length, tension
T and hinges at both ends, EI y'''' − T y'' = w:

    y = w/T [x (L − x)/2 − (EI/T) (1 − cosh((x − L/2)/λ)/cosh(L/(2λ)))],     λ = √(EI/T)

Configuration: L = 10 m on a winch that keeps T = 20 N, tow point at rest, λ = 1 m. Tolerance: 2e-4 of the sag at a
quarter of a metre (measured 8e-5) and second order; the form is for small slopes, here 2.5e-3, whose square is 6e-6.
"""

from functools import cache

import numpy as np
import pytest

import cable

LENGTH, TENSION, STIFFNESS = 10.0, 20.0, 20.0
BEAM = {"mass_per_length": 0.0059, "bending_stiffness": STIFFNESS}
THICK = {
    "water_density": 1025.0,
    "mass_per_length": 0.75,
    "cross_section_area": 4.91e-4,
    "diameter": 0.025,
    "normal_drag_coefficient": 1.2,
    "compliance": 2e-7,
}


def sag(x, weight, stiffness):
    """Return how far a hinged tensioned beam hangs down at x from one end. [m]"""
    reach = np.sqrt(stiffness / TENSION)
    rounded = 1.0 - np.cosh((x - LENGTH / 2.0) / reach) / np.cosh(LENGTH / (2.0 * reach))
    return weight / TENSION * (x * (LENGTH - x) / 2.0 - stiffness / TENSION * rounded)


@cache
def hanging_shape(segment_length, factor=1.0):
    """Return the nodes of a beam that has come to rest (n, 3), and its weight; times `factor` stiffer."""
    beam = cable.CableProperties(**BEAM | {"bending_stiffness": factor * STIFFNESS})
    run = cable.pull_out(
        lambda _: (0.0, 0.0, 0.0),
        60.0,
        cable=beam,
        start=LENGTH,
        drum=cable.ConstantTension(tension=TENSION),
        scheme=cable.MovingEnd(time_step=0.5, segment_length=segment_length),
    )
    assert run.outcome.completed, run.outcome.message
    return run.shapes[-1], beam.weight_in_water


def error(segment_length):
    """Return the largest distance from the closed form, as a share of the largest sag."""
    shape, weight = hanging_shape(segment_length)
    exact = sag(shape[:, 0], weight, STIFFNESS)
    return np.abs(shape[:, 2] - exact).max() / exact.max()


@pytest.mark.long
def test_a_hinged_beam_under_tension_hangs_as_its_closed_form():
    assert error(0.25) < 2e-4


@pytest.mark.long
def test_its_error_falls_with_the_square_of_the_segment():
    sizes = (1.0, 0.5, 0.25)
    assert np.polyfit(np.log(sizes), np.log([error(size) for size in sizes]), 1)[0] > 1.8


@pytest.mark.long
@pytest.mark.parametrize("factor", [0.1, 5.0])
def test_softer_and_stiffer_beams_have_theirs(factor):
    shape, weight = hanging_shape(0.25, factor)
    exact = sag(shape[:, 0], weight, factor * STIFFNESS)
    assert np.abs(shape[:, 2] - exact).max() < 1e-3 * exact.max()
    assert abs(exact.max() / sag(LENGTH / 2.0, weight, STIFFNESS) - 1.0) > 0.05, "and it is another one"


@pytest.mark.long
def test_without_stiffness_it_is_a_parabola():
    shape, weight = hanging_shape(0.25, 0.0)
    parabola = weight / TENSION * shape[:, 0] * (LENGTH - shape[:, 0]) / 2.0
    np.testing.assert_allclose(shape[:, 2], parabola, rtol=0, atol=1e-4 * parabola.max())


def bowing(t):
    """Return a motion that starts softly and goes through a quarter of a circle of 10 m, down and aside."""
    speed, angle = 0.5 * min(t / 5.0, 1.0), 0.05 * t
    return speed * np.cos(angle), 0.6 * speed * np.sin(angle), 0.8 * speed * np.sin(angle)


@pytest.mark.long
@pytest.mark.parametrize("segment_length", [0.25, 0.03])
def test_a_stiff_cable_of_short_segments_does_not_spike(segment_length):
    """EI/Δs² is a hundred times the tension and more: an explicit moment would ring. Nothing else is new in the pull.

    A bow of 10 m radius bends a cable of 5 N m² with 0.5 N m and a shear force of that per its way: 1 % of 50 N.
    """
    stiff, limp = (
        cable.pull_out(
            bowing,
            20.0,
            cable=cable.CableProperties(**THICK, bending_stiffness=stiffness),
            drum=cable.ConstantTension(tension=50.0),
            scheme=cable.MovingEnd(segment_length=segment_length),
        )
        for stiffness in (5.0, 0.0)
    )
    assert stiff.outcome.completed, stiff.outcome.message
    np.testing.assert_allclose(stiff.tow_force, limp.tow_force, rtol=0, atol=0.01 * 50.0)
    assert np.abs(np.diff(stiff.tow_tension[60:], 3)).max() < 1e-3 * 50.0


def test_a_negative_stiffness_is_refused():
    with pytest.raises(
        ValueError, match=r"bending_stiffness is -1\.0; it must be a finite number, at least 0"
    ):
        cable.CableProperties(bending_stiffness=-1.0)
