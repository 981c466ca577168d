"""All figures of the issue's "It is right when", in its order."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .scores import (
    CLEAR,
    PLAIN,
    Result,
    Score,
    by_chance,
    calibration,
    errors,
    expected,
    first,
    gain_of,
    hidden,
    is_foreign,
    is_right,
    is_right_as_told,
    names,
    number,
    of,
    plain,
    share,
    smallest_D,
    truth,
    wrongly_sure,
)


def rows(results: Sequence[Result]) -> list[Score]:
    """Return all figures."""
    return [*_singles(results), *_sudden(results), *_healthy(results), *_pairs(results), *_outside(results),
            *_numbers(results), *_gains(results), *_degraded(results), *_baselines(results)]  # fmt: skip


def _holds(one: Result) -> bool:
    return truth(one) in set(map(plain, one["set"])) or (
        bool(one["strange"]) and any(map(is_foreign, one["set"]))
    )


def _stated(cases: Sequence[Result]) -> float:
    """Return the mean probability that is stated of all that is in a set."""
    stated = [one["probabilities"].get(name, 0.0) for one in cases for name in one["set"]]
    return sum(stated) / max(len(cases), 1)


def _singles(results: Sequence[Result]) -> list[Score]:
    singles, twins = of(results, "single"), of(results, "twin")
    clear = [one for one in singles if smallest_D(one) >= CLEAR]
    sizes = [float(len(one["set"])) for one in singles]
    return [
        share("singles, D ≥ 16: right name first", clear, is_right, "≥ 97 %", least=0.97),
        share("… named outright (verdict `cause_named`, no other name)", clear,
              lambda one: names(one) == hidden(one), "–"),
        share("… with D ≥ 25: right name first", [one for one in clear if smallest_D(one) >= 25.0], is_right, "–"),
        share("all singles: right name first", singles, is_right, "–"),
        share("all singles: the 95 % set holds the truth", singles, _holds, "93 … 98 %", least=0.93, most=0.98),
        Score("… that its stated probabilities let expect", f"{100.0 * _stated(singles):.1f} %", "–", "–",
              len(singles), None),
        number("… median size of that set", sizes, "≤ 2", "{:.0f}", most=2.0),
        share("twins: the verdict is a set that holds the truth", twins,
              lambda one: one["verdict"] == "undecided" and _holds(one), "all", least=0.9999),
    ]  # fmt: skip


def _sudden(results: Sequence[Result]) -> list[Score]:
    cases = of(results, "sudden")
    clear = [one for one in cases if smallest_D(one) >= CLEAR]
    right = [one for one in cases if names(one) == hidden(one)]
    late = [abs(cause["start"] - one["starts"][cause["id"]]) for one in right for cause in one["causes"]]
    off, _, covered = errors(cases)
    return [
        share("from mid-trial on, D ≥ 16: right name first", clear, is_right, "≥ 97 %", least=0.97),
        share("… named outright", clear, lambda one: names(one) == hidden(one), "–"),
        share("from mid-trial on: the 95 % set holds the truth", cases, _holds, "–"),
        share("… a name that is wrong, or wrong in being from then on", cases,
              lambda one: not names(one) <= hidden(one), "≤ 1 %", most=0.01),
        number("… error of when it began", late, "–", "{:.2f} s"),
        number("… error of its parameter", off, "–", "{:.1%}"),
        share("… 95 % interval of its parameter covers the truth", [{"in": x} for x in covered],
              lambda one: one["in"], "–"),
    ]  # fmt: skip


def _healthy(results: Sequence[Result]) -> list[Score]:
    healthy = of(results, "healthy")
    sound = [one for one in results if one["kind"] != "degraded"]
    return [
        share("healthy: false names", healthy, lambda one: bool(one["causes"]), "≤ 1 %", most=0.01),
        share("healthy: `nothing_wrong`", healthy, lambda one: one["verdict"] == "nothing_wrong", "–"),
        share(
            "healthy: called outside the catalogue",
            healthy,
            lambda one: one["verdict"] == "outside_catalogue",
            "–",
        ),
        share("all cases: a wrong name with p ≥ 0.95", sound, wrongly_sure, "≤ 0.5 %", most=0.005),
        *_calibrated(sound),
        Score(
            "… stated less right, on average (below 0: too modest)",
            f"{_overstated(sound):+.3f}",
            "0",
            "–",
            len(sound),
            None,
        ),
    ]


def _calibrated(sound: Sequence[Result]) -> list[Score]:
    """Return the calibration error, and what chance alone makes of it."""
    _, error = calibration(sound)
    stated = np.array([first(one)[1] for one in sound])
    low, middle, high = np.percentile(by_chance(stated), [2.5, 50.0, 97.5]) if sound else (0.0, 0.0, 0.0)
    return [
        Score("expected calibration error", f"{error:.3f}", "≤ 0.03", "–", len(sound), error <= 0.03, error <= high),
        Score("… of an engine that is right exactly as often as it states", f"{middle:.3f}", "–",
              f"{low:.3f} … {high:.3f}", len(sound), None),
    ]  # fmt: skip


def _overstated(results: Sequence[Result]) -> float:
    """Return how much more is stated than is right."""
    return sum(first(one)[1] - is_right_as_told(one) for one in results) / max(len(results), 1)


def _pairs(results: Sequence[Result]) -> list[Score]:
    clear = [one for one in of(results, "pair") if smallest_D(one) >= CLEAR]
    return [
        share("pairs, both D ≥ 16: exactly named first", clear, is_right, "≥ 85 %", least=0.85),
        share("… at least one right", clear, lambda one: bool(set(first(one)[0].split(" + ")) & set(one["truth"])),
              "≥ 98 %", least=0.98),
    ]  # fmt: skip


def _outside(results: Sequence[Result]) -> list[Score]:
    cases = [one for one in of(results, "outside") if smallest_D(one) >= CLEAR]
    flagged = [one for one in cases if one["verdict"] == "outside_catalogue"]
    forces = [one for one in flagged if one["strange"] != "wandering"]
    rms = [one["outside"]["rms"] for one in forces if "rms" in one["outside"]]
    reported = [
        one for one in forces if one["outside"]["features"] and one["outside"].get("first") is not None
    ]
    return [
        share("outside, D ≥ 16: flagged", cases, is_right, "≥ 95 %", least=0.95),
        share("… with D ≥ 50: flagged", [one for one in cases if smallest_D(one) >= PLAIN], is_right, "–"),
        share("outside: confidently misnamed (p ≥ 0.95)", cases, wrongly_sure, "≤ 2 %", most=0.02),
        share("outside: axis (or channel) right, of those flagged", flagged,
              lambda one: one["outside"]["axis"] == one["outside"]["found"], "≥ 90 %", least=0.9),
        number("outside: RMS error of the history, of its largest", rms, "≤ 10 %", "{:.1%}", most=0.1),
        share("outside: right feature in the formula's first two", reported,
              lambda one: bool(set(one["outside"]["features"]) & set(one["outside"]["first"])), "≥ 70 %", least=0.7),
    ]  # fmt: skip


def _numbers(results: Sequence[Result]) -> list[Score]:
    off, stated, covered = errors(of(results, "single", "twin"))
    inside = share("… 95 % interval covers the truth", [{"in": x} for x in covered], lambda one: one["in"],
                   "93 … 97 %", least=0.93, most=0.97)  # fmt: skip
    return [
        number("parameter of the named cause: error", off, "median ≤ 4 %", "{:.1%}", most=0.04),
        number("… that its stated standard deviation lets expect", expected(stated), "–", "{:.1%}"),
        inside,
    ]


def _gains(results: Sequence[Result]) -> list[Score]:
    right = [
        one
        for one in of(results, "single")
        if names(one) == hidden(one) and "extended" in one.get("gain", {})
    ]
    named = [one for one in of(results, "single", "pair") if "extended" in one.get("gain", {})]
    found = [number("held-out gain on the other manoeuvre, right cause", [gain_of(one, "extended") for one in right],
                    "≥ 0.95", "{:.4f}", least=0.95)]  # fmt: skip
    found += [
        number(words, [gain_of(one, model) for one in right if model in one["gain"]], "–", "{:.4f}")
        for words, model in (
            ("… of the refit within tolerances", "tolerance"),
            ("… of the best rival", "rival"),
        )
    ]
    harm = share("harm: worse than the nominal model there", [one for one in named if one["causes"]],
                 lambda one: gain_of(one, "extended") < 0.0, "≤ 1 %", most=0.01)  # fmt: skip
    return [*found, harm]


def _degraded(results: Sequence[Result]) -> list[Score]:
    cases = of(results, "degraded")
    healthy = [one for one in cases if not one["truth"]]
    return [
        share("degraded, healthy: false names", healthy, lambda one: bool(one["causes"]), "≤ 5 %", most=0.05),
        share("degraded: a wrong name with p ≥ 0.95", cases, wrongly_sure, "–"),
    ]


def _baselines(results: Sequence[Result]) -> list[Score]:
    clear = [one for one in of(results, "single") if smallest_D(one) >= CLEAR]
    healthy = of(results, "healthy")
    return [
        share("score test, D ≥ 16: right name first", clear, lambda one: one["score"][0] in one["truth"], "–"),
        share("score test, healthy: alarms", healthy, lambda one: bool(one["score"][1]), "–"),
        share("forward selection by BIC, D ≥ 16: right name first", clear,
              lambda one: one["selection"][:1] == list(one["truth"]), "–"),
        share("… D ≥ 16: the truth and nothing else", clear, lambda one: one["selection"] == list(one["truth"]), "–"),
        share("forward selection by BIC, healthy: names something", healthy, lambda one: bool(one["selection"]), "–"),
    ]  # fmt: skip
