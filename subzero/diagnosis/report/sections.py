"""The report of a diagnosis: answers in words, sections of paragraphs, tables and figures; and all of it as Markdown.

``report.html`` and ``report.md`` are made of the same sections, so that they cannot say different things.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from subzero.diagnosis.report import tables, words
from subzero.diagnosis.report.summary import summary
from subzero.diagnosis.results import CAUSE_NAMED, OUT_OF_CATALOGUE, UNDECIDED, Gain, Misfit, Verdict


class Section(NamedTuple):
    """A part of a report: paragraphs and tables as they follow one another, and the kinds of figures that belong to
    it.

    A section that `is_folded` is for readers who want to know how the verdict was found.
    """

    title: str
    parts: list[str | tables.Table]
    figures: tuple[str, ...] = ()
    is_folded: bool = False


def sections(verdict: Verdict, records: Mapping[str, str]) -> list[Section]:
    """Return the sections that are not empty, in the order of reading.

    Args:
        verdict: of `subzero.diagnose`.
        records: name → description, in a line.
    """
    return [
        Section("What explains the records", _explanations(verdict), ("evidence", "rivals")),
        Section("What no cause explains", _missing(verdict), ("missing_force",)),
        Section("Measured and simulated", _misfit(verdict, records), ("misfit",)),
        Section("The gain", _gain(verdict), ("gain",)),
        Section("The next trial", _next_trial(verdict)),
        Section("The extended model", _extended(verdict)),
        Section("What these records could show", _detectable(verdict), ("detectable",), is_folded=True),
        Section("How it was found", _how(verdict), is_folded=True),
    ]


def belongs(figure: str, section: Section) -> bool:
    """Say whether a figure belongs to a section: by its kind, to which the name of a record may be added."""
    return any(figure == kind or figure.startswith(f"{kind}_") for kind in section.figures)


def _explanations(verdict: Verdict) -> list[str | tables.Table]:
    parts: list[str | tables.Table] = [words.cause(cause) for cause in verdict.causes]
    if verdict.rivals:
        undecided = verdict.on_model == UNDECIDED
        what = "What the records allow" if undecided else "What else the records allow"
        reference = "what is most probable" if undecided else "the reported one"
        parts += [f"{what} (D: how far from {reference}):", tables.rivals(verdict)]
    return parts


def _missing(verdict: Verdict) -> list[str | tables.Table]:
    return [] if verdict.unknown is None else [words.unknown(verdict.unknown)]


def _misfit(verdict: Verdict, records: Mapping[str, str]) -> list[str | tables.Table]:
    parts: list[str | tables.Table] = []
    for name, rows in verdict.misfit.items():
        parts += [
            f"{name}: {records.get(name, '')}".strip(": "),
            tables.misfit(rows),
            f"Noise: {_noise(rows)}.",
        ]
    return parts


def _noise(rows: Mapping[str, Misfit]) -> str:
    """Return the noise of the channels: its level, its slow part, the step of its values, outliers and gaps."""
    return "; ".join(f"{name.replace('_', ' ')} {_parts(row)}" for name, row in rows.items())


def _parts(misfit: Misfit) -> str:
    rounded = f", rounded to {misfit.resolution:.3g}" if misfit.resolution > 0.0 else ""
    return (
        f"{misfit.noise_sd:.3g} (of that slow {misfit.noise_slow:.2g}, over {misfit.noise_time:.2g} s{rounded}; "
        f"outliers {misfit.outliers}, gaps {misfit.gaps})"
    )


def _gain(verdict: Verdict) -> list[str | tables.Table]:
    parts: list[str | tables.Table] = []
    for name, each in tables.gain(verdict).items():
        parts += [f"Root mean square error, {name}:", each]
    if verdict.gain:
        total, owed, low = (f"{100.0 * share:.1f} %" for share in _shares(verdict.gain))
        parts.append(
            f"Of all that can be explained {total} is (0 the nominal model, 100 % the noise). Owed to the new physics, "
            f"beyond a refit within tolerance: {owed} (95 % sure of {low})."
        )
    return parts


def _shares(gain: Gain) -> tuple[float, float, float]:
    return gain.total, gain.owed, gain.owed_low


def _next_trial(verdict: Verdict) -> list[str | tables.Table]:
    if verdict.next_trial is None:
        return []
    return [words.next_trial(verdict.next_trial), *filter(None, [tables.next_trial(verdict.next_trial)])]


def _extended(verdict: Verdict) -> list[str | tables.Table]:
    drifts = verdict.unknown is not None and verdict.unknown.is_drift
    new = verdict.on_model in (CAUSE_NAMED, OUT_OF_CATALOGUE) and (
        not drifts or bool(verdict.extended.deviations)
    )
    what = "the extended model" if new else _fitted(verdict)
    return [f"extended.toml is {what}: subzero simulate SCENARIO --with extended.toml."]


def _fitted(verdict: Verdict) -> str:
    """Return, for a diagnosis that names nothing, how far the numbers of its model deviate from the nominal ones."""
    farthest = max(verdict.deviations, key=lambda name: abs(verdict.deviations[name][0]), default="")
    if not farthest:
        return "the nominal model"
    size = abs(verdict.deviations[farthest][0])
    return f"the model as it fits best, with no cause in it: {farthest} is bent farthest, by {size:.2g} tolerances"


def _detectable(verdict: Verdict) -> list[str | tables.Table]:
    if not verdict.detectable:
        return []
    return [
        "Known before anything was compared. Signal: what a cause of its usual size does, in noise and tolerances; "
        f"below {tables.SEEN_SIGNAL:g} it is not seen. D: squared distance to the cause that looks most alike, all "
        f"tolerances free; below {tables.CONFUSED_BELOW:g} the two cannot be told apart, from "
        f"{tables.CLEAR_FROM:g} on they can.",
        tables.detectable(verdict, every=True),
    ]


def _how(verdict: Verdict) -> list[str | tables.Table]:
    parts: list[str | tables.Table] = []
    if verdict.tolerance_scale:
        scales = ", ".join(f"{scale:g}: {p:.2f}" for scale, p in verdict.tolerance_scale.items())
        parts.append(f"Probability that the tolerances are so many times as declared: {scales}.")
    strained = [
        f"{name} {mean:+.1f} ± {sd:.1f}" for name, (mean, sd) in verdict.deviations.items() if abs(mean) > 2.0
    ]
    if strained:
        parts.append(f"Parameters beyond two tolerances: {', '.join(strained)}.")
    spent = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in verdict.seconds.items())
    return [*parts, f"Seed {verdict.seed}{f'; {spent}' if spent else ''}."]


def markdown(
    verdict: Verdict, records: Mapping[str, str], figures: Sequence[str] = (), scenario: str = "SCENARIO"
) -> str:
    """Return the report as Markdown.

    Args:
        verdict: of `subzero.diagnose`.
        records: name → description, in a line.
        figures: names of the figures in the same folder, without their ending.
        scenario: the trial as the user named it, a name or a path, for lines of the shell.
    """
    lines = [f"# {words.headline(verdict)}", ""]
    for answer in summary(verdict, scenario):
        lines += [f"## {answer.question}", "", *_paragraphs(answer.words)]
        lines += [f"    {answer.command}", ""] if answer.command else []
    lines += _paragraphs(verdict.notes)
    for section in sections(verdict, records):
        shown = [f"![{name}]({name}.png)" for name in figures if belongs(name, section)]
        if section.parts or shown:
            lines += [f"## {section.title}", ""]
            for part in section.parts:
                lines += table(part) if isinstance(part, tables.Table) else _paragraphs([part])
            lines += [line for each in shown for line in (each, "")]
    return "\n".join(lines).rstrip() + "\n"


def _paragraphs(texts: Sequence[str]) -> list[str]:
    return [line for text in texts for line in (_escaped(text), "")]


def table(table: tables.Table) -> list[str]:
    """Return a table as Markdown, followed by an empty line."""
    rows = [table.header, ("---",) * len(table.header), *table.rows]
    return [
        *(f"| {' | '.join(_escaped(cell) if row != rows[1] else cell for cell in row)} |" for row in rows),
        "",
    ]


def _escaped(text: str) -> str:
    """Return a text that Markdown shows as it is."""
    return "".join(f"\\{letter}" if letter in "\\`*_{}[]<>#|$&" else letter for letter in text)
