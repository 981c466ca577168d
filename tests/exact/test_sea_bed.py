"""A cable on a sea bed: closed forms at rest, friction in signs and sizes, rest that lasts, symmetry, energy, messages.

Verifies: the inextensible and the elastic catenary with a part on the bed, with and without friction (Jonkman, NREL
TP-500-41958, eq. 2-37 and 2-38); the second order of both ends' forces; what a slope adds to the tension; that a cable
that lies keeps its forces; friction along and across, as μ times weight; mirror; where the energy goes; messages.
Tolerance: a polygon of 200 segments is within 1e-4 of closed forms. Friction of held end segments is left out, half a
segment each: 1/N. A mirrored run is the same but for rounding.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

import cable
from cable import SeaBed
from subzero.errors import UserError

LENGTH, HEIGHT, SPAN = 100.0, 20.0, 93.0
HARD = 1e8
"""Ground into which the cable sinks by 0.1 mm. [N/m³]"""


def chain(**values):
    """A cable that weighs 1 N/m in water."""
    return cable.CableProperties(mass_per_length=0.2, cross_section_area=9.806e-5, diameter=0.012, **values)


def lifted(pull, weight, e):
    """Return how much of the cable a horizontal pull of the upper end lifts. [m]"""

    def height(length):
        return (np.hypot(pull, weight * length) - pull) / weight + 0.5 * e * weight * length**2 - HEIGHT

    return brentq(height, 1e-6, 100.0 * LENGTH)


def span(pull, weight, e, friction):
    """Return how far the upper end is from the anchor, of a cable that a pull lifts in part. [m]"""
    up = lifted(pull, weight, e)
    lies = LENGTH - up
    way = lies + pull / weight * np.arcsinh(weight * up / pull) + e * pull * LENGTH
    if friction > 0.0:
        held = lies - pull / (friction * weight)
        way += 0.5 * e * friction * weight * (max(held, 0.0) * held - lies * lies)
    return way


def held(cord, bed, segments=200, east=0.0):
    return cable.hold(
        [(SPAN, east, -HEIGHT), (0.0, 0.0, 0.0)],
        LENGTH,
        cable=cord,
        segment_length=LENGTH / segments,
        bed=bed,
    )


@pytest.mark.long
@pytest.mark.parametrize("friction", [0.0, 0.4, 2.0])
@pytest.mark.parametrize("compliance", [0.0, 2e-4])
def test_a_cable_on_a_bed_pulls_as_the_closed_form_says(compliance, friction):
    cord = chain(compliance=compliance)
    weight = cord.weight_in_water
    pull = brentq(lambda H: span(H, weight, compliance, friction) - SPAN, 1.0, 1e3)
    line = held(cord, SeaBed(depth=0.0, modulus=HARD, axial_friction=friction))
    up = lifted(pull, weight, compliance)
    assert_allclose(line.tow_force, [-pull, 0.0, weight * up], atol=1e-4 * weight * LENGTH)
    at_anchor = max(pull - friction * weight * (LENGTH - up), 0.0)
    half = (
        0.55 * LENGTH / 200 * friction * weight
    )  # of the friction: half a segment, and a little where it fades
    assert_allclose(line.drum_force[0], at_anchor, atol=half + 1e-4 * weight * LENGTH)


@pytest.mark.long
def test_forces_are_of_second_order_in_the_segments():
    """The point where the cable touches lies between nodes: the worst of several spans shows the order."""
    cord, counts, errors = chain(), (25, 50, 100, 200), []
    spans = SPAN + np.array([-2.0, -1.1, 0.0, 0.7])
    for segments in counts:
        worst = 0.0
        for way in spans:
            pull = brentq(lambda H, way=way: span(H, cord.weight_in_water, 0.0, 0.0) - way, 1.0, 1e3)
            ends = [(way, 0.0, -HEIGHT), (0.0, 0.0, 0.0)]
            bed = SeaBed(depth=0.0, modulus=1e10, axial_friction=0.0)
            line = cable.hold(ends, LENGTH, cable=cord, segment_length=LENGTH / segments, bed=bed)
            worst = max(worst, abs(line.tow_force[0] + pull) / pull)
        errors.append(worst)
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] > 1.8, errors


@pytest.mark.long
def test_on_a_slope_tension_grows_uphill_by_the_weight_along_it():
    cord, slope, L = chain(compliance=1e-4), 0.2, 30.0
    bed = SeaBed(depth=10.0, slope_north=slope, axial_friction=0.0, modulus=HARD)
    uphill = np.array([-1.0, 0.0, -slope]) / np.hypot(1.0, slope)
    line = cable.hold([30.1 * uphill + (0.0, 0.0, 10.0), (0.0, 0.0, 10.0)], L, cable=cord, bed=bed)
    inner = line.segment_tensions
    angle, share = np.arctan(slope), (inner.size - 1) / inner.size
    assert inner[0] - inner[-1] == pytest.approx(cord.weight_in_water * L * np.sin(angle) * share, rel=1e-6)
    assert bed.below(line.shape[1:-1]).min() > 0.0
    assert bed.below(line.shape).max() == pytest.approx(bed.sinkage(cord), rel=0.03)  # cos 11.3° is 0.98


@pytest.mark.long
def test_a_cable_that_lies_keeps_its_forces():
    """Friction holds without creeping: in 20 s the pull at the anchor changes by what Newton's method leaves."""
    line = held(chain(compliance=1e-5), SeaBed(depth=0.0), segments=50)
    run = cable.pull_out(lambda t: (0.0, 0.0, 0.0), 20.0, drum=cable.Brake(), start=line)
    assert run.outcome.completed
    assert_allclose(run.tow_force[-1], line.tow_force, rtol=1e-5, atol=1e-5)
    assert_allclose(run.drum_tension[-1], line.tensions[-1], rtol=1e-4)


