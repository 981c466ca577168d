"""The error that a run reports of its tow force, where the force is made up and its error known.

Verifies: a force F = F0 (1 + C h^p) on segments h changes by C h^p (2^p - 1)/(1 + C h^p), as a share of its largest,
from segments 2h; the refinement reports that change, stops at the first h where it is within `rtol`, and what it
reports is no less than the true error C h^p/(1 + C h^p). Where the force is another at every h, or the budget ends, it
says so. Configuration: fig6 for 3 s, no simulation: runs are made up. Tolerance: rounding.
"""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import subzero

try:
    from subzero.simulation import refinement
except ImportError:
    from subzero import convergence as refinement

TRIAL = dataclasses.replace(subzero.load_scenario("fig6"), duration=3.0)
SIZE = 0.4
"""C of the error, of segments in metres to the power of the order."""


def taking(error, iterations=1.0):
    """Return what makes a run of a trial: a force of 1 N, and `error` of its segments' length more than that."""

    def take(trial, grid, progress=None):
        trace = np.zeros((grid.times.size, 4))
        trace[:, 0] = 1.0 + error(trial.segment_length)
        trace[:, 3] = 10.0
        recording = SimpleNamespace(trace=trace, iterations=np.full(grid.times.size, iterations))
        return SimpleNamespace(completed=True, all_times=grid.times, recording=recording)

    return take


def power(order):
    return lambda length: SIZE * length**order


def change(order, length):
    """Return the change from segments of twice a length to that length, as a share of the force there."""
    return power(order)(length) * (2.0**order - 1.0) / (1.0 + power(order)(length))


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("rtol", [0.3, 0.03, 0.01])
def test_the_reported_error_is_the_last_change_and_no_less_than_the_true_error(order, rtol):
    trial = dataclasses.replace(TRIAL, rtol=rtol)
    lengths = trial.segment_length * 0.5 ** np.arange(5)
    within = [halvings for halvings, length in enumerate(lengths) if change(order, length) <= rtol]
    halvings = min(within, default=4)
    run, accuracy = refinement.run_converged(trial, taking(power(order)), refinement.Budget())
    assert accuracy.halvings == halvings
    assert accuracy.force_error == pytest.approx(change(order, lengths[halvings]), rel=1e-12)
    true = power(order)(lengths[halvings]) / (1.0 + power(order)(lengths[halvings]))
    assert accuracy.force_error >= true * (1.0 - 1e-12)
    assert accuracy.converged == (accuracy.force_error <= rtol)
    assert run.recording.trace[0, 0] == pytest.approx(1.0 + power(order)(lengths[halvings]))


def test_a_force_that_is_another_at_every_resolution_is_not_converged():
    _, accuracy = refinement.run_converged(
        TRIAL, taking(lambda length: np.sin(40.0 * np.log(length))), refinement.Budget()
    )
    assert not accuracy.converged
    assert accuracy.force_error > TRIAL.rtol


def test_a_budget_that_ends_leaves_the_last_change_as_the_error():
    trial = dataclasses.replace(TRIAL, rtol=1e-3)
    _, accuracy = refinement.run_converged(trial, taking(power(1), iterations=1e6), refinement.Budget(12.0))
    assert accuracy.budget_spent
    assert accuracy.halvings < 4
    length = trial.segment_length * 0.5**accuracy.halvings
    assert accuracy.force_error == pytest.approx(change(1, length), rel=1e-12)
