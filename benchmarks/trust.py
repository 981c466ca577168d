"""Does a run that is wrong say so? Random coupled trials, each held against a fourfold refinement of itself.

    python -m benchmarks.trust 60 --seed 0 --jobs 2          # trials 0 … 59; prints the tables
    python -m benchmarks.trust 1 --seed 17 --show            # one of them, in full
    python -m benchmarks.trust 1000 --keep trials.jsonl      # each verdict kept as it comes; run again, it goes on

Trial n is drawn from the generator of seed n alone (`benchmarks.trust_trials`), so an offender is reproduced by its
number, `draw(n)`. Each is run as finely as its rtol asks for, and with all steps and segments a quarter as long as
these. The error of the force is

    max over t of |F(t) − F_fine(t)| / max over t of |F_fine(t)|

with F the force of the cable on the vehicle in body axes, at the times of the coarse run, single-sample jolts included:
a cable that goes taut in one sample is a force that somebody will read. Where the fine run stops, or the pull of the
cable never reaches `NO_PULL`, there is nothing to judge by.

    wrong      completed, and the force is off by more than 3 %, or the residual of the energies above 5 %
    silent     wrong, without a numerical warning
    unchecked  silent, and not even `subzero.check`, with half the steps, changes the tow force by more than 1 %
    right      within 1 %, force and energies
    false      right, with a numerical warning
    unsettled  it would be false, but a second reference, twice as fine as the first, moves by more than 1 %

A reference may call a warning false only if it stands itself: where a drum is ill-posed, the run and its reference may
agree, and segments half as long give another force, as the warning says. So each trial that is right and warns gets a
second reference. One that is unsettled is neither right nor wrong; where the second one stops or takes too long, the
warning stays false.

A numerical warning (`NUMERICAL`) says that force or energies may be off, and is false where neither is. Energies are
measured as the force is: the largest residual, as a share of the largest energy of the run. The other warnings (a
vehicle in the air, a cable that would break, a servo at its limit) say what happened and claim nothing about numbers,
so that the run of a right one may have them. Between 1 and 3 % a run is neither right nor wrong, whatever it says.

A reference of a drum that does not hold its cable may take half an hour. With `--patience` a trial is given up whose
reference takes longer than so many seconds of CPU, or goes on at a rate (`LEAST_LOOK`, `SPARE`) at which it will, or
whose run takes three times as long; it is counted with what it had warned of by then. So what a run spends on its own
doubts hardly chooses which trials are judged. A second reference has `--second-patience`.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
import xarray as xr
from scipy.stats import binomtest

import scenarios
import subzero
from benchmarks.trust_trials import draw, tags_of
from subzero.simulation.comparison import MOST, refine
from subzero.validity import DOUBTS

WRONG, RIGHT = 0.03, 0.01
"""Error of the force from which a run is wrong, and up to which it is right. [-]"""
LARGEST_RESIDUAL = 0.05
"""Residual of the energy balance, as a share of its largest term, from which a run is wrong. [-]"""
NO_PULL = 1e-3
"""A cable that never pulls harder than this has no force to judge. [N]"""
REFINEMENT = 4.0
RTOL = 0.02
"""What trials ask for, by default: as that of every trial. [-]"""
LEAST_LOOK, SPARE = 2.0, 2.0
"""A reference is given up where it would take so many times its patience, by the rate at which it went on for so long.
A start takes more iterations than what comes later, a long cable more than a short one. [s], [-]"""
TOO_LONG = "no reference: too long"
NUMERICAL = DOUBTS
"""Checks that say that numbers are wrong; all others say what happened."""
PULL = ("cable_force_forward", "cable_force_starboard", "cable_force_down")
ENERGIES = ("propeller_work", "hull_loss", "cable_loss", "kinetic_change", "drum", "added_mass_term")


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What a trial came to.

    Attributes:
        seed: of the trial.
        tags: what there is in it.
        outcome: of the run at its own steps; "no reference" where the fine run stopped, `TOO_LONG` where the patience
            ended before it did.
        force_error, smooth_error: of the tow force; and without jolts of a single sample. [-]
        largest_force: of the fine run. [N]
        reference_change: of the force, from the fine run to the second reference; nan without one. [-]
        check: by which share half the steps change the tow force; nan where the run is not silent. [-]
        stated: error of the force that the run itself states. [-]
        halvings: how often the run halved its steps and segments.
        residual: largest residual of the energies, as a share of the largest term of the run. [-]
        warnings: check → how many sentences.
        seconds: of the run and of the fine one.
    """

    seed: int
    tags: tuple[str, ...]
    outcome: str
    force_error: float = np.nan
    smooth_error: float = np.nan
    largest_force: float = 0.0
    reference_change: float = np.nan
    check: float = np.nan
    stated: float = np.nan
    halvings: int = 0
    residual: float = np.nan
    warnings: tuple[str, ...] = ()
    seconds: tuple[float, float] = (0.0, 0.0)

    @property
    def numerical(self) -> bool:
        """Whether a warning says that numbers may be wrong."""
        return any(name in NUMERICAL for name in self.warnings)

    @property
    def judged(self) -> bool:
        """Whether the run ended well, and so did its reference."""
        return self.outcome == "completed"

    @property
    def wrong(self) -> bool:
        """Whether force or energies are wrong."""
        return self.judged and (self.force_error > WRONG or self.residual > LARGEST_RESIDUAL)

    @property
    def silent(self) -> bool:
        """Whether it is wrong without a word."""
        return self.wrong and not self.numerical

    @property
    def unchecked(self) -> bool:
        """Whether not even half the steps would tell."""
        return self.silent and self.check <= MOST

    @property
    def near(self) -> bool:
        """Whether force and energies are within what is right of the reference, whatever that is worth."""
        return self.judged and self.force_error < RIGHT and self.residual < RIGHT

    @property
    def unsettled(self) -> bool:
        """Whether the warning cannot be called false, as the reference moves itself."""
        return self.near and self.numerical and self.reference_change > RIGHT

    @property
    def right(self) -> bool:
        """Whether force and energies are right."""
        return self.near and not self.unsettled

    @property
    def false(self) -> bool:
        """Whether it is right, and warns."""
        return self.right and self.numerical


