"""The one style of all figures: tethered solid, untethered dashed, measured as dots, colour-blind safe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from subzero.validity import warnings_of

if TYPE_CHECKING:
    import xarray as xr

Runs = dict[str, "xr.Dataset"]
"""Runs of one trial by name: tethered, untethered or both."""

BLUE, ORANGE, GREEN, PURPLE, AMBER, SKY = "#0072B2", "#D55E00", "#009E73", "#AA4499", "#E69F00", "#56B4E9"
INK, GREY, PALE = "#222222", "#8A8A8A", "#E3E3E3"
"""Okabe and Ito's colours for all kinds of sight, purple after Tol; ink for text, grey for what is behind."""

CYCLE = (BLUE, ORANGE, GREEN, PURPLE, AMBER, SKY, INK, GREY)
DASHES = ("-", (0, (5, 2)), (0, (1, 1)))
"""Three curves of one panel differ in colour and in dash, to survive a grey print."""

LINES: dict[str, dict[str, Any]] = {
    "tethered": {"color": BLUE, "linestyle": DASHES[0], "linewidth": 1.5},
    "untethered": {"color": ORANGE, "linestyle": DASHES[1], "linewidth": 1.5},
}
COMMAND: dict[str, Any] = {"color": INK, "linestyle": "-", "linewidth": 1.2}
DOTS: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 2.6, "color": INK, "alpha": 0.6}

DPI = 150
TINY, SMALL, NORMAL, LARGE = 6.8, 7.5, 8.5, 9.5
"""Font sizes. [pt]"""


def warnings_in_short(runs: Runs) -> str:
    """Return how many warnings some runs end with, and which checks have them, for a line of a figure; or nothing."""
    names = {label: [one.check.replace("_", " ") for one in warnings_of(run)] for label, run in runs.items()}
    count = sum(map(len, names.values()))
    if not count:
        return ""
    several = len(runs) > 1
    parts = [
        (f"{label}: " if several else "") + ", ".join(dict.fromkeys(checks))
        for label, checks in names.items()
        if checks
    ]
    return f"{count} warning{'s' if count > 1 else ''} ({'; '.join(parts)}), see summary.json"
