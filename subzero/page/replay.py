"""The data of the replay of some runs: poses, channels and cable shapes, small enough to be embedded in the page.

A series of numbers x is stored as 16-bit integers c, little-endian, in base64,

    x ≈ low + step (c + 32767),   step = (high − low)/65534,   c = −32768 where there is no number,

so that it is known to half a step: 0.2 mm on a track of 25 m, 8 mm on one of a kilometre. Samples are left out evenly
where there are more than a page should carry, and the cable is given at a fixed number of points, spread evenly over
its nodes, so that a cable with short segments near the vehicle is shown as finely there. Nothing is smoothed, and
nothing is invented: every sample of the replay is one of the run.

Axes are north, east and down from where the vehicle starts; channels have the units of `subzero.channels`.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.channels import BY_NAME, channels_of
from subzero.results.dataset import cable_origin

if TYPE_CHECKING:
    import xarray as xr

    from subzero.records.record import Record

MOST_SAMPLES, MOST_SHAPES, MOST_POINTS = 4000, 1200, 80
"""Samples of channels, shapes of the cable and points of a shape that a page carries of one run."""

MISSING, LOWEST, STEPS = -32768, 32767, 65534
"""The code for no number; the number added to a code; the steps between the lowest and the highest."""

HULL = ("hull", "rudder", "stern_planes", "propeller", "tow_point")
"""Sections of a vehicle's parameters that determine its appearance."""

POSE = ("north", "east", "depth", "roll_angle", "pitch", "heading")
ACTUATORS = ("propeller_speed", "rudder_angle", "stern_plane_port_angle", "stern_plane_starboard_angle")
"""Channels that a vehicle is drawn from."""

Packed = dict[str, Any]
"""A series as the page reads it: n, low, step, and data unless the series is constant."""


@dataclass(frozen=True, kw_only=True)
class Actor:
    """One vehicle of a replay, with its cable if it has one.

    Args:
        name: its label in the replay.
        run: its motion.
        ghost: drawn translucent, behind the others.
    """

    name: str
    run: xr.Dataset
    ghost: bool = False


def can_be_replayed(run: xr.Dataset) -> bool:
    """Return whether there is anything to replay: at least two samples, of a vehicle whose shape is known."""
    shape = json.loads(run.attrs["parameters"]).get("vehicle", {})
    return run.sizes["time"] > 1 and all(name in shape for name in HULL)


def actors_of(runs: dict[str, xr.Dataset]) -> tuple[Actor, ...]:
    """Return the vehicles of some runs by name: the first one solid, the others as ghosts."""
    return tuple(Actor(name=name, run=run, ghost=at > 0) for at, (name, run) in enumerate(runs.items()))


def encode(actors: tuple[Actor, ...], record: Record | None = None) -> dict[str, Any]:
    """Return the data of a replay, ready for JSON.

    Args:
        actors: the vehicles that move; the first one is followed.
        record: the measured record, drawn as dots, and as a track if it has places.
    """
    first = actors[0].run
    parameters = json.loads(first.attrs["parameters"])
    return {
        "vehicle": {name: parameters["vehicle"][name] for name in HULL}
        | {"thrusters": parameters["vehicle"].get("thrusters", {})},
        "drum_radius": parameters["drum"]["radius"],
        "drum_on_vessel": parameters.get("vessel") is not None,
        "sea_bed": float(first.attrs.get("sea_bed_m", 0.0)) or None,
        "channels": {
            channel.name: {"unit": channel.unit, "words": channel.long_name} for channel in channels_of(first)
        },
        "actors": [_actor(actor) for actor in actors],
        "measured": None if record is None else _measured(record),
    }


def _actor(actor: Actor) -> dict[str, Any]:
    """Return the motion of one vehicle."""
    run = actor.run
    kept = _spread(run.sizes["time"], MOST_SAMPLES)
    channels = {channel.name: pack(run[channel.name].values[kept]) for channel in channels_of(run)}
    return {
        "name": actor.name,
        "ghost": actor.ghost,
        "samples_of_run": int(run.sizes["time"]),
        "time": pack_exactly(run["time"].values[kept]),
        "turns": pack(_turns(run)[kept]),
        "channels": channels,
        "cable": _cable(run) if run.attrs["tethered"] and run["node_count"].values.any() else None,
    }


def _measured(record: Record) -> dict[str, Any]:
    """Return the measurements, in the channels of the page."""
    kept = _spread(record.time.size, MOST_SAMPLES)
    values = {name: pack(values[kept]) for name, values in record.values.items() if name in BY_NAME}
    return {"time": pack_exactly(record.time[kept]), "channels": values}


def _turns(run: xr.Dataset) -> np.ndarray:
    """Return how often the propeller has turned since the start: the integral of its speed, by trapezia."""
    time, speed = run["time"].values, np.nan_to_num(run["propeller_speed"].values)
    return np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])


