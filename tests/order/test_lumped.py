"""The second formulation of the cable (masses at nodes, stiff springs, TR-BDF2): closed forms, order, and the default.

Verifies: `cable.lumped.history`. Closed forms: straight pull ½ρπdC_tU²S, the same accelerating with a drum that has
inertia and friction, towing with a drogue, at the critical angle and with stretch, winch of constant tension out and
in, catenary, tensioned beam, motion of everything together. Second order on a helix and on the dive of section 4.1
(ii), with soft ends. Agreement with "moving_end", which shares no solver code, on dive, helix, a U-turn with a stop
(slack), a heavy umbilical on a winch in a sheared current, a vertical cable in that current, towed cables and a
moving drum.
Tolerances: an inextensible cable stretches by 1e-6 per newton here, so straight pulls are exact to a few 1e-6; for the
others the sum of two errors of second order, in shares of the largest force on the vehicle, and this falls by three at
least when step and segment are halved (by four once the leading term is alone).
"""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

import cable
from cable.current import Current

pytestmark = pytest.mark.long

TABLE_1 = cable.CableProperties()
HEAVY = cable.CableProperties(mass_per_length=0.0098)
UMBILICAL = cable.CableProperties(mass_per_length=0.12, cross_section_area=1.13e-4, diameter=0.012)
RUBBING = cable.DrumProperties(friction_torque=0.005)
STILL = Current.uniform([0.0, 0.0, 0.0])
SHEARED = Current.profile(
    down=[0.0, 10.0, 40.0], velocity=[[0.4, 0.0, 0.0], [0.2, 0.1, 0.0], [0.0, 0.1, 0.0]]
)


def pull(motion, duration, step, segment, **changes):
    """Pull out with the lumped cable; Table 1 and still water unless changed."""
    lumped = cable.Lumped(time_step=step, segment_length=segment)
    run = cable.pull_out(motion, duration, scheme=lumped, **changes)
    assert run.outcome.completed, run.outcome.message
    return run


def tow(motion, length, duration, step=0.1, segment=0.5, **changes):
    """Tow the lumped cable."""
    lumped = cable.Lumped(time_step=step, segment_length=segment)
    run = cable.tow(motion, length, duration, scheme=lumped, **changes)
    assert run.outcome.completed, run.outcome.message
    return run


def smooth(x):
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def northward(speed):
    return lambda t: (speed, 0.0, 0.0)


def helix(t):
    return np.cos(0.2 * t), np.sin(0.2 * t), -0.2


def soft_dive(t):
    pitch = np.radians(60.0) * smooth(t / 12.0)
    return np.cos(pitch), 0.0, np.sin(pitch)


def u_turn_with_a_stop(t):
    speed, heading = (
        1.0 - smooth((t - 8.0) / 3.0) + smooth((t - 13.0) / 3.0),
        np.pi * smooth((t - 4.0) / 10.0),
    )
    return speed * np.cos(heading), speed * np.sin(heading), 0.0


def dive_and_turn_back(t):
    speed, heading = 0.3 * smooth((t - 3.0) / 5.0), np.pi * smooth((t - 15.0) / 20.0)
    down = 0.5 * smooth(t / 4.0) * (1.0 - smooth((t - 25.0) / 6.0))
    return speed * np.cos(heading), speed * np.sin(heading), down


def downward(t):
    return 0.0, 0.0, 0.5


def boat(t):
    return 0.5, 0.2 * np.sin(0.3 * t), 0.0


WINCH = cable.PayOutRate(rate=lambda t: 0.62 * smooth(t / 4.0) * (1.0 - 0.5 * smooth((t - 27.0) / 6.0)))


@pytest.mark.parametrize(("speed", "step", "segment"), [(0.3, 0.033, 0.5), (1.0, 0.1, 0.5), (2.5, 0.5, 0.7)])
def test_a_straight_pull_is_exact_at_every_step(speed, step, segment):
    run = pull(northward(speed), 10.0, step, segment)
    exact = TABLE_1.tangential_drag * speed**2 * (speed * run.time + 1e-6)
    stretch = 2e-6 * (1.0 + exact[-1])  # 1.5 eT in theory: a longer cable, and slower towards the drum
    np.testing.assert_allclose(run.tow_force[1:, 0], -exact[1:], rtol=stretch)
    np.testing.assert_allclose(run.length[1:], speed * run.time[1:] + 1e-6, rtol=stretch)
    assert np.abs(run.tow_force[:, 1:]).max() == 0.0


