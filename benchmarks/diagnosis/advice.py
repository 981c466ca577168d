"""Does the next trial decide? The advice is taken and flown by the truth: ``python -m benchmarks.diagnosis.advice``.

Of single causes that the benchmark left undecided on fig6, the truth and its best rival are taken. The trial that is
proposed for these two is flown by the truth, run by the other formulation, and both records are diagnosed together.
Whether any trial of the library could decide at all is asked of all of them (D ≥ 16).
"""

from __future__ import annotations

import json
import multiprocessing
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cyclopts

from subzero.diagnosis.api import diagnose_trials
from subzero.diagnosis.assessment import DECISIVE_DISCRIMINATION, LIBRARY, flown, next_trial, outlooks
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference import Findings
from subzero.diagnosis.results import UNDECIDED, NextTrial

from .cases import AFTER, SEED, Case, Made, cases
from .draws import with_values
from .held_out import STARTS
from .manoeuvres import CHANNELS, times
from .results import place, read
from .sharing import Shared, share
from .trial_of import Result, posed
from .truth import NoRunError, agreed, noisy

DECIDED = 0.95
OPTIMISED = 40.0
"""Length of a trial that was made to measure. [s]"""
app = cyclopts.App(name="python -m benchmarks.diagnosis.advice", help_format="plaintext", version_flags=[])
_shared: list[Shared] = []


@app.default
def benchmark(*, count: int = 20, workers: int = 2, seed: int = SEED, results: Path | None = None) -> None:
    """Take the advice, and keep what came of it for the page of the benchmark; an interrupted run goes on.

    Args:
        count: of undecided cases.
        workers: processes.
        seed: of all cases.
        results: the benchmark's results; the advice is kept beside them.
    """
    known = results or place(seed)
    path, undecided = beside(known), {one["index"] for one in read(known) if _is_open(one)}
    done = {one["index"] for one in kept(known)}
    asked = [case for case in cases(seed) if case.index in undecided][:count]
    asked = [case for case in asked if case.index not in done]
    with (
        multiprocessing.get_context("fork").Pool(workers, initializer=_begin) as pool,
        path.open("a") as file,
    ):
        for one in pool.imap_unordered(_measured, asked):
            file.write(json.dumps(one) + "\n")
            file.flush()
            print(one, flush=True)


def _is_open(one: Result) -> bool:
    """Say whether a result is an undecided single cause on fig6."""
    single = one["kind"] in ("single", "twin") and one["manoeuvre"] == "fig6"
    return single and one.get("verdict") == UNDECIDED


def beside(results: Path) -> Path:
    """Return where the advice is kept."""
    return results.with_suffix(".advice.jsonl")


def kept(results: Path) -> list[Result]:
    """Return what came of the advice."""
    path = beside(results)
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def _begin() -> None:
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    _shared.append(share(1))


def _measured(case: Case) -> Result:
    made = posed(case)[0]
    before = diagnose_trials([made.logged], seed=case.index, budget="verdict")
    work = _shared[0].work
    assert work is not None
    pair = _pair(case, work)
    found: Result = {"index": case.index, "truth": case.causes[0], "before": before.verdict}
    if len(pair) < 2:
        return {**found, "skipped": "nothing else was fitted"}
    best = {name: view.discrimination() for name, view in outlooks(work.problem, pair)}
    if not best:
        return {**found, "skipped": "no trial of the library stays at safe depths with both"}
    found |= {"rival": " + ".join(pair[1].ids) or "none", "library": max(best.values()),
              "able": max(best, key=lambda name: best[name])}  # fmt: skip
    advice = next_trial(work.problem, pair, seed=case.index)
    assert advice is not None
    found |= {"advice": advice.name, "channel": advice.channel, "promised": advice.decides}
    try:
        second = _flown(case, made, advice)
    except NoRunError:
        return {**found, "skipped": "there is no one truth there"}
    after = diagnose_trials([made.logged, second], seed=case.index, budget="verdict")
    return {**found, **_judged(case, after.probabilities, found["rival"]), "after": after.verdict}


def _pair(case: Case, work: Findings) -> list:
    """Return the candidates of the truth and of its best rival."""
    candidates = work.search.candidates
    work.search.fit(case.causes)
    others = [one for ids, one in candidates.items() if not set(ids) & set(case.causes)]
    return [candidates[case.causes], max(others, key=lambda one: one.log_posterior)] if others else []


def _flown(case: Case, made: Made, advice: NextTrial) -> Logged:
    """Return the record of a trial that was proposed, flown by the truth."""
    setting, channels = _trial(made.logged.setting, advice), (*CHANNELS, *filter(None, [advice.channel]))
    values = {name: one for name, one in made.values.items() if not name.startswith(STARTS)}
    true = with_values(setting, values)
    true = replace(true, trial=replace(true.trial, duration=true.trial.duration + AFTER))
    shown = agreed(true, times(setting), channels)
    record = noisy(shown, times(setting), case.rng(attempt=999))
    return Logged(record=record, setting=setting, name="advised")


def _trial(setting: Setting, advice: NextTrial) -> Setting:
    """Return the setting of a trial that was proposed."""
    if advice.name in LIBRARY:
        return LIBRARY[advice.name][1](setting)
    if advice.name == "same":
        return setting
    return flown(setting, advice.commands, OPTIMISED)  # type: ignore[arg-type]


def _judged(case: Case, probabilities: dict[str, float], rival: str) -> Result:
    """Return what both records say of the two."""
    truth, other = probabilities.get(case.causes[0], 0.0), probabilities.get(rival, 0.0)
    first = max(probabilities, key=lambda name: probabilities[name])
    return {"odds": truth / max(truth + other, 1e-12), "first": first, "p": probabilities[first]}


def decided(results: Sequence[Result]) -> tuple[list[Result], list[Result]]:
    """Return what some trial of the library could decide, and what of it was decided for the truth."""
    able = [one for one in results if "odds" in one and one["library"] >= DECISIVE_DISCRIMINATION]
    return able, [one for one in able if one["odds"] >= DECIDED]


if __name__ == "__main__":
    app()
