"""Autopilots hold what they are asked for, and the cable does not disturb those that know it.

Verifies: `autopilot.fly` with the standard autopilots, on the bare hull and on the cable; anti-windup, bumpless
transfer and schedule of the loops alone. Tolerance: the factors of 5 (speed) and 3 (heading) that the feed-forward has
to reach, measured after the transients; 10 % between the nonlinear hull and the linear closed loop it was designed as.
"""

from dataclasses import replace

import control
import numpy as np
import pytest

import subzero
from subzero import autopilot
from subzero.autopilot import Loop, Schedule, Sensor, Sensors, Wanted
from subzero.autopilot.loops import Law
from subzero.autopilot.sensors import UNKNOWN

TURN = np.radians(8.0)


@pytest.fixture(scope="module")
def fig6():
    return subzero.load_scenario("fig6")


@pytest.fixture(scope="module")
def wide_turn():
    return subzero.load_scenario("wide_turn")


@pytest.fixture(scope="module")
def tuning(fig6):
    return autopilot.tune(subzero.Model.of(fig6))


def straight(trial):
    return lambda t: Wanted(1.0, trial.start.heading, trial.start.depth)


def turning(trial):
    """200 degrees at 8 degrees a second, from 8 s on."""

    def wanted(t):
        turned = min(max(t - 8.0, 0.0) * TURN, np.radians(200.0))
        return Wanted(
            1.0, trial.start.heading + turned, trial.start.depth, 0.0, TURN if 8.0 <= t < 33.0 else 0.0
        )

    return wanted


def error(run, name):
    """Return what a run lacks of what was wanted, in display units, after its transients."""
    time = run["time"].values
    settled = ((time > 15.0) & (time < 33.0)) | (time > 40.0)
    channel = "surge_speed" if name == "speed" else name
    return (run[channel] - run[f"wanted_{name}"]).values[settled]


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.long
@pytest.mark.parametrize("feed_forward", ["formula", "model"])
def test_feed_forward_makes_the_speed_error_five_times_smaller(fig6, tuning, feed_forward):
    fed = {
        name: autopilot.fly(
            replace(fig6, duration=60.0),
            autopilot.make("pid", fig6, feed_forward=name, tuning=tuning),
            straight(fig6),
        )
        for name in ("none", feed_forward)
    }
    alone, helped = (error(run, "speed") for run in fed.values())
    assert np.mean(alone) < -0.005, "feedback alone runs after the growing cable"
    assert rms(alone) > 5.0 * rms(helped)


@pytest.mark.parametrize("name", ["pid", pytest.param("lqr", marks=pytest.mark.slow)])
def test_the_cable_model_makes_the_heading_error_in_a_wide_turn_three_times_smaller(wide_turn, tuning, name):
    errors = {}
    for feed_forward in ("none", "model"):
        pilot = autopilot.make(name, wide_turn, feed_forward=feed_forward, tuning=tuning)
        errors[feed_forward] = error(
            autopilot.fly(replace(wide_turn, duration=45.0), pilot, turning(wide_turn)), "heading"
        )
    assert rms(errors["none"]) > 3.0 * rms(errors["model"])


def test_the_formula_knows_that_the_cable_cuts_the_corner(wide_turn, tuning):
    """The heading loses less: a part of its error is the bare hull's own, see docs/autopilot.md."""
    runs = {}
    for feed_forward in ("none", "formula"):
        pilot = autopilot.make("pid", wide_turn, feed_forward=feed_forward, tuning=tuning)
        runs[feed_forward] = autopilot.fly(replace(wide_turn, duration=45.0), pilot, turning(wide_turn))
    for name, factor in (("speed", 5.0), ("heading", 2.5)):
        alone, helped = (rms(error(run, name)) for run in runs.values())
        assert alone > factor * helped


def test_the_same_gains_move_on_board_when_the_cable_is_cut(wide_turn, tuning):
    """With its cable fed forward the tethered vehicle answers like the bare one with the same feedback."""
    fed = autopilot.make("pid", wide_turn, feed_forward="model", tuning=tuning)
    tethered = autopilot.fly(replace(wide_turn, duration=45.0), fed, turning(wide_turn))
    bare = autopilot.fly(
        replace(wide_turn, duration=45.0),
        autopilot.make("pid", wide_turn, tuning=tuning),
        turning(wide_turn),
        tethered=False,
    )
    assert np.max(np.abs(tethered["heading"] - bare["heading"])) < 0.5
    assert np.max(np.abs(tethered["surge_speed"] - bare["surge_speed"])) < 0.02


