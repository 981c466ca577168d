"""Coupled runs say how far their force can be trusted, and are taken finer where that is not far enough.

Verifies: `subzero.convergence` against runs with steps and segments an eighth as long, and the criterion of the theory
page for a free drum: the direction in which a cable leaves it is only determined if it pulls there with T(S) > m₁U².
Configuration: shipped trials and changes of them. Tolerance: the estimate must bound the true error, with a tenth to
spare for what the fine run itself errs by. (Segments of 3 cm are too fine on a free drum: within 2m₁/ρπdC_t = 0.25 m of
it a cable has less tension than m₁U², and what is undetermined there begins to grow when eight segments resolve it.)
"""

import dataclasses
import json

import numpy as np
import pytest

import subzero
from subzero.convergence import run_converged
from subzero.simulation import run_trial

BODY = ("cable_force_forward", "cable_force_starboard", "cable_force_down")


def force(run):
    return np.stack([run[name].values for name in BODY], axis=1)


def accuracy(run):
    return json.loads(run.attrs["accuracy"])


def finer(trial, factor, **changes):
    """Return a trial with all steps and segments shorter by a factor, taken as they are."""
    steps = {name: getattr(trial, name) / factor for name in ("cable_step", "hull_step", "segment_length")}
    return dataclasses.replace(trial, rtol=0.0, **steps | changes)


def true_error(trial, run):
    """Return the largest error of the force at the rows of a run, as a share of the largest force."""
    fine = force(subzero.simulate(finer(trial, 8)))[::8]
    return np.linalg.norm(force(run) - fine, axis=1)[1:].max() / np.linalg.norm(fine, axis=1).max()


def changed(name, *, cable=None, drum=None, start=None, **fields):
    trial = subzero.load_scenario(name)
    return dataclasses.replace(
        trial,
        cable={**trial.cable, **(cable or {})},
        drum={**trial.drum, **(drum or {})},
        start=dataclasses.replace(trial.start, **(start or {})),
        **fields,
    )


TRIALS = {
    "a pull that stops": changed("stop_and_drift", duration=24.0),
    "a zigzag": changed("zigzag", duration=12.0),
    "a heavy drum, slack and taut": changed("stop_and_drift", duration=24.0, drum={"inertia": 1e-3}),
    "a turn with coarse segments": changed("turning_circle", duration=12.0, segment_length=2.0),
    "a heavy cable on a drum that holds it": changed(
        "fig6", duration=8.0, cable={"mass_per_length": 0.02}, drum={"friction_torque": 0.02}
    ),
}


@pytest.mark.parametrize("name", TRIALS)
def test_the_error_that_a_run_states_bounds_its_true_error(name):
    run = subzero.simulate(TRIALS[name])
    stated = accuracy(run)["force_error"]
    assert true_error(TRIALS[name], run) <= 1.1 * stated + 1e-3


def test_a_run_that_is_fine_enough_is_left_as_it_is():
    trial = changed("fig6", duration=6.0)
    run, plain = subzero.simulate(trial), subzero.simulate(dataclasses.replace(trial, rtol=0.0))
    assert accuracy(run)["halvings"] == 0
    assert accuracy(plain) == {}
    np.testing.assert_array_equal(force(run), force(plain))


def test_a_run_that_is_too_coarse_is_taken_finer_at_the_same_times():
    trial = changed("stop_and_drift", duration=21.0)
    run, plain = subzero.simulate(trial), subzero.simulate(dataclasses.replace(trial, rtol=0.0))
    assert accuracy(run)["halvings"] > 0
    assert accuracy(run)["force_error"] <= trial.rtol
    np.testing.assert_array_equal(run["time"], plain["time"])
    assert true_error(trial, run) < 0.3 * true_error(trial, plain)


def test_a_last_step_that_is_no_whole_one_is_covered_too():
    run = subzero.simulate(changed("fig6", duration=3.05))
    assert float(run["time"][-1]) == 3.05
    assert 0.0 < accuracy(run)["force_error"] < 0.02


