"""The page docs/diagnosis_world.md: how often verdicts are right on records that were not made for the engine.

    python -m benchmarks.diagnosis.world_page

writes it from what is kept of `benchmarks.diagnosis.world`, `data_errors`, `outside`, `onsets`, `jitter` and
`calibration`, each of the seed below, which no choice was made with. Figures whose records are few have wide intervals;
the page shows them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import calibration, data_errors, jitter, onsets, outside, scores, world
from .results import read
from .scores import Score, share, table

Rows = Sequence[Mapping[str, Any]]
SEEDS = {
    "world": 5702,
    "data_errors": 12101,
    "outside": 91,
    "onsets": 3,
    "jitter": 10505,
    "calibration": 31337,
}
"""Of what the page rests on."""
PAGE = Path(__file__).resolve().parents[2] / "docs" / "diagnosis_world.md"
KEPT = Path(__file__).parent / "kept"
FAMILY_COLUMNS = (
    "noise",
    "healthy: none first",
    "healthy: named, outside or an error reported",
    "D ≥ 25: right first",
    "wrong with p ≥ 0.95",
)
MEDIAN_S, MOST_S, WORST_S = 10.0, 20.0, 40.0
"""Targets of the time of a verdict: in the median, of 95 % of the records, of every one. [s]"""
HEAD = """# How often verdicts are right

Measured on records that were not made for the diagnosis: any shipped manoeuvre or random commands, nine families of
noise, healthy or with one hidden cause of any size; errors in the data; forces not in the catalogue; copies that
differ by a hundredth of the noise. Truths come from the other formulation of the cable, with every number drawn from
its tolerance. No choice in the program was made with these seeds before they were judged. Every record counts as it was
first judged.

**The records of the world are judged by the engine for any model** (30 November 2026, with two or three other programs
on two processors, so that times are too long); names of records that no model is near to have changed since. **All
other results, from errors in the data on, are of the search for causes that it replaced**: they are what it is to be
held against, and are not yet measured anew. The page is written by

    python -m benchmarks.diagnosis.world_page

from the results, kept in `benchmarks/diagnosis/kept`, of

{commands}

