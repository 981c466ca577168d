"""Label a finished run: one variable per channel with its unit, arrays with named axes, and where it all came from."""

from __future__ import annotations

import json
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

import scenarios
from subzero.channels import BY_NAME, CHANNELS, TIME
from subzero.convergence import Accuracy, as_numbers
from subzero.errors import printable
from subzero.model import Model
from subzero.validity import as_json, check_run
from vehicle import BREAKDOWN

if TYPE_CHECKING:
    from subzero.engine.recording import Recording, Run

NO_PULL = 1e-9
"""A tow force below this has no direction; then the cable is taken to lie straight behind the vehicle. [N]"""

ENERGY_CHANNELS = (
    "energy_propeller_work",
    "energy_hull_loss",
    "energy_cable_loss",
    "energy_kinetic_change",
    "energy_drum",
    "energy_added_mass_term",
    "energy_residual",
)
"""In the order of `subzero.engine.energy`."""

AXES = {
    "term": (list(BREAKDOWN), "named force of the equation of motion, see vehicle.TERMS"),
    "component": (
        list("XYZKMN"),
        "force X, Y, Z [N] and moment K, M, N [N m], body axes, about the hull centre",
    ),
    "earth_axis": (["north", "east", "down"], "axis of the earth-fixed frame"),
}
"""Named axes of the arrays: their labels, and what they are."""
LIBRARIES = ("numpy", "numba", "xarray")


def dataset_of(
    trial: scenarios.Trial, model: Model, tethered: bool, run: Run, accuracy: Accuracy | None = None
) -> xr.Dataset:
    """Return a run as a labelled dataset; angles in degrees, all other channels in SI and rev/s."""
    values = channel_values(run, model)
    data: dict[str, Any] = {
        channel.name: ("time", values[channel.name] * channel.scale, channel.attributes)
        for channel in CHANNELS
    }
    data |= _arrays(run) | _diagnostics(run, values, model)
    coordinates = {TIME.name: ("time", run.times, TIME.attributes)} | _axes(run)
    attributes = _provenance(trial, model, tethered, run) | {"accuracy": json.dumps(as_numbers(accuracy))}
    result = xr.Dataset(data, coords=coordinates, attrs=attributes)
    result.attrs["warnings"] = as_json(check_run(result, trial, model))
    return result


def channel_values(run: Run, model: Model) -> dict[str, np.ndarray]:
    """Return every channel by name, in SI units (propeller speeds in rev/s)."""
    r = run.recording
    attitude, velocity = _attitudes(r.attitude), r.state[:, 7:13]
    names = ("north", "east", "depth", "roll_angle", "pitch", "heading")
    values = dict(zip(names, (*r.state[:, :3].T, *attitude), strict=True))
    rates = ("surge_speed", "sway_speed", "heave_speed", "roll_rate", "pitch_rate", "yaw_rate")
    values |= dict(zip(rates, velocity.T, strict=True))
    values["speed_over_ground"] = np.linalg.norm(velocity[:, :3], axis=1)
    fins = ("rudder", "stern_plane_port", "stern_plane_starboard")
    values["propeller_speed"], values["propeller_command"] = r.state[:, 13], r.command[:, 0]
    values |= {f"{fin}_angle": r.fins[:, i] for i, fin in enumerate(fins)}
    values |= {f"{fin}_command": r.command[:, 1 + i] for i, fin in enumerate(fins)}
    values["battery_voltage"] = r.voltage
    values["cable_tension"] = _tow_tension(r)
    values["drum_tension"], values["cable_length"] = r.drum_tension, r.length
    pulls = [f"cable_force_{axis}" for axis in ("forward", "starboard", "down")]
    twists = [f"cable_moment_{axis}" for axis in ("roll", "pitch", "yaw")]
    values |= dict(zip(pulls + twists, r.wrench.T, strict=True))
    local = [f"tow_velocity_{axis}" for axis in ("tangential", "normal", "binormal")]
    values |= dict(zip(local, _tow_velocities(run, model), strict=True))
    return values | dict(zip(ENERGY_CHANNELS, r.energy.T, strict=True))


def _tow_tension(r: Recording) -> np.ndarray:
    """Return T(0) (n,), negative where the cable pushes, as it may in the paper's scheme. [N]."""
    size: np.ndarray = np.linalg.norm(r.tow_force, axis=1)
    if not r.nodes.any():
        return size
    first = np.cumsum(r.nodes) - r.nodes
    signed: np.ndarray = np.where(r.tension[first] < 0.0, -size, size)
    return signed


def _attitudes(attitude: np.ndarray) -> np.ndarray:
    """Return roll, pitch and heading (3, n); the heading continuous, starting in [0, 360) degrees. [rad]."""
    angles = attitude.T.copy()
    angles[2] = np.unwrap(angles[2])
    angles[2] += 2.0 * np.pi * (angles[2, 0] < -1e-12)
    return angles


