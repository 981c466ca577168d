"""The figures of the benchmark, from its results: each with its target, its interval, and the cases it rests on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest, norm

from subzero.synthetic.unmodelled_forces import ALSO_CAUSES

Result = dict[str, Any]
CLEAR, PLAIN, SURE = 16.0, 50.0, 0.95
EDGES = (0.0, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.95, 0.99, 1.0 + 1e-9)
"""Bins of stated probabilities."""
CLOSE_CAUSES = {**ALSO_CAUSES, "weed": "fouling"}
"""What is strange → the cause of the catalogue that comes close to it, which may be named for it."""
FOREIGN = ("unknown_force:", "sensor_drift:")


class Score(NamedTuple):
    """A figure: words, value as text, target as text, 95 % interval as text, cases, met (None: not judged), and whether
    its interval reaches the target if not.
    """

    words: str
    value: str
    target: str
    interval: str
    cases: int
    met: bool | None
    near: bool = False


def plain(name: str) -> str:
    """Return a hypothesis without the time that it began at: "rudder_offset@" for "rudder_offset@12.3"."""
    before, at, _ = name.partition("@")
    return before + at


def first(one: Result) -> tuple[str, float]:
    """Return the most probable hypothesis, without a time, and its probability."""
    name, p = max(one["probabilities"].items(), key=lambda pair: pair[1])
    return plain(name), p


def is_foreign(name: str) -> bool:
    """Say whether a hypothesis is outside the catalogue."""
    return any(one.startswith(FOREIGN) for one in name.split(" + "))


def truth(one: Result) -> str:
    """Return the hypothesis that is true, "outside" for what is none."""
    return "outside" if one["strange"] else " + ".join(sorted(hidden(one))) or "none"


def hidden(one: Result) -> set[str]:
    """Return the causes that are true; with @ behind what begins in mid-trial."""
    return {f"{name}@" if name in one.get("starts", {}) else name for name in one["truth"]}


def is_right(one: Result) -> bool:
    """Say whether the most probable hypothesis is true; of a force outside the catalogue, that it is called one, or the
    cause that comes close to it.
    """
    if not one["strange"]:
        return first(one)[0] == truth(one)
    close = CLOSE_CAUSES.get(one["strange"], "none")
    return one["verdict"] == "outside_catalogue" or first(one)[0] == f"{close}@"


def is_right_as_told(one: Result) -> bool:
    """Say whether the most probable hypothesis is true as it is meant: it stands for itself with or without further
    causes that the record cannot show (`probability.folded`), so that true ones with D < 16 may be missing beside it.
    """
    reported = set(first(one)[0].split(" + "))
    shown = {name for name, d in one["D"].items() if d >= CLEAR}
    return is_right(one) or (
        not one["strange"] and bool(reported & hidden(one)) and shown <= reported <= hidden(one)
    )


def smallest_D(one: Result) -> float:
    """Return the smallest D of its causes."""
    return min(one["D"].values(), default=0.0)


def names(one: Result) -> set[str]:
    """Return the causes that are named; with @ behind what begins in mid-trial."""
    return {reported(cause) for cause in one["causes"]}


def reported(cause: Result) -> str:
    """Return the name of a cause; with @ behind it if it begins in mid-trial."""
    return cause["id"] + ("@" if cause.get("start") is not None else "")


def wrongly_sure(one: Result, sure: float = SURE) -> bool:
    """Say whether a wrong name is stated with certainty."""
    return any(cause["p"] >= sure and reported(cause) not in hidden(one) for cause in one["causes"])


def of(results: Iterable[Result], *kinds: str) -> list[Result]:
    """Return the results of some kinds."""
    return [one for one in results if one["kind"] in kinds]


def share(
    words: str,
    cases: Sequence[Result],
    good: Callable[[Result], bool],
    target: str,
    *,
    least: float | None = None,
    most: float | None = None,
) -> Score:
    """Return a share of cases as a figure."""
    n, k = len(cases), sum(map(good, cases))
    if n == 0:
        return Score(words, "–", target, "–", 0, None)
    low, high = binomtest(k, n).proportion_ci(0.95)
    value = k / n
    met = (least is None or value >= least) and (most is None or value <= most)
    judged = met if (least, most) != (None, None) else None
    near = (least is None or high >= least) and (most is None or low <= most)
    return Score(
        words, f"{100 * value:.1f} %", target, f"{100 * low:.1f} … {100 * high:.1f} %", n, judged, near
    )


def number(words: str, values: Sequence[float], target: str, form: str, *, least: float | None = None,
           most: float | None = None) -> Score:  # fmt: skip
    """Return a median as a figure, with the quartiles in the place of an interval."""
    if not values:
        return Score(words, "–", target, "–", 0, None)
    low, value, high = np.percentile(values, [25, 50, 75])
    met = bool((least is None or value >= least) and (most is None or value <= most))
    judged = met if (least, most) != (None, None) else None
    return Score(words, form.format(value), target, f"{form.format(low)} … {form.format(high)} (quartiles)",
                 len(values), judged)  # fmt: skip


def calibration(results: Sequence[Result]) -> tuple[list[tuple[float, float, int]], float]:
    """Return (stated, right, cases) by bins of the first hypothesis' probability, and the expected error."""
    stated = np.array([first(one)[1] for one in results])
    return calibration_error(stated, np.array([is_right_as_told(one) for one in results], dtype=float))


def by_chance(stated: np.ndarray, draws: int = 1000) -> np.ndarray:
    """Return the calibration errors (draws,) of an engine that is right as often as it states (n,)."""
    rng = np.random.default_rng(0)
    return np.array(
        [calibration_error(stated, 1.0 * (rng.random(stated.size) < stated))[1] for _ in range(draws)]
    )


def calibration_error(stated: np.ndarray, right: np.ndarray) -> tuple[list[tuple[float, float, int]], float]:
    """Return (stated, right, cases) by bins of stated probabilities (n,), and the mean difference of the two."""
    found = []
    for low, high in pairwise(EDGES):
        own = (stated >= low) & (stated < high)
        if own.any():
            found.append((float(stated[own].mean()), float(right[own].mean()), int(own.sum())))
    error = sum(n * abs(a - b) for a, b, n in found) / max(stated.size, 1)
    return found, float(error)


def errors(results: Sequence[Result]) -> tuple[list[float], list[float], list[bool]]:
    """Return the parameters of rightly named causes: relative errors, the relative standard deviations that are stated
    with them, and whether their intervals cover the truth.
    """
    off, stated, covered = [], [], []
    for one in results:
        for cause in one["causes"]:
            for (value, low, high, sd), true in zip(cause["parameters"].values(), one["truth"].get(cause["id"], ()),
                                                    strict=False):  # fmt: skip
                if reported(cause) in hidden(one) and true:
                    off.append(abs(value - true) / abs(true))
                    stated.append(sd / abs(true))
                    covered.append(low <= true <= high)
    return off, stated, covered


def expected(stated: Sequence[float]) -> list[float]:
    """Return the errors that standard deviations let expect: ten quantiles of the size of a normal one for each."""
    sizes = norm.ppf(0.5 + 0.5 * (np.arange(10) + 0.5) / 10)
    return list(np.outer(stated, sizes).ravel())


def gain_of(one: Result, model: str) -> float:
    """Return the gain of a model on the other manoeuvre."""
    gain = one["gain"]
    return (gain["nominal"] - gain[model]) / gain["nominal"]
