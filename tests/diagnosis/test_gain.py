"""The gain on data that were not fitted: all of it for the right cause, none for a wrong one or for nothing."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from subzero.diagnosis import catalogue
from subzero.diagnosis.assessment import BLOCKS, Fitted, gain, held_out, parts_of, raw, rows_of, share
from subzero.diagnosis.inference import Noise, objective, rewhitened


def hidden(name, size):
    return lambda setting: catalogue(("heading",))[name].apply(setting, size)


@pytest.fixture(scope="module")
def struck(plant):
    """The propeller's torque rolls the hull thrice as much as it should: far beyond its tolerance."""
    planted = plant(hidden("propeller_torque", 3.0))
    fits = {
        ids: Fitted(planted.problem, planted.fit(*ids))
        for ids in ((), ("propeller_torque",), ("yaw_damping",))
    }
    return planted, fits


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_right_cause_is_sure_to_gain_and_a_wrong_one_is_not(plant, seed):
    """It is the lower bound that tells them apart: the fit of a wrong cause is strained, and its gain scatters widely
    (0.52, 0.66 and 0.00 for these seeds, with lower bounds of −0.30, −0.11 and −0.03).
    """
    planted = plant(hidden("propeller_torque", 3.0), seed=seed)
    tolerance, cause, rival = (
        Fitted(planted.problem, planted.fit(*ids)) for ids in ((), ("propeller_torque",), ("yaw_damping",))
    )
    right, wrong = gain(planted.r, tolerance, cause, rival), gain(planted.r, tolerance, rival)
    assert right.total > 0.95
    assert right.owed > 0.9
    assert right.owed_low > 0.2
    assert wrong.owed < right.owed - 0.2
    assert wrong.owed_low < 0.05
    assert right.how == BLOCKS
    roll = right.held_out["roll_angle"]
    assert roll.after < min(roll.rival, roll.tolerance)
    assert roll.after == pytest.approx(roll.floor, rel=0.25)


def test_a_healthy_record_owes_nothing(plant):
    planted = plant()
    tolerance, extended = (Fitted(planted.problem, planted.fit(*ids)) for ids in ((), ("hull_drag",)))
    found = gain(planted.r, tolerance, extended)
    assert abs(found.owed) < 0.3
    assert found.owed_low < 0.1


def test_gains_repeat_with_their_seed(struck):
    planted, fits = struck
    one, same = (gain(planted.r, fits[()], fits["propeller_torque",], seed=3) for _ in range(2))
    assert one == same


def test_an_extension_beside_noise_of_its_own_is_judged_in_the_same_units(struck):
    """A force has the noise beside it, of which there is less; a fit that was white by that was told in levels of the
    other, and made a speed worse that it had made better.
    """
    planted, fits = struck
    known, fit = fits["propeller_torque",]
    quieter = [
        replace(one, noise={name: replace(noise, white=0.5 * noise.white, slow=0.3 * noise.slow)
                            for name, noise in one.noise.items()})
        for one in known.records
    ]  # fmt: skip
    own = replace(known, records=tuple(quieter))
    there = Fitted(own, rewhitened(fit, known, own))
    afresh = objective(own.residual(fit.z), fit.z, fit.D)
    assert there.fit.objective == pytest.approx(afresh, rel=1e-9), "what a run under that noise has"
    assert afresh > 1.5 * fit.objective, "quieter noise makes more of the same residual"
    same, found = (gain(planted.r, fits[()], one) for one in (fits["propeller_torque",], there))
    for channel, one in same.fitted.items():
        other = found.fitted[channel]
        assert_allclose(
            (other.before, other.tolerance, other.after), (one.before, one.tolerance, one.after), rtol=1e-9
        )
        assert other.floor < one.floor
        assert found.held_out[channel].after == pytest.approx(same.held_out[channel].after, rel=0.3)


def test_parts_cover_the_trial_and_a_refit_without_them_is_worse(struck):
    planted, fits = struck
    parts = parts_of(planted.problem, rows_of(planted.problem))
    assert sorted(set(parts)) == [0, 1, 2, 3, 4]
    fit = fits["propeller_torque",].fit
    out = held_out(fits["propeller_torque",], parts)
    assert np.sum(fit.r**2) < np.sum(out**2) < 1.2 * np.sum(fit.r**2)


def test_what_was_whitened_gets_its_colour_and_unit_back(struck):
    values = np.random.default_rng(0).standard_normal(8)
    used = np.array([True, True, False, True, True, True, False, True])
    noise = Noise(white=0.1, slow=0.3, correlation_time=0.2, used=used, time=0.1 * np.flatnonzero(used))
    assert_allclose(noise.colour(noise.whiten(values)), values[used])
    planted, _ = struck
    assert raw(planted.problem, planted.r).shape == planted.r.shape


def test_a_share_is_one_at_the_noise_and_negative_for_harm():
    assert share(5.0, 1.0, 1e6) == pytest.approx(1.0)
    assert share(5.0, 0.98, 1e6) == pytest.approx(1.0)
    assert share(5.0, 3.0, 1e6) == pytest.approx(0.5)
    assert share(2.0, 3.0, 1e6) == pytest.approx(-1.0)
    assert abs(share(1.001, 0.999, 2000.0)) < 0.1
