"""The page of some runs of one trial, made from their results."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from subzero.page.replay import actors_of, can_be_replayed, encode
from subzero.page.report import Line, Report, Section, Table, render
from subzero.results.tables import NOTHING, RUNS, fit_rows, index_in_words, number_groups

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray as xr
    from matplotlib.figure import Figure

    from subzero.records.record import Record


def page_of_runs(
    runs: dict[str, xr.Dataset],
    summary: dict[str, Any],
    figures: Mapping[str, Figure],
    *,
    command: str,
    record: Record | None = None,
) -> str:
    """Return ``report.html`` of some runs.

    Args:
        runs: runs by name; the first one is followed by the camera, the others are ghosts.
        summary: of `subzero.results.summary.summary_of`, perhaps with ``indices`` of each run.
        figures: by name.
        command: the line that makes them again.
        record: the measured record.
    """
    first = next(iter(runs.values()))
    labels = [label for label in RUNS if label in summary]
    return render(
        Report(
            command_name=[*command.split(), "", ""][1],
            scenario=summary["scenario"],
            title=summary["title"],
            version=summary["subzero_version"],
            outcome=[line for label in labels for line in _outcome(label, summary[label])],
            command=command,
            warnings=_warnings(summary, labels),
            notes=[f"{label} run: {each['message']}" for label in labels for each in summary[label]["notes"]],
            sections=_sections(_tables(summary, labels), figures),
            replay=encode(actors_of(runs), record) if can_be_replayed(first) else None,
            sources=_sources(first),
        )
    )


def _outcome(label: str, run: dict[str, Any]) -> list[Line]:
    """Return the headlines of a run."""
    is_complete = run["outcome"] == "completed"
    end = NOTHING if run["time_at_end_s"] is None else f"{run['time_at_end_s']:g} s"
    message = "" if is_complete else f": {run['outcome_message']}"
    lines = [Line(text=f"{label}: {run['outcome']} at {end}{message}", kind="good" if is_complete else "bad")]
    count = len(run["warnings"])
    words = f"{label}: {count} warning{'s' if count > 1 else ''}"
    return [*lines, Line(text=words, kind="bad")] if count else lines


def _warnings(summary: dict[str, Any], labels: list[str]) -> dict[str, list[str]]:
    """Return the warnings of the runs that have some."""
    return {
        f"{label} run": [each["message"] for each in summary[label]["warnings"]]
        for label in labels
        if summary[label]["warnings"]
    }


def _sections(tables: list[Table], figures: Mapping[str, Figure]) -> list[Section]:
    """Return the numbers, each table a section of its own, and the figures after them."""
    numbers = [Section(title=table.title, tables=[table]) for table in tables]
    return [*numbers, Section(title="Figures", figures=figures)] if figures else numbers


def _tables(summary: dict[str, Any], labels: list[str]) -> list[Table]:
    """Return the numbers: indices of a manoeuvre, the headlines, and how well a record is explained."""
    tables = [Table(title="Numbers", header=("", *labels), groups=number_groups(summary))]
    if all("indices" in summary[label] for label in labels):
        tables.insert(0, Table(title="Indices", header=("", *labels), groups=[_indices(summary, labels)]))
    if summary["measured"] is not None:
        header = ("channel", "run", "samples", "RMSE", "bias", "fit %")
        title = f"Model − measured, {summary['measured']['source']}"
        tables.append(Table(title=title, header=header, groups=[fit_rows(summary["measured"])]))
    return tables


def _indices(summary: dict[str, Any], labels: list[str]) -> list[tuple[str, ...]]:
    """Return the rows of the indices of a manoeuvre; a number that does not exist is a dash."""

    def cell(value: float | None) -> str:
        return NOTHING if value is None else f"{value:.4g}"

    names = summary[labels[0]]["indices"]
    return [
        (index_in_words(name), *(cell(summary[label]["indices"].get(name)) for label in labels))
        for name in names
    ]


def _sources(run: xr.Dataset) -> dict[str, str]:
    """Return the provenance of a run: the scenario as it was read, all parameters, the versions of the libraries."""
    parameters = json.dumps(json.loads(run.attrs["parameters"]), indent=2, ensure_ascii=False)
    versions = {"subzero": run.attrs["subzero_version"], **json.loads(run.attrs["versions"])}
    return {
        "The scenario, as it was read": run.attrs["scenario_text"],
        "All parameters (SI, radians)": parameters,
        "Versions": "\n".join(f"{name} {number}" for name, number in versions.items()),
    }
