"""Sensitivities of a calibration are those of a curve, and the ends of its intervals are looked at.

Verifies: `Problem.central_jacobian`, `subzero.calibration.fit.ends_checked`. Configuration: problems of one record that
needs no run, whose residual is a curve: a square; one that stays flat far out; a line that is 0 elsewhere.
"""

import dataclasses

import numpy as np
import pytest

from subzero.calibration.fit import ends_checked, is_settled, wider_by_rows
from subzero.diagnosis import Effect, Parameter
from subzero.diagnosis.inference import Fit, Noise, Problem, entries_of

LOW, HIGH = -1.0, 2.0


class Curve(Problem):
    """A curve of every entry, of one record that needs no run."""

    @staticmethod
    def curve(z):
        return z**2

    def setting(self, record, z, *, late=True):
        return z

    def tracks(self, jobs, stops=None):
        return [None] * len(jobs)

    def true(self, record, setting, track):
        return {}

    def whitened(self, record, setting, track, *, measured=False, true=None):
        return self.curve(setting)


class Flat(Curve):
    """It begins with slope 10 and stays below 1."""

    @staticmethod
    def curve(z):
        return np.sign(z) * np.sqrt(-np.expm1(-((10.0 * z) ** 2)))


class Aside(Curve):
    """It is 0 at 0.2."""

    @staticmethod
    def curve(z):
        return 20.0 * z - 4.0


class Straight(Curve):
    """It is what Laplace says."""

    @staticmethod
    def curve(z):
        return 10.0 * z


def problem(count, kind=Curve):
    def nothing(setting, size):
        return setting

    parameter = Parameter(name="size", unit="1", tolerance=0.1, scale=1.0, low=LOW, high=HIGH)
    effects = [Effect(id=f"e{k}", sentence="it is another", slot="hull", apply=nothing, parameters=(parameter,))
               for k in range(count)]  # fmt: skip
    return kind(records=(None,), entries=entries_of(effects, (), 1))


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


def checked(kind):
    one, D = problem(1, kind), np.array([100.0])
    r = one.residual(np.zeros(1))
    fit = Fit(z=np.zeros(1), r=r, J=np.array([[10.0]]), D=D, objective=0.5 * float(r @ r), converged=True)
    return ends_checked(one, fit, np.array([[0.01]]), 1)


@pytest.mark.parametrize(
    "entry, off, free, settled", [(0, 0.5, 1, True), (0, 2.0, 1, False), (1, 2.0, 1, True)]
)
def test_a_fit_has_settled_if_the_whole_step_moves_no_calibrated_number(entry, off, free, settled):
    """However little the damped step of a fit would gain; by so many standard deviations of 0.1; a start may move."""
    one, D, z = problem(2, Straight), np.full(2, 100.0), np.zeros(2)
    z[entry] = 0.1 * off
    fit = Fit(z=z, r=one.residual(z), J=10.0 * np.eye(2), D=D, objective=0.0, converged=True)
    assert is_settled(one, fit, 0.01 * np.eye(2), free) == settled


def test_an_interval_at_whose_ends_the_posterior_has_not_fallen_is_widened():
    wider, better = checked(Flat)
    assert better is None
    assert wider == pytest.approx([1.96 / np.sqrt(1.0 - np.exp(-(1.96**2)))], rel=1e-3)


def test_an_interval_of_a_normal_posterior_stays_as_it_is():
    wider, better = checked(Straight)
    assert better is None
    assert wider == pytest.approx([1.0], rel=1e-3)


@dataclasses.dataclass(frozen=True)
class Levels:
    """A channel that shows a level of 0 with noise of 1, but for three samples that show 30 and were left out."""

    time: np.ndarray
    values: dict[str, np.ndarray]
    noise: dict[str, Noise]


class Level(Curve):
    """The level that all samples show which are used."""

    def whitened(self, record, setting, track, *, measured=False, true=None):
        one = self.records[0]
        return float(setting[0]) - one.values["depth"][one.noise["depth"].used]


@pytest.mark.parametrize(
    ("at", "factor"), [([10, 11, 12], np.sqrt(1.0 + 0.9**2 * 100.0)), ([10, 30, 50], 1.0)]
)
def test_an_interval_holds_what_outliers_in_a_row_would_make_of_it_and_not_what_single_ones_would(at, factor):
    """100 samples: with the three the level is 0.9, nine of its standard deviations of 0.1 off."""
    values, used, time = np.zeros(100), np.ones(100, bool), np.arange(100.0)
    values[at], used[at] = 30.0, False
    record = Levels(time, {"depth": values}, {"depth": Noise(white=1.0, used=used, time=time[used])})
    one, D = dataclasses.replace(problem(1, Level), records=(record,)), np.array([1e6])
    z = np.zeros(1)
    fit = Fit(z=z, r=one.residual(z), J=np.ones((97, 1)), D=D, objective=0.0, converged=True)
    assert wider_by_rows(one, fit, np.array([[0.01]])) == pytest.approx([factor], rel=1e-3)


def test_what_is_better_at_the_end_of_an_interval_is_told():
    _, better = checked(Aside)
    assert better == pytest.approx([0.196], rel=1e-3)
