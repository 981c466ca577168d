"""A record of another vehicle names nothing, and a channel that breaks the algebra is set aside and named.

Configuration: 30 s of a REMUS 100 by another simulator (`tests/data/pvs_remus100`), given as a trial of `subzero2`;
and a record of fig6 whose depths make the algebra fail. Tolerance: none.
"""

import re
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

import subzero
from benchmarks.diagnosis.headings import NOISE
from subzero.diagnosis import api
from subzero.records.record import Record

PEER = Path(__file__).parents[1] / "data" / "pvs_remus100" / "step.csv"
PEER_COLUMNS = {
    "surge_speed": ("u_m_s", 1.0),
    "heading": ("psi_rad", 57.3),
    "yaw_rate": ("r_rad_s", 57.3),
    "pitch": ("theta_rad", 57.3),
    "roll_angle": ("phi_rad", 57.3),
    "depth": ("z_m", 1.0),
}


@pytest.mark.long
def test_a_channel_that_breaks_a_diagnosis_is_set_aside_and_named(monkeypatch):
    run, rng = subzero.simulate("fig6"), np.random.default_rng(0)
    time = run["time"].values
    values = {name: run[name].values + sd * rng.standard_normal(time.size) for name, sd in NOISE.items()}
    values["depth"] = values["depth"] * 1e6
    pose = api.pose

    def singular(records, effects):
        if any("depth" in one.record.values for one in records):
            raise np.linalg.LinAlgError("Matrix is singular.")
        return pose(records, effects)

    monkeypatch.setattr(api, "pose", singular)
    verdict = subzero.diagnose(Record(source="log", time=time, values=values), "fig6", budget="screen")
    assert "depth_m is set aside" in verdict.notes[0]


@pytest.mark.slow
def test_a_vehicle_of_another_simulator_is_near_to_nothing(tmp_path):
    table, rng = np.genfromtxt(PEER, delimiter=",", names=True), np.random.default_rng(0)
    table = table[table["t_s"] <= 30.0]
    values = {
        name: scale * table[column] + (name == "depth") + NOISE[name] * rng.standard_normal(table.size)
        for name, (column, scale) in PEER_COLUMNS.items()
    }
    text = (resources.files("scenarios") / "trials" / "fig6.toml").read_text(encoding="utf-8")
    text = re.sub(r"(?m)^heading_deg = [^#]*", "heading_deg = 0.0 ", text)
    text = re.sub(r"(?m)^rudder_deg .*$", "rudder_deg = [5.0, 5.0, 5.0]", text)
    text = re.sub(r"(?m)^(stern_plane_\w+_deg) += \[.*$", r"\1 = [5.0, 5.0, 5.0]", text)
    trial = tmp_path / "remus.toml"
    trial.write_text(text, encoding="utf-8")
    verdict = subzero.diagnose(
        Record(source="peer", time=table["t_s"], values=values), trial, budget="verdict"
    )
    assert verdict.verdict == "nothing_near"
    assert verdict.causes == ()
    (curves,) = verdict.curves.values()
    for error in verdict.data_errors:  # possible at most; drawn as it is recorded, with the error
        assert error.probability < 0.9
        drawn, seen = curves.models[f"rival: {error.id}"]["roll_angle"], curves.measured["roll_angle"]
        assert np.nanmean((seen - drawn) ** 2) < np.nanmean((seen + drawn) ** 2)