def test_a_small_step_of_the_bare_hull_is_the_one_it_was_designed_for(fig6, tuning):
    """Two degrees of heading: the flight against the linear closed loop of the same gains, held for 0.1 s a sample."""
    model = replace(tuning.model, vehicle=tuning.model.vehicle.with_parameter("motor.lag", 0.0))
    trial = replace(fig6, start=replace(fig6.start, surge_speed=1.0, heading=0.0))
    step = np.radians(2.0)
    pilot = autopilot.make("pid", trial, tuning=tuning)
    run = autopilot.fly(
        replace(trial, duration=8.0), pilot, lambda t: Wanted(1.0, step, 1.0), tethered=False, model=model
    )
    part = autopilot.subsystem(
        autopilot.linearise(tuning.model, autopilot.trim(tuning.model, speed=1.0)), "yaw_sway"
    )
    sampled = control.c2d(part, 0.1)
    k_rate, k_angle, k_integral, _ = tuning.gains["heading"].at(1.0)
    x, integral, headings = np.zeros(4), 0.0, []
    for _ in run["time"].values:
        headings.append(x[2])
        integral += 0.1 * k_integral * (step - x[2])
        rudder = k_angle * (step - x[2]) - k_rate * x[1] + integral
        x = np.asarray(sampled.A) @ x + np.asarray(sampled.B)[:, 0] * rudder
    flown = np.radians(run["heading"].values)
    assert np.max(np.abs(flown - np.array(headings))) < 0.1 * step


@pytest.mark.parametrize("name", list(autopilot.AUTOPILOTS))
def test_every_autopilot_holds_speed_heading_depth_and_roll_of_the_bare_hull(fig6, tuning, name):
    goal = Wanted(0.8, fig6.start.heading + 1.0, fig6.start.depth + 2.0)
    pilot = autopilot.make(name, fig6, tuning=tuning)
    run = autopilot.fly(replace(fig6, duration=60.0), pilot, lambda t: goal, tethered=False)
    end = run.isel(time=-1)
    assert float(end["surge_speed"]) == pytest.approx(0.8, abs=1e-3)
    assert float(end["heading"]) == pytest.approx(float(end["wanted_heading"]), abs=0.05)
    assert float(end["depth"]) == pytest.approx(fig6.start.depth + 2.0, abs=0.01)
    assert float(end["roll_angle"]) == pytest.approx(0.0, abs=0.1)
    limit = np.degrees(tuning.model.vehicle.rudder_servo.deflection_limit)
    assert np.max(np.abs(run["rudder_command"])) <= limit + 1e-9


def test_the_twin_sees_nothing_but_the_drum_and_the_commands(fig6, tuning):
    twins = [autopilot.TwinCable(fig6, 0.1) for _ in range(2)]
    command = np.array([25.0, 0.05, 0.0, 0.0])
    for k in range(100):
        blind = UNKNOWN._replace(time=0.1 * k, cable_length=0.05 * k)
        seeing = subzero.Observation(*[0.37] * len(blind))._replace(cable_length=0.05 * k)
        pulls = [twin.wrench(reading, command) for twin, reading in zip(twins, (blind, seeing), strict=True)]
    assert np.array_equal(*pulls)
    assert pulls[0][0] < 0.0


def law(gains=(0.5, 1.0, 0.4, 1.0), largest_error=10.0):
    return Law(
        measured=("yaw_rate", "heading"),
        gains=Schedule(np.array([1.0]), np.array([gains])),
        largest_error=largest_error,
    )


def test_the_integral_does_not_wind_up():
    """A minute at the limit, then the error turns round: the command leaves the limit at once."""
    loop = Loop(law(), 0.1)
    far, back = UNKNOWN._replace(heading=-1.0, yaw_rate=0.0), UNKNOWN._replace(heading=0.3, yaw_rate=0.0)
    for _ in range(600):
        assert loop.update(far, 0.0, 1.0, 0.0, (-0.3, 0.3)) == 0.3
    assert loop.update(back, 0.0, 1.0, 0.0, (-0.3, 0.3)) < 0.3


def test_a_loop_takes_over_without_a_jump(fig6, tuning):
    reading = UNKNOWN._replace(
        heading=0.7, yaw_rate=0.05, surge_speed=0.9, depth=3.0, pitch=0.1, pitch_rate=0.02, roll=-0.05, roll_rate=0.1,
        cable_length=10.0,
    )  # fmt: skip
    by_hand = np.array([23.0, 0.08, -0.02, 0.05])
    goal = Wanted(1.0, 0.6, 2.5)
    for name in autopilot.AUTOPILOTS:
        pilot = autopilot.make(name, fig6, feed_forward="formula", tuning=tuning)
        pilot.engage(reading, goal, by_hand)
        taken = np.array(pilot.update(reading, goal))
        assert taken == pytest.approx(by_hand, abs=0.3), (
            name
        )  # a sample of the integral: 0.1 s of 20 rev/s per m/s …
        assert taken[1:] == pytest.approx(by_hand[1:], abs=0.02), name


