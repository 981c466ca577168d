"""The noise of a channel against dense linear algebra, and what is found of it behind a fit, whatever kind it is.

Verifies: whitening, and its inverse, against the Cholesky factor of the covariance; level, slow part and resolution
behind a misfit that parameters explain, for noise of any family and sampling; that it is the most probable, by dense
covariances, of a channel alone and of several with parameters in common. Configuration: made-up channels, 24 records
each. Tolerance: linear algebra to 1e-9; medians of levels within 20 %, as 24 records of 30 s let one expect.
"""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
from benchmarks.diagnosis import world
from subzero.diagnosis import NOISE, catalogue
from subzero.diagnosis.inference import (
    Noise,
    Observed,
    as_noise,
    prior_of,
    resolution_of,
    spikes,
    with_residual_noise,
)
from subzero.identification import noise as general
from subzero.identification.noise import log_times, most_probable, visible

LEVEL = 0.3
RECORDS = 24


def slow(random, time, sd, lasts):
    """Return an Ornstein-Uhlenbeck process by the factor of its covariance: not as the program makes it white."""
    covariance = np.exp(-np.abs(np.subtract.outer(time, time)) / lasts)
    return sd * np.linalg.cholesky(covariance + 1e-12 * np.eye(time.size)) @ random.standard_normal(time.size)


def test_whitening_is_the_inverse_of_a_cholesky_factor_at_uneven_times():
    random = np.random.default_rng(1)
    time, used = np.sort(random.uniform(0.0, 30.0, 300)), random.random(300) > 0.1
    noise = Noise(white=0.1, slow=0.2, correlation_time=2.0, resolution=0.3, used=used, time=time[used])
    apart = np.abs(np.subtract.outer(time[used], time[used]))
    covariance = 0.2**2 * np.exp(-apart / 2.0) + (0.1**2 + 0.3**2 / 12.0) * np.eye(int(used.sum()))
    values, half = random.standard_normal((300, 3)), np.linalg.cholesky(covariance)
    assert_allclose(noise.whiten(values), np.linalg.solve(half, values[used]), atol=1e-9)
    assert_allclose(noise.colour(noise.whiten(values)), values[used], atol=1e-9)
    assert_allclose(noise.log_scale, np.sum(np.log(np.diag(half))), atol=1e-9)
    assert_allclose(noise.whiten(values[:, 0]), noise.whiten(values)[:, 0])


def test_a_record_is_whitened_channel_by_channel_also_where_one_has_no_values_any_more():
    """What no run could tell of one channel is no news of the next."""
    random, time = np.random.default_rng(2), np.arange(0.0, 20.0, 0.1)
    used = {"depth": random.random(200) > 0.1, "heading": random.random(200) > 0.3}
    noise = {name: Noise(white=0.1, slow=0.2, used=one, time=time[one]) for name, one in used.items()}
    values = {"depth": np.where(time < 15.0, random.standard_normal(200), np.nan), "heading": np.sin(time)}
    record = Observed(name="one", time=time, values={}, noise=noise, setting=None)
    apart = [one.whiten(values[name]) for name, one in noise.items()]
    assert_allclose(record.whiten(values), np.concatenate(apart), rtol=1e-12)
    assert np.isfinite(apart[1]).all()


def test_the_mean_of_slow_noise_scatters_as_its_covariance_says():
    noise = Noise(
        white=0.1, slow=0.2, correlation_time=3.0, used=np.ones(21, bool), time=np.arange(21) / 10.0
    )
    apart = np.abs(np.subtract.outer(noise.time, noise.time))
    covariance = 0.2**2 * np.exp(-apart / 3.0) + 0.1**2 * np.eye(21)
    assert_allclose(noise.sd_of_mean(21, 2.0), np.sqrt(np.mean(covariance)), rtol=0.01)


def behind(random, time, noise, misfit=1.0):
    """Return noise on top of a misfit that six parameters explain, each within its tolerance; and their J D^½."""
    J = np.column_stack([np.sin((k + 1) * time / 9.0 + k) for k in range(6)])
    return noise + J @ (misfit * random.standard_normal(6)), misfit * J


def estimate(time, residual, F, *, is_known=False):
    """Return the most probable noise behind a fit, as `posing` has it."""
    prior, used = prior_of(LEVEL, 0.0, time, is_known=is_known), np.ones(time.size, bool)
    columns = np.column_stack([visible(F, LEVEL), residual])
    found = most_probable(prior.usual(), prior, time, columns, lambda noise: times_of(noise, prior))
    return as_noise(found, prior, time, used)


def times_of(noise, prior):
    """Return the log prior density of the correlation time of a channel by itself."""
    return log_times([noise], [prior.interval])


