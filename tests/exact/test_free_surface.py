"""A free surface: drafts, a rope that floats in a current, arches that would be above it, half-wet lines, energy.

Verifies: that the shares of a segment and their derivatives are integrals of the circle's; the draft of a rope, whose
wet share is its density over the water's, and of a spherical float; that a rope between two ends at the surface lies
there, bowed by a current as one with the drag of the wetted share; a line held below that would arch above the surface;
that a line through the surface weighs its weight in air above it; that energy is booked when a rope is drawn out of the
water; mirror; a tow; messages. Tolerance: 100 segments, or said.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.optimize import brentq

import cable
from cable.moving_end import wetting
from cable.properties import GRAVITY
from subzero.errors import UserError
from subzero.jit import compiled

RADIUS = 0.02
AREA = np.pi * RADIUS**2


@compiled
def shares(a, b, out):
    out[0], out[1], out[2], out[3], out[4] = wetting.dry_segment(a, b)
    out[5] = wetting.dry_energy(a, b)


def dry(u):
    """Return the dry share of a circle, from its segment's angle."""
    half = np.arccos(np.clip(u, -1.0, 1.0))
    return (half - np.sin(half) * np.cos(half)) / np.pi


def moment(x, a, b, power):
    """Return the dry share at x of a segment from depth a to b, times a power of x."""
    return x**power * dry(a + x * (b - a))


def test_shares_are_integrals_of_the_circle():
    out, more, less = np.zeros(6), np.zeros(6), np.zeros(6)
    for a, b in (
        (-0.3, 0.5),
        (0.2, 0.21),
        (-4.0, 0.3),
        (0.9, -7.0),
        (-2.0, 5.0),
        (0.995, 1.4),
        (-3.0, -2.0),
        (1.0, 2.0),
    ):
        shares(a, b, out)
        kinks = [x for x in ((-1.0 - a) / (b - a), (1.0 - a) / (b - a)) if 0.0 < x < 1.0]
        whole = [quad(moment, 0.0, 1.0, (a, b, p), points=kinks or None)[0] for p in (0, 1)]
        assert_allclose(out[:2], [whole[0] - whole[1], whole[1]], atol=2e-7)
        for column, (da, db) in enumerate(((1e-6, 0.0), (0.0, 1e-6))):
            shares(a + da, b + db, more)
            shares(a - da, b - db, less)
            assert_allclose((more[:2] - less[:2]) / 2e-6, out[2 + column : 4 + column], atol=3e-5)
            assert_allclose((more[5] - less[5]) / 2e-6, -out[column], atol=3e-5)


def rope(share, **values):
    """Return a round rope that floats with a share of its volume in the water."""
    return cable.CableProperties(
        mass_per_length=share * 1000.0 * AREA, cross_section_area=AREA, diameter=2 * RADIUS, **values
    )


def depth_of(share):
    """Return how deep the axis of a cylinder is whose cross-section is wet by a share. [m]"""
    return RADIUS * brentq(lambda u: 1.0 - dry(u) - share, -1.0, 1.0)


@pytest.mark.long
@pytest.mark.parametrize("share", [0.3, 0.8])
def test_a_rope_between_two_ends_floats_with_its_draft_and_is_bowed_by_the_wetted_drag(share):
    deep, L, U = depth_of(share), 20.0, 0.5
    line = rope(share, tangential_drag_coefficient=0.0)
    rest = cable.hold([(18.0, 0.0, deep), (0.0, 0.0, deep)], L, (0.0, U, 0.0), cable=line, surface=0.0)
    assert_allclose(rest.shape[:, 2], deep, atol=1e-4 * RADIUS)
    # q cos²φ across makes tan φ = q s/T with an even T
    q = share * line.normal_drag * U * U
    t = np.diff(rest.shape, axis=0)
    t /= np.linalg.norm(t, axis=1)[:, None]
    assert_allclose(rest.segment_tensions, rest.segment_tensions.mean(), rtol=1e-4)
    pull = brentq(
        lambda T: 2.0 * T / q * np.arcsinh(0.5 * q * L / T) - 18.0,
        0.1 * q * L,
        100.0 * q * L,
    )
    assert rest.segment_tensions.mean() == pytest.approx(pull, rel=1e-3)
    assert rest.tow_force[1] == pytest.approx(rest.drum_force[1], rel=1e-4)


@pytest.mark.long
def test_a_float_has_the_draft_of_a_sphere_and_lifts_what_is_wet():
    """A clump below a float, on a weightless line: the float's wet volume carries its own weight and the clump's."""
    neutral = cable.CableProperties(
        mass_per_length=0.1, cross_section_area=1e-4, diameter=0.0113, compliance=1e-6
    )
    volume, mass = 0.02, 4.0
    line = cable.SectionedCable(
        sections=[cable.Section(20.0, neutral)], bodies=[cable.Body(10.0, mass=mass, volume=volume)]
    )
    rest = cable.hold([(8.0, 0.0, 6.0), (-8.0, 0.0, 6.0)], 20.0, cable=line, surface=0.0)
    radius = np.cbrt(0.75 * volume / np.pi)
    z = rest.shape[:, 2].min()
    u = z / radius
    lift = (1000.0 * volume * 0.25 * (2.0 + 3.0 * u - u**3) - mass) * GRAVITY
    assert z > -radius
    assert_allclose(
        rest.tow_force[2] + rest.drum_force[2], -lift, rtol=5e-4
    )  # the line is a little dry there
    assert_allclose(np.hypot(8.0, 6.0 - z), 10.0, rtol=1e-4)


