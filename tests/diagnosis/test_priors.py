"""What is measured stays as it was."""

import numpy as np

from subzero.diagnosis.inference import Observed


def test_a_correction_of_the_simulation_leaves_what_was_measured():
    values = {"depth": np.array([1.0, 2.0])}
    record = Observed(name="x", time=np.arange(2.0), values=values, noise={}, setting=None)
    twice = record.corrected({"depth": np.array([0.5, 0.0])}).corrected({"depth": np.array([0.25, 1.0])})
    assert twice.values["depth"].tolist() == [1.0, 2.0]
    assert twice.correction["depth"].tolist() == [0.75, 1.0]
