"""Errors of the moving-end scheme fall with the square of step and segment, in smooth three-dimensional manoeuvres.

Verifies: slopes of log error over log step and log segment, five refinements each, on the tow force; and how far half a
metre and a tenth of a second are from the converged force. Configuration: 60° dive, 180° turn (radii down to 1.7 m),
helix of 5 m radius; they begin and change without kinks (ramps with three derivatives). Table 1 with friction at the
drum, C_f/R_d = 0.05 N; without it a layer at the free drum, where T → 0, leaves a floor of 2e-4. Tolerance: slopes of
1.9; in space the coarsest segments of a tight turn are not yet asymptotic, so there the finest pairs must show it.
"""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import cable

DURATION = 16.0


def ramp(x):
    """From 0 to 1 over 0 ≤ x ≤ 1, with three continuous derivatives."""
    x = np.clip(x, 0.0, 1.0)
    return x**4 * (35.0 - 84.0 * x + 70.0 * x**2 - 20.0 * x**3)


def ramp_integral(x):
    """∫ ramp from 0 to x, a straight line beyond 1."""
    y = np.clip(x, 0.0, 1.0)
    return 7.0 * y**5 - 14.0 * y**6 + 10.0 * y**7 - 2.5 * y**8 + np.maximum(x - 1.0, 0.0)


def heading_for(pitch, heading):
    return np.cos(pitch) * np.cos(heading), np.cos(pitch) * np.sin(heading), -np.sin(pitch)


MANOEUVRES = {
    "dive": lambda t: heading_for(-np.pi / 3.0 * ramp((t - 2.0) / 12.0), 0.0),
    "turn": lambda t: heading_for(0.0, np.pi * ramp((t - 2.0) / 12.0)),
    "helix": lambda t: heading_for(-0.2 * ramp((t - 1.0) / 4.0), 0.8 * ramp_integral((t - 1.0) / 4.0)),
}
every_manoeuvre = pytest.mark.parametrize("name", MANOEUVRES)


@cache
def force(name, step, segment_length, friction=0.005):
    """Return the tow force at whole multiples of 0.8 s from 4 s on (n, 3). [N]"""
    drum = cable.DrumProperties(friction_torque=friction)
    run = cable.pull_out(
        MANOEUVRES[name],
        DURATION,
        drum=drum,
        scheme=cable.MovingEnd(time_step=step, segment_length=segment_length),
    )
    assert run.outcome.completed, run.outcome.message
    return run.tow_force[:: round(0.8 / step)][5:]


def slope(sizes, errors):
    return np.polyfit(np.log(sizes), np.log(errors), 1)[0]


@every_manoeuvre
def test_second_order_in_time(name):
    """Segments of 12.5 cm: with longer ones the marks of nodes that come in, 2e-5 N, show below 0.05 s."""
    steps = 0.8 / 2.0 ** np.arange(6)
    exact = force(name, 0.8 / 128, 0.125)
    errors = [np.abs(force(name, step, 0.125) - exact).max() for step in steps]
    assert slope(steps, errors) > 1.9


@every_manoeuvre
def test_second_order_in_space(name):
    segments = 1.0 / 2.0 ** np.arange(5)
    exact = force(name, 0.05, 1.0 / 64)
    errors = [np.abs(force(name, 0.05, length) - exact).max() for length in segments]
    assert slope(segments, errors) > 1.8
    assert slope(segments[-3:], errors[-3:]) > 1.9


@pytest.mark.long
@every_manoeuvre
def test_second_order_when_both_are_refined_together(name):
    """Changes between halvings, so that no reference is needed: each is a quarter of the one before."""
    runs = [force(name, 0.4 / n, 1.0 / n) for n in (1, 2, 4, 8, 16, 32)]
    changes = [np.abs(fine - coarse).max() for coarse, fine in pairwise(runs)]
    assert slope(0.5 ** np.arange(5), changes) > 1.9


def turning(rate, total, start=4.0, soft=2.0):
    """Return an angle that turns at a rate [rad/s] by `total` [rad], with soft ends of `soft` seconds."""

    def angle(t):
        started, ended = (t - start) / soft, (t - start - total / rate) / soft
        return rate * soft * (ramp_integral(started) - ramp_integral(ended))

    return angle


DIVING, ROUND = turning(np.radians(6.0), np.pi / 3.0), turning(np.radians(6.0), np.pi)
AT_THE_PAPERS_RATE = {
    "dive": (lambda t: heading_for(-DIVING(t), 0.0), 24.0),
    "turn": (lambda t: heading_for(0.0, ROUND(t)), 40.0),
    "helix": (MANOEUVRES["helix"], 24.0),
}


@pytest.mark.long
@pytest.mark.parametrize("friction", [0.0, 0.005], ids=["free drum", "rubbing drum"])
@pytest.mark.parametrize(
    ("name", "in_tension", "in_force"),
    [("dive", 2.0e-4, 5e-4), ("turn", 3.0e-4, 8e-4), ("helix", 4e-4, 1.2e-3)],
)
def test_half_a_metre_and_a_tenth_of_a_second_are_close_to_converged(name, in_tension, in_force, friction):
    """Share of the largest pull, at the paper's 6°/s; measured 1.3e-4, 2.0e-4, 2.2e-4 in tension, more in direction.

    Direction: 3e-4, 5e-4, 7e-4 rad. Against an extrapolation from 6 cm, good to 2e-5 with friction, 1e-4 without.
    """
    motion, duration = AT_THE_PAPERS_RATE[name]
    drum = cable.DrumProperties(friction_torque=friction)

    def pull(step, segment_length):
        run = cable.pull_out(
            motion, duration, drum=drum, scheme=cable.MovingEnd(time_step=step, segment_length=segment_length)
        )
        return run.tow_force[:: round(0.1 / step)][30:]

    coarse, fine = pull(0.025, 0.125), pull(0.0125, 0.0625)
    exact = fine + (fine - coarse) / 3.0
    most = np.linalg.norm(exact, axis=1).max()
    ours = pull(0.1, 0.5)
    assert np.abs(ours - exact).max() < in_force * most
    assert np.abs(np.linalg.norm(ours, axis=1) - np.linalg.norm(exact, axis=1)).max() < in_tension * most


@every_manoeuvre
def test_the_tow_force_is_smooth_from_step_to_step(name):
    """No staircase, no mark where a node comes in that could be seen: second differences below 5e-4 of the pull."""
    drum = cable.DrumProperties(friction_torque=0.005)
    run = cable.pull_out(MANOEUVRES[name], DURATION, drum=drum)
    roughness = np.abs(np.diff(run.tow_force[20:], 3, axis=0)).max()
    assert roughness < 5e-4 * run.tow_tension.max()
