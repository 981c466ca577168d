"""Deliver a calibration: the vehicle's file, the same as JSON, figures, and what is told on the terminal."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich import box
from rich.console import Console
from rich.table import Table

from subzero.calibration import report
from subzero.calibration.results import Calibration
from subzero.errors import UserError, printable
from subzero.voice import PLAIN, Voice

if TYPE_CHECKING:
    from subzero.stage import Stage

ENDINGS = (".toml", "_cable.toml", ".json", "_numbers.png", "_errors.png", "_profiles.png")
"""Of the files that are written, behind the name of the vehicle."""


def files_of(out: Path) -> tuple[str, ...]:
    """Return the names of all files that a calibration may write.

    Raises:
        UserError: the name of the vehicle's file does not end in .toml.
    """
    if out.suffix != ".toml":
        raise UserError(f"'{printable(str(out))}' is no name for a vehicle's file. Give --out one that ends in .toml, "
                        "such as my_vehicle.toml.")  # fmt: skip
    return tuple(f"{out.stem}{ending}" for ending in ENDINGS)


def write_all(found: Calibration, stage: Stage, stem: str) -> None:
    """Write the vehicle (and the cable), the JSON file and the figures, under a common name."""
    from subzero.figures.calibration import draw_calibration
    from subzero.figures.style import Title
    from subzero.output import write_figures

    for kind, text in found.files.items():
        ending = ".toml" if kind == "vehicle" else "_cable.toml"
        if text:
            (stage.path / f"{stem}{ending}").write_text(text, encoding="utf-8")
    (stage.path / f"{stem}.json").write_text(report.text(found), encoding="utf-8")
    trials = ", ".join(dict.fromkeys(one.trial for one in found.records))
    title = Title(words=f"Calibration of {', '.join(one.name for one in found.records)}", scenario=trials)
    figures = draw_calibration(found, title)
    write_figures({f"{stem}_{name}": figure for name, figure in figures.items()}, stage)


def tell(found: Calibration, stage: Stage, out: Path, *, voice: Voice = PLAIN) -> None:
    """Print the numbers, what the records do not determine, and where the files are."""
    with voice.tells(report.plain(report.mapping(found)) | stage.files()):
        _tell(found, stage, out, Console())


def _tell(found: Calibration, stage: Stage, out: Path, console: Console) -> None:
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    for name in ("number", "before", "calibrated", "95 %", "change"):
        words = name in ("number", "change")
        table.add_column(name, justify="left" if words else "right", overflow="fold", no_wrap=not words)
    for row in report.rows(found):
        table.add_row(*row)
    console.print(table, highlight=False)
    for line in (report.headline(found), *report.story(found)):
        console.print(printable(line), highlight=False, markup=False)
    console.print(stage.words(), highlight=False, markup=False)
    if not found.refused:
        console.print(f'Fly it: vehicle = "{out.name}" in a trial beside it.', highlight=False, markup=False)
