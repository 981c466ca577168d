"""The linear models of a vehicle on its cable do what the coupled simulation does when it is disturbed a little.

Verifies: `autopilot.linearise_along` (the cable grows) and `autopilot.linearise` (frozen at the length in the middle of
the run) against half the difference of two runs of `subzero.simulate` that are disturbed by as much either way, a
hundredth of a degree or of a revolution a second (`benchmarks.autopilot.disturbed`); margins against flights whose
gain is raised (`benchmarks.autopilot.raised`). Tolerance: along a run 5 % of the largest deviation over 12 s, frozen
25 %; of the answer to a sine 10 % and 10 degrees, where the cable grows by less than two fifths of its length in a
period; 10 % of a gain margin; 15 % for a motion of many degrees with the drag across the cable made linear.
"""

import dataclasses

import numpy as np
import pytest

import subzero
from benchmarks.autopilot import disturbed
from benchmarks.autopilot.disturbed import INPUTS, SEEN, STEP, deviations, error, frozen, held, pulse
from benchmarks.autopilot.raised import Raised
from benchmarks.autopilot.trials import tuning
from scenarios import Commands
from subzero import autopilot


def cases(*quick, slow):
    """Return cases, those beyond the quick ones marked."""
    return [*quick, *(pytest.param(*one, marks=pytest.mark.slow) for one in slow)]


PULSED = cases(
    (10.0, 1.5), (20.0, 1.0),
    slow=[(10.0, 0.5), (10.0, 1.0), (20.0, 0.5), (20.0, 1.5), (40.0, 0.5), (40.0, 1.0), (40.0, 1.5)],
)  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("part", INPUTS)
@pytest.mark.parametrize("wet_length,speed", PULSED)
def test_a_pulse_moves_both_linear_models_like_the_run(part, wet_length, speed):
    """The run that the model was wrong for: after 2 s of rudder the cable pulls the heading back."""
    command, change = held(speed, wet_length), pulse(part)
    expected = deviations(speed, wet_length, command, change)
    nominal = disturbed.run_with(speed, wet_length, np.tile(command, (len(change), 1)))
    along = autopilot.linearise_along(nominal).respond(change)
    middle = frozen(part, disturbed.in_the_middle(speed, wet_length, command), change)
    for name in SEEN[part]:
        assert error(along[name].values, expected(name)) < 0.05, name
        assert error(middle[name], expected(name)) < 0.25, name


@pytest.mark.parametrize("part", INPUTS)
@pytest.mark.parametrize(
    "speed,wet_length,frequency",
    cases(
        (0.5, 40.0, 0.3), (1.0, 20.0, 0.8), (1.0, 20.0, 4.0),
        slow=[
            (0.5, 20.0, 0.4), (0.5, 40.0, 1.0), (0.6, 10.0, 0.95), (1.0, 20.0, 2.0), (1.0, 40.0, 0.4), (1.0, 40.0, 1.0),
            (1.4, 30.0, 0.75), (1.4, 30.0, 3.0),
        ],
    ),
)  # fmt: skip
@pytest.mark.long
def test_a_sine_moves_the_linear_model_like_the_run(part, speed, wet_length, frequency):
    assert 2.0 * np.pi * speed / frequency < 0.4 * wet_length
    expected = disturbed.answer(speed, wet_length, part, frequency)
    ratio = disturbed.frozen_answer(speed, wet_length, part, frequency) / expected
    assert abs(ratio) == pytest.approx(1.0, abs=0.1)
    assert abs(np.degrees(np.angle(ratio))) < 10.0


def test_with_its_drag_made_linear_the_model_turns_by_degrees_like_the_run():
    """5 degrees of rudder for 2 s: 13 degrees of heading, for which the cable's drag is half of a tenth of U."""
    size = np.radians([0.0, 5.0, 0.0, 0.0])
    command, change = held(1.0, 20.0), pulse("yaw_sway", size)
    expected = deviations(1.0, 20.0, command, change)("heading")
    assert np.degrees(np.max(expected)) == pytest.approx(13.0, abs=1.0)
    steady = disturbed.in_the_middle(1.0, 20.0, command)
    drag = 0.5 * steady.speed * np.max(expected)
    assert error(frozen("yaw_sway", steady, change, cross_flow=drag)["heading"], expected) < 0.15
    assert error(frozen("yaw_sway", steady, change)["heading"], expected) > 0.25, (
        "a motion this large needs it"
    )


@pytest.mark.long
@pytest.mark.parametrize(
    "name,times",
    cases(
        ("wide_turn", 1.0),
        ("current", 10.0),
        slow=[("zigzag", 1.0), ("dive", 1.0), ("stop_and_drift", 1.0)],
    ),
)
def test_any_scenario_can_be_linearised_along(name, times):
    """Turning, in a current, diving, with a cable that has gone slack: what no steady motion stands for.

    In the current the run is taken four times as fine, and one of the two that are disturbed splits a segment a part of
    a step before the other: that moves its length by a micrometre, and so the disturbance is a tenth of a degree.
    """
    trial = dataclasses.replace(subzero.load_scenario(name), duration=15.0)
    time = STEP * np.arange(150)
    rows = np.searchsorted(trial.commands.time, time + 1e-9, side="right") - 1
    values, change = np.asarray(trial.commands.values)[rows], np.zeros((150, 4))
    change[30:50] = times * disturbed.SMALL
    ends = [
        subzero.simulate(
            dataclasses.replace(trial, commands=Commands(time=time, values=values + sign * change))
        )
        for sign in (1.0, -1.0)
    ]
    found = autopilot.linearise_along(trial).respond(change)
    for channel in (
        "yaw_rate",
        "surge_speed",
        "pitch_rate",
        "depth",
        "cable_length",
        "cable_force_starboard",
    ):
        half = 0.5 * (ends[0][channel].values - ends[1][channel].values)
        expected = np.radians(half) if ends[0][channel].attrs["units"].startswith("degree") else half
        assert error(found[channel].values, expected) < 0.05, channel


