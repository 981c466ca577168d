"""Write a diagnosis: all its files, its page, and the text on the terminal, before it and after it.

In the replay of the page the model that explains the first record best is solid, with its cable; the nominal simulation
and the measured vehicle are ghosts.
"""

from __future__ import annotations

import dataclasses
import shlex
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from subzero.cli.output_mode import COMMAND, PLAIN, OutputMode
from subzero.diagnosis.hypothesis.catalogue import all_effects, with_own
from subzero.diagnosis.hypothesis.hypotheses import apply_extended
from subzero.diagnosis.report import json_file, tables, words
from subzero.diagnosis.report.sections import Section as Told
from subzero.diagnosis.report.sections import belongs, markdown, sections
from subzero.diagnosis.report.summary import summary
from subzero.diagnosis.report.toml_file import text_of
from subzero.diagnosis.results import (
    CAUSE_NAMED,
    NOTHING_WRONG,
    OUT_OF_CATALOGUE,
    UNDECIDED,
    Detectability,
    Extended,
    Verdict,
)
from subzero.errors import DISTRIBUTION, printable
from subzero.page.replay import Actor, as_run, can_be_replayed, encode
from subzero.page.report import Answer, Line, Report, Section, render
from subzero.page.report import Table as Rows
from subzero.results.netcdf_csv import write_figures

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from subzero.diagnosis.hypothesis.configuration import Setting
    from subzero.diagnosis.hypothesis.effect import Effect
    from subzero.diagnosis.hypothesis.logged import Logged
    from subzero.files.atomic_output import OutputFolder
    from subzero.records.record import Record

Run = Callable[["Setting"], "xr.Dataset"]
"""Simulates a setting as the diagnosis has simulated it."""

MOST_ROWS = 12
"""Number of indistinguishable causes that are shown on the terminal; the report has them all."""


def print_plan(rows: Sequence[Detectability]) -> None:
    """Print how much the records cannot show, or not tell apart, before anything is compared."""
    console = Console()
    hidden = tables.detectable(rows)
    if not hidden.rows:
        console.print("These records can tell all causes of the catalogue apart (D ≥ 16).", highlight=False)
        return
    console.print(
        f"Known beforehand: {len(hidden.rows)} of {len(rows)} causes would not be seen in these records, or hardly be "
        f"told from another (D below {tables.CLEAR_FROM:g}).",
        highlight=False,
    )


def _print_unreported(verdict: Verdict, console: Console) -> None:
    """Print which causes these records cannot show, or not distinguish, after those that they do show."""
    hidden = tables.detectable(verdict)
    if not hidden.rows:
        return
    console.print("Not seen in these records, or hardly told from another:", highlight=False)
    console.print(_rich(tables.Table(hidden.header, hidden.rows[:MOST_ROWS]), console.width), highlight=False)
    if len(hidden.rows) > MOST_ROWS:
        console.print(f"… and {len(hidden.rows) - MOST_ROWS} more in the report.", highlight=False)


def print_diagnosis(
    verdict: Verdict,
    output_folder: OutputFolder,
    console: Console | None = None,
    *,
    scenario: str = "SCENARIO",
    output_mode: OutputMode = PLAIN,
) -> None:
    """Print a verdict in words, the questions that remain open, and the paths of the files.

    Args:
        verdict: of `subzero.diagnose`.
        output_folder: where the files are.
        console: where to print.
        scenario: the trial as the user named it, a name or a path, for lines of the shell.
        output_mode: the form of the output.
    """
    with output_mode.emit(json_file.mapping(verdict) | output_folder.files()):
        _print(verdict, output_folder, console or Console(), scenario)


def _print(verdict: Verdict, output_folder: OutputFolder, console: Console, scenario: str) -> None:
    console.print(f"\n[bold]{escape(words.headline(verdict))}[/bold]", highlight=False)
    extended = shlex.quote(printable(str(output_folder.folder / "extended.toml")))
    for answer in summary(verdict, scenario, extended):
        console.print(f"[bold]{answer.question}[/bold]", highlight=False)
        for line in answer.words:
            console.print(Padding(Text(line), (0, 0, 0, 2)))
        if answer.command:
            console.print(f"    {answer.command}", highlight=False, markup=False, soft_wrap=True)
    for note in verdict.notes:
        console.print(note, highlight=False, markup=False)
    if verdict.rivals:
        console.print(_rich(tables.rivals(verdict, short=True), console.width), highlight=False)
    for name, table in tables.gain(verdict, short=True).items():
        console.print(f"Root mean square error, {name}:", highlight=False, markup=False)
        console.print(_rich(table, console.width), highlight=False)
    _print_unreported(verdict, console)
    console.print(output_folder.words(), highlight=False, markup=False)


COLUMN_GAP = 3
"""So many letters stand between two columns, at most."""
SENTENCE_LETTERS = 20
"""Least number of letters in a line of a sentence, if the terminal is wide enough."""


