"""A tether that a host steps, against closed forms: a catenary, a spring, and a mass that comes to the end of its rope.

Verifies: `cable.Tether`. Configuration: in each test. Tolerance: in each test, with its reason.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

import cable

REST = np.zeros(3)


def test_a_tether_that_was_moved_comes_to_rest_as_a_catenary():
    """30 m of heavy cable between ends 24 m apart, after one was carried there: T = w (a + height).

    Tolerance: 50 segments are a polygon with errors of (1/50)², 4e-4; drag grows
    with the square of the speed and lets the last motion decay slowly, so it rests for 300 s.
    """
    heavy = cable.CableProperties(mass_per_length=0.1)
    w, span, length = heavy.weight_in_water, 24.0, 30.0
    tether = cable.Tether(heavy, length=length, ends=[(20.0, 6.0, 4.0), (0.0, 0.0, 5.0)])
    for k in range(1, 21):
        x = np.array([20.0 + 0.2 * k, 6.0 - 0.3 * k, 4.0 + 0.05 * k])
        tether.step(0.5, [x, (0.0, 0.0, 5.0)])
    for _ in range(300):
        forces = tether.step(1.0, [(24.0, 0.0, 5.0), (0.0, 0.0, 5.0)])
    a = brentq(lambda a: 2.0 * a * np.sinh(0.5 * span / a) - length, 1.0, 100.0)
    assert forces[0] == pytest.approx([-w * a, 0.0, 0.5 * w * length], rel=2e-3, abs=2e-3)
    assert forces[1] == pytest.approx([w * a, 0.0, 0.5 * w * length], rel=2e-3, abs=2e-3)
    sag = a * (np.cosh(0.5 * span / a) - 1.0)
    assert tether.shape[:, 2].max() - 5.0 == pytest.approx(sag, rel=2e-3)
    assert tether.tension.min() == pytest.approx(w * a, rel=2e-3)


@pytest.mark.parametrize("dt", [0.01, 0.1, 2.0])
def test_what_hangs_at_rest_stays_at_rest(dt):
    """The start is that of `cable.hold`, whose balances are those of a step: they agree as far as both are solved.

    The rest state does not depend on the step (a complaint about other codes). Tolerance: 1e-6 of the tension, for
    steps solved to 1e-9 that may drift.
    """
    heavy = cable.CableProperties(mass_per_length=0.1, compliance=1e-5)
    ends = np.array([(20.0, 0.0, 9.0), (0.0, 0.0, 5.0)])
    rest = cable.hold(ends, 26.0, (0.0, 0.2, 0.0), cable=heavy, segment_length=0.52)
    tether = cable.Tether(heavy, length=26.0, ends=ends, current=(0.0, 0.2, 0.0))
    for _ in range(40):
        forces = tether.step(dt, ends)
    assert forces[0] == pytest.approx(rest.tow_force, rel=1e-6, abs=1e-6)
    assert forces[1] == pytest.approx(rest.drum_force, rel=1e-6, abs=1e-6)
    assert np.abs(tether.shape - rest.shape).max() < 1e-5


def test_the_linearised_tether_is_a_spring_along_itself_and_a_string_across():
    """A neutral straight cable, stretched: ∂F/∂x is ∓EA/L along and ∓T/(L + stretch) across, at rest (a step of 1e4 s).

    Tolerance: 1e-3: central differences of 1e-6 of the length, of steps solved to 1e-9 of a tension.
    """
    EA, length, strain = 1e3, 20.0, 0.01
    elastic = cable.CableProperties(compliance=1.0 / EA)
    way = length * (1.0 + strain)
    tether = cable.Tether(elastic, length=length, ends=[(way, 0.0, 0.0), REST], segments=10)
    Z = tether.linearise(1e4)
    along, across = EA / length, EA * strain / way
    block = np.diag([along, across, across])
    expected = np.block([[-block, block], [block, -block]])
    assert np.abs(Z - expected).max() < 1e-3 * along
    assert Z[1, 1] == pytest.approx(-across, rel=1e-2)
    assert tether.time == 0.0


def snap(EA, mass, speed, length, dt):
    """Return the largest pull on a mass that drifts off until its tether comes taut, by the velocity Verlet method."""
    elastic = cable.CableProperties(compliance=1.0 / EA)
    tether = cable.Tether(elastic, length=length, ends=[(length - 0.3, 0.0, 0.0), REST])
    x, v, pull, largest = length - 0.3, speed, 0.0, 0.0
    while v > 0.0:
        a = -pull / mass
        x += dt * v + 0.5 * dt * dt * a
        end = [((x, 0.0, 0.0), (v + dt * a, 0.0, 0.0)), (REST, REST)]
        pull = -tether.step(dt, end)[0, 0]
        v += 0.5 * dt * (a - pull / mass)
        largest = max(largest, pull)
        assert tether.time < 10.0
    return largest


@pytest.mark.parametrize(
    ("EA", "mass", "speed", "length"),
    [
        (1e4, 40.0, 0.85, 12.0),
        (1e5, 40.0, 0.85, 12.0),
        (1e4, 40.0, 0.5, 30.0),
        (1e5, 12.0, 1.5, 20.0),
        (1e6, 200.0, 0.5, 40.0),
        (1e3, 40.0, 0.85, 12.0),
    ],
)
def test_a_mass_at_the_end_of_its_tether_is_stopped_by_a_spring(EA, mass, speed, length):
    """½Mv² = ½(EA/L)x²: the largest pull is v√(M·EA/L), less what 0.3 m of straightening costs by drag and inertia.

    The cable's own mass, 0.06 to 0.2 kg, moves with the mass and joins in: √(m/3M) is up to 4 %, felt in ripples on the
    pull. Tolerance: 3 %.
    """
    period = 2.0 * np.pi * np.sqrt(mass * length / EA)
    expected = speed * np.sqrt(mass * EA / length)
    assert snap(EA, mass, speed, length, period / 200.0) == pytest.approx(expected, rel=0.03)
