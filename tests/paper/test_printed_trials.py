"""Trials run with the paper's own scheme, coupled as its section 3 says.

Verifies: the staircase of Fig. 4, the dive of Fig. 5 beside `cable.pull_out`, Fig. 6 beside the default scheme, and
how a run ends that the printed scheme cannot finish. Configuration: the shipped trials, their scheme and cable step
changed. Tolerances: rounding where the scheme is the same; first order in the step beside the default scheme.
"""

import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable
import scenarios
import subzero
import vehicle
from subzero.model import Model
from subzero.results.summary import summarise
from subzero.simulation.run import run_trial

DRAG = 0.5 * 1000.0 * np.pi * 0.0025 * 0.01
"""½ρπdC_t [N s²/m³]."""


def run_of(name, step, scheme="paper_tangent", *, tethered=True, **changes):
    trial = subzero.load_scenario(name)
    changes = {
        key: {**getattr(trial, key), **value} if key == "drum" else value for key, value in changes.items()
    }
    trial = dataclasses.replace(trial, scheme=scheme, cable_step=step, **changes)
    return subzero.simulate(trial, tethered=tethered)


def test_fig4_climbs_a_staircase_that_is_exact_at_every_second_step():
    run = run_of("fig4", 1.0)
    T, S = run["cable_tension"].values, run["cable_length"].values
    assert run.attrs["outcome"] == "completed"
    assert_allclose(S, np.arange(31.0), rtol=1e-12)
    assert_allclose(T[::2], DRAG * S[::2], atol=1e-12)
    assert_allclose(T[1::2], DRAG * (S[1::2] + 1.0), atol=1e-12)
    assert_allclose(run["cable_force_forward"], -T, atol=1e-12)
    for other in ("force_starboard", "force_down", "moment_roll", "moment_pitch", "moment_yaw"):
        assert_allclose(run[f"cable_{other}"], 0.0, atol=1e-12)


def test_fig4_shows_one_node_a_step_from_the_tow_point_to_the_drum():
    run = run_of("fig4", 1.0)
    assert run["node_count"].values.tolist() == list(range(1, 32))
    place, tension = run["cable_position"].values[-1], run["cable_node_tension"].values[-1]
    assert_allclose(place[:, 0], np.arange(30.0, -1.0, -1.0), atol=1e-12)
    assert_allclose(place[:, 1:], 0.0, atol=1e-12)
    assert tension[0] == pytest.approx(run["cable_tension"].values[-1], abs=1e-12)
    assert tension[-1] == run["drum_tension"].values[-1] == pytest.approx(0.0, abs=1e-12)


def test_fig5_is_what_the_cable_alone_does_on_the_same_motion():
    """The tow point half a metre behind the centre moves down while the nose goes down: V + Ω × r_c."""

    def dive(time):
        rate = np.radians(-6.0) if 10.0 - 1e-9 <= time < 20.0 - 1e-9 else 0.0
        pitch, w = np.radians(-6.0) * np.clip(time - 10.0, 0.0, 10.0), 0.5 * rate
        return np.cos(pitch) + w * np.sin(pitch), 0.0, -np.sin(pitch) + w * np.cos(pitch)

    run, alone = run_of("fig5", 0.5), cable.pull_out(dive, 30.0, scheme=cable.Paper(time_step=0.5))
    assert_allclose(run["cable_tension"], alone.tow_tension, atol=1e-9)
    assert_allclose(run["cable_length"], alone.length, rtol=1e-9)
    assert_allclose(run["cable_position"].values[-1], alone.shapes[-1], atol=1e-8)
    pitch = np.radians(run["pitch"].values)
    north, down = alone.tow_force[:, 0], alone.tow_force[:, 2]
    assert_allclose(run["cable_force_forward"], north * np.cos(pitch) - down * np.sin(pitch), atol=1e-9)
    assert_allclose(run["cable_force_down"], north * np.sin(pitch) + down * np.cos(pitch), atol=1e-9)
    assert_allclose(run["cable_moment_pitch"], 0.5 * run["cable_force_down"], atol=1e-12)