def _rich(table: tables.Table, width: int) -> Table:
    """Return a table for a terminal of a given width: words and ids are not broken, sentences are broken between
    words.

    If the terminal is too narrow for all columns to be readable, the longest ones in the middle are left out; the
    report has them.
    """
    columns = [(name, [row[at] for row in table.rows]) for at, name in enumerate(table.header)]
    while len(columns) > 2 and sum(_readable(*column) + COLUMN_GAP for column in columns) > width:
        columns.remove(max(columns[1:-1], key=lambda column: sum(map(len, column[1]))))
    shown = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name, cells in columns:
        is_one_word = not any(" " in cell for cell in (name, *cells))
        shown.add_column(name, overflow="fold", no_wrap=is_one_word, min_width=_readable(name, cells))
    for row in zip(*(cells for _, cells in columns), strict=True):
        shown.add_row(*map(escape, row))
    return shown


def _readable(name: str, cells: Sequence[str]) -> int:
    """Return how many letters a column needs to be read: its longest word, of sentences a few words a line."""
    longest_word = max((len(word) for cell in (name, *cells) for word in cell.split()), default=1)
    return max(longest_word, min(SENTENCE_LETTERS, max(map(len, (name, *cells)))))


def write_all(
    verdict: Verdict,
    logged: Sequence[Logged],
    output_folder: OutputFolder,
    *,
    run: Run,
    effects: Iterable[Effect] = (),
    effects_file: Path | None = None,
) -> None:
    """Write ``diagnosis.json``, ``extended.toml``, figures, and the report as ``report.md`` and ``report.html``.

    Args:
        verdict: of `subzero.diagnose`.
        logged: the records that were explained.
        output_folder: where to.
        run: simulates the settings that the page replays.
        effects: causes of the user's own.
        effects_file: where they are from.
    """
    output_folder.failed = not verdict.complete
    if effects_file is not None:
        shutil.copyfile(effects_file, output_folder.path / effects_file.name)
    sources = ", ".join(trial.record.source for trial in logged)
    own = effects_file.name if effects_file is not None else None
    known = all_effects(with_own(effects, logged[0].setting.model.vehicle))
    extended = text_of(verdict.extended, logged[0].setting, effects=known, effects_file=own, source=sources)
    _write(output_folder, "extended.toml", extended)
    reported = {trial.name: _about(trial) for trial in logged}
    _write(output_folder, "diagnosis.json", json_file.text(verdict, reported, logged[0].setting.trial.source))
    figures = _draw(verdict, logged, output_folder)
    _write(
        output_folder,
        "report.md",
        markdown(verdict, about(logged), tuple(figures), logged[0].setting.trial.source),
    )
    command = COMMAND.get()
    page = page_of_diagnosis(
        verdict, logged, figures, command=command, run=run, extended_toml=extended, effects=effects
    )
    _write(output_folder, "report.html", page)


def _draw(verdict: Verdict, logged: Sequence[Logged], output_folder: OutputFolder) -> dict[str, Figure]:
    """Draw the figures, write each as a picture, and return them by name."""
    from subzero.figures.diagnosis import draw_diagnosis
    from subzero.figures.style import Title

    names = ", ".join(dict.fromkeys(trial.setting.trial.name for trial in logged))
    records = ", ".join(trial.name for trial in logged)
    title = f"Diagnosis of {records}: {words.headline(verdict)}"
    figures = draw_diagnosis(verdict, Title(words=title, scenario=names))
    write_figures(figures, output_folder)
    return figures


def page_of_diagnosis(
    verdict: Verdict,
    logged: Sequence[Logged],
    figures: Mapping[str, Figure],
    *,
    command: str,
    run: Run,
    extended_toml: str = "",
    effects: Iterable[Effect] = (),
) -> str:
    """Return ``report.html`` of a diagnosis.

    Args:
        verdict: of `subzero.diagnose`.
        logged: the records that were explained; the first one is replayed.
        figures: by name.
        command: the command line that repeats it.
        run: simulates a setting for the replay.
        extended_toml: text of the extended model's file.
        effects: causes of the user's own.
    """
    trials = list(dict.fromkeys(trial.setting.trial.name for trial in logged))
    actors, said = replayed(verdict, logged[0], run, effects)
    return render(
        Report(
            command_name="diagnose",
            scenario=", ".join(trials),
            title=words.title(verdict),
            version=version(DISTRIBUTION),
            outcome=_outcome(verdict, logged),
            command=command,
            answers=[Answer(**trial._asdict()) for trial in summary(verdict, logged[0].setting.trial.source)],
            notes=verdict.notes,
            sections=[
                _section(section, figures)
                for section in sections(verdict, about(logged))
                if _is_there(section, figures)
            ],
            replay=encode(actors, _as_corrected(logged[0].record, verdict, logged[0].name))
            if actors
            else None,
            replay_words=said if actors else "",
            sources=_sources(logged, extended_toml),
        )
    )


def about(logged: Sequence[Logged]) -> dict[str, str]:
    """Return descriptions of the records, each in a line."""
    return {
        trial.name: f"{trial.record.source}, trial {trial.setting.trial.name}. {' '.join(trial.notes)}".strip()
        for trial in logged
    }