def test_an_accelerating_pull_with_a_heavy_rubbing_drum_is_of_second_order_at_every_step():
    drum, errors = cable.DrumProperties(inertia=0.002, friction_torque=0.01), []
    for step in (0.4, 0.2, 0.1):
        run = pull(lambda t: (0.5 + 0.3 * np.sin(0.5 * t), 0.0, 0.0), 8.0, step, 0.5, drum=drum)
        t = run.time
        u, a = 0.5 + 0.3 * np.sin(0.5 * t), 0.15 * np.cos(0.5 * t)
        S = 0.5 * t + 0.6 * (1.0 - np.cos(0.5 * t))
        exact = (0.0049 * a + TABLE_1.tangential_drag * u * u) * S + (0.002 * a / 0.1 + 0.01) / 0.1
        errors.append(np.abs(run.tow_tension - exact)[1:].max())
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / np.array(errors[1:])), 2.0, atol=0.15)
    assert errors[-1] < 2e-5


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_a_cable_with_weight_tows_at_the_critical_angle(speed):
    run = tow(northward(speed), 30.0, 5.0, cable=HEAVY)
    x, z = (run.shapes[-1][-1] - run.shapes[-1][0])[[0, 2]]
    phi, weight = np.arctan2(z, -x), HEAVY.weight_in_water
    assert HEAVY.normal_drag * speed**2 * np.sin(phi) ** 2 == pytest.approx(weight * np.cos(phi), rel=1e-9)
    slope = HEAVY.tangential_drag * (speed * np.cos(phi)) ** 2 + weight * np.sin(phi)
    np.testing.assert_allclose(run.tow_tension, 30.0 * slope, rtol=1e-9)


def test_a_stretching_cable_with_a_drogue_tows_with_the_drag_of_its_stretched_skin():
    """dT/ds = k √(1 + eT) from the drogue's T on: √(1 + eT) grows by ½ekL."""
    stretching, drogue = cable.CableProperties(compliance=0.05), 0.5 * 1000.0 * 0.001
    run = tow(northward(1.0), 30.0, 5.0, cable=stretching, drogue_drag_area=0.001)
    root = np.sqrt(1.0 + 0.05 * drogue) + 0.5 * 0.05 * TABLE_1.tangential_drag * 30.0
    np.testing.assert_allclose(run.tow_tension, (root**2 - 1.0) / 0.05, rtol=1e-5)
    np.testing.assert_allclose(run.drum_tension, drogue, rtol=1e-6)


def test_a_winch_of_constant_tension_pays_out_and_reels_in():
    """T(0) = T_w ± kU²S: the drag turns with the motion; back to a tenth of a metre."""
    turned = pull(
        lambda t: (1.0 - 2.0 * smooth((t - 8.0) / 4.0), 0.0, 0.0),
        19.9,
        0.1,
        0.5,
        drum=cable.ConstantTension(tension=1.0),
    )
    k, t, S = TABLE_1.tangential_drag, turned.time, turned.tow_point[:, 0]
    for rows, side in (((t > 1.0) & (t < 8.0), 1.0), (t > 13.0, -1.0)):
        np.testing.assert_allclose(turned.tow_tension[rows], 1.0 + side * k * S[rows], rtol=3e-5)
    np.testing.assert_allclose(turned.length[1:], S[1:], rtol=3e-5)
    assert turned.shapes[-1].shape[0] == 2, "one segment is left"


