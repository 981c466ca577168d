"""Sensitivities of a calibration are those of a curve, and stay within bounds.

Verifies: `Problem.central_jacobian`. Configuration: a problem whose simulation is the square of its deviations.
"""

import numpy as np
import pytest

from subzero.diagnosis import Effect, Parameter
from subzero.diagnosis.inference import Problem, entries_of

LOW, HIGH = -1.0, 2.0


class Squares(Problem):
    """h(z) = z² for every entry, of one record that needs no run."""

    def setting(self, record, z, *, late=True):
        return z

    def tracks(self, jobs, stops=None):
        return [None] * len(jobs)

    def whitened(self, record, setting, track, *, measured=False):
        return setting**2


def problem(count):
    def nothing(setting, size):
        return setting

    parameter = Parameter(name="size", unit="1", tolerance=0.1, scale=1.0, low=LOW, high=HIGH)
    effects = [Effect(id=f"e{k}", sentence="it is another", slot="hull", apply=nothing, parameters=(parameter,))
               for k in range(count)]  # fmt: skip
    return Squares(records=(None,), entries=entries_of(effects, (), 1))


def test_central_differences_are_exact_on_a_parabola_and_one_sided_ones_are_not():
    z = np.array([0.3, -0.5, 1.0])
    assert problem(3).central_jacobian(z) == pytest.approx(np.diag(2.0 * z), abs=1e-9)
    assert np.max(np.abs(problem(3).jacobian(z) - np.diag(2.0 * z))) > 0.01


def test_at_a_bound_no_run_is_made_beyond_it():
    z = np.array([LOW, HIGH])
    J = problem(2).central_jacobian(z)
    assert J[0, 0] == pytest.approx(2.0 * LOW, abs=0.05)
    assert J[0, 0] > 2.0 * LOW, "from within"
    assert J[1, 1] < 2.0 * HIGH, "from within"
