"""Figures of a diagnosis.

Measured over simulated, with residuals; what each rival leaves unexplained; how probable the causes are, which look
alike, and what the extended model gains; the force that no cause of the catalogue explains, with its band and formula.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.channels import BY_NAME
from subzero.diagnosis.report.tables import CLEAR_FROM, CONFUSED_BELOW, SEEN_SIGNAL
from subzero.diagnosis.report.words import formula_term
from subzero.diagnosis.results import ChannelGain, Curves, Misfit, Unknown, Verdict
from subzero.figures import style
from subzero.figures.style import Title, headline, label, legend, sheet, time_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
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
    return float(max([1.0, *(one for one in found if np.isfinite(one))]))


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
    from subzero.figures.style import BOTTOM, TOP, WIDTH

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


MODELS: dict[str, dict[str, Any]] = {
    "nominal": {"color": style.ORANGE, "linestyle": style.DASHES[1], "linewidth": 1.3},
    "extended": {"color": style.BLUE, "linestyle": style.DASHES[0], "linewidth": 1.4},
}
"""Models that are drawn over what was measured, the best one last."""
CALIBRATED = "tolerance", "within tolerances"
"""The nominal model refitted within its tolerances, drawn where nothing is extended; its label."""

RIVAL = "rival: "
MOST_RIVALS = 2
BAND = 1.96
"""The noise band holds 95 % of what a right model leaves."""

SMOOTH = 0.5
"""Residuals are shown as dots, and as a line smoothed over so long. [s]"""


def draw_diagnosis(verdict: Verdict, title: Title) -> dict[str, Figure]:
    """Return the figures of a diagnosis by the name of their file.

    Args:
        verdict: of `subzero.diagnose`.
        title: stands above each.
    """
    figures: dict[str, Figure | None] = {}
    for name, curves in verdict.curves.items():
        ending = f"_{_file(name)}" if len(verdict.curves) > 1 else ""
        figures[f"misfit{ending}"] = misfit(curves, verdict.misfit.get(name, {}), title, name)
        figures[f"rivals{ending}"] = rivals(curves, verdict.misfit.get(name, {}), title, name)
    figures["evidence"] = evidence(verdict, title)
    figures["detectable"] = detectable(verdict, title)
    figures["gain"] = gain(verdict, title)
    figures["missing_force"] = missing_force(verdict, title)
    return {name: figure for name, figure in figures.items() if figure is not None}


def misfit(curves: Curves, noise: Mapping[str, Misfit], title: Title, name: str) -> Figure | None:
    """Draw every channel: measured over models on the left, what they leave unexplained on the right."""
    if not curves.measured:
        return None
    figure, panels = sheet(len(curves.measured), 2, _named(title, name))
    for at, channel in enumerate(curves.measured):
        left, right = panels[2 * at : 2 * at + 2]
        _overlay(left, curves, channel)
        _residuals(right, curves, channel, noise.get(channel), _shown(curves))
        words = BY_NAME[channel].long_name
        headline(left, words[0].upper() + words[1:])
        headline(right, "Measured − simulated" if at else "Measured − simulated; grey: noise, 95 %")
    legend(panels[0])
    time_label(panels, 2)
    return figure


def rivals(curves: Curves, noise: Mapping[str, Misfit], title: Title, name: str) -> Figure | None:
    """Draw what it would have looked like if a rival were true: what was measured would lie on the rival's line."""
    best = _best(curves)
    names = [model for model in curves.models if model.startswith(RIVAL) and model != best][:MOST_RIVALS]
    if not names:
        return None
    worst = sorted(curves.measured, key=lambda channel: -_apart(curves, channel, names, noise.get(channel)))[
        :6
    ]
    figure, panels = sheet((len(worst) + 1) // 2, 2, _named(title, f"{name}: if a rival were true"))
    for axes, channel in zip(panels, worst, strict=False):
        _beside(axes, curves, channel, noise.get(channel), names)
        model = "extended model" if best == "extended" else best.removeprefix(RIVAL)
        headline(axes, f"{BY_NAME[channel].name.replace('_', ' ').capitalize()} − {model}")
    legend(panels[0], columns=2)
    for axes in panels[len(worst) :]:
        axes.remove()
    time_label(panels[: len(worst)], 2)
    return figure


def _apart(curves: Curves, channel: str, names: list[str], misfit: Misfit | None) -> float:
    """Return how far rivals and the best model lie apart in a channel, in its noise."""
    best = curves.models[_best(curves)][channel]
    gaps = [np.sqrt(np.nanmean((curves.models[name][channel] - best) ** 2)) for name in names]
    return float(max(gaps)) / (misfit.noise_sd if misfit else 1.0)


def _beside(axes: Axes, curves: Curves, channel: str, misfit: Misfit | None, names: list[str]) -> None:
    """Draw rivals and what was measured, smoothed, less the best model."""
    best, used = curves.models[_best(curves)][channel], _used(curves, channel)
    _band(axes, misfit)
    smooth = _smooth(curves.time[used], (curves.measured[channel] - best)[used])
    axes.plot(curves.time[used], smooth, color=style.INK, linewidth=0.9, alpha=0.6, label="measured")
    axes.axhline(0.0, **MODELS["extended"], label=_best(curves).removeprefix(RIVAL))
    looks = zip(names, (style.GREEN, style.PURPLE), style.DASHES[1:], strict=False)
    for name, colour, dash in looks:
        words = name.removeprefix(RIVAL)
        axes.plot(curves.time, curves.models[name][channel] - best, color=colour, linestyle=dash, label=words)
    label(axes, None, f"[{BY_NAME[channel].unit}]")
    _in_time(axes, curves)


def _best(curves: Curves) -> str:
    """Return the extended model; without one the first rival, the most probable; or the calibrated one."""
    rivals = [model for model in curves.models if model.startswith(RIVAL)]
    return next((model for model in ("extended", *rivals) if model in curves.models), CALIBRATED[0])


def _shown(curves: Curves) -> dict[str, dict[str, Any]]:
    """Return the models that are drawn, and how."""
    looks = {"nominal": MODELS["nominal"], _best(curves): MODELS["extended"]}
    return {name: look for name, look in looks.items() if name in curves.models}


def _overlay(axes: Axes, curves: Curves, channel: str) -> None:
    """Draw a channel as it was measured, and as models have it."""
    values = curves.measured[channel]
    used = _used(curves, channel)
    axes.plot(curves.time[used], values[used], label="measured", zorder=1.5, **style.DOTS | {"alpha": 0.35})
    left_out = np.isfinite(values) & ~used
    if left_out.any():
        axes.plot(
            curves.time[left_out], values[left_out], "x", color=style.GREY, markersize=4, label="left out"
        )
    for name, look in _shown(curves).items():
        words = CALIBRATED[1] if name == CALIBRATED[0] else name.removeprefix(RIVAL)
        axes.plot(curves.time, curves.models[name][channel], label=words, **look)
    label(axes, None, f"${BY_NAME[channel].symbol}$ [{BY_NAME[channel].unit}]")
    _in_time(axes, curves)
    if left_out.any():
        _fit_to(axes, [values[used], *(one[channel] for one in curves.models.values())])


def _residuals(
    axes: Axes,
    curves: Curves,
    channel: str,
    misfit: Misfit | None,
    shown: Mapping[str, dict[str, Any]],
) -> None:
    """Draw what models leave unexplained, smoothed, over the band of the noise."""
    values = curves.measured[channel]
    used = _used(curves, channel)
    _band(axes, misfit)
    axes.axhline(0.0, color=style.GREY, linewidth=0.7)
    for name, look in shown.items():
        left = (values - curves.models[name][channel])[used]
        axes.plot(curves.time[used], left, "o", color=look["color"], markersize=1.4, alpha=0.35)
        axes.plot(curves.time[used], _smooth(curves.time[used], left), label=name, **look)
    label(axes, None, f"[{BY_NAME[channel].unit}]")
    _in_time(axes, curves)


def _used(curves: Curves, channel: str) -> np.ndarray:
    return curves.used.get(channel, np.isfinite(curves.measured[channel]))


def _band(axes: Axes, misfit: Misfit | None) -> None:
    """Draw where the noise of a channel lies."""
    if misfit is not None:
        axes.axhspan(-BAND * misfit.noise_sd, BAND * misfit.noise_sd, color=style.PALE, zorder=0.5)


def _smooth(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return a running mean over SMOOTH, at the same times."""
    if time.size < 3:
        return values
    total = np.r_[0.0, np.cumsum(np.nan_to_num(values))]
    first = np.searchsorted(time, time - 0.5 * SMOOTH)
    last = np.searchsorted(time, time + 0.5 * SMOOTH, side="right")
    mean: np.ndarray = (total[last] - total[first]) / (last - first)
    return mean


def _fit_to(axes: Axes, curves: list[np.ndarray]) -> None:
    """Let outliers lie outside of the panel rather than flatten what matters."""
    values = np.concatenate([one[np.isfinite(one)] for one in curves])
    low, high = values.min(), values.max()
    margin = 0.08 * (high - low) or 1.0
    axes.set_ylim(low - margin, high + margin)


def _in_time(axes: Axes, curves: Curves) -> None:
    axes.set_xlim(min(0.0, float(curves.time[0])), float(curves.time[-1]))


def _named(title: Title, name: str) -> Title:
    return Title(words=f"{title.words}; {name}", scenario=title.scenario)


def _file(name: str) -> str:
    return "".join(letter if letter.isalnum() or letter in "-." else "_" for letter in name)
