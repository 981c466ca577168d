"""The figures of the page: what is taken for what, how certain and how right, and success over D."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.stats import binomtest

from .manoeuvres import ids
from .scores import CLEAR, Result, calibration, first, is_foreign, is_right, of, smallest_D, truth

FIGURES = Path(__file__).resolve().parents[2] / "docs" / "figures"
BINS = ((0, 4), (4, 9), (9, 16), (16, 25), (25, 100), (100, 1e9))


def draw(results: Sequence[Result]) -> list[str]:
    """Write all figures and return their names."""
    made = {
        "diagnosis_confusion": _confusion,
        "diagnosis_calibration": _calibration,
        "diagnosis_success": _success,
    }
    for name, picture in made.items():
        figure = picture(results)
        figure.savefig(FIGURES / f"{name}.png", dpi=120, bbox_inches="tight", metadata={"Software": None})
        plt.close(figure)
    return list(made)


def _confusion(results: Sequence[Result]) -> plt.Figure:
    """Draw truth over the most probable hypothesis, singles and healthy records."""
    rows = ["none", *ids()]
    columns = [*rows, "two causes", "outside"]
    table = np.zeros((len(rows), len(columns)))
    for one in of(results, "single", "healthy"):
        said = first(one)[0]
        said = "outside" if is_foreign(said) else said if said in rows else "two causes"
        table[rows.index(truth(one)), columns.index(said)] += 1.0
    shares = table / np.maximum(table.sum(axis=1, keepdims=True), 1.0)
    figure, axes = plt.subplots(figsize=(11.0, 9.5))
    axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=1.0)
    for i, j in zip(*np.nonzero(table), strict=True):
        axes.text(j, i, f"{table[i, j]:.0f}", ha="center", va="center", fontsize=6,
                  color="white" if shares[i, j] > 0.6 else "black")  # fmt: skip
    axes.set_xticks(range(len(columns)), columns, rotation=90, fontsize=7)
    axes.set_yticks(range(len(rows)), rows, fontsize=7)
    axes.set_xlabel("most probable hypothesis")
    axes.set_ylabel("truth")
    return figure


def _calibration(results: Sequence[Result]) -> plt.Figure:
    """Draw how often the first hypothesis is right, over its probability."""
    found, error = calibration([one for one in results if one["kind"] != "degraded"])
    stated, right, _ = np.array(found).T
    figure, axes = plt.subplots(figsize=(5.5, 5.0))
    axes.plot([0.0, 1.0], [0.0, 1.0], color="0.6", linewidth=1.0)
    bars = [binomtest(round(y * n), n).proportion_ci(0.68, "wilson") for _, y, n in found]
    off = [[y - bar.low, bar.high - y] for y, bar in zip(right, bars, strict=True)]
    axes.errorbar(stated, right, yerr=np.abs(off).T, fmt="o-", capsize=3)
    for i, (x, y, n) in enumerate(found):
        axes.annotate(f"{n}", (x, y), textcoords="offset points", xytext=(6, -10 - 10 * (i % 2)), fontsize=8)
    axes.set_xlabel("stated probability of the first hypothesis")
    axes.set_ylabel("share that is right")
    axes.set_title(f"expected calibration error {error:.3f}")
    return figure


def _success(results: Sequence[Result]) -> plt.Figure:
    """Draw how often the right name comes first, over D, for the engine and both baselines."""
    singles = of(results, "single", "twin")
    groups = [[one for one in singles if low <= smallest_D(one) < high] for low, high in BINS]
    labels = [f"{low:.0f} … {high:.0f}" if high < 1e8 else f"> {low:.0f}" for low, high in BINS]
    ways = {"diagnosis": is_right, "forward selection": lambda one: one["selection"][:1] == list(one["truth"]),
            "score test": lambda one: one["score"][0] in one["truth"]}  # fmt: skip
    figure, axes = plt.subplots(figsize=(7.0, 4.0))
    for i, (name, good) in enumerate(ways.items()):
        heights = [np.mean([good(one) for one in group]) if group else 0.0 for group in groups]
        axes.bar(np.arange(len(BINS)) + 0.27 * (i - 1), heights, width=0.25, label=name)
    axes.set_xticks(
        range(len(BINS)), [f"{label}\n{len(g)} cases" for label, g in zip(labels, groups, strict=True)]
    )
    axes.axvline(BINS.index((16, 25)) - 0.5, color="0.5", linestyle=":")
    axes.set_xlabel(f"D (from {CLEAR:.0f} on a case can be told)")
    axes.set_ylabel("right name first")
    axes.legend()
    return figure
