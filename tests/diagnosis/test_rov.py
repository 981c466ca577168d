"""A remotely operated vehicle that keeps its station is diagnosed: BlueROV2 Heavy on 60 m of tether.

Verifies: one thruster that follows 60 % of its command is named with its size; a tether that is held by something is
told as its pull, with the time; a healthy vehicle gets no name; the catalogue of a vehicle without lists is as it was.
Configuration: the first 25 s of rov_hover, which it enters out of its balance, ten usual sensors at 5 Hz, white noise;
simulated in the steps of the trial, explained in those of a diagnosis. Tolerance: the size within three of its standard
deviations, and known to 0.1.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import subzero
from subzero.diagnosis import NOISE, Setting, catalogue, diagnose
from subzero.diagnosis.hypothesis.catalogue import listed
from subzero.diagnosis.inference.simulator import respond
from subzero.diagnosis.read_trials import read_trials
from subzero.external_force import MissingForce
from subzero.records.record import Record, read_record

DURATION, RATE = 25.0, 5.0
CHANNELS = (
    "heading", "yaw_rate", "pitch", "roll_angle", "depth", "surge_speed", "sway_speed", "north", "east",
    "cable_tension",
)  # fmt: skip
HOVER = subzero.load_scenario("rov_hover")


@pytest.fixture(scope="module")
def trial_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("rov") / "hover.toml"
    path.write_text(HOVER.text.replace("duration_s = 120.0", f"duration_s = {DURATION}"))
    return path


def record_of(trial, seed: int, missing: MissingForce | None = None) -> Record:
    model = replace(subzero.Model.of(trial), missing=missing)
    time = np.arange(1, int(DURATION * RATE) + 1) / RATE
    true = respond(Setting(trial=replace(trial, duration=DURATION), model=model), time, CHANNELS)
    random = np.random.default_rng(seed)
    values = {name: true[name] + NOISE[name] * random.standard_normal(time.size) for name in CHANNELS}
    return Record(source="hover.csv", time=time, values=values)


@pytest.mark.long
@pytest.mark.parametrize("name,seed", [
    ("aft_starboard", 1), pytest.param("vertical_front_port", 2, marks=pytest.mark.long),
])  # fmt: skip
def test_a_thruster_that_does_less_is_named_with_its_size(trial_file, name, seed):
    weak = HOVER.with_changes({f"vehicle.thrusters.{name}.lost_command": 0.4})
    verdict = diagnose(record_of(weak, seed), trial_file, budget="verdict")
    (cause,) = verdict.causes
    assert (verdict.verdict, cause.id) == ("cause_named", f"thruster:{name}")
    lost = cause.parameters["lost_share"]
    assert lost.deviation_sd < 0.05
    assert lost.value == pytest.approx(0.4, abs=3.0 * lost.deviation_sd)
    assert f"the thruster {name} does less than it is commanded" in cause.sentence


@pytest.mark.long
@pytest.mark.parametrize("seed", [3, pytest.param(4, marks=pytest.mark.long)])
def test_a_healthy_vehicle_gets_no_name(trial_file, seed):
    verdict = diagnose(record_of(HOVER, seed), trial_file, budget="verdict")
    assert (verdict.verdict, verdict.causes) == ("nothing_wrong", ())


@pytest.mark.long
def test_a_tether_that_is_held_by_something_is_told_as_its_pull(trial_file):
    """From 10 s on 3 N more astern and 4 N to starboard at the tow point."""
    arm = subzero.Model.of(HOVER).vehicle.tow_point.position()
    pull = (-3.0, 4.0, 0.0, *np.cross(arm, [-3.0, 4.0, 0.0]).tolist())
    snag = MissingForce(time=(10.0, 10.0, DURATION), wrench=((0.0,) * 6, pull, pull))
    verdict = diagnose(record_of(HOVER, 5, snag), trial_file, budget="verdict")
    (cause,) = verdict.causes
    assert cause.id == "tether_pull"
    assert cause.start_time == pytest.approx(10.0, abs=0.5)
    assert cause.parameters["forward"].value == pytest.approx(-3.0, abs=1.0)
    assert cause.parameters["starboard"].value == pytest.approx(4.0, abs=1.0)


def test_a_vehicle_without_lists_has_the_causes_that_it_had():
    assert listed.effects_of(subzero.Model.of(subzero.load_scenario("fig6")).vehicle) == ()
    rov = [effect.id for effect in listed.effects_of(subzero.Model.of(HOVER).vehicle)]
    assert rov[:1] == ["thruster:front_starboard"]
    assert rov[-5:] == ["damping:surge", "damping:sway", "damping:heave", "damping:yaw", "tether_pull"]
    assert not set(rov) & set(catalogue(CHANNELS))
    for effect in listed.effects_of(subzero.Model.of(HOVER).vehicle):
        assert listed.description_of(effect.id) == {"sentence": effect.sentence, "slot": effect.slot}
    assert listed.description_of("sensor_bias:heading") == {}
    setting = Setting(trial=HOVER, model=subzero.Model.of(HOVER))
    for effect in listed.effects_of(setting.model.vehicle)[: len(setting.model.vehicle.thrusters)]:
        changed, key = effect.apply(setting, 0.4).model.vehicle, effect.id.partition(":")[2]
        assert changed == setting.model.vehicle.with_parameter(f"thrusters.{key}.lost_command", 0.4)
        known = setting.model.vehicle.own_numbers.thrusters
        np.testing.assert_array_equal(
            changed.own_numbers.thrusters, known
        )  # station keeping knows nothing of it


def test_a_log_may_hold_the_commands_of_thrusters_and_they_can_be_flown(tmp_path, trial_file):
    """Flown open loop, a run's own commands lead where it went, until the drift of the steps."""
    from subzero.results.netcdf_csv import write_csv

    trial = replace(HOVER, duration=DURATION, rtol=0.0)
    run = subzero.simulate(trial)
    columns = ["time_s", "heading_deg", "surge_speed_m_s", "depth_m"]
    write_csv(run, tmp_path / "run.csv")
    assert read_record(tmp_path / "run.csv").listed.keys() == set(run["thruster"].values)
    table = np.genfromtxt(tmp_path / "run.csv", delimiter=",", names=True)
    names = [name for name in table.dtype.names if name in columns or name.endswith("_command")]
    rows = np.column_stack([table[name] for name in names])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header=",".join(names), comments="", fmt="%.9g")
    (logged,) = read_trials(tmp_path / "log.csv", scenario=trial_file, commands="record")
    flown = logged.setting.trial
    assert flown.station is None
    assert set(flown.commands.listed) == set(run["thruster"].values)
    again = subzero.simulate(replace(flown, rtol=0.0))
    close = run["time"].values < 10.0
    np.testing.assert_allclose(again["depth"].values[close], run["depth"].values[close], atol=0.02)
    (kept,) = read_trials(tmp_path / "log.csv", scenario=trial_file)
    assert kept.setting.trial.station is not None
