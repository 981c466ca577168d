"""The cable's own energy balance closes with everything that moves, stretches and changes.

Verifies: −F·U(0) = dE/dt + L − G + D_S + M + C of `cable.moving_end.energy`, by `History.diagnostics`, in a sheared
current that changes in time, with a moving drum, stretch, winch, friction and inertia, and for a towed cable with a
drogue. Tolerance: what is missing at 0.5 m and 0.1 s is below 1e-3 of all work and loss (measured: 2e-5 to 5e-4), and
falls when both are halved, again and again: with the square in still water (measured slope 1.75), and at least with
the first power where water passes the drum (measured: 1.0 to 1.6), because the books take t(S) half a segment away.
"""

from functools import cache

import numpy as np
import pytest

import cable

ELASTIC = cable.CableProperties(mass_per_length=0.0055, compliance=0.05)
DRUM = cable.DrumProperties(friction_torque=0.03, inertia=5e-4)
SHARES = (1.0, 0.5, 0.25, 0.125)


def in_step(t):
    """Return the share of a start from rest within 2 s, smooth."""
    return np.sin(0.25 * np.pi * min(t, 2.0)) ** 2


def motion(t):
    return in_step(t) * (np.array([1.0, 0.2, 0.15]) + 0.2 * np.sin(np.array([0.3, 0.5, 0.4]) * t))


def boat(t):
    return np.array([0.2 * np.sin(0.3 * t) ** 2, -0.1 * np.sin(0.2 * t) ** 2, 0.05 * np.sin(0.9 * t) ** 2])


SHEARED = cable.Current.profile(down=[-20.0, 20.0], velocity=[[-0.4, 0.3, 0.0], [0.4, -0.1, 0.0]])
CHANGING = cable.Current.sampled(
    lambda n, e, d, t: (0.02 * d + 0.1 * np.sin(0.4 * t), 0.1 - 0.01 * d, 0.0),
    down=[-20.0, 20.0],
    time=np.linspace(0.0, 16.0, 65),
)
WINCH = cable.ConstantTension(tension=0.5)
PULLS = {
    "stretch": {"drum": DRUM},
    "uniform": {"drum": DRUM, "current": (0.1, 0.2, 0.0)},
    "shear": {"drum": DRUM, "current": SHEARED},
    "boat": {"drum": cable.MovingDrum(velocity=boat, drum=DRUM)},
    "everything": {"drum": cable.MovingDrum(velocity=boat, drum=DRUM), "current": CHANGING},
    "everything on a winch": {"drum": cable.MovingDrum(velocity=boat, drum=WINCH), "current": CHANGING},
}


@cache
def missing(name, share):
    """Return what is missing in a pull, as a share, with segments of 0.5 m and steps of 0.1 s times `share`."""
    run = cable.pull_out(
        motion,
        16.0,
        cable=ELASTIC,
        scheme=cable.MovingEnd(time_step=0.1 * share, segment_length=0.5 * share),
        **PULLS[name],
    )
    assert run.outcome.completed, run.outcome.message
    return run.diagnostics()["energy_residual"]


@pytest.mark.parametrize("name", PULLS)
def test_little_is_missing_at_half_a_metre_and_a_tenth_of_a_second(name):
    assert missing(name, 1.0) < 1e-3


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in PULLS if name != "stretch"])
def test_what_is_missing_falls_at_least_with_step_and_segment(name):
    slope = np.polyfit(np.log(SHARES), np.log([missing(name, share) for share in SHARES]), 1)[0]
    assert slope > 0.8, "on a winch, whose pull begins with a jolt, 0.85: first order"


def test_in_still_water_it_falls_with_their_square():
    """Of the three coarser pairs; the finest residual, 2e-8, changes sign nearby and says nothing of the order."""
    slope = np.polyfit(np.log(SHARES[:3]), np.log([missing("stretch", share) for share in SHARES[:3]]), 1)[0]
    assert slope > 1.6


@pytest.mark.parametrize(
    "settings", [{}, {"current": CHANGING, "drogue_drag_area": 0.002}], ids=["still", "drogue"]
)
def test_the_books_of_a_towed_cable_close(settings):
    """A free tail, and a drogue in water that changes along its way and in time."""
    coarse, fine = (
        cable.tow(
            motion,
            15.0,
            16.0,
            cable=ELASTIC,
            scheme=cable.MovingEnd(time_step=0.1 * share, segment_length=0.5 * share),
            **settings,
        )
        for share in (1.0, 0.25)
    )
    assert coarse.outcome.completed, coarse.outcome.message
    assert coarse.outcome.energy_residual < 1e-3
    assert fine.outcome.energy_residual < 0.3 * coarse.outcome.energy_residual


def test_diagnostics_tell_how_a_run_was_solved():
    """√(T/m1) Δt/Δs of the fullest segment of a straight pull, by hand, at most a segment beside the tow point."""
    run = cable.pull_out(lambda _: (1.0, 0.0, 0.0), 20.0)
    reported = run.diagnostics()
    assert reported["steps"] == 200
    assert reported["closure_error_m"] < 1e-9
    wave = np.sqrt(run.tow_tension[-1] / cable.CableProperties().virtual_mass_per_length)
    assert reported["largest_courant_number"] == pytest.approx(wave * 0.1 / 0.5, rel=0.02)
    assert reported["energy_residual"] < 1e-3
