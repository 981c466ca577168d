"""Figure of a diagnosis: the force that no catalogued cause explains, over time with its band, and its formula."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from subzero.diagnosis.report.words import formula_term
from subzero.diagnosis.results import Unknown, Verdict
from subzero.figures import style
from subzero.figures.panel import headline, label, time_label
from subzero.figures.sheet import Title, sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

AXES = {
    "X": "Force, forward",
    "Y": "Force, to starboard",
    "Z": "Force, down",
    "K": "Roll moment, positive to starboard",
    "M": "Pitch moment, positive nose up",
    "N": "Yaw moment, positive to starboard",
}


def missing_force(verdict: Verdict, title: Title) -> Figure | None:
    """Draw the missing force with its 95 % band; the formula in words below the headline."""
    unknown = verdict.unknown
    if unknown is None:
        return None
    figure, (axes,) = sheet(1, 1, title)
    figure.set_size_inches(figure.get_figwidth(), 3.6)
    figure.subplots_adjust(bottom=0.13, top=0.87)
    low, high = unknown.force - 1.96 * unknown.band, unknown.force + 1.96 * unknown.band
    axes.fill_between(unknown.time, low, high, color=style.SKY, alpha=0.4, linewidth=0, label="95 %")
    axes.plot(
        unknown.time,
        unknown.force,
        color=style.BLUE,
        linewidth=1.5,
        label="drift" if unknown.is_drift else "missing",
    )
    axes.axhline(0.0, color=style.GREY, linewidth=0.7)
    axes.set_xlim(float(unknown.time[0]), float(unknown.time[-1]))
    label(axes, None, f"[{unknown.unit}]")
    axes.yaxis.set_label_coords(-0.07, 0.5)
    time_label([axes], 1)
    headline(axes, f"{_what(unknown)}, that no cause explains, with its 95 % band")
    if unknown.formula:
        words = "Looks like " + " + ".join(formula_term(term) for term in unknown.formula)
        words = textwrap.fill(words, 110)
        axes.text(
            0.01, 0.98, words, va="top", fontsize=style.SMALL, color=style.INK, transform=axes.transAxes
        )
        bottom, top = axes.get_ylim()
        axes.set_ylim(bottom, top + 0.2 * (top - bottom))
    return figure


def _what(unknown: Unknown) -> str:
    """Return what is drawn in words."""
    return (
        f"Drift of the {unknown.axis.replace('_', ' ')}'s sensor" if unknown.is_drift else AXES[unknown.axis]
    )