@pytest.mark.parametrize("step", [0.2, 0.5, 1.0])
def test_fig6_agrees_with_the_default_scheme_to_the_first_order_of_the_step(step):
    """The force lags by a step, the length by half the speed gained in one (17): errors that shrink with the step."""
    run, ours = run_of("fig6", step), subzero.simulate("fig6")
    assert run.attrs["outcome"] == "completed"
    for name, allowed in (("surge_speed", 8e-3), ("cable_tension", 8e-3), ("cable_length", 0.5)):
        there = np.interp(run["time"], ours["time"], ours[name])
        assert_allclose(run[name].values, there, atol=allowed * step)


def test_fig6_rings_at_the_drum_with_segments_of_a_tenth_of_a_metre_and_says_where_it_stops():
    """Shorter than m1/(½ρπdC_t) = 0.25 m, the last boxes turn by radians; the speed is right until then."""
    run, ours = run_of("fig6", 0.1), subzero.simulate("fig6")
    end, message = run["time"].values[-1], run.attrs["outcome_message"]
    assert run.attrs["outcome"] == "stopped"
    assert message.startswith(
        f"The paper's scheme does not reach t = {end + 0.1:g} s: Newton's method stalled"
    )
    assert message.endswith('Try scheme = "moving_end", the default, or a longer cable_step_s.')
    assert_allclose(run["surge_speed"], ours["surge_speed"][: run.sizes["time"]], atol=1e-3)


def test_the_force_of_a_time_is_held_until_the_next():
    """At 1 s the single node has just begun to move: no force. So the vehicle is free up to 2 s, not beyond."""
    run, free = run_of("fig6", 1.0), run_of("fig6", 1.0, tethered=False)
    speed, alone = run["surge_speed"].values, free["surge_speed"].values
    assert (run["cable_tension"].values[:2] == 0.0).all()
    assert run["cable_tension"].values[2] > 1e-3
    assert (speed[:3] == alone[:3]).all()
    assert speed[3] < alone[3]


def test_between_two_times_the_vehicle_moves_under_the_force_of_the_first():
    trial = dataclasses.replace(subzero.load_scenario("fig6"), scheme="paper_tangent", cable_step=1.0)
    model = Model.of(trial)
    rows = run_trial(trial, model, tethered=True).recording
    numbers, r_c = model.vehicle.numbers(), model.vehicle.tow_point.position()
    state, slopes, R = rows.state[20].copy(), np.zeros((4, vehicle.STATE_SIZE)), np.zeros((3, 3))
    for _ in range(50):
        for stage, part in enumerate((0.0, 0.01, 0.01, 0.02)):
            now = state + part * slopes[stage - 1]
            vehicle.rotation(now[3:7], R)
            pull = R.T @ rows.tow_force[20]
            wrench = np.concatenate([pull, np.cross(r_c, pull)])
            vehicle.derivative(now, rows.command[20], np.zeros(3), wrench, numbers, slopes[stage])
        state += 0.02 / 6.0 * np.array([1.0, 2.0, 2.0, 1.0]) @ slopes
        vehicle.finish_step(state, rows.command[20], numbers)
    assert_allclose(state, rows.state[21], rtol=1e-12, atol=1e-12)


def test_on_a_held_force_the_alternation_of_the_tension_grows_with_the_mass_of_the_cable():
    """T_{k+1} + T_k = −2r T_k, r cable over vehicle: a factor −(1 + 2r) a step. Table 1, and three times as heavy."""
    trial = dataclasses.replace(subzero.load_scenario("fig6"), scheme="paper_tangent", cable_step=0.2)
    light = Model.of(trial)
    area, mass = 3.0 * light.cable.cross_section_area, 3.0 * light.cable.mass_per_length
    heavy = dataclasses.replace(light.cable, cross_section_area=area, mass_per_length=mass)
    for model in (light, dataclasses.replace(light, cable=heavy)):
        run = subzero.simulate(trial, model=model)
        jitter = np.abs(np.diff(run["cable_tension"].values, 4))
        wet = model.cable.mass_per_length * run["cable_length"].values[-12]
        r = wet * model.vehicle.numbers().inverse_mass[0, 0]
        assert (jitter[-1] / jitter[-21]) ** 0.05 == pytest.approx(1.0 + 2.0 * r, abs=0.01)


