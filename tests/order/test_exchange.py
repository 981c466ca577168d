"""Why hull and cable stay together: the exchange is stable for a cable of any mass, and of second order.

Verifies: section 8 of docs/theory.md. Configuration: a cable that only has mass, r times the vehicle's; then `fig6`
with a drum of ten times the vehicle's mass at the cable (I_d/R_d² = 70 kg). Tolerances: the roots' own digits.
"""

import dataclasses

import numpy as np
import pytest

import subzero
from cable.moving_end.bdf2 import backward_weights
from subzero.model import Model

RATIOS = np.logspace(-3, 6, 400)
TWICE = np.polymul([3, -1], [3, -1])
"""(3z − 1)², from two backward differences."""


def largest_root(r, lead, pull):
    """Of lead z^n + r pull(z) (3z − 1)²."""
    high = np.zeros(len(lead))
    high[0] = lead[0]
    return np.abs(np.roots(np.polyadd(high, r * np.polymul(pull, TWICE)))).max()


def exchange(r):
    return largest_root(r, [24, 0, 0, 0, 0, 0], [3, 1, 1, 1])


def held(r):
    return largest_root(r, [8, 0, 0, 0, 0], [1, 1])


def linear(r):
    return largest_root(r, [24, 0, 0, 0, 0], [1, 4, 1])


def test_errors_fall_to_less_than_three_quarters_in_a_step_whatever_the_cable_weighs():
    assert max(exchange(r) for r in RATIOS) < 0.725


def test_pulls_that_are_held_or_linear_are_unstable_for_a_heavy_cable():
    for pull, limit in ((held, 0.73), (linear, 0.75)):
        assert pull(limit - 0.01) < 1.0 < pull(limit + 0.01)
    assert linear(1e9) == pytest.approx(2.0 + np.sqrt(3.0), rel=1e-6)


@pytest.mark.parametrize("r", [0.2, 1.0, 10.0, 1000.0])
def test_the_recurrence_with_the_codes_own_weights_decays_as_its_largest_root_says(r):
    w = backward_weights.py_func(1.0, 1.0)
    weights = np.array([w.a0, w.a1, w.a2])
    twice = np.convolve(weights, weights)  # of x_{n+1} … x_{n−3}
    x, v, F = [0.0, 0.0, 0.0, 0.0], 1.0, [0.0, 0.0]
    for _ in range(120):
        slope = F[-1] - F[-2]
        free = x[-1] + v - slope / 3.0  # where a vehicle of mass 1 goes with F_{n+1} = 0
        past = np.dot(twice[1:], x[: -len(twice) : -1])
        F.append(-r * (twice[0] * free + past) / (1.0 + 0.5 * r * twice[0]))
        x.append(free + 0.5 * F[-1])
        v += F[-1] - 0.5 * slope
    fall = np.abs(F[42:82]).max() / np.abs(F[2:42]).max()  # over forty steps
    assert fall ** (1.0 / 40.0) == pytest.approx(exchange(r), rel=0.05)


def test_a_drum_ten_times_as_heavy_as_the_vehicle_slows_it_smoothly():
    trial = subzero.load_scenario("fig6")
    model = Model.of(trial)
    heavy = dataclasses.replace(model, drum=dataclasses.replace(model.drum, inertia=0.7))
    run, free = subzero.simulate(trial, model=heavy), subzero.simulate(trial)
    kinks = np.abs(np.diff(run["cable_tension"].values, 2))[20:]
    assert run.attrs["outcome"] == "completed"
    assert kinks.max() < 0.01  # 1560 N with a pull that is linear in an exchange
    assert run["surge_speed"].values[100] < 0.4 * free["surge_speed"].values[100]