def refined(trial: scenarios.Trial, factor: float = REFINEMENT) -> scenarios.Trial:
    """Return a trial with all steps and segments so many times shorter, taken as they are."""
    names = ("hull_step", "cable_step", "segment_length", "grading", "far_grading")
    return dataclasses.replace(trial, rtol=0.0, **{name: getattr(trial, name) / factor for name in names})


def pull_of(run: xr.Dataset) -> np.ndarray:
    """Return the force of the cable on the vehicle, body axes (n, 3). [N]."""
    return np.stack([run[name].values for name in PULL], axis=1)


def force_errors(run: xr.Dataset, fine: xr.Dataset) -> tuple[float, float, float]:
    """Return the error of the tow force, the same without jolts of one sample, and the largest force. [-], [N]."""
    time, there = run["time"].values, fine["time"].values
    F = pull_of(fine)
    reference = np.stack([np.interp(time, there, one) for one in F.T], axis=1)
    largest = float(np.linalg.norm(F, axis=1).max())
    error = np.linalg.norm(pull_of(run) - reference, axis=1)
    calm = np.minimum.reduce([error[:-1], error[1:]]) if error.size > 1 else error
    return float(error.max()) / largest, float(calm.max()) / largest, largest


def residual_of(run: xr.Dataset) -> float:
    """Return the largest residual of the energies, as a share of the largest term. [-]."""
    largest = max(float(np.abs(run[f"energy_{name}"].values).max()) for name in ENERGIES)
    return float(np.abs(run["energy_residual"].values).max()) / max(largest, 1e-12)


class TooLongError(Exception):
    """The patience is at an end."""


def impatient(seconds: float, *, foresees: bool = False) -> Callable[[float], None]:
    """Return a progress that ends what takes longer than so many seconds of CPU from now on, or will (`SPARE`)."""
    begin = process_time()

    def tell(fraction: float) -> None:
        taken = process_time() - begin
        late = foresees and taken > max(LEAST_LOOK, SPARE * fraction * seconds)
        if late or taken > seconds:
            raise TooLongError

    return tell


