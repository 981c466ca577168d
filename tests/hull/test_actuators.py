"""Servos, motor and battery: each stage does what it says, and its neutral value switches it off exactly."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import scenarios
import subzero
import vehicle
from vehicle.actuators import Servo, servo_target

DEGREE = math.pi / 180


@pytest.fixture
def angles(subzero2):
    """Rudder in the water every 0.01 s under a series of commands, for a rudder servo with some values
    changed.
    """

    def call(commands, **changes):
        hull = subzero2
        for name, value in changes.items():
            hull = hull.with_parameter(f"rudder_servo.{name}", value)
        commands = np.asarray(commands, dtype=float)
        table = np.zeros((len(commands), 4))
        table[:, 1] = commands
        states = vehicle.free_run(hull, vehicle.initial_state(), table, 0.01 * len(commands), 0.01).states
        numbers = hull.numbers()
        rows = [
            vehicle.deflections(state.copy(), command, numbers)[0]
            for state, command in zip(states[1:], table, strict=True)
        ]
        return np.array(rows)

    return call


def test_a_lag_approaches_its_target_exponentially(angles):
    found = angles(np.full(60, 0.1), lag=0.15, rate_limit=math.inf)
    time = 0.01 * np.arange(1, 61)
    assert_allclose(found, 0.1 * (1 - np.exp(-time / 0.15)), rtol=0, atol=1e-8)  # Runge-Kutta at h/lag = 1/15


def test_a_rate_limit_makes_a_ramp(angles):
    found = angles(np.full(10, 0.3), lag=0.01, rate_limit=1.0)
    assert_allclose(found, 0.01 * np.arange(1, 11), rtol=0, atol=1e-12)


def test_a_deflection_limit_stops_the_fin_either_way(angles):
    for sign in (1, -1):
        assert angles(np.full(300, sign * 2.0))[-1] == pytest.approx(sign * 0.3491, abs=1e-8)


def test_a_dead_band_swallows_small_commands_and_shortens_large_ones(angles):
    assert np.array_equal(angles(np.full(50, 0.9 * DEGREE), dead_band=DEGREE), np.zeros(50))
    assert angles(np.full(300, 5 * DEGREE), dead_band=DEGREE)[-1] == pytest.approx(4 * DEGREE, abs=1e-8)
    assert angles(np.full(300, -5 * DEGREE), dead_band=DEGREE)[-1] == pytest.approx(-4 * DEGREE, abs=1e-8)


def test_an_offset_shifts_the_fin_at_zero_command(angles):
    assert angles(np.zeros(300), offset=0.01)[-1] == pytest.approx(0.01, abs=1e-9)


def test_backlash_leaves_the_fin_standing_until_the_slack_is_taken_up(angles):
    there = angles(np.full(300, 0.1), half_backlash=0.02)
    assert there[-1] == pytest.approx(0.08, abs=1e-8)
    back = angles(np.concatenate([np.full(300, 0.1), np.full(300, 0.07)]), half_backlash=0.02)
    assert back[-1] == pytest.approx(back[299], abs=1e-8)  # a reversal inside the play moves nothing
    far = angles(np.concatenate([np.full(300, 0.1), np.full(300, 0.0)]), half_backlash=0.02)
    assert far[-1] == pytest.approx(0.02, abs=1e-8)


def test_neutral_values_switch_every_stage_off_exactly(angles):
    commands = 0.3 * np.sin(np.arange(100))
    neutral = {"dead_band": 0.0, "offset": 0.0, "lag": 0.0, "rate_limit": math.inf,
               "deflection_limit": math.inf, "half_backlash": 0.0, "position_feedback": 0.0,
               "lost_command": 0.0}  # fmt: skip
    assert np.array_equal(angles(commands, **neutral), commands)
    assert servo_target(0.123, Servo(**neutral).numbers()) == 0.123


CROOKED = {"dead_band": DEGREE, "offset": DEGREE, "half_backlash": 0.5 * DEGREE}


@pytest.mark.parametrize("command", [5.0, 0.5, -0.5, -5.0])
def test_position_feedback_brings_a_crooked_fin_where_it_is_commanded(angles, command):
    """To starboard and back: without feedback, dead band, offset and play of a degree stand in between."""
    commands = np.repeat([8.0 * DEGREE, command * DEGREE], 300)
    fed_back = angles(commands, **CROOKED, position_feedback=1.0)
    assert_allclose(fed_back[[299, 599]], commands[[299, 599]], rtol=0, atol=1e-4 * DEGREE)
    alone = angles(commands, **CROOKED)
    assert abs(alone[599] - command * DEGREE) > 0.4 * DEGREE


def test_without_position_feedback_an_offset_stays_and_half_of_it_leaves_half(angles):
    """A positive offset turns to starboard: the fin stands to starboard of its command."""
    for feedback in (0.0, 0.5, 1.0):
        found = angles(np.full(300, 0.1), offset=0.01, position_feedback=feedback)[-1]
        assert found == pytest.approx(0.1 + (1.0 - feedback) * 0.01, abs=1e-8)


def test_position_feedback_makes_a_servo_neither_faster_nor_stronger(angles):
    time = 0.01 * np.arange(1, 61)
    lagging = angles(np.full(60, 0.1), lag=0.15, rate_limit=math.inf, offset=0.01, position_feedback=1.0)
    assert_allclose(lagging, 0.1 * (1 - np.exp(-time / 0.15)), rtol=0, atol=1e-8)
    ramp = angles(np.full(10, 0.3), lag=0.01, rate_limit=1.0, position_feedback=1.0)
    assert_allclose(ramp, 0.01 * np.arange(1, 11), rtol=0, atol=1e-12)
    assert angles(np.full(300, 2.0), offset=0.1, position_feedback=1.0)[-1] == pytest.approx(0.3491, abs=1e-8)


def test_a_servo_that_obeys_at_once_rests_where_one_that_lags_ends(angles):
    commands = np.repeat([8.0, 3.0, -1.0, 0.4], 400) * DEGREE
    for feedback in (0.0, 0.5, 1.0):
        slow = angles(commands, **CROOKED, lag=0.05, rate_limit=math.inf, position_feedback=feedback)
        at_once = angles(commands, **CROOKED, lag=0.0, rate_limit=math.inf, position_feedback=feedback)
        assert_allclose(slow[399::400], at_once[399::400], rtol=0, atol=1e-3 * DEGREE)


@pytest.mark.parametrize("feedback", [0.0, 1.0])
def test_a_jammed_fin_stands_at_its_offset_whatever_is_commanded_and_fed_back(angles, feedback):
    commands = 0.3 * np.sin(0.05 * np.arange(200))
    assert_allclose(
        angles(commands, offset=0.05, lost_command=1.0, position_feedback=feedback)[150:], 0.05, atol=1e-5
    )


def test_of_a_command_that_is_lost_in_part_the_rest_arrives(angles):
    """The offset is none of the command: it stays whole, and half of the dead band is lost with half of the command."""
    found = angles(np.full(300, 0.1), offset=0.01, dead_band=0.02, lost_command=0.5)[-1]
    assert found == pytest.approx(0.5 * (0.1 - 0.02) + 0.01, abs=1e-8)


def test_a_vehicle_file_from_before_there_was_position_feedback_has_none(tmp_path):
    root = scenarios.path("fig6").parent.parent
    old = (root / "vehicles" / "subzero2.toml").read_text(encoding="utf-8").splitlines()
    old = [one for one in old if not one.startswith("position_feedback")]
    (tmp_path / "old.toml").write_text("\n".join(old), encoding="utf-8")
    text = (root / "trials" / "fig6.toml").read_text(encoding="utf-8").replace('"subzero2"', '"old.toml"')
    fed_back = text + '"vehicle.rudder_servo.position_feedback" = 1.0\n'
    for name, trial, expected in (("mine", text, 0.0), ("fed_back", fed_back, 1.0)):
        (tmp_path / f"{name}.toml").write_text(trial, encoding="utf-8")
        found = subzero.load_scenario(tmp_path / f"{name}.toml").vehicle["rudder_servo"]["position_feedback"]
        assert found == expected


def test_the_shaft_follows_with_its_lag_and_stops_at_the_ceiling_of_the_battery(subzero2):
    run = vehicle.free_run(subzero2, vehicle.initial_state(), (24, 0, 0, 0), 1.5, 0.01)
    assert_allclose(run.states[:, 13], 24 * (1 - np.exp(-run.time / 0.3)), rtol=0, atol=1e-6)
    numbers = subzero2.numbers()
    for sign in (1, -1):
        command = np.array([sign * 500.0, 0, 0, 0])
        last = vehicle.free_run(subzero2, vehicle.initial_state(), command, 10.0).states[-1].copy()
        volts = vehicle.battery_voltage(last, command, np.zeros(3), numbers)
        assert volts < subzero2.battery.full_voltage
        # Astern the hull tumbles slowly, so load and ceiling still move; the shaft follows within its lag.
        assert last[13] == pytest.approx(sign * subzero2.motor.speed_per_volt * volts, rel=3e-3)


def test_the_battery_gives_what_the_shaft_takes(subzero2):
    """I = 2π n Q/(η V) + hotel, V = V_full − k q − R I, at a state written down by hand."""
    n, u, charge = 24.0, 0.8, 500.0
    P, motor, battery = subzero2.propeller, subzero2.motor, subzero2.battery
    J = (1 - P.wake_fraction) * u / (n * P.diameter)
    KQ = P.torque_constant - P.torque_slope * J - P.torque_curvature * J**2
    shaft = 2 * math.pi * n * 1000 * n**2 * P.diameter**5 * KQ
    current = shaft / (motor.efficiency * battery.full_voltage) + battery.hotel_current
    volts = (
        battery.full_voltage
        - battery.voltage_drop_per_charge * charge
        - battery.internal_resistance * current
    )
    state = vehicle.initial_state(velocity=(u, 0, 0, 0, 0, 0), propeller_speed=n)
    state[17] = charge
    numbers, rate = subzero2.numbers(), np.empty(vehicle.STATE_SIZE)
    command = np.array([n, 0, 0, 0])
    vehicle.derivative(state, command, np.zeros(3), np.zeros(6), numbers, rate)
    assert rate[17] == pytest.approx(current)
    assert vehicle.battery_voltage(state, command, np.zeros(3), numbers) == pytest.approx(volts)


def test_the_battery_sags_with_use_and_an_open_loop_motor_slows_down(subzero2):
    weak = subzero2.with_parameter("battery.voltage_drop_per_charge", 1e-2)
    run = vehicle.free_run(weak, vehicle.initial_state(), (24, 0, 0, 0), 60.0)
    numbers, command = weak.numbers(), np.array([24.0, 0, 0, 0])
    volts = [
        vehicle.battery_voltage(state.copy(), command, np.zeros(3), numbers) for state in run.states[::500]
    ]
    assert np.all(np.diff(volts[1:]) < 0.0)
    assert run.states[-1, 13] == pytest.approx(24.0)  # the speed loop holds the command
    loose = weak.with_parameter("motor.voltage_sensitivity", 1.0)
    slower = vehicle.free_run(loose, vehicle.initial_state(), (24, 0, 0, 0), 60.0).states[-1]
    assert slower[13] < 23.9


def test_a_motor_and_battery_with_neutral_values_obey_at_once(subzero2):
    ideal = subzero2
    keys = ("motor.lag", "battery.voltage_drop_per_charge", "battery.internal_resistance")
    for key, value in (*((key, 0.0) for key in keys), ("motor.speed_per_volt", math.inf)):
        ideal = ideal.with_parameter(key, value)
    command = (80.0, 0.0, 0.0, 0.0)
    at_once = vehicle.breakdown_table(ideal, vehicle.initial_state(), command)["propeller"]
    turning = vehicle.breakdown_table(ideal, vehicle.initial_state(propeller_speed=80.0), command)[
        "propeller"
    ]
    assert np.array_equal(at_once, turning)


def test_an_open_loop_drive_slows_down_with_the_charge_drawn(subzero2):
    """Shaft speed → command · (1 − l q_e); l = 0 is off to the last bit."""
    command, start = (24.0, 0.0, 0.0, 0.0), vehicle.initial_state()
    plain = vehicle.free_run(subzero2, start, command, 30.0).states
    off = subzero2.with_parameter("battery.speed_loss_per_charge", 0.0)
    assert np.array_equal(vehicle.free_run(off, start, command, 30.0).states, plain)
    loose = subzero2.with_parameter("battery.speed_loss_per_charge", 1e-3)
    last = vehicle.free_run(loose, start, command, 30.0).states[-1]
    assert last[17] > 10.0
    assert last[13] == pytest.approx(24.0 * (1.0 - 1e-3 * last[17]), rel=1e-3)
    empty = subzero2.with_parameter("battery.speed_loss_per_charge", 1.0)
    assert vehicle.free_run(empty, start, command, 30.0).states[-1][13] >= 0.0
