"""A vehicle that heads north has a compass that jumps from 360 to 0 degrees, and a diagnosis that does not.

Verifies: `subzero.records.record`, and what `measurement`, `problem`, `reference_run` and `challenge` make of a heading
about north. Configuration: the first seconds of zigzag, which starts at north. Tolerance: an angle at the start is
there at the start, to the steps' error of 0.02 degrees.
"""

import dataclasses
from math import degrees

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
from scenarios.heading import turned
from subzero.diagnosis import START, Logged, Setting
from subzero.diagnosis.inference import pose, respond
from subzero.records.consistency import unit_questions
from subzero.records.record import Record, read_record
from subzero.synthetic.challenge import Challenge, write
from subzero.synthetic.planted import Hidden
from subzero.synthetic.reference_run import simulate_reference
from subzero.synthetic.sealed_answer import Answer

LONG = subzero.load_scenario("zigzag")
TRIAL = dataclasses.replace(LONG, duration=4.0)
NORTH = Setting(trial=TRIAL, model=subzero.Model.of(TRIAL))
TIMES = np.linspace(0.0, 4.0, 41)
(TURN,) = (effect for effect in START if effect.id == "start:heading")


def headings(setting):
    return respond(setting, TIMES, ["heading"])["heading"]


@pytest.mark.parametrize("turns", [-2, -1, 0, 1, 3])
def test_whole_turns_do_not_count_nor_do_an_outlier_or_a_gap(turns):
    run = np.linspace(-1.0, 5.0, 30)
    record = run + 360.0 * turns
    record[[0, 4]] = np.nan, 360.0 * turns + 170.0
    assert_allclose(turned(record, run)[5:], run[5:])


def test_a_little_to_port_of_north_is_a_little_less_than_north():
    change = headings(TURN.apply(NORTH, -0.2)) - headings(NORTH)
    assert change[0] == pytest.approx(-0.2, abs=1e-9)
    assert np.abs(change + 0.2).max() < 0.05


def test_the_other_formulation_counts_a_heading_in_the_same_way():
    shown = simulate_reference(TURN.apply(NORTH, -0.2), TIMES, ["heading"])["heading"]
    assert shown[0] == pytest.approx(-0.2, abs=0.02)


@pytest.mark.parametrize("counted", [0.0, 360.0, -720.0])
def test_a_record_from_359_degrees_is_a_degree_from_north_for_the_engine(counted):
    shown = headings(NORTH) - 1.0 + counted
    noise = 0.1 * np.random.default_rng(5).standard_normal(TIMES.size)
    record = Record(source="a compass", time=TIMES, values={"heading": shown + noise})
    problem = pose([Logged(record=record, setting=NORTH, name="zigzag")])
    z = np.zeros(len(problem.entries))
    (at,) = (k for k, entry in enumerate(problem.entries) if entry.effect.id == "sensor_bias:heading")
    z[at] = -1.0
    seen = problem.records[0].noise["heading"].count
    assert problem.residual(z)[:seen] @ problem.residual(z)[:seen] < 2.0 * seen


def test_a_challenge_writes_what_a_compass_shows_and_it_is_read_without_jumps(tmp_path):
    heading = headings(NORTH) + np.linspace(-1.0, 1.0, TIMES.size)
    record = Record(source="made", time=TIMES, values={"heading": heading})
    answer = Answer(kind="none", names=(), sentences=(), deviations={}, starts={}, axis="", feature="", tolerances={},
                    scenario="zigzag", seed=1)  # fmt: skip
    made = Challenge(record=record, nominal=NORTH, true=NORTH, hidden=Hidden(), answer=answer)
    write(made, tmp_path, "zigzag")
    column = np.genfromtxt(tmp_path / "record.csv", delimiter=",", names=True)["heading_deg"]
    assert column.min() >= 0.0
    assert np.ptp(column) > 180.0
    read = read_record(tmp_path / "record.csv").values["heading"]
    assert_allclose(turned(read, degrees(TRIAL.start.heading)), heading, atol=1e-4)


def test_a_compass_in_radians_is_asked_about_although_it_jumps_at_north():
    heading = {"heading": 20.0 * np.sin(TIMES)}
    radians = {"heading": np.radians(heading["heading"]) % (2.0 * np.pi)}
    (question,) = unit_questions(radians, heading, {"heading": 0.4})
    assert "heading_deg looks like radians" in question
    assert unit_questions({"heading": heading["heading"] + 0.3}, heading, {"heading": 0.4}) == []
