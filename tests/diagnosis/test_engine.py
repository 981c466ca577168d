"""The engine's parts against closed forms and brute force.

Verifies: evidence, bounded steps, sensitivities and responses of a diagnosis; that every effect is exactly off
at 0; that the catalogue has the ids it promises. Configuration: made-up linear problems, and fig6 with the cable.
Tolerance: linear algebra to 1e-8; sensitivities to 1 %.
"""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import lsq_linear
from scipy.stats import multivariate_normal

import subzero
from subzero.diagnosis import NOISE, START, Parameter, Setting, catalogue
from subzero.diagnosis.assessment import separation
from subzero.diagnosis.inference import (
    TRUTHS,
    Noise,
    Observed,
    Problem,
    Quadratic,
    columns_of,
    economical,
    entries_of,
    posterior,
    quadratic_step,
    respond,
)

BASIC = ("surge_speed", "heading", "yaw_rate", "pitch", "roll_angle", "depth")
KINDS = ("scale", "bias", "lag")
IDS = {
    *("propeller_thrust_gain", "propeller_thrust_slope", "motor_lag", "battery_sag", "propeller_torque"),
    *("rudder_lag", "rudder_rate_limit", "rudder_offset", "rudder_lift_slope", "rudder_backlash"),
    *("stern_plane_offset", "hull_drag", "surge_added_mass", "yaw_inertia", "yaw_damping", "sway_damping"),
    *("munk_moment", "cable_tangential_drag", "cable_normal_drag", "cable_initial_length", "drum_friction"),
    *(
        "drum_inertia",
        "cable_weight",
        "current",
        "net_buoyancy",
        "cg_offset",
        "roll_stiffness",
        "clock_offset",
    ),
    *(f"sensor_{kind}:{channel}" for kind in KINDS for channel in BASIC),
}
TRIAL = subzero.load_scenario("fig6")
FIG6 = Setting(trial=TRIAL, model=subzero.Model.of(TRIAL))
CATALOGUE = catalogue(BASIC)
ALL = {**CATALOGUE, **{effect.id: effect for effect in START}}


def linear_problem(seed, m=40, k=6):
    random = np.random.default_rng(seed)
    J, D, z = random.standard_normal((m, k)), random.uniform(0.1, 4.0, k), 0.3 * random.standard_normal(k)
    r = random.standard_normal(m)
    return J, D, z, r


@pytest.mark.parametrize("seed", range(3))
def test_evidence_is_that_of_the_dense_gaussian(seed):
    """Evidence = ln N(r + J z; 0, I + J D Jᵀ), but for its constant."""
    J, D, z, r = linear_problem(seed)
    found = posterior(Quadratic.at(z, r, J), D)
    y = r + J @ z
    dense = multivariate_normal(np.zeros(y.size), np.eye(y.size) + J @ np.diag(D) @ J.T).logpdf(y)
    assert_allclose(found.log_evidence, dense + 0.5 * y.size * np.log(2.0 * np.pi), atol=1e-8)
    covariance = np.linalg.inv(J.T @ J + np.diag(1.0 / D))
    assert_allclose(found.M, covariance, atol=1e-10)
    assert_allclose(found.z, covariance @ J.T @ y, atol=1e-10)


@pytest.mark.parametrize("seed", range(20))
def test_a_bounded_step_is_the_best_within_bounds(seed):
    random = np.random.default_rng(seed)
    A, b = random.standard_normal((20, 8)), 3.0 * random.standard_normal(20)
    low, high = -random.uniform(0.0, 0.4, 8), random.uniform(0.05, 0.4, 8)
    low[random.random(8) < 0.3] = 0.0
    step = quadratic_step(A.T @ A, A.T @ b, low, high)
    best = lsq_linear(A, b, (low, high), method="bvls", tol=1e-14).x
    assert_allclose(step, best, atol=1e-8)


@pytest.mark.long
def test_a_response_shows_what_a_run_records():
    """In the run's own steps: to the tolerance within which hull and cable agree, and the rub of its drum, 1 mN."""
    run = subzero.simulate("fig6")
    names = [name for name in TRUTHS if name in run]
    shown = respond(FIG6, run["time"].values, names)
    for name in names:
        if name == "heading":
            continue
        scale = float(np.abs(run[name]).max()) + 1e-9
        assert_allclose(shown[name], run[name].values, atol=3e-3 * max(scale, 1.0), err_msg=name)
    turned = np.degrees(np.unwrap(np.radians(shown["heading"] - run["heading"].values)))
    assert np.abs((turned + 180.0) % 360.0 - 180.0).max() < 0.03


def test_economical_steps_cost_less_than_a_tenth_of_the_noise():
    times = np.arange(301) / 10.0
    exact, cheap = respond(FIG6, times, BASIC), respond(economical(FIG6, 30.0), times, BASIC)
    for name in BASIC:
        assert np.abs(exact[name] - cheap[name]).max() < 0.1 * NOISE[name], name


def test_the_catalogue_has_the_ids_that_are_promised():
    assert set(CATALOGUE) == IDS