D is the squared distance, with the true noise, of the hidden cause from the best rival with all tolerances
free; a cause with D of 25 or more should be named. Intervals are exact binomial ones: where there are few records, they
are wide, and "near" says that the interval reaches the target."""


def write_page() -> Path:
    """Write the page and return its path."""
    found = {name: list(filter(is_sound, read(path_of(name)))) for name in SEEDS}
    parts = [
        HEAD.format(commands=_commands(found)),
        "## Figures and targets\n\n" + _scores(found),
        "## By the family of the noise\n\n" + _families(found["world"]),
        "## Errors in the data\n\n```\n" + data_errors.table(found["data_errors"]) + "\n```",
        "## What was missed\n\n" + _missed(found["world"], found["data_errors"]),
    ]
    PAGE.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    return PAGE


def is_sound(one: Mapping[str, Any]) -> bool:
    """Say whether a record was judged; what a calibration has as its error is a table of numbers."""
    return not isinstance(one.get("error"), str)


def path_of(name: str) -> Path:
    """Return where the results of a benchmark are kept that the page rests on."""
    return KEPT / f"{name}_{SEEDS[name]}.jsonl"


def _commands(found: Mapping[str, Rows]) -> str:
    """Return what made the results, and how many there are."""
    return "\n".join(
        f"    python -m benchmarks.diagnosis.{name} --seed {SEEDS[name]} --count {len(rows)}"
        for name, rows in found.items()
        if rows
    )


def _scores(found: Mapping[str, Rows]) -> str:
    """Return the table of the figures that have a target."""
    rows = [
        *of_world(found["world"]),
        *of_time(found["world"]),
        *of_data_errors(found["data_errors"]),
        *of_outside(found["outside"]),
        *of_onsets(found["onsets"]),
        *of_jitter(found["jitter"]),
        *of_calibration(found["calibration"]),
    ]
    body = [
        [one.words, one.value, one.interval, str(one.cases), one.target, one.mark]
        for one in rows
        if one.cases
    ]
    return table(["figure", "value", "95 % interval", "records", "target", ""], body)


def excludes_physics(one: Mapping[str, Any]) -> bool:
    """Say whether a record has a cause that should be named."""
    return bool(one["D"]) and min(one["D"].values()) >= world.CLEAR


def of_world(results: Rows) -> list[Score]:
    """Return the figures of healthy records and single causes, over all families."""
    healthy = [one for one in results if not one["cause"]]
    clear = [one for one in results if excludes_physics(one)]
    stated = np.array([one["p"] for one in results])
    right = np.array([float(world.is_right(one)) for one in results])
    error = scores.calibration_error(stated, right) if results else 0.0
    chance = scores.by_chance(stated) if results else np.zeros(1)
    low, middle, high = np.percentile(chance, [2.5, 50.0, 97.5])
    return [
        share("healthy: named, outside, or an error reported", healthy, world.is_false_alarm, "≤ 1 %", most=0.01),
        share("one cause, D ≥ 25: right first", clear, world.is_right, "≥ 95 %", least=0.95),
        share("wrong with p ≥ 0.95", results, world.is_confidently_wrong, "≤ 1 %", most=0.01),
        Score("probabilities: mean error of calibration", f"{error:.3f}", "≤ 0.03", "–", len(results), error <= 0.03,
              error <= high),
        Score("… of an engine that is right exactly as often as it states", f"{middle:.3f}", "–",
              f"{low:.3f} … {high:.3f}", len(results), None),
    ]  # fmt: skip


def of_time(results: Rows) -> list[Score]:
    """Return how long a verdict takes, by the clock of a machine that has other work, and of the processor."""
    found = []
    for name, key in (("processor", "cpu"), ("clock, machine shared", "seconds")):
        times = [one[key] for one in results if key in one]
        for words, rank, most in (("median", 50, MEDIAN_S), ("95 %", 95, MOST_S), ("worst", 100, WORST_S)):
            value = float(np.percentile(times, rank)) if times else 0.0
            found.append(Score(f"time of a verdict, {name}: {words}", f"{value:.1f} s", f"≤ {most:g} s", "–",
                               len(times), value <= most))  # fmt: skip
    return found


def of_data_errors(results: Rows) -> list[Score]:
    """Return the figures of records with an error in their data, and of others."""
    wrong = [one for one in results if one["kinds"]]
    sound = [one for one in results if not one["kinds"]]
    return [
        share("errors in the data: exactly these named", wrong, _is_named, "≥ 95 %", least=0.95),
        share("… taken for physics with p ≥ 0.95", wrong, data_errors.is_taken_for_physics, "none", most=0.0),
        share("no error in the data: one reported", sound, lambda one: not one["named"], "–"),
    ]


def _is_named(one: Mapping[str, Any]) -> bool:
    return bool(one["named"])


def of_outside(results: Rows) -> list[Score]:
    """Return the figures of forces and drifts outside the catalogue; weed that gathers is one that fouls the hull."""
    clear = list(filter(outside.is_clear, results))
    flagged = [one for one in clear if one["outside"]["found"]]
    return [
        share("not in the catalogue, D ≥ 16: reported", clear, outside.is_right, "≥ 95 %", least=0.95),
        share("… with the right axis or channel", flagged, outside.has_right_axis, "≥ 90 %", least=0.90),
    ]


def of_onsets(results: Rows) -> list[Score]:
    """Return the figures of causes that only begin in mid-trial: jams, and slow changes."""
    clear = [one for one in results if one["D"] >= onsets.CLEAR]
    return [
        share(
            "jam or slow change from mid-trial on, D ≥ 16: right first",
            clear,
            onsets.is_right,
            "≥ 95 %",
            least=0.95,
        ),
        share("… wrong with p ≥ 0.95", results, onsets.is_confidently_wrong, "–"),
    ]


def of_jitter(results: Rows) -> list[Score]:
    """Return how many copies that say the same get the same verdict and first name."""
    copies = [{"same": same} for one in results for same in jitter.repeats(one)]
    words = "copies that differ by a hundredth of the noise: same verdict and name"
    return [share(words, copies, lambda one: bool(one["same"]), "≥ 98 %", least=0.98)]


def of_calibration(results: Rows) -> list[Score]:
    """Return how many intervals of calibrations hold the truth."""
    reported = [one for one in results if "numbers" in one and calibration.is_reported(one)]
    numbers = [row for one in reported for row in one["numbers"].values()]
    words = "calibration: intervals of 95 % hold the truth"
    return [share(words, numbers, lambda one: bool(one["held"]), "93 … 97 %", least=0.93, most=0.97)]


def _families(results: Rows) -> str:
    """Return a row for every family of noise."""
    body = []
    for name in (*world.FAMILIES, "all"):
        own = [one for one in results if name in (one["family"], "all")]
        healthy, clear = (
            [one for one in own if not one["cause"]],
            [one for one in own if excludes_physics(one)],
        )
        counts = [
            (world.is_right, healthy), (world.is_false_alarm, healthy),
            (world.is_right, clear), (world.is_confidently_wrong, own),
        ]  # fmt: skip
        body.append([f"`{name}`" if name != "all" else "all", *(_of(rule, some) for rule, some in counts)])
    return table(FAMILY_COLUMNS, body)


def _of(rule: Callable[[Any], bool], some: Rows) -> str:
    return f"{sum(map(rule, some))} of {len(some)}"


def _missed(results: Rows, errors: Rows) -> str:
    """Return the line of every record that is not as it should be."""
    missed = [
        world.line_of(one)
        for one in sorted(results, key=lambda one: one["index"])
        if world.is_confidently_wrong(one)
        or world.is_false_alarm(one)
        or (excludes_physics(one) and not world.is_right(one))
    ]
    missed += [
        data_errors.line_of(one) for one in sorted(errors, key=lambda one: one["index"]) if not one["named"]
    ]
    return "```\n" + "\n".join(missed) + "\n```"


if __name__ == "__main__":
    print(write_page())
