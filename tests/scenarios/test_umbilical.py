"""The shipped umbilical: a heavy cable off a winch on a moving vessel, in a sheared current, 180 degrees of turn.

Verifies: the scenario runs to its end, and what one would say of it in words. Tolerance: the way of the vessel and the
length of the cable are integrals of straight lines, exact but for rounding (1e-9 m); the energy residual is of first
order in the length of the segment at the drum, half a metre in 90 m (1e-2); half the step, or half the segments, may
change the tow force by 1e-3 of its largest, as the issue asks.
"""

import dataclasses
import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
from subzero.results.summary import summarise

FORCE = ("cable_force_forward", "cable_force_starboard", "cable_force_down")


@pytest.fixture(scope="module")
def trial():
    return subzero.load_scenario("rov_umbilical")


@pytest.fixture(scope="module")
def run(trial):
    return subzero.simulate(trial)


def force(run):
    return np.stack([run[name].values for name in FORCE], axis=1)


def drum(run):
    """Return where the drum is (n, 3)."""
    last = run["node_count"].values - 1
    return run["cable_position"].values[np.arange(last.size), last]


def integral(time, values, until):
    """Return the integral of what is linear between values at times, and constant behind the last."""
    at = np.linspace(0.0, until, 68001)  # every 5 ms: all times of the scenario are among them
    return np.trapezoid(np.interp(at, time, values), at)


@pytest.mark.long
def test_it_reaches_its_end_and_its_diagnostics_are_fine(run):
    assert run.attrs["outcome"] == "completed", run.attrs["outcome_message"]
    found = summarise(run)["diagnostics"]
    assert found["closure_error_m"] < 1e-9
    assert found["energy_residual"] < 1e-2
    assert found["smallest_tension_N"] >= 0.0
    assert found["newton_iterations"] >= run.sizes["time"] - 1


def test_the_vehicle_dives_and_turns_through_180_degrees(run):
    assert run["depth"].values[-1] > 40.0
    assert run["heading"].values[-1] - run["heading"].values[0] == pytest.approx(180.0)
    assert float(run["surge_speed"].max()) == pytest.approx(0.5)


def test_the_drum_goes_where_the_vessel_goes_and_the_winch_gives_the_length(trial, run):
    for axis in range(3):
        velocity = np.array(trial.vessel.velocity)[:, axis]
        way = integral(trial.vessel.time, velocity, trial.duration)
        assert drum(run)[-1, axis] == pytest.approx(way, abs=1e-9)
    paid = integral(trial.winch.time, trial.winch.setpoint, trial.duration)
    assert run["cable_length"].values[-1] == pytest.approx(
        paid + 1e-6, abs=1e-9
    )  # a run starts with 1 µm of cable


def test_the_cable_sags_all_the_time_and_no_snap_load_comes(run):
    way = np.linalg.norm(run["cable_position"].values[:, 0] - drum(run), axis=1)
    length = run["cable_length"].values
    assert (length[1:] > 1.05 * way[1:]).all()
    size = np.linalg.norm(force(run), axis=1)
    assert np.abs(np.diff(size)).max() < 0.01 * size.max()  # within a tenth of a second


def test_the_drum_carries_what_hangs_below_it(run):
    """dT/dz = w_c for a cable that moves slowly, so T(S) − T(0) is w_c times the depth, to a tenth (drag)."""
    w_c = (0.75 - 1025.0 * 4.91e-4) * 9.81
    late = run["time"].values > 150.0
    carried = (run["drum_tension"] - run["cable_tension"]).values[late]
    assert_allclose(carried, w_c * run["depth"].values[late], rtol=0.1)


def test_the_record_says_what_winch_vessel_and_water_did(trial, run):
    reported = json.loads(run.attrs["parameters"])
    assert reported["winch"]["control"] == "pay_out_rate"
    assert reported["vessel"]["time"] == list(trial.vessel.time)
    assert reported["profile"]["depth"] == [0.0, 20.0, 60.0]


@pytest.mark.slow
@pytest.mark.parametrize("finer", ["step", "segments"])
def test_half_the_step_or_half_the_segments_change_little(finer, trial, run):
    if finer == "step":
        change = {"cable_step": 0.5 * trial.cable_step, "hull_step": 0.5 * trial.hull_step}
    else:
        change = {"segment_length": 0.5 * trial.segment_length, "grading": 0.5 * trial.grading}
    fine = force(subzero.simulate(dataclasses.replace(trial, **change)))
    fine = fine[:: (len(fine) - 1) // (run.sizes["time"] - 1)]
    gap = np.linalg.norm(force(run) - fine, axis=1)
    assert gap.max() < 1e-3 * np.linalg.norm(fine, axis=1).max()
