"""A trial whose heavy cable hangs between vehicle and drum at the start: `[start] drum_north_m` and its like.

Verifies: that a prescribed vehicle at rest feels the hanging cable of `cable.hold` from the first row to the last, and
that nothing moves; what is said where the cable does not reach. Tolerance: 1e-6 of the force, left by Newton's method.
"""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable
import subzero
from subzero.errors import UserError
from subzero.model import Model
from subzero.validity import check_run

TRIAL = """
description = "An umbilical hangs between a vehicle that waits and a vessel's winch"
vehicle = "subzero2"
cable = "umbilical"

[run]
duration_s = 10.0
hull_step_s = 0.1
cable_step_s = 0.1
segment_length_m = 0.5

[start]
depth_m = 40.0
wet_length_m = {wet}
drum_north_m = -20.0
drum_east_m = 5.0
drum_down_m = -40.0

[water]
current_east_m_s = 0.2

[winch]
control = "brake"

[motion]
time_s = [0.0, 10.0]
surge_speed_m_s = [0.0, 0.0]
pitch_deg = [0.0, 0.0]
heading_deg = [0.0, 0.0]

[changes]
"vehicle.tow_point.x" = 0.0
"""


def written(folder, wet):
    path = folder / "hanging.toml"
    path.write_text(TRIAL.format(wet=wet), encoding="utf-8")
    return path


def test_a_trial_begins_with_a_cable_that_hangs_and_goes_on_so(tmp_path):
    run = subzero.simulate(written(tmp_path, 50.0))
    assert run.attrs["outcome"] == "completed", run.attrs["outcome_message"]
    model = Model.of(subzero.load_scenario(written(tmp_path, 50.0)))
    ends = ((0.0, 0.0, 40.0), (-20.0, 5.0, 0.0))
    held = cable.hold(ends, 50.0, (0.0, 0.2, 0.0), cable=model.cable, segment_length=0.5)
    found = np.column_stack([run[f"cable_force_{name}"] for name in ("forward", "starboard", "down")])
    assert_allclose(found[1:], np.tile(held.tow_force, (100, 1)), atol=1e-6 * np.linalg.norm(held.tow_force))
    shape = run["cable_position"].isel(time=-1).dropna("node").values
    assert_allclose(shape, held.shape - held.shape[-1], atol=1e-6)
    assert float(run["cable_length"][-1]) == pytest.approx(50.0, abs=1e-9)


def test_a_cable_that_does_not_reach_is_said(tmp_path):
    with pytest.raises(UserError, match="it would stretch by 800 %"):
        subzero.simulate(written(tmp_path, 5.0))


@pytest.mark.parametrize(
    ("winch", "words"),
    [
        (
            'control = "brake"\n[vessel]\ntime_s = [0.0]\nvelocity_down_m_s = [0.5]',
            "rest: the vessel by 0.5 m/s, and",
        ),
        (
            'control = "pay_out_rate"\ntime_s = [0.0]\npay_out_rate_m_s = [-0.3]',
            "rest: the winch by 0.3 m/s, and",
        ),
        (
            'control = "constant_tension"\ntime_s = [0.0]\ntension_N = [{tension:g}]',
            "rest: the winch asks for +2 N, and",
        ),
    ],
)
def test_a_doubtful_start_says_what_it_is_out_of_balance_by(winch, words, tmp_path):
    """A winch that is asked for 2 N more than the hanging cable pulls with at the drum is out of balance by +2 N."""
    still = Model.of(subzero.load_scenario(written(tmp_path, 50.0))).cable
    ends = ((0.0, 0.0, 40.0), (-20.0, 5.0, 0.0))
    hanging = cable.hold(ends, 50.0, (0.0, 0.2, 0.0), cable=still, segment_length=0.5)
    path = written(tmp_path, 50.0)
    text = path.read_text().replace('control = "brake"', winch.format(tension=hanging.tensions[-1] + 2.0))
    path.write_text(text)
    trial = subzero.load_scenario(path)
    run = subzero.simulate(trial.with_changes({"run.rtol": 0.0, "run.duration_s": 0.5}))
    error = {"start_error": 0.1, "start_time": 0.1, "change": 0.0, "proof_error": 0.0, "force_error": 0.1}
    run.attrs["accuracy"] = json.dumps({**error, "rtol": 0.02, "halvings": 0, "proof_finer": 0})
    (doubt,) = [
        warning for warning in check_run(run, trial, Model.of(trial)) if "of the start" in warning.message
    ]
    assert words in doubt.message