def judge(
    seed: int, patience: float = np.inf, rtol: float = RTOL, second_patience: float | None = None
) -> Verdict:
    """Run a trial and its reference, this for at most so many seconds of CPU, the run for thrice that, and compare.

    A second reference has as much again, if not told otherwise.
    """
    trial = dataclasses.replace(draw(seed), rtol=rtol)
    tags, begin, warnings, given_up = tags_of(trial), perf_counter(), (), "no run: too long"
    try:
        run = subzero.simulate(trial, progress=impatient(3.0 * patience))
        middle, given_up = perf_counter(), TOO_LONG
        warnings = tuple(one.check for one in subzero.warnings_of(run))
        if run.attrs["outcome"] != "completed":
            return Verdict(seed=seed, tags=tags, outcome="stopped", warnings=warnings)
        found, fine = compared(run, trial, patience)
    except TooLongError:
        return Verdict(seed=seed, tags=tags, outcome=given_up, warnings=warnings)
    except subzero.UserError as error:  # a cable that does not reach its drum in this current
        return Verdict(seed=seed, tags=tags, outcome=f"refused: {str(error)[:60]}")
    seconds = (middle - begin, perf_counter() - middle)
    verdict = Verdict(seed=seed, tags=tags, warnings=warnings, seconds=seconds, **found)
    if verdict.silent:
        return dataclasses.replace(verdict, check=refine(run, trial).tow_force)
    if not verdict.false:
        return verdict
    again = patience if second_patience is None else second_patience
    change = change_of_reference(fine, trial, 2.0**verdict.halvings, impatient(again))
    return dataclasses.replace(verdict, reference_change=change)


def change_of_reference(
    fine: xr.Dataset, trial: scenarios.Trial, taken: float, tell: Callable[[float], None]
) -> float:
    """Return how much the force of a reference moves with half its steps and segments; nan where that does not end.

    Args:
        fine: the reference.
        trial: of the run.
        taken: how much finer than its trial the run was taken. [-]
        tell: ends what takes too long.
    """
    try:
        finer = subzero.simulate(refined(trial, 2.0 * REFINEMENT * taken), progress=tell)
    except (TooLongError, subzero.UserError):  # steps below the least that a trial may have
        return np.nan
    return force_errors(fine, finer)[0] if finer.attrs["outcome"] == "completed" else np.nan


def compared(
    run: xr.Dataset, trial: scenarios.Trial, patience: float
) -> tuple[dict[str, object], xr.Dataset]:
    """Return what a finer run says of one that reached its end, fields of a `Verdict`, and that reference.

    It has so many seconds of CPU.
    """
    accuracy = json.loads(run.attrs["accuracy"])
    halvings, stated = accuracy.get("halvings", 0), accuracy.get("force_error", np.nan)
    finest = refined(trial, REFINEMENT * 2.0**halvings)
    fine = subzero.simulate(finest, progress=impatient(patience, foresees=True))
    stated = np.inf if stated is None else stated
    found = {"residual": residual_of(run), "stated": stated, "halvings": halvings}
    if fine.attrs["outcome"] != "completed":
        return {**found, "outcome": "no reference"}, fine
    error, smooth, largest = force_errors(run, fine)
    if largest < NO_PULL:
        return {**found, "outcome": "no pull"}, fine
    found |= {"force_error": error, "smooth_error": smooth, "largest_force": largest}
    return {**found, "outcome": "completed"}, fine


def report(verdicts: list[Verdict]) -> str:
    """Return the tables."""
    judged = [one for one in verdicts if one.judged]
    lines = [
        _counts(verdicts, judged),
        "",
        "by what there is in a trial        runs  right  wrong  silent  false",
    ]
    for tag in sorted({tag for one in judged for tag in one.tags}):
        some = [one for one in judged if tag in one.tags]
        right, *others = (sum(map(_is(name), some)) for name in ("right", "wrong", "silent", "false"))
        lines.append(f"{tag:32s} {len(some):6d} {right:6d} {others[0]:6d} {others[1]:7d} {others[2]:6d}")
    lists = {
        "silent and wrong": "silent",
        "false warnings": "false",
        "warnings of which the reference moves": "unsettled",
    }
    for words, name in lists.items():
        lines += ["", f"{words}:", *(_line(one) for one in judged if getattr(one, name))]
    lines += ["", "without an end or a reference:"]
    lines += [f"  {one.seed:6d}  {one.outcome}: {'; '.join(one.tags)}" for one in verdicts if not one.judged]
    return "\n".join(lines)


def _is(name: str) -> Callable[[Verdict], bool]:
    return lambda verdict: bool(getattr(verdict, name))


