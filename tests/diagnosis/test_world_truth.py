"""The truths of the benchmark: runs with segments of two lengths must say the same.

Verifies: the first run that a coarser one agrees with is taken; where none agrees, or one cannot be run, there is no
truth. What a sensor of the world is off by: rounding lasts where a value stands still, and is as good as white noise
where it does not. Configuration: a formulation that is made up.
"""

import numpy as np
import pytest

from benchmarks.diagnosis import manoeuvres, truth, world
from subzero.diagnosis import SPECS
from subzero.diagnosis.inference import Noise
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


@pytest.mark.parametrize(("speed", "lasting"), [(0.02, True), (7.3, False)])
def test_what_rounding_takes_off_lasts_as_long_as_a_value_stands_still(speed, lasting):
    """A ramp of `speed` steps a second, ten samples a second, little noise: a sawtooth of 1/speed seconds, or none."""
    time = np.linspace(0.0, 100.0, 1001)
    truth_there = speed * time + 0.03 * np.random.default_rng(5).standard_normal(time.size)
    used = np.ones(time.size, dtype=bool)
    errors = np.round(truth_there) - speed * time
    noise = world.likeliest_noise(errors, Noise(white=1.0, used=used, time=time))
    assert noise.sd == pytest.approx(np.sqrt(1.0 / 12.0), rel=0.3)
    longer = noise.lasting / (
        0.1 * noise.sd**2
    )  # spectral density at low frequencies, over that of white noise
    assert longer > 50.0 if lasting else longer < 3.0
