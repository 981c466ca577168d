"""The stepper is the simulation, driven from outside.

Verifies: `subzero.Simulator` against `subzero.simulate` to the last bit, datasets and attributes; that what a
controller does wrong is told; that a step costs next to nothing beside the physics. Tolerance: none, and 20 µs a step
(the best of many batches, since the machine has other things to do).
"""

import dataclasses
import os
import subprocess
import sys
import time

import numpy as np
import pytest

import subzero
from subzero.channels import BY_NAME, RENAMED_CHANNELS
from subzero.engine.initial_conditions import prepare
from subzero.engine.recording import new_recording
from subzero.engine.time_loop import run_rows


def identical(one, other):
    assert set(one.variables) == set(other.variables)
    for name in one.variables:
        assert one[name].values.tobytes() == other[name].values.tobytes(), name
    assert described(one) == described(other)


def described(run):
    """Return the attributes of a run, but for the accuracy: nobody runs what is stepped from outside twice."""
    return {name: value for name, value in run.attrs.items() if name != "accuracy"}


@pytest.mark.parametrize("tethered", [True, False])
@pytest.mark.parametrize("scenario", ["fig6", "spiral"])
def test_steps_of_the_scenarios_own_commands_are_its_simulation(scenario, tethered):
    sim = subzero.Simulator(scenario, tethered=tethered)
    for _ in range(round(sim.trial.duration / sim.trial.cable_step)):
        sim.step()
    identical(sim.result(), subzero.simulate(scenario, tethered=tethered))


def test_commands_given_are_the_commands_of_a_scenario():
    """Steps of 0.5 s, five exchanges each, beyond the end of the first recording; never taken finer."""
    rng = np.random.default_rng(7)
    values = np.column_stack([rng.uniform(20, 30, 40), *rng.uniform(-0.1, 0.1, (3, 40))])
    trial = subzero.load_scenario("fig6")
    short = dataclasses.replace(trial, duration=5.0)
    sim = subzero.Simulator(short, sample_time=0.5)
    for command in values:
        seen = sim.step(command)
    commands = dataclasses.replace(trial.commands, time=0.5 * np.arange(40), values=values)
    run = subzero.simulate(dataclasses.replace(trial, duration=20.0, commands=commands, rtol=0.0))
    stepped = sim.result()
    last = {
        "rudder_command",
        "propeller_command",
        "stern_plane_port_command",
        "stern_plane_starboard_command",
    }
    for name in set(run.data_vars) - last - {"battery_voltage"}:
        found, wanted = stepped[name].values, run[name].values
        assert np.array_equal(found[:-1], wanted[:-1], equal_nan=True), name
    assert seen.time == 20.0
    assert seen.surge_speed == float(run["surge_speed"][-1])


def test_an_observation_is_the_last_row_in_inner_units():
    sim = subzero.Simulator("turning_circle")
    for _ in range(400):
        seen = sim.step()
    row = sim.result().isel(time=-1)
    assert seen.time == float(row["time"]) == sim.time
    for name, value in list(seen._asdict().items())[1:]:
        channel = RENAMED_CHANNELS.get(name, name)
        assert value * BY_NAME[channel].scale == pytest.approx(float(row[channel]), rel=1e-14, abs=1e-14), (
            name
        )
    assert seen.heading > 2 * np.pi, "the heading goes on after a full turn"


def test_a_reset_begins_again():
    sim = subzero.Simulator("fig6")
    first = [sim.step() for _ in range(20)]
    start = sim.reset()
    assert start.time == 0.0
    assert [sim.step() for _ in range(20)] == first


@pytest.mark.parametrize(
    "command", [(25.0, float("nan"), 0.0, 0.0), (25.0, 0.0, 0.0), "full", None.__class__, (np.inf, 0, 0, 0)]
)
def test_a_controller_that_returns_nonsense_is_told_and_the_run_keeps_what_it_has(command):
    sim = subzero.Simulator("fig6")
    sim.step()
    with pytest.raises(subzero.UserError, match="Allowed: four finite numbers, propeller"):
        sim.step(command)
    assert sim.time == pytest.approx(0.1)
    assert sim.result().sizes["time"] == 2
    sim.step()


def test_a_run_that_cannot_go_on_stops_with_what_it_has():
    trial = subzero.load_scenario("fig6")
    fast = dataclasses.replace(trial.start, surge_speed=20.0)
    sim = subzero.Simulator(dataclasses.replace(trial, start=fast, hull_step=1.0, cable_step=1.0))
    with pytest.raises(subzero.RunStoppedError, match="absurd"):
        sim.step()
    with pytest.raises(subzero.RunStoppedError, match="absurd"):
        sim.step()
    assert sim.result().attrs["outcome"] == "stopped"


@pytest.mark.parametrize(
    "scenario,options,reported",
    [
        ("fig6", {"sample_time": 0.05}, "whole number of cable steps, 0.1 s each"),
        ("fig6", {"sample_time": float("nan")}, "it must be a finite number or None"),
        ("fig5", {}, "nothing to command"),
    ],
)
def test_what_cannot_be_stepped_is_refused(scenario, options, reported):
    with pytest.raises(subzero.UserError, match=reported):
        subzero.Simulator(scenario, **options)


def test_a_simulator_that_was_interrupted_while_it_began_again_stands_where_it_stood(monkeypatch):
    """All of a run is exchanged at once: it went on from the end of the old run, at the time 0 of the new one."""
    sim, other = subzero.Simulator("fig6"), subzero.Simulator("fig6")
    for _ in range(50):
        before = sim.step()
        other.step()

    def interrupted(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("subzero.simulation.stepper.observe", interrupted)
        with pytest.raises(KeyboardInterrupt):
            sim.reset()
    assert sim.observation == before
    assert sim.step() == other.step()


def test_a_step_costs_little_beside_the_physics():
    command, batch = (25.0, 0.05, 0.0, 0.0), 50
    sim = subzero.Simulator("turning_circle", tethered=False)
    sim.step(command)
    trial = dataclasses.replace(sim.trial, commands=None)
    setup, live = prepare(trial, sim.model, False)
    recording, times = new_recording(601, 10_000), np.linspace(0.0, 60.0, 601)
    run_rows(setup, live, recording, times, 1, 2, 0, 1, 1)
    stepped, inside = [], []
    for k in range(11):
        begin = time.perf_counter()
        for _ in range(batch):
            sim.step(command)
        middle = time.perf_counter()
        run_rows(setup, live, recording, times, 2 + k * batch, 2 + (k + 1) * batch, 0, 1, 1)
        stepped.append((middle - begin) / batch)
        inside.append((time.perf_counter() - middle) / batch)
    assert min(stepped) - min(inside) < 20e-6


@pytest.mark.slow
def test_the_stepper_runs_without_the_compiler_too():
    script = (
        "import subzero; sim = subzero.Simulator('fig6', tethered=False);"
        "print([sim.step() for _ in range(20)][-1].surge_speed.hex())"
    )
    reported = [
        subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, check=True,
            env=os.environ | {"NUMBA_DISABLE_JIT": off},
        ).stdout.strip()
        for off in ("0", "1")
    ]  # fmt: skip
    assert float.fromhex(reported[0]) == pytest.approx(float.fromhex(reported[1]), rel=1e-12)
