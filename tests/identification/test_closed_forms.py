"""Noise, evidence and estimates against closed forms.

Tolerance: rounding errors, 1e-8; Laplace is exact for a linear problem, whose covariances are summed in another order,
1e-6.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

import subzero.diagnosis as sd
from subzero.identification.candidates import _Followed, declared, suggested
from subzero.identification.explanation import data_terms
from subzero.identification.fit import (
    Levels,
    Products,
    fit,
    given_others,
    linearised,
    solve,
    usual_levels,
    with_secant,
)
from subzero.identification.noise import (
    Filter,
    Noise,
    NoisePrior,
    level_of,
    log_marginal,
    log_times,
    middle_of_equal,
    resolution_of,
)
from subzero.identification.problem import Problem
from subzero.identification.readings import spikes, spikes_at_ends
from tests.identification.oscillator import STEP, model, record


def line(p, u, t):
    """A model that is linear in its numbers."""
    return {"y": p["a"] + p["b"] * t + u["push"]}


@pytest.fixture
def problem():
    rng = np.random.default_rng(3)
    time = np.sort(rng.uniform(0.0, 10.0, 40))
    record = sd.Record(time, {"y": 1.0 + 0.5 * time + 0.1 * rng.standard_normal(40)})
    numbers = [sd.Number("a", 0.8, tolerance=0.3), sd.Number("b", 0.6, tolerance=0.2)]
    unknown = [sd.Unknown("push", size=0.2, time=3.0)]
    sensor = sd.Sensor(noise=0.1, resolution=0.0)
    return Problem(sd.Model(line, {"y": sensor}, parameters=numbers, unknown=unknown), [record])


def covariance(noise, time):
    return noise.white**2 * np.eye(time.size) + noise.slow**2 * np.exp(
        -np.abs(np.subtract.outer(time, time)) / noise.time
    )


def test_what_would_be_seen_is_the_size_at_which_the_odds_of_two_gaussians_are_nine():
    """A constant y = a, of which the mean of n readings says σ/√n; the cause moves a beyond its tolerance."""
    noise, count, tolerance, size = 0.1, 200, 0.05, 0.5
    time = np.arange(count) * 1.0
    model = sd.Model(
        lambda p, u, t: {"y": p["a"] + 0.0 * t},
        {"y": sd.Sensor(noise=noise, resolution=0.0, spread=1e-3)},
        parameters=[sd.Number("a", 0.0, tolerance=tolerance)],
        causes=[sd.Cause("shift", "a is off", changes={"a": size})],
    )
    y = noise * np.random.default_rng(0).standard_normal(count)
    verdict = sd.diagnose(sd.Record(time, {"y": y - y.mean()}), model)
    without = noise**2 / count + tolerance**2
    having = without + size**2
    odds = 9.0 / 0.05  # the prior odds of a single cause
    x = np.sqrt(2.0 * np.log(odds * np.sqrt(having / without)) / (1.0 / without - 1.0 / having))
    assert float(verdict.visible_from["shift"]) == pytest.approx(x, rel=0.03)


def test_the_filter_whitens_as_the_dense_covariance_does():
    rng = np.random.default_rng(1)
    time, noise = np.cumsum(rng.uniform(0.05, 0.4, 60)), Noise(0.3, 0.7, 1.5)
    values = rng.standard_normal((60, 2))
    filtered = Filter.of(noise, 0.0, time)
    dense = covariance(noise, time)
    squares = np.sum(filtered.whiten(values) ** 2, axis=0)
    np.testing.assert_allclose(
        squares, np.einsum("ij,ij->j", values, np.linalg.solve(dense, values)), rtol=1e-8
    )
    assert filtered.log_scale == pytest.approx(0.5 * np.linalg.slogdet(dense)[1], rel=1e-8)


def test_the_evidence_of_a_linear_model_is_the_density_of_its_record(problem):
    noise = Noise(0.1, 0.05, 0.7)
    entries = problem.entries(())
    centre = np.array([entry.centre for entry in entries])
    levels = Levels({"y": noise}, {"push": 1.7})
    linear = linearised(problem, (), entries, centre + 0.01, levels)
    record = problem.records[0]
    knots = knots_of(problem)
    hats = np.array([np.interp(record.time, knots, row) for row in np.eye(knots.size)])
    spread = covariance(noise, record.time) + 0.3**2 + 0.2**2 * np.outer(record.time, record.time)
    spread += (1.7 * 0.2) ** 2 * hats.T @ hats
    exact = multivariate_normal.logpdf(record.columns["y"], 0.8 + 0.6 * record.time, spread)
    found = linear.evidence(problem)[1] - prior_of(problem, linear)
    assert found == pytest.approx(exact, abs=1e-6)


def knots_of(problem):
    """Return the times of the knots of the unknown input."""
    return problem.knots(0, problem.intervals_of(0, problem.model.unknown[0]))


def prior_of(problem, linear):
    """Return the log prior of noise and sizes, as its definition says."""
    prior = problem.channels["y"].prior
    noise = linear.levels.noise["y"]
    return prior.log_density(noise) + log_times([noise], [prior.interval]) - 0.5 * np.log(1.7) ** 2


def test_the_evidence_does_not_depend_on_where_a_linear_model_is_linearised(problem):
    entries = problem.entries(())
    levels = Levels({"y": Noise(0.1, 0.05, 0.7)}, {"push": 1.0})
    found = [
        linearised(problem, (), entries, np.full(len(entries), at), levels).evidence(problem)[1]
        for at in (0.0, 0.5, 1.0)
    ]
    assert np.ptp(found) < 1e-6


@pytest.mark.parametrize("factor", [1.0, 0.1, -2.0])
def test_what_numbers_can_follow_is_the_density_of_the_readings_in_their_unit(problem, factor):
    """Readings y = b (h + e), all numbers at their prior: a Gaussian, with the noise that makes it and its own size
    most probable. That is found on a grid, and near its maximum the density is flat to 0.1 nats.
    """
    entries = problem.entries(())
    x = np.array([entry.centre for entry in entries]) + 0.3 * np.array([entry.sd for entry in entries])
    linear = linearised(problem, (), entries, x, usual_levels(problem, ()))
    J, prior = linear.J["y"], problem.prior("y", ())
    y = problem.recorded("y", ())
    e = y / factor - (y - linear.e["y"])
    mean = (y - linear.e["y"]) - J @ linear.off
    spread = J @ np.diag([entry.sd**2 for entry in entries]) @ J.T
    sizes = prior.level * np.exp(prior.spread * np.linspace(-5.0, 5.0, 1001))
    log = [
        multivariate_normal.logpdf(y / factor, mean, spread + size**2 * np.eye(y.size))
        - 0.5 * (np.log(size / prior.level) / prior.spread) ** 2
        for size in sizes
    ]
    true = max(log) - y.size * np.log(abs(factor))
    constant = -y.size * (np.log(prior.level) + 0.5 * np.log(2.0 * np.pi))
    assert _Followed(problem, linear, "y").log_density(e, factor) + constant == pytest.approx(true, abs=0.1)


def test_a_step_goes_to_the_mean_of_the_posterior(problem):
    entries = problem.entries(())
    noise = Noise(0.1, 0.05, 0.7)
    linear = linearised(problem, (), entries, np.zeros(len(entries)), Levels({"y": noise}, {"push": 1.0}))
    mean = linear.x + linear.evidence(problem)[0]
    time, y = problem.records[0].time, problem.records[0].columns["y"]
    hats = np.array([np.interp(time, knots_of(problem), row) for row in np.eye(len(entries) - 2)])
    J = np.column_stack([np.ones(40), time, hats.T])
    D = np.diag([0.3**2, 0.2**2, *np.full(len(entries) - 2, 0.2**2)])
    centre = np.array([entry.centre for entry in entries])
    gain = D @ J.T @ np.linalg.inv(J @ D @ J.T + covariance(noise, time))
    np.testing.assert_allclose(mean, centre + gain @ (y - J @ centre), atol=1e-6)


def test_a_linearisation_shows_the_derivatives_of_the_model(problem):
    entries = problem.entries(())
    J = problem.jacobian((), entries, np.array([entry.centre for entry in entries]))["y"]
    np.testing.assert_allclose(J[:, 0], 1.0, atol=1e-8)
    np.testing.assert_allclose(J[:, 1], problem.records[0].time, atol=1e-8)


def test_sensitivities_learn_the_slope_along_a_step_and_nothing_across_it(problem):
    """The secant condition; what the prior calls orthogonal to the step keeps its slope."""
    entries, rng = problem.entries(()), np.random.default_rng(0)
    x, levels = np.array([entry.centre for entry in entries]), usual_levels(problem, ())
    here = linearised(problem, (), entries, x, levels)
    wrong = replace(here, J={"y": here.J["y"] + rng.normal(size=here.J["y"].shape)})
    step = rng.normal(size=x.size)
    there = replace(wrong, x=x + step, e=linearised(problem, (), entries, x + step, levels).e)
    J = with_secant(wrong, there).J["y"]
    np.testing.assert_allclose(J @ step, here.e["y"] - there.e["y"], atol=1e-8)
    across = rng.normal(size=x.size)
    D = np.array([entry.sd for entry in entries]) ** 2
    across -= step * (across @ (step / D)) / (step @ (step / D))
    np.testing.assert_allclose(J @ across, wrong.J["y"] @ across, atol=1e-8)


@pytest.mark.parametrize("step", [0.1, 0.25, 1.0])
def test_what_readings_are_rounded_to_is_read_off_them(step):
    values = np.random.default_rng(0).normal(0.0, 3.0, 400)
    assert resolution_of(step * np.rint(values / step)) == pytest.approx(step)
    assert resolution_of(values) == 0.0


def test_the_level_of_white_noise_on_a_slow_signal_is_read_off_a_record():
    t = np.arange(0.0, 60.0, 0.1)
    values = np.sin(0.3 * t) + 0.05 * np.random.default_rng(0).standard_normal(t.size)
    # 600 samples: the median of second differences has a standard deviation of about 6 %.
    assert level_of(values, 0.0) == pytest.approx(0.05, rel=0.2)


def test_a_declared_level_binds():
    prior = NoisePrior(level=0.1, resolution=0.0, interval=0.1, spread=0.1)
    assert prior.log_density(Noise(0.3, 0.03, 1.0)) == -np.inf
    assert prior.log_density(Noise(0.11, 0.03, 1.0)) > -2.0


def test_the_prior_of_correlation_times_has_their_mean_and_spread_integrated_out():
    """Slow parts without white ones, so that each counts whole; the mean by a rule, the spread by its three values."""
    intervals, mean = [0.1, 0.2, 0.1], np.linspace(-9.0, 9.0, 18001)

    def integral(times):
        off = [np.log(time / (10.0 * step)) for time, step in zip(times, intervals, strict=True)]
        each = [
            np.exp(-0.5 * mean**2)
            * np.prod([np.exp(-0.5 * ((one - mean) / s) ** 2) / s for one in off], axis=0)
            for s in (0.15, 0.3, 0.6)
        ]
        return np.log(np.sum(each))

    def found(times):
        return log_times([Noise(1e-9, 1.0, time) for time in times], intervals)

    alike, apart = (0.2, 0.3, 0.25), (0.2, 3.0, 0.25)
    assert found(alike) - found(apart) == pytest.approx(integral(alike) - integral(apart), abs=1e-5)
    assert found(alike) > found(apart) + 2.0
    # A slow part of a single channel that lasts far longer than usual is an offset, not noise.
    single = [log_times([Noise(1e-9, 1.0, time)], [0.1]) for time in (1.0, 50.0)]
    assert single[0] > single[1] + 4.0


def test_the_correlation_time_of_a_slow_part_that_is_not_there_says_nothing():
    noise = [Noise(0.1, 0.1, 0.2), Noise(0.1, 0.1, 0.2)]
    there = [log_times([*noise, Noise(1.0, 1e-4, time)], [0.1] * 3) for time in (0.2, 20.0)]
    assert there[0] == pytest.approx(there[1], abs=1e-5)


def test_the_density_of_a_channel_given_the_others_is_that_of_a_gaussian():
    rng = np.random.default_rng(5)
    time, noise = np.cumsum(rng.uniform(0.05, 0.4, 50)), Noise(0.3, 0.7, 1.5)
    K, e = rng.standard_normal((50, 4)), rng.standard_normal(50)
    found = log_marginal(Filter.of(noise, 0.0, time), np.column_stack([K, e]))
    exact = multivariate_normal.logpdf(e, np.zeros(50), covariance(noise, time) + K @ K.T)
    assert found - 25.0 * np.log(2.0 * np.pi) == pytest.approx(exact, abs=1e-8)


def test_a_channel_given_the_others_changes_the_evidence_as_all_channels_together_do():
    rng = np.random.default_rng(4)
    time = np.linspace(0.0, 10.0, 40)
    columns = {name: 0.8 + 0.6 * time + 0.1 * rng.standard_normal(40) for name in ("y", "z")}
    numbers = [sd.Number("a", 0.8, tolerance=0.3), sd.Number("b", 0.6, tolerance=0.2)]
    sensor = sd.Sensor(noise=0.1, resolution=0.0)

    def both(p, u, t):
        return dict.fromkeys(("y", "z"), p["a"] + p["b"] * t)

    problem = Problem(
        sd.Model(both, {"y": sensor, "z": sensor}, parameters=numbers), [sd.Record(time, columns)]
    )
    entries = problem.entries(())
    first, second = Noise(0.1, 0.05, 0.7), Noise(0.2, 0.01, 2.0)
    linear = linearised(problem, (), entries, np.array([0.9, 0.5]), Levels({"y": first, "z": first}, {}))
    products = Products(problem, (), linear.e, linear.J)
    samples, columns_given = given_others(problem, linear, products, linear.levels, "y")

    def alone(noise):
        return log_marginal(Filter.of(noise, 0.0, samples), columns_given)

    def together(noise):
        total = products.total({"y": noise, "z": first})
        return solve(total, entries, linear.levels, linear.off)[1]

    assert alone(second) - alone(first) == pytest.approx(together(second) - together(first), abs=1e-6)


def test_what_a_bound_forbids_is_left_at_the_bound_and_the_rest_follows(problem):
    numbers = [sd.Number("a", 0.8, tolerance=0.3), sd.Number("b", 0.6, tolerance=0.2, low=0.55)]
    model = sd.Model(line, problem.model.channels, parameters=numbers, unknown=problem.model.unknown)
    bound = Problem(model, problem.records)
    held = Problem(model, problem.records, {("number", "b", -1, 0): 0.55})
    levels = Levels({"y": Noise(0.1, 0.05, 0.7)}, {"push": 1.0})
    found, expected = (
        linearised(each, (), each.entries(()), np.array([e.centre for e in each.entries(())]), levels)
        for each in (bound, held)
    )
    there = found.x + found.evidence(bound)[0]
    assert there[1] == pytest.approx(0.55)
    np.testing.assert_allclose(there, expected.x + expected.evidence(held)[0], atol=1e-5)


def test_equal_readings_in_a_row_say_no_more_than_one(problem):
    """A sensor that holds its values for five samples gives a mean of the same uncertainty as the values themselves."""
    rng = np.random.default_rng(2)
    fresh = 0.8 + 0.1 * rng.standard_normal(40)
    held = np.repeat(fresh, 5)
    assert np.flatnonzero(middle_of_equal(held)).tolist() == list(range(2, 200, 5))
    number = [sd.Number("a", 0.0, tolerance=10.0)]
    found = []
    for values in (fresh, held):
        model = sd.Model(
            lambda p, u, t: {"y": p["a"] + 0.0 * t}, {"y": sd.Sensor(noise=0.1)}, parameters=number
        )
        record = sd.Record(np.arange(float(values.size)), {"y": values})
        whole = Problem(model, [record])
        # A slow part of nothing: with the usual one a longer record knows more of it.
        quiet = Levels({"y": Noise(0.1, 1e-6, 10.0)}, {})
        linear = linearised(whole, (), whole.entries(()), np.array([0.8]), quiet)
        _, _, (factor, _) = linear.evidence(whole)
        found.append((linear.x[0] + linear.evidence(whole)[0][0], 10.0 / factor[0, 0]))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-6)
    assert found[0][1] == pytest.approx(0.1 / np.sqrt(40.0), rel=1e-3)


def test_a_spike_is_set_aside_beside_a_gap_and_a_corner_is_not():
    values = np.array([0.0, 0.1, np.nan, 5.0, 0.0, 0.1, 0.0, 1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0])
    assert np.flatnonzero(spikes(values, 0.5, 0.0)).tolist() == [3]
    heading = np.array([358.0, 359.0, 0.0, 1.0, 90.0, 2.0, 3.0])
    assert np.flatnonzero(spikes(heading, 5.0, 360.0)).tolist() == [4]
    pair = np.array([0.0, 0.1, 0.0, 5.0, 5.1, 0.0, 0.1, 0.0, 0.1])
    assert np.flatnonzero(spikes(pair, 0.5, 0.0)).tolist() == [3, 4]
    away = np.array([0.1, 4.0, 0.0, 0.1, -0.1, 0.1, 0.0, -4.0])
    assert np.flatnonzero(spikes_at_ends(away, 0.5)).tolist() == [1, 7]


def test_the_usual_errors_of_a_sensor_are_part_of_every_explanation():
    """A gauge that is known to ± 0.5 m and errs by 0.6 m has no error; one that is known to ± 0.05 m has."""
    time = np.arange(0.0, 60.0, 1.0)
    seen = 0.6 + 5.0 + 2.0 * np.sin(0.3 * time) + 0.02 * np.random.default_rng(0).standard_normal(time.size)
    record = sd.Record(time, {"depth": seen})
    for zero, verdict in ((0.5, "nothing_wrong"), (0.05, "data_error")):
        model = sd.Model(
            lambda p, u, t: {"depth": 5.0 + p["amplitude"] * np.sin(0.3 * t)},
            {"depth": sd.Sensor(noise=0.02, zero=zero, unit="m")},
            parameters=[sd.Number("amplitude", 2.0, tolerance=0.02)],
        )
        found = sd.diagnose(record, model)
        assert found.verdict == verdict, found
    assert found.named[0].id == "offset:depth"
    assert found.named[0].estimates[0].value == pytest.approx(0.6, abs=0.05)


def test_a_fit_begins_where_it_is_told_and_ends_at_the_maximum(problem):
    """Of a linear problem the maximum is the same from everywhere, to the gain that ends a fit: 0.05 nats."""
    levels = Levels({"y": Noise(0.1, 0.03, 2.0)}, {"push": 1.0})
    entries = problem.entries(())
    sd_of = np.array([entry.sd for entry in entries])
    ends = [
        fit(problem, linearised(problem, (), entries, at * sd_of, levels)).log_evidence for at in (0.0, 3.0)
    ]
    assert abs(ends[0] - ends[1]) < 0.1


def test_the_slope_of_a_delay_is_that_between_two_samples():
    """x(t − d) is interpolated: ∂x/∂d = −(x_k − x_{k−1})/h, up to the corner at the next sample."""
    made = record(0)
    problem = Problem(model(), [made])
    (late,) = [term for term in data_terms(problem.model) if term.kind == "delay"]
    entries = problem.entries((late,))
    (place,) = [i for i, entry in enumerate(entries) if entry.kind == "delay"]
    x = np.array([entry.centre for entry in entries])
    here, _ = problem.residuals((late,), entries, [x])
    shown = made.columns["x"] - here["x"][:, 0]
    x[place] = 0.99 * STEP
    slope = problem.jacobian((late,), entries, x, [place])["x"][1:, 0]
    np.testing.assert_allclose(slope, -np.diff(shown) / STEP, atol=1e-9)


def test_a_delay_that_is_far_from_usual_is_as_probable_as_any_other():
    """Its prior about itself, times its odds, is a uniform density: of 16 usual ones to either side, as is tried."""
    made = record(3)
    x = np.interp(made.time - 9.0, made.time, made.columns["x"])
    problem = Problem(model(unknown=False), [replace(made, columns={**made.columns, "x": x})])
    entries = problem.entries(())
    centre = np.array([entry.centre for entry in entries])
    here = linearised(problem, (), entries, centre, usual_levels(problem, ()))
    (late,) = [term for term in declared(problem) if term.kind == "delay"]
    (found,) = [term for term in suggested(problem, here, [late]) if term.kind == "delay"]
    (own,) = [entry for entry in problem.entries((found,)) if entry.kind == "delay"]
    assert own.centre == found.centre == pytest.approx(9.0, abs=0.05)
    density = found.odds / (np.sqrt(2.0 * np.pi) * own.sd)
    assert density == pytest.approx(late.odds / (2.0 * 16.0 * own.sd))


@pytest.mark.long
@pytest.mark.parametrize("third", [False, True])
def test_errors_of_every_sensor_are_an_error_of_the_model(third):
    """Two sensors that both drift name nothing; with a third one that agrees with the model they are named."""
    factors = {"left": 1.0, "right": 2.0, **({"third": 3.0} if third else {})}
    made = sd.Model(
        lambda p, u, t: {name: factor * p["size"] * np.sin(t) for name, factor in factors.items()},
        channels={name: sd.Sensor(noise=0.05, unit="m") for name in factors},
        parameters=[sd.Number("size", 1.0, tolerance=0.01)],
    )
    rng, time = np.random.default_rng(0), 0.1 * np.arange(200)
    drifts = {"left": 1.0, "right": -1.5, "third": 0.0}
    columns = {
        name: factor * np.sin(time) + drifts[name] * (time / 20.0 - 0.5) + 0.05 * rng.standard_normal(200)
        for name, factor in factors.items()
    }
    verdict = sd.diagnose(sd.Record(time, columns), made)
    assert verdict.verdict == ("data_error" if third else "nothing_near")
    assert {each.id.partition(":")[2] for each in verdict.named} == ({"left", "right"} if third else set())


def test_numbers_that_trade_off_exactly_keep_their_prior_along_the_ridge():
    """Y = (a²/b)ᵗ says a²/b, and of a and b nothing else: sd(a) = τ √(1 − 4/5), that of θ ~ N(1, τ²) with 2a − b given.

    A sensitivity by a long step is off by half of it, which looks like information along the ridge. Tolerance: 20 %,
    for a step of a hundredth of τ.
    """
    tau, noise, time = 0.1, 1e-3, np.linspace(0.0, 2.0, 200)
    model = sd.Model(
        lambda p, u, t: {"y": (p["a"] ** 2 / p["b"]) ** t},
        {"y": sd.Sensor(noise=noise, resolution=0.0, spread=1e-3)},
        parameters=[sd.Number("a", 1.0, tolerance=tau), sd.Number("b", 1.0, tolerance=tau)],
    )
    y = 1.0 + noise * np.random.default_rng(0).standard_normal(time.size)
    problem = Problem(model, [sd.Record(time, {"y": y})])
    entries, levels = problem.entries(()), usual_levels(problem, ())
    found = fit(problem, linearised(problem, (), entries, np.ones(2), levels))
    (place,) = [i for i, entry in enumerate(entries) if entry.name == "a"]
    assert np.sqrt(found.variance[place]) == pytest.approx(tau * np.sqrt(1.0 - 4.0 / 5.0), rel=0.2)


def test_a_fit_of_which_the_linear_problem_promises_too_little_is_ended():
    """A spring that is stiffer than the model says needs steps, and simulations; an ended fit takes none."""
    problem = Problem(model(), [record(0, k=4.1)])
    entries = problem.entries(())
    centre = np.array([entry.centre for entry in entries])
    start = linearised(problem, (), entries, centre, usual_levels(problem, ()))
    whole = fit(problem, start)
    before = problem.runs[0].count
    ended = fit(problem, start, least=whole.log_evidence + 100.0)
    assert problem.runs[0].count == before
    assert ended.log_evidence < whole.log_evidence
    assert fit(problem, start, least=whole.log_evidence - 100.0).log_evidence == whole.log_evidence


def test_a_step_is_shortened_alike_where_a_model_takes_many_sets_at_once():
    """Of a spring that is far stiffer than the model says, with batches and set by set. Tolerance: of rounding."""
    fits = []
    for batch in (True, False):
        problem = Problem(model(batch=batch, unknown=False), [record(0, k=4.4)])
        entries, levels = problem.entries(()), usual_levels(problem, ())
        fits.append(fit(problem, linearised(problem, (), entries, np.array([4.0, 0.3, 1.0]), levels)))
    assert fits[0].x == pytest.approx(fits[1].x, rel=1e-6)
    assert fits[0].log_evidence == pytest.approx(fits[1].log_evidence, abs=0.01)


def test_an_outlier_that_begins_a_record_beside_gaps_is_one_for_an_explanation_too():
    """The first two readings have no two neighbours on either side; those of the record before are none."""
    time = np.arange(40.0)
    columns = [0.2 * time + 0.1 * np.random.default_rng(k).standard_normal(40) for k in range(2)]
    columns[1][1] += 5.0
    columns[1][2:4] = np.nan
    slow = sd.Model(
        lambda p, u, t: {"y": p["rate"] * t},
        {"y": sd.Sensor(noise=0.1, resolution=0.0)},
        parameters=[sd.Number("rate", 0.15, tolerance=0.1)],  # too far off to show an outlier by itself
    )
    problem = Problem(slow, [sd.Record(time, {"y": y}) for y in columns])
    entries = problem.entries(())
    e, _ = problem.residuals((), entries, [np.array([0.2])])
    seen = np.flatnonzero(problem.outliers((), {"y": e["y"][:, 0]}).get("y", [])).tolist()
    aside = np.flatnonzero(problem.channels["y"].spikes).tolist()
    assert {*seen, *aside} == {41}
