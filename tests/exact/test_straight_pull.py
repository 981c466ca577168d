"""The straight pull of section 4.1 (i), whose solution is known.

Verifies: equations (30)-(37), with acceleration, drum inertia and friction added,

    T(0) = (m u' + ½ρπdC_t u|u|) S + (I_d u'/R_d + C_f)/R_d,    T(s) falls linearly to the drum,

force against the motion, all else zero. Configuration: Table 1 unless said. Tolerances: 1e-6 of the tension, what is
asked of the scheme (measured: 1e-9 at 0.1 s, 1e-8 at 0.033 s; its smoothed slack law is a strain of 1e-12 N/T);
rounding (1e-12 N) for what is zero; slopes of second order.
"""

import numpy as np
import pytest

import cable

K = 0.5 * 1000.0 * np.pi * 0.0025 * 0.01
"""½ρπdC_t of Table 1, written out: 0.03927 N per metre at 1 m/s. [N s²/m³]"""
NORTH = np.array([1.0, 0.0, 0.0])
ASKEW = np.array([0.6, -0.64, 0.48])


def ramp(x):
    """From 0 to 1 over 0 ≤ x ≤ 1, with three continuous derivatives."""
    x = np.clip(x, 0.0, 1.0)
    return x**4 * (35.0 - 84.0 * x + 70.0 * x**2 - 20.0 * x**3)


def ramp_slope(x):
    x = np.clip(x, 0.0, 1.0)
    return 140.0 * x**3 * (1.0 - x) ** 3


def steady(speed, step, segment_length, direction=NORTH, steps=40):
    """Pull at a constant speed."""
    run = cable.pull_out(
        lambda _: speed * direction,
        steps * step,
        scheme=cable.MovingEnd(time_step=step, segment_length=segment_length),
    )
    assert run.outcome.completed, run.outcome.message
    return run


@pytest.mark.parametrize("segment_length", [0.07, 0.5, 1.0])
@pytest.mark.parametrize(
    ("speed", "step"), [(1.0, 1.0), (1.0, 0.25), (1.0, 0.1), (2.5, 1.0), (2.5, 0.033), (0.3, 1.0)]
)
def test_tension_at_constant_speed_is_drag_times_length_at_every_step_odd_and_even(
    speed, step, segment_length
):
    """Eq. (37). The paper's own scheme has a staircase here: right at every second step only."""
    run = steady(speed, step, segment_length)
    np.testing.assert_allclose(run.length, speed * run.time + 1e-6, rtol=0, atol=2e-7)
    np.testing.assert_allclose(run.tow_tension[1:], K * speed**2 * run.length[1:], rtol=1e-6)
    from_start = K * speed**2 * (speed * run.time[1:] + 1e-6)  # a run starts with a micrometre of cable
    np.testing.assert_allclose(run.tow_tension[1:], from_start, rtol=1e-6)


def test_at_half_a_minute_the_tension_is_the_one_the_paper_prints():
    """1.178 N at 30 s (hull_parameters 1.2; the paper rounds 0.03927 to 0.0393)."""
    run = cable.pull_out(lambda _: NORTH, 30.0)
    np.testing.assert_allclose(run.tow_tension[[100, 200, 300]], [0.3927, 0.7854, 1.1781], atol=5e-5)


