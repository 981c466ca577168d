"""Write the files of a command: runs, summaries and figures; all of them are delivered, or none."""

from __future__ import annotations

import csv
import json
import warnings
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from subzero.channels import TIME, channels_of
from subzero.files import atomic_output
from subzero.files.atomic_output import OutputFolder
from subzero.files.integrity import append_digest

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

RUN_FILES = (
    *("tethered.nc", "tethered.csv", "untethered.nc", "untethered.csv", "summary.json", "report.html"),
    *(
        f"{name}.{kind}"
        for kind in ("png", "svg", "pdf")
        for name in (
            "fig4",
            "fig5",
            "fig6",
            "attitude",
            "station",
            "actuators",
            "cable",
            "tension",
            "forces",
            "deployment",
            "measured",
            "manoeuvre",
        )
    ),
    *("replay.gif", "replay.mp4"),
)
"""Files of runs; `subzero.figures.draw` names the figures."""

DIAGNOSIS_FILES = (
    "diagnosis.json",
    "extended.toml",
    "report.md",
    "report.html",
    "record.csv",
    "record.toml",
    "answer.sealed",
)
"""Files of diagnoses and challenges."""


def open_output_folder(folder: Path) -> AbstractContextManager[OutputFolder]:
    """Give a folder to write to, as `atomic_output.open_output_folder`; files of commands must not be folders there.

    Raises:
        UserError: at once, if `folder` cannot be made or written.
    """
    return atomic_output.open_output_folder(folder, (*RUN_FILES, *DIAGNOSIS_FILES))


def write_run(run: xr.Dataset, output_folder: OutputFolder, name: str, *, float64: bool = False) -> None:
    """Write a run as ``name.nc`` (everything, with units and provenance) and ``name.csv`` (the channels).

    Args:
        run: the run.
        output_folder: where to.
        name: of both files.
        float64: in double precision throughout; by default the arrays of `storage` have single precision.
    """
    with atomic_output.friendly_errors(output_folder.folder):
        write_netcdf(run, output_folder.path / f"{name}.nc", float64)
        write_csv(run, output_folder.path / f"{name}.csv")


CHUNKS, CHANNEL_CHUNK = {"time": 128, "node": 64}, 4096
"""So many times of so many nodes are compressed together, one axis at a time; a channel has one axis. Of the layouts
that were tried on five minutes of fig6 it gives the smallest file, a third smaller than nodes one by one. [-]"""
COMPRESSION = 4
"""Of zlib's 1 to 9; more takes twice the time and saves some per cent."""


def storage(run: xr.Dataset, *, float64: bool = False) -> dict[str, dict[str, Any]]:
    """Return how a run is stored as netCDF, as ``to_netcdf(encoding=...)`` takes it: compressed, all of it.

    Channels, times and counts keep every bit. What has more axes than time (the cable's shape, tensions along it,
    forces by name) is most of a run, and has single precision: 24 bits, a share of 6e-8, which is half a millimetre at
    10 km from the drum.

    Args:
        run: the run.
        float64: every bit of these too.
    """
    stored: dict[str, dict[str, Any]] = {}
    for name, values in run.variables.items():
        if name != TIME.name and "time" in values.dims and values.size:
            most = CHUNKS if values.ndim > 1 else {"time": CHANNEL_CHUNK}
            chunks = tuple(min(size, most.get(str(dim), 1)) for dim, size in values.sizes.items())
            how = {"zlib": True, "complevel": COMPRESSION, "shuffle": True, "chunksizes": chunks}
            single = {"dtype": "float32"} if values.ndim > 1 and not float64 else {}
            stored[str(name)] = how | single
    return stored


BLOCK = 8 * CHUNKS["time"]
"""So many times of an array are converted and written together: whole chunks, and no second copy of all of it. [-]"""

CHUNK_CACHE = 2**20
"""No chunk is written twice: the library need not keep 16 MiB of them for each array. [bytes]"""


def write_netcdf(run: xr.Dataset, path: Path, float64: bool = False) -> None:
    """Write a run as netCDF, its large arrays block by block.

    xarray converts all that it writes before it writes any of it, which takes as much memory as the run itself.
    """
    stored = storage(run, float64=float64)
    large = [name for name, values in run.variables.items() if values.ndim > 1 and name in stored]
    rest = run.drop_vars(large)
    with full_disk_said(path):
        rest.to_netcdf(
            path, engine="netcdf4", encoding={name: stored[name] for name in stored if name in rest.variables}
        )
        _append(run, path, {str(name): stored[str(name)] for name in large})
        append_digest(path)