def _counts(verdicts: list[Verdict], judged: list[Verdict]) -> str:
    """Return the sums."""
    names = ("wrong", "silent", "unchecked", "right", "false", "unsettled")
    wrong, silent, unchecked, right, false, unsettled = (sum(map(_is(name), judged)) for name in names)
    unproved = sum(one.false and np.isnan(one.reference_change) for one in judged)
    others = len(verdicts) - len(judged)
    long = [one for one in verdicts if one.outcome == TOO_LONG]
    unwarned = sum(not one.numerical for one in long)
    return (
        f"{len(verdicts)} trials, {len(judged)} judged, {others} stopped or without a reference; "
        f"of these {len(long)} took too long, {unwarned} of them without a numerical warning\n"
        f"wrong (force off by > 3 % or residual > 5 %): {wrong}; of them silent: {silent} "
        f"({interval(silent, len(judged))} of all), and silent under --check: {unchecked}\n"
        f"right within 1 %: {right}; of them with a numerical warning: {false} ({interval(false, right)}), "
        f"{unproved} of these without a second reference\n"
        f"within 1 %, with a numerical warning, and the reference moves by more than 1 %: {unsettled}"
    )


def interval(some: int, of: int) -> str:
    """Return a share with its 95 % interval, of the binomial distribution (Clopper and Pearson)."""
    if not of:
        return "of none"
    low, high = binomtest(some, of).proportion_ci()
    return f"{100.0 * some / of:.1f} %, 95 %: {100.0 * low:.1f} to {100.0 * high:.1f} %"


def _line(one: Verdict) -> str:
    """Return a line about an offender."""
    checks = ", ".join(dict.fromkeys(one.warnings)) or "no warning"
    return (
        f"  {one.seed:6d}  force {100 * one.force_error:7.2f} % (without jolts {100 * one.smooth_error:7.2f} %), "
        f"residual {100 * one.residual:6.2f} %, {one.largest_force:7.3f} N; "
        f"{checks}; {'; '.join(one.tags)}"
    )


def judged_all(
    seeds: Iterable[int], jobs: int, keep: Path | None = None, how: Callable[[int], Verdict] | None = None
) -> list[Verdict]:
    """Judge trials, in so many processes; those that a file keeps are read from it, and others are added to it."""
    seeds = list(seeds)
    found = {one.seed: one for one in kept(keep)} if keep else {}
    for verdict in _judged([seed for seed in seeds if seed not in found], jobs, how or judge):
        found[verdict.seed] = verdict
        if keep:
            with keep.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(verdict)) + "\n")
    return [found[seed] for seed in seeds]


def _judged(seeds: list[int], jobs: int, how: Callable[[int], Verdict]) -> Iterator[Verdict]:
    """Give verdicts as they come, in the order of the seeds."""
    if jobs <= 1:
        yield from map(how, seeds)
        return
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(how, seeds)


def kept(path: Path) -> list[Verdict]:
    """Return the verdicts that a file keeps, one a line."""
    if not path.exists():
        return []
    lines = map(json.loads, path.read_text(encoding="utf-8").splitlines())
    return [Verdict(**{name: _hashable(value) for name, value in line.items()}) for line in lines]


def _hashable(value: object) -> object:
    return tuple(value) if isinstance(value, list) else value


def main() -> None:
    """Judge, print, and keep the verdicts."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.trust", description=__doc__.splitlines()[0])
    parser.add_argument("count", type=int, nargs="?", default=60)
    parser.add_argument("--seed", type=int, default=0, help="of the first trial")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--show", action="store_true", help="one line for every trial")
    parser.add_argument("--keep", type=Path, help="file for all verdicts, one a line, as they come")
    parser.add_argument("--kept", action="store_true", help="only print the tables of what the file keeps")
    parser.add_argument(
        "--patience", type=float, default=np.inf, help="CPU seconds of the references of a trial"
    )
    parser.add_argument(
        "--second-patience", type=float, help="of a second reference; as much as of the trial if not given"
    )
    parser.add_argument("--rtol", type=float, default=RTOL, help="of the trials; 0 takes steps as they are")
    asked = parser.parse_args()
    if asked.kept:
        verdicts = kept(asked.keep)
    else:
        how = partial(judge, patience=asked.patience, rtol=asked.rtol, second_patience=asked.second_patience)
        verdicts = judged_all(range(asked.seed, asked.seed + asked.count), asked.jobs, asked.keep, how)
    if asked.show:
        print(*(_line(one) for one in verdicts), sep="\n")
    print(report(verdicts))


if __name__ == "__main__":
    main()
