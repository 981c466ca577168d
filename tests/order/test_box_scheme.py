"""The second formulation (angles, TR-BDF2, moving end): exact where it can be, second order elsewhere.

Verifies: straight pull with acceleration, drum inertia and friction, T(0) = (m u' + ½ρπdCt u²) S +
(I_d u'/R_d + C_f)/R_d; the dive of section 4.1 (ii) beside the prototype; smooth manoeuvres refined.
Tolerances: rounding (1e-12); slopes within 0.15 of 2; the prototype's printed digits.
"""

from itertools import pairwise

import numpy as np
import pytest

from cable import CableProperties, Current, DrumProperties, Equation7, pull_out

pytestmark = pytest.mark.long


def pull_out_boxes(tow_velocity, duration, step, *, segment_length=0.5, **others):
    scheme = Equation7(time_step=step, segment_length=segment_length)
    return pull_out(tow_velocity, duration, scheme=scheme, **others)


DRAG = 0.5 * 1000.0 * np.pi * 0.0025 * 0.01


def helix(time):
    return np.cos(0.2 * time), np.sin(0.2 * time), -0.2


def smooth_dive(time):
    """Pitch falls by 60° between 0 and 12 s, without kinks."""
    x = np.clip(time / 12.0, 0.0, 1.0)
    pitch = -np.radians(60.0) * x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    return np.cos(pitch), 0.0, -np.sin(pitch)


def dive(time):
    """The dive of section 4.1 (ii), tow point at (−0.5, 0, 0)."""
    rate = np.radians(-6.0) if 10.0 < time <= 20.0 else 0.0
    pitch = np.radians(-6.0) * np.clip(time - 10.0, 0.0, 10.0)
    w = 0.5 * rate
    return np.cos(pitch) + w * np.sin(pitch), 0.0, -np.sin(pitch) + w * np.cos(pitch)


def slopes(errors):
    """Orders between halvings."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@pytest.mark.parametrize(("step", "segment_length"), [(0.5, 1.0), (0.1, 0.5), (0.33, 0.2)])
def test_straight_pull_is_exact_at_every_step(step, segment_length):
    run = pull_out_boxes(lambda _: (1.0, 0.0, 0.0), 10.0, step, segment_length=segment_length)
    assert run.outcome.completed
    np.testing.assert_allclose(run.length, run.time, rtol=1e-12)
    np.testing.assert_allclose(run.tow_force[:, 0], -DRAG * run.time, atol=1e-12)
    np.testing.assert_allclose(run.tow_force[:, 1:], 0.0, atol=1e-14)


def test_tension_of_an_accelerating_pull_with_a_heavy_drum_is_of_second_order_at_every_step():
    drum, errors = DrumProperties(inertia=0.002, friction_torque=0.01), []
    for step in (0.4, 0.2, 0.1, 0.05):
        run = pull_out_boxes(lambda t: (0.5 + 0.3 * np.sin(0.5 * t), 0.0, 0.0), 8.0, step, drum=drum)
        t = run.time
        u, a = 0.5 + 0.3 * np.sin(0.5 * t), 0.15 * np.cos(0.5 * t)
        S = 0.5 * t + 0.6 * (1.0 - np.cos(0.5 * t))
        exact = (0.0049 * a + DRAG * u * u) * S + (0.002 * a / 0.1 + 0.01) / 0.1
        errors.append(np.abs(run.tow_tension - exact)[1:].max())
    np.testing.assert_allclose(slopes(errors), 2.0, atol=0.15)
    assert errors[-1] < 2e-6


def test_the_dive_has_the_prototypes_tension_and_length():
    run = pull_out_boxes(dive, 30.0, 0.1)
    assert run.tow_tension[-1] == pytest.approx(0.977, abs=5e-4)
    assert run.length[-1] == pytest.approx(28.239, abs=2e-3)
    assert np.abs(np.diff(run.tow_tension, 2)[-80:]).max() < 2e-5  # smooth: no staircase


def test_halving_step_and_segment_quarters_the_change_of_the_tow_force():
    """From 4 m, 0.8 s to 0.5 m, 0.1 s; below 0.25 m the layer at a free drum takes over (`box_scheme`)."""
    runs = [
        pull_out_boxes(smooth_dive, 16.0, 0.8 / n, segment_length=4.0 / n).tow_force[::n]
        for n in (1, 2, 4, 8)
    ]
    changes = [np.abs(a[-6:] - b[-6:]).max() for a, b in pairwise(runs)]
    assert (slopes(changes) > 1.9).all()
    assert changes[-1] < 5e-4


def test_turning_or_mirroring_a_helix_turns_or_mirrors_the_force():
    angle = np.radians(77.0)
    R = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    mirror = np.diag([1.0, -1.0, 1.0])
    plain = pull_out_boxes(helix, 20.0, 0.2)
    for Q in (R, mirror, R @ mirror):
        other = pull_out_boxes(lambda t, Q=Q: Q @ helix(t), 20.0, 0.2)
        np.testing.assert_allclose(other.tow_force, plain.tow_force @ Q.T, atol=1e-9)


def test_the_cable_closes_between_drum_and_tow_point_to_second_order():
    gaps = []
    for step, segment_length in ((0.4, 2.0), (0.2, 1.0)):
        run = pull_out_boxes(helix, 20.0, step, segment_length=segment_length)
        t = run.time
        tow = np.stack([np.sin(0.2 * t) / 0.2, (1.0 - np.cos(0.2 * t)) / 0.2, -0.2 * t], axis=1)
        ends = np.array([x[0] for x in run.shapes])
        gaps.append(np.linalg.norm(ends - tow, axis=1).max())
    assert gaps[1] < 0.04  # of 20 m, wound with a radius of 5 m, in segments of 1 m
    assert gaps[0] / gaps[1] > 3.0


def test_a_stretching_cable_in_a_cross_current_pays_out_less_than_it_covers():
    run = pull_out_boxes(
        lambda _: (1.0, 0.0, 0.0),
        20.0,
        0.2,
        cable=CableProperties(compliance=0.05),
        current=Current.uniform((0.0, 0.1, 0.0)),
    )
    assert run.outcome.completed
    assert run.tow_force[-1, 1] > 0.0  # the current sets east and pushes the cable, and the vehicle, east
    assert run.length[-1] < 20.0


def test_a_cable_that_would_have_to_push_stops_the_run_and_says_so():
    run = pull_out_boxes(lambda t: (max(1.0 - 0.2 * t, 0.0), 0.0, 0.0), 8.0, 0.1)
    assert not run.outcome.completed
    assert "goes slack" in run.outcome.message
    assert "cable.MovingEnd" in run.outcome.message
    assert run.diagnostics()["smallest_tension_N"] > -1e-6