@contextmanager
def full_disk_said(path: Path) -> Iterator[None]:
    """Raise the error of a file that cannot be written where the netCDF library says "HDF error"."""
    try:
        yield
    except RuntimeError as error:
        if "HDF error" not in str(error):
            raise
        raise OSError(
            0, f"{path.name} could not be written, perhaps because the disk is full ({error})"
        ) from error


def _append(run: xr.Dataset, path: Path, stored: dict[str, dict[str, Any]]) -> None:
    """Write arrays over time into a file that has the rest of their run, as xarray would have."""
    import netCDF4

    with netCDF4.Dataset(path, "a") as file:
        _forget_homeless(
            file, {each for name in stored for each in _located(run, name).get("coordinates", "").split()}
        )
        for name, how in stored.items():
            values = run.variables[name]
            dims = tuple(str(dim) for dim in values.dims)
            for dim in (dim for dim in dims if dim not in file.dimensions):
                file.createDimension(dim, values.sizes[dim])
            kind = np.dtype(how.get("dtype", values.dtype))
            options = {key: value for key, value in how.items() if key != "dtype"}
            fill = np.array(np.nan, kind) if kind.kind == "f" else None
            made = file.createVariable(name, kind, dims, fill_value=fill, **options)
            made.set_var_chunk_cache(CHUNK_CACHE)
            made.setncatts(_located(run, name) | values.attrs)
            for first in range(0, values.shape[0], BLOCK):
                made[first : first + BLOCK] = values.values[first : first + BLOCK].astype(kind)


def _forget_homeless(file: Any, found: set[str]) -> None:
    """Take coordinates that variables will name out of the attribute of those that none names."""
    if "coordinates" in file.ncattrs():
        left = [name for name in file.coordinates.split() if name not in found]
        file.delncattr("coordinates")
        file.setncatts({"coordinates": " ".join(left)} if left else {})


def _located(run: xr.Dataset, name: str) -> dict[str, str]:
    """Return the attribute that names the coordinates of a variable that are no axes of it, by the CF conventions."""
    auxiliary = sorted(
        str(coord)
        for coord, values in run.coords.items()
        if coord not in run.dims and set(values.dims) <= set(run[name].dims)
    )
    return {"coordinates": " ".join(auxiliary)} if auxiliary and name not in run.coords else {}


def write_csv(run: xr.Dataset, path: Path) -> None:
    """Write the channels of a run as CSV: one row a sample, units in the column names, nothing where NaN."""
    channels = [TIME, *channels_of(run)]
    columns = [run[channel.name].values for channel in channels]
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([channel.column for channel in channels])
        for first in range(0, columns[0].size, BLOCK):
            block = [column[first : first + BLOCK].tolist() for column in columns]
            writer.writerows([_cell(value) for value in row] for row in zip(*block, strict=True))


def write_summary(summary: dict[str, Any], output_folder: OutputFolder) -> None:
    """Write ``summary.json``."""
    text = json.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False)
    with atomic_output.friendly_errors(output_folder.folder):
        (output_folder.path / "summary.json").write_text(text + "\n", encoding="utf-8")


def write_page(page: str, output_folder: OutputFolder) -> None:
    """Write ``report.html``."""
    with atomic_output.friendly_errors(output_folder.folder):
        (output_folder.path / "report.html").write_text(page, encoding="utf-8")


DRAWING: dict[Any, Any] = {"svg.hashsalt": "subzero", "svg.fonttype": "path", "pdf.fonttype": 42}
"""Two drawings of one figure are alike to the last letter; letters of a PDF are letters."""
OF_KIND: dict[str, dict[str, Any]] = {
    "png": {"pil_kwargs": {"compress_level": 3}},
    "svg": {"metadata": {"Date": None}},
    "pdf": {"metadata": {"CreationDate": None}},
}
"""How a figure of a kind is written."""


@contextmanager
def lacking_letters_as_boxes() -> Iterator[None]:
    """Draw figures without a word on letters that their font lacks: they are boxes, and pages say them as text."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from font", UserWarning)
        yield


def write_figures(figures: Mapping[str, Figure], output_folder: OutputFolder, kind: str = "png") -> None:
    """Write each figure as ``name.png``, or as a drawing, ``name.svg`` or ``name.pdf``."""
    with atomic_output.friendly_errors(output_folder.folder):
        for name, figure in figures.items():
            save(figure, output_folder.path / f"{name}.{kind}", kind)


def save(figure: Figure, to: Path | IO[bytes], kind: str) -> None:
    """Write a figure to a file, by its path or open."""
    import matplotlib as mpl

    with mpl.rc_context(DRAWING), lacking_letters_as_boxes():
        figure.savefig(to, format=kind, **OF_KIND[kind])


def _cell(value: float) -> str:
    """Ten digits are more than any of these numbers is good for; a gap is an empty cell."""
    return "" if value != value else format(value, ".10g")
