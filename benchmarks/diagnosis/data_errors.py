"""Errors in the data, in records of the world: are they named, and is nothing else taken for one?

Truths are by the other formulation, all numbers drawn from their tolerances, on the manoeuvres and with the noise of
`world`. Every other record has an error in its data (every fourth of these two of them), with a healthy vehicle or with
one cause; the others have none: a healthy vehicle, a cause, a large cause, or one that begins in mid-trial. D of an
error is the squared distance, with the true noise, of what it changes from all that one cause and the tolerances could
do; what has less than `CLEAR` is drawn again. Run it:

    python -m benchmarks.diagnosis.data_errors --count 400 --seed 1 --results found.jsonl --resume
"""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, NamedTuple

import cyclopts
import numpy as np

import subzero
from subzero.channels import BY_NAME, HEADING
from subzero.diagnosis.api import diagnose_trials
from subzero.diagnosis.hypothesis.catalogue import NOISE
from subzero.diagnosis.hypothesis.catalogue.sensors import CLOCK
from subzero.diagnosis.hypothesis.data_error import COMMAND_GROUPS, REFERENCES, SWAPS, DataError
from subzero.diagnosis.hypothesis.effect import with_onset
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference import Problem, pose, respond
from subzero.diagnosis.results import Verdict
from subzero.records.consistency import MISTAKEN
from subzero.records.record import Record

from . import onsets, world
from .distance import sensitivities, strangeness
from .draws import hidden, nuisances, with_values
from .manoeuvres import CHANNELS, ids
from .results import results_of
from .truth import NoRunError, agreed

KINDS = ("sign", "unit", "reference", "frozen", "step", "dropout", "swapped", "late_clock", "clock_rate", "latency",
         "command_sign", "command_swap")  # fmt: skip
OF_CLOCK = ("late_clock", "clock_rate")
"""Kinds that affect the times of all channels."""
PLAIN = ("healthy", "cause", "large", "begun")
"""What records without an error in their data hide."""
CLEAR, SURE = world.CLEAR, world.SURE
LARGE = 2.0
"""A large cause is so many times one of the benchmark's."""
DENSE_S = 0.05
"""Truths are read so often, and between those linear. [s]"""
SAME_DELAY_S, SAME_RATE, SAME_STEP = 0.3, 0.01, 0.3
"""A number is right within this: a delay [s], a rate [-], a step as a share of it."""
ATTEMPTS = 30
app = cyclopts.App(
    name="python -m benchmarks.diagnosis.data_errors", help_format="plaintext", version_flags=[]
)


class Made(NamedTuple):
    """A record, what is wrong with its data, with D of each, and what is hidden in the vehicle."""

    logged: Logged
    errors: tuple[DataError, ...]
    D: tuple[float, ...]
    hidden: str


@dataclass(frozen=True, kw_only=True)
class Truth:
    """What happened, without noise, often enough to be read at any time: a record, its trial, and what was hidden."""

    dense: Logged
    hidden: str


class Case(NamedTuple):
    """A record that is to be made: the world's draw, kinds of errors in its data, and what the vehicle hides."""

    one: world.Drawn
    kinds: tuple[str, ...]
    what: str

    @property
    def index(self) -> int:
        """Its number."""
        return self.one.index