@pytest.mark.parametrize("refused, tried", [(0.25, {1.0, 0.5, 0.25}), (1.0, {1.0, 0.5})])
def test_what_is_refused_at_another_resolution_leaves_the_run_as_it_was_asked_for(refused, tried):
    """A finer run that does not fit into memory, a coarser one whose cable cannot be laid."""
    trial, taken = changed("stop_and_drift", duration=21.0), set()

    def take(one, grid, _):
        taken.add(one.segment_length)
        if one.segment_length == refused:
            raise subzero.UserError("it does not fit")
        return run_trial(one, subzero.Model.of(one), True, grid=grid)

    run, found = run_converged(trial, take)
    assert taken - {0.125, 0.0625} == tried, "beside the start alone, a quarter as coarse"
    assert run.completed
    assert (found is None) == (refused == 1.0)
    assert found is None or not found.converged


def test_a_heavy_cable_on_a_free_drum_never_settles_and_says_so():
    run = subzero.simulate(changed("fig6", duration=10.0, cable={"mass_per_length": 0.02}))
    assert accuracy(run)["force_error"] > 0.05


@pytest.mark.parametrize("friction", [0.2, 0.4])
def test_a_drum_that_holds_its_cable_with_more_than_its_momentum_determines_it(friction):
    """T(S) = 0.2 N beside m₁U² = 0.04 N: the length of cable out settles at the second order, at least 1.5."""
    trial = changed(
        "fig6", duration=10.0, cable={"mass_per_length": 0.02}, drum={"friction_torque": 0.1 * friction}
    )
    runs = [subzero.simulate(finer(trial, factor)) for factor in (1, 2, 4, 8)]
    lengths = np.array([float(run["cable_length"][-1]) for run in runs])
    speed = np.gradient(runs[-1]["cable_length"].values, runs[-1]["time"].values)[-1]
    m1 = 0.02 + 1000.0 * trial.cable["cross_section_area"]
    assert friction > 2.0 * m1 * speed**2
    gaps = np.abs(np.diff(lengths))
    assert np.log2(gaps[:-1] / gaps[1:]).min() > 1.5


def test_on_the_shipped_current_the_length_settles_as_steps_shrink():
    """Its drum rubs with twice the momentum of the cable; on a free one the length moves on by as much each time."""
    trial = changed("current", duration=12.0)
    rubbing, free = (
        [subzero.simulate(finer(one, factor)) for factor in (1, 2, 4)]
        for one in (trial, dataclasses.replace(trial, drum={**trial.drum, "friction_torque": 0.0}))
    )
    spread = [np.ptp([float(run["cable_length"][-1]) for run in runs]) for runs in (rubbing, free)]
    assert spread[0] < 0.2 * spread[1]


def test_on_the_shipped_current_the_force_is_of_second_order_from_the_first_sample_on():
    """It begins with no cable: even segments make its force jump when the first is split, an error of first order."""
    trial = changed("current", duration=8.0)
    forces = [force(subzero.simulate(finer(trial, factor)))[::factor] for factor in (1, 2, 4, 8, 16)]
    errors = np.array([np.linalg.norm(one - forces[-1], axis=1)[1:].max() for one in forces[:-1]])
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders.min() > 1.5, orders
    assert np.log2(errors[0] / errors[-1]) / 3.0 > 1.8, orders


START_FROM_REST = changed(
    "fig6",
    duration=4.0,
    start={"wet_length": 16.0, "surge_speed": 0.0},
    drum={"inertia": 1e-3, "friction_torque": 0.02},
)


def test_a_propeller_that_takes_hold_of_a_resting_cable_at_once_is_seen_in_the_first_sample():
    """No sample of the coarser run is there; what comes later is as right as can be."""
    run = subzero.simulate(dataclasses.replace(START_FROM_REST, rtol=0.2))
    told, fine = accuracy(run), force(subzero.simulate(finer(START_FROM_REST, 8)))[::8]
    errors = np.linalg.norm(force(run) - fine, axis=1)[1:] / np.linalg.norm(fine, axis=1).max()
    assert errors.argmax() == 0
    assert errors.max() > 2.0 * errors[5:].max()
    assert told["start_error"] == pytest.approx(errors[:5].max(), rel=0.3)
    assert told["force_error"] >= told["start_error"]
    assert told["start_time"] == pytest.approx(0.1)
