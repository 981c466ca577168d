"""Write what a command leaves behind: all of it, or nothing.

Files are written into a hidden folder on the same disk, and moved to their place when all of them are
complete, so a run that is interrupted, or a disk that is full, leaves no half-written file. The hidden
folder is made *before* anything is simulated: a folder that cannot be written is told at once, not after
the run.
"""

from __future__ import annotations

import csv
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from subzero.channels import CHANNELS, TIME
from subzero.errors import UserError

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Stage:
    """Where files are written before all of them move to the output folder.

    Args:
        path: the hidden folder.
        folder: the output folder, as the user named it.
        written: names of the files that have been moved to the output folder.
    """

    path: Path
    folder: Path
    written: list[str] = field(default_factory=list)


@contextmanager
def staged(folder: Path) -> Iterator[Stage]:
    """Give a stage to write to; its files appear in `folder` when the block ends without an error.

    Files of the same name are replaced, others stay.

    Raises:
        UserError: at once, if `folder` cannot be made or written.
    """
    stage = Stage(_hidden_folder(folder), folder)
    try:
        yield stage
        with _told(folder):
            folder.mkdir(parents=True, exist_ok=True)
            for path in sorted(stage.path.iterdir()):
                os.replace(path, folder / path.name)
                stage.written.append(path.name)
    finally:
        shutil.rmtree(stage.path, ignore_errors=True)


def write_run(run: xr.Dataset, stage: Stage, name: str) -> None:
    """Write a run as ``name.nc`` (everything, with units and provenance) and ``name.csv`` (the channels)."""
    with _told(stage.folder):
        run.to_netcdf(stage.path / f"{name}.nc", engine="netcdf4")
        write_csv(run, stage.path / f"{name}.csv")


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
    with _told(stage.folder):
        (stage.path / "summary.json").write_text(text + "\n", encoding="utf-8")


def write_figures(figures: dict[str, Figure], stage: Stage) -> None:
    """Write each figure as ``name.png``."""
    with _told(stage.folder):
        for name, figure in figures.items():
            figure.savefig(stage.path / f"{name}.png", pil_kwargs={"compress_level": 3})


def _cell(value: float) -> str:
    """Ten digits are more than any of these numbers is good for; a gap is an empty cell."""
    return "" if value != value else format(value, ".10g")


def _hidden_folder(folder: Path) -> Path:
    """Make the hidden folder next to where the files will be, on the same disk."""
    with _told(folder):
        home = folder.absolute()
        while not home.exists():
            home = home.parent
        if not home.is_dir():
            raise NotADirectoryError(0, f"{_shown(home)} is a file, not a folder")
        stage = home / f".subzero-{os.getpid()}-{os.urandom(4).hex()}"
        stage.mkdir()
        return stage


def _shown(path: Path) -> Path:
    """Return a path as a user would write it: relative to here if it is inside."""
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path


@contextmanager
def _told(folder: Path) -> Iterator[None]:
    """Turn a refusal of the disk into a clean message."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise UserError(
            f"The output folder {folder} cannot be written: {reason}. Give another one with --out DIR."
        ) from error
