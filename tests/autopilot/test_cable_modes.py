"""The few equations of a cable's sideways motion are the partial differential equation, tested with the same shapes.

Verifies: `cable_modes.CableModes` against the weak form of

    (T y_s)_s + k_t U² y_s = m₁ y_tt + ρA U y_ts + c (y_t + U y_s),   F = T(0) y_s(0)

on the material of the cable, s from the tow point, while the drum moves away with S' = U: y = S η(s/S, t) is put in and
differentiated in time by differences at fixed s, which knows nothing of the lengthening coordinate. What
takes short waves near the drum is left out. Tolerance: 1e-6, of second differences over a millisecond.
"""

import dataclasses

import numpy as np
import pytest
from scipy.special import eval_legendre

import subzero
from subzero.autopilot import cable_modes
from subzero.autopilot.cable_modes import BENDS, CableModes

U, S, W, DT = 0.8, 15.0, 0.02, 1e-3


@pytest.fixture
def model():
    model = subzero.Model.of(subzero.load_scenario("fig6"))
    heavier = dataclasses.replace(model.cable, mass_per_length=0.02, cross_section_area=9e-6)
    return dataclasses.replace(
        model, cable=heavier, drum=dataclasses.replace(model.drum, friction_torque=0.02)
    )


def shape(k, sigma):
    return (1.0 - sigma) * (1.0 if k == 0 else sigma * eval_legendre(k - 1, 2.0 * sigma - 1.0))


def test_they_are_the_weak_form_on_the_material_of_a_cable_that_grows(model, monkeypatch):
    monkeypatch.setattr(cable_modes, "LOST_OVER", 0.0)
    monkeypatch.setattr(cable_modes, "NEAR_DRUM", 1e-9)
    modes = CableModes.of(model, U, S, cross_flow=W)
    rng = np.random.default_rng(1)
    z, (V, a) = rng.normal(size=2 * BENDS + 1), rng.normal(size=2)
    rates, force = modes.A @ z + modes.B @ [V, a], modes.G @ z + modes.H @ [V, a]
    q = z[: BENDS + 1]
    q1 = np.array([(V - U * z[0]) / S, *z[BENDS + 1 :]])
    q2 = np.array([(a - 2.0 * U * q1[0]) / S, *rates[BENDS + 1 :]])
    assert rates[0] == pytest.approx(q1[0])

    def y(s, t):
        length = S + U * t
        return length * sum(
            (q[k] + t * q1[k] + 0.5 * t * t * q2[k]) * shape(k, s / length) for k in range(BENDS + 1)
        )

    node, weight = np.polynomial.legendre.leggauss(30)
    s, weight = 0.5 * S * (node + 1.0), 0.5 * S * weight
    step = 1e-3
    now, y_t = y(s, 0.0), (y(s, DT) - y(s, -DT)) / (2.0 * DT)
    y_tt = (y(s, DT) - 2.0 * now + y(s, -DT)) / DT**2
    y_s = (y(s + step, 0.0) - y(s - step, 0.0)) / (2.0 * step)
    y_ts = (y(s + step, DT) - y(s - step, DT) - y(s + step, -DT) + y(s - step, -DT)) / (4.0 * step * DT)
    cable = model.cable
    added = cable.water_density * cable.cross_section_area
    c = 8.0 / (3.0 * np.pi) * cable.normal_drag * W
    tension = cable.tangential_drag * U**2 * (S - s) + model.drum.friction_torque / model.drum.radius
    load = cable.virtual_mass_per_length * y_tt + added * U * y_ts + c * (y_t + U * y_s)
    for k in range(BENDS + 1):
        w = shape(k, s / S)
        w_s = (shape(k, (s + step) / S) - shape(k, (s - step) / S)) / (2.0 * step)
        terms = (
            w * load,
            w_s * tension * y_s,
            -w * cable.tangential_drag * U**2 * y_s,
        )
        left, size = sum(weight @ term for term in terms), sum(weight @ np.abs(term) for term in terms)
        assert left + (force if k == 0 else 0.0) == pytest.approx(0.0, abs=1e-6 * size), k


def test_a_cable_that_points_from_the_drum_another_way_is_at_rest(model):
    """Towed on straight along that way, V = U b: it pulls along itself, with T(0) b across the old way."""
    modes = CableModes.of(model, U, S, cross_flow=W)
    z = np.zeros(2 * BENDS + 1)
    z[0] = 0.1
    assert modes.A @ z + modes.B @ [U * 0.1, 0.0] == pytest.approx(np.zeros(z.size), abs=1e-12)
    tension = model.cable.tangential_drag * U**2 * S + model.drum.friction_torque / model.drum.radius
    assert modes.G @ z + modes.H @ [U * 0.1, 0.0] == pytest.approx(-0.1 * tension)


@pytest.mark.parametrize("cross_flow", [0.0, 0.1])
@pytest.mark.parametrize("speed", [0.4, 1.4])
@pytest.mark.parametrize("length", [0.3, 2.0, 20.0, 45.0])
def test_bends_of_a_cable_die_away(speed, length, cross_flow):
    model = subzero.Model.of(subzero.load_scenario("fig6"))
    modes = CableModes.of(model, speed, length, cross_flow=cross_flow)
    assert np.max(np.linalg.eigvals(modes.A).real) < 0.0
