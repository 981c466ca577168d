"""The page docs/diagnosis_benchmark.md, from whatever results there are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import inf
from pathlib import Path

import numpy as np

from .advice import decided
from .cases import HEAVY, SHARES
from .figures_of import rows
from .pictures import FIGURES, draw
from .scores import CLEAR, Result, Score, first, is_right, names, of, smallest_D, truth, wrongly_sure
from .times import LIMITS, Row
from .truth import SAME
from .words import (
    ADVICE_WORDS,
    ALONE_WORDS,
    BEFORE_WORDS,
    CONFOUNDED_WORDS,
    HEAD,
    LIMITS_WORDS,
    MISSED_WORDS,
    NEAR_WORDS,
    TIMES_WORDS,
)

PAGE = FIGURES.parent / "diagnosis_benchmark.md"
CONFOUNDED = 9.0
MARK = {True: "pass", False: "**FAIL**", None: ""}


def write_page(
    results: Sequence[Result],
    alone: Sequence[Row] = (),
    advice: Sequence[Result] = (),
    before: Sequence[Result] = (),
) -> Path:
    """Write the page and its figures, and return its path.

    Args:
        results: that it rests on.
        alone: times of single diagnoses.
        advice: what came of it.
        before: results of another seed, with what the engine was before.
    """
    broken = [one for one in results if "error" in one]
    sound = [one for one in results if "error" not in one]
    draw(sound)
    parts = [_head(sound, broken), _scores(sound, before), _pictures(), _missed(sound),
             _confounded(sound), _limits(sound), _advice(advice), _times(sound, alone), _all_cases(sound)]  # fmt: skip
    PAGE.write_text("\n\n".join(parts) + "\n")
    return PAGE


def _table(header: Sequence[str], body: Sequence[Sequence[str]]) -> str:
    lines = [header, ["---"] * len(header), *body]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _head(results: Sequence[Result], broken: Sequence[Result]) -> str:
    """Return what the page is, and what it rests on."""
    count = Counter(one["kind"] for one in results)
    kinds = _table(["kind", "cases here", "of the whole benchmark"],
                   [[kind, str(count[kind]), str(whole)] for kind, whole in SHARES.items()])  # fmt: skip
    where = Counter(one["manoeuvre"] for one in results)
    return HEAD.format(
        cases=len(results), whole=sum(SHARES.values()), kinds=kinds, fig6=where["fig6"] + where["short"],
        rich=where["rich"], broken=len(broken), seed=results[0]["seed"], versions=_versions(results), same=SAME,
        dropped=sum(one["dropped"] for one in results), redrawn=sum(one["dropped"] > 0 for one in results),
        heavy=sum(one["dropped"] > 0 and HEAVY in one["truth"] for one in results),
    )  # fmt: skip


def _versions(results: Sequence[Result]) -> str:
    """Return by how many versions of the code the results were made; the last result is one of the newest."""
    newest = Counter(one.get("code", "") for one in results)[results[-1].get("code", "")]
    if newest == len(results):
        return "All cases were diagnosed by the same code."
    return f"{newest} cases were diagnosed by a newer version of the code than the others."


def _scores(results: Sequence[Result], before: Sequence[Result]) -> str:
    """Return the table of all figures, beside those that the engine had before."""
    found, earlier = rows(results), rows([one for one in before if "error" not in one])
    was = {s.words: f"{s.value} {MARK[s.met]}".strip() for s in earlier}
    body = [
        [s.words, s.value, s.interval, str(s.cases), s.target, _mark(s), was.get(s.words, "")] for s in found
    ]
    met, judged = sum(s.met is True for s in found), sum(s.met is not None for s in found)
    near = sum(s.met is False and s.near for s in found)
    words = BEFORE_WORDS.format(seed=before[0]["seed"], cases=len(before)) if before else ""
    header = ["figure", "value", "95 % interval", "cases", "target", "", "before"]
    count = f"**{met} of {judged} targets are met** on these cases; {near} of the others are near."
    return f"## It is right when\n\n{count} {NEAR_WORDS}\n\n{words}\n\n" + _table(header, body)


def _mark(s: Score) -> str:
    """Return whether a figure meets its target, if it is judged, or its interval reaches it."""
    return MARK[s.met] + (" (near)" if s.met is False and s.near else "")


def _pictures() -> str:
    return ("## What is taken for what\n\n![confusion](figures/diagnosis_confusion.png)\n\n"
            "## How certain, and how right\n\n![calibration](figures/diagnosis_calibration.png)\n\n"
            "![success over D](figures/diagnosis_success.png)")  # fmt: skip


def _missed(results: Sequence[Result]) -> str:
    """Return every case that should have been told and was not."""
    body = [[str(one["index"]), one["kind"], one["manoeuvre"] + (f" ({one['how']})" if one["how"] else ""), _true(one),
             *_said(one)] for one in results if _is_missed(one)]  # fmt: skip
    header = ["case", "kind", "manoeuvre", "truth (D, closest rival)", "verdict", "first hypothesis", "p"]
    return f"## What was missed\n\n{MISSED_WORDS}\n\n" + _table(header, body)


def _is_missed(one: Result) -> bool:
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


def _confounded(results: Sequence[Result]) -> str:
    """Return the pairs that a manoeuvre cannot tell apart."""
    body = [[manoeuvre, f"`{name}`", f"`{rival}`", f"{D:.1f}", f"{alike:.3f}"]
            for manoeuvre, table in _tables_of(results).items()
            for name, _, _, rival, D, alike in table if CONFOUNDED > D]  # fmt: skip
    header = ["manoeuvre", "cause, one effect scale", "closest rival", "D", "cosine"]
    return f"## What is confounded with what\n\n{CONFOUNDED_WORDS}\n\n" + _table(header, body)


def _limits(results: Sequence[Result]) -> str:
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
    return f"## Detection limits\n\n{LIMITS_WORDS}\n\n" + _table(header, body)


def _limit(row: list | None) -> tuple[str, str]:
    if row is None:
        return "–", "–"
    _, signal, smallest, rival, D, _ = row
    return ", ".join(
        f"{name} {size:.3g}" for name, size in smallest.items()
    ), f"{signal:.1f}, {D:.0f} ({rival})"


def _advice(results: Sequence[Result]) -> str:
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
    told = f"\n\nNot counted: {', '.join(left)}." if left else ""
    return f"## The next trial\n\n{ADVICE_WORDS}\n\n{share}\n\n" + _table(header, body) + told


def _times(results: Sequence[Result], alone: Sequence[Row]) -> str:
    """Return how long a diagnosis takes."""
    body = []
    for manoeuvre in ("fig6", "rich"):
        own = [one["seconds"] for one in results if one["manoeuvre"] == manoeuvre]
        if own:
            cells = [np.percentile([one[key] for one in own], [50, 90]) for key in ("cpu", "wall")]
            body.append([manoeuvre, str(len(own)), *(f"{a:.0f} s, {b:.0f} s" for a, b in cells)])
    header = ["manoeuvre", "cases", "processor time: median, nine in ten", "wall clock: median, nine in ten"]
    single = _table(["manoeuvre", "record", "records", "first screen: median, slowest", "verdict: median, slowest"],
                    _alone(alone))  # fmt: skip
    return f"## Times\n\n{ALONE_WORDS}\n\n{single}\n\n{TIMES_WORDS}\n\n" + _table(header, body)


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


def _all_cases(results: Sequence[Result]) -> str:
    """Return a line for every case with a truth."""
    body = [[str(one["index"]), one["manoeuvre"] + (f" ({one['how']})" if one["how"] else ""), _true(one), *_said(one)]
            for one in sorted(results, key=lambda one: one["index"]) if one["D"]]  # fmt: skip
    header = ["case", "manoeuvre", "truth (D, closest rival)", "verdict", "first hypothesis", "p"]
    return "## Every case with something hidden\n\n" + _table(header, body)
