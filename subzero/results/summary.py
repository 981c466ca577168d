"""A run in a few numbers: the main results, each with its unit in its name.

Plain numbers, texts and mappings only, so a summary can be printed, stored as JSON and compared. A number
that does not exist (the heading of a run without samples, the balance of a prescribed run) is None.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.channels import BY_NAME, ENERGY_CHANNELS, AnyRun, channels_of
from subzero.records.record import fits
from subzero.validity import notes_of, warnings_of

if TYPE_CHECKING:
    import xarray as xr

    from subzero.records.record import Record

ENERGY_PARTS = tuple(name.removeprefix("energy_") for name in ENERGY_CHANNELS[1:])
"""Where the work of the propulsion goes; their sum is ``energy_propeller_work``."""

FORCE = ("cable_force_forward", "cable_force_starboard", "cable_force_down")
MOMENT = ("cable_moment_roll", "cable_moment_pitch", "cable_moment_yaw")


def summarise(run: AnyRun) -> dict[str, Any]:
    """Return the numbers of one run that one reads first; keys carry their units."""
    time, speed = run["time"].values, run["surge_speed"].values
    force, moment = magnitude(run, FORCE), magnitude(run, MOMENT)
    peak, pull, twist = (int(np.argmax(values)) for values in (speed, force, moment))
    return {
        "outcome": run.attrs["outcome"],
        "outcome_message": run.attrs["outcome_message"],
        "warnings": [warning._asdict() for warning in warnings_of(run)],
        "notes": [note._asdict() for note in notes_of(run)],
        "time_at_end_s": number(time[-1]),
        "peak_speed_m_s": number(speed[peak]),
        "time_of_peak_speed_s": number(time[peak]),
        "speed_at_end_m_s": number(speed[-1]),
        "heading_at_end_deg": at_end(run, "heading"),
        "depth_at_end_m": at_end(run, "depth"),
        "path_length_m": number(path_length(run)),
        "cable_length_at_end_m": at_end(run, "cable_length"),
        "largest_cable_force_N": number(force[pull]),
        "time_of_largest_cable_force_s": number(time[pull]),
        "largest_cable_moment_N_m": number(moment[twist]),
        "time_of_largest_cable_moment_s": number(time[twist]),
        **({"snap": json.loads(run.attrs["snap"])} if "snap" in run.attrs else {}),
        **({"listed_actuators": moved} if (moved := moved_actuators(run)) else {}),
        "energy": energy_balance(run),
        "diagnostics": diagnostics(run),
        "thinned": run.attrs.get("thinned"),
        "refinement": json.loads(run.attrs["refinement"]) if "refinement" in run.attrs else None,
    }


def moved_actuators(run: AnyRun) -> dict[str, list[float | None]]:
    """Return how far each listed actuator of the vehicle went: column of its state → least and largest value."""
    listed = [channel for channel in channels_of(run) if channel.name not in BY_NAME]
    states = [channel for channel in listed if channel.name.endswith("_state")]
    return {
        channel.column: [number(run[channel.name].values.min()), number(run[channel.name].values.max())]
        for channel in states
    }


def diagnostics(run: AnyRun) -> dict[str, float | int | None] | None:
    """Return the numbers that show how far to trust the cable; None for a run without one.

    ``energy_residual`` is what the balance of all energies leaves unexplained at the end, as a share of the work and
    the losses in all; a scheme that keeps no such balance has none.
    """
    if not run.attrs["tethered"]:
        return None
    work = np.abs(np.diff(run["energy_propeller_work"].values)).sum()
    spent = work + run["energy_hull_loss"].values[-1] + run["energy_cable_loss"].values[-1]
    residual = abs(run["energy_residual"].values[-1])
    return {
        "closure_error_m": number(run["closure_error"].values.max()),
        "energy_residual": number(residual / spent) if spent > 0.0 else None,
        "largest_courant_number": number(run["courant_number"].values.max()),
        "smallest_tension_N": number(np.nanmin(run["cable_node_tension"].values)),
        "newton_iterations": int(run["newton_iterations"].values[-1]),
    }


def summary_of(runs: dict[str, xr.Dataset], record: Record | None) -> dict[str, Any]:
    """Return some runs of one trial, and how well they explain a record, ready for JSON.

    Args:
        runs: runs by name, tethered, untethered or both.
        record: the measured record.

    Returns:
        scenario, title, subzero_version, prescribed; each run's `summarise` under its name; and ``measured``:
        source and channels → unit and, by run, samples, rmse, bias, fit_percent; None without a record.
    """
    first = next(iter(runs.values()))
    head = {key: first.attrs[key] for key in ("scenario", "title", "subzero_version")}
    body = {label: summarise(run) for label, run in runs.items()}
    measured = (
        None
        if record is None
        else {"source": record.source, "channels": _explained(runs, record), "notes": list(record.notes)}
    )
    return {**head, "prescribed": bool(first.attrs["prescribed"]), **body, "measured": measured}


def plain(value: Any) -> Any:
    """Return a value as JSON takes it: arrays as lists, numbers that do not exist as null."""
    if isinstance(value, Mapping):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(each) for each in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _explained(runs: dict[str, xr.Dataset], record: Record) -> dict[str, Any]:
    """Return channel → its unit and, by run, the numbers of the fit."""
    return {
        name: {"unit": BY_NAME[name].unit, **{label: plain(asdict(fit)) for label, fit in by_run.items()}}
        for name, by_run in fits(runs, record).items()
    }


def energy_balance(run: AnyRun) -> dict[str, float | None] | None:
    """Return where the propeller's work went by the end, in joules, and the unexplained share of it.

    None for a prescribed run, whose vehicle is moved by no propeller.
    """
    work = at_end(run, "energy_propeller_work")
    if run.attrs["prescribed"] or work is None:
        return None
    parts = {f"{part}_J": at_end(run, f"energy_{part}") for part in ENERGY_PARTS}
    residual = parts["residual_J"]
    closure = abs(residual / work) if work and residual is not None else None
    return {"propeller_work_J": work, **parts, "unexplained_share": closure}


def path_length(run: AnyRun) -> float:
    """Return the length of the track of the hull centre, as a polygon through the samples. [m]"""
    track = np.array([run[name].values for name in ("north", "east", "depth")])
    return float(np.sum(np.linalg.norm(np.diff(track, axis=1), axis=0)))


def magnitude(run: AnyRun, names: tuple[str, ...]) -> np.ndarray:
    """Return the length of a vector that is stored as three channels; gaps count as zero."""
    size: np.ndarray = np.linalg.norm(np.nan_to_num([run[name].values for name in names]), axis=0)
    return size


def at_end(run: AnyRun, name: str) -> float | None:
    """Return the last value of a channel, None if it does not exist."""
    return number(run[name].values[-1])


def number(value: Any) -> float | None:
    """Return a plain float that JSON can hold: None for a number that is not finite."""
    return float(value) if math.isfinite(value) else None