FAMILIES = {
    "white": (0.1, 30.0, LEVEL, 0.0, 1.0),
    "mild": (0.1, 30.0, 0.0, LEVEL, 0.144),
    "slow": (0.1, 30.0, 0.0, LEVEL, 0.95),
    "slow and white": (0.1, 60.0, 0.7 * LEVEL, 0.7 * LEVEL, 3.0),
    "once a second": (1.0, 60.0, LEVEL, 0.0, 1.0),
    "a hundred times a second": (0.01, 6.0, LEVEL, 0.0, 1.0),
    "thrice as much": (0.1, 30.0, 3.0 * LEVEL, 0.0, 1.0),
}


@pytest.mark.long
@pytest.mark.parametrize("family", FAMILIES)
def test_level_is_found_behind_what_parameters_explain(family):
    step, end, white, slow_sd, lasts = FAMILIES[family]
    random, time, found = np.random.default_rng(3), np.arange(0.0, end, step), []
    for _ in range(RECORDS):
        noise = white * random.standard_normal(time.size) + slow(random, time, slow_sd, lasts)
        found.append(estimate(time, *behind(random, time, noise)))
    assert_allclose(np.median([one.sd for one in found]), np.hypot(white, slow_sd), rtol=0.2)
    lasting = 2.0 * slow_sd**2 * lasts + white**2 * step
    unseen = 2.0 * (0.35 * LEVEL) ** 2  # of a slow part so small that nothing but its prior speaks of it
    assert 0.5 < np.median([one.lasting for one in found]) / lasting < 2.0 + unseen / lasting


def dense(noise, resolution=0.0):
    """Return the covariance of a channel's noise (m, m)."""
    apart = np.abs(np.subtract.outer(noise.time, noise.time))
    white = noise.white**2 + resolution**2 / 12.0
    return noise.slow**2 * np.exp(-apart / noise.correlation_time) + white * np.eye(noise.time.size)


def log_normal(values, covariance):
    """Return log N(values; 0, covariance), but for a constant."""
    return -0.5 * values @ np.linalg.solve(covariance, values) - 0.5 * np.linalg.slogdet(covariance)[1]


def test_no_noise_close_by_is_more_probable_than_what_is_found():
    """The search ends where 0.05 more would be gained, in nats."""
    random, time = np.random.default_rng(4), np.arange(0.0, 30.0, 0.1)
    residual, F = behind(random, time, slow(random, time, 0.2, 3.0) + 0.2 * random.standard_normal(time.size))
    prior = prior_of(LEVEL, 0.0, time, is_known=False)

    def log_posterior(noise):
        one = general.Noise(noise.white, noise.slow, noise.correlation_time)
        return log_normal(residual, F @ F.T + dense(noise)) + prior.log_density(one) + times_of(one, prior)

    found = estimate(time, residual, F)
    for what in ("white", "slow", "correlation_time"):
        for factor in (0.8, 1.25):
            other = dataclasses.replace(found, **{what: factor * getattr(found, what)})
            assert log_posterior(other) < log_posterior(found) + 0.1, (what, factor)


@pytest.mark.slow
@pytest.mark.parametrize("index", [4, 76])
def test_a_healthy_record_with_white_and_slow_noise_at_once_gets_no_name(index):
    """With one noise for all, that behind the best fit, both were named with 0.99."""
    logged, planted = world.record_of(world.drawn(7301, index + 1)[index])
    assert not planted
    assert subzero.diagnose(logged, budget="verdict").verdict != "cause_named"


def test_a_misfit_that_the_parameters_can_follow_is_no_noise(plant):
    """A hull that is a little heavier, which the prior just allows, or forbids."""
    heavier, name = 0.02, "net_buoyancy"  # [N]
    planted = plant(lambda setting: catalogue(["depth"])[name].apply(setting, -heavier))
    problem, zero = planted.problem, np.zeros(len(planted.problem.entries))
    free = [entry.effect.id == name for entry in problem.entries]
    level = {}
    for allowed in (heavier, 1e-6):
        D = np.where(free, allowed, 1e-6 * np.array([e.parameter.tolerance for e in problem.entries])) ** 2
        again = with_residual_noise(problem, zero, D)
        (record,) = (again or problem).records
        level[allowed] = record.noise["depth"].sd / NOISE["depth"]
    assert level[heavier] == pytest.approx(1.0, rel=0.2)  # 300 samples of coloured noise
    assert level[1e-6] > 1.5


def test_a_wander_of_twenty_levels_is_no_noise():
    random, time = np.random.default_rng(4), np.arange(0.0, 30.0, 0.1)
    wander = 20.0 * LEVEL * np.sin(2.0 * np.pi * time / 20.0)
    found = estimate(time, *behind(random, time, LEVEL * random.standard_normal(300) + wander, 1e-3))
    assert found.slow < 4.0 * LEVEL
    assert np.sum(found.whiten(wander) ** 2) > 100.0, "ten standard deviations of it still show"