@pytest.mark.long
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_cable_drawn_along_the_bed_pulls_with_friction_times_weight(friction):
    """The tow point is held at the surface of the bed, and takes 0.2 % of the weight off it."""
    cord, L, n, speed = chain(), 20.0, 40, 0.1
    bed = SeaBed(depth=0.0, axial_friction=friction, lateral_friction=2.0)
    run = cable.tow(lambda t: (speed, 0.0, 0.0), L, 20.0, cable=cord, bed=bed)
    lies, drag = L * (1.0 - 0.5 / n), cord.tangential_drag * speed**2 * L
    assert -run.tow_force[-1, 0] == pytest.approx(friction * cord.weight_in_water * lies + drag, rel=3e-3)


@pytest.mark.long
@pytest.mark.parametrize("friction", [0.2, 0.6])
def test_a_cable_drawn_across_the_bed_pulls_with_friction_times_weight(friction):
    """Both ends go sideways until all of the cable follows; no drag but the bed's, on what the ends do not carry."""
    cord, L, n, speed = chain(compliance=1e-4, normal_drag_coefficient=0.0), 10.0, 20, 0.1
    bed = SeaBed(depth=0.0, axial_friction=0.0, lateral_friction=friction)
    ends, velocity = np.array([(L, 0.0, 0.0), (0.0, 0.0, 0.0)]), np.array([0.0, speed, 0.0])
    tether = cable.Tether(cord, length=L, ends=ends, segments=n, bed=bed)
    pulls = [tether.step(0.1, [(end + 0.1 * k * velocity, velocity) for end in ends]) for k in range(1, 301)]
    forces = np.mean(pulls[150:], axis=0)  # it swings a little
    lies = cord.weight_in_water * L - forces[:, 2].sum()
    assert -forces[:, 1].sum() == pytest.approx(friction * lies, rel=0.02)


def circling(radius, period, east=1.0):
    """Return the velocity of an upper end on a circle that begins smoothly, tilted to one side."""
    omega = 2.0 * np.pi / period

    def velocity(t):
        grown = min(t / period, 1.0) ** 2
        turn = omega * t
        side, up = radius * omega * grown * np.cos(turn), radius * omega * grown * np.sin(turn)
        return side, 0.5 * east * side, up

    return velocity


def run_of(east, bed=None):
    bed = SeaBed(depth=0.0, slope_east=0.05 * east, modulus=1e6) if bed is None else bed
    cord = chain(compliance=1e-5)
    start = held(cord, bed, segments=40, east=3.0 * east)
    return cable.pull_out(
        circling(2.0, 6.0, east),
        12.0,
        drum=cable.Brake(),
        start=start,
        scheme=cable.MovingEnd(time_step=0.02),
    )


@pytest.fixture(scope="module")
def moved():
    return run_of(1.0)


@pytest.mark.long
def test_a_mirrored_run_gives_mirrored_forces(moved):
    mirrored = run_of(-1.0).tow_force * (1.0, -1.0, 1.0)
    assert_allclose(mirrored, moved.tow_force, atol=1e-6 * np.abs(moved.tow_force).max())


@pytest.mark.long
def test_what_the_bed_takes_is_booked_and_no_node_sinks_in_by_a_diameter(moved):
    assert moved.outcome.completed
    assert moved.outcome.energy_residual < 0.01
    bed = SeaBed(depth=0.0, slope_east=0.05, modulus=1e6)
    anchor = moved.shapes[0][-1]
    assert max(bed.below(shape - anchor).max() for shape in moved.shapes) < chain().diameter


@pytest.mark.long
def test_a_towed_cable_trails_on_the_bed():
    """Steadily towed over the bed, what lies pulls with μ times its weight, besides its drag."""
    cord, bed = chain(), SeaBed(depth=2.0, axial_friction=0.5, modulus=1e6)
    run = cable.tow(lambda t: (0.3, 0.0, 0.0), 40.0, 60.0, cable=cord, bed=bed)
    assert run.outcome.completed
    places = run.shapes[-1] - run.shapes[0][0]
    lies = (places[:, 2] > 2.0 - 1e-3).mean() * 40.0
    assert places[:, 2].max() < 2.0 + 2.0 * bed.sinkage(cord)
    drag = cord.tangential_drag * 0.3**2 * 40.0
    assert -run.tow_force[-1, 0] == pytest.approx(0.5 * cord.weight_in_water * lies + drag, rel=0.04)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: held(chain(), SeaBed(depth=-5.0)),
            r"hold: end 1 is 5 m below the sea bed.*an end holds no cable",
        ),
        (
            lambda: cable.Tether(chain(), ends=[(0, 0, 0), (0, 0, 9)], bed=SeaBed(depth=8.0)),
            "end 1 is 1 m below",
        ),
        (lambda: SeaBed(depth=3.0, axial_friction=-0.1), "axial_friction is -0.1"),
        (lambda: SeaBed(depth=3.0, slope_east=4.0), "slope_east is 4"),
        (
            lambda: cable.tow(lambda t: (1, 0, 0), 5.0, 1.0, bed=SeaBed(depth=3.0), scheme="lumped"),
            "'lumped' does not know a sea bed; use 'moving_end'",
        ),
        (
            lambda: cable.pull_out(lambda t: (1, 0, 0), 1.0, bed=SeaBed(depth=3.0), scheme="equation7"),
            "does not know a sea bed; use 'moving_end'",
        ),
    ],
)
def test_what_makes_no_sense_is_refused(call, words):
    with pytest.raises(UserError, match=words):
        call()