def _outcome(verdict: Verdict, logged: Sequence[Logged]) -> list[Line]:
    """Return the verdict, and the trial and records it is about."""
    kind: Any = "good" if verdict.verdict in (NOTHING_WRONG, CAUSE_NAMED) and verdict.complete else "bad"
    records = [
        Line(text=f"{trial.name}: {trial.record.time.size} samples, {len(trial.record.values)} channels")
        for trial in logged
    ]
    return [Line(text=words.headline(verdict), kind=kind), *records]


def _is_there(section: Told, figures: Mapping[str, Figure]) -> bool:
    return bool(section.parts) or any(belongs(name, section) for name in figures)


def _section(section: Told, figures: Mapping[str, Figure]) -> Section:
    """Return a section of the page: a table has the paragraph above it as its title."""
    text: list[str] = []
    shown: list[Rows] = []
    for part in section.parts:
        if isinstance(part, tables.Table):
            title = text.pop().rstrip(":") if text and text[-1].endswith(":") else ""
            shown.append(Rows(title=title, header=part.header, groups=[part.rows], is_of_words=True))
        else:
            text.append(part)
    own = {name: figure for name, figure in figures.items() if belongs(name, section)}
    return Section(title=section.title, text=text, tables=shown, figures=own, is_folded=section.is_folded)


def _sources(logged: Sequence[Logged], extended_toml: str) -> dict[str, str]:
    texts = {
        f"The trial {trial.setting.trial.name}, as it was read": trial.setting.trial.text for trial in logged
    }
    extended = {"The extended model, extended.toml": extended_toml} if extended_toml else {}
    libraries = (DISTRIBUTION, "numpy", "scipy", "numba", "xarray")
    return {**extended, **texts, "Versions": "\n".join(f"{name} {version(name)}" for name in libraries)}


def replayed(
    verdict: Verdict, logged: Logged, run: Run, effects: Iterable[Effect] = ()
) -> tuple[tuple[Actor, ...], str]:
    """Return the actors in the replay of a record, and a sentence about them; no actors if there is nothing to see.

    Args:
        verdict: of the diagnosis; of one that was interrupted there is no replay.
        logged: the record with its nominal setting.
        run: simulates a setting.
        effects: causes of the user's own.
    """
    if not verdict.complete:
        return (), ""
    known = all_effects(with_own(effects, logged.setting.model.vehicle))
    name, extended = _best(verdict)
    nominal = run(logged.setting)
    if not can_be_replayed(nominal):
        return (), ""
    best = run(apply_extended(extended, logged.setting, known)) if extended is not None else None
    found = [Actor(name=name, run=best)] if best is not None and best.sizes["time"] > 1 else []
    found.append(Actor(name="simulated", run=nominal, ghost=bool(found)))
    said = f"{logged.name}. " + (f"Solid: the {name}. " if len(found) > 1 else "")
    curves = verdict.curves.get(logged.name)
    record = _as_corrected(logged.record, verdict, logged.name)
    measured = as_run(record, nominal, curves.used if curves is not None else {})
    if measured is not None:
        found.append(Actor(name="measured", run=measured, ghost=True))
        said += (
            f"White: the vehicle as the record has it{', its errors put right' if verdict.then else ''}; where it does "
            "not say the place, that is reckoned from its speed and attitude. "
        )
    said += "Orange: the simulation as it was. " if found[0].name != "simulated" else ""
    return tuple(found), f"{said}A run is what is; what sensors make of it (shifts, lags) is not in it."


def _as_corrected(record: Record, verdict: Verdict, name: str) -> Record:
    """Return a record as figures and words have it: with the errors in its data put right, if there are any."""
    curves = verdict.curves.get(name)
    if not verdict.then or curves is None:
        return record
    return dataclasses.replace(record, time=curves.time, values=dict(curves.measured))


def _best(verdict: Verdict) -> tuple[str, Extended | None]:
    """Return the model that explains the records best, as the figures have it, and its name."""
    extended = verdict.extended
    if verdict.on_model in (CAUSE_NAMED, OUT_OF_CATALOGUE):
        return "extended model", extended
    first = verdict.rivals[0] if verdict.on_model == UNDECIDED and verdict.rivals else None
    if first is not None and first.ids and first.extended is not None:
        return "most probable model", first.extended
    return ("calibrated model", extended) if extended.calibration else ("", None)


def _about(trial: Logged) -> dict[str, object]:
    """Return the entry of a record in diagnosis.json."""
    return {
        "source": trial.record.source,
        "scenario": trial.setting.trial.name,
        "tethered": trial.setting.tethered,
        "channels": list(trial.record.values),
        "samples": int(trial.record.time.size),
        "duration_s": float(trial.record.time[-1]),
        "notes": list(trial.notes),
    }


def _write(output_folder: OutputFolder, name: str, text: str) -> None:
    (output_folder.path / name).write_text(text, encoding="utf-8")
