"""The paper's scheme, equations (14)-(26), as printed.

Verifies: the straight pull of section 4.1 (i), where T = ½ρπdCt U² S exactly (37), and the dive (ii).
Configuration: Table 1, tow point half a metre behind the hull's centre, Δt = 1 s as in the paper.
Tolerances: rounding on the straight line; 5e-4 N, half the last printed digit, beside the prototype's dive.
"""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from cable import CableProperties, Current, DrumProperties, Paper, pull_out
from cable.feng_allen import run as feng_allen
from cable.feng_allen.box_equations import Ends
from cable.feng_allen.box_newton import box_workspace, start_paper
from cable.feng_allen.equation7 import equation7_numbers
from cable.feng_allen.printed_scheme import (
    node_force,
    paper_step,
    undo_paper_step,
)
from cable.task import PullOut


def pull_out_paper(tow_velocity, duration, step, *, reading="tangent", implicit=False, **others):
    scheme = Paper(time_step=step, reading=reading, implicit=implicit)
    return pull_out(tow_velocity, duration, scheme=scheme, **others)


DRAG = 0.5 * 1000.0 * np.pi * 0.0025 * 0.01
"""½ρπdCt [N s²/m³]."""


def ahead(_time):
    return 1.0, 0.0, 0.0


def dive_pitch(time):
    """Pitch and pitch rate of the nose-down manoeuvre of section 4.1 (ii) [rad, rad/s]."""
    rate = np.radians(-6.0) if 10.0 < time <= 20.0 else 0.0
    return np.radians(-6.0) * np.clip(time - 10.0, 0.0, 10.0), rate


def dive(time):
    """V + Ω × r_c with r_c = (−0.5, 0, 0), in earth axes."""
    pitch, rate = dive_pitch(time)
    u, w = 1.0, 0.5 * rate
    return u * np.cos(pitch) + w * np.sin(pitch), 0.0, -u * np.sin(pitch) + w * np.cos(pitch)


def turn(time):
    """The dive laid on its side: down becomes starboard (section 4.1 (iii))."""
    north, _, down = dive(time)
    return north, down, 0.0


def test_straight_pull_is_exact_at_every_second_step_and_stands_still_in_between():
    run = pull_out_paper(ahead, 30.0, 1.0)
    np.testing.assert_allclose(run.length, np.arange(31.0), rtol=1e-12)
    np.testing.assert_allclose(run.tow_tension[::2], DRAG * run.length[::2], atol=1e-12)
    np.testing.assert_allclose(run.tow_tension[1::2], DRAG * (run.length[1::2] + 1.0), atol=1e-12)
    np.testing.assert_allclose(run.tow_tension[1:5], [0.0785, 0.0785, 0.1571, 0.1571], atol=5e-5)


def test_taken_fully_implicit_the_straight_pull_is_exact_at_every_step():
    run = pull_out_paper(ahead, 30.0, 1.0, implicit=True)
    np.testing.assert_allclose(run.tow_tension, DRAG * run.length, atol=1e-12)


def test_straight_ahead_the_cable_pulls_back_and_does_nothing_else():
    run = pull_out_paper(ahead, 30.0, 1.0)
    assert (run.tow_force[1:, 0] < 0.0).all()
    np.testing.assert_allclose(run.tow_force[:, 0], -run.tow_tension, rtol=1e-14)
    np.testing.assert_allclose(run.tow_force[:, 1:], 0.0, atol=1e-14)
    np.testing.assert_allclose(run.shapes[-1][0], (30.0, 0.0, 0.0), atol=1e-12)


def test_in_the_dive_the_cable_pulls_back_and_up_in_the_hull_and_lifts_the_head():
    """F_cX < 0 dominant, F_cZ > 0 and M_cY > 0, as in Fig. 5 (e)-(f)."""
    run = pull_out_paper(dive, 30.0, 1.0)
    for time, (north, _, down) in zip(run.time[12:], run.tow_force[12:], strict=True):
        pitch, _ = dive_pitch(time)
        forward = north * np.cos(pitch) - down * np.sin(pitch)
        below = north * np.sin(pitch) + down * np.cos(pitch)
        assert forward < 0.0 < below < -forward
        assert 0.5 * below > 0.0  # M_cY = z_c F_cX − x_c F_cZ with x_c = −0.5


