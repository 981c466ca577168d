"""Name what a finished run holds: a variable per channel with its unit, arrays with named axes, and where it came from.

A `PlainRun` has all of it in plain arrays, by the names of the dataset: what looks at one array after another, as the
checks of a run and a sweep do, needs no labels. To label them takes half as long as a short run, and what labels them,
xarray, takes a second to import.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import version
from math import isfinite, prod
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import scenarios
from subzero.channels import BY_NAME, CHANNELS, ENERGY_CHANNELS, LISTED, TIME, listed_channels
from subzero.errors import DISTRIBUTION, printable
from subzero.model import Model
from subzero.validity import as_json, check_run, notes_on
from vehicle import BREAKDOWN, STATE_SIZE
from vehicle.channels import FIRST_COMMAND

if TYPE_CHECKING:
    import xarray as xr

    from subzero.engine.recording import Recording, Run
    from subzero.simulation.refinement import Accuracy

NO_PULL = 1e-9
"""A tow force below this has no direction; then the cable is taken to lie straight behind the vehicle. [N]"""

AXES = {
    "term": (list(BREAKDOWN), "named force of the equation of motion, see vehicle.TERMS"),
    "component": (
        list("XYZKMN"),
        "force X, Y, Z [N] and moment K, M, N [N m], body axes, about the hull centre",
    ),
    "earth_axis": (["north", "east", "down"], "axis of the earth-fixed frame"),
}
"""Named axes of the arrays: their labels, and their meaning."""
LIBRARIES = ("numpy", "numba", "xarray")


class Variable(NamedTuple):
    """An array of a run: names of its axes, its values and their attributes."""

    axes: str | tuple[str, ...]
    values: Any
    attributes: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class PlainRun:
    """A run by the names of its dataset, in plain arrays: ``run["heading"].values``, ``run.attrs["outcome"]``.

    Attributes:
        variables: by name.
        coordinates: by name.
        attrs: its provenance, its outcome, and the warnings.
    """

    variables: dict[str, Variable]
    coordinates: dict[str, Variable]
    attrs: dict[str, Any]

    def __getitem__(self, name: str) -> Variable:
        """Return a variable or a coordinate."""
        return self.variables[name] if name in self.variables else self.coordinates[name]

    def labelled(self) -> xr.Dataset:
        """Return it as a labelled dataset, on the same arrays."""
        import xarray as xr

        made = {name: xr.Variable(*variable) for name, variable in self.coordinates.items()}
        indexes = {name: _index(name, made[name].values) for name in made if made[name].dims == (name,)}
        for name, index in indexes.items():
            made |= index.create_variables({name: made[name]})
        return xr.Dataset(self.variables, coords=xr.Coordinates(made, indexes), attrs=self.attrs)


def _index(name: str, values: np.ndarray) -> Any:
    """Return the index of an axis; those of `AXES` are made once, as pandas takes long for texts."""
    from xarray.indexes import PandasIndex

    return _label_index(name) if name in AXES else PandasIndex(values, name, coord_dtype=values.dtype)


@cache
def _label_index(name: str) -> Any:
    from xarray.indexes import PandasIndex

    labels = np.array(AXES[name][0])
    return PandasIndex(labels, name, coord_dtype=labels.dtype)


def plain_run(
    trial: scenarios.Trial,
    model: Model,
    tethered: bool,
    run: Run,
    accuracy: Accuracy | None = None,
    *,
    spends: bool = False,
) -> PlainRun:
    """Return a run by the names of its dataset; angles in degrees, all other channels in SI and rev/s.

    Args:
        trial: the trial that was run.
        model: with which model.
        tethered: with the cable.
        run: the run.
        accuracy: how far its force can be trusted, if that is known.
        spends: the result may take over the memory of the run's shapes; the run is not used afterwards.
    """
    values = channel_values(run, model)
    diagnostics = _diagnostics(run, values, model)
    channels = {
        channel.name: Variable("time", values[channel.name] * channel.scale, channel.attributes)
        for channel in CHANNELS
    }
    channels |= _listed(run, model)
    result = PlainRun(
        variables=channels | _arrays(run, spends) | diagnostics | _thrusters(run, model),
        coordinates={TIME.name: Variable("time", run.times, TIME.attributes)}
        | _axes(run, spends)
        | _thruster_names(model),
        attrs=_provenance(trial, model, tethered, run),
    )
    record_accuracy(result, trial, model, accuracy)
    return result


def _listed(run: Run, model: Model) -> dict[str, Variable]:
    """Return state and command of each listed actuator of the vehicle."""
    found = {}
    for i, command in enumerate(model.vehicle.channels):
        columns = run.recording.state[:, STATE_SIZE + i], run.recording.command[:, FIRST_COMMAND + i]
        for channel, values in zip(listed_channels(command), columns, strict=True):
            about = channel.attributes | {LISTED: command.name}
            found[channel.name] = Variable("time", values * channel.scale, about)
    return found


def _thrusters(run: Run, model: Model) -> dict[str, Variable]:
    """Return what the thrusters do, of a vehicle that has some."""
    count = len(model.vehicle.thrusters)
    words = "lagged command of each thruster, -1 full astern to 1 full ahead"
    given = run.recording.state[:, STATE_SIZE : STATE_SIZE + count]
    attributes = {"units": "1", "long_name": words}
    return {"thruster_command": Variable(("time", "thruster"), given, attributes)} if count else {}


def _thruster_names(model: Model) -> dict[str, Variable]:
    """Return the axis of the thrusters: their names."""
    names = [name for name, _ in model.vehicle.thrusters]
    words = {"long_name": "thruster, by the name of its table in the file of the vehicle"}
    return {"thruster": Variable("thruster", np.array(names), words)} if names else {}


def record_accuracy(
    result: PlainRun, trial: scenarios.Trial, model: Model, accuracy: Accuracy | None
) -> None:
    """Write into the attributes of a run how far its force can be trusted, what may be wrong with it, and notes."""
    result.attrs["accuracy"] = json.dumps(_accuracy_numbers(accuracy))
    result.attrs["warnings"] = as_json(check_run(result, trial, model))
    result.attrs["notes"] = as_json(notes_on(result, trial, model))


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


def _arrays(run: Run, spends: bool) -> dict[str, Variable]:
    """Return the force breakdown, and the cable's nodes in rows of equal length, NaN after the last node."""
    r = run.recording
    position, tension = _by_node(r, r.position, spends), _by_node(r, r.tension, spends)
    about = (
        "relative to the drum's place at the start; node 0 is the tow point, the last one sits at the drum"
    )
    return {
        "force_breakdown": Variable(
            ("time", "term", "component"),
            r.breakdown,
            {
                "units": "N; N m",
                "long_name": "share of every term in the force (X, Y, Z) and moment (K, M, N)",
            },
        ),
        "cable_position": Variable(
            ("time", "node", "earth_axis"),
            position,
            {"units": "m", "long_name": f"place of the cable's nodes, {about}"},
        ),
        "cable_node_tension": Variable(
            ("time", "node"),
            tension,
            {"units": BY_NAME["cable_tension"].unit, "long_name": "tension along the cable"},
        ),
        "node_count": Variable(
            "time", r.nodes, {"units": "1", "long_name": "nodes of the cable, 0 without one"}
        ),
    }


