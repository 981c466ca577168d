"""``report.html`` of a sweep: in a few sentences the parameters, the outcomes and the main effects; then all of it.

The tables are those of the terminal (`subzero.cli.write_sweep`), from the numbers of ``summary.json``.
"""

from __future__ import annotations

import sys
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from subzero.page.report import Answer, Drawn, Line, Report, Section, Table, render
from subzero.sweeps.outcomes import in_words
from subzero.sweeps.result import TABLE
from subzero.sweeps.sensitivity import description_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from subzero.sweeps.plan import Plan

Summary = dict[str, Any]
"""Of `subzero.cli.write_sweep.summary_of`."""

COLUMNS = {
    "min": "min",
    "p5": "5 %",
    "p50": "median",
    "p95": "95 %",
    "max": "max",
    "mean": "mean",
    "standard_deviation": "deviation",
}
"""Statistics of a scalar, and their names."""
SHOWN_EFFECTS = 5
"""Number of parameters that are named for each scalar. [-]"""
IN_WORDS = 4
"""Number of parameters or scalars with a sentence of their own; the tables have all of them. [-]"""
NOTHING = "–"
LIBRARIES = ("numpy", "numba", "scipy", "xarray")


def page_of_sweep(plan: Plan, summary: Summary, figures: Mapping[str, Drawn], command: str) -> str:
    """Return ``report.html`` of a finished sweep.

    Args:
        plan: the sweep.
        summary: its numbers.
        figures: by name.
        command: the line that does it again.
    """
    return render(
        Report(
            command_name="sweep",
            scenario=summary["scenario"],
            title=summary["title"],
            version=summary["subzero_version"],
            outcome=_outcome(summary),
            command=command,
            answers=_answers(summary),
            warnings={"Members": list(warning_lines(summary))} if summary["warnings"] else {},
            sections=_sections(summary, figures),
            sources={
                **({"The sweep's file, as it was read": plan.text} if plan.text else {}),
                "The trial, as it was read": plan.job.trial.text,
                "Versions": _versions(summary),
            },
        )
    )


def numbers(summary: Summary) -> Table:
    """Return the statistics of all scalars."""
    rows = [
        (f"{scalar}{_bracket(row['unit'])}", *(f"{row[name]:.4g}" for name in COLUMNS))
        for scalar, row in summary["scalars"].items()
    ]
    header = (f"{summary['members'] - summary['failed']} members", *COLUMNS.values())
    return Table(title="Numbers", header=header, groups=[rows])


def what_matters(summary: Summary) -> Table:
    """Return the parameters that move each scalar most: a group of rows for each."""
    method, *columns = description_of(summary["design"]["name"])
    columns = [column for column in columns if column]
    groups = []
    for scalar in summary["scalars"]:
        own = _effects(summary, scalar)[:SHOWN_EFFECTS]
        sizes = [[row["size"], row["other"]][: len(columns)] for row in own]
        groups.append(
            [
                (scalar if i == 0 else "", row["parameter"], *map(_cell, size))
                for i, (row, size) in enumerate(zip(own, sizes, strict=True))
            ]
        )
    return Table(
        title=f"What matters: {method}",
        header=("number", "parameter", *columns),
        groups=[group for group in groups if group],
        is_of_words=True,
    )


def warning_lines(summary: Summary) -> list[str]:
    """Return the warnings of members' runs."""
    return [
        f"{count} of {summary['members']} members' runs warn of {check.replace('_', ' ')}."
        for check, count in summary["warnings"].items()
    ]


def _effects(summary: Summary, scalar: str) -> list[Summary]:
    """Return the parameters that move a scalar, the one of greatest effect first."""
    return [row for row in summary["sensitivity"]["effects"] if row["scalar"] == scalar]


def _cell(value: float | None) -> str:
    return NOTHING if value is None else f"{value:.3g}"


def _with_unit(value: float, unit: str) -> str:
    return f"{value:.4g}" if unit in ("", "1") else f"{value:.4g} {unit}"


