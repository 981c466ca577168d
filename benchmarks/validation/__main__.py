"""Measure the cases and write the page: ``python -m benchmarks.validation``."""

from __future__ import annotations

import sys
from typing import Annotated

import cyclopts
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from . import moordyn_record
from .cases import CASES, Case
from .page import FAIL, PAGE, cells, draw, write_page
from .row import Row

app = cyclopts.App(name="python -m benchmarks.validation", help_format="plaintext", version_flags=[])
console = Console(highlight=False, width=None if sys.stdout.isatty() else 150)


@app.default
def validate(
    *,
    only: Annotated[list[str] | None, cyclopts.Parameter(consume_multiple=True)] = None,
    quick: bool = False,
) -> int:
    """Measure the cable against what is known, and write docs/validation.md with its figures.

    Args:
        only: names of cases; the page keeps the sections of the others.
        quick: print, with fewer refinements, and write nothing.
    """
    names = [case.name for case in CASES]
    unknown = [name for name in only or () if name not in names]
    if unknown:
        console.print(f"There is no case {unknown[0]!r}; there are: {', '.join(names)}.")
        return 2
    chosen = [case for case in CASES if only is None or case.name in only]
    found = measure(chosen, quick)
    if not quick:
        for case in chosen:
            if case.draw:
                draw(case)
        write_page(found)
        console.print(f"Written: {PAGE}")
    failed = sum(row.judged and not row.passed for rows in found.values() for row in rows)
    judged = sum(row.judged for rows in found.values() for row in rows)
    console.print(f"{judged - failed} of {judged} gates are met.")
    return 1 if failed else 0


def measure(cases: list[Case], quick: bool) -> dict[str, list[Row]]:
    """Return the rows of the cases by name, printing each table when it is known."""
    found = {}
    with Progress(console=console, transient=True) as bar:
        task = bar.add_task("measuring", total=len(cases))
        for case in cases:
            bar.update(task, description=case.name)
            if case.name == "moordyn_2" and not quick and moordyn_record.is_possible():
                moordyn_record.renew()
            found[case.name] = case.rows(quick)
            show(case, found[case.name])
            bar.advance(task)
    return found


def show(case: Case, rows: list[Row]) -> None:
    """Print the rows of a case, what fails in red."""
    sheet = Table("case", "ours", "reference", "error", "gate", title=case.title, title_justify="left")
    for row in rows:
        name, ours, reference, unit, error, gate, verdict, _ = cells(row)
        style = "red" if verdict == FAIL else ""
        sheet.add_row(name, f"{ours} {unit}", f"{reference} {unit}", error, gate, style=style)
    console.print(sheet)


if __name__ == "__main__":
    sys.exit(app(result_action="return_value"))