@pytest.mark.parametrize("name", sorted(ALL))
def test_every_effect_is_off_at_zero(name):
    """Bit for bit: the whole run with all deviations 0 is the run without the effect."""
    effect = ALL[name]
    short = economical(dataclasses.replace(FIG6, trial=dataclasses.replace(TRIAL, duration=4.0)), 4.0)
    off = effect.apply(short, *(0.0 for _ in effect.parameters))
    times = np.arange(41) / 10.0
    plain, same = respond(short, times, BASIC), respond(off, times, BASIC)
    for channel in BASIC:
        assert np.array_equal(plain[channel], same[channel]), channel


@pytest.fixture(scope="module")
def problem():
    """fig6, all six channels, noise as of the usual sensors."""
    times = np.arange(301) / 10.0
    setting = economical(FIG6, 30.0)
    used = np.ones(301, bool)
    noise = {name: Noise(white=0.0, slow=NOISE[name], correlation_time=0.144, used=used, time=times)
             for name in BASIC}  # fmt: skip
    record = Observed(
        name="fig6", time=times, values=respond(setting, times, BASIC), noise=noise, setting=setting
    )
    return Problem(records=(record,), entries=entries_of(tuple(CATALOGUE.values()), START, 1))


CURVED = {
    "rudder_backlash": "a play takes a tolerance before it is felt throughout",
    "cable_initial_length": "its step is 3 m, from a cable that begins at the drum",
    "drum_friction": "its step is a whole tolerance, from a drum that turns freely",
    "sensor_lag": "its step is a whole tolerance, and a lag is felt in its square, too",
}
"""Effects that only go one way: their steps are whole tolerances, and curvature counts. Allowed: 8 %."""
ROUGH = {
    "rudder_rate_limit": "a step of 2 degrees is over before the limit is felt: no slope at all",
    "drum_inertia": "a light drum chatters in the steps of a diagnosis: 5 mm/s, a third of the speed log's noise",
}
"""Effects whose sensitivity at the nominal model is not to be relied on; the engine tries sizes, or refits."""


def test_sensitivities_are_smooth(problem):
    """|J(h) − J(h/2)| < 1 % of |J(h)|, or of a tenth of the noise per tolerance where there is nothing to see."""
    zero = np.zeros(len(problem.entries))
    whole, half = (_differences(problem, zero, share) for share in (1.0, 0.5))
    bad = {}
    for k, entry in enumerate(problem.entries):
        if entry.effect.id in ROUGH:
            continue
        size = max(float(np.linalg.norm(whole[:, k])), 0.1 / entry.parameter.tolerance)
        error = float(np.linalg.norm(whole[:, k] - half[:, k])) / size
        if error >= (0.08 if entry.effect.id.split(":")[0] in CURVED else 0.01):
            bad[entry.name] = error
    assert not bad


def _differences(problem, zero, share):
    """Return J with a share of the steps of `Problem.jacobian`."""
    return np.column_stack([_column(problem, zero, k, share) for k in range(zero.size)])


def _column(problem, zero, k, share):
    moved = zero + share * (problem.moved(zero, k) - zero)
    return problem.change(zero, moved) / moved[k]


def test_a_run_that_cannot_go_on_is_told_by_nan():
    broken = FIG6.with_model(current=(-30.0, 0.0, 0.0))
    shown = respond(economical(broken, 30.0), np.array([0.0, 30.0]), ["surge_speed"])["surge_speed"]
    assert np.isfinite(shown[0])
    assert np.isnan(shown[1])


def test_D_under_wide_tolerances_is_that_of_a_model_with_such_tolerances(plant):
    """κ = 2 is nothing but tolerances twice as wide; a cause far beyond them is told apart under each."""
    planted = plant(duration=12.0)
    problem, J = planted.problem, planted.J
    wide = [
        entry._replace(effect=dataclasses.replace(entry.effect, parameters=tuple(
            dataclasses.replace(p, tolerance=2.0 * p.tolerance) for p in entry.effect.parameters)))
        for entry in problem.entries
    ]  # fmt: skip
    doubled = dataclasses.replace(problem, entries=tuple(wide))
    z = np.zeros(len(problem.entries))
    z[columns_of(problem.entries, ("rudder_offset",))] = 2.5
    found, who = separation(problem, J, z, ("rudder_offset",), 2.0)
    assert (found, who) == (pytest.approx(separation(doubled, J, z, ("rudder_offset",))[0]), who)
    assert 9.0 < found < separation(problem, J, z, ("rudder_offset",))[0]


def test_several_residuals_are_those_of_each(plant):
    problem = plant(duration=6.0).problem
    random = np.random.default_rng(2)
    several = [0.01 * random.normal(size=len(problem.entries)) for _ in range(3)]
    several = [np.where([one.parameter.low == 0.0 for one in problem.entries], abs(z), z) for z in several]
    for z, r in zip(several, problem.residuals(several), strict=True):
        assert np.array_equal(r, problem.residual(z))


def test_a_bound_on_the_whole_value_follows_the_nominal_model():
    made = Parameter(
        name="x", unit="s", tolerance=0.1, scale=1.0, low=-9.0, nominal=lambda _: 0.15, least=0.06
    )
    assert made.within(FIG6).low == pytest.approx(-0.09)
    quick = dataclasses.replace(made, nominal=lambda _: 0.02)
    assert quick.within(FIG6).low == 0.0, "a model below the least stays as it is"