def drawn(seed: int, count: int) -> list[Case]:
    """Return what the first records of a seed are."""
    rng = np.random.default_rng([seed, 55])
    causes, families = rng.permutation(ids()).tolist(), list(world.FAMILIES)
    turns = [np.random.default_rng([seed, turn]).permutation(KINDS).tolist() for turn in range(count)]
    first = [kind for turn in turns for kind in turn]
    found = []
    for i in range(count):
        kinds: tuple[str, ...] = ()
        if i % 2 == 0:
            more = np.random.default_rng([seed, i, 57]).permutation(KINDS)[: int(i % 8 == 6)].tolist()
            kinds = (first[i // 2], *more)
        what = ("healthy", "healthy", "cause")[(i // 2) % 3] if kinds else PLAIN[(i // 2) % len(PLAIN)]
        family = families[int(np.random.default_rng([seed, i, 56]).integers(len(families)))]
        cause = causes[i % len(causes)]
        if cause == CLOCK.id and "late_clock" in kinds:  # nobody can tell one from the other
            cause = causes[(i + 1) % len(causes)]
        flown = world.FLOWN[(i + i // 9) % len(world.FLOWN)]
        one = world.Drawn(seed=seed, index=i, flown=flown, family=family, cause=cause)
        found.append(Case(one, kinds, what))
    return found


def made(one: world.Drawn, kinds: tuple[str, ...], what: str) -> Made:
    """Return a record; drawn again where there is no one truth, or an error that changes too little."""
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([one.seed, one.index, attempt, 5])
        try:
            truth = _truth(one, what, rng)
            scale = _scale_of(truth.dense, one) if kinds else None
            for _ in range(ATTEMPTS):
                if found := _with_errors(one, truth, kinds, rng, scale):
                    return found
        except (NoRunError, subzero.UserError):
            continue
    message = f"Record {one.index} ({what}, {kinds}, on {one.flown}) has no truth."
    raise NoRunError(message)


def _truth(one: world.Drawn, what: str, rng: np.random.Generator) -> Truth:
    setting = world.flown(one, rng)
    planted = {one.cause: hidden(rng, one.cause)} if what in ("cause", "large") else {}
    if what == "large":
        planted = {name: tuple(LARGE * z for z in values) for name, values in planted.items()}
        planted = {name: _within(name, values) for name, values in planted.items()}
    true = with_values(setting, {**nuisances(rng), **planted})
    name = one.cause if planted else ""
    if what == "begun":
        name = list(onsets.CAUSES)[one.index // 8 % len(onsets.CAUSES)]
        started = onsets.hidden(onsets.CAUSES[name], setting, rng)
        true = with_onset(onsets.CAUSES[name], started.time).apply(true, *started.values)
    duration = setting.trial.duration + world.AFTER
    times = np.arange(0.0, setting.trial.duration + 1e-9, DENSE_S)
    shown = agreed(replace(true, trial=replace(true.trial, duration=duration)), times, CHANNELS)
    dense = Logged(record=Record(source="world", time=times, values=shown), setting=setting, name=one.flown)
    return Truth(dense=dense, hidden=name)


def _within(name: str, values: tuple[float, ...]) -> tuple[float, ...]:
    from .manoeuvres import effects

    parameters = effects()[name].parameters
    return tuple(
        float(np.clip(z, 0.9 * p.low, 0.9 * p.high)) for z, p in zip(values, parameters, strict=True)
    )


def _with_errors(
    one: world.Drawn, truth: Truth, kinds: tuple[str, ...], rng: np.random.Generator, scale: Scale | None
) -> Made | None:
    """Return a record with errors of some kinds; None if one of them changes nothing that anybody could see."""
    family, dense = world.FAMILIES[one.family], truth.dense
    times = np.arange(0.0, dense.record.time[-1] + 1e-9, family.step)
    errors = tuple(_error(kind, dense, times, rng) for kind in kinds)
    if len({channel for error in errors for channel in error.channels}) < sum(
        len(e.channels) for e in errors
    ):
        return None
    noise = np.random.default_rng([one.seed, one.index, 9])
    logged = _read(dense, errors, times, family, noise)
    D = tuple(_distance(dense, error, times, scale) for error in errors) if scale else ()
    return Made(logged, errors, D, truth.hidden) if min(D, default=CLEAR) >= CLEAR else None


def _read(
    dense: Logged,
    errors: Sequence[DataError],
    times: np.ndarray,
    family: world.Family,
    rng: np.random.Generator,
) -> Logged:
    """Return a record of a truth: read at other times, with noise, and then written wrongly."""
    for error in errors:
        dense = error.planted(dense) if _is_before_noise(error) else dense
    shown = {name: np.interp(times, dense.record.time, one) for name, one in dense.record.values.items()}
    seen = {name: world.seen_by(family, name, one, times, rng) for name, one in shown.items()}
    logged = replace(dense, record=Record(source="world", time=times, values=seen))
    for error in errors:
        logged = logged if _is_before_noise(error) else error.planted(logged)
    return logged


def _is_before_noise(error: DataError) -> bool:
    return error.kind in OF_CLOCK or error.is_of_commands or error.kind == "latency"


def _error(kind: str, dense: Logged, times: np.ndarray, rng: np.random.Generator) -> DataError:
    """Return an error of a kind, drawn."""
    channel = (HEADING,) if kind == "reference" else (str(rng.choice(CHANNELS)),)
    side, last = float(rng.choice([-1.0, 1.0])), float(times[-1])
    drawn_: dict[str, Any] = {
        "unit": lambda: {"how": str(rng.choice(list(MISTAKEN[BY_NAME[channel[0]].unit])))},
        "reference": lambda: {"how": str(rng.choice(list(REFERENCES)))},
        "frozen": lambda: _from(times, rng.uniform(0.2, 0.7) * last),
        "step": lambda: {"since": float(times[int(rng.uniform(0.2, 0.8) * times.size)]),
                         "amount": side * rng.uniform(5.0, 40.0) * NOISE[channel[0]]},
        "dropout": lambda: {"at": _some(times, rng), "how": str(rng.choice(["", "0", "-999"]))},
        "swapped": lambda: {"channels": tuple(rng.choice(CHANNELS, 2, replace=False).tolist())},
        "late_clock": lambda: {"channels": (), "amount": side * rng.uniform(2.0, min(15.0, 0.4 * last))},
        "clock_rate": lambda: {"channels": (), "amount": side * rng.uniform(0.03, 0.15)},
        "latency": lambda: {"amount": side * rng.uniform(1.2, 5.0)},
        "command_sign": lambda: {"channels": (str(rng.choice(list(COMMAND_GROUPS))),)},
        "command_swap": lambda: {"channels": SWAPS[int(rng.integers(len(SWAPS)))]},
    }  # fmt: skip
    more = drawn_[kind]() if kind in drawn_ else {}
    return DataError(**{"kind": kind, "channels": channel, **more})


def _from(times: np.ndarray, since: float) -> dict[str, Any]:
    at = tuple(times[times >= since].tolist())
    return {"since": at[0], "at": at}


def _some(times: np.ndarray, rng: np.random.Generator) -> tuple[float, ...]:
    """Return the times of samples that are lost in some stretches."""
    lost = np.zeros(times.size, dtype=bool)
    for _ in range(int(rng.integers(3, 8))):
        begin = int(rng.integers(1, times.size - 8))
        lost[begin : begin + int(rng.integers(3, max(4, times.size // 20)))] = True
    lost[-1] = False  # what lasts to the end is frozen
    return tuple(times[lost].tolist())


class Scale(NamedTuple):
    """What D is measured with: the problem with the true noise, and its sensitivities (m, k)."""

    problem: Problem
    J: np.ndarray


def _scale_of(dense: Logged, one: world.Drawn) -> Scale:
    family = world.FAMILIES[one.family]
    times = np.arange(0.0, dense.record.time[-1] + 1e-9, family.step)
    problem = world.with_true_noise(pose([_clean(dense, times)]), family)
    return Scale(problem, sensitivities(problem))


def _distance(dense: Logged, error: DataError, times: np.ndarray, scale: Scale) -> float:
    """Return D of an error against what the tolerances and one cause could do."""
    plain = _clean(dense, times)
    if error.is_of_commands:
        bad, good = (respond(one.setting, times, CHANNELS) for one in (error.planted(plain), plain))
    else:
        good = plain.record.values
        before = _is_before_noise(error)
        bad = (
            _clean(error.planted(dense), times).record.values
            if before
            else error.planted(plain).record.values
        )
    (one,) = scale.problem.records
    change = np.concatenate(
        [noise.whiten(np.nan_to_num(bad[name] - good[name])) for name, noise in one.noise.items()]
    )
    return strangeness(scale.problem, scale.J, change)[0]


def _clean(dense: Logged, times: np.ndarray) -> Logged:
    """Return a record without noise."""
    values = {name: np.interp(times, dense.record.time, one) for name, one in dense.record.values.items()}
    return replace(dense, record=Record(source="world", time=times, values=values))


def result_of(case: Case, make: Any = made, diagnose: Any = diagnose_trials) -> dict[str, Any]:
    """Return what a record is, and what the diagnosis says of it."""
    one, kinds, what = case
    found: dict[str, Any] = {
        "index": one.index,
        "flown": one.flown,
        "family": one.family,
        "kinds": kinds,
        "what": what,
    }
    try:
        record = make(one, kinds, what)
        found |= {"cause": record.hidden, "D": record.D, "errors": [error.id for error in record.errors]}
        found |= {"numbers": [error.amount for error in record.errors]}
        started, cpu = perf_counter(), process_time()
        verdict = diagnose([record.logged], seed=one.index, budget="verdict")
        found |= {"seconds": perf_counter() - started, "cpu": process_time() - cpu, **_said(verdict)}
        return found | {"named": is_right(record, verdict)}
    except Exception as error:
        return found | {"error": repr(error)}


def _said(verdict: Verdict) -> dict[str, Any]:
    first, p = max(verdict.probabilities.items(), key=lambda pair: pair[1])
    return {"verdict": verdict.verdict, "then": verdict.then, "first": first, "p": p,
            "told": [one.id for one in verdict.data_errors],
            "told_numbers": [one.amount for one in verdict.data_errors],
            "told_p": max((one.probability for one in verdict.data_errors), default=0.0),
            "alike": [list(one.alike) for one in verdict.data_errors],
            "scan": verdict.seconds.get("errors in the data")}  # fmt: skip


def is_right(record: Made, verdict: Verdict) -> bool:
    """Say whether exactly the errors of a record are named, or told as what the record cannot tell from them; a hidden
    clock is the same thing whether it is told as a cause or as an error.
    """
    if not record.errors:
        is_clock = record.hidden == "clock_offset" and {one.id for one in verdict.data_errors} == {
            "late_clock"
        }
        return verdict.verdict != "data_error" or is_clock
    reported, true = verdict.data_errors, record.errors
    return (
        verdict.verdict == "data_error"
        and len(reported) == len(true)
        and all(_is_among(e, reported) for e in true)
    )


def _is_among(error: DataError, reported: Sequence[Any]) -> bool:
    """Say whether an error is told, with about the right number."""
    near = {"late_clock": SAME_DELAY_S, "latency": SAME_DELAY_S, "clock_rate": SAME_RATE,
            "step": SAME_STEP * abs(error.amount)}.get(error.kind, 0.0)  # fmt: skip
    same = [one for one in reported if one.id in _names(error)]
    words = [other for one in reported for other in one.alike]
    return any(abs(one.amount - error.amount) <= near for one in same) or any(
        other.startswith(error.sentence()) for other in words
    )


def _names(error: DataError) -> tuple[str, str]:
    """Return the ids of an error: two channels are swapped in either order, a jump at either sample."""
    turned = replace(error, channels=error.channels[::-1]) if error.kind == "swapped" else error
    return error.id, turned.id


def is_taken_for_physics(one: Mapping[str, Any]) -> bool:
    """Say whether a record with an error in its data is explained by physics with certainty."""
    return bool(one["kinds"]) and one["verdict"] not in ("data_error", "nothing_wrong") and one["p"] >= SURE


def line_of(one: Mapping[str, Any]) -> str:
    """Return a result as a line."""
    head = f"{one['index']:4d} {one['flown']:14} {one['family']:12} {one['what']:8}"
    if "error" in one:
        return f"{head} {'+'.join(one['kinds'])} ERROR {one['error']}"
    mark = "  " if one["named"] else "! " if is_taken_for_physics(one) or not one["kinds"] else "? "
    planted = zip(one["errors"], one["numbers"], one["D"], strict=True)
    true = " + ".join(f"{name} {size:.3g} (D {D:.0f})" for name, size, D in planted)
    reported = " + ".join(
        f"{name} {size:.3g}" for name, size in zip(one["told"], one["told_numbers"], strict=True)
    )
    said = f"{one['verdict']} [{reported}] {one['told_p']:.2f}; {one['first']} {one['p']:.2f}"
    return f"{mark}{head} {one['cause']} {true or 'no error'} → {said} {one['seconds']:.0f} s, CPU {one['cpu']:.0f} s"


def table(results: Sequence[Mapping[str, Any]]) -> str:
    """Return a row for every kind of error, and for what is none."""
    own = [one for one in results if "error" not in one]
    rows = ["kind            records  named  physics with p >= 0.95  median s  CPU s"]
    rows += [_row(kind, [one for one in own if list(one["kinds"]) == [kind]]) for kind in KINDS]
    rows.append(_row("two errors", [one for one in own if len(one["kinds"]) > 1]))
    rows.append(_row("all errors", [one for one in own if one["kinds"]]))
    for what in (*PLAIN, "all"):
        plain = [one for one in own if not one["kinds"] and what in (one["what"], "all")]
        rows.append(_row(f"none: {what}", plain))
    return "\n".join(rows)


def _row(name: str, own: Sequence[Mapping[str, Any]]) -> str:
    named, physics = sum(one["named"] for one in own), sum(map(is_taken_for_physics, own))
    times = [statistics.median([one[key] for one in own]) if own else np.nan for key in ("seconds", "cpu")]
    return f"{name:15s} {len(own):7d} {named:6d} {physics:23d} {times[0]:9.1f} {times[1]:6.1f}"


@app.default
def benchmark(
    *, count: int = 48, seed: int = 1, workers: int = 2, results: Path | None = None, resume: bool = False
) -> None:
    """Diagnose records with and without errors in their data, and print what came of it.

    Args:
        count: how many records; half of them have an error.
        seed: of all records.
        workers: processes.
        results: where they are kept, one JSON object a line; nowhere if not given.
        resume: keep the results of an interrupted run, and go on behind them.
    """
    known = results_of(
        drawn(seed, count), result_of, tell=line_of, workers=workers, path=results, resume=resume
    )
    print(Counter(one["error"] for one in known if "error" in one) or "", table(known), sep="\n")


if __name__ == "__main__":
    app()