@pytest.mark.parametrize(("step", "tension"), [(1.0, 0.989), (0.5, 0.983), (0.25, 0.980)])
def test_implicit_dive_reproduces_the_prototype(step, tension):
    run = pull_out_paper(dive, 30.0, step, implicit=True)
    assert run.outcome.completed
    assert run.tow_tension[-1] == pytest.approx(tension, abs=5e-4)


def test_as_printed_the_dive_staircases_about_the_converged_tension():
    run = pull_out_paper(dive, 30.0, 1.0)
    rises = np.diff(run.tow_tension)[22:]
    assert np.ptp(rises) > 0.05  # implicit: the last eight rises differ by less than 0.01 N
    assert np.ptp(np.diff(pull_out_paper(dive, 30.0, 1.0, implicit=True).tow_tension)[22:]) < 0.01
    assert run.tow_tension[-1] == pytest.approx(0.977, abs=0.02)


def test_a_dive_of_a_neutral_cable_is_a_turn_laid_on_its_side():
    down, side = pull_out_paper(dive, 25.0, 1.0), pull_out_paper(turn, 25.0, 1.0)
    np.testing.assert_allclose(side.tow_force[:, [0, 2, 1]], down.tow_force, atol=1e-9)
    np.testing.assert_allclose(side.tow_tension, down.tow_tension, atol=1e-9)


def test_turning_the_manoeuvre_turns_the_force():
    heading = np.radians(137.0)
    R = np.array([[np.cos(heading), -np.sin(heading), 0], [np.sin(heading), np.cos(heading), 0], [0, 0, 1]])
    straight = pull_out_paper(dive, 25.0, 1.0)
    turned = pull_out_paper(lambda time: R @ dive(time), 25.0, 1.0)
    np.testing.assert_allclose(turned.tow_force, straight.tow_force @ R.T, atol=1e-9)


def test_a_uniform_current_is_a_moving_frame_away_from_the_drum():
    """Towing ahead in still water or, on a drum that drifts with the stream, in a current: the same drag."""
    run = pull_out_paper(
        lambda _: (1.5, 0.0, 0.0), 10.0, 1.0, current=Current.uniform((0.5, 0.0, 0.0)), implicit=True
    )
    np.testing.assert_allclose(run.tow_tension, DRAG * run.length, atol=1e-12)  # 1 m/s through the water


def test_acceleration_and_a_heavy_drum_add_their_inertia():
    """T(0) = (m a + ½ρπdCt U²) S + (I_d a/R_d + C_f)/R_d, to first order in Δt (implicit)."""
    drum, a = DrumProperties(inertia=0.002, friction_torque=0.01), 0.1
    errors = []
    for step in (0.5, 0.25):
        run = pull_out_paper(lambda t: (0.5 + a * t, 0.0, 0.0), 10.0, step, drum=drum, implicit=True)
        u = 0.5 + a * run.time
        S = (u * u - 0.25) / (2.0 * a)
        exact = (0.0049 * a + DRAG * u * u) * S + (0.002 * a / 0.1 + 0.01) / 0.1
        errors.append(abs(run.tow_tension[-1] - exact[-1]) / exact[-1])
    assert (
        errors[1] < 0.02
    )  # (17) takes the pay-out speed of the old time: a step's worth of length is missing
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.2)


def test_as_printed_the_wound_tangent_misplaces_the_drum_end_by_radians_or_stops():
    """The reading ``drum``: ΔS/R_d is 10 rad at 1 s; the straight cable must stay straight, and does not."""
    for step in (2.0, 1.0, 0.5, 0.1):
        run = pull_out_paper(ahead, 20.0, step, reading="drum")
        task = PullOut(tow_velocity=ahead, duration=20.0)
        record, _ = feng_allen.run_paper(task, Paper(time_step=step, reading="drum"))
        bend = max(np.abs(y[:, 5] - np.pi).max() for y in record.states)
        assert bend > 0.9 or not run.outcome.completed
        assert np.isfinite(run.tow_force).all()