def test_a_cable_at_rest_hangs_in_a_catenary():
    """A rubbing drum gives 10 m, the vehicle comes back to 9 m: S = 2a sinh(L/2a), w_c a the horizontal pull."""

    def out_and_back(t):
        if t < 20.0:
            return 0.5 * (1.0 - np.cos(0.1 * np.pi * t)), 0.0, 0.0
        return (-0.25 * (1.0 - np.cos(0.5 * np.pi * (t - 20.0))) if t < 24.0 else 0.0), 0.0, 0.0

    heavy = cable.CableProperties(mass_per_length=0.02)
    run = pull(out_and_back, 60.0, 0.1, 0.25, cable=heavy, drum=cable.DrumProperties(friction_torque=0.5))
    S, L, w = run.length[-1], np.linalg.norm(run.tow_point[-1]), heavy.weight_in_water
    a = brentq(lambda a: 2.0 * a * np.sinh(L / (2.0 * a)) - S, 0.3 * L, 30.0 * L)
    np.testing.assert_allclose(run.tow_force[-1], [-w * a, 0.0, 0.5 * w * S], rtol=0, atol=5e-4 * w * S)
    line = run.shapes[-1]
    depth = a * (np.cosh(0.5 * L / a) - np.cosh((line[:, 0] - 0.5 * L) / a))
    np.testing.assert_allclose(line[:, 2], depth, rtol=0, atol=5e-4 * S)


def test_bending_stiffness_lifts_a_sagging_cable_as_that_of_a_tensioned_beam():
    """Hinged at both ends: sag wL²/8T − (w EI/T²)(1 − 1/cosh ½λL), λ = √(T/EI), for a sag of a hundredth of L."""
    sags = []
    for stiffness in (0.0, 2.0):
        properties = cable.CableProperties(mass_per_length=0.0151, bending_stiffness=stiffness)
        winch = cable.ConstantTension(tension=5.0)
        run = pull(
            lambda t: (smooth(t / 2.0) - smooth((t - 4.0) / 2.0), 0.0, 0.0),
            20.0,
            0.1,
            0.2,
            cable=properties,
            drum=winch,
        )
        sags.append(run.shapes[-1][:, 2].max())
    w, root = properties.weight_in_water, np.sqrt(5.0 / 2.0)
    lifted = w * 2.0 / 25.0 * (1.0 - 1.0 / np.cosh(2.0 * root))
    assert sags[0] == pytest.approx(w * 16.0 / 40.0, rel=3e-3)
    assert sags[0] - sags[1] == pytest.approx(lifted, rel=2e-2)


def test_only_motion_relative_to_the_water_and_to_the_drum_counts():
    drift = np.array([0.3, -0.2, 0.1])
    plain = pull(helix, 8.0, 0.1, 0.5, drum=RUBBING)
    moved = pull(
        lambda t: np.array(helix(t)) + drift,
        8.0,
        0.1,
        0.5,
        drum=cable.MovingDrum(velocity=lambda t: drift, drum=RUBBING),
        current=Current.uniform(drift),
    )
    late = plain.time > 2.0  # the first micrometre of cable points another way
    np.testing.assert_allclose(
        moved.tow_force[late], plain.tow_force[late], atol=1e-4 * plain.tow_tension.max()
    )


@pytest.mark.parametrize("motion", [helix, soft_dive])
def test_halving_step_and_segment_quarters_the_change_of_the_tow_force(motion):
    runs = [pull(motion, 16.0, 0.4 / n, 2.0 / n, drum=RUBBING).tow_force[::n][20:] for n in (1, 2, 4, 8)]
    changes = [np.abs(a - b).max() for a, b in pairwise(runs)]
    slopes = np.log2(np.array(changes[:-1]) / np.array(changes[1:]))
    assert slopes[-1] > 1.7
    assert slopes.mean() > 1.8


def distance(ours, theirs, rows):
    """Return the worst difference of the tow forces in some rows, over the largest force there."""
    assert theirs.outcome.completed, theirs.outcome.message
    difference = np.linalg.norm(ours.tow_force - theirs.tow_force, axis=1)[rows(ours.time)]
    return difference.max() / theirs.tow_tension[rows(ours.time)].max()


