"""Gains are those of the textbook on the matrices that are shown.

Verifies: `autopilot.design_gains` against `control.lqr` and the Riccati equation itself, `reduced` against the steady
response, `margins` against loops whose margins are known in closed form. Tolerance: 1e-9 for gains (the same algebra);
0.5 % for margins, read off a frequency grid of 4000 points over six decades.
"""

import control
import numpy as np
import pytest
import scipy.linalg

import subzero
from subzero import autopilot


@pytest.fixture(scope="module")
def model():
    return subzero.Model.of(subzero.load_scenario("fig6"))


@pytest.fixture(scope="module")
def yaw(model):
    return autopilot.subsystem(autopilot.linearise(model, autopilot.trim(model, speed=1.0)), "yaw_sway")


@pytest.fixture(scope="module")
def gains(yaw):
    largest = {"yaw_rate": 0.3, "heading": 0.1, "integral": 0.2}
    return autopilot.design_gains(yaw, tracked="heading", largest=largest, largest_command=0.15)


def test_gains_are_those_of_control_lqr_on_the_matrices_that_are_shown(gains):
    K = np.asarray(control.lqr(gains.A, gains.B, gains.Q, gains.R)[0])[0]
    assert np.append(gains.feedback, -gains.integral) == pytest.approx(K, rel=1e-12)


def test_gains_solve_the_riccati_equation(gains):
    P = scipy.linalg.solve_continuous_are(gains.A, gains.B, gains.Q, gains.R)
    assert np.append(gains.feedback, -gains.integral) == pytest.approx(
        (gains.B.T @ P)[0] / gains.R[0, 0], rel=1e-9
    )


def test_weights_are_inverse_squares_of_what_is_acceptable(gains):
    assert np.diag(gains.Q) == pytest.approx([0.0, 1 / 0.09, 1 / 0.01, 0.0, 1 / 0.04])
    assert gains.R[0, 0] == pytest.approx(1 / 0.15**2)


def test_the_integral_gain_is_the_ratio_of_the_acceptable_deviations(gains):
    """The Riccati equation gives k_I = √(q_I/r), whatever the plant."""
    assert gains.integral == pytest.approx(0.15 / 0.2, rel=1e-9)


def test_a_first_order_loop_has_its_closed_form():
    """Known: for x' = −a x + b δ: λ₁λ₂ = b √(q_I/r) and (λ₁ + λ₂)² = a² + b² q/r + 2 λ₁λ₂, by the root locus."""
    a, b, q, qi = 0.6, 0.02, 1 / 0.1**2, 1 / 0.2**2
    part = control.ss(
        [[-a]], [[b]], [[1.0]], [[0.0]], states=["u"], inputs=["n"], outputs=["u"], name="surge"
    )
    found = autopilot.design_gains(
        part, tracked="u", largest={"u": 0.1, "integral": 0.2}, largest_command=4.0
    )
    r = 1 / 4.0**2
    product = np.sqrt(b * b * qi / r)  # λ1 λ2 = b k_I
    total = np.sqrt(a * a + b * b * q / r + 2.0 * product)  # −(λ1 + λ2) = a + b k
    assert found.feedback[0] == pytest.approx((total - a) / b, rel=1e-9)


def test_a_reduced_model_has_the_same_steady_response(yaw):
    small = autopilot.reduced(yaw, ["yaw_rate", "heading"])
    A, B = np.asarray(yaw.A), np.asarray(yaw.B)
    keep = [0, 1, 3]
    whole = -np.linalg.solve(A[np.ix_(keep, keep)], B[keep])[1, 0]
    assert -small.B[0, 0] / small.A[0, 0] == pytest.approx(whole, rel=1e-12)


def test_depth_moves_nothing_and_can_be_left_out(model):
    line = autopilot.linearise(model, autopilot.trim(model, speed=1.0))
    assert autopilot.reduced(autopilot.subsystem(line, "pitch_heave"), ["pitch_rate", "pitch"]).nstates == 2


@pytest.mark.parametrize("delay", [0.0, 0.3])
def test_margins_of_an_integrator_with_a_delay(delay):
    """L = w/s e^(−sτ): phase margin π/2 − wτ, gain margin π/(2 w τ), crossover w."""
    w = 1.7
    found = autopilot.margins(control.ss([[0.0]], [[1.0]], [[w]], [[0.0]]), delay=delay)
    assert found.crossover == pytest.approx(w, rel=5e-3)
    assert found.phase == pytest.approx(np.pi / 2 - w * delay, rel=1e-2)
    assert found.gain == pytest.approx(np.pi / (2 * w * delay) if delay else np.inf, rel=5e-3)


def test_margins_of_a_third_order_loop():
    """k/(s (s + 1)²) becomes unstable at k = 2; with k = 0.5 the gain margin is 4."""
    loop = control.tf2ss(control.tf([0.5], [1.0, 2.0, 1.0, 0.0]))
    assert autopilot.margins(loop).gain == pytest.approx(4.0, rel=5e-3)


def test_lqr_keeps_its_guaranteed_margins(gains):
    """Full state feedback by LQR: phase margin at least 60°, gain margin upwards infinite, down to one half."""
    found = autopilot.margins(gains.loop)
    assert found.phase >= np.radians(60.0)
    assert found.gain == np.inf
    assert found.gain_down <= 0.5


@pytest.mark.parametrize(
    "changes,words",
    [
        ({"tracked": "headin"}, "no state 'headin'"),
        ({"largest": {"heading": 0.1}}, '"integral" has no weight'),
        ({"largest": {"heading": -0.1, "integral": 1.0}}, "above 0"),
        ({"largest": {"depth": 0.1, "integral": 1.0}}, "no state 'depth'"),
        ({"largest_command": float("nan")}, "above 0"),
    ],
)
def test_weights_that_mean_nothing_are_refused(yaw, changes, words):
    asked = {"tracked": "heading", "largest": {"heading": 0.1, "integral": 0.2}, "largest_command": 0.1}
    with pytest.raises(subzero.UserError, match=words):
        autopilot.design_gains(yaw, **(asked | changes))


def test_a_loop_that_cannot_be_stabilised_is_told(yaw):
    deaf = control.ss(
        np.diag([1.0, -1.0]),
        [[0.0], [1.0]],
        np.eye(2),
        np.zeros((2, 1)),
        states=["a", "b"],
        inputs=["c"],
        name="deaf",
    )
    with pytest.raises(subzero.UserError, match="'deaf' cannot be stabilised"):
        autopilot.design_gains(deaf, tracked="b", largest={"b": 1.0, "integral": 1.0}, largest_command=1.0)
