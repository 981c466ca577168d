"""Deliver a diagnosis: all its files, and what is told on the terminal, before it and after it."""

from __future__ import annotations

import io
import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from subzero.diagnosis.report import tables, words
from subzero.diagnosis.results import Detectability, Verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from subzero.diagnosis.hypothesis.effect import Effect
    from subzero.diagnosis.hypothesis.logged import Logged
    from subzero.stage import Stage

MOST_ROWS = 12
"""So many causes that cannot be told apart are shown on the terminal; the report has them all."""


def tell_before(rows: Sequence[Detectability], console: Console | None = None) -> None:
    """Print what the records cannot show, or not tell apart, before anything is compared."""
    console = console or Console()
    hidden = tables.detectable(rows)
    if not hidden.rows:
        console.print("These records can tell all causes of the catalogue apart (D ≥ 16).", highlight=False)
        return
    console.print(
        f"Known beforehand: {len(hidden.rows)} of {len(rows)} causes would not be seen in these records, or hardly be "
        f"told from another (D below {tables.CLEAR_FROM:g}).",
        highlight=False,
    )
    console.print(_rich(tables.Table(hidden.header, hidden.rows[:MOST_ROWS])), highlight=False)
    if len(hidden.rows) > MOST_ROWS:
        console.print(f"… and {len(hidden.rows) - MOST_ROWS} more in the report.", highlight=False)


def tell(verdict: Verdict, stage: Stage, console: Console | None = None) -> None:
    """Print a verdict in words, and where the files are."""
    console = console or Console()
    console.print(f"\n[bold]{escape(words.headline(verdict))}[/bold]", highlight=False)
    for line in words.story(verdict):
        console.print(line, highlight=False, markup=False)
    if verdict.rivals:
        console.print(_rich(tables.rivals(verdict, short=True)), highlight=False)
    for name, table in tables.gain(verdict).items():
        console.print(f"Root mean square error, {name}:", highlight=False, markup=False)
        console.print(_rich(table), highlight=False)
    console.print(stage.words(), highlight=False, markup=False)


def _rich(table: tables.Table) -> Table:
    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in table.header:
        shown.add_column(name, overflow="fold")
    for row in table.rows:
        shown.add_row(*map(escape, row))
    return shown


def write_all(
    verdict: Verdict,
    logged: Sequence[Logged],
    stage: Stage,
    *,
    effects: Iterable[Effect] = (),
    effects_file: Path | None = None,
) -> None:
    """Write ``diagnosis.json``, ``extended.toml``, figures, and the report as ``report.md`` and ``report.html``."""
    from subzero.diagnosis.hypothesis.extended_model import all_effects
    from subzero.diagnosis.report import json_file
    from subzero.diagnosis.report.toml_file import text_of

    stage.failed = not verdict.complete
    if effects_file is not None:
        shutil.copyfile(effects_file, stage.path / effects_file.name)
    sources = ", ".join(one.record.source for one in logged)
    own = effects_file.name if effects_file is not None else None
    extended = text_of(verdict.extended, logged[0].setting, effects=all_effects(effects), effects_file=own,
                       source=sources)  # fmt: skip
    _write(stage, "extended.toml", extended)
    _write(stage, "diagnosis.json", json_file.text(verdict, {one.name: _about(one) for one in logged}))
    _write_report(verdict, logged, stage)


def _write_report(verdict: Verdict, logged: Sequence[Logged], stage: Stage) -> None:
    from subzero.diagnosis.report import html as report
    from subzero.figures.diagnosis import draw_diagnosis
    from subzero.figures.style import Title

    names = ", ".join(dict.fromkeys(one.setting.trial.name for one in logged))
    records = ", ".join(one.name for one in logged)
    title = f"Diagnosis of {records}: {words.headline(verdict)}"
    figures = draw_diagnosis(verdict, Title(words=title, scenario=names))
    pictures = {name: _png(figure) for name, figure in figures.items()}
    for name, picture in pictures.items():
        (stage.path / f"{name}.png").write_bytes(picture)
    about = {
        one.name: f"{one.record.source}, trial {one.setting.trial.name}. {' '.join(one.notes)}"
        for one in logged
    }
    text = report.markdown(verdict, about, tuple(pictures))
    _write(stage, "report.md", text)
    _write(stage, "report.html", report.page(text, pictures, title))


def _about(one: Logged) -> dict[str, object]:
    """Return what diagnosis.json says of a record."""
    return {
        "source": one.record.source,
        "scenario": one.setting.trial.name,
        "tethered": one.setting.tethered,
        "channels": list(one.record.values),
        "samples": int(one.record.time.size),
        "duration_s": float(one.record.time[-1]),
        "notes": list(one.notes),
    }


def _png(figure: Figure) -> bytes:
    held = io.BytesIO()
    figure.savefig(held, format="png", pil_kwargs={"compress_level": 3})
    return held.getvalue()


def _write(stage: Stage, name: str, text: str) -> None:
    (stage.path / name).write_text(text, encoding="utf-8")