def test_wound_around_the_drum_the_straight_cable_of_fig4_bends_and_pulls_too_hard():
    run = run_of("fig4", 1.0, "paper_drum")
    assert run.attrs["outcome"] == "completed"
    assert run["cable_tension"].values[-1] > 1.01 * DRAG * 30.0
    assert np.abs(run["cable_position"].values[-1, :, 2]).max() > 0.1


def test_wound_around_the_drum_in_short_steps_fig4_stops_and_says_what_to_try():
    run = run_of("fig4", 0.1, "paper_drum")
    message = run.attrs["outcome_message"]
    assert run.attrs["outcome"] == "stopped"
    assert run.sizes["time"] == 46
    assert message.startswith("The paper's scheme does not reach t = 4.6 s: Newton's method stalled")
    assert "worst at node 45, normal compatibility" in message
    assert message.endswith(
        'Try scheme = "moving_end", or scheme = "paper_tangent", whose new node is not turned around the drum.'
    )


def test_a_cable_that_pushes_is_shown_with_a_tension_below_zero():
    """1 m/s up to 9 s, at rest from 10 s on: from then the cable pulls and pushes by turns."""
    zero = np.zeros(4)
    motion = scenarios.Motion(
        time=np.array([0.0, 9.0, 10.0, 20.0]),
        surge_speed=np.array([1.0, 1.0, 0.0, 0.0]),
        pitch=zero,
        heading=zero,
    )
    run = run_of("fig4", 1.0, motion=motion)
    T = run["cable_tension"].values
    assert T[10] < -0.05
    assert_allclose(T[11:], -T[10:-1], atol=1e-9)
    assert_allclose(T, -run["cable_force_forward"], atol=1e-12)
    assert_allclose(T, run["cable_node_tension"][:, 0], atol=1e-12)
    assert_allclose(run["tow_velocity_tangential"], -run["surge_speed"], atol=1e-9)


def test_a_dragging_drum_does_not_pull_before_it_turns():
    run = run_of("fig6", 0.2, drum={"friction_torque": 0.002})
    T = run["cable_tension"].values
    assert run.attrs["outcome"] == "completed"
    assert T[0] == 0.0
    assert_allclose(run["drum_tension"].values[2:], 0.02, atol=1e-12)  # C_f/R_d
    assert (T[2:] >= 0.02 - 1e-12).all()


def test_a_wet_length_at_the_start_is_laid_straight_and_in_steady_tow():
    start = dataclasses.replace(subzero.load_scenario("fig4").start, wet_length=5.0)
    run = run_of("fig4", 1.0, start=start)
    T, S = run["cable_tension"].values, run["cable_length"].values
    assert run["node_count"].values[:3].tolist() == [11, 12, 13]  # ten segments of half a metre
    assert_allclose(S, 5.0 + np.arange(31.0), rtol=1e-12)
    assert_allclose(T[::2], DRAG * S[::2], atol=1e-12)


def test_energies_that_the_scheme_does_not_have_are_gaps_not_numbers():
    run = run_of("fig6", 0.5)
    for name in ("cable_loss", "kinetic_change", "drum", "added_mass_term", "residual"):
        assert np.isnan(run[f"energy_{name}"].values).all()
    energy = summarise(run)["energy"]
    assert energy["unexplained_share"] is None
    assert energy["residual_J"] is None
    assert energy["propeller_work_J"] > energy["hull_loss_J"] > 0.0
    json.dumps(summarise(run), allow_nan=False)


def test_two_runs_are_identical_to_the_last_bit():
    assert run_of("fig6", 0.5).identical(run_of("fig6", 0.5))


LOOK = """
import json, sys, subzero
run = subzero.simulate("fig4")
json.dump([run.attrs["scheme"], sorted(sys.modules)], sys.stdout)
"""


@pytest.mark.long
def test_a_default_run_imports_nothing_of_the_papers_scheme():
    done = subprocess.run([sys.executable, "-c", LOOK], capture_output=True, check=True)
    scheme, modules = json.loads(done.stdout)
    assert scheme == "moving_end"
    assert "cable.moving_end.state" in modules
    assert [m for m in modules if m.startswith(("subzero.simulation.feng_allen", "cable.feng_allen"))] == []
