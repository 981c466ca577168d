"""The truths of the benchmark: runs with segments of two lengths must say the same.

Verifies: the first run that a coarser one agrees with is taken; where none agrees, or one cannot be run, there is no
truth. Configuration: a formulation that is made up.
"""

import numpy as np
import pytest

from benchmarks.diagnosis import manoeuvres, truth
from benchmarks.diagnosis.cases import HEAVY, cases
from subzero.diagnosis import SPECS
from subzero.synthetic.reference_run import NoTruthError

TIMES, CHANNELS = np.linspace(0.0, 10.0, 101), ("heading",)


def shown(monkeypatch, error):
    """Return what is agreed on where runs with segments h are wrong by error(h), in noise levels."""

    def simulate(setting, times, channels, *, segment_length, **steps):
        return {"heading": error(segment_length) * SPECS["heading"].noise * np.ones(times.size)}

    monkeypatch.setattr(truth, "simulate_reference", simulate)
    return truth.agreed(manoeuvres.nominal("fig6"), TIMES, CHANNELS)["heading"] / SPECS["heading"].noise


@pytest.mark.parametrize(("size", "segment"), [(0.9, 0.25), (3.0, 0.125)])
def test_the_first_run_that_a_coarser_one_agrees_with_is_the_truth(monkeypatch, size, segment):
    """Errors of size h² differ between 0.5 and 0.25 m by 0.1875 size, in 101 samples: 4 = 101 (0.199)²."""
    np.testing.assert_allclose(shown(monkeypatch, lambda h: size * h * h), size * segment**2)


def test_there_is_no_truth_where_every_run_says_another(monkeypatch):
    with pytest.raises(truth.NoRunError):
        shown(monkeypatch, lambda h: np.sin(9.0 / h))


@pytest.mark.parametrize("none", [np.nan, NoTruthError("none")])
def test_there_is_no_truth_where_nothing_can_be_run(monkeypatch, none):
    def cannot(h):
        if isinstance(none, float):
            return none
        raise none

    with pytest.raises(truth.NoRunError):
        shown(monkeypatch, cannot)


def test_heavy_drums_are_hidden_where_they_have_a_truth():
    hidden = [case for case in cases() if HEAVY in case.causes]
    assert hidden
    assert all(case.manoeuvre != "rich" for case in hidden)
