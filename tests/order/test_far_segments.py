"""Segments far from both ends of a long cable are joined to longer ones, and the vehicle does not feel it.

Verifies: `cable.moving_end.remeshing.join_far` through coupled runs. Configuration: five minutes of fig6 with other
commands, on 150 to 300 m of cable. Tolerance: the tow force changes by less than 1e-4 of its largest value (measured:
1e-6 and less; `python -m benchmarks.long_runs force`); shorter cables stay as they are, to the last bit.
"""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose

import scenarios
import subzero
from cable.moving_end import LONGEST
from subzero.engine.initial_conditions import RUN_IN
from subzero.simulation.run import run_trial

FORCE_TOLERANCE = 1e-4
MINUTES_S = 300.0


def trial_of(rudder_deg, **fields):
    """Return fig6 at about a metre a second, told a rudder every second."""
    times = np.arange(0.0, MINUTES_S, 1.0)
    values = np.zeros((times.size, 4))
    values[:, 0], values[:, 1] = 48.0, np.radians(rudder_deg(times))
    fields = {"rtol": 0.0, "cable_step": 0.2, "duration": MINUTES_S} | fields
    commands = scenarios.Commands(time=times, values=values)
    return dataclasses.replace(subzero.load_scenario("fig6"), commands=commands, **fields)


def turning(t):
    return np.where(np.mod(t, 60.0) < 10.0, np.where(np.mod(t, 120.0) < 60.0, 6.0, -6.0), 0.0)


def heavy(trial):
    cable, drum = (
        dict(trial.cable) | {"mass_per_length": 0.0052},
        dict(trial.drum) | {"friction_torque": 0.05},
    )
    return dataclasses.replace(trial, cable=cable, drum=drum)


CASES = {
    "turns": lambda: trial_of(turning),
    "a cross current": lambda: trial_of(turning, current=(0.05, 0.1, 0.0)),
    "a cable that sinks": lambda: heavy(trial_of(lambda t: 0.0 * t)),
    "150 m in the water at the start": lambda: trial_of(
        turning,
        duration=60.0,
        start=dataclasses.replace(subzero.load_scenario("fig6").start, wet_length=150.0),
    ),
    "elastic": lambda: trial_of(
        turning, duration=200.0, cable=dict(trial_of(turning).cable) | {"compliance": 1e-4}
    ),
}


def followed(trial):
    run = run_trial(trial, subzero.Model.of(trial), tethered=True)
    assert run.completed, run.message
    return run


@pytest.mark.long
@pytest.mark.parametrize("case", CASES)
def test_the_vehicle_does_not_feel_it(case):
    trial = CASES[case]()
    even, joined = followed(dataclasses.replace(trial, far_grading=0.0)), followed(trial)
    force, plain = joined.recording.trace[:, :3], even.recording.trace[:, :3]
    assert np.linalg.norm(force - plain, axis=1).max() < FORCE_TOLERANCE * np.linalg.norm(plain, axis=1).max()
    assert_allclose(joined.recording.length, even.recording.length, rtol=FORCE_TOLERANCE)
    assert joined.recording.nodes[-1] < 0.75 * even.recording.nodes[-1]


def test_ends_stay_fine_and_the_middle_is_as_long_as_it_may_be():
    trial = CASES["turns"]()
    run = followed(dataclasses.replace(trial, every=MINUTES_S))
    chords = np.linalg.norm(np.diff(run.recording.position[-run.recording.nodes[-1] :], axis=0), axis=1)
    begins = np.cumsum(chords) - chords
    beyond = np.minimum(begins, chords.sum() - begins - chords) - trial.far_length
    limit = trial.segment_length + trial.far_grading * np.maximum(beyond, 0.0)
    assert np.all(chords[:-1] <= limit[:-1] + 1e-3)
    near = (beyond <= 0.0) & (begins > RUN_IN)
    assert_allclose(chords[near][:-1], trial.segment_length, rtol=1e-2)
    assert chords.max() > 4.0 * trial.segment_length


def test_a_long_cable_begins_with_few_segments_as_far_apart_as_they_may_be():
    start = dataclasses.replace(subzero.load_scenario("fig6").start, wet_length=600.0)
    run = followed(trial_of(turning, duration=1.0, start=start))
    lengths = np.diff(run.recording.arc_length[: run.recording.nodes[0]])
    trial, begins = CASES["turns"](), np.cumsum(lengths) - lengths
    beyond = np.minimum(begins, 600.0 - begins - lengths) - trial.far_length
    limit = trial.segment_length + np.minimum(trial.far_grading * np.maximum(beyond, 0.0), LONGEST)
    assert_allclose(lengths[:-1], limit[:-1], rtol=1e-9)
    assert lengths.sum() == pytest.approx(600.0, rel=1e-12)
    assert lengths.size < 250  # of 1200


def test_the_energy_still_balances():
    run = subzero.simulate(CASES["a cross current"](), every=10.0)
    assert np.abs(run["energy_residual"]).max() < 2e-3 * run["energy_propeller_work"].max()


@pytest.mark.parametrize("name", ["fig6", "turning_circle", "rov_umbilical"])
def test_shipped_scenarios_stay_as_they_are(name):
    trial = dataclasses.replace(subzero.load_scenario(name), rtol=0.0)
    even = dataclasses.replace(trial, far_grading=0.0)
    for one, other in zip(followed(trial).recording, followed(even).recording, strict=True):
        assert np.array_equal(one, other, equal_nan=True)
