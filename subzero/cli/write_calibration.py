"""Write a calibration: the vehicle's file, JSON (docs/calibration.md explains every key), figures, and the text on
the terminal.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich import box
from rich.console import Console
from rich.table import Table

from subzero.calibration.results import REMEDY, Advice, Calibration, Estimate
from subzero.cli.output_mode import PLAIN, OutputMode
from subzero.errors import UserError, printable
from subzero.results.summary import plain

if TYPE_CHECKING:
    from subzero.files.atomic_output import OutputFolder

ENDINGS = (".toml", "_cable.toml", ".json", "_numbers.png", "_errors.png", "_profiles.png")
"""Endings of the files that are written, after the name of the vehicle."""


def files_of(out: Path) -> tuple[str, ...]:
    """Return the names of all files that a calibration may write.

    Raises:
        UserError: the name of the vehicle's file does not end in .toml.
    """
    if out.suffix != ".toml":
        raise UserError(
            f"'{printable(str(out))}' is no name for a vehicle's file. Give --out one that ends in .toml, "
            "such as my_vehicle.toml."
        )
    return tuple(f"{out.stem}{ending}" for ending in ENDINGS)


def write_all(found: Calibration, output_folder: OutputFolder, stem: str) -> None:
    """Write the vehicle (and the cable), the JSON file and the figures, under a common name."""
    from subzero.figures.calibration import draw_calibration
    from subzero.figures.style import Title
    from subzero.results.netcdf_csv import write_figures

    for kind, content in found.files.items():
        ending = ".toml" if kind == "vehicle" else "_cable.toml"
        if content:
            (output_folder.path / f"{stem}{ending}").write_text(content, encoding="utf-8")
    (output_folder.path / f"{stem}.json").write_text(text(found), encoding="utf-8")
    trials = ", ".join(dict.fromkeys(record.trial for record in found.records))
    title = Title(
        words=f"Calibration of {', '.join(record.name for record in found.records)}", scenario=trials
    )
    figures = draw_calibration(found, title)
    write_figures({f"{stem}_{name}": figure for name, figure in figures.items()}, output_folder)


def print_calibration(
    found: Calibration, output_folder: OutputFolder, out: Path, *, output_mode: OutputMode = PLAIN
) -> None:
    """Print the numbers, the undetermined directions, and the paths of the files."""
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    for name in ("number", "before", "calibrated", "95 %", "change"):
        words = name in ("number", "change")
        table.add_column(
            name, justify="left" if words else "right", overflow="fold", no_wrap=name != "change"
        )
    for row in rows(found):
        table.add_row(*row)
    lines = [printable(line) for line in (headline(found), *story(found))]
    lines += [output_folder.words()]
    lines += [] if found.refused else [f'Fly it: vehicle = "{out.name}" in a trial of the same folder.']
    with output_mode.emit(plain(mapping(found)) | output_folder.files()):
        console = Console()
        console.print(table, highlight=False)
        for line in lines:
            console.print(line, highlight=False, markup=False)


FORMAT = "subzero calibration 1"
STRONG = 0.9
"""Correlations from this size on are reported. [-]"""
MOST_LISTED = 3
"""Number of directions, correlations and trials that are printed on the terminal; the JSON file has all."""
WORTH_FLYING = 1.2
"""A trial that makes no interval this many times narrower is not advised. [-]"""


def rows(found: Calibration) -> list[tuple[str, str, str, str, str]]:
    """Return a row for every number: name, before, after, the interval of 95 %, and remarks."""
    return [
        (
            _short(estimate.name),
            f"{estimate.before:.4g}",
            f"{estimate.value:.4g}",
            f"{estimate.low:.4g} to {estimate.high:.4g}",
            _mark(estimate),
        )
        for estimate in found.estimates
    ]


def _mark(estimate: Estimate) -> str:
    """Return by how much a number has changed, and whether the records determine it."""
    change = f"{100.0 * estimate.change:+.1f} %" if estimate.before else ""
    words = [
        change,
        "" if estimate.is_determined else "not determined",
        "at its bound" if estimate.is_at_bound else "",
    ]
    return ", ".join(filter(None, words))


def headline(found: Calibration) -> str:
    """Return the gain in one sentence; or that there was none."""
    if found.refused:
        return "Nothing comes near these records: the numbers above are no calibration, and no vehicle is written."
    count, moved = len(found.estimates), sum(estimate.is_determined for estimate in found.estimates)
    return (
        f"{moved} of {count} numbers are determined; on {found.how}, not fitted, the error goes from "
        f"{found.error('before'):.3g} to {found.error():.3g} noise levels."
    )


def story(found: Calibration) -> Iterator[str]:
    """Yield the lines that belong below the table; where nothing came near, the reason and the remedy."""
    if found.refused:
        yield from (*found.refused[:MOST_LISTED], REMEDY, *found.notes)
        return
    for direction in found.directions[:MOST_LISTED]:
        yield f"Not determined by these records: {direction.sentence}."
    for a, b, rho in correlations(found)[:MOST_LISTED]:
        yield f"Hardly told apart: {_short(a)} and {_short(b)} (correlation {rho:+.2f})."
    if found.advice and max(found.advice[0].sharper.values()) >= WORTH_FLYING:
        yield "To determine more: " + advised(found.advice[0])
    yield from found.strange
    if found.strange:
        yield "Something is left that no number explains: diagnose these records with the calibrated vehicle."
    yield from found.notes


def advised(advice: Advice) -> str:
    """Return a trial to fly, and the numbers that it would make sharper."""
    sharper = [(name, factor) for name, factor in advice.sharper.items() if factor >= WORTH_FLYING][
        :MOST_LISTED
    ]
    words = ", ".join(f"{_short(name)} {factor:.1f} times" for name, factor in sharper)
    return f"{advice.sentence} It would narrow the interval of {words}."


def correlations(found: Calibration) -> list[tuple[str, str, float]]:
    """Return pairs of numbers with a correlation of at least `STRONG`, the strongest first."""
    names, C = [estimate.name for estimate in found.estimates], found.correlation
    pairs = [(names[i], names[j], float(C[i, j])) for i in range(len(names)) for j in range(i)]
    return sorted((pair for pair in pairs if abs(pair[2]) >= STRONG), key=lambda pair: -abs(pair[2]))


def _short(name: str) -> str:
    return name.removeprefix("vehicle.")


def text(found: Calibration) -> str:
    """Return a calibration as JSON."""
    return json.dumps(plain(mapping(found)), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def mapping(found: Calibration) -> dict[str, Any]:
    """Return a calibration in plain numbers and texts."""
    return {
        "format": FORMAT,
        "verdict": found.verdict,
        "sentence": headline(found),
        "refused": list(found.refused),
        "converged": found.converged,
        "numbers": {
            estimate.name: {**asdict(estimate), "change": estimate.change} for estimate in found.estimates
        },
        "correlation": {
            "names": [estimate.name for estimate in found.estimates],
            "matrix": found.correlation,
        },
        "not_determined": [asdict(direction) for direction in found.directions],
        "profiles": {name: asdict(profile) for name, profile in found.profiles.items()},
        "held_out": {
            "how": found.how,
            "before": found.error("before"),
            "after": found.error(),
            "fitted": found.error("fitted"),
            "records": {
                name: {key: asdict(channel) for key, channel in channels.items()}
                for name, channels in found.held_out.items()
            },
        },
        "advice": [asdict(each) for each in found.advice],
        "nuisances": {name: {"mean": mean, "sd": sd} for name, (mean, sd) in found.nuisances.items()},
        "strange": list(found.strange),
        "records": [asdict(record) for record in found.records],
        "notes": list(found.notes),
        "seconds": dict(found.seconds),
    }
