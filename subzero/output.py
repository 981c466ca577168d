"""Write what a command leaves behind: runs, summaries and figures, to a stage that delivers all of them or none."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Any

from subzero import stage as stages
from subzero.channels import CHANNELS, TIME
from subzero.stage import Stage

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

COMMAND: ContextVar[str] = ContextVar("COMMAND", default="")
"""The line of the shell that is being carried out; a page says it, so that its reader can do it again."""

RUN_FILES = (*("tethered.nc", "tethered.csv", "untethered.nc", "untethered.csv", "summary.json", "report.html"),
             *(f"{name}.{kind}" for kind in ("png", "svg", "pdf")
               for name in ("fig4", "fig5", "fig6", "attitude", "cable", "tension", "forces", "deployment", "measured",
                            "manoeuvre")),
             *("replay.gif", "replay.mp4"))  # fmt: skip
"""Files of runs; `subzero.figures.draw` names the figures."""

DIAGNOSIS_FILES = ("diagnosis.json", "extended.toml", "report.md", "report.html", "record.csv", "record.toml",
                   "answer.sealed")  # fmt: skip
"""Files of diagnoses and challenges."""


@contextmanager
def staged(folder: Path) -> Iterator[Stage]:
    """Give a stage to write to, as `subzero.stage.staged`; what commands write must not be names of folders there.

    Raises:
        UserError: at once, if `folder` cannot be made or written.
    """
    with stages.staged(folder, (*RUN_FILES, *DIAGNOSIS_FILES)) as stage:
        yield stage


def write_run(run: xr.Dataset, stage: Stage, name: str, *, float64: bool = False) -> None:
    """Write a run as ``name.nc`` (everything, with units and provenance) and ``name.csv`` (the channels).

    Args:
        run: the run.
        stage: where to.
        name: of both files.
        float64: in double precision throughout; by default the arrays of `storage` have single precision.
    """
    with stages.told(stage.folder):
        write_netcdf(run, stage.path / f"{name}.nc", float64)
        write_csv(run, stage.path / f"{name}.csv")


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


def write_netcdf(run: xr.Dataset, path: Path, float64: bool = False) -> None:
    """Write a run as netCDF; its library says a full disk as it says everything else."""
    try:
        run.to_netcdf(path, engine="netcdf4", encoding=storage(run, float64=float64))
    except RuntimeError as error:
        if "HDF error" not in str(error):
            raise
        raise OSError(
            0, f"{path.name} could not be written, perhaps because the disk is full ({error})"
        ) from error


def write_csv(run: xr.Dataset, path: Path) -> None:
    """Write the channels of a run as CSV: one row a sample, units in the column names, nothing where NaN."""
    channels = [TIME, *(channel for channel in CHANNELS if channel.name in run)]
    columns = [run[channel.name].values.tolist() for channel in channels]
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([channel.column for channel in channels])
        writer.writerows([_cell(value) for value in row] for row in zip(*columns, strict=True))


def write_summary(summary: dict[str, Any], stage: Stage) -> None:
    """Write ``summary.json``."""
    text = json.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False)
    with stages.told(stage.folder):
        (stage.path / "summary.json").write_text(text + "\n", encoding="utf-8")


def write_page(page: str, stage: Stage) -> None:
    """Write ``report.html``."""
    with stages.told(stage.folder):
        (stage.path / "report.html").write_text(page, encoding="utf-8")


DRAWING: dict[Any, Any] = {"svg.hashsalt": "subzero", "svg.fonttype": "path", "pdf.fonttype": 42}
"""Two drawings of one figure are alike to the last letter; letters of a PDF are letters."""
OF_KIND: dict[str, dict[str, Any]] = {
    "png": {"pil_kwargs": {"compress_level": 3}},
    "svg": {"metadata": {"Date": None}},
    "pdf": {"metadata": {"CreationDate": None}},
}
"""How a figure of a kind is written."""


def write_figures(figures: Mapping[str, Figure], stage: Stage, kind: str = "png") -> None:
    """Write each figure as ``name.png``, or as a drawing, ``name.svg`` or ``name.pdf``."""
    import matplotlib as mpl

    with stages.told(stage.folder), mpl.rc_context(DRAWING):
        for name, figure in figures.items():
            figure.savefig(stage.path / f"{name}.{kind}", **OF_KIND[kind])


def _cell(value: float) -> str:
    """Ten digits are more than any of these numbers is good for; a gap is an empty cell."""
    return "" if value != value else format(value, ".10g")
