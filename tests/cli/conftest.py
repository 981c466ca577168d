"""Runs that cost nothing: a point on rails, its cable where it went, in the shape of a real result.

What a command does with a run (files, figures, tables, messages, exit codes) needs no physics. The real
simulation is run from the command line once, in test_end_to_end.py.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import types
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from subzero.channels import BY_NAME, CHANNELS
from subzero.cli.app import main

DRAG_PER_METRE = 0.5 * 1000.0 * np.pi * 0.0025 * 0.01
STOPPED = "The cable did not converge at t = 3 s, node 4. Try a shorter cable step."
TERMS = ("propeller", "axial_drag", "cross_flow_drag", "body_lift", "rudder", "restoring", "cable")
MASS = 70.0
PARAMETERS = {
    "cable": {"water_density": 1000.0, "diameter": 0.0025, "tangential_drag_coefficient": 0.01,
              "mass_per_length": 0.0049},
    "drum": {"radius": 0.1, "inertia": 0.0, "friction_torque": 0.0},
    "vehicle": {},
    "current": [0.0, 0.0, 0.0],
}  # fmt: skip


def make_run(*, tethered=True, prescribed=None, samples=301, outcome="completed", name="fig6"):
    """Return a run in the shape of `subzero.simulate`: `prescribed` is None, "straight" or "dive"."""
    time = np.linspace(0.0, 0.1 * (samples - 1), samples)
    values = {channel.name: np.zeros(samples) for channel in CHANNELS}
    _motion(values, time, tethered, prescribed)
    _cable(values, tethered)
    run = xr.Dataset(coords={"time": ("time", time, BY_NAME["time"].attributes)})
    for channel in CHANNELS:
        run[channel.name] = ("time", values[channel.name], channel.attributes)
    _arrays(run, tethered)
    return run.assign_attrs(
        outcome=outcome, outcome_message="Reached the end." if outcome == "completed" else STOPPED,
        scenario=name, title="a synthetic trial", scenario_text="[run]", parameters=json.dumps(PARAMETERS),
        subzero_version="0.2.0", versions=json.dumps({"numpy": "2"}), tethered=int(tethered),
        prescribed=int(prescribed is not None), scheme="moving_end",
    )  # fmt: skip


def _motion(values, time, tethered, prescribed):
    """Speed up, lose speed to the cable, turn by 8 degrees; or do as prescribed."""
    step = 0.1
    speed = np.ones_like(time) if prescribed else _speed(time, step, tethered)
    dive = -np.clip(6.0 * (time - 10.0), 0.0, 60.0) * (prescribed == "dive")
    turn = 0.0 * time if prescribed else 27.0 + 8.0 / (1.0 + np.exp(-(time - 14.0) / 2.0))
    turn = turn - (0.0 if prescribed else 0.02 * tethered * np.maximum(time - 15.0, 0.0))
    pitch, heading, ahead = np.radians(dive), np.radians(turn), step * speed
    values["surge_speed"] = values["speed_over_ground"] = speed
    values["pitch"], values["heading"] = dive, turn
    values["north"] = np.cumsum(ahead * np.cos(pitch) * np.cos(heading))
    values["east"] = np.cumsum(ahead * np.cos(pitch) * np.sin(heading))
    values["depth"] = np.cumsum(-ahead * np.sin(pitch))
    values["yaw_rate"] = np.diff(turn, prepend=turn[0]) / step
    _actuators(values, time, ahead, prescribed)


def _speed(time, step, tethered):
    speed, length = np.zeros_like(time), 0.0
    for k in range(1, time.size):
        drag = 2.0 + tethered * DRAG_PER_METRE * length
        speed[k] = speed[k - 1] + step * (6.0 - drag * speed[k - 1] ** 2) / MASS
        length += step * speed[k]
    return speed


def _actuators(values, time, ahead, prescribed):
    speed = values["surge_speed"]
    if not prescribed:
        values["propeller_command"] += 12.0
        values["propeller_speed"] = 12.0 * (1 - np.exp(-time))
        values["rudder_command"] = np.where((time > 10) & (time < 18), 5.0, 0.0)
        values["rudder_angle"] = values["rudder_command"] * 0.9
        values["battery_voltage"] += 24.0
        values["energy_propeller_work"] = np.cumsum(6.0 * ahead)
        values["energy_hull_loss"] = np.cumsum(2.0 * speed**2 * ahead)
        values["energy_kinetic_change"] = 0.5 * MASS * speed**2


def _cable(values, tethered):
    if not tethered:
        return
    length = np.cumsum(np.hypot(np.diff(values["north"], prepend=0.0), np.diff(values["depth"], prepend=0.0)))
    tension = DRAG_PER_METRE * values["surge_speed"] ** 2 * length
    values["cable_length"], values["cable_tension"] = length, tension
    values["cable_force_forward"] = -tension * 0.98
    values["cable_force_down"] = 0.1 * tension * (values["pitch"] < 0)
    values["cable_moment_pitch"] = 0.5 * values["cable_force_down"]
    values["tow_velocity_tangential"] = -values["surge_speed"]
    values["energy_cable_loss"] = 0.5 * tension * length
    values["energy_residual"] = (values["energy_propeller_work"] - values["energy_hull_loss"]
                                 - values["energy_cable_loss"] - values["energy_kinetic_change"])  # fmt: skip


def _arrays(run, tethered):
    """The cable lies along the track; its tension falls linearly to the drum. Forces: all thrust and drag."""
    samples, nodes = run.sizes["time"], 40
    position, tension = np.full((samples, nodes, 3), np.nan), np.full((samples, nodes), np.nan)
    track = np.array([run[name].values for name in ("north", "east", "depth")])
    for k in range(samples if tethered else 0):
        at = np.linspace(k, 0, max(2, min(nodes, k // 8)))
        position[k, : at.size] = np.array([np.interp(at, np.arange(samples), one) for one in track]).T
        tension[k, : at.size] = run["cable_tension"].values[k] * at / max(k, 1)
    run["cable_position"] = (("time", "node", "earth_axis"), position, {"units": "m"})
    run["cable_node_tension"] = (("time", "node"), tension, {"units": "N"})
    run["node_count"] = ("time", np.isfinite(tension).sum(axis=1))
    run["closure_error"] = ("time", np.full(samples, 1e-15))
    run["courant_number"] = ("time", np.linspace(0.0, 0.5, samples))
    run["newton_iterations"] = ("time", 2 * np.arange(samples))
    forces = np.zeros((samples, len(TERMS), 6))
    forces[:, 0, 0], forces[:, 1, 0] = 6.0, -2.0 * run["surge_speed"].values ** 2
    forces[:, 4, 5] = run["rudder_angle"].values * 0.1
    forces[:, -1, 0] = run["cable_force_forward"].values
    run["force_breakdown"] = (("time", "term", "component"), forces)
    run.coords["term"], run.coords["component"] = list(TERMS), list("XYZKMN")
    run.coords["earth_axis"] = ["north", "east", "down"]


@pytest.fixture(name="make_run")
def _make_run():
    return make_run


def put_on_rails(patch):
    """Replace the simulation by runs on rails; return the list that will hold what it was asked for."""
    asked = []

    def simulate(scenario, *, tethered=True, progress=None):
        asked.append((scenario, tethered))
        prescribed = None if scenario.motion is None else "straight"
        return make_run(tethered=tethered, prescribed=prescribed, name=scenario.name)

    module = types.ModuleType("subzero.simulation.run")
    vars(module)["simulate"] = simulate
    patch.setitem(sys.modules, "subzero.simulation.run", module)
    patch.delitem(sys.modules, "subzero.simulation.comparison", raising=False)
    return asked


@pytest.fixture
def rails(monkeypatch):
    """Runs on rails instead of the simulation; gives the list of what was asked for: (trial, tethered)."""
    yield put_on_rails(monkeypatch)
    sys.modules.pop("subzero.simulation.comparison", None)


@dataclass(frozen=True)
class Done:
    """A command that was run: exit code, standard output, working folder, what it simulated."""

    code: int
    said: str
    here: Path
    asked: list


@pytest.fixture(scope="session")
def compared(tmp_path_factory):
    """What ``subzero compare fig6`` does, on rails, run once for all tests that only look."""
    here, said = tmp_path_factory.mktemp("compared"), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(said):
        patch.chdir(here)
        patch.setenv("COLUMNS", "200")
        asked = put_on_rails(patch)
        code = main(["compare", "fig6"])
        sys.modules.pop("subzero.simulation.comparison", None)
    return Done(code, said.getvalue(), here, asked)
