"""A run in the formats that other programs open: MCAP, MATLAB's, Parquet, and netCDF as the CF conventions ask for it.

    mcap     viewers of robots' logs: every channel over time, vehicle and cable in three dimensions, warnings
    mat      MATLAB, Octave: everything, one variable each, their units in the structure `units`
    parquet  tables: one row a sample, units in the column names as in the CSV; the cable's nodes as lists
    cf       netCDF that passes a checker of CF 1.11: standard names, units of UDUNITS, times since an epoch

Each holds the numbers of the run as they are, to the last bit. A run has no date, so time 0 is 1970-01-01 00:00 in
MCAP, where a log has to have one, and `EPOCH` in CF.

Axes. MCAP has the frames `map` (x east, y north, z up, as viewers want it), `ned` (north, east, down, from where the
vehicle starts; all numbers of a run are in it) and `vehicle` (forward, starboard, down; at the hull's centre).
"""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from subzero.arguments import check_is_run, checked_arguments
from subzero.channels import STANDARD_NAMES, TIME, channels_of
from subzero.errors import UserError, chosen, missing_extra, printable
from subzero.files.atomic_output import friendly_errors
from subzero.results.dataset import cable_origin

if TYPE_CHECKING:
    import xarray as xr

    from subzero.files.atomic_output import OutputFolder

EPOCH = "2000-01-01 00:00:00"
"""Time 0 of a run in CF, which knows no time without a date."""


@checked_arguments
def export(run: xr.Dataset, path: str | Path, kind: str | None = None) -> None:
    """Write a run in another format.

    Args:
        run: of `subzero.simulate`, or read from its netCDF file.
        path: of the file; one that is there is replaced.
        kind: one of `KINDS`; by default that of the file's ending, ``.nc`` being ``cf``.

    Raises:
        UserError: no such kind; its library is not installed; the file cannot be written.
    """
    check_is_run("export", run)
    path = Path(path)
    write = writer_of(kind or {"nc": "cf"}.get(path.suffix[1:], path.suffix[1:]))
    try:
        write(run, path)
    except OSError as error:
        raise UserError(f"{printable(str(path))} cannot be written: {error.strerror or error}.") from error


def writer_of(kind: str) -> Callable[[xr.Dataset, Path], None]:
    """Return the writer of a kind of file, once its library is known to be there.

    Raises:
        UserError: there is no such kind, or no library for it.
    """
    _, library, write = chosen(KINDS, kind, "export")
    try:
        importlib.import_module(library)
    except ImportError:
        raise missing_extra(f"The export {kind}", library.split(".")[0], "export") from None
    return write


def write_exports(run: xr.Dataset, label: str, kinds: Iterable[str], output_folder: OutputFolder) -> None:
    """Write a run in some formats: ``tethered.mcap``, ``tethered.mat``, ``tethered.parquet``, ``tethered_cf.nc``."""
    with friendly_errors(output_folder.folder):
        for kind in kinds:
            writer_of(kind)(run, output_folder.path / (label + KINDS[kind][0]))


# MCAP: messages in JSON, of schemas that viewers know by their names.


def write_mcap(run: xr.Dataset, path: Path) -> None:
    """Write channels, poses, cable and warnings as an MCAP log."""
    from mcap.writer import Writer

    with open(path, "wb") as stream:
        log: Any = Writer(stream)
        log.start(profile="", library=f"subzero {run.attrs.get('subzero_version', '')}".strip())
        log.add_metadata("run", {name: str(value) for name, value in run.attrs.items()})
        topics = {topic: _topic(log, topic, *about) for topic, about in _topics(run).items()}
        for at, topic, message in _messages(run):
            body = json.dumps(message, allow_nan=False).encode()
            log.add_message(topics[topic], log_time=at, publish_time=at, data=body)
        log.finish()


def _topic(log: Any, topic: str, name: str, schema: dict[str, Any]) -> int:
    schema_id = log.register_schema(name, "jsonschema", json.dumps(schema).encode())
    return int(log.register_channel(topic, "json", schema_id))


