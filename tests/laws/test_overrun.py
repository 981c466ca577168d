"""A drum with inertia runs ahead of a vehicle that slows: what it throws out lies loose, and the cable is taut behind.

Verifies: in a straight pull, the length that a coasting drum gives, S = S₀ + U₀t − ½ (C_f/I_d) R_d² t², and the force
of the taut cable, ½ρπdC_t U² times its way, in two schemes that share no equation; that neither depends on segments;
that a drum that is caught up with takes the impulse (I_d/R_d²) ΔU; that runs change smoothly with the friction of the
drum (a fit is lost where they jump); that both schemes agree in a manoeuvre of three dimensions; that the slack of a
heavy cable, which hangs at the drum, pulls there. Configuration: Table 1, drums of 0.1 kg at the rim. Tolerances: the
drum that coasts is advanced to first order, ½ (C_f R_d/I_d) Δt a second; else those of the schemes, 1e-3.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable

HEAVY = 0.1
"""I_d/R_d². [kg]"""
RUBS = 1e-3
"""C_f/R_d. [N]"""
DRAG = 0.5 * 1000.0 * np.pi * 0.0025 * 0.01
"""½ρπdC_t of Table 1. [kg/m²]"""
SCHEMES = {"moving end": cable.MovingEnd, "lumped": cable.Lumped}
every_scheme = pytest.mark.parametrize("scheme", SCHEMES)


def drum(friction=RUBS):
    return cable.DrumProperties(inertia=HEAVY * 0.1**2, friction_torque=friction * 0.1)


def slowing(t):
    """From 4 s to 14 s from 1 m/s to half of it."""
    return np.array([1.0 - 0.05 * np.clip(t - 4.0, 0.0, 10.0), 0.0, 0.0])


def way(t):
    late = np.clip(t - 4.0, 0.0, 10.0)
    return np.minimum(t, 4.0) + late - 0.025 * late**2 + 0.5 * np.maximum(t - 14.0, 0.0)


def slow_and_fast(t):
    """Half as fast from 8 s to 10 s, as fast as before from 14 s on, to and fro across all the while."""
    pace = 1.0 - 0.5 * np.clip((t - 4.0) / 4.0, 0.0, 1.0) + 0.5 * np.clip((t - 10.0) / 4.0, 0.0, 1.0)
    return np.array([pace, 0.3 * np.sin(t), 0.0])


def pulled(scheme, motion, duration, *, friction=RUBS, step=0.05, segment=0.5, **more):
    run = cable.pull_out(motion, duration, drum=drum(friction), **more,
                         scheme=SCHEMES[scheme](time_step=step, segment_length=segment))  # fmt: skip
    assert run.outcome.completed, run.outcome.message
    return run


@every_scheme
@pytest.mark.parametrize("segment", [1.0, 0.25])
def test_a_coasting_drum_gives_what_friction_lets_it_and_the_taut_cable_pulls(scheme, segment):
    run = pulled(scheme, slowing, 30.0, segment=segment)
    late, t = run.time >= 4.0, run.time
    given = t - 0.5 * RUBS / HEAVY * np.maximum(t - 4.0, 0.0) ** 2
    assert_allclose(run.length[late], given[late], atol=0.5 * RUBS / HEAVY * 0.05 * 26.0)
    assert_allclose(run.tow_tension[t > 14.5], (DRAG * 0.25 * way(t))[t > 14.5], rtol=1e-4)
    assert run.drum_tension[(t > 4.5)].max() < 1e-9  # what is loose does not pull


@every_scheme
def test_a_drum_may_run_ahead_from_the_first_step_on(scheme):
    run = pulled(
        scheme, lambda t: np.array([1.0 - 0.1 * t, 0.0, 0.0]), 5.0, friction=0.002, step=0.1, start=3.0
    )
    given = 3.0 + run.time - 0.5 * 0.002 / HEAVY * run.time**2
    assert_allclose(run.length, given, atol=0.5 * 0.002 / HEAVY * 0.1 * 5.0 + 1e-3)


@every_scheme
def test_a_drum_that_is_caught_up_with_takes_the_impulse_of_its_inertia(scheme):
    """It coasts from 1 m/s while the vehicle is slow; the cable makes it as fast as that again, 1.5 m/s, by a jerk."""

    def motion(t):
        return np.array([1.0 - 0.8 * np.clip(t - 4.0, 0.0, 1.0) + 1.3 * np.clip(t - 5.0, 0.0, 1.0), 0.0, 0.0])

    friction = 0.01
    run = pulled(scheme, motion, 16.0, friction=friction, step=0.02)
    slack = run.drum_tension < 1e-9
    caught = run.time[1:][slack[:-1] & ~slack[1:] & (run.time[1:] > 6.0)][0]
    slowest = 1.0 - friction / HEAVY * (caught - 4.0)
    jerk = (run.time > caught - 0.1) & (run.time < caught + 0.5)
    taut = (run.time > caught - 1e-9) & jerk
    impulse = np.sum(run.drum_tension[jerk]) * 0.02 - friction * np.count_nonzero(taut) * 0.02
    assert impulse == pytest.approx(HEAVY * (1.5 - slowest), rel=0.05)
    assert run.length[-1] == pytest.approx(run.tow_point[-1, 0], abs=1e-4)  # nothing is loose any more


@every_scheme
def test_runs_change_smoothly_with_the_friction_of_the_drum(scheme):
    """In steps of 0.2 s and segments of 1 m, as a diagnosis takes them, differences by 2 % of the friction are slopes:
    twice summed, the force bends by 0.004 and 0.023 N s² from one to the next (1.3 and 2.7 with slack in the water).
    """
    frictions = 0.01 * np.linspace(0.9, 1.1, 15)
    force = np.array([pulled(scheme, slow_and_fast, 20.0, friction=one, step=0.2, segment=1.0).tow_force
                      for one in frictions])  # fmt: skip
    moved = force.cumsum(axis=1).cumsum(axis=1) * 0.2**2
    assert np.abs(np.diff(moved, 2, axis=0)).max() < 0.05


def test_two_schemes_agree_where_a_drum_runs_ahead_and_is_caught_up_with():
    """Both advance the drum to first order: their lengths differ by 0.23 m/s times the step."""
    one, other = (
        pulled(scheme, slow_and_fast, 30.0, friction=0.005, step=0.025, segment=0.25) for scheme in SCHEMES
    )
    ahead = one.length - np.linalg.norm(one.tow_point, axis=1)
    assert ahead[one.time < 20.0].max() > 0.3
    assert_allclose(one.length, other.length, atol=8e-3)
    impulses = [np.cumsum(run.tow_force, axis=0) * 0.025 for run in (one, other)]
    assert_allclose(*impulses, atol=2e-3 * np.abs(impulses[0]).max())


def test_what_hangs_heavy_at_the_drum_pulls_it_on_and_is_not_loose():
    """A sinking cable pulls at the drum by its weight: a drum that has stopped ahead of it turns again."""
    sinking = cable.CableProperties(mass_per_length=0.02)
    run = cable.pull_out(lambda t: np.array([1.0 if t < 5.0 else 0.0, 0.0, 0.0]), 15.0, cable=sinking,
                         drum=drum(0.02), start=2.0)  # fmt: skip
    assert run.outcome.completed
    assert run.length[-1] > run.length[60] + 0.1


def test_a_jolt_takes_the_cable_along_and_not_the_drum_that_is_ahead_of_it():
    """M S ΔU while cable is loose, (m S + I_d/R_d²) ΔU while it is taut."""
    for pace, loose in ((0.5, True), (1.0, False)):

        def motion(t, pace=pace):
            return np.array([1.0 if t < 5.0 else pace if t < 6.0 else pace + 0.3, 0.0, 0.0])

        run = cable.pull_out(motion, 6.5, drum=drum(0.0), scheme=cable.MovingEnd(time_step=0.1))
        (k,) = np.flatnonzero(np.abs(run.time - 6.0) < 1e-6)
        in_water = run.tow_point[k, 0]
        assert bool(run.length[k] - in_water > 0.3) is loose
        taken = cable.CableProperties().mass_per_length * in_water + (0.0 if loose else HEAVY)
        assert run.tow_impulse[k, 0] == pytest.approx(-0.3 * taken, rel=1e-3)
