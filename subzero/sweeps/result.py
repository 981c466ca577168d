"""One labelled dataset of a sweep: written member after member, so that memory does not grow with their number.

    member                                  dimension, from 0
    "start.wet_length_m", …                 coordinates on it: the parameters, units in their attributes
    "peak_speed_m_s", "heading.end", …      scalars, float64
    surge_speed, …                          channels (member, time), float32
    failed, reason, warnings                whether and why a member failed; the checks that its run warns of

The same sweep gives the same file to the last byte, however it was run, and however often it was killed on the way.
"""

from __future__ import annotations

import csv
import json
import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import netCDF4
import numpy as np

from subzero.channels import BY_NAME, TIME
from subzero.errors import UserError
from subzero.results.netcdf_csv import full_disk_said
from subzero.sweeps.design import Points
from subzero.sweeps.member import Job, Member
from subzero.sweeps.outcomes import unit_of
from subzero.sweeps.store import BLOCK, Store

if TYPE_CHECKING:
    import xarray as xr

RESULT, TABLE = "sweep.nc", "members.csv"
COMPRESSION = 4
"""Of zlib; more costs time and gains nothing. [-]"""
TAKEN = ("member", "time", "failed", "reason", "warnings", "refinement_share")
"""Names of variables that no number of one's own may have."""
MOST_DRAWN = 1000
"""Number of members kept in memory for the bands of a figure: the rank of the curve drawn as the median is then right
within 1.6 %, that of the outer percentiles within 0.7 % (one standard deviation)."""
RANKS = (5.0, 25.0, 50.0, 75.0, 95.0)
"""Percentiles that are reported and drawn."""


@dataclass(frozen=True, kw_only=True)
class Gathered:
    """Data for figures and page when a sweep is done: all scalars, channels of some members, and the warnings.

    Attributes:
        names: of the scalars, those of one's own behind the others.
        scalars: (members, scalars), NaN where a member failed.
        channels: (some members, channels, times).
        failed: (members,).
        warned: check → how many members' runs warn of it.
    """

    names: tuple[str, ...]
    scalars: np.ndarray
    channels: np.ndarray
    failed: np.ndarray
    warned: Counter[str] = field(default_factory=Counter)


def write_result(
    store: Store, job: Job, points: Points, attributes: dict[str, Any], folder: Path
) -> Gathered:
    """Write the dataset and the table of all members, and return the data for figures and page.

    Args:
        store: where every member is finished.
        job: the sweep.
        points: its points.
        attributes: of the dataset.
        folder: where to.

    Raises:
        UserError: a number of one's own has a name that is taken.
    """
    own = _own_names(store, job)
    members, drawn = len(points.values), _drawn(len(points.values))
    names = (*job.outcomes.scalars, *own)
    found = Gathered(
        names=names,
        scalars=np.full((members, len(names)), np.nan),
        channels=np.full(
            (drawn.sum(), len(job.outcomes.channels), job.outcomes.times.size), np.nan, np.float32
        ),
        failed=np.zeros(members, dtype=bool),
    )
    place = np.cumsum(drawn) - 1
    path = folder / RESULT
    with (
        full_disk_said(path),
        netCDF4.Dataset(path, "w") as file,
        open(folder / TABLE, "w", newline="", encoding="utf-8") as table,
    ):
        _head(file, job, points, names, attributes)
        rows = csv.writer(table, lineterminator="\n")
        rows.writerow(["member", *points.names, *names, "reason", "warnings"])
        for block in store.blocks():
            _gather(block, found, own, drawn, place)
            _write_block(file, block, job, found)
            rows.writerows(_table_row(column, points, found) for column in block)
    return found


def open_result(path: Path) -> xr.Dataset:
    """Return the dataset of a sweep, read from its file as far as it is looked at."""
    import xarray as xr

    runs = xr.open_dataset(path, engine="netcdf4")
    return runs.set_coords(json.loads(runs.attrs["parameters"]))


def _own_names(store: Store, job: Job) -> tuple[str, ...]:
    """Return the names of all numbers of one's own, in the order in which they first come."""
    if job.outcomes.function is None:
        return ()
    names = tuple(dict.fromkeys(name for block in store.blocks() for column in block for name in column.own))
    taken = set(names) & {*TAKEN, *job.names, *job.outcomes.scalars, *job.outcomes.channels}
    if taken:
        raise UserError(
            f"The function gives {', '.join(sorted(taken))}, which the sweep has already. Use another name."
        )
    return names


def _drawn(members: int) -> np.ndarray:
    """Return which members are kept for the bands (members,): all, or of many a random choice, always the same.

    Those evenly spaced would be in step with the columns of a grid: of every other member, half the values are missing.
    """
    drawn = np.zeros(members, dtype=bool)
    chosen = np.random.default_rng(0).choice(members, min(members, MOST_DRAWN), replace=False)
    drawn[chosen] = True
    return drawn


