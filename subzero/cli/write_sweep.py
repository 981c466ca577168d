"""Write the results of a sweep: dataset, table, summary, figures, page; and print numbers and the main effects.

The processes that ran the members draw the figures at the same time.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING, Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from subzero.cli.output_mode import COMMAND, PLAIN, OutputMode
from subzero.errors import printable
from subzero.page.report import Drawn, drawn
from subzero.results import netcdf_csv
from subzero.results.summary import plain
from subzero.sweeps.design import Points
from subzero.sweeps.member import Job
from subzero.sweeps.outcomes import unit_of
from subzero.sweeps.page import numbers, page_of_sweep, warning_lines, what_matters
from subzero.sweeps.plan import Plan
from subzero.sweeps.result import RESULT, TABLE, Gathered, percentiles, write_result
from subzero.sweeps.sensitivity import Effect, description_of, effects_of
from subzero.sweeps.store import FILE, Store

if TYPE_CHECKING:
    from subzero.files.atomic_output import OutputFolder
    from subzero.page.report import Table as Rows
    from subzero.sweeps.workers import WorkerPool

FIGURES = ("bands", "histograms", "against", "tornado")
"""All that there may be, in the order in which a page has them."""
LONGEST_FIRST = ("against", "histograms", "bands", "tornado")
FILES = (RESULT, TABLE, "summary.json", "report.html", *(f"{name}.png" for name in FIGURES))
"""Files that a sweep writes in addition to its store."""
SHOWN_REASONS = 5
"""Number of failed members that are reported with their reason. [-]"""
KEPT_REASONS = 100
"""Number of failed members in the summary; the table has all."""


def write_sweep(
    plan: Plan, store: Store, output_folder: OutputFolder, pool: WorkerPool | None = None
) -> dict[str, Any]:
    """Write everything that belongs to a finished sweep, and return its summary; a pool draws, if there is one."""
    from subzero.files.atomic_output import friendly_errors

    with friendly_errors(output_folder.folder):
        found = write_result(store, plan.job, plan.points, plan.attributes, output_folder.path)
    effects = effects_of(plan.points, found)
    summary = summary_of(plan, store, found, effects)
    netcdf_csv.write_summary(summary, output_folder)
    title = {"words": plan.description, "scenario": plan.job.trial.name, "warnings": _in_short(summary)}
    made = pictures(partial(drawn_here, plan.points, plan.job, found, effects, title), pool)
    with friendly_errors(output_folder.folder):
        for name, (png, _) in made.items():
            (output_folder.path / f"{name}.png").write_bytes(png)
    figures = {name: figure for name, (_, figure) in made.items()}
    netcdf_csv.write_page(page_of_sweep(plan, summary, figures, COMMAND.get()), output_folder)
    return summary


Picture = tuple[bytes, Drawn]
"""A figure as the bytes of a PNG, and as it stands in a page."""


def pictures(
    draw: Callable[[Sequence[str]], dict[str, Picture]], pool: WorkerPool | None = None
) -> dict[str, Picture]:
    """Return the pictures that there are, by name, in the order of `FIGURES`; drawn by a pool, if there is one."""
    if pool is None:
        made = draw(FIGURES)
    else:
        made, asked = {}, {name: pool.submit(draw, [name]) for name in LONGEST_FIRST}
        for name, each in asked.items():
            try:
                made |= each.result()
            except BrokenExecutor:  # a user killed it: no member is lost by that, and no figure
                made |= draw([name])
    return {name: made[name] for name in FIGURES if name in made}


def drawn_here(
    points: Points,
    job: Job,
    found: Gathered,
    effects: list[Effect],
    title: dict[str, str],
    names: Sequence[str],
) -> dict[str, Picture]:
    """Draw those of some figures that there are, in this process; `title` has the texts of a `Title`."""
    from subzero.figures.style import Title
    from subzero.sweeps.figures import draw_sweep

    made = {}
    for name, figure in draw_sweep(points, job, found, effects, Title(**title), names).items():
        held = io.BytesIO()
        netcdf_csv.save(figure, held, "png")
        made[name] = held.getvalue(), drawn(figure)
    return made


def summary_of(plan: Plan, store: Store, found: Gathered, effects: list[Effect]) -> dict[str, Any]:
    """Return a sweep in a few numbers, ready for JSON."""
    points = plan.points
    return {
        "scenario": plan.job.trial.name,
        "title": plan.description,
        "subzero_version": plan.attributes["subzero_version"],
        "design": {"name": points.design, "samples": points.samples, "seed": points.seed},
        "parameters": {
            spread.name: {"unit": spread.unit, "from": spread.ends[0], "to": spread.ends[1]}
            for spread in points.spreads
        },
        "members": len(points.values),
        "failed": int(found.failed.sum()),
        "reasons": dict(store.reasons(KEPT_REASONS)),
        "warnings": dict(found.warned.most_common()),
        "scalars": {
            name: {"unit": unit_of(name), **percentile} for name, percentile in percentiles(found).items()
        },
        "sensitivity": {
            "method": description_of(points.design)[0],
            "effects": [plain(asdict(effect)) for effect in effects],
        },
    }


def _in_short(summary: dict[str, Any]) -> str:
    """Return how many members failed or warn, for a line of a figure; or nothing."""
    failed = [f"{summary['failed']} of {summary['members']} members failed"] if summary["failed"] else []
    warned = [f"{count} warn of {check.replace('_', ' ')}" for check, count in summary["warnings"].items()]
    return "; ".join([*failed, *warned])


def print_sweep(
    summary: dict[str, Any], output_folder: OutputFolder, output_mode: OutputMode = PLAIN
) -> None:
    """Print the outcomes of a sweep."""
    kept = f"{FILE} keeps its members: the same command does not run them again."
    with output_mode.emit(summary | output_folder.files()):
        console = Console()
        console.print(f"{summary['scenario']}: {summary['title']}", highlight=False, markup=False)
        console.print(_rich(numbers(summary), words=1), highlight=False)
        if summary["sensitivity"]["effects"]:
            matters = what_matters(summary)
            console.print(matters.title, highlight=False, markup=False)
            console.print(_rich(matters, words=2), highlight=False)
        for line in _troubles(summary):
            console.print(printable(line), highlight=False, markup=False, soft_wrap=True)
        console.print(f"{output_folder.words()}\n{kept}", highlight=False, markup=False)


def _rich(rows: Rows, *, words: int) -> Table:
    """Return rows as the terminal shows them: `words` columns of words, then numbers."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for at, name in enumerate(rows.header):
        table.add_column(escape(name), justify="left" if at < words else "right", overflow="fold")
    for group in rows.groups:
        for row in group:
            table.add_row(*(escape(printable(cell)) for cell in row))
    return table


def _troubles(summary: dict[str, Any]) -> Iterator[str]:
    """Give the lines on members that warn or failed."""
    yield from (f"Warning: {line}" for line in warning_lines(summary))
    if summary["failed"]:
        yield f"{summary['failed']} of {summary['members']} members failed:"
        for member, reason in list(summary["reasons"].items())[:SHOWN_REASONS]:
            yield f"  member {member}: {' '.join(reason.split())}"
        if summary["failed"] > SHOWN_REASONS:
            yield f"  … and {summary['failed'] - SHOWN_REASONS} more, in {TABLE}."
