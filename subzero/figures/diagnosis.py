"""Figures of a diagnosis.

Measured over simulated, with residuals; what each rival leaves unexplained; how probable the causes are, which look
alike, and what the extended model gains; the force that no cause of the catalogue explains, with its band and formula.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from itertools import cycle
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from subzero.channels import BY_NAME
from subzero.diagnosis.report.tables import CLEAR_FROM, CONFUSED_BELOW, SEEN_SIGNAL, WORTH_A_LINE
from subzero.diagnosis.report.words import (
    explanation,
    formula_term,
    is_reported,
    number,
    sentences,
    something,
    with_errors,
    without_errors,
)
from subzero.diagnosis.results import (
    UNDECIDED,
    ChannelGain,
    Curves,
    Misfit,
    Unknown,
    Verdict,
    worth_naming,
)
from subzero.figures import style
from subzero.figures.style import Title, headline, label, legend, log_scale, sheet, time_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


AXES = {
    "X": "Force, positive forward",
    "Y": "Force, positive to starboard",
    "Z": "Force, positive down",
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
    low, high = unknown.force - 1.96 * unknown.band, unknown.force + 1.96 * unknown.band
    axes.fill_between(
        unknown.time, low, high, color=style.SKY, alpha=0.4, linewidth=0, label="95 %", zorder=1.5
    )
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
    time_label([axes], 1)
    headline(axes, _what(unknown))
    if unknown.formula:
        formula = "Looks like " + " + ".join(formula_term(term) for term in unknown.formula)
        lines = textwrap.wrap(formula, int(FORMULA_LENGTH * style.width() / style.WIDTH) - 3)
        place: dict[str, Any] = {"va": "top", "transform": axes.transAxes, "parse_math": False}
        axes.text(0.01, 0.98, "\n".join(lines), fontsize=style.SMALL, color=style.INK, **place)
        bottom, top = axes.get_ylim()
        axes.set_ylim(bottom, top + (0.08 + 0.08 * len(lines)) * (top - bottom))
    return figure


FORMULA_LENGTH = 110
"""So many letters of a formula fit on a line."""


def _what(unknown: Unknown) -> str:
    """Return the label of a drawn effect: its force or drift, and the meaning of its sign."""
    if unknown.is_drift:
        return f"Drift of the {unknown.axis.replace('_', ' ')}'s sensor, that no cause explains; band: 95 %"
    does = something(unknown.axis, unknown.force)
    return f"{does[0].upper()}{does[1:]}: {AXES[unknown.axis].lower()}; band: 95 %"


MOST = 10
"""So many hypotheses are shown."""

LEAST = 1e-4
"""Probabilities below this are not shown."""

FLOOR = 0.05
"""Where the logarithmic axis of D begins."""

GAINS = {
    "before": (style.ORANGE, "simulated"),
    "tolerance": (style.AMBER, "calibrated within tolerances"),
    "rival": (style.GREEN, "best rival"),
    "after": (style.BLUE, "extended model"),
}
"""Errors of a channel → colour and words; the floor is a line."""


def evidence(verdict: Verdict, title: Title) -> Figure | None:
    """Draw how probable every hypothesis is: on a linear axis, and on a logarithmic one for the small ones."""
    ranked = sorted(verdict.probabilities.items(), key=lambda item: -item[1])[:MOST]
    ranked = [(name, p) for name, p in ranked if p >= LEAST]
    if not ranked:
        return None
    names = [_wrapped(with_errors(name, verdict)) for name, _ in ranked]
    rows = sum(1 + name.count("\n") for name in names)
    figure, (plain, logarithmic) = _bars(2, rows, title, left=0.42, apart=0.2)
    colours = [style.BLUE if is_reported(name, verdict) else style.GREY for name, _ in ranked]
    for axes in (plain, logarithmic):
        axes.barh(range(len(ranked)), [p for _, p in ranked], color=colours, height=0.65)
        axes.set_xlabel("probability", fontsize=style.NORMAL)
    _names(plain, names)
    plain.set_xlim(0.0, 1.0)
    headline(plain, "Data put right" if verdict.then else "Probability")
    logarithmic.set_xscale("log")
    logarithmic.set_xlim(LEAST, 1.3)
    _names(logarithmic, [""] * len(ranked))
    headline(logarithmic, "Small ones too")
    return figure


NAME_LENGTH, NARROW_NAME_LENGTH = 50, 36
"""Number of letters of an explanation that fit next to its bar; in a narrow figure."""


def _wrapped(words: str) -> str:
    most = NAME_LENGTH if style.width() >= style.ONE_COLUMN else NARROW_NAME_LENGTH
    return textwrap.fill(words[:1].upper() + words[1:], most)


def detectable(verdict: Verdict, title: Title) -> Figure | None:
    """Draw signal and discrimination of every cause, the least distinct one on top."""
    rows = sorted(verdict.detectable, key=lambda each: each.discrimination)
    if not rows:
        return None
    known = sentences(verdict)
    figure, (signal, apart) = _bars(2, len(rows), title, left=0.325, apart=2.05)
    size = [max(row.signal, FLOOR) for row in rows]
    signal.barh(
        range(len(rows)),
        size,
        color=[style.GREY if s < SEEN_SIGNAL else style.BLUE for s in size],
        height=0.65,
    )
    signal.axvline(SEEN_SIGNAL, color=style.INK, linewidth=0.8, linestyle=style.DASHES[1])
    signal.set_xlabel("signal", fontsize=style.NORMAL)
    headline(signal, f"Seen: from {SEEN_SIGNAL:g}")
    far = [max(row.discrimination, FLOOR) for row in rows]
    apart.barh(range(len(rows)), far, color=[_verdict_colour(each) for each in far], height=0.65)
    for limit in (CONFUSED_BELOW, CLEAR_FROM):
        apart.axvline(limit, color=style.INK, linewidth=0.8, linestyle=style.DASHES[1])
    apart.set_xlabel("D", fontsize=style.NORMAL)
    headline(apart, f"Apart: from {CLEAR_FROM:g}")
    apart.text(
        -0.06,
        1.0,
        "looks most like:",
        ha="right",
        va="bottom",
        transform=apart.transAxes,
        fontsize=style.TINY,
        color=style.GREY,
    )
    causes = [_short(explanation(row.id, known)) for row in rows]
    alike = [_short(explanation(row.rival, known)) for row in rows]
    for axes, words in ((signal, causes), (apart, alike)):
        axes.set_xscale("log")
        axes.set_xlim(left=FLOOR)
        _names(axes, words)
    return figure


def _short(words: str) -> str:
    """Return as many of the words as fit next to a bar."""
    most = 38 if style.width() >= style.ONE_COLUMN else 34
    return words if len(words) <= most else f"{words[: most - 1].rstrip()}…"


def gain(verdict: Verdict, title: Title) -> Figure | None:
    """Draw errors before and after by channel, in units of the noise floor: held out, and fitted."""
    if verdict.gain is None:
        return None
    none = "" if verdict.gain.total > 0.0 else "; the extended model is no better there"
    parts = {f"Not fitted: {verdict.gain.how}{none}": verdict.gain.held_out, "Fitted": verdict.gain.fitted}
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
    log_scale(axes)
    axes.set_xticks(range(len(rows)), [_words(name) for name in rows], fontsize=style.SMALL)
    if style.width() < style.ONE_COLUMN:
        axes.set_xticklabels([_words(name).replace(" ", "\n") for name in rows])
    axes.set_ylabel("RMS error / noise floor", fontsize=style.NORMAL)


def _high(rows: Mapping[str, ChannelGain]) -> float:
    """Return the largest error, in noise floors."""
    found = [getattr(row, key) / row.floor for row in rows.values() for key in GAINS]
    return float(max([1.0, *(each for each in found if np.isfinite(each))]))


def _words(name: str) -> str:
    return (BY_NAME[name].name if name in BY_NAME else name).replace("_", " ")


def _verdict_colour(discrimination: float) -> str:
    if discrimination < CONFUSED_BELOW:
        return style.ORANGE
    return style.AMBER if discrimination < CLEAR_FROM else style.BLUE


BAR_ROW, NARROW_LEFT = 0.17, 0.6
"""Height of a bar with its space [inch]; start of bars in a narrow figure, whose panels are below one another."""


def _bars(
    columns: int, rows: int, title: Title, *, left: float = 0.2, apart: float = 0.72
) -> tuple[Figure, list[Axes]]:
    """Return a sheet for horizontal bars, as high as they need, with space for their names."""
    from subzero.figures.style import BOTTOM, TITLE_LINE, TOP

    figure, panels = sheet(1, columns, title)
    stacked = columns if style.width() < style.ONE_COLUMN else 1
    above = TOP + TITLE_LINE * (1 + figure.texts[0].get_text().count("\n"))
    bars = 0.2 + BAR_ROW * max(rows, 3)
    between = BOTTOM + TOP
    height = above + stacked * bars + (stacked - 1) * between + BOTTOM
    figure.set_size_inches(style.width(), height)
    figure.subplots_adjust(
        left=left if stacked == 1 else NARROW_LEFT,
        wspace=apart,
        hspace=between / bars,
        bottom=BOTTOM / height,
        top=1.0 - above / height,
    )
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
"""Models that are drawn over the measurements, the best one last."""
CALIBRATED = "tolerance"
"""The nominal model refitted within its tolerances, drawn where nothing is extended."""
MODEL_WORDS = {
    "nominal": "simulated",
    "extended": "extended model",
    CALIBRATED: "calibrated within tolerances",
}
"""Names of the models in all figures."""

RIVAL = "rival: "
BAND = 1.96
"""The noise band holds 95 % of the residuals of a right model."""

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
        drawn = Drawn(curves, verdict.misfit.get(name, {}), verdict)
        several = len(verdict.curves) > 1
        figures[f"misfit{ending}"] = misfit(drawn, _named(title, name) if several else title)
        rival = f"{name}: if a rival were true" if several else "if a rival were true"
        figures[f"rivals{ending}"] = rivals(drawn, _named(title, rival))
    figures["evidence"] = evidence(verdict, title)
    figures["detectable"] = detectable(verdict, title)
    figures["gain"] = gain(verdict, title)
    figures["missing_force"] = missing_force(verdict, title)
    return {name: figure for name, figure in figures.items() if figure is not None}


class Drawn(NamedTuple):
    """The data of the figures of a record: its curves, the noise of its channels, and the verdict that they belong
    to.
    """

    curves: Curves
    noise: Mapping[str, Misfit]
    verdict: Verdict

    def words(self, model: str) -> str:
        """Return the name of a model."""
        if model in MODEL_WORDS and not (model == CALIBRATED and self._is_rival):
            return MODEL_WORDS[model]
        model = model.replace(CALIBRATED, "none")
        return textwrap.fill(f"if {explanation(model.removeprefix(RIVAL), sentences(self.verdict))}", 44)

    @property
    def ranked(self) -> list[str]:
        """The explanations that have curves, the most probable first; where none has, the calibrated model."""
        found = [model for model in self.curves.models if model.startswith(RIVAL)]
        if CALIBRATED in self.curves.models and (not found or self._is_rival):
            found.append(CALIBRATED)
        return sorted(found, key=lambda model: -self._probability(model)) or [CALIBRATED]

    @property
    def named(self) -> list[str]:
        """The explanations that are drawn: all that the words of an undecided verdict name; else those with curves."""
        if self.verdict.on_model != UNDECIDED:
            return self.ranked
        words = worth_naming(self._probabilities)
        return [model for model in self.ranked if self._key(model) in words]

    @property
    def _is_rival(self) -> bool:
        """Whether "nothing is wrong", which the calibrated model represents, is among the remaining explanations."""
        return self.verdict.on_model == UNDECIDED and self._probability(CALIBRATED) >= WORTH_A_LINE

    def _probability(self, model: str) -> float:
        return self._probabilities.get(self._key(model), 0.0)

    @property
    def _probabilities(self) -> dict[str, float]:
        """Explanation → probability, without the errors in the data that are reported."""
        return {without_errors(name, self.verdict): p for name, p in self.verdict.probabilities.items()}

    @staticmethod
    def _key(model: str) -> str:
        """Return the explanation that a model represents, as in `Verdict.probabilities`."""
        return model.removeprefix(RIVAL).replace(CALIBRATED, "none")

    @property
    def best(self) -> str:
        """The extended model; without one the most probable explanation that has curves."""
        return "extended" if "extended" in self.curves.models else self.ranked[0]

    @property
    def shown(self) -> dict[str, dict[str, Any]]:
        """The models that are drawn over the measurements, and their styles."""
        looks = {"nominal": MODELS["nominal"], self.best: MODELS["extended"]}
        return {name: look for name, look in looks.items() if name in self.curves.models}

    def used(self, channel: str) -> np.ndarray:
        """Return which samples of a channel were used."""
        return self.curves.used.get(channel, np.isfinite(self.curves.measured[channel]))

    def left(self, channel: str, model: str) -> np.ndarray:
        """Return the residuals of a model at the samples that were used."""
        residual = self.curves.measured[channel] - self.curves.models[model][channel]
        used: np.ndarray = residual[self.used(channel)]
        return used


def misfit(drawn: Drawn, title: Title) -> Figure | None:
    """Draw every channel: measured over models on the left, the residuals of the models on the right."""
    measured = drawn.curves.measured
    if not measured:
        return None
    figure, panels = sheet(len(measured), 2, title)
    for at, channel in enumerate(measured):
        left, right = panels[2 * at : 2 * at + 2]
        _overlay(left, drawn, channel)
        _residuals(right, drawn, channel)
        words = BY_NAME[channel].long_name
        headline(left, words[0].upper() + words[1:])
    legend(panels[0], columns=2)
    time_label(panels, 2)
    return figure


def rivals(drawn: Drawn, title: Title) -> Figure | None:
    """Draw the channels as if a rival were true: the measurements would then lie on the rival's line."""
    curves, best = drawn.curves, drawn.best
    names = [model for model in drawn.named if model in curves.models and model != best]
    if not names or not any(name.startswith(RIVAL) for name in (best, *names)):
        return None
    worst = sorted(curves.measured, key=lambda channel: -_apart(drawn, channel, names))[:6]
    figure, panels = sheet((len(worst) + 1) // 2, 2, title)
    for axes, channel in zip(panels, worst, strict=False):
        _draw_less_best(axes, drawn, channel, names)
        model = "extended model" if best == "extended" else "most probable"
        headline(axes, f"{BY_NAME[channel].name.replace('_', ' ').capitalize()} − {model}")
    legend(panels[0], columns=1)
    for axes in panels[len(worst) :]:
        axes.remove()
    time_label(panels[: len(worst)], 2)
    return figure


def _apart(drawn: Drawn, channel: str, names: list[str]) -> float:
    """Return how far rivals and the best model lie apart in a channel, in its noise."""
    models, noise = drawn.curves.models, drawn.noise.get(channel)
    best = models[drawn.best][channel]
    gaps = [np.sqrt(np.nanmean((models[name][channel] - best) ** 2)) for name in names]
    return float(max(gaps)) / (noise.noise_sd if noise else 1.0)


def _draw_less_best(axes: Axes, drawn: Drawn, channel: str, names: list[str]) -> None:
    """Draw rival models and the smoothed measurements, each minus the best model."""
    curves, best = drawn.curves, drawn.best
    time = curves.time[drawn.used(channel)]
    _band(axes, drawn.noise.get(channel))
    smooth = _smooth(time, drawn.left(channel, best))
    axes.plot(time, smooth, color=style.INK, linewidth=0.9, alpha=0.6, label="measured")
    axes.axhline(0.0, **MODELS["extended"], label=drawn.words(best))
    looks = zip(
        names, (style.GREEN, style.PURPLE, style.AMBER, style.SKY), cycle(style.DASHES[1:]), strict=False
    )
    for name, colour, dash in looks:
        apart = curves.models[name][channel] - curves.models[best][channel]
        axes.plot(curves.time, apart, color=colour, linestyle=dash, label=drawn.words(name))
    label(axes, None, f"[{BY_NAME[channel].unit}]")
    _in_time(axes, curves)


def _overlay(axes: Axes, drawn: Drawn, channel: str) -> None:
    """Draw a channel as it was measured, and as models have it."""
    curves, values, used = drawn.curves, drawn.curves.measured[channel], drawn.used(channel)
    dots = style.DOTS | {"alpha": 0.35, "rasterized": True}
    axes.plot(curves.time[used], values[used], label="measured", zorder=1.5, **dots)
    left_out = np.isfinite(values) & ~used
    if left_out.any():
        axes.plot(
            curves.time[left_out], values[left_out], "x", color=style.GREY, markersize=4, label="left out"
        )
    wrong = _recorded_wrong(curves, channel)
    if wrong.size:
        axes.plot(*wrong.T, "x", color=style.ORANGE, markersize=4, label="as recorded")
    for name, look in drawn.shown.items():
        axes.plot(curves.time, curves.models[name][channel], label=drawn.words(name), **look)
    label(axes, None, f"${BY_NAME[channel].symbol}$ [{BY_NAME[channel].unit}]")
    _in_time(axes, curves)
    if left_out.any() or wrong.size:
        _fit_to(axes, [values[used], *(model[channel] for model in curves.models.values())])


def _recorded_wrong(curves: Curves, channel: str) -> np.ndarray:
    """Return recorded time and value of the samples that an error in the data affects (n, 2)."""
    time, values = curves.recorded.get(channel, (np.empty(0), np.empty(0)))
    right = set(zip(np.round(curves.time, 6), curves.measured[channel], strict=True))
    pairs = zip(np.round(time, 6), values, strict=True)
    return np.array([pair for pair in pairs if np.isfinite(pair[1]) and pair not in right]).reshape(-1, 2)


def _residuals(axes: Axes, drawn: Drawn, channel: str) -> None:
    """Draw measured − simulated of each model, smoothed, with the noise of the sensor and the step of its values."""
    time, noise = drawn.curves.time[drawn.used(channel)], drawn.noise.get(channel)
    _band(axes, noise)
    axes.axhline(0.0, color=style.GREY, linewidth=0.7)
    for name, look in drawn.shown.items():
        left = drawn.left(channel, name)
        axes.plot(time, left, "o", color=look["color"], markersize=1.4, alpha=0.35, rasterized=True)
        axes.plot(time, _smooth(time, left), label=drawn.words(name), **look)
    unit = BY_NAME[channel].unit
    label(axes, None, f"[{unit}]")
    _in_time(axes, drawn.curves)
    headline(axes, f"Residual{_behind(noise)}")
    if noise is not None:
        _show_noise(axes, drawn, channel, noise.noise_sd, unit)


def _behind(noise: Misfit | None) -> str:
    """Return the words that explain the background of the residuals."""
    if noise is None:
        return ""
    return "; grey: noise, 95 %" + ("; dotted: step" if noise.resolution > 0.0 else "")


def _show_noise(axes: Axes, drawn: Drawn, channel: str, noise: float, unit: str) -> None:
    """Limit the axis so that the noise and the residuals of the best model are visible; say so if the nominal one is
    cut.
    """
    best = np.abs(drawn.left(channel, drawn.best)) if drawn.best in drawn.curves.models else np.zeros(1)
    most = NOISE_SHARE * max(BAND * noise, float(best.max(initial=0.0)))
    nominal = drawn.curves.models.get("nominal")
    off = float(np.abs(drawn.left(channel, "nominal")).max(initial=0.0)) if nominal is not None else 0.0
    if off > OFF_SCALE * most > 0.0:
        axes.set_ylim(-most, most)
        words = f"simulated: off by as much as {number(off, unit)}"
        place: dict[str, Any] = {"ha": "right", "va": "bottom", "transform": axes.transAxes}
        behind = {"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 1.0}
        axes.text(0.985, 0.02, words, fontsize=style.SMALL, color=style.ORANGE, bbox=behind, **place)


NOISE_SHARE, OFF_SCALE = 1.5, 3.0
"""A panel reaches so many times beyond the noise or the best residual; a model this far beyond that is cut off. [-]"""


def _band(axes: Axes, misfit: Misfit | None) -> None:
    """Draw where the noise of a channel lies, and between which values its sensor shows none."""
    if misfit is None:
        return
    axes.axhspan(-BAND * misfit.noise_sd, BAND * misfit.noise_sd, color=style.PALE, zorder=0.5)
    if misfit.resolution > 0.0:
        for edge in (-0.5, 0.5):
            look: dict[str, Any] = {"color": style.INK, "linewidth": 0.8, "linestyle": style.DASHES[2]}
            axes.axhline(edge * misfit.resolution, **look)


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
    """Limit the axis so that outliers are outside of the panel and do not flatten the other values."""
    values = np.concatenate([curve[np.isfinite(curve)] for curve in curves])
    low, high = values.min(), values.max()
    margin = 0.08 * (high - low) or 1.0
    axes.set_ylim(low - margin, high + margin)


def _in_time(axes: Axes, curves: Curves) -> None:
    axes.set_xlim(min(0.0, float(curves.time[0])), float(curves.time[-1]))


def _named(title: Title, name: str) -> Title:
    return Title(words=f"{title.words}; {name}", scenario=title.scenario)


def _file(name: str) -> str:
    return "".join(letter if letter.isalnum() or letter in "-." else "_" for letter in name)