def test_a_deviation_at_the_start_goes_on_like_that_of_the_run():
    """A hundredth of a degree of heading and a centimetre a second of speed, on 20 m of cable."""
    start = autopilot.trim(tuning().model, speed=1.0, wet_length=20.0)
    off = np.zeros(16)
    off[5], off[6] = np.radians(0.01), 0.01
    found = autopilot.linearise_along("fig6", start=start, duration=8.0).respond(np.zeros((80, 4)), off)
    fig6 = subzero.load_scenario("fig6").start
    plant = autopilot.plant(
        tuning().model, tethered=True, start=start, depth=fig6.depth, heading=fig6.heading,
        discretisation=autopilot.Discretisation(longest=40.0),
    )  # fmt: skip
    ends = []
    for sign in (1.0, -1.0):
        x = plant.initial_state.copy()
        x[:16] += sign * off
        for k in range(80):
            x = plant.dynamics(STEP * k, x, start.command)
        ends.append(x[:16])
    expected = 0.5 * (ends[0] - ends[1])
    for i, name in ((5, "heading"), (6, "surge_speed"), (7, "sway_speed"), (11, "yaw_rate")):
        assert float(found[name][-1]) == pytest.approx(expected[i], rel=0.02, abs=2e-6), name


def test_the_heading_is_pulled_back_and_only_the_whole_picture_may_be_turned():
    """No pole at 0 belongs to the heading: it does when cable and bearing from the drum turn with it."""
    model = tuning().model
    part = autopilot.subsystem(
        autopilot.linearise(model, autopilot.trim(model, speed=1.0, wet_length=20.0)), "yaw_sway"
    )
    labels, A = list(part.state_labels), np.asarray(part.A)
    turned, bearing = (labels.index(name) for name in ("heading", "cable_bearing"))
    assert np.max(np.abs(A[:, turned] + A[:, bearing])) < 1e-6
    assert A[labels.index("yaw_rate"), turned] < -0.3, "with the bearing held the heading has a stiffness"
    assert np.max(np.linalg.eigvals(A).real) < 1e-6


@pytest.mark.parametrize(
    "loop,pilot,wet_length",
    cases(
        ("heading", "pid", 20.0),
        slow=[
            ("heading", "pid", 40.0), ("heading", "lqr", 20.0), ("pitch", "pid", 40.0), ("speed", "pid", 20.0),
            ("roll", "pid", 40.0),
        ],
    ),
)  # fmt: skip
def test_a_flight_grows_with_a_tenth_more_than_its_gain_margin_and_not_with_a_tenth_less(
    loop, pilot, wet_length
):
    matrices = autopilot.estimates(tuning(), 0.1) if pilot == "lqr" else None
    found = autopilot.loop_margins(tuning(), loop, speed=1.0, wet_length=wet_length, estimates=matrices)
    flight = Raised(loop=loop, pilot=pilot, speed=1.0, wet_length=wet_length)
    assert not flight.grows(0.9 * found.gain)
    assert flight.grows(1.1 * found.gain)


def test_a_cable_that_does_not_lie_straight_is_refused():
    model = tuning().model
    heavy = dataclasses.replace(model, cable=dataclasses.replace(model.cable, mass_per_length=0.02))
    turning = autopilot.trim(model, speed=1.0, wet_length=10.0, turn_rate=0.1)
    straight = autopilot.trim(model, speed=1.0, wet_length=10.0)
    for other, steady, words in ((model, turning, "the vehicle turns"), (heavy, straight, "weight")):
        with pytest.raises(subzero.UserError, match=f"{words}.*Use linearise_along"):
            autopilot.linearise(other, steady)
    with pytest.raises(subzero.UserError, match="cross_flow is -1"):
        autopilot.linearise(model, straight, cross_flow=-1.0)


def test_a_cable_cannot_be_left_to_follow_at_once():
    """That was the model before: heading off by a factor of five after 12 s."""
    steady = autopilot.trim(tuning().model, speed=1.0, wet_length=20.0)
    part = autopilot.subsystem(autopilot.linearise(tuning().model, steady), "yaw_sway")
    with pytest.raises(subzero.UserError, match="without cable_bearing is wrong for slow motions"):
        autopilot.reduced(part, ["yaw_rate", "heading"])
    assert autopilot.reduced(part, ["yaw_rate", "heading", "cable_bearing"]).nstates == 3


def test_deviations_that_mean_nothing_are_refused():
    along = autopilot.linearise_along("fig6", duration=1.0)
    with pytest.raises(subzero.UserError, match=r"commands of shape \(3, 4\).*\(10, 4\)"):
        along.respond(np.zeros((3, 4)))
    with pytest.raises(subzero.UserError, match="finite"):
        along.respond(np.full((10, 4), np.nan))
    with pytest.raises(subzero.UserError, match="duration is 0"):
        autopilot.linearise_along("fig6", duration=0)
    with pytest.raises(subzero.UserError, match="prescribes its motion"):
        autopilot.linearise_along("fig4")
