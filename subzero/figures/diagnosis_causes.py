"""Figures of a diagnosis: how probable the causes are, which look alike, and what the extended model gains."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from subzero.channels import BY_NAME
from subzero.diagnosis.report.tables import CLEAR_FROM, CONFUSED_BELOW, SEEN_SIGNAL
from subzero.diagnosis.results import ChannelGain, Verdict
from subzero.figures import style
from subzero.figures.panel import headline, legend
from subzero.figures.sheet import Title, sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST = 10
"""So many hypotheses are shown."""

LEAST = 1e-4
"""Probabilities below this are not shown."""

FLOOR = 0.05
"""Where the logarithmic axis of D begins."""

GAINS = {
    "before": (style.ORANGE, "nominal"),
    "tolerance": (style.AMBER, "refit within tolerance"),
    "rival": (style.GREEN, "best rival"),
    "after": (style.BLUE, "extended"),
}
"""Errors of a channel → colour and words; the floor is a line."""


def evidence(verdict: Verdict, title: Title) -> Figure | None:
    """Draw how probable every hypothesis is: on a linear axis, and on a logarithmic one for the small ones."""
    ranked = sorted(verdict.probabilities.items(), key=lambda item: -item[1])[:MOST]
    ranked = [(name, p) for name, p in ranked if p >= LEAST]
    if not ranked:
        return None
    figure, (plain, logarithmic) = _bars(2, len(ranked), title, left=0.34, apart=0.12)
    named = " + ".join(sorted(cause.id for cause in verdict.causes))
    colours = [style.BLUE if _sorted(name) == named else style.GREY for name, _ in ranked]
    for axes in (plain, logarithmic):
        axes.barh(range(len(ranked)), [p for _, p in ranked], color=colours, height=0.65)
        axes.set_xlabel("probability", fontsize=style.NORMAL)
    _names(plain, [name.replace(" + ", " +\n") for name, _ in ranked])
    plain.set_xlim(0.0, 1.0)
    headline(plain, "Probability of each")
    logarithmic.set_xscale("log")
    logarithmic.set_xlim(LEAST, 1.3)
    _names(logarithmic, [""] * len(ranked))
    headline(logarithmic, "The same, for the small ones")
    return figure


def detectable(verdict: Verdict, title: Title) -> Figure | None:
    """Draw signal and discrimination of every cause, the least distinct one on top."""
    rows = sorted(verdict.detectable, key=lambda one: one.discrimination)
    if not rows:
        return None
    figure, (signal, apart) = _bars(2, len(rows), title)
    size = [max(one.signal, FLOOR) for one in rows]
    signal.barh(
        range(len(rows)),
        size,
        color=[style.GREY if s < SEEN_SIGNAL else style.BLUE for s in size],
        height=0.65,
    )
    signal.axvline(SEEN_SIGNAL, color=style.INK, linewidth=0.8, linestyle=style.DASHES[1])
    signal.set_xlabel("signal, in noise and tolerances", fontsize=style.NORMAL)
    headline(signal, f"Seen from {SEEN_SIGNAL:g} on (usual size)")
    far = [max(one.discrimination, FLOOR) for one in rows]
    apart.barh(range(len(rows)), far, color=[_verdict_colour(one) for one in far], height=0.65)
    for limit in (CONFUSED_BELOW, CLEAR_FROM):
        apart.axvline(limit, color=style.INK, linewidth=0.8, linestyle=style.DASHES[1])
    apart.set_xlabel("D", fontsize=style.NORMAL)
    headline(apart, f"Told apart from {CLEAR_FROM:g} on")
    for axes, words in ((signal, [one.id for one in rows]), (apart, [f"/ {one.rival}" for one in rows])):
        axes.set_xscale("log")
        axes.set_xlim(left=FLOOR)
        _names(axes, words)
    return figure


def gain(verdict: Verdict, title: Title) -> Figure | None:
    """Draw errors before and after by channel, in units of the noise floor: held out, and fitted."""
    if verdict.gain is None:
        return None
    parts = {f"Not fitted: {verdict.gain.how}": verdict.gain.held_out, "Fitted": verdict.gain.fitted}
    parts = {words: rows for words, rows in parts.items() if rows}
    figure, panels = sheet(len(parts), 1, title)
    top = max(_high(rows) for rows in parts.values())
    for axes, (words, rows) in zip(panels, parts.items(), strict=True):
        _gain_bars(axes, rows)
        axes.set_ylim(0.5, 1.4 * top)
        headline(axes, words)
    legend(panels[0], columns=4)
    return figure


def _gain_bars(axes: Axes, rows: Mapping[str, ChannelGain]) -> None:
    width = 0.8 / len(GAINS)
    for at, (key, (colour, words)) in enumerate(GAINS.items()):
        heights = [getattr(row, key) / row.floor for row in rows.values()]
        places = np.arange(len(rows)) + (at - 0.5 * (len(GAINS) - 1)) * width
        axes.bar(places, heights, width, color=colour, label=words)
    axes.axhline(1.0, color=style.INK, linewidth=0.9, linestyle=style.DASHES[1])
    axes.set_yscale("log")
    axes.set_xticks(range(len(rows)), [_words(name) for name in rows], fontsize=style.SMALL)
    axes.set_ylabel("RMS error / noise floor", fontsize=style.NORMAL)


def _high(rows: Mapping[str, ChannelGain]) -> float:
    """Return the largest error, in noise floors."""
    found = [getattr(row, key) / row.floor for row in rows.values() for key in GAINS]
    return max([1.0, *(one for one in found if np.isfinite(one))])


def _words(name: str) -> str:
    return (BY_NAME[name].name if name in BY_NAME else name).replace("_", " ")


def _verdict_colour(discrimination: float) -> str:
    if discrimination < CONFUSED_BELOW:
        return style.ORANGE
    return style.AMBER if discrimination < CLEAR_FROM else style.BLUE


def _sorted(name: str) -> str:
    return " + ".join(sorted(name.split(" + ")))


def _bars(
    columns: int, rows: int, title: Title, *, left: float = 0.2, apart: float = 0.72
) -> tuple[Figure, list[Axes]]:
    """Return a sheet for horizontal bars, as high as they need, with room for their names."""
    from subzero.figures.sheet import BOTTOM, TOP, WIDTH

    figure, panels = sheet(1, columns, title)
    height = TOP + 0.4 + BOTTOM + 0.17 * max(rows, 3)
    figure.set_size_inches(WIDTH, height)
    figure.subplots_adjust(left=left, wspace=apart, bottom=BOTTOM / height, top=1.0 - (TOP + 0.2) / height)
    for text in figure.texts:
        text.set_y(1.0 - 0.09 / height)
    figure.texts[0].set_x(0.02)
    return figure, panels


def _names(axes: Axes, names: list[str]) -> None:
    axes.set_yticks(range(len(names)), names, fontsize=style.TINY)
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    axes.set_ylim(len(names) - 0.4, -0.6)
