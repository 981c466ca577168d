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
NUMBER = SimpleNamespace(name="rudder.lift_slope", low=-1.0, high=2.0, prior_sd=1.0)


def fitted(size=1.0, slow=1.0, resolution=0.0, known=None, **more):
    white, used = 0.5 * USUAL, np.ones(TIME.size, bool)
    noise = Noise(white=white, slow=slow * USUAL, resolution=resolution, used=used, time=TIME)
    record = SimpleNamespace(name="zigzag", known=known or {}, noise={"heading": noise})
    r = size * np.random.default_rng(8).standard_normal(TIME.size)
    r[1:] += more.get("coloured", 0.0) * r[:-1]
    fit = SimpleNamespace(r=r, z=np.array([more.get("at", 0.0), -7.0]))
    problem = SimpleNamespace(records=[record])
    M = np.eye(2) * more.get("sd", 0.1) ** 2
    return SimpleNamespace(problem=problem, fit=fit, M=M, settled=more.get("settled", True),
                           repeated=more.get("repeated", True))  # fmt: skip


@pytest.mark.parametrize(("work", "words"), [
    (fitted(), ""),
    (fitted(size=1.3), "misses the heading in zigzag"),
    (fitted(coloured=0.4, size=0.9), "is no noise (Ljung and Box"),
    (fitted(slow=3.0), "wandering by 3.0 times"),
    (fitted(slow=3.0, resolution=6.0 * USUAL), ""),
    (fitted(slow=3.0, known={"heading": 2.0 * USUAL}), ""),
    (fitted(slow=1.5, known={"heading": 0.5 * USUAL}), "wandering by 3.0 times"),
    (fitted(at=-1.0), "rudder.lift_slope stands at its bound"),
    (fitted(at=2.0), "rudder.lift_slope stands at its bound"),
    (fitted(at=2.0, sd=0.9), ""),
    (fitted(settled=False), "found no minimum"),
    (fitted(repeated=False), "Every start ended in another minimum"),
])  # fmt: skip
def test_what_is_left_is_held_to_the_noise_of_the_sensor(work, words):
    said = " ".join(refused([NUMBER], work))
    assert (words in said) if words else (said == "")
