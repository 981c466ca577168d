"""One bad compass sample, a gap, or a second that a logger interpolated spoils neither a comparison nor a motion.

Configuration: headings made by hand, and a run of fig6 that crosses north. Tolerance: 10 % of the error without the bad
samples, which is white noise of 0.4 degrees; whole turns exactly.
"""

import dataclasses
from math import radians

import numpy as np
import pytest
import xarray as xr

import scenarios
import subzero
from scenarios.heading import continuous, contradicted, expected
from subzero import autopilot
from subzero.errors import UserError
from subzero.records.record import Record, fit, modelled, read_record, with_heading_of

TIME = np.arange(0.0, 30.0, 0.1)
TURNING = 330.0 + 10.0 * np.maximum(TIME - 2.0, 0.0)
"""Nearly a whole turn, over north at 5 s."""


def as_shown(heading, seed=0):
    return (heading + 0.4 * np.random.default_rng(seed).standard_normal(heading.size)) % 360.0


def averaged(heading):
    at = int(np.flatnonzero(np.abs(np.diff(heading)) > 180.0)[0])
    heading[at] = 0.5 * (heading[at] + heading[at + 1])


def flipped(heading):
    heading[[20, 21, 140]] = (heading[[20, 21, 140]] + 179.0) % 360.0


def interpolated(heading):
    at = int(np.flatnonzero(np.abs(np.diff(heading)) > 180.0)[0])
    heading[at - 4 : at + 7] = np.linspace(heading[at - 4], heading[at + 6], 11)


def lost(heading):
    heading[60:260] = np.nan


def all_averaged_over_a_second(heading):
    heading[:] = np.convolve(np.pad(heading, 5, mode="edge"), np.ones(11) / 11.0, "valid")


BAD = (averaged, flipped, interpolated, lost, all_averaged_over_a_second)


@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("with_rate", [True, False])
def test_bad_samples_lose_no_turn_and_are_left_out(bad, with_rate):
    run = xr.Dataset({"heading": ("time", TURNING)}, coords={"time": TIME})
    heading = as_shown(TURNING)
    bad(heading)
    values = {"heading": heading}
    if with_rate:
        values["yaw_rate"] = np.gradient(TURNING, TIME)
    record = with_heading_of(Record(source="", time=TIME, values=values), modelled(run, "heading", TIME))
    assert fit(run, record, "heading").rmse < 1.1 * 0.4
    assert bool(record.notes) == (bad is not lost)
    assert np.isfinite(record.values["heading"]).sum() >= (100 if bad is lost else 285)


def test_a_gap_keeps_the_turns_of_the_yaw_rate_where_the_simulation_stands_still():
    heading = as_shown(TURNING)
    lost(heading)
    like = expected(TIME, np.gradient(TURNING, TIME), np.zeros(TIME.size))
    assert np.nanmax(np.abs(continuous(heading, like) - TURNING)) < 3.0


@pytest.mark.parametrize("shift", [25.0, 120.0])
def test_a_compass_that_is_shifted_for_good_and_one_of_five_degrees_are_believed(shift):
    stepped = as_shown(TURNING + shift * (TIME > 15.0))
    assert not contradicted(stepped).any()
    assert not contradicted(5.0 * np.round(as_shown(TURNING) / 5.0)).any()


@pytest.mark.long
@pytest.mark.parametrize(
    ("begin", "goal", "way"), [(10.0, 350.0, -20.0), (350.0, 10.0, 20.0), (359.9, 0.0, 0.1)]
)
@pytest.mark.parametrize("name", ["pid", "lqr"])
def test_autopilots_turn_the_shorter_way(begin, goal, way, name):
    fig6 = subzero.load_scenario("fig6")
    start = dataclasses.replace(fig6.start, heading=radians(begin), surge_speed=1.0)
    trial = dataclasses.replace(fig6, start=start, duration=20.0)
    wanted = autopilot.Wanted(speed=1.0, heading=radians(goal), depth=1.0)
    run = autopilot.fly(trial, autopilot.make(name, trial), lambda t: wanted, tethered=False)
    assert run["heading"].values[-1] - begin == pytest.approx(way, abs=2.0)


@pytest.mark.parametrize("goal", [{"heading": 37.0}, {"heading": 0.5, "roll": 10.0}, {"heading": -90.0}])
def test_a_set_point_in_degrees_is_refused(goal):
    wanted = autopilot.Wanted(speed=1.0, depth=1.0, **goal)
    with pytest.raises(UserError, match="Give radians"):
        autopilot.fly("fig6", autopilot.make("pid", subzero.load_scenario("fig6")), lambda t: wanted)


START = "2026-10-25T02:59:50+02:00"
TIMES = {
    "dates": ([START, "2026-10-25T02:59:51+02:00", "2026-10-25T02:00:00+01:00"], "2 time zones occur"),
    "hours": (["00:00:00.10", "00:00:00.20", "00:00:00.30"], "hours, minutes and seconds"),
    "timedelta": (
        ["0 days 00:00:00.1", "0 days 00:00:00.2", "0 days 00:00:00.3"],
        "hours, minutes and seconds",
    ),
    "ns": ([f"16365000000000000{k}0" for k in (10, 20, 30)], "nanoseconds since 1970"),
    "us": ([f"16365000000000{k}" for k in (10, 20, 30)], "microseconds since 1970"),
    "ms": ([f"16365000000{k}" for k in (10, 20, 30)], "milliseconds since 1970"),
    "whole seconds": (["0", "0", "0", "1", "1"], "fractions of a second are lost"),
    "restart": (["0", "0.1", "0.2", "0", "0.1"], "the logger was restarted"),
}


