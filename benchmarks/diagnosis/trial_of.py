"""One case from end to end: make it, measure its D, diagnose it, and put down what was said as plain values."""

from __future__ import annotations

from functools import cache
from hashlib import sha256
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np

from subzero.diagnosis.api import diagnose_trials
from subzero.diagnosis.assessment import separation
from subzero.diagnosis.inference import Problem, pose
from subzero.diagnosis.results import Verdict

from . import baselines
from .cases import Case, Made, make
from .distance import change_by, discriminations, sensitivities, signals, strangeness, sudden_distance
from .held_out import gains
from .sharing import Shared
from .strange_found import judged
from .truth import with_true_noise

Result = dict[str, Any]
ATTEMPTS, LISTED = {"outside": 12, "twin": 40}, 12
SHOWN = 12
"""Of the first so many cases what they could show is kept: of every manoeuvre one is among them."""
CONFOUNDED, CLEAR = 4.0, 16.0
"""A twin has D below the first against its rival, around the nominal model and where the truth flies, and above the
second against nothing."""


def result_of(case: Case, shared: Shared, budget: str = "verdict") -> Result:
    """Return what a case is, what the diagnosis says of it, and what other ways say."""
    made, problem, verdict, found = _asked(case, budget)
    plain, r, J = baselines.white(problem)
    found["score"] = baselines.score(plain, r, J)
    found["selection"] = baselines.selection(plain, r, J)
    if case.kind in ("single", "pair") and case.number % 2 == 0 and shared.work is not None:
        found["gain"] = gains(case, made, verdict, shared.work)
    if case.index < SHOWN:
        found["detectable"] = _detectable(verdict)
    return found


def briefly(case: Case) -> Result:
    """Return what a case is, and what the diagnosis says of it."""
    return _asked(case, "verdict")[3]


def _asked(case: Case, budget: str) -> tuple[Made, Problem, Verdict, Result]:
    """Return a case, and what the diagnosis says of it."""
    made, problem, D, rival = posed(case)
    start, cpu = perf_counter(), process_time()
    verdict = diagnose_trials([made.logged], seed=case.index, budget=budget)
    taken = {"wall": perf_counter() - start, "cpu": process_time() - cpu, "parts": dict(verdict.seconds)}
    found = {**_truth(case, made), "code": code(), "D": D, "rival": rival, "seconds": taken, **_said(verdict)}
    if made.strange:
        found["outside"] = judged(made, verdict)
    return made, problem, verdict, found


def posed(case: Case) -> tuple[Made, Problem, dict[str, float], dict[str, str]]:
    """Return a case with D of each of its causes; twins and strange ones drawn until they are what they should be.

    Raises:
        LookupError: no draw is a twin.
    """
    for attempt in range(ATTEMPTS.get(case.kind, 1)):
        made = make(case, attempt, size=1.3 ** min(attempt, 5))
        problem = with_true_noise(pose([made.logged]), 3.0 if case.how == "noise" else 1.0)
        D, rival, fits = _measured(case, made, problem)
        if fits:
            break
    if case.kind == "twin" and not fits:
        message = f"No draw of case {case.index}, {case.causes}, is a twin."
        raise LookupError(message)
    return made, problem, D, rival


@cache
def code() -> str:
    """Return eight digits that change with any edit of what diagnoses."""
    root, digest = Path(__file__).resolve().parents[2], sha256()
    for package in ("cable", "vehicle", "scenarios", "subzero"):
        for path in sorted((root / package).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:8]


def _measured(case: Case, made: Made, problem: Problem) -> tuple[dict[str, float], dict[str, str], bool]:
    """Return D and rival of each cause, and whether the case is what its kind should be."""
    if case.kind not in ("single", "pair", "twin", "outside", "degraded", "sudden"):
        return {}, {}, True
    J = sensitivities(problem)
    if made.starts:
        ((one, time),) = made.starts.items()
        D, rival = sudden_distance(problem, J, one, made.hidden[one], time)
        return {one: D}, {one: rival}, True
    if made.strange:
        D, rival = _strange(made, problem, J)
        return {made.strange.kind: D}, {made.strange.kind: rival}, D >= CLEAR
    found = discriminations(problem, J, {one: v for one, v in made.hidden.items() if _known(problem, one)})
    D, rivals = {one: d for one, (d, _) in found.items()}, {one: who for one, (_, who) in found.items()}
    if case.kind != "twin":
        return D, rivals, True
    clear = min(signals(problem, J, made.hidden).values()) >= CLEAR
    close = all(d < CONFOUNDED for d in D.values())
    return D, rivals, clear and close and _there(problem, made) < CONFOUNDED


def _there(problem: Problem, made: Made) -> float:
    """Return D of what is hidden where the truth flies: a vehicle that dives tells scale and bias of depth apart."""
    z = np.array([made.values[entry.effect.id][entry.place] for entry in problem.entries])
    return separation(problem, problem.jacobian(z), z, tuple(made.hidden))[0]


def _known(problem: Problem, one: str) -> bool:
    return any(entry.effect.id == one for entry in problem.entries)


def _strange(made: Made, problem: Problem, J: np.ndarray) -> tuple[float, str]:
    """Return D of what is outside the catalogue."""
    assert made.strange is not None
    seen = problem.records[0]
    if made.strange.drift is None:
        return strangeness(problem, J, change_by(problem, seen.setting, made.strange.on(seen.setting)))
    shift = dict.fromkeys(seen.noise, 0.0 * seen.time)
    shift[made.strange.axis] = made.strange.drift(seen.time)
    change = np.concatenate([noise.whiten(shift[name]) for name, noise in seen.noise.items()])
    return strangeness(problem, J, change)


def _truth(case: Case, made: Made) -> Result:
    """Return what is true."""
    return {"seed": case.seed, "index": case.index, "kind": case.kind, "manoeuvre": case.manoeuvre, "how": case.how,
            "number": case.number, "truth": {one: list(values) for one, values in made.hidden.items()},
            "starts": dict(made.starts), "strange": made.strange.kind if made.strange else "",
            "dropped": made.dropped}  # fmt: skip


def _said(verdict: Verdict) -> Result:
    """Return what is said."""
    causes = [{"id": cause.id, "p": cause.probability, "start": cause.start_time, "start_sd": cause.start_sd,
               "parameters": {name: [one.deviation, one.low - one.nominal, one.high - one.nominal, one.deviation_sd]
                              for name, one in cause.parameters.items()}} for cause in verdict.causes]  # fmt: skip
    ranked = list(verdict.probabilities.items())
    return {"verdict": verdict.verdict, "causes": causes, "probabilities": dict(ranked[:LISTED]),
            "set": _set(ranked), "kappa": {str(k): p for k, p in verdict.tolerance_scale.items()},
            "strain": max((abs(mean) for mean, _ in verdict.deviations.values()), default=0.0),
            "advice": verdict.next_trial.name if verdict.next_trial else ""}  # fmt: skip


def _set(ranked: list[tuple[str, float]], total: float = 0.95) -> list[str]:
    """Return the most probable hypotheses that together have 95 %."""
    found, have = [], 0.0
    for name, p in ranked:
        found.append(name)
        have += p
        if have >= total:
            break
    return found


def _detectable(verdict: Verdict) -> list[list[Any]]:
    """Return id, signal, smallest sizes, rival, D and likeness of every cause."""
    return [[one.id, one.signal, dict(one.smallest), one.rival, one.discrimination, one.cosine]
            for one in verdict.detectable]  # fmt: skip