def _axes(run: Run, spends: bool) -> dict[str, Variable]:
    """Return the coordinates besides the time: labels of the axes, nodes, and the arc length of each node."""
    r, nodes = run.recording, max(int(run.recording.nodes.max(initial=0)), 1)
    named = {
        name: Variable(name, np.array(labels), {"long_name": words}) for name, (labels, words) in AXES.items()
    }
    count = {"long_name": "node of the cable, 0 at the tow point, the last one at the drum", "units": "1"}
    arc = {
        "long_name": "arc length along the unstretched cable, from the tow point",
        "units": "m",
        "symbol": "s",
    }
    return named | {
        "node": Variable("node", np.arange(nodes), count),
        "arc_length": Variable(("time", "node"), _by_node(r, r.arc_length, spends), arc),
    }


BLOCK = 512
"""So many rows are spread at a time. [-]"""


def _by_node(r: Recording, packed: np.ndarray, spends: bool) -> np.ndarray:
    """Return an array packed node by node in rows of equal length (n, nodes, …), NaN after the last node.

    With `spends` the rows are spread in place, as the array has space after them: a long run then needs its memory
    once, not twice. Rows are moved from the last one on, so that no row is written over one that is still to be read.
    """
    nodes = max(int(r.nodes.max(initial=0)), 1)
    buffer = packed.base if spends and packed.base is not None else packed
    if buffer.shape[0] < r.nodes.size * nodes or buffer.shape[1:] != packed.shape[1:]:
        buffer = np.empty((r.nodes.size * nodes, *packed.shape[1:]))
    rows: np.ndarray = buffer[: r.nodes.size * nodes].reshape(r.nodes.size, nodes, *packed.shape[1:])
    ends = np.concatenate([[0], np.cumsum(r.nodes)])
    for first in reversed(range(0, r.nodes.size, BLOCK)):
        last = min(first + BLOCK, r.nodes.size)
        some = np.full((last - first, nodes, *packed.shape[1:]), np.nan)
        is_there = np.arange(nodes) < r.nodes[first:last, None]
        _as_items(some, 2)[is_there] = _as_items(packed[ends[first] : ends[last]], 1)
        rows[first:last] = some
    return rows