def _bracket(unit: str) -> str:
    return "" if unit in ("", "1") else f" [{unit}]"


def _outcome(summary: Summary) -> list[Line]:
    members, failed, warned = summary["members"], summary["failed"], len(summary["warnings"])
    lines = [
        Line(text=f"{members - failed} of {members} members completed", kind="bad" if failed else "good")
    ]
    return (
        [*lines, Line(text=f"warnings of {warned} kind{'s' if warned > 1 else ''}", kind="bad")]
        if warned
        else lines
    )


def _answers(summary: Summary) -> list[Answer]:
    """Return in words the parameters, the outcomes and the main effects."""
    found = [Answer(question="What was varied", words=_varied(summary))]
    if summary["scalars"]:
        found.append(Answer(question="What came out", words=_outcome_lines(summary)))
    if summary["sensitivity"]["effects"]:
        found.append(Answer(question="What matters most", words=_matters(summary)))
    return found


def _varied(summary: Summary) -> list[str]:
    design, parameters = summary["design"], summary["parameters"]
    spans = [
        f"{name} from {parameter['from']:.4g} to {_with_unit(parameter['to'], parameter['unit'])}"
        for name, parameter in parameters.items()
    ]
    more = f"; and {len(spans) - IN_WORDS} more parameters" if len(spans) > IN_WORDS else ""
    return [
        f"{'; '.join(spans[:IN_WORDS])}{more}.",
        f"{summary['members']} members, {design['name'].replace('_', ' ')}, seed {design['seed']}.",
    ]


def _outcome_lines(summary: Summary) -> list[str]:
    """Return of some scalars where most members lie."""
    return [
        f"{in_words(name).capitalize()}: {_with_unit(row['p50'], row['unit'])} in the middle; "
        f"nine of ten members lie between {row['p5']:.4g} and {row['p95']:.4g}."
        for name, row in list(summary["scalars"].items())[:IN_WORDS]
    ]


def _matters(summary: Summary) -> list[str]:
    """Return of some scalars which parameter moves it most, and how much by the design's own measure."""
    method, first, _ = description_of(summary["design"]["name"])
    most = {scalar: _effects(summary, scalar)[:1] for scalar in list(summary["scalars"])[:IN_WORDS]}
    return [
        f"{in_words(scalar).capitalize()}: {own[0]['parameter']} ({first} {own[0]['size']:.3g})."
        for scalar, own in most.items()
        if own and own[0]["size"] is not None
    ] or [f"No parameter moves these numbers ({method})."]


def _sections(summary: Summary, figures: Mapping[str, Drawn]) -> list[Section]:
    effects = bool(summary["sensitivity"]["effects"])
    tornado = {name: figure for name, figure in figures.items() if name == "tornado"}
    others = {name: figure for name, figure in figures.items() if name != "tornado"}
    matters = Section(
        title="What matters", tables=[what_matters(summary)] if effects else (), figures=tornado
    )
    found = [
        Section(title="Numbers", tables=[numbers(summary)]),
        *([matters] if effects or tornado else []),
        Section(title="Figures", figures=others),
    ]
    return [*([_failures(summary)] if summary["failed"] else []), *found]


def _failures(summary: Summary) -> Section:
    """Return the members that could not go on, each with its reason."""
    rows = [(f"member {member}", " ".join(reason.split())) for member, reason in summary["reasons"].items()]
    more = summary["failed"] - len(rows)
    text = [f"{more} more stand in {TABLE}."] if more > 0 else []
    table = Table(title="", header=("", "why it could not go on"), groups=[rows], is_of_words=True)
    return Section(title=f"{summary['failed']} members failed", text=text, tables=[table])


def _versions(summary: Summary) -> str:
    rows = {"subzero": summary["subzero_version"], "python": sys.version.split()[0]}
    return "\n".join(
        f"{name} {number}" for name, number in (rows | {row: version(row) for row in LIBRARIES}).items()
    )