@pytest.mark.parametrize("step", [0.033, 0.01])
def test_a_slow_pull_in_short_steps_is_as_exact(step):
    """The tension is small, 1e-3 N, when the second segment comes: its smoothed strain may cost a jolt of 1e-7 N."""
    run = steady(0.3, step, 0.5, steps=round(5.0 / step))
    np.testing.assert_allclose(run.tow_tension[1:], K * 0.09 * run.length[1:], rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("direction", [NORTH, ASKEW], ids=["north", "askew"])
def test_the_cable_pulls_straight_back_and_in_no_other_direction(direction):
    """Exactly zero across when the motion is along an axis; rounding when it is askew."""
    run = steady(1.0, 0.1, 0.5, direction)
    along = run.tow_force @ direction
    assert (along[1:] < 0.0).all()
    across = run.tow_force - np.outer(along, direction)
    assert np.abs(across).max() <= (0.0 if direction is NORTH else 1e-12)


def test_nothing_holds_the_cable_at_a_free_drum_and_the_cable_closes():
    run = steady(1.0, 0.1, 0.5, ASKEW)
    assert np.abs(run.drum_tension).max() < 1e-12
    assert run.closure_error.max() < 1e-9
    line = run.shape(4.0)
    np.testing.assert_allclose(np.cross(line, ASKEW), 0.0, atol=1e-9)
    np.testing.assert_allclose(line[-1], 0.0, atol=1e-15)


@pytest.mark.parametrize(("speed", "step"), [(1.0, 0.1), (2.5, 1.0)])
def test_tension_falls_linearly_from_tow_point_to_drum(speed, step):
    """Eq. (34), T(s) = ½ρπdC_t U² (S − s), at every recorded node of every row, also where a node has just come in."""
    run = steady(speed, step, 0.5)
    for line, tension in zip(run.shapes[1:], run.tensions[1:], strict=True):
        exact = K * speed**2 * np.linalg.norm(line, axis=1)  # distance to the drum is S − s
        np.testing.assert_allclose(tension, exact, rtol=0, atol=1e-6 * exact[0])


def test_the_smoothing_of_slack_takes_no_visible_length():
    """A strain of 1e-12 N/T makes up less than a ten-millionth of a metre in half a minute."""
    run = cable.pull_out(lambda _: NORTH, 30.0)
    assert abs(run.length[-1] - 30.0 - 1e-6) < 1e-7


def accelerating(step, drum, times=8.0):
    """Return the largest error of T(0) and of T(S), and the run, from 0.6 to 1.4 m/s."""
    run = cable.pull_out(
        lambda t: (0.6 + 0.8 * ramp(t / times)) * NORTH,
        times,
        drum=drum,
        scheme=cable.MovingEnd(time_step=step),
    )
    assert run.outcome.completed, run.outcome.message
    u, rate = 0.6 + 0.8 * ramp(run.time / times), 0.8 / times * ramp_slope(run.time / times)
    at_drum = (drum.inertia * rate / drum.radius + drum.friction_torque) / drum.radius
    exact = (0.0049 * rate + K * u * u) * run.length + at_drum
    return np.abs(run.tow_tension - exact)[1:].max(), np.abs(run.drum_tension - at_drum)[1:].max(), run


@pytest.mark.parametrize(
    "drum",
    [
        cable.DrumProperties(),
        cable.DrumProperties(friction_torque=0.01),
        cable.DrumProperties(inertia=0.002, friction_torque=0.01),
        cable.DrumProperties(radius=0.25, inertia=0.02, friction_torque=0.02),
    ],
    ids=["free drum", "friction", "heavy drum", "large drum"],
)
def test_tension_of_an_accelerating_pull_is_of_second_order(drum):
    """Slope of log error over log step, five steps. The step matters only; here segments are never in the way."""
    steps = np.array([0.4, 0.2, 0.1, 0.05, 0.025])
    errors = [accelerating(step, drum)[0] for step in steps]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] > 1.9
    assert errors[-1] < 2e-5  # of 0.4 … 0.7 N


def test_the_drum_takes_what_it_needs_to_spin_up_and_what_it_rubs():
    drum = cable.DrumProperties(inertia=0.002, friction_torque=0.01)
    steps = np.array([0.2, 0.1, 0.05, 0.025])
    errors = [accelerating(step, drum)[1] for step in steps]
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] > 1.9
    assert accelerating(0.1, drum)[2].drum_tension[1:].min() > 0.09  # C_f/R_d = 0.1 N less a little inertia


def test_drum_friction_is_felt_whole_at_the_tow_point():
    """At constant speed friction adds C_f/R_d, no more and no less, and inertia adds nothing."""
    drum = cable.DrumProperties(inertia=1e-3, friction_torque=0.005)
    run = cable.pull_out(lambda _: NORTH, 5.0, drum=drum)
    np.testing.assert_allclose(run.tow_tension[1:], K * run.length[1:] + 0.05, rtol=1e-6)


def test_a_pull_that_starts_with_an_acceleration_has_the_inertia_of_the_drum_right_from_the_start():
    """T(S) = I_d u'/R_d², constant; 2 % for what a first step of first order may leave."""
    drum = cable.DrumProperties(inertia=0.002)
    run = cable.pull_out(
        lambda t: (1.0 + 0.15 * t) * NORTH, 2.0, drum=drum, scheme=cable.MovingEnd(time_step=0.05)
    )
    np.testing.assert_allclose(run.drum_tension[1:], 0.2 * 0.15, rtol=0.02)


def test_a_current_along_the_cable_counts_by_the_speed_through_the_water():
    """Galilean invariance, where the drum allows it: T(0) = ½ρπdC_t (U − J)|U − J| S, against and with the stream."""
    for stream in (-0.4, 0.3):
        run = cable.pull_out(lambda _: NORTH, 5.0, current=(stream, 0.0, 0.0))
        np.testing.assert_allclose(run.tow_tension[1:], K * (1.0 - stream) ** 2 * run.length[1:], rtol=1e-6)


def test_a_stretching_cable_pays_out_less_by_its_strain():
    """Ut − S = ∫eT ds = ½ e ½ρπdC_t U² S² to first order in the strain, which is 0.4 % here: within 2 % of 0.02 m."""
    run = cable.pull_out(lambda _: NORTH, 10.0, cable=cable.CableProperties(compliance=0.01))
    assert 10.0 - run.length[-1] == pytest.approx(0.5 * 0.01 * K * 100.0, rel=0.02)