@pytest.mark.parametrize("case", TIMES)
def test_a_time_that_is_no_seconds_from_a_start_is_named_in_one_line(case, tmp_path):
    times, words = TIMES[case]
    path = tmp_path / "log.csv"
    path.write_text("time_s,depth_m\n" + "".join(f"{time},1.{k}\n" for k, time in enumerate(times)))
    with pytest.raises(UserError, match=words) as refused:
        read_record(path)
    assert len(str(refused.value).splitlines()) == 2


@pytest.mark.parametrize(
    ("header", "row", "words"),
    [
        ("time_s,lat,lon", "50.9,-1.4", "latitude and longitude"),
        ("time_s,Latitude (deg),gps_lng", "50.9,-1.4", "latitude and longitude"),
        ("time_s,heading_deg", "2665.56", "centidegrees"),
    ],
)
def test_positions_and_centidegrees_are_named_in_one_line(header, row, words, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(f"{header}\n0,{row}\n1,{row}\n")
    with pytest.raises(UserError, match=words) as refused:
        read_record(path)
    assert len(str(refused.value).splitlines()) == 2


def filled_in(values, kind):
    rows = np.arange(values.size)
    return values[rows // 10 * 10] if kind == "held" else np.interp(rows, rows[::10], values[::10])


@pytest.mark.parametrize("kind", ["held", "interpolated"])
def test_values_that_a_logger_filled_in_are_left_out(kind, tmp_path):
    noisy = 1.0 + 0.01 * np.random.default_rng(1).standard_normal((2, 301))
    columns = filled_in(noisy[0], kind), noisy[1]
    path = tmp_path / "log.csv"
    rows = "".join(f"{0.1 * k:.6g},{a:.6g},{b:.6g}\n" for k, (a, b) in enumerate(zip(*columns, strict=True)))
    path.write_text(f"time_s,depth_m,surge_speed_m_s\n{rows}")
    record = read_record(path)
    np.testing.assert_array_equal(np.flatnonzero(np.isfinite(record.values["depth"])), np.arange(0, 301, 10))
    assert np.isfinite(record.values["surge_speed"]).all()
    assert record.intervals == {"depth": pytest.approx(1.0)}
    assert record.notes == (
        "Only measurements are used, not what a logger filled in between them: depth_m (every 1 s).",
    )


def test_a_rounded_sensor_and_commands_that_step_are_measurements(tmp_path):
    rounded = np.round(1.0 + 0.003 * np.random.default_rng(2).standard_normal(301), 2)
    path = tmp_path / "log.csv"
    rows = "".join(f"{0.1 * k:.6g},{a:.6g},{5.0 * (10 <= k < 30)}\n" for k, a in enumerate(rounded))
    path.write_text(f"time_s,depth_m,rudder_command_deg\n{rows}")
    assert read_record(path).notes == ()


def test_a_prescribed_motion_with_a_heading_averaged_across_north_is_refused_with_its_line(tmp_path):
    heading = as_shown(TURNING)
    averaged(heading)
    at = int(np.flatnonzero(np.abs(np.diff(heading)) > 90.0)[0])
    rows = "\n".join(f"{t:g},1.0,0.0,{h:.3f}" for t, h in zip(TIME, heading, strict=True))
    path = tmp_path / "motion.csv"
    path.write_text(f"time_s,surge_speed_m_s,pitch_deg,heading_deg\n{rows}\n")
    trial = tmp_path / "trial.toml"
    trial.write_text(
        'description = "a log"\nvehicle = "subzero2"\ncable = "table1"\n[run]\nduration_s = 29.0\n'
        "[start]\ndepth_m = 1.0\n[motion]\nfile = 'motion.csv'\n"
    )
    with pytest.raises(scenarios.ScenarioError, match=f"line {at + 3}.*contradicts"):
        scenarios.load(trial)


@pytest.mark.parametrize("noise", [0.0, 0.01, 0.4])
@pytest.mark.parametrize("every", [1, 10])
@pytest.mark.parametrize("shift", [0.0, -31.0])
@pytest.mark.parametrize("name", ["fig6", "current", "wide_turn", "zigzag", "stop_and_drift"])
def test_a_quick_turn_that_a_few_samples_catch_is_no_bad_heading(name, shift, every, noise):
    """Samples of the turn of fig6, once a second, were left out as if averaged across north: what a simulation that
    lacks the turn gets wrong went unseen. Shifted, the turn of fig6 leads through north.
    """
    heading = shift + subzero.simulate(name, tethered=False)["heading"].values[::every]
    shown = (heading + noise * np.random.default_rng(0).standard_normal(heading.size)) % 360.0
    assert not contradicted(shown).any()


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_a_mean_across_north_is_a_bad_heading_whatever_its_share(share):
    """Numbers of a compass that swings slowly through north: one is a mean of 359 and 1."""
    heading = np.linspace(350.0, 370.0, 41) % 360.0
    at = int(np.argmin(heading))
    heading[at] = share * heading[at - 1] + (1.0 - share) * heading[at + 1]
    assert np.flatnonzero(contradicted(heading)).tolist() == [at]
