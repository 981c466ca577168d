"""Time steps of the coupled run: how little they matter, and that what they cost falls with their square.

Verifies: halving both steps changes the speed on fig6 by less than 0.1 % (asked; measured 2e-5), second order of speed,
heading, depth and tension in the exchange step, with the hull step at a fifth of it. Configuration of the order: a turn
and climb from 0.9 m/s with 5 m of cable, commands held, friction at the drum; errors against steps of 0.2/64 s. The
tension stops at 2e-6 N, the mark of nodes that come in at whole steps, so only its first steps are fitted.
"""

import dataclasses

import numpy as np
import pytest

STEPS = 0.2 / 2.0 ** np.arange(5)
TURN_AND_CLIMB = {
    "held": (22.0, 0.06, 0.02, 0.02),
    "duration": 12.0,
    "start": {"surge_speed": 0.9, "wet_length": 5.0},
    "drum": {"friction_torque": 0.005},
}


@pytest.fixture(scope="module")
def refined(trial_of, simulate):
    """Runs with steps that are halved five times, and a reference with steps another four times shorter."""
    trial = trial_of(**TURN_AND_CLIMB)
    return [
        simulate(dataclasses.replace(trial, cable_step=step, hull_step=0.2 * step))
        for step in (*STEPS, STEPS[-1] / 4.0)
    ]


def errors(runs, channel):
    """Return the largest error of each run but the last, against the last, at the times of the coarsest."""

    def coarse(run):
        return run[channel].values[:: round(STEPS[0] / float(run["time"][1]))]

    return [np.abs(coarse(run) - coarse(runs[-1]))[5:].max() for run in runs[:-1]]


@pytest.mark.parametrize("channel", ["surge_speed", "heading", "depth", "cable_length"])
def test_the_coupled_scheme_is_of_second_order(channel, refined):
    assert np.polyfit(np.log(STEPS), np.log(errors(refined, channel)), 1)[0] > 1.9


def test_the_tension_is_of_second_order_down_to_the_mark_of_new_nodes(refined):
    error = errors(refined, "cable_tension")
    assert np.polyfit(np.log(STEPS[:3]), np.log(error[:3]), 1)[0] > 1.9
    assert error[-1] < 1e-5


def test_halving_both_steps_changes_the_speed_of_fig6_by_less_than_a_thousandth_everywhere(
    trial_of, simulate
):
    plain = simulate("fig6")["surge_speed"].values[1:]
    halved = simulate(trial_of(hull_step=0.01, cable_step=0.05))["surge_speed"].values[2::2]
    assert (np.abs(plain - halved) < 1e-3 * halved).all()  # at every time, from the first step on


def test_shorter_segments_change_the_speed_of_fig6_by_less_than_a_thousandth(trial_of, simulate):
    plain = simulate("fig6")["surge_speed"].values[1:]
    finer = simulate(trial_of(segment_length=0.25))["surge_speed"].values[1:]
    assert (np.abs(plain - finer) < 1e-3 * finer).all()


@pytest.mark.parametrize("name", ["wide_turn", "spiral", "dive", "zigzag"])
def test_halving_both_steps_changes_the_speed_of_other_trials_little_too(name, trial_of, simulate):
    plain = simulate(name)["surge_speed"].values[1:]
    halved = simulate(trial_of(name, hull_step=0.01, cable_step=0.05))["surge_speed"].values[2::2]
    assert (np.abs(plain - halved) < 1e-3 * halved).all()


def test_the_cable_may_take_longer_steps_than_the_hull(trial_of, simulate):
    """Ten hull steps to an exchange, or one: the same run within a thousandth of the top speed."""
    many = simulate(trial_of(hull_step=0.01, cable_step=0.1))["surge_speed"].values
    one = simulate(trial_of(hull_step=0.1, cable_step=0.1))["surge_speed"].values
    assert np.abs(many - one).max() < 1e-3 * many.max()