def _as_items(array: np.ndarray, axes: int) -> np.ndarray:
    """Return an array as one of so many axes: the numbers of a node are one item, and moved at once, not one by one."""
    numbers = prod(array.shape[axes:])
    item = np.dtype((np.void, numbers * array.itemsize))
    return array.reshape(*array.shape[:axes], numbers).view(item)[..., 0]


def _diagnostics(run: Run, values: dict[str, np.ndarray], model: Model) -> dict[str, Variable]:
    """Return the variables that show how far to trust the cable, row by row."""
    r, words = run.recording, "how far the cable, summed up from the drum, ends from the tow point"
    wave = "segments of the cable that a transverse wave crosses in an exchange, at most"
    return {
        "closure_error": Variable(
            "time", _closure_error(run, values, model), {"units": "m", "long_name": words}
        ),
        "courant_number": Variable("time", r.courant, {"units": "1", "long_name": wave}),
        "newton_iterations": Variable(
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
    """Return the provenance of the result; no clock, so that two runs are alike to the last bit."""
    motion = trial.motion
    snap = run.snap
    return {
        "scenario": trial.name,
        "title": printable(trial.description),
        "scenario_text": trial.text,
        "parameters": json.dumps(model.parameters()),
        **_versions(),
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
        **({"snap": json.dumps(snap)} if snap else {}),
    }


@cache
def _versions() -> dict[str, str]:
    """Return the versions of the software; looked up once, for each time a file is read."""
    return {
        "subzero_version": version(DISTRIBUTION),
        "versions": json.dumps({name: version(name) for name in LIBRARIES}),
    }


def _accuracy_numbers(accuracy: Accuracy | None) -> dict[str, float | int | None]:
    """Return an accuracy ready for JSON: an infinite error as None."""
    if accuracy is None:
        return {}
    numbers = asdict(accuracy)
    return {name: value if isfinite(value) else None for name, value in numbers.items()}


def cable_origin(run: xr.Dataset) -> np.ndarray:
    """Return from where the cable's places count, (3,): at the start, node 0 is at the tow point. [m]"""
    from scipy.spatial.transform import Rotation

    first = int(np.argmax(run["node_count"].values > 0))
    hull = np.array([run[name].values[first] for name in ("north", "east", "depth")])
    tow = json.loads(run.attrs["parameters"])["vehicle"]["tow_point"]
    arm = np.array([tow["x"], tow["y"], tow["z"]])
    angles = [run[name].values[first] for name in ("heading", "pitch", "roll_angle")]
    to_earth = Rotation.from_euler("ZYX", angles, degrees=True)
    place: np.ndarray = hull + to_earth.apply(arm) - run["cable_position"].values[first, 0]
    return place