def _topics(run: xr.Dataset) -> dict[str, tuple[str, dict[str, Any]]]:
    """Return topic → name and JSON schema of its messages."""
    channels = {
        channel.column: {"type": "number", "description": f"{channel.long_name} [{channel.unit}]"}
        for channel in channels_of(run)
    }
    origin = np.zeros((1, 3))
    scene = _scene(0, "", "", cylinders=[_hull(run)], lines=[_line(origin)])
    return {
        "/channels": ("subzero.Channels", {"type": "object", "properties": channels}),
        "/tf": ("foxglove.FrameTransform", _schema_of(_transform(0, "", "", origin[0], UP_AND_EAST))),
        "/scene": ("foxglove.SceneUpdate", _schema_of(scene)),
        "/log": ("foxglove.Log", _schema_of(_line_of_log(0, WARNING, ""))),
    }


def _schema_of(message: Any) -> dict[str, Any]:
    """Return the JSON schema of messages like this one; viewers know the rest of a schema by its name.

    Lists that are empty here are left out: what would be in them is not known.
    """
    if isinstance(message, dict):
        parts = {name: _schema_of(part) for name, part in message.items() if part != []}
        return {"type": "object", "properties": parts}
    if isinstance(message, list):
        return {"type": "array", "items": _schema_of(message[0])}
    return {"type": {bool: "boolean", str: "string"}.get(type(message), "number")}


def _messages(run: xr.Dataset) -> Iterator[tuple[int, str, dict[str, Any]]]:
    """Give (time [ns], topic, message), in the order of time."""
    times = np.rint(1e9 * run["time"].values).astype(np.int64).tolist()
    yield times[0], "/tf", _transform(times[0], "map", "ned", np.zeros(3), UP_AND_EAST)
    yield times[0], "/scene", _scene(times[0], "vehicle", "vehicle", cylinders=[_hull(run)])
    columns = {channel.column: run[channel.name].values.tolist() for channel in channels_of(run)}
    place, turn = _poses(run)
    shapes = _shapes(run)
    for row, at in enumerate(times):
        values = {name: column[row] for name, column in columns.items()}
        yield (
            at,
            "/channels",
            {name: value for name, value in values.items() if value == value},
        )  # JSON has no NaN
        if np.isfinite(place[row]).all():
            yield at, "/tf", _transform(at, "ned", "vehicle", place[row], turn[row])
        if shapes is not None:
            yield at, "/scene", _scene(at, "cable", "ned", lines=[_line(shapes[row])])
    for level, words in _reported(run):
        yield times[-1], "/log", _line_of_log(times[-1], level, words)


UP_AND_EAST = np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0])
"""Quaternion (x, y, z, w) from north, east, down to east, north, up: half a turn about the north-east."""
WARNING, ERROR = 3, 4
"""Levels of a line of a log."""


