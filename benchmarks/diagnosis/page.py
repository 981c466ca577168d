"""The page docs/diagnosis_benchmark.md, from whatever results there are.

``python -m benchmarks.diagnosis.page`` writes it from what there is of the run by now.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from . import advice, degraded, sections, times
from .cases import BEFORE, HEAVY, SEED, SETTLED, SHARES
from .figures_of import rows
from .pictures import FIGURES, draw
from .results import place, read
from .scores import Result
from .sections import MARK, counted, mark, table
from .truth import SAME
from .words import BEFORE_WORDS, HEAD, NEAR_WORDS, NOT_YET, UNFINISHED

PAGE = FIGURES.parent / "diagnosis_benchmark.md"


def write_page(path: Path, earlier: Path | None = None) -> Path:
    """Write the page and its figures, and return its path.

    Args:
        path: of the results that it rests on; times, advice and degraded records are beside them.
        earlier: of results of another seed, with what the engine was before.
    """
    results = read(path)
    before = read(earlier) if earlier and earlier != path else []
    broken = [one for one in results if "error" in one]
    sound = [one for one in results if "error" not in one]
    draw(sound)
    parts = [_head(sound, broken), _scores(sound, before), _pictures(), sections.missed(sound),
             sections.confounded(sound), sections.limits(sound),
             *_beside(sound, path, earlier), sections.all_cases(sound)]  # fmt: skip
    PAGE.write_text("\n\n".join(parts) + "\n")
    return PAGE


def _beside(results: Sequence[Result], path: Path, earlier: Path | None) -> list[str]:
    """Return the sections that rest on further records: those of these results, or else of the earlier ones."""
    parts = []
    for module, section in (
        (degraded, sections.degraded),
        (advice, sections.advice),
        (times, partial(sections.times, results)),
    ):
        here = module.kept(path)
        found = here or (module.kept(earlier) if earlier else [])
        part = section(found)
        parts.append(part if here or not found else part.replace("\n\n", f"\n\n{NOT_YET}\n\n", 1))
    return parts


def _head(results: Sequence[Result], broken: Sequence[Result]) -> str:
    """Return what the page is, and what it rests on."""
    count = Counter(one["kind"] for one in results)
    kinds = table(["kind", "cases here", "of the whole benchmark"],
                   [[kind, str(count[kind]), str(whole)] for kind, whole in SHARES.items()])  # fmt: skip
    where = Counter(one["manoeuvre"] for one in results)
    drawn = {
        "dropped": sum(one["dropped"] for one in results),
        "redrawn": sum(one["dropped"] > 0 for one in results),
        "heavy": sum(one["dropped"] > 0 and HEAVY in one["truth"] for one in results),
    }
    seed = results[0]["seed"]
    return HEAD.format(
        cases=len(results), whole=sum(SHARES.values()), kinds=kinds, fig6=where["fig6"] + where["short"],
        rich=where["rich"], broken=len(broken), seed=seed, settled=SETTLED[seed], versions=_versions(results),
        unfinished=_unfinished(count), same=SAME, **drawn,
    )  # fmt: skip


def _unfinished(count: Counter[str]) -> str:
    """Return a warning if some kinds are further than others."""
    shares = [count[kind] / whole for kind, whole in SHARES.items()]
    return UNFINISHED if max(shares) > min(shares) + 0.1 else ""


def _versions(results: Sequence[Result]) -> str:
    """Return by how many versions of the code the results were made; the last result is one of the newest."""
    newest = Counter(one.get("code", "") for one in results)[results[-1].get("code", "")]
    if newest == len(results):
        return "All cases were diagnosed by the same code."
    return f"{newest} cases were diagnosed by a newer version of the code than the others."


def _scores(results: Sequence[Result], before: Sequence[Result]) -> str:
    """Return the table of all figures, beside those that the engine had before."""
    found, earlier = rows(results), rows([one for one in before if "error" not in one]) if before else []
    was = {s.words: f"{s.value} {MARK[s.met]}".strip() for s in earlier}
    body = [
        [s.words, s.value, s.interval, str(s.cases), s.target, mark(s), was.get(s.words, "")] for s in found
    ]
    words = BEFORE_WORDS.format(seed=before[0]["seed"], cases=len(before)) if before else ""
    header = ["figure", "value", "95 % interval", "cases", "target", "", *(["before"] if before else [])]
    body = body if before else [line[:-1] for line in body]
    return f"## It is right when\n\n{counted(found)} {NEAR_WORDS}\n\n{words}\n\n" + table(header, body)


def _pictures() -> str:
    return ("## What is taken for what\n\n![confusion](figures/diagnosis_confusion.png)\n\n"
            "## How certain, and how right\n\n![calibration](figures/diagnosis_calibration.png)\n\n"
            "![success over D](figures/diagnosis_success.png)")  # fmt: skip


if __name__ == "__main__":
    print(write_page(place(SEED), place(BEFORE)))