def test_a_run_that_stops_says_when_where_and_what_to_try():
    run = pull_out_paper(ahead, 20.0, 0.1, reading="drum")
    assert not run.outcome.completed
    assert run.outcome.message.startswith("Stopped at 4.6 s: Newton's method stalled")
    assert "node 45" in run.outcome.message
    assert "Try reading='tangent'" in run.outcome.message
    assert len(run.time) == len(run.tensions) == len(run.shapes) == 46


def test_a_step_taken_back_and_taken_again_gives_the_same_bits():
    c, w = equation7_numbers(CableProperties()), box_workspace(12)
    start_paper(w, 1.0, 0.0, 0.0, 0.0)
    forces = []
    for k in range(1, 9):
        right, wrong = (Ends(1.0, 0.05 * k * x, 0.0, 0.0, 0.0, False) for x in (1.0, -3.0))
        assert paper_step(w, 0.5, wrong, 0.0, False, c)[0] == 0
        undo_paper_step(w)
        assert paper_step(w, 0.5, right, 0.0, False, c)[0] == 0
        forces.append(node_force(w, 0))
    plain = pull_out_paper(lambda t: (1.0, 0.1 * t, 0.0), 4.0, 0.5)
    assert (plain.tow_force[1:] == np.array(forces)).all()


def test_a_stopped_drum_adds_no_node_and_keeps_its_length():
    run = pull_out_paper(lambda t: (1.0 if t < 5.0 else 0.0, 0.0, 0.0), 10.0, 0.5, implicit=True)
    assert run.outcome.completed
    assert [len(y) for y in run.tensions[10:]] == [11] * 11
    assert run.length[-1] == run.length[10]
    np.testing.assert_allclose(run.tow_tension[-5:], 0.0, atol=1e-12)  # the slack line rests


def test_as_printed_a_stopped_cable_rings_about_zero_tension():
    run = pull_out_paper(lambda t: (1.0 if t < 5.0 else 0.0, 0.0, 0.0), 10.0, 0.5)
    np.testing.assert_allclose(run.tow_tension[-1] + run.tow_tension[-2], 0.0, atol=1e-9)
    assert run.diagnostics()["smallest_tension_N"] < -0.05


def test_a_start_from_rest_waits_for_the_first_motion_and_takes_its_direction():
    run = pull_out_paper(lambda t: (0.0, -0.1 * max(t - 2.0, 0.0), 0.0), 6.0, 1.0, implicit=True)
    assert (run.length[:4] == 0.0).all()
    assert run.tow_force[-1, 1] > 0.0  # the vehicle goes west, the cable pulls east
    np.testing.assert_allclose(run.tow_force[:, [0, 2]], 0.0, atol=1e-14)


def test_a_heavy_cable_hangs_down_behind_and_pulls_down():
    heavy = CableProperties(mass_per_length=0.0055)
    run = pull_out_paper(
        ahead, 20.0, 0.5, cable=heavy, drum=DrumProperties(friction_torque=0.02), implicit=True
    )
    assert run.outcome.completed
    assert run.tow_force[-1, 2] > 0.0
    assert run.shapes[-1][len(run.shapes[-1]) // 2, 2] > 0.0


@pytest.mark.parametrize("bad", [{"step": 0.0}, {"duration": np.nan}, {"reading": "sideways"}])
def test_what_cannot_be_run_is_refused_by_name(bad):
    arguments = {"duration": 1.0, "step": 0.5, **bad}
    with pytest.raises(ValueError, match=next(iter(bad))):
        pull_out_paper(ahead, **arguments)


def test_the_page_on_the_paper_scheme_shows_what_its_command_prints():
    root = Path(__file__).parents[2]
    spec = importlib.util.spec_from_file_location("paper_scheme", root / "benchmarks" / "paper_scheme.py")
    assert spec is not None
    assert spec.loader is not None
    benchmark = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(benchmark)
    page = (root / "docs" / "paper_scheme.md").read_text(encoding="utf-8")
    for make in (benchmark.straight_table, benchmark.stop_table):
        for line in make().splitlines():
            assert line in page, f"not in docs/paper_scheme.md, run python -m benchmarks.paper_scheme: {line}"
