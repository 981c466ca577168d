"""Figures of a diagnosis: measured over simulated with residuals; and what each rival leaves unexplained."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.channels import BY_NAME
from subzero.diagnosis.results import Curves, Misfit, Verdict
from subzero.figures import style
from subzero.figures.diagnosis_causes import detectable, evidence, gain
from subzero.figures.diagnosis_force import missing_force
from subzero.figures.panel import headline, label, legend, time_label
from subzero.figures.sheet import Title, sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
    return (total[last] - total[first]) / (last - first)


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
