"""A fit that leaves more than noise is no calibration, and one that leaves noise is.

Verifies: `subzero.calibration.assessment.refused`. Configuration: a residual of 400 samples, white by law, of a compass
with its usual noise of 0.4 degrees.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from subzero.calibration.assessment import refused
from subzero.diagnosis import SPECS
from subzero.diagnosis.inference import Noise

USUAL = SPECS["heading"].noise
TIME = np.arange(0.0, 40.0, 0.1)


def fitted(size=1.0, slow=1.0, resolution=0.0, known=None, settled=True):
    noise = Noise(
        white=0.5 * USUAL, slow=slow * USUAL, resolution=resolution, used=np.ones(TIME.size, bool), time=TIME
    )
    record = SimpleNamespace(name="zigzag", known=known or {}, noise={"heading": noise})
    r = size * np.random.default_rng(8).standard_normal(TIME.size)
    return SimpleNamespace(
        problem=SimpleNamespace(records=[record]), fit=SimpleNamespace(r=r), settled=settled
    )


@pytest.mark.parametrize(("work", "words"), [
    (fitted(), ""),
    (fitted(size=1.3), "misses the heading in zigzag"),
    (fitted(slow=3.0), "wandering by 3.0 times"),
    (fitted(slow=3.0, resolution=6.0 * USUAL), ""),
    (fitted(slow=3.0, known={"heading": 2.0 * USUAL}), ""),
    (fitted(slow=1.5, known={"heading": 0.5 * USUAL}), "wandering by 3.0 times"),
    (fitted(settled=False), "found no minimum"),
])  # fmt: skip
def test_what_is_left_is_held_to_the_noise_of_the_sensor(work, words):
    said = " ".join(refused(work))
    assert (words in said) if words else (said == "")