def _cable(run: xr.Dataset) -> dict[str, Any]:
    """Return the shapes of the cable and the tension along it, point 0 at the vehicle."""
    kept = _spread(run.sizes["time"], MOST_SHAPES)
    counts = run["node_count"].values[kept].astype(int)
    points = min(int(counts.max()), MOST_POINTS)
    position = run["cable_position"].values[kept] + cable_origin(run)
    tension = run["cable_node_tension"].values[kept]
    along = np.concatenate([position, tension[:, :, None]], axis=2)
    shapes = np.stack([_points(rows, count, points) for rows, count in zip(along, counts, strict=True)])
    packed = [pack(shapes[:, :, axis].ravel()) for axis in range(4)]
    return {
        "time": pack_exactly(run["time"].values[kept]),
        "points": points,
        **dict(zip(("north", "east", "down", "tension"), packed, strict=True)),
    }


def _points(rows: np.ndarray, count: int, points: int) -> np.ndarray:
    """Return `points` rows spread evenly over the first `count`, between them linearly; no numbers without a cable."""
    if count < 2:
        return np.full((points, rows.shape[1]), np.nan)
    at = np.linspace(0.0, count - 1.0, points)
    before = np.minimum(at.astype(int), count - 2)
    share = (at - before)[:, None]
    between: np.ndarray = (1.0 - share) * rows[before] + share * rows[before + 1]
    return between


def _spread(size: int, most: int) -> np.ndarray:
    """Return indices spread evenly over a sequence, every n-th and the last, `most` at most and one more."""
    every = max(1, -(-size // most))
    return np.unique(np.append(np.arange(0, size, every), size - 1))


def pack(values: np.ndarray) -> Packed:
    """Return a series as 16-bit steps between its lowest and its highest number."""
    values = np.asarray(values, dtype=float)
    known = np.isfinite(values)
    if not known.any():
        return {"n": values.size, "low": None, "step": 0.0}
    low, high = float(values[known].min()), float(values[known].max())
    step = (high - low) / STEPS
    if known.all() and step <= 0.0:
        return {"n": values.size, "low": low, "step": 0.0}
    codes = np.full(values.size, MISSING, dtype="<i2")
    codes[known] = np.rint((values[known] - low) / (step or 1.0)) - LOWEST
    return {"n": values.size, "low": low, "step": step, "data": _base64(codes)}


def pack_exactly(values: np.ndarray) -> Packed:
    """Return a series in double precision: times, which must rise."""
    return {"n": values.size, "doubles": _base64(np.asarray(values, dtype="<f8"))}


def _base64(values: np.ndarray) -> str:
    return base64.b64encode(values.tobytes()).decode("ascii")


def as_run(record: Record, other: xr.Dataset, used: Mapping[str, np.ndarray]) -> xr.Dataset | None:
    """Return a record as a run at its own times, to be shown as a vehicle; None if it does not say where that went.

        dx/dt = R(roll, pitch, heading) (u, v, w),    from the position of the other run at the first sample

    Places that were measured are taken as they are; else they are reckoned so, with v and w as measured, 0 where they
    are not. A record with neither places nor speed and heading does not say where the vehicle went.

    Args:
        record: the measured record.
        other: a run of the same trial, which lends its fins, its propeller and the angles that were not measured.
        used: channel → which samples are no outliers, (samples,) of bool; all of them where it has none.
    """
    end = float(other["time"].values[-1])
    time = record.time[(record.time >= 0.0) & (record.time <= end)]
    values = {name: _filled(record, name, time, used.get(name)) for name in record.values if name in BY_NAME}
    if time.size < 2 or not ({"north", "east"} <= set(values) or {"surge_speed", "heading"} <= set(values)):
        return None
    from_run = {
        name: np.interp(time, other["time"], other[name]) for name in (*POSE, *ACTUATORS) if name in other
    }
    pose = {name: values.get(name, from_run[name]) for name in ("roll_angle", "pitch", "heading")}
    place = _computed(time, pose, values, {name: from_run[name][0] for name in ("north", "east", "depth")})
    shown = {**from_run, **values, **pose, **place}
    data = {name: ("time", each, BY_NAME[name].attributes) for name, each in shown.items()}
    import xarray as xr

    return xr.Dataset(data, coords={"time": time}, attrs={**other.attrs, "tethered": 0})


def _filled(record: Record, name: str, time: np.ndarray, used: np.ndarray | None) -> np.ndarray:
    """Return a channel at some times, linear across its gaps and outliers; zero if it has no samples."""
    known = np.isfinite(record.values[name])
    if used is not None and used.shape == known.shape:
        known &= used
    return (
        np.interp(time, record.time[known], record.values[name][known])
        if known.any()
        else np.zeros(time.size)
    )


def _computed(
    time: np.ndarray,
    pose: Mapping[str, np.ndarray],
    values: Mapping[str, np.ndarray],
    start: Mapping[str, float],
) -> dict[str, np.ndarray]:
    """Return north, east and depth: as they are measured, else the integral of the velocity from the start on. [m]"""
    from scipy.integrate import cumulative_trapezoid
    from scipy.spatial.transform import Rotation

    speeds = [values.get(name, np.zeros(time.size)) for name in ("surge_speed", "sway_speed", "heave_speed")]
    angles = np.stack([pose["heading"], pose["pitch"], pose["roll_angle"]], axis=-1)
    velocity = Rotation.from_euler("ZYX", angles, degrees=True).apply(np.stack(speeds, axis=-1))
    way = cumulative_trapezoid(velocity, time, axis=0, initial=0.0)
    return {
        name: values.get(name, start[name] + way[:, axis])
        for axis, name in enumerate(("north", "east", "depth"))
    }