def test_gains_that_change_with_the_speed_do_not_jump_at_rest():
    gains = Schedule(np.array([0.5, 1.5]), np.array([[1.0, 2.0, 0.5, 1.0], [0.3, 0.6, 0.5, 1.0]]))
    loop = Loop(Law(measured=("yaw_rate", "heading"), gains=gains, largest_error=1.0), 0.1)
    still = UNKNOWN._replace(heading=0.2, yaw_rate=0.0)
    loop.engage(still, 0.2, 0.5, 0.0, 0.07)
    assert [loop.update(still, 0.2, speed) for speed in (0.5, 1.0, 1.5)] == pytest.approx([0.07] * 3)


def test_a_schedule_is_read_in_between_and_holds_at_its_ends():
    schedule = Schedule(np.array([0.5, 1.0, 2.0]), np.array([[1.0, 0.0], [3.0, 1.0], [5.0, 1.0]]))
    assert schedule.at(0.1) == pytest.approx([1.0, 0.0])
    assert schedule.at(0.75) == pytest.approx([2.0, 0.5])
    assert schedule.at(9.0) == pytest.approx([5.0, 1.0])
    with pytest.raises(subzero.UserError, match="increase"):
        Schedule(np.array([1.0, 1.0]), np.zeros((2, 1)))


class Broken:
    name, sample_time = "broken", 0.1

    def __init__(self, answer):
        self.answer = answer

    def reset(self):
        pass

    def update(self, reading, wanted):
        return (25.0, 0.0, 0.0, 0.0) if reading.time < 1.0 else self.answer


@pytest.mark.parametrize("answer", [(25.0, float("nan"), 0.0, 0.0), (25.0,), None])
def test_an_autopilot_that_returns_nonsense_ends_the_run_which_keeps_what_it_has(fig6, answer):
    with pytest.warns(autopilot.AutopilotWarning, match="four finite numbers"):
        run = autopilot.fly(fig6, Broken(answer), straight(fig6))
    assert run.attrs["outcome"] == "stopped"
    assert "Autopilot 'broken': At t = 1 s" in run.attrs["outcome_message"]
    assert "four finite numbers" in run.attrs["outcome_message"]
    assert float(run["time"][-1]) == pytest.approx(1.0)


def test_a_sample_time_shorter_than_the_step_is_refused(fig6, tuning):
    pilot = autopilot.make("pid", fig6, tuning=tuning, sample_time=0.05)
    with pytest.raises(subzero.UserError, match="whole number of cable steps"):
        autopilot.fly(fig6, pilot, straight(fig6))


def test_unknown_names_are_told(fig6):
    with pytest.raises(subzero.UserError, match=r"no autopilot 'pidd'\. Did you mean 'pid'"):
        autopilot.make("pidd", fig6)
    with pytest.raises(subzero.UserError, match="Allowed: none, formula, model"):
        autopilot.make("pid", fig6, feed_forward="oracle")


def test_a_flight_with_noisy_sensors_repeats_with_its_seed(fig6, tuning):
    pilot = autopilot.make("lqr", fig6, tuning=tuning)
    noisy = [Sensor(channel=one.channel, noise=0.01) for one in autopilot.PERFECT]
    seeds = Sensors(noisy, seed=1), Sensors(noisy, seed=2)
    first, again, other = (
        autopilot.fly(replace(fig6, duration=5.0), pilot, straight(fig6), sensors=sensors)
        for sensors in (seeds[0], *seeds)
    )
    assert np.array_equal(first["heading"], again["heading"])
    assert not np.array_equal(first["heading"], other["heading"])


def test_a_jump_of_what_is_wanted_goes_to_the_proportional_part_by_its_share_only():
    """And what is said to move on does not jump: a ramp with its rate leaves the integral alone."""
    loop, still = Loop(law((0.5, 1.0, 0.0, 0.6)), 0.1), UNKNOWN._replace(heading=0.0, yaw_rate=0.0)
    assert loop.update(still, 0.0, 1.0) == 0.0
    assert loop.update(still, 0.2, 1.0) == pytest.approx(0.6 * 0.2)
    ramp = Loop(law((0.0, 1.0, 0.0, 0.6)), 0.1)
    assert [ramp.update(still, 0.03 * k, 1.0, rate=0.3) for k in range(4)] == pytest.approx(
        [0.0, 0.03, 0.06, 0.09]
    )


def test_the_share_puts_the_zero_of_the_step_on_the_slowest_pole(tuning):
    gains = tuning.designs["heading"][3]
    closed = gains.A - gains.B @ np.append(gains.feedback, -gains.integral)[None]
    zero = -gains.integral / (gains.share * gains.feedback[-1])
    assert 0.0 < gains.share < 1.0
    assert np.min(np.abs(np.linalg.eigvals(closed) - zero)) < 1e-9
