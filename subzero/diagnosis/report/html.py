"""The report of a diagnosis: one text, as Markdown and as a page that stands alone, its figures inside."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape

from subzero.diagnosis.report import tables, words
from subzero.diagnosis.results import CAUSE_NAMED, OUTSIDE, UNDECIDED, Gain, Misfit, Verdict

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 2rem; border-bottom: 1px solid #e3e3e3; }
table { border-collapse: collapse; font-size: 0.85rem; display: block; overflow-x: auto; }
th, td { padding: 0.2rem 0.7rem 0.2rem 0; text-align: left; vertical-align: top; }
th { border-bottom: 1px solid #8a8a8a; font-weight: 600; }
tr:nth-child(even) td { background: #f7f7f7; }
img { max-width: 100%; height: auto; } code { background: #f2f2f2; padding: 0 0.2rem; }
"""

FIGURES = {
    "misfit": "What is wrong",
    "evidence": "The cause",
    "rivals": "The cause",
    "detectable": "What these records could show",
    "gain": "The gain",
    "missing_force": "What no cause explains",
}
"""Start of a figure's name → the section it stands in."""


def markdown(verdict: Verdict, records: Mapping[str, str], figures: Sequence[str] = ()) -> str:
    """Return the report as Markdown.

    Args:
        verdict: of `subzero.diagnose`.
        records: name → what it is, in a line.
        figures: names of the figures beside it, without their ending.
    """
    lines = [f"# {words.headline(verdict)}", ""]
    lines += [line for told in words.story(verdict) for line in (_escaped(told), "")]
    for title, body in _sections(verdict, records).items():
        shown = [f"![{name}]({name}.png)" for name in figures if _section_of(name) == title]
        if body or shown:
            lines += [f"## {title}", "", *body, *(line for one in shown for line in (one, ""))]
    return "\n".join(lines).rstrip() + "\n"


def page(text: str, figures: Mapping[str, bytes], title: str) -> str:
    """Return Markdown as an HTML page with its figures inside.

    Args:
        text: of `markdown`.
        figures: name → PNG.
        title: of the page.
    """
    from markdown_it import MarkdownIt

    body = str(MarkdownIt("commonmark", {"html": False}).enable("table").render(text))
    for name, png in figures.items():
        inside = f"data:image/png;base64,{base64.b64encode(png).decode()}"
        body = body.replace(f'src="{name}.png"', f'src="{inside}"')
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{STYLE}</style>'
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}</body></html>\n'


def _section_of(figure: str) -> str:
    return next((title for start, title in FIGURES.items() if figure.startswith(start)), "What is wrong")


def _sections(verdict: Verdict, records: Mapping[str, str]) -> dict[str, list[str]]:
    """Return the sections by title, in the order in which one reads them: the long table behind what was found."""
    return {
        "What is wrong": _misfit(verdict, records),
        "The cause": _cause(verdict),
        "What no cause explains": _missing(verdict),
        "The gain": _gain(verdict),
        "The extended model": _extended(verdict),
        "What these records could show": _detectable(verdict),
        "How it was found": _how(verdict),
    }


def _detectable(verdict: Verdict) -> list[str]:
    if not verdict.detectable:
        return []
    return [
        "Known before anything was compared. *Signal*: what a cause of its usual size does, in noise and tolerances; "
        f"below {tables.SEEN_SIGNAL:g} it is not seen. *D*: squared distance to the cause that looks most alike, all "
        f"tolerances free; below {tables.CONFUSED_BELOW:g} the two cannot be told apart, from "
        f"{tables.CLEAR_FROM:g} on they can.",
        "",
        *table(tables.detectable(verdict, every=True)),
    ]


def _misfit(verdict: Verdict, records: Mapping[str, str]) -> list[str]:
    lines = []
    for name, rows in verdict.misfit.items():
        lines += [f"**{_escaped(name)}** {_escaped(records.get(name, ''))}".strip(), ""]
        lines += table(tables.misfit(rows))
        lines += [f"Noise: {_noise(rows)}.", ""]
    return lines


def _noise(rows: Mapping[str, Misfit]) -> str:
    """Return the noise of the channels: its level, its slow part, the step of its values, outliers and gaps."""
    return "; ".join(f"{name} {_parts(one)}" for name, one in rows.items())


def _parts(one: Misfit) -> str:
    rounded = f", rounded to {one.resolution:.3g}" if one.resolution > 0.0 else ""
    return (
        f"{one.noise_sd:.3g} (of that slow {one.noise_slow:.2g}, over {one.noise_time:.2g} s{rounded}; "
        f"outliers {one.outliers}, gaps {one.gaps})"
    )


def _cause(verdict: Verdict) -> list[str]:
    lines = [line for one in verdict.causes for line in (_escaped(words.cause(one)), "")]
    if verdict.rivals:
        undecided = verdict.on_model == UNDECIDED
        what = "What the records allow" if undecided else "What else the records allow"
        beside = "what is most probable" if undecided else "what is told"
        lines += [f"{what} (D: how far from {beside}):", "", *table(tables.rivals(verdict))]
    return lines


def _missing(verdict: Verdict) -> list[str]:
    return [] if verdict.unknown is None else [_escaped(words.unknown(verdict.unknown)), ""]


def _gain(verdict: Verdict) -> list[str]:
    lines = [line for name, one in tables.gain(verdict).items()
             for line in (f"Root mean square error, {name}:", "", *table(one))]  # fmt: skip
    if verdict.gain:
        total, owed, low = (f"{100.0 * share:.1f} %" for share in _shares(verdict.gain))
        lines += [
            f"Of all that can be explained {total} is (0 the nominal model, 100 % the noise). Owed to the new physics, "
            f"beyond a refit within tolerance: {owed} (95 % sure of {low}).",
            "",
        ]
    return lines


def _shares(gain: Gain) -> tuple[float, float, float]:
    return gain.total, gain.owed, gain.owed_low


def _extended(verdict: Verdict) -> list[str]:
    drifts = verdict.unknown is not None and verdict.unknown.is_drift
    new = verdict.on_model in (CAUSE_NAMED, OUTSIDE) and (not drifts or bool(verdict.extended.deviations))
    what = (
        "the extended model"
        if new
        else "the model as calibrated within its tolerances, with nothing new in it"
    )
    return [f"`extended.toml` is {what}: `subzero simulate SCENARIO --with extended.toml`.", ""]


def _how(verdict: Verdict) -> list[str]:
    lines = []
    if verdict.tolerance_scale:
        scales = ", ".join(f"{scale:g}: {p:.2f}" for scale, p in verdict.tolerance_scale.items())
        lines += [f"Probability that the tolerances are so many times as declared: {scales}.", ""]
    strained = [
        f"{name} {mean:+.1f} ± {sd:.1f}" for name, (mean, sd) in verdict.deviations.items() if abs(mean) > 2.0
    ]
    if strained:
        lines += [f"Parameters beyond two tolerances: {_escaped(', '.join(strained))}.", ""]
    spent = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in verdict.seconds.items())
    return [*lines, f"Seed {verdict.seed}{f'; {spent}' if spent else ''}."]


def table(one: tables.Table) -> list[str]:
    """Return a table as Markdown, with an empty line below it."""
    rows = [one.header, ("---",) * len(one.header), *one.rows]
    return [
        *(f"| {' | '.join(_escaped(cell) if row != rows[1] else cell for cell in row)} |" for row in rows),
        "",
    ]


def _escaped(text: str) -> str:
    """Return a text that Markdown shows as it is."""
    return "".join(f"\\{letter}" if letter in "\\`*_{}[]<>#|" else letter for letter in text)
