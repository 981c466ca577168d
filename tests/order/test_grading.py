"""Segments that grow with the distance from the tow point, Δs + g s, keep what matters at the vehicle.

Verifies: `grading=` of `cable.pull_out`: lengths of the segments, how many there are, the exact straight pull, and the
tow force of smooth manoeuvres against segments of 6 cm. Tolerance: 1e-7 of the straight pull, as without grading; in
manoeuvres, 0.25 m + 0.05 s may err by twice what 0.25 m everywhere does, 1e-3 at most (measured: 1.6 and 1.0 times),
with half as many segments.
"""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable

DURATION, SEGMENT = 16.0, 0.25
DRUM = cable.DrumProperties(friction_torque=0.005)
TABLE_1 = cable.CableProperties()


def eased(x):
    """Return the way from 0 to 1 over 0 ≤ x ≤ 1, with three continuous derivatives."""
    x = np.clip(x, 0.0, 1.0)
    return x**4 * (35.0 - 84.0 * x + 70.0 * x**2 - 20.0 * x**3)


def dive(t):
    angle = np.pi / 3.0 * eased((t - 2.0) / 12.0)
    return np.cos(angle), 0.0, np.sin(angle)


def helix(t):
    angle, climb = 0.2 * max(t - 3.0, 0.0) * eased((t - 3.0) / 6.0), 0.2 * eased((t - 1.0) / 4.0)
    return np.cos(climb) * np.cos(angle), np.cos(climb) * np.sin(angle), np.sin(climb)


MANOEUVRES = {"dive": dive, "helix": helix}


@cache
def pulled(name, segment_length, grading):
    run = cable.pull_out(
        MANOEUVRES[name],
        DURATION,
        drum=DRUM,
        scheme=cable.MovingEnd(segment_length=segment_length, grading=grading),
    )
    assert run.outcome.completed, run.outcome.message
    return run


def error(name, grading):
    """Return the error of the tow force, as a share of its largest value."""
    fine = pulled(name, SEGMENT / 4.0, 0.0)
    gaps = np.linalg.norm(pulled(name, SEGMENT, grading).tow_force - fine.tow_force, axis=1)
    return gaps[10:].max() / fine.tow_tension.max()


@pytest.mark.parametrize("grading", [0.02, 0.2])
@pytest.mark.parametrize("friction", [0.0, 0.005])
def test_a_straight_pull_stays_exact(grading, friction):
    drum = cable.DrumProperties(friction_torque=friction)
    run = cable.pull_out(lambda _: (1.0, 0.0, 0.0), 100.0, drum=drum, scheme=cable.MovingEnd(grading=grading))
    assert run.outcome.completed, run.outcome.message
    rubbing = 10.0 * friction / np.sqrt(1.0 + 1e-6)  # rounded off at rest, over 1 mm/s (`cable.drum`)
    exact = rubbing + TABLE_1.tangential_drag * run.length
    assert_allclose(run.tow_tension[2:], exact[2:], rtol=1e-7)
    assert_allclose(run.length, run.time + 1e-6, rtol=1e-9)


@pytest.mark.parametrize("grading", [0.0, 0.02, 0.1])
def test_segments_are_as_long_as_they_were_asked_for(grading):
    """Straight and inextensible, chords are lengths; s is where a segment starts. All but the last, which grows."""
    run = cable.pull_out(
        lambda _: (1.0, 0.0, 0.0),
        60.0,
        drum=DRUM,
        scheme=cable.MovingEnd(grading=grading, segment_length=SEGMENT),
    )
    lengths = np.linalg.norm(np.diff(run.shapes[-1], axis=0), axis=1)
    starts = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    assert_allclose(lengths[:-1], (SEGMENT + grading * starts)[:-1], rtol=1e-9)
    assert lengths[-1] < 1.5 * (SEGMENT + grading * starts[-1]) + 1e-9


@pytest.mark.parametrize("grading", [0.0, 0.05])
def test_the_first_segments_are_shorter_where_that_is_asked_for(grading):
    """Node j at (jΔs)²/4L₀ up to L₀, as with grading, and as long as ever beyond it."""
    run = cable.pull_out(
        lambda _: (1.0, 0.0, 0.0),
        10.0,
        drum=DRUM,
        scheme=cable.MovingEnd(grading=grading, segment_length=SEGMENT, run_in=2.0),
    )
    nodes = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(run.shapes[-1], axis=0), axis=1))])
    beyond = nodes[:-1] >= 2.0 - 1e-9
    assert_allclose(np.diff(nodes)[beyond][:-1], (SEGMENT + grading * nodes[:-1][beyond])[:-1], rtol=1e-9)
    if not grading:
        assert_allclose(nodes[:17], (SEGMENT * np.arange(17)) ** 2 / 8.0, rtol=1e-9)
    assert nodes[1] == pytest.approx(SEGMENT**2 / 8.0, rel=1e-9)


def test_their_number_grows_with_the_logarithm_of_the_length():
    """N segments are Δs ((1 + g)^N − 1)/g long."""
    counts = []
    for duration in (100.0, 1000.0):
        run = cable.pull_out(
            lambda _: (1.0, 0.0, 0.0),
            duration,
            drum=DRUM,
            scheme=cable.MovingEnd(time_step=1.0, grading=0.05),
        )
        expected = np.log1p(0.05 * duration / 0.5) / np.log1p(0.05)
        counts.append(len(run.shapes[-1]) - 1)
        assert abs(counts[-1] - expected) <= 2.0
    assert counts[1] < 2.5 * counts[0]


@pytest.mark.parametrize("name", MANOEUVRES)
def test_a_manoeuvre_hardly_feels_it(name):
    even, graded = error(name, 0.0), error(name, 0.05)
    assert graded < 1e-3
    assert graded < 2.0 * even
    nodes = [len(pulled(name, SEGMENT, grading).shapes[-1]) for grading in (0.0, 0.05)]
    assert nodes[1] < 0.52 * nodes[0]


@pytest.mark.parametrize("name", MANOEUVRES)
def test_more_grading_costs_more(name):
    """Second order in the longest segments: what far segments miss is seen when they are long enough."""
    assert error(name, 0.05) < error(name, 0.1) < error(name, 0.2) < 1e-2


def test_what_goes_out_graded_comes_in_again():
    """A winch takes segments of all lengths back to nothing."""
    run = cable.pull_out(
        lambda t: (np.sin(np.pi * t / 20.0), 0.0, 0.0),
        40.0,
        drum=cable.ConstantTension(tension=0.6),
        scheme=cable.MovingEnd(grading=0.1),
    )
    assert run.outcome.completed, run.outcome.message
    exact_length = 20.0 / np.pi * (1.0 - np.cos(np.pi * run.time / 20.0)) + 1e-6
    assert_allclose(run.length, exact_length, rtol=0, atol=1e-7)
    assert len(run.shapes[-1]) == 2