def test_a_known_level_is_kept():
    random, time = np.random.default_rng(5), np.arange(0.0, 30.0, 0.1)
    noise = behind(random, time, LEVEL * random.standard_normal(300))
    assert_allclose(estimate(time, *noise, is_known=True).sd, LEVEL, rtol=0.1)


@pytest.mark.parametrize("step", [1.0, 0.05, 0.1, 1e-3])
def test_the_resolution_is_read_off_the_values(step):
    random = np.random.default_rng(6)
    smooth = 30.0 * step * np.sin(np.arange(300) / 40.0) + step * random.standard_normal(300)
    smooth[random.random(300) < 0.05] = np.nan
    rounded = np.round((170.0 + smooth) / step) * step
    assert_allclose(resolution_of(rounded, LEVEL), step, rtol=1e-6)
    assert_allclose(resolution_of(np.round(rounded, 7), LEVEL), step, rtol=1e-4)
    assert resolution_of(170.0 + smooth, LEVEL) == 0.0, "what is not rounded has none"


@pytest.mark.parametrize("jump", [0.24, 0.013, 0.0098])
def test_the_resolution_is_that_before_and_behind_a_jump(jump):
    """A sensor that jumps by no whole step is rounded all the same, and so is a record without that jump."""
    random = np.random.default_rng(8)
    rounded = (
        np.round((2.0 * np.sin(np.arange(300) / 40.0) + 0.02 * random.standard_normal(300)) / 0.05) * 0.05
    )
    rounded[170:] += jump
    assert_allclose(resolution_of(rounded, 0.015), 0.05, rtol=1e-6)


def test_the_resolution_is_that_of_a_value_that_is_hardly_ever_left_though_a_few_samples_are_wrong():
    """Such as a heading near 0 in whole radians, of which outliers are turned into ±180 degrees."""
    random = np.random.default_rng(7)
    values = np.zeros(400)
    values[random.permutation(400)[:22]] = [*[57.3] * 11, *[-57.3] * 7, -41.07, -41.07, 16.2, 16.2]
    assert resolution_of(values, 0.4) == pytest.approx(57.3)
    values[values != 0.0] = random.standard_normal(22)
    assert resolution_of(values, 0.4) == 0.0, "of a sensor that freezes nothing is known"
    values[values == 0.0] = -999.0
    assert resolution_of(values, 0.4) == 0.0, "what stands for nothing is no step away from what is measured"


def test_a_record_of_seven_digits_is_hardly_rounded():
    values = np.array([float(f"{x:.7g}") for x in 27.0 + np.random.default_rng(7).standard_normal(300)])
    assert resolution_of(values, LEVEL) < 1e-4


def test_a_value_that_never_changes_says_nothing_of_its_step():
    """Then it is as coarse as a usual sensor is noisy, not perfect."""
    assert_allclose(resolution_of(np.full(50, 5.0), LEVEL) / np.sqrt(12.0), LEVEL)


def test_spikes_are_those_that_stand_alone():
    values = np.sin(np.arange(200) / 200.0) + 0.02 * np.random.default_rng(5).standard_normal(200)
    values[[20, 77, 150]] += [1.0, -0.8, 0.5]
    assert np.flatnonzero(spikes(values, 0.02)).tolist() == [20, 77, 150]
    values[100:] += 3.0
    assert np.flatnonzero(spikes(values, 0.02)).tolist() == [20, 77, 150], "a step is no spike"


def test_tails_of_a_tenth_of_the_samples_are_no_spikes_but_a_few_far_off_are():
    """Real sensors have such noise (a glider's pressure, a pool's compass): as outliers, a tenth of a channel had it
    told in feet, in which there would be none.
    """
    random = np.random.default_rng(6)
    values = 0.1 * random.standard_normal(400)
    tails = random.random(400) < 0.1
    values[tails] += 0.5 * random.choice([-1.0, 1.0], tails.sum())
    assert not spikes(values, 0.2).any()
    values[[50, 200, 351]] += 5.0
    assert np.flatnonzero(spikes(values, 0.2)).tolist() == [50, 200, 351]
    assert np.array_equal(spikes(3.0 * values, 0.6), spikes(values, 0.2)), "in any unit"


def test_two_spikes_at_the_end_of_a_record_are_no_majority():
    values = 0.02 * np.random.default_rng(3).standard_normal(200)
    for first, second in ((-1, -2), (-1, -3), (-2, -3), (0, 1), (1, 2)):
        spoilt = values.copy()
        spoilt[[first, second]] += 0.25
        assert np.flatnonzero(spikes(spoilt, 0.02)).tolist() == sorted({first % 200, second % 200})
    slope = values + 0.01 * np.arange(200)
    assert not spikes(slope, 0.02).any(), "a slope of half a noise level a sample is none at the ends either"
