"""Vehicles that are commanded by lists: a glider's battery and bladder, a thruster of a remotely operated vehicle.

Verifies: a glider that is as its model says gets no name; a challenge hides what the vehicle has, and nothing else.
Configuration: 40 s of glider_sawtooth, usual sensors at 2 Hz with white noise; rov_hover, seed 0.
Tolerance: none.
"""

from __future__ import annotations

import numpy as np
import pytest

import subzero
from subzero.diagnosis import NOISE, diagnose

CHANNELS = ("heading", "yaw_rate", "pitch", "roll_angle", "depth", "surge_speed")


@pytest.mark.long
def test_a_glider_that_is_as_its_model_says_gets_no_name(tmp_path):
    text = subzero.load_scenario("glider_sawtooth").text
    assert "duration_s = 900.0" in text
    (tmp_path / "glider.toml").write_text(text.replace("duration_s = 900.0", "duration_s = 40.0"))
    run = subzero.simulate(tmp_path / "glider.toml", tethered=False).isel(time=slice(5, None, 5))
    random = np.random.default_rng(1)
    values = {
        name: run[name].values + NOISE[name] * random.standard_normal(run["time"].size) for name in CHANNELS
    }
    record = subzero.Record(source="glide.csv", time=run["time"].values, values=values)
    verdict = diagnose(record, tmp_path / "glider.toml", budget="verdict")
    assert (verdict.verdict, verdict.causes) == ("nothing_wrong", ())


@pytest.mark.long
def test_a_weak_thruster_can_be_hidden_in_a_challenge():
    hidden = subzero.challenge("rov_hover", seed=0)
    assert hidden.answer.names[0].startswith("thruster:")
    assert "propeller_thrust_gain" not in hidden.answer.tolerances, "there is no propeller"
