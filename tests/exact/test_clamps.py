"""Clamped ends of a cable that bends: elastica, clamped beam, forces, energy, messages.

Verifies: that a long weightless cable under a tension T which is clamped at an angle φ to it bends there by κ per
unstretched length with ½EI κ² = T (1 − cos φ) + ½eT² sin² φ, at second order: the elastica that is straight far away,
κ = 2 √(T/EI) sin φ/2 without stretch; a beam with both ends clamped,

    y = w/T [x (L − x)/2 − ½ L λ (cosh L/2λ − cosh (x − L/2)/λ)/sinh L/2λ],     λ = √(EI/T)

that both ends' forces carry the weight, with the shear at the second end; that energy is booked when a clamped end
moves.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable
from cable import Clamps
from subzero.errors import UserError

STIFFNESS, LENGTH, SOFT = 2.0, 4.0, 4e-4


def beam(**values):
    """A neutral cable."""
    neutral = {"mass_per_length": 0.1, "cross_section_area": 1e-4, "diameter": 0.0113, "compliance": SOFT}
    return cable.CableProperties(**neutral | {"bending_stiffness": STIFFNESS} | values)


def clamped_at(angle, segment):
    """Return a cable pulled along north whose first end is clamped at an angle, to the east."""
    way = Clamps(first=(-np.cos(angle), np.sin(angle), 0.0))
    ends = [(1.02 * LENGTH - 0.04 * angle**2, 0.0, 0.0), (0.0, 0.0, 0.0)]
    return cable.hold(ends, LENGTH, cable=beam(), segment_length=segment, clamps=way)


def bend_error(angle, segment):
    """Return the relative error of the curvature at the clamp."""
    rest = clamped_at(angle, segment)
    pull = -rest.tow_force
    T = np.linalg.norm(pull)
    phi = angle + np.arctan2(pull[1], pull[0])  # from the way in which the cable pulls
    squared = (2.0 * T * (1.0 - np.cos(phi)) + SOFT * (T * np.sin(phi)) ** 2) / STIFFNESS
    stretched = np.linalg.norm(rest.shape[1] - rest.shape[0]) / rest.segment_lengths[0]
    return float(rest.to_dataset()["curvature"][0]) * stretched / np.sqrt(squared) - 1.0


@pytest.mark.long
@pytest.mark.parametrize("angle", [0.02, 0.6])
def test_a_clamped_end_bends_as_the_elastica_says(angle):
    sizes = np.array([0.1, 0.05, 0.025])
    errors = [abs(bend_error(angle, size)) for size in sizes]
    assert errors[-1] < 3e-3
    assert np.polyfit(np.log(sizes), np.log(errors), 1)[0] > 1.8, errors


@pytest.mark.long
def test_a_beam_with_clamped_ends_sags_as_its_closed_form_and_both_ends_carry_it():
    heavy, sizes, errors = beam(mass_per_length=0.12, compliance=2e-5), (0.2, 0.1, 0.05), []
    for size in sizes:
        ends, ways = [(LENGTH * 1.001, 0.0, 0.0), (0.0, 0.0, 0.0)], Clamps(first=(-1, 0, 0), second=(1, 0, 0))
        rest = cable.hold(ends, LENGTH, cable=heavy, segment_length=size, clamps=ways)
        L, T, w = LENGTH * 1.001, float(rest.segment_tensions.mean()), heavy.weight_in_water / 1.001
        reach, x = np.sqrt(STIFFNESS / T), rest.shape[:, 0]
        rounded = (np.cosh(0.5 * L / reach) - np.cosh((x - 0.5 * L) / reach)) / np.sinh(0.5 * L / reach)
        exact = w / T * (x * (L - x) / 2.0 - 0.5 * L * reach * rounded)
        errors.append(np.abs(rest.shape[:, 2] - exact).max() / exact.max())
        assert_allclose(rest.tow_force[2] + rest.drum_force[2], heavy.weight_in_water * LENGTH, rtol=1e-8)
        assert_allclose(rest.tow_force[2], rest.drum_force[2], rtol=1e-8)
    assert errors[-1] < 5e-3
    assert np.polyfit(np.log(sizes), np.log(errors), 1)[0] > 1.8, errors


@pytest.mark.long
def test_a_clamped_end_that_moves_books_its_energy():
    start = clamped_at(0.5, 0.1)
    way = lambda t: (0.0, 0.3 * np.sin(2.0 * t), 0.1 * np.sin(3.0 * t))  # noqa: E731
    run = cable.pull_out(way, 4.0, drum=cable.Brake(), start=start, scheme=cable.MovingEnd(time_step=0.01))
    assert run.outcome.completed
    assert run.outcome.energy_residual < 3e-3
    still = cable.pull_out(lambda t: (0.0, 0.0, 0.0), 2.0, drum=cable.Brake(), start=start)
    assert_allclose(still.tow_force, np.broadcast_to(start.tow_force, still.tow_force.shape), atol=1e-5)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: Clamps(first=(0.0, 0.0, 0.0)), "first is .*not all zero"),
        (lambda: Clamps(second=(0.0, 1.0)), "second is .*three finite numbers"),
        (
            lambda: cable.hold([(3, 0, 0), (0, 0, 0)], 4.0, clamps=Clamps(first=(0, 0, 1))),
            "Clamps: the cable has no bending_stiffness",
        ),
        (
            lambda: cable.tow(lambda t: (1, 0, 0), 4.0, 1.0, cable=beam(), clamps=Clamps(second=(1, 0, 0))),
            "clamped at the free tail",
        ),
        (
            lambda: cable.pull_out(lambda t: (1, 0, 0), 1.0, cable=beam(), clamps=Clamps(second=(1, 0, 0))),
            "clamped at the drum; only what a cable.Brake holds",
        ),
        (
            lambda: cable.Tether(
                beam(),
                ends=[(4, 0, 0), (0, 0, 0)],
                winch=cable.PayOutRate(rate=1.0),
                clamps=Clamps(second=(1, 0, 0)),
            ),
            "Tether: the second end is clamped",
        ),
        (
            lambda: cable.tow(
                lambda t: (1, 0, 0), 4.0, 1.0, cable=beam(), clamps=Clamps(first=(1, 0, 0)), scheme="lumped"
            ),
            "does not know clamped ends; use 'moving_end'",
        ),
    ],
)
def test_what_makes_no_sense_is_refused(call, words):
    with pytest.raises(UserError, match=words):
        call()