def _tow_velocities(run: Run, model: Model) -> np.ndarray:
    """Return V_t, V_n, V_b of the tow point (3, n) in the cable's local frame (3)-(4), Fig. 5 (d). [m/s]

    α and β follow from the tangent t = (cosα cosβ, −sinα cosβ, −sinβ) at the tow point, with cosβ ≤ 0: straight
    ahead to the north α = 0, β = π and V_t = −u.
    """
    r, R = run.recording, run.recording.rotation
    spin = np.cross(r.state[:, 10:13], model.vehicle.tow_point.position())
    V = np.einsum("nij,nj->ni", R, r.state[:, 7:10] + spin)
    if not r.nodes.any():
        return np.zeros((3, run.times.size))
    pull = _tow_tension(r)[:, None]
    pulls = np.abs(pull) > NO_PULL
    t = np.where(pulls, r.tow_force / np.where(pulls, pull, 1.0), -R[:, :, 0])
    sin_b = -t[:, 2]
    cos_b = -np.sqrt(np.maximum(1.0 - sin_b**2, 0.0))
    alpha = np.where(cos_b < -1e-12, np.arctan2(t[:, 1], -t[:, 0]), 0.0)
    n = np.stack([-np.cos(alpha) * sin_b, np.sin(alpha) * sin_b, -cos_b], axis=1)
    b = np.stack([np.sin(alpha), np.cos(alpha), np.zeros_like(alpha)], axis=1)
    return np.stack([np.einsum("ni,ni->n", V, axis) for axis in (t, n, b)])


def _arrays(run: Run) -> dict[str, Any]:
    """Return the force breakdown, and the cable's nodes in rows of equal length, NaN behind the last node."""
    r = run.recording
    position, tension = _by_node(r, r.position), _by_node(r, r.tension)
    about = (
        "relative to the drum's place at the start; node 0 is the tow point, the last one sits at the drum"
    )
    return {
        "force_breakdown": (
            ("time", "term", "component"),
            r.breakdown,
            {
                "units": "N; N m",
                "long_name": "share of every term in the force (X, Y, Z) and moment (K, M, N)",
            },
        ),
        "cable_position": (
            ("time", "node", "earth_axis"),
            position,
            {"units": "m", "long_name": f"place of the cable's nodes, {about}"},
        ),
        "cable_node_tension": (
            ("time", "node"),
            tension,
            {"units": BY_NAME["cable_tension"].unit, "long_name": "tension along the cable"},
        ),
        "node_count": ("time", r.nodes, {"units": "1", "long_name": "nodes of the cable, 0 without one"}),
    }


def _axes(run: Run) -> dict[str, Any]:
    """Return the coordinates besides the time: labels of the axes, nodes, and the arc length of each node."""
    nodes = max(int(run.recording.nodes.max(initial=0)), 1)
    labels = {name: (name, labels, {"long_name": words}) for name, (labels, words) in AXES.items()}
    count = {"long_name": "node of the cable, 0 at the tow point, the last one at the drum", "units": "1"}
    arc = {
        "long_name": "arc length along the unstretched cable, from the tow point",
        "units": "m",
        "symbol": "s",
    }
    return labels | {
        "node": ("node", np.arange(nodes), count),
        "arc_length": (("time", "node"), _by_node(run.recording, run.recording.arc_length), arc),
    }


def _by_node(r: Recording, packed: np.ndarray) -> np.ndarray:
    """Return what is packed node by node in rows of equal length (n, nodes, …), NaN behind the last node."""
    nodes = max(int(r.nodes.max(initial=0)), 1)
    rows = np.full((r.nodes.size, nodes, *packed.shape[1:]), np.nan)
    rows[np.arange(nodes) < r.nodes[:, None]] = packed
    return rows


def _diagnostics(run: Run, values: dict[str, np.ndarray], model: Model) -> dict[str, Any]:
    """Return what tells how far to trust the cable, row by row."""
    r, words = run.recording, "how far the cable, summed up from the drum, ends from the tow point"
    wave = "segments of the cable that a transverse wave crosses in an exchange, at most"
    return {
        "closure_error": ("time", _closure_error(run, values, model), {"units": "m", "long_name": words}),
        "courant_number": ("time", r.courant, {"units": "1", "long_name": wave}),
        "newton_iterations": (
            "time",
            r.iterations,
            {"units": "1", "long_name": "iterations of Newton's method on the cable since the start"},
        ),
    }


def _closure_error(run: Run, values: dict[str, np.ndarray], model: Model) -> np.ndarray:
    """Return the distance between the tow point and node 0, counted from the start, (n,). [m]."""
    r = run.recording
    if not r.nodes.all():
        return np.zeros(run.times.size)
    hull = np.stack([values[name] for name in ("north", "east", "depth")], axis=1)
    tow = hull + r.rotation @ model.vehicle.tow_point.position()
    gap = tow - r.position[np.cumsum(r.nodes) - r.nodes]
    opened: np.ndarray = np.linalg.norm(gap - gap[0], axis=1)
    return opened


def _provenance(trial: scenarios.Trial, model: Model, tethered: bool, run: Run) -> dict[str, Any]:
    """Return what the result came from; no clock, so that two runs are alike to the last bit."""
    motion = trial.motion
    return {
        "scenario": trial.name,
        "title": printable(trial.description),
        "scenario_text": trial.text,
        "parameters": json.dumps(model.parameters()),
        "subzero_version": version("subzero"),
        "versions": json.dumps({name: version(name) for name in LIBRARIES}),
        "tethered": int(tethered),
        "prescribed": int(motion is not None),
        **(
            {"motion": f"smooth, from {', '.join(motion.given)}"}
            if motion is not None and motion.is_smooth
            else {}
        ),
        "scheme": trial.scheme,
        "sea_bed_m": trial.sea_bed,
        "outcome": "completed" if run.completed else "stopped",
        "outcome_message": run.message,
    }
