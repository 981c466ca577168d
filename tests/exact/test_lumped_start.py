"""A cable that lies straight and slack in the water comes along without a bight: the lumped cable's start.

Verifies: `cable.lumped.history.lay`. Exact: the length in the water is the distance between the ends. Tolerance: the
stretch of an "inextensible" lumped cable, 1e-6 of its length. A start at a tension of 1e-11 N had a tenth of its
length too much.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cable import DrumProperties, Lumped, pull_out


@pytest.mark.parametrize("wet", [0.3, 5.0])
@pytest.mark.parametrize("inertia", [0.0, 0.002])
def test_a_cable_pulled_from_rest_has_the_length_between_its_ends(wet, inertia):
    history = pull_out(
        lambda t: np.array([0.12 * t, 0.0, 0.0]), 2.0, start=wet, drum=DrumProperties(inertia=inertia),
        scheme=Lumped(time_step=0.05, segment_length=0.25),
    )  # fmt: skip
    assert history.outcome.completed
    assert_allclose(history.length, history.tow_point[:, 0], rtol=2e-6, atol=1e-5)
