"""Random manoeuvres: whatever a vehicle does, a run ends converged or with a named, located reason.

Speeds of −1 … 3 m/s, turns of up to 60°/s, random currents, weights, stretch, drums with inertia and friction,
stop-and-go. Every case comes from its seed. Gates: at least 99 % of the cases converge, none gives a number that is
none, a cable that pushes, or a cable that does not end at the tow point.
"""

import numpy as np
import pytest

import cable

DURATION = 20.0
FAST, ALL = 120, 600


def manoeuvre(seed):
    """Return a random tow velocity and the properties to run it with."""
    r = np.random.default_rng(seed)
    knots, fine = np.linspace(0.0, DURATION, 8), np.linspace(0.0, DURATION, 2001)
    speed, turn, pitch = (
        r.uniform(-1.0, 3.0, 8),
        np.radians(r.uniform(-60.0, 60.0, 8)),
        r.uniform(-0.7, 0.7, 8),
    )
    if r.random() < 0.3:
        speed[r.integers(8)] = 0.0
    U, theta = np.interp(fine, knots, speed), np.interp(fine, knots, pitch)
    psi = np.concatenate([[0.0], np.cumsum(np.interp(fine[:-1], knots, turn) * (fine[1] - fine[0]))])
    way = np.stack(
        [U * np.cos(theta) * np.cos(psi), U * np.cos(theta) * np.sin(psi), -U * np.sin(theta)], axis=1
    )
    properties = {
        "cable": cable.CableProperties(
            mass_per_length=0.0049 * r.choice([1.0, 1.0, 0.8, 1.3]), compliance=r.choice([0.0, 0.0, 1e-3])
        ),
        "drum": cable.DrumProperties(
            inertia=r.choice([0.0, 0.0, 1e-3]), friction_torque=r.choice([0.0, 0.0, 0.005])
        ),
        "current": r.uniform(-0.3, 0.3, 3) * r.choice([0.0, 1.0]) * (1.0, 1.0, 0.2),
    }
    return (lambda t: [np.interp(t, fine, way[:, i]) for i in range(3)]), properties


def converged(seed):
    """Run a case, check what must hold in any case, and say whether it reached its end."""
    velocity, properties = manoeuvre(seed)
    run = cable.pull_out(velocity, DURATION, **properties)
    assert np.isfinite(run.tow_force).all(), f"seed {seed}: a force that is no number"
    assert np.isfinite(run.length).all()
    assert min(tension.min() for tension in run.tensions) >= 0.0, f"seed {seed}: the cable pushes"
    assert run.closure_error.max() <= 1e-9, f"seed {seed}: the cable does not end at the tow point"
    assert (np.diff(run.length) >= -1e-9).all(), f"seed {seed}: a drum that takes cable up"
    if not run.outcome.completed:
        assert "could not be solved beyond t = " in run.outcome.message
        assert "at node " in run.outcome.message
    return run.outcome.completed


def share_converged(seeds):
    return np.mean([converged(seed) for seed in seeds])


def test_random_manoeuvres_converge():
    assert share_converged(range(FAST)) >= 0.99


@pytest.mark.slow
def test_many_random_manoeuvres_converge():
    assert share_converged(range(FAST, ALL)) >= 0.99