@pytest.mark.long
def test_a_line_that_would_arch_above_the_surface_lies_on_it():
    """Its pull grows from H on the surface by ∫w dz down to the end, and is that of two catenaries for a thin rope."""
    line, deep, L, span = rope(0.4), 5.0, 27.0, 20.0
    top, lift = depth_of(0.4), -line.weight_in_water
    pulls = []
    for segments in (100, 200, 400):
        ends = [(span, 0.0, deep), (0.0, 0.0, deep)]
        rest = cable.hold(ends, L, cable=line, segment_length=L / segments, surface=0.0)
        pulls.append(-rest.tow_force[0])
        assert rest.shape[:, 2].min() == pytest.approx(top, abs=0.01 * RADIUS)
    missing = line.buoyancy * quad(lambda z: dry(z / RADIUS), top, RADIUS)[0]
    assert np.linalg.norm(rest.tow_force) - pulls[-1] == pytest.approx(
        lift * (deep - top) - missing, rel=1e-4
    )
    assert abs(pulls[1] / pulls[2] - 1.0) < 2e-4

    def closes(pull):
        leg = np.sqrt(
            (deep - top + pull / lift) ** 2 - (pull / lift) ** 2
        )  # of a catenary that is level above
        return 2.0 * pull / lift * np.arcsinh(leg * lift / pull) + (L - 2.0 * leg) - span

    assert pulls[-1] == pytest.approx(brentq(closes, 1e-3, 1e3), rel=0.015)


@pytest.mark.long
def test_a_line_hung_through_the_surface_weighs_its_weight_in_air_above_it():
    heavy, L = rope(1.6, compliance=1e-7), 10.0
    for up in (3.0, 3.04, 3.11):
        rest = cable.hold(
            [(0.0, 0.0, -up), (1e-3, 0.0, L - up + 1e-3)], L, cable=heavy, segment_length=0.25, surface=0.0
        )
        air = heavy.mass_per_length * GRAVITY * up
        assert_allclose(
            rest.tow_force[2] - -rest.drum_force[2], air + heavy.weight_in_water * (L - up), rtol=1e-4
        )


def drawn(east):
    """Return a run of a floating rope whose end goes up and down through the surface, and to one side."""
    deep = depth_of(0.6)
    start = cable.hold(
        [(9.0, 0.0, deep), (0.0, 0.0, deep)],
        10.0,
        (0.1, 0.2 * east, 0.0),
        cable=rope(0.6, compliance=1e-6),
        surface=0.0,
    )
    way = lambda t: (0.3 * np.sin(t), 0.5 * east * np.sin(t), -0.6 * np.sin(0.8 * t))  # noqa: E731
    return cable.pull_out(way, 6.0, drum=cable.Brake(), start=start, scheme=cable.MovingEnd(time_step=0.01))


@pytest.mark.long
def test_a_rope_that_is_pulled_off_a_drum_at_the_surface_stays_in_the_water():
    run = cable.pull_out(lambda t: (1.0, 0.0, 0.0), 4.0, cable=rope(0.6), surface=0.0)
    assert run.has_surface
    assert min(shape[:, 2].min() for shape in run.shapes) > -0.01


@pytest.mark.long
def test_energy_is_booked_when_a_rope_is_drawn_out_of_the_water_and_a_mirrored_run_is_mirrored():
    run, mirrored = drawn(1.0), drawn(-1.0)
    assert run.outcome.completed
    assert run.outcome.energy_residual < 0.01
    assert not any("above down = 0" in words for words in run.warnings)
    assert_allclose(
        mirrored.tow_force * (1.0, -1.0, 1.0), run.tow_force, atol=1e-5 * np.abs(run.tow_force).max()
    )


@pytest.mark.long
def test_a_rope_that_is_dipped_in_takes_the_momentum_of_its_water_and_half_of_the_work_is_lost():
    """Both ends go down evenly, without drag: the water of the rope gets σρA U² of energy for σρA U of momentum."""
    line = rope(2.0, compliance=1e-6, normal_drag_coefficient=0.0, tangential_drag_coefficient=0.0)
    start = cable.hold(
        [(5.001, 0.0, -0.04), (0.0, 0.0, -0.04)], 5.0, cable=line, segment_length=0.25, surface=0.0
    )
    down = lambda t: (0.0, 0.0, 1.0)  # noqa: E731
    drum = cable.MovingDrum(velocity=down, drum=cable.Brake())
    run = cable.pull_out(down, 0.1, drum=drum, start=start, scheme=cable.MovingEnd(time_step=0.001, rtol=0.0))
    assert run.outcome.energy_residual < 0.02


@pytest.mark.long
def test_a_towed_floating_rope_trails_on_the_surface():
    run = cable.tow(lambda t: (1.0, 0.0, 0.0), 20.0, 20.0, cable=rope(0.5), surface=0.0)
    assert run.outcome.completed
    assert np.abs((run.shapes[-1] - run.shapes[0][0])[:, 2]).max() < 0.2 * RADIUS
    line = rope(0.5)
    assert -run.tow_force[-1, 0] == pytest.approx(0.5 * line.tangential_drag * 20.0, rel=0.01)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: cable.tow(lambda t: (1, 0, 0), 5.0, 1.0, surface=0.0, scheme="lumped"),
            "does not know a free surface; use 'moving_end'",
        ),
        (lambda: cable.hold([(3, 0, 0), (0, 0, 0)], 4.0, surface=float("nan")), "surface is nan"),
    ],
)
def test_what_makes_no_sense_is_refused(call, words):
    with pytest.raises(UserError, match=words):
        call()