def _poses(run: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return where the hull's centre is (n, 3) [m], and quaternions (x, y, z, w) from its axes to north, east, down."""
    place = np.stack([run[name].values for name in ("north", "east", "depth")], axis=1)
    angles = np.stack([run[name].values for name in ("heading", "pitch", "roll_angle")], axis=1)
    return place, Rotation.from_euler("ZYX", np.nan_to_num(angles), degrees=True).as_quat()


def _shapes(run: xr.Dataset) -> list[np.ndarray] | None:
    """Return the nodes of the cable (nodes, 3) of every sample, from where the vehicle starts [m]; None without one."""
    counts = run["node_count"].values.astype(int)
    if not counts.any():
        return None
    position = run["cable_position"].values + cable_origin(run)
    return [shape[:count] for shape, count in zip(position, counts, strict=True)]


def _reported(run: xr.Dataset) -> Iterator[tuple[int, str]]:
    """Return the level and the words of the messages of a run."""
    for load in json.loads(run.attrs.get("warnings", "[]")):
        yield WARNING, f"{load['check']}: {load['message']}"
    if run.attrs["outcome"] != "completed":
        yield ERROR, run.attrs["outcome_message"]


def _line_of_log(at: int, level: int, words: str) -> dict[str, Any]:
    return {"timestamp": _stamp(at), "level": level, "name": "subzero", "message": words}


def _stamp(at: int) -> dict[str, int]:
    return {"sec": at // 10**9, "nsec": at % 10**9}


def _vector(numbers: Iterable[float], names: str = "xyz") -> dict[str, float]:
    return {name: float(number) for name, number in zip(names, numbers, strict=True)}


def _transform(at: int, parent: str, child: str, place: np.ndarray, turn: np.ndarray) -> dict[str, Any]:
    frames = {"timestamp": _stamp(at), "parent_frame_id": parent, "child_frame_id": child}
    return frames | {"translation": _vector(place), "rotation": _vector(turn, "xyzw")}


def _scene(at: int, name: str, frame: str, **shapes: list[dict[str, Any]]) -> dict[str, Any]:
    kinds = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
    empty: dict[str, list[Any]] = {kind: [] for kind in kinds}
    entity = {
        "timestamp": _stamp(at),
        "frame_id": frame,
        "id": name,
        "lifetime": _stamp(0),
        "frame_locked": True,
    }
    return {"deletions": [], "entities": [entity | {"metadata": []} | empty | shapes]}


YELLOW, ORANGE = {"r": 1.0, "g": 0.8, "b": 0.1, "a": 1.0}, {"r": 1.0, "g": 0.45, "b": 0.0, "a": 1.0}
THICKNESS_PX = 2.0
"""Drawn thickness of the cable, which at its own thickness, a few millimetres, would not be visible."""


def _hull(run: xr.Dataset) -> dict[str, Any]:
    """Return the hull as a cylinder along its forward axis."""
    hull = json.loads(run.attrs["parameters"])["vehicle"]["hull"]
    middle = hull["nose_station"] - 0.5 * hull["length"]
    along = np.array([0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)])  # a cylinder's own axis is z
    return {
        "pose": {"position": _vector((middle, 0.0, 0.0)), "orientation": _vector(along, "xyzw")},
        "size": _vector((hull["diameter"], hull["diameter"], hull["length"])),
        "bottom_scale": 1.0,
        "top_scale": 1.0,
        "color": YELLOW,
    }


def _line(points: np.ndarray) -> dict[str, Any]:
    origin = {"position": _vector(np.zeros(3)), "orientation": _vector((0.0, 0.0, 0.0, 1.0), "xyzw")}
    how = {"type": 0, "pose": origin, "thickness": THICKNESS_PX, "scale_invariant": True}
    return how | {
        "points": [_vector(point) for point in points],
        "color": ORANGE,
        "colors": [],
        "indices": [],
    }


# MATLAB, tables.


def write_mat(run: xr.Dataset, path: Path) -> None:
    """Write every variable as one of MATLAB's, with structures of units, meanings and axes, and the run's
    attributes.
    """
    from scipy.io import savemat

    everything: dict[str, Any] = {str(name): run[name].values for name in run.variables}
    # A text becomes a cell of MATLAB.
    everything = {name: x if x.dtype.kind in "biuf" else x.astype(object) for name, x in everything.items()}
    for name, key in (("units", "units"), ("meanings", "long_name")):
        everything[name] = {
            str(variable): run[variable].attrs[key]
            for variable in run.variables
            if key in run[variable].attrs
        }
    everything["axes"] = {str(var): ", ".join(map(str, run[var].dims)) for var in run.data_vars}
    everything["about"] = {str(name): value for name, value in run.attrs.items()}
    savemat(path, everything, long_field_names=True, do_compression=True, oned_as="column")


def write_parquet(run: xr.Dataset, path: Path) -> None:
    """Write the channels as a table, and the cable's nodes as lists; units are in names and in the fields' metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = [
        (channel.column, pa.array(run[channel.name].values), channel.attributes)
        for channel in (TIME, *channels_of(run))
    ]
    columns += [
        (name, pa.array(lists, pa.list_(pa.float64())), {"units": unit}) for name, unit, lists in _lists(run)
    ]
    fields = [pa.field(name, values.type, metadata=about) for name, values, about in columns]
    schema = pa.schema(fields, {name: str(value) for name, value in run.attrs.items()})
    pq.write_table(pa.table([values for _, values, _ in columns], schema=schema), path, compression="zstd")


def _lists(run: xr.Dataset) -> Iterator[tuple[str, str, list[np.ndarray]]]:
    """Give the column, the unit and the lists of the cable's nodes, node 0 at the vehicle."""
    shapes = _shapes(run)
    if shapes is None:
        return
    for axis, name in enumerate(("north", "east", "depth")):
        yield f"cable_{name}_m", "m", [shape[:, axis] for shape in shapes]
    counts = run["node_count"].values.astype(int)
    tension = run["cable_node_tension"].values
    yield "cable_node_tension_N", "N", [row[:count] for row, count in zip(tension, counts, strict=True)]


# netCDF by the conventions.

CF_NAMES = STANDARD_NAMES | {
    "time": "time",
    "roll_rate": "platform_roll_rate_starboard_down",
    "pitch_rate": "platform_pitch_rate_fore_up",
    "yaw_rate": "platform_yaw_rate_fore_starboard",
}
"""Our name → that of the CF standard name table, where it means the same, sign included."""
UDUNITS = {"rev/s": "revolution s-1"}
"""Our unit → its name in UDUNITS."""
FORCE, MOMENT = ("X", "Y", "Z"), ("K", "M", "N")


def write_cf(run: xr.Dataset, path: Path) -> None:
    """Write a run as netCDF by the CF conventions."""
    from subzero.results.netcdf_csv import write_netcdf

    write_netcdf(as_cf(run), path, float64=True)


def as_cf(run: xr.Dataset) -> xr.Dataset:
    """Return a run as CF 1.11 wants it.

    Forces and moments of `force_breakdown`, which share no unit, are two variables. Names along an axis are labels
    for it, since a coordinate has to be a number. The longest axis, time, comes last, as is recommended.
    """
    cf = run.copy()
    if "force_breakdown" in run:
        for name, components, unit in (("force", FORCE, "N"), ("moment", MOMENT, "N m")):
            share = run["force_breakdown"].sel(component=list(components)).rename(component=f"{name}_axis")
            about = {"units": unit, "long_name": f"share of every term in the {name} on the vehicle"}
            cf[f"{name}_breakdown_by_term"] = share.assign_attrs(about)
        cf = cf.drop_vars(("force_breakdown", "component"))
    labels = {name: f"{name}_label" for name in cf.coords if cf[name].dtype.kind not in "biuf"}
    cf = cf.rename_vars(labels).drop_indexes(list(labels.values()), errors="ignore").transpose(..., "time")
    for variable in cf.variables:
        _describe(str(variable), cf[variable])
    words = f"simulated by subzero {run.attrs.get('subzero_version', '')}".strip()
    return cf.assign_attrs({"Conventions": "CF-1.11", "history": words, "source": words})


def _describe(name: str, variable: xr.DataArray) -> None:
    """Give a variable the attributes of the conventions, and no fill value where it has no gaps."""
    about = variable.attrs
    if name == TIME.name:
        about |= {"units": f"seconds since {EPOCH}", "axis": "T", "calendar": "proleptic_gregorian"}
        about["units_metadata"] = "leap_seconds: none"
        about["comment"] = "A run has no date: that of its start is a nominal one."
    elif about.get("units") in UDUNITS:
        about["units"] = UDUNITS[about["units"]]
    if name in CF_NAMES:
        about["standard_name"] = CF_NAMES[name]
    if name == "depth":
        about["positive"] = "down"
    if name.endswith("_label"):
        about["long_name"] = f"names along the axis {name.removesuffix('_label')}"
    if variable.dtype.kind != "f" or np.isfinite(variable.values).all():
        variable.encoding["_FillValue"] = None


KINDS: dict[str, tuple[str, str, Callable[[xr.Dataset, Path], None]]] = {
    "mcap": (".mcap", "mcap.writer", write_mcap),
    "mat": (".mat", "scipy.io", write_mat),
    "parquet": (".parquet", "pyarrow.parquet", write_parquet),
    "cf": ("_cf.nc", "netCDF4", write_cf),
}
"""Kind → ending of its files, the library that it needs, its writer."""
