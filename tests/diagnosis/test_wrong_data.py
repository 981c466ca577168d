"""Errors in the data that something else nearly explains: they are told as what they are, at the public face.

Verifies: the step of a rounded sensor is read off all that it has shown; records of the benchmark whose error a fin,
another channel or another clock came close to. Configuration: short zigzags of a healthy vehicle by the other
formulation of the cable; seeds 7401 and 71125 of `benchmarks.diagnosis.data_errors`, 8301 and 8302 of
`benchmarks.diagnosis.unit_errors`. Tolerance: numbers as in those benchmarks.
"""

import dataclasses

import numpy as np
import pytest

import subzero
from benchmarks.diagnosis import data_errors, unit_errors, world
from subzero import Logged
from subzero.diagnosis import Setting, catalogue
from subzero.diagnosis.hypothesis.data_error import DataError
from subzero.diagnosis.inference import pose
from subzero.records.record import Record
from subzero.synthetic.planted import draw_tolerances, make_record

FEW = ("surge_speed", "heading", "depth")


def measured(scenario: str, seed: int) -> Logged:
    """Return three channels of the first 14 s of a healthy vehicle's record."""
    trial = subzero.load_scenario(scenario)
    setting = Setting(trial=trial, model=subzero.Model.of(trial))
    true = draw_tolerances(setting, catalogue(FEW).values(), seed)
    return Logged(
        record=make_record(true, np.arange(0.0, 14.0, 0.1), FEW, seed=seed), setting=setting, name=scenario
    )


@pytest.mark.parametrize(
    "error",
    [DataError(kind="latency", channels=("depth",), amount=2.0), DataError(kind="late_clock", amount=2.0)],
    ids=["latency", "late_clock"],
)
def test_a_rounded_depth_is_as_coarse_where_a_delay_leaves_one_of_its_values(error):
    """Which steps a sensor shows in is read off all that it has shown: one value by itself might be as fine as any."""
    clean = measured("zigzag", 20264)
    depth = np.where(clean.record.time < 1.5, 1.0, 1.1)
    record = Record(source="made", time=clean.record.time, values={**clean.record.values, "depth": depth})
    logged = error.corrected(dataclasses.replace(clean, record=record))
    assert set(logged.record.values["depth"][np.isfinite(logged.record.values["depth"])]) == {1.1}
    (posed,) = pose([logged]).records
    assert posed.noise["depth"].resolution == pytest.approx(0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "index", "errors"),
    [(7401, 48, {"command_sign:stern_plane_port"}),  # was a stern-plane that jams at 1 s, with certainty
     (7401, 38, {"step:pitch", "clock_rate"}),  # was another rate, and a late clock
     (7401, 14, {"step:depth", "clock_rate"}),  # was a clock, and a drift of the depth
     (71125, 6, {"sign:heading", "command_swap:rudder/stern_planes"}),  # was the sign of the yaw rate
     (11013, 62, {"late_clock", "latency:surge_speed"}),  # was the clock of the speed log, and others late
     (11013, 22, {"late_clock", "reference:heading=counts counter-clockwise from south"}),  # was 0.9 s off
     (12013, 14, {"command_sign:rudder", "unit:pitch=radians"})],  # was a rudder that jams at 8 s
)  # fmt: skip
def test_an_error_that_something_else_comes_close_to_is_named(seed, index, errors):
    record = data_errors.made(*data_errors.drawn(seed, index + 1)[index])
    assert {one.id for one in record.errors} == errors
    verdict = subzero.diagnose(record.logged, budget="verdict")
    assert data_errors.is_right(record, verdict), verdict.sentence
    assert max(one.probability for one in verdict.data_errors) > 0.95


@pytest.mark.slow
def test_a_current_that_is_twice_as_strong_delays_no_channel():
    """The linear problem has delays of three channels far ahead; by the same samples they explain nothing."""
    verdict = subzero.diagnose(data_errors.made(*data_errors.drawn(11003, 134)[133]).logged, budget="verdict")
    assert not verdict.data_errors
    assert [one.id for one in verdict.causes] == ["current"]


@pytest.mark.slow
def test_a_cause_that_takes_the_vehicle_far_away_is_no_error_of_three_sensors():
    """A vehicle that floats: at the nominal numbers three wrong units are ranked far above it, and explain less."""
    verdict = subzero.diagnose(data_errors.made(*data_errors.drawn(9101, 6)[5]).logged, budget="verdict")
    assert not verdict.data_errors
    assert [cause.id for cause in verdict.causes] == ["net_buoyancy"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "index"),
    [(8301, 3),  # a heading that drifts by 2 degrees: its other sign was 25 nats ahead, and is 7 behind in a search
     (12001, 122)],  # a rounded depth that stands still: without its first 2 s it seemed twice as fine, worth 165 nats
)  # fmt: skip
def test_a_healthy_record_is_accused_of_nothing(seed, index):
    logged, _ = world.record_of(world.drawn(seed, index + 1)[index])
    verdict = subzero.diagnose(logged, budget="verdict")
    assert verdict.verdict == "nothing_wrong"
    assert not verdict.data_errors


@pytest.mark.long
def test_depth_in_decimetres_is_named_with_its_remedy_and_so_is_a_compass_that_is_turned():
    """No unit of the table is ten times a metre: the error is y = a + b x, with b = 10."""
    clean = measured("dive", 20263)
    values = dict(clean.record.values)
    values["depth"], values["heading"] = 10.0 * values["depth"], values["heading"] + 90.0
    record = Record(source="made", time=clean.record.time, values=values)
    verdict = subzero.diagnose(dataclasses.replace(clean, record=record), budget="verdict")
    assert (verdict.verdict, verdict.then) == ("data_error", "nothing_wrong")
    depth, heading = sorted(verdict.data_errors, key=lambda error: error.id)
    assert (depth.id, heading.id) == ("affine:depth", "reference:heading=is 90 degrees too large")
    assert depth.remedy == "divide it by 10"
    assert heading.remedy == "subtract 90 degrees"


@pytest.mark.slow
@pytest.mark.parametrize("seed, index", [(8301, 0), (8302, 0), (8302, 3)])
def test_several_columns_in_wrong_units_are_all_named(seed, index):
    """Pitch in hundredths or tenths, which numbers can bend to; heading and yaw rate so small that the rudder seems to
    be commanded in minutes of arc.
    """
    _, _, all_named, is_wrong = unit_errors.planted(seed, index)
    assert all_named
    assert not is_wrong