def _head(file: Any, job: Job, points: Points, names: tuple[str, ...], attributes: dict[str, Any]) -> None:
    """Write dimensions, units, parameters and attributes."""
    members, times = len(points.values), job.outcomes.times
    file.createDimension("member", members)
    file.setncatts({"parameters": json.dumps(points.names), **attributes})
    _variable(file, "member", "i4", ("member",), {"long_name": "number of the run, from 0"})[:] = np.arange(
        members
    )
    for spread, column in zip(points.spreads, points.values.T, strict=True):
        meaning = {"units": spread.unit, "long_name": f"parameter {spread.name}"}
        _variable(file, spread.name, "f8", ("member",), meaning)[:] = column
    for name in names:
        _variable(
            file, name, "f8", ("member",), {"units": unit_of(name), "long_name": name.replace("_", " ")}
        )
    _variable(file, "failed", "i1", ("member",), {"long_name": "1 where the run could not go on"})
    about = {"units": "1", "long_name": "share of its work that runs with finer steps took"}
    _variable(file, "refinement_share", "f8", ("member",), about)
    for name, words in (("reason", "why it failed"), ("warnings", "checks that its run warns of")):
        _variable(file, name, str, ("member",), {"long_name": words})
    if job.outcomes.channels:
        file.createDimension("time", times.size)
        _variable(file, "time", "f8", ("time",), TIME.attributes)[:] = times
    for name in job.outcomes.channels:
        _variable(
            file, name, "f4", ("member", "time"), BY_NAME[name].attributes, (min(members, BLOCK), times.size)
        )


def _variable(
    file: Any, name: str, kind: Any, axes: tuple[str, ...], about: dict[str, str], chunks: Any = None
) -> Any:
    packing = {} if kind is str else {"zlib": True, "complevel": COMPRESSION, "shuffle": True}
    variable = file.createVariable(name, kind, axes, chunksizes=chunks, **packing)
    if chunks is not None:
        variable.set_var_chunk_cache(
            size=2 * 4 * math.prod(chunks)
        )  # netCDF keeps 16 MB of each variable otherwise
    variable.setncatts(about)
    return variable


def _gather(
    block: list[Member], found: Gathered, own: tuple[str, ...], drawn: np.ndarray, place: np.ndarray
) -> None:
    """Add the data of some members for figures and page."""
    for column in block:
        numbers = [column.own.get(name, np.nan) for name in own]
        found.scalars[column.index] = np.concatenate([column.scalars, numbers])
        found.failed[column.index] = bool(column.reason)
        found.warned.update([*dict.fromkeys(check for check, _ in column.warnings)])
        if drawn[column.index]:
            found.channels[place[column.index]] = column.channels


def _write_block(file: Any, block: list[Member], job: Job, found: Gathered) -> None:
    """Write some members that follow one another."""
    at = slice(block[0].index, block[-1].index + 1)
    for name, column in zip(found.names, found.scalars[at].T, strict=True):
        file[name][at] = column
    file["failed"][at] = found.failed[at]
    file["refinement_share"][at] = [each.refinement_share for each in block]
    file["reason"][at] = np.array([each.reason for each in block], dtype=object)
    file["warnings"][at] = np.array([_checks(each) for each in block], dtype=object)
    if job.outcomes.channels:
        channels = np.array([each.channels for each in block])
        for i, name in enumerate(job.outcomes.channels):
            file[name][at] = channels[:, i]


def _checks(member: Member) -> str:
    return ", ".join(dict.fromkeys(check for check, _ in member.warnings))


def _table_row(member: Member, points: Points, found: Gathered) -> Iterable[str]:
    numbers = (*points.values[member.index], *found.scalars[member.index])
    cells = ("" if number != number else format(number, ".10g") for number in numbers)
    return (str(member.index), *cells, member.reason, _checks(member))


def percentiles(found: Gathered) -> dict[str, dict[str, float]]:
    """Return statistics of every scalar, of members that did not fail: percentiles, mean, deviation, extremes."""
    reported = {}
    for name, column in zip(found.names, found.scalars.T, strict=True):
        values = column[np.isfinite(column)]
        if values.size:
            ranks = np.percentile(values, RANKS)
            reported[name] = {
                "members": int(values.size),
                "mean": float(values.mean()),
                "standard_deviation": float(values.std(ddof=1)) if values.size > 1 else 0.0,
                "min": float(values.min()),
                **{f"p{rank:g}": float(value) for rank, value in zip(RANKS, ranks, strict=True)},
                "max": float(values.max()),
            }
    return reported
