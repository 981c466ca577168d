"""What is believed before a record is seen; that what is measured stays as it was."""

from math import comb

import numpy as np
import pytest

from subzero.diagnosis.inference import PRIOR, Observed, log_prior


def test_prior_probabilities_sum_to_one():
    """Those of the kinds, and those of every hypothesis within the kinds that have a list."""
    assert sum(PRIOR.values()) == pytest.approx(1.0)
    count = 30
    for size, kind in enumerate(("none", "single", "pair", "more")):
        one = np.exp(log_prior(tuple(map(str, range(size))), count))
        assert one * comb(count, size) == pytest.approx(PRIOR[kind])


def test_a_correction_of_the_simulation_leaves_what_was_measured():
    values = {"depth": np.array([1.0, 2.0])}
    record = Observed(name="x", time=np.arange(2.0), values=values, noise={}, setting=None)
    twice = record.corrected({"depth": np.array([0.5, 0.0])}).corrected({"depth": np.array([0.25, 1.0])})
    assert twice.values["depth"].tolist() == [1.0, 2.0]
    assert twice.correction["depth"].tolist() == [0.75, 1.0]