@cache
def both(name, refinement):
    """Return the worst difference between the two formulations at 0.5 m, 0.1 s, refined."""
    motion, duration, setting, rows = CASES[name]
    segment, step = 0.5 / refinement, 0.1 / refinement
    ours = pull(motion, duration, step, segment, **setting)
    return distance(
        ours,
        cable.pull_out(
            motion, duration, scheme=cable.MovingEnd(time_step=step, segment_length=segment), **setting
        ),
        rows,
    )


def after(start):
    return lambda t: t > start


CASES = {
    "dive": (soft_dive, 20.0, {"drum": RUBBING}, after(4.0)),
    "helix": (helix, 20.0, {"drum": RUBBING}, after(4.0)),
    "U-turn": (u_turn_with_a_stop, 24.0, {}, lambda t: ((t > 4.0) & (t < 12.0)) | (t > 17.0)),
    "umbilical": (
        dive_and_turn_back,
        40.0,
        {"cable": UMBILICAL, "drum": WINCH, "current": SHEARED},
        after(8.0),
    ),
    "vertical": (
        downward,
        20.0,
        {"cable": UMBILICAL, "drum": cable.ConstantTension(tension=5.0), "current": SHEARED},
        after(4.0),
    ),
    "boat": (
        lambda t: (1.0, 0.3, 0.3),
        20.0,
        {
            "cable": UMBILICAL,
            "drum": cable.MovingDrum(velocity=boat, drum=cable.DrumProperties(friction_torque=0.5)),
            "start": 1.0,
        },
        after(4.0),
    ),
}
AGREE = {"dive": 2e-4, "helix": 3e-4, "U-turn": 1e-2, "umbilical": 8e-3, "vertical": 1.5e-3, "boat": 4e-3}
"""At 0.25 m and 0.05 s; the kinks of a cable that jerks taut are left out of the U-turn."""


@pytest.mark.parametrize("name", CASES)
def test_both_formulations_go_to_the_same_tow_force_with_second_order(name):
    assert both(name, 2) < AGREE[name]
    assert both(name, 1) / both(name, 2) > 3.0


@pytest.mark.parametrize("properties", [TABLE_1, HEAVY], ids=["neutral", "heavy"])
def test_both_formulations_tow_a_turning_wire_with_the_same_force(properties):
    distances = []
    for n in (1, 2):
        segment, step = 0.5 / n, 0.1 / n
        ours = tow(
            lambda t: (np.cos(0.1 * t), np.sin(0.1 * t), 0.0), 15.0, 20.0, step, segment, cable=properties
        )
        theirs = cable.tow(
            lambda t: (np.cos(0.1 * t), np.sin(0.1 * t), 0.0),
            15.0,
            20.0,
            cable=properties,
            scheme=cable.MovingEnd(time_step=step, segment_length=segment),
        )
        distances.append(distance(ours, theirs, after(1.0)))
    assert distances[1] < 3e-4
    assert distances[0] / distances[1] > 3.0


def test_a_slack_cable_never_pushes_and_a_standing_drum_gives_nothing():
    run = pull(lambda t: (1.0 - 2.0 * smooth((t - 4.0) / 3.0), 0.0, 0.0), 9.0, 0.1, 0.5, drum=RUBBING)
    assert min(tension.min() for tension in run.tensions) >= 0.0
    assert (np.diff(run.length) > -1e-9).all()
    np.testing.assert_allclose(np.diff(run.length)[65:], 0.0, atol=1e-9)
    # what a slack cable still does to the vehicle: the drag of its first half segment, broadside at most
    assert run.tow_tension[-1] < 0.25 * TABLE_1.normal_drag


def test_a_run_that_cannot_go_on_says_where_when_and_what_to_do():
    """A cable that sinks off a drum that nothing holds: ill-posed, and told so."""
    sinking = cable.CableProperties(mass_per_length=0.2)
    run = cable.pull_out(lambda t: (0.0, 0.0, 0.1), 60.0, cable=sinking, start=2.0, scheme="lumped")
    assert not run.outcome.completed
    assert run.time[-1] < 60.0
    assert "t = " in run.outcome.message
    assert "Let the drum rub" in run.outcome.message or "Try other segments" in run.outcome.message
    assert np.isfinite(run.tow_force).all()
