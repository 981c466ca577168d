"""Only motion through the water counts: drum, water and tow point that all drift along with V change no force.

Verifies: `cable.MovingDrum` and `Current` of `cable.pull_out` and `cable.tow`. Configuration: heavy stretching cable,
three-dimensional motion at about 1 m/s, 0.1 s, 0.5 m, V of 0.8 m/s; free drum with inertia and friction, winches;
uniform current and one with shear in depth, which a horizontal V leaves as it is.
Tolerance: 1e-12 N where Newton's method takes the same way in both runs, 2e-7 N where it ends an iteration earlier in
one (1e-9 of the tension in each of 30 balances). The first step is left out: it differences momenta to first order
(`cable.moving_end.bdf2`), and m V of the cable that enters is not the same in both. That is 3e-5 N on a free drum, and
is forgotten by the second step.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable

DRIFT = np.array([0.7, -0.4, 0.2])
LEVEL_DRIFT = np.array([0.7, -0.4, 0.0])
STREAM = np.array([0.1, -0.05, 0.0])
HEAVY = cable.CableProperties(mass_per_length=0.02, compliance=0.02)
RUBBING = cable.DrumProperties(inertia=1e-4, friction_torque=0.01)
DURATION = 8.0


def motion(t):
    return np.array([0.9, 0.2, 0.1]) + 0.2 * np.sin(np.array([0.3, 0.5, 0.7]) * t + np.array([0.2, 1.0, 2.0]))


def shear(added):
    return cable.Current.profile(
        down=[-2.0, 1.0, 5.0], velocity=np.array([[0.3, 0, 0], [0, 0.2, 0], STREAM]) + added
    )


def pulls(drift, current, drum):
    """Return the run of a drum that rests, and of the same that drifts with everything else."""
    rest, moving = (
        cable.pull_out(lambda t, V=V: motion(t) + V, DURATION, cable=HEAVY, drum=held, current=current(V))
        for V, held in (
            (np.zeros(3), drum),
            (drift, cable.MovingDrum(velocity=lambda _: drift, drum=drum)),
        )
    )
    assert rest.outcome.completed, rest.outcome.message
    assert moving.outcome.completed, moving.outcome.message
    return rest, moving


@pytest.mark.parametrize(
    ("drum", "tolerance"),
    [(RUBBING, 1e-12), (cable.PayOutRate(rate=1.6), 1e-11), (cable.ConstantTension(tension=0.5), 2e-7)],
    ids=["free drum", "pay-out rate", "constant tension"],
)
def test_a_drum_that_drifts_with_the_water_and_the_vehicle_feels_nothing_of_it(drum, tolerance):
    rest, moving = pulls(DRIFT, lambda V: STREAM + V, drum)
    assert_allclose(moving.tow_force[2:], rest.tow_force[2:], rtol=0, atol=tolerance)
    assert_allclose(moving.drum_tension[2:], rest.drum_tension[2:], rtol=0, atol=tolerance)
    assert_allclose(moving.length, rest.length, rtol=0, atol=max(tolerance, 1e-12))
    assert_allclose(moving.shapes[-1], rest.shapes[-1] + DURATION * DRIFT, rtol=0, atol=1e-6)


def test_the_first_step_alone_remembers_the_drift():
    """First order in the momenta: an error of the size m1 V Δs/Δt of 1e-6 m of cable and one new step, no more."""
    rest, moving = pulls(DRIFT, lambda V: STREAM + V, RUBBING)
    first = np.abs(moving.tow_force[1] - rest.tow_force[1]).max()
    assert 0.0 < first < 1e-4 * rest.tow_tension.max()


def test_it_holds_in_a_sheared_current_under_a_level_drift():
    rest, moving = pulls(LEVEL_DRIFT, shear, RUBBING)
    assert_allclose(moving.tow_force[2:], rest.tow_force[2:], rtol=0, atol=1e-11)
    assert np.abs(rest.tow_force - pulls(DRIFT, lambda V: STREAM + V, RUBBING)[0].tow_force).max() > 0.01


def test_a_tow_that_drifts_with_the_water_feels_the_same():
    rest, moving = (
        cable.tow(lambda t, V=V: motion(t) + V, 15.0, DURATION, cable=HEAVY, current=shear(V))
        for V in (np.zeros(3), LEVEL_DRIFT)
    )
    assert_allclose(moving.tow_force, rest.tow_force, rtol=0, atol=1e-8)


def test_the_drift_matters_when_the_drum_alone_takes_part():
    """A neutral cable straight behind the vehicle: it leaves the drum at the difference of the two speeds."""
    run = cable.pull_out(
        lambda _: (1.0, 0.0, 0.0), 10.0, drum=cable.MovingDrum(velocity=lambda _: (0.4, 0.0, 0.0))
    )
    assert run.outcome.completed, run.outcome.message
    assert_allclose(run.length, 1e-6 + 0.6 * run.time, rtol=0, atol=1e-9)
    drag = cable.CableProperties().tangential_drag * run.length
    assert_allclose(run.tow_tension[2:], drag[2:], rtol=1e-6)


def test_a_boat_that_leaves_a_waiting_vehicle_lays_the_cable_on_its_way():
    """The cable lies still, so nothing but the friction of the drum pulls on it: C_f/R_d everywhere."""
    drum = cable.DrumProperties(friction_torque=0.005)
    run = cable.pull_out(
        lambda _: (0.0, 0.0, 0.0), 10.0, drum=cable.MovingDrum(velocity=lambda _: (1.0, 0.0, 0.0), drum=drum)
    )
    assert run.outcome.completed, run.outcome.message
    assert_allclose(run.length, 1e-6 + run.time, rtol=0, atol=1e-7)
    assert_allclose(run.tow_force[2:, 0], 0.05, rtol=1e-5)
    assert_allclose(run.shapes[-1][-1], [10.0, 0.0, 0.0], rtol=0, atol=1e-9)
