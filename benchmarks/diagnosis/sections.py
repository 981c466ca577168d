"""Sections of the page: what was missed and what is confounded, limits, degraded records, advice, times, every case."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from .advice import decided
from .degraded import rows
from .scores import CLEAR, Result, Score, first, is_right, names, of, smallest_D, truth, wrongly_sure
from .times import LIMITS, Row
from .words import (
    ADVICE_WORDS,
    ALONE_WORDS,
    CONFOUNDED_WORDS,
    DEGRADED_WORDS,
    LIMITS_WORDS,
    MISSED_WORDS,
    TIMES_WORDS,
)

CONFOUNDED = 9.0
MARK = {True: "pass", False: "**FAIL**", None: ""}


def table(header: Sequence[str], body: Sequence[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *body]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def missed(results: Sequence[Result]) -> str:
    """Return every case that should have been told and was not."""
    body = [[str(one["index"]), one["kind"], one["manoeuvre"] + (f" ({one['how']})" if one["how"] else ""), _true(one),
             *_said(one)] for one in results if _ismissed(one)]  # fmt: skip
    header = ["case", "kind", "manoeuvre", "truth (D, closest rival)", "verdict", "first hypothesis", "p"]
    return f"## What was missed\n\n{MISSED_WORDS}\n\n" + table(header, body)


def _ismissed(one: Result) -> bool:
    """Say whether a case with D ≥ 16 throughout was not told rightly, or a healthy one got a name."""
    if one["kind"] == "healthy":
        return bool(one["causes"])
    return wrongly_sure(one) or (smallest_D(one) >= CLEAR and not is_right(one))


def _true(one: Result) -> str:
    """Return what is true, with D."""
    parts = [f"`{name}` ({d:.0f}, {one['rival'][name]})" for name, d in one["D"].items()]
    return ", ".join(parts) or truth(one)


def _said(one: Result) -> list[str]:
    """Return what was said."""
    name, p = first(one)
    named = " + ".join(sorted(names(one)))
    return [one["verdict"] + (f": {named}" if named else ""), name, f"{p:.2f}"]


def _tables_of(results: Sequence[Result]) -> dict[str, list]:
    """Return manoeuvre → what a healthy record of it can show."""
    found: dict[str, list] = {}
    for one in of(results, "healthy", "single"):
        if one.get("detectable") and one["manoeuvre"] not in found:
            found[one["manoeuvre"]] = one["detectable"]
    return found


def confounded(results: Sequence[Result]) -> str:
    """Return the pairs that a manoeuvre cannot tell apart."""
    body = [[manoeuvre, f"`{name}`", f"`{rival}`", f"{D:.1f}", f"{alike:.3f}"]
            for manoeuvre, table in _tables_of(results).items()
            for name, _, _, rival, D, alike in table if CONFOUNDED > D]  # fmt: skip
    header = ["manoeuvre", "cause, one effect scale", "closest rival", "D", "cosine"]
    return f"## What is confounded with what\n\n{CONFOUNDED_WORDS}\n\n" + table(header, body)


def limits(results: Sequence[Result]) -> str:
    """Return the smallest sizes that would be seen, and those that could be told from the closest rival."""
    tables = {name: {row[0]: row for row in table} for name, table in _tables_of(results).items()}
    every = list(dict.fromkeys(one for table in tables.values() for one in sorted(table)))
    header = [
        "cause",
        *(f"{name}: {what}" for name in tables for what in ("smallest seen", "signal, D at one scale")),
    ]
    body = [
        [f"`{one}`", *(cell for table in tables.values() for cell in _limit(table.get(one)))] for one in every
    ]
    return f"## Detection limits\n\n{LIMITS_WORDS}\n\n" + table(header, body)


def _limit(row: list | None) -> tuple[str, str]:
    if row is None:
        return "–", "–"
    _, signal, smallest, rival, D, _ = row
    return ", ".join(
        f"{name} {size:.3g}" for name, size in smallest.items()
    ), f"{signal:.1f}, {D:.0f} ({rival})"


def degraded(results: Sequence[Result]) -> str:
    """Return what becomes of records that are worse than usual."""
    body = [
        [
            how,
            str(false.cases),
            f"{false.value} ({false.interval})",
            str(right.cases),
            right.value,
            wrong.value,
        ]
        for how, false, right, wrong in rows(results)
    ]
    header = [
        "how",
        "healthy records",
        "false names (target: ≤ 5 %)",
        "singles",
        "right first",
        "wrong name with p ≥ 0.95",
    ]
    return f"## Degraded records\n\n{DEGRADED_WORDS}\n\n" + table(header, body)


def mark(s: Score) -> str:
    """Return whether a figure meets its target, if it is judged, or its interval reaches it."""
    return MARK[s.met] + (" (near)" if s.met is False and s.near else "")


def counted(found: Sequence[Score]) -> str:
    """Return how many figures meet their targets, in a sentence."""
    met, judged = sum(s.met is True for s in found), sum(s.met is not None for s in found)
    near = sum(s.met is False and s.near for s in found)
    return f"**{met} of {judged} targets are met** on these cases; {near} of the others are near."


def advice(results: Sequence[Result]) -> str:
    """Return what came of flying the trials that were proposed."""
    able, good = decided(results)
    body = [[str(one["index"]), f"`{one['truth']}`", f"`{one['rival']}`", f"{one['able']} ({one['library']:.0f})",
             one["advice"] + (f" + {one['channel']}" if one["channel"] else ""), f"{one['promised']:.2f}",
             f"{one['odds']:.3f}"] for one in results if "odds" in one]  # fmt: skip
    header = [
        "case",
        "truth",
        "rival",
        "best of the library (D)",
        "advice",
        "promised",
        "truth : both, afterwards",
    ]
    share = f"**{len(good)} of {len(able)}** pairs that a trial of the library can decide are decided (target: 80 %)."
    left = [f"{one['index']} ({one['skipped']})" for one in results if "skipped" in one]
    reported = f"\n\nNot counted: {', '.join(left)}." if left else ""
    return f"## The next trial\n\n{ADVICE_WORDS}\n\n{share}\n\n" + table(header, body) + reported


def times(results: Sequence[Result], alone: Sequence[Row]) -> str:
    """Return how long a diagnosis takes."""
    body = []
    for manoeuvre in ("fig6", "rich"):
        own = [one["seconds"] for one in results if one["manoeuvre"] == manoeuvre]
        if own:
            cells = [np.percentile([one[key] for one in own], [50, 90]) for key in ("cpu", "wall")]
            body.append([manoeuvre, str(len(own)), *(f"{a:.0f} s, {b:.0f} s" for a, b in cells)])
    header = ["manoeuvre", "cases", "processor time: median, nine in ten", "wall clock: median, nine in ten"]
    single = table(["manoeuvre", "record", "records", "first screen: median, slowest", "verdict: median, slowest"],
                    _alone(alone))  # fmt: skip
    return f"## Times\n\n{ALONE_WORDS}\n\n{single}\n\n{TIMES_WORDS}\n\n" + table(header, body)


def _alone(alone: Sequence[Row]) -> list[list[str]]:
    """Return a line for each kind of record on each manoeuvre."""
    body = []
    for manoeuvre, words in dict.fromkeys(row[:2] for row in alone):
        taken = np.array([row[2:] for row in alone if row[:2] == (manoeuvre, words)])
        cells = [", ".join(_within(float(s), limit) for s in (np.median(part), np.max(part)))
                 for part, limit in zip(taken.T, LIMITS[manoeuvre], strict=True)]  # fmt: skip
        body.append([manoeuvre, words, str(len(taken)), *cells])
    return body


def _within(seconds: float, limit: float) -> str:
    """Return a time, and whether it is within what is asked, if anything is."""
    return (
        f"{seconds:.1f} s" if limit == inf else f"{seconds:.1f} s (≤ {limit:.0f} s: {MARK[seconds <= limit]})"
    )


def all_cases(results: Sequence[Result]) -> str:
    """Return a line for every case with a truth."""
    body = [[str(one["index"]), one["manoeuvre"] + (f" ({one['how']})" if one["how"] else ""), _true(one), *_said(one)]
            for one in sorted(results, key=lambda one: one["index"]) if one["D"]]  # fmt: skip
    header = ["case", "manoeuvre", "truth (D, closest rival)", "verdict", "first hypothesis", "p"]
    return "## Every case with something hidden\n\n" + table(header, body)
