"""Are the intervals of a calibration right, and does it predict? ``python -m benchmarks.diagnosis.calibration``.

Truth by the other formulation: twelve numbers of a vehicle off by up to 40 %, uniformly at random; everything else of
the catalogue drawn from its tolerance. Three records: a rudder, a propeller and a stern-plane manoeuvre, drawn. Four
families of noise, both vehicles, with and without cable, in turn. What leaves the water or rolls over is drawn again;
REMUS without its autopilot still dives to 50 m at 60 degrees, and its heading runs away: simulations part from it
within seconds. The drum rubs, as in `manoeuvres`: slack cable behind a free drum has no one truth.

Counted: how many intervals of 95 % hold the truth; the error in a fourth trial that was not fitted, in levels of the
true noise (its start is fitted, which no other record can know; "one left out" is the error of each of the three,
predicted by the two others, which may lack its manoeuvre); and, of `--diagnose` cases, whether a later trial with a
cause planted on top gets its name with the calibrated vehicle as it does with the true one, and what `diagnose` says of
the three records with the uncalibrated one.
"""

from __future__ import annotations

import multiprocessing
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import cyclopts
import numpy as np

import subzero
from scenarios.parameters import with_vehicle
from subzero.calibration.numbers import USUAL, numbers_of, with_deviation, with_free_numbers
from subzero.calibration.results import Calibration
from subzero.diagnosis import CALIBRATED
from subzero.diagnosis.assessment import LIBRARY
from subzero.diagnosis.hypothesis.catalogue import START, catalogue
from subzero.diagnosis.hypothesis.catalogue.sensors import NOISE
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.hypotheses import Entry, number_of
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference import pose
from subzero.model import Model
from subzero.records.record import Record
from subzero.synthetic.planted import apply_all, draw_deviations, draw_effect

from .manoeuvres import BRAKE, CHANNELS
from .results import line, read
from .truth import NoRunError, shown_by
from .world import FAMILIES, ROUNDED, seen_by

VEHICLES = ("subzero2", "remus100")
CABLES = ("with its cable", "without")
NOISES = ("white", "mild", "slow", "rounded")
"""Families of noise: white, AR(1) with ρ 0.5 and 0.9, and rounded to coarse steps."""
FLOWN = (("zigzag", "rudder_doublets", "steady_turn"), ("stop_and_go", "coast_down"),
         ("stern_plane_doublets", "roll_doublets"))  # fmt: skip
"""One trial of each is flown."""
LATER = "zigzag"
"""Flown afterwards, with a cause planted on top."""
SPREAD = 0.4
"""Numbers are off by at most this share. [-]"""
CAUSES = ("rudder_offset", "net_buoyancy", "stern_plane_offset", "drum_friction", "sensor_bias:heading",
          "sensor_scale:surge_speed", "cable_tangential_drag", "rudder_backlash")  # fmt: skip
"""Causes that may be planted; none moves a number that was calibrated."""
CAUSE_SCALES = 1.5
"""Size of a planted cause, in its usual size. [-]"""
LEAST_DEPTH, STEEPEST, MOST_ROLL = 0.2, 80.0, 90.0
"""What a flight keeps to: least depth [m], steepest pitch and largest roll [degree]."""
START_STEPS = 3
"""Steps of the fit of the start of a later trial."""
RATE = 10.0
"""Samples a second. [Hz]"""
TARGETS = {"coverage": (0.93, 0.97), "held out": 1.2}
app = cyclopts.App(
    name="python -m benchmarks.diagnosis.calibration", help_format="plaintext", version_flags=[]
)


@dataclass(frozen=True, kw_only=True)
class Case:
    """A vehicle whose numbers are off, and its records: a seed, a number, and whether it is diagnosed too."""

    seed: int
    index: int
    diagnosed: bool = False

    @property
    def vehicle(self) -> str:
        """The vehicle that is nominal."""
        return VEHICLES[self.index % len(VEHICLES)]

    @property
    def noise(self) -> str:
        """The family of the noise."""
        return NOISES[self.index // len(VEHICLES) % len(NOISES)]

    @property
    def tethered(self) -> bool:
        """Whether it pulls its cable."""
        return (self.index // 2 + self.index // 8) % 2 == 0

    @property
    def rng(self) -> np.random.Generator:
        """All that is drawn."""
        return np.random.default_rng([self.seed, self.index, 5])


def nominal(vehicle: str, flown: str, tethered: bool = True) -> Setting:
    """Return the nominal setting of a trial, with a drum that rubs."""
    trial = subzero.load_scenario("fig6")
    trial = trial if vehicle == "subzero2" else with_vehicle(trial, vehicle)[0]
    setting = Setting(trial=trial, model=Model.of(trial), tethered=tethered)
    setting = setting.with_drum(friction_torque=BRAKE * setting.model.drum.radius)
    drum = {**trial.drum, "friction_torque": setting.model.drum.friction_torque}
    made = LIBRARY[flown][1](setting)
    return replace(made, trial=replace(made.trial, drum=drum))


def nuisances() -> list[Any]:
    """Return what else may be off within tolerance: all of the catalogue that moves none of the twelve."""
    setting = nominal(VEHICLES[0], LATER)
    before = [number_of(name, setting) for name in USUAL]
    found = []
    for effect in (*catalogue(CHANNELS).values(), *START):
        moved = effect.apply(setting, *(max(one.tolerance, one.low) for one in effect.parameters))
        if before == [number_of(name, moved) for name in USUAL]:
            found.append(effect)
    return found


def with_truth(
    setting: Setting, numbers: Mapping[str, float], off: Mapping[str, tuple[float, ...]]
) -> Setting:
    """Return the true setting: numbers off by shares, everything else by deviations within tolerance."""
    for name, share in numbers.items():
        setting = with_deviation(name, setting, share * number_of(name, setting))
    return apply_all(setting, (*catalogue(CHANNELS).values(), *START), off)


def logged_of(setting: Setting, true: Setting, flown: str, noise: str, rng: np.random.Generator) -> Logged:
    """Return the record of a trial as it truly went, with noise."""
    times = np.arange(round(setting.trial.duration * RATE) + 1) / RATE
    longer = replace(true, trial=replace(true.trial, duration=true.trial.duration + 4.0))
    shown = shown_by(longer, times, CHANNELS)
    if not is_flight(shown):
        raise NoRunError(flown)
    values = {name: seen_by(FAMILIES[noise], name, column, times, rng) for name, column in shown.items()}
    return Logged(record=Record(source=flown, time=times, values=values), setting=setting, name=flown)


def is_flight(shown: Mapping[str, np.ndarray]) -> bool:
    """Say whether a trial stays in the water and the right way up; nobody calibrates with another."""
    return (
        float(np.min(shown["depth"])) > LEAST_DEPTH
        and float(np.max(np.abs(shown["pitch"]))) < STEEPEST
        and float(np.max(np.abs(shown["roll_angle"]))) < MOST_ROLL
    )


def result_of(case: Case) -> dict[str, Any]:
    """Return what a calibration says of a case, beside the truth; drawn again where there is no truth."""
    said = {"index": case.index, "vehicle": case.vehicle, "noise": case.noise, "tethered": case.tethered}
    rng = case.rng
    for _ in range(20):
        flown = [str(rng.choice(group)) for group in FLOWN]
        later = str(rng.choice([name for group in FLOWN for name in group if name not in flown]))
        numbers = {name: float(rng.uniform(-SPREAD, SPREAD)) for name in USUAL}
        shared = draw_deviations([one for one in nuisances() if one.slot != "start"], rng)
        try:
            *logged, fourth = [_flown(case, name, numbers, shared, rng) for name in (*flown, later)]
        except (NoRunError, subzero.UserError):
            continue
        start, cpu = perf_counter(), process_time()
        try:
            found = subzero.calibrate(logged, vehicle=case.vehicle, quick=True)
            said |= _held_to(case, found, numbers) | {"flown": flown, "later": later}
            said["later_error"] = error_in_later(case, found, fourth)
            said |= {"seconds": perf_counter() - start, "cpu": process_time() - cpu}
            also = case.diagnosed and not found.refused
            return said | (diagnosed(case, found, logged, numbers, shared, rng) if also else {})
        except Exception as error:
            return said | {"flown": flown, "error": repr(error)}
    return said | {"error": "no truth"}


def _flown(
    case: Case, flown: str, numbers: Mapping[str, float], shared: Mapping[str, Any], rng: np.random.Generator
) -> Logged:
    setting = nominal(case.vehicle, flown, case.tethered)
    true = with_truth(setting, numbers, {**shared, **draw_deviations(START, rng)})
    return logged_of(setting, true, flown, case.noise, rng)


def _held_to(case: Case, found: Calibration, numbers: Mapping[str, float]) -> dict[str, Any]:
    """Return a calibration beside the truth."""
    true = {one.name: one.before * (1.0 + numbers[one.name]) for one in found.estimates}
    return {
        "numbers": {
            one.name: {"z": (one.value - true[one.name]) / one.sd, "held": one.low <= true[one.name] <= one.high,
                       "sd": one.sd / abs(one.before), "determined": one.is_determined, "bound": one.is_at_bound}
            for one in found.estimates
        },
        "error": {when: error_in_true_noise(case, found, when) for when in ("before", "after", "fitted")},
        "converged": found.converged,
        "verdict": found.verdict,
        "refused": list(found.refused),
        "strange": len(found.strange),
    }  # fmt: skip


def error_in_later(case: Case, found: Calibration, record: Logged) -> float:
    """Return the root mean square of the errors in a trial that was not fitted, in levels of its true noise.

    Numbers, sensors and all else are as the calibration has them; the start of the trial is fitted to it.
    """
    whole = pose([record])
    numbers = numbers_of(whole, list(USUAL), {})
    problem, D = with_free_numbers(whole, numbers)
    z = np.array([_as_found(found, entry) for entry in problem.entries])
    own = np.array([entry.record >= 0 for entry in problem.entries])
    noise = {name: replace(one, white=true_noise(case, name), slow=0.0, resolution=0.0)
             for name, one in problem.records[0].noise.items()}  # fmt: skip
    problem = replace(problem, records=(replace(problem.records[0], noise=noise),))
    for _ in range(START_STEPS):
        J, r = problem.jacobian(z, np.flatnonzero(own)), problem.residual(z)
        z[own] += np.linalg.solve(J[:, own].T @ J[:, own] + np.diag(1.0 / D[own]),
                                  J[:, own].T @ r - z[own] / D[own])  # fmt: skip
    return float(np.sqrt(np.mean(problem.residual(z) ** 2)))


def _as_found(found: Calibration, entry: Entry) -> float:
    """Return the deviation that a calibration found of a number, or of what all records share; 0 of others."""
    known = {one.name: one.value - one.before for one in found.estimates}
    tolerance = entry.parameter.tolerance
    return known.get(entry.effect.id, found.nuisances.get(entry.name, (0.0, 0.0))[0] * tolerance)


def true_noise(case: Case, channel: str) -> float:
    """Return the standard deviation of the noise that a channel truly has, in its unit."""
    family = FAMILIES[case.noise]
    q = ROUNDED[channel] if family.rounded else 0.0
    return float(np.sqrt((family.white**2 + family.slow**2) * NOISE[channel] ** 2 + q**2 / 12.0))


def error_in_true_noise(case: Case, found: Calibration, when: str) -> float:
    """Return the root mean square of the errors of all channels, in levels of the noise that they truly have."""
    squares, count = 0.0, 0
    for channels in found.held_out.values():
        for name, one in channels.items():
            squares += one.samples * (getattr(one, when) * one.noise / true_noise(case, name)) ** 2
            count += one.samples
    return float(np.sqrt(squares / count))


def diagnosed(
    case: Case,
    found: Calibration,
    logged: Sequence[Logged],
    numbers: Mapping[str, float],
    shared: Mapping[str, Any],
    rng: np.random.Generator,
) -> dict[str, Any]:
    """Return what a diagnosis says: of the records with the uncalibrated vehicle, and of a later trial with a cause."""
    cause = CAUSES[case.index // 2 % len(CAUSES)]
    planted = draw_effect(catalogue(CHANNELS)[cause], rng, CAUSE_SCALES)
    setting = nominal(case.vehicle, LATER, case.tethered)
    off = {**shared, **draw_deviations(START, rng), cause: planted}
    record = logged_of(setting, with_truth(setting, numbers, off), LATER, case.noise, rng)
    as_true = with_truth(setting, numbers, {})
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "calibrated.toml"
        path.write_text(found.vehicle, encoding="utf-8")
        trial, _ = with_vehicle(setting.trial, path)
    as_found = replace(setting, trial=trial, model=Model.of(trial))
    said = {"cause": cause, "before": _verdict(list(logged), case.index)}
    for key, one in (("true", as_true), ("calibrated", as_found)):
        said[key] = _verdict([replace(record, setting=one)], case.index)
    return {"diagnosed": said}


def _verdict(logged: list[Logged], seed: int) -> dict[str, Any]:
    """Return what a diagnosis of some records says, in short."""
    verdict = subzero.diagnose(logged, seed=seed, budget="verdict")
    first, p = next(iter(verdict.probabilities.items()))
    return {"verdict": verdict.verdict, "named": [one.id for one in verdict.causes], "first": first, "p": p}


def line_of(one: Mapping[str, Any]) -> str:
    """Return a result as a line."""
    head = f"{one['index']:4d} {one['vehicle']:9} {one['noise']:8} {'cable' if one['tethered'] else 'free':5}"
    if "error" in one and not isinstance(one["error"], dict):
        return f"{head} ERROR {one['error']}"
    rows = one["numbers"].values()
    missed = [
        f"{name.partition('.')[2]} {row['z']:+.1f}" for name, row in one["numbers"].items() if not row["held"]
    ]
    held, error = sum(row["held"] for row in rows), one["error"]
    text = f"{head} {held}/{len(rows)} fourth trial {one['later_error']:.3f}, "
    text += f"one left out {error['before']:.3g} → {error['after']:.3f}"
    text += f" {one['cpu']:.0f} s {', '.join(missed)}{'' if is_reported(one) else ' refused'}"
    if "diagnosed" in one:
        said = one["diagnosed"]
        text += f" | before {said['before']['verdict']} | {said['cause']}: true {said['true']['first']}"
        text += f" {said['true']['p']:.2f}, calibrated {said['calibrated']['first']} {said['calibrated']['p']:.2f}"
    return text


def table(results: Sequence[Mapping[str, Any]]) -> str:
    """Return a row for every family and vehicle: coverage, errors before and after, verdicts, names."""
    head = "                 cases refused  in 95 %   of   share (95 %)         before  fourth  above 1.2  strange"
    rows = [_row(name, results) for name in (*NOISES, *VEHICLES, *CABLES, "all")]
    return "\n".join([head, *rows, *_diagnosed_rows(results)])


def _row(name: str, results: Sequence[Mapping[str, Any]]) -> str:
    every = [
        one
        for one in results
        if name in (one["noise"], one["vehicle"], cable_of(one), "all") and "numbers" in one
    ]
    own = [one for one in every if is_reported(one)]
    held = [row["held"] for one in own for row in one["numbers"].values()]
    error = {"before": [one["error"]["before"] for one in own], "after": [one["later_error"] for one in own]}
    before, after = (float(np.median(error[when])) if own else np.nan for when in error)
    above, strange = (
        sum(one > TARGETS["held out"] for one in error["after"]),
        sum(one["strange"] > 0 for one in own),
    )
    share = sum(held) / max(len(held), 1)
    low, high = _interval(own)
    return (f"{name:16s} {len(every):5d} {len(every) - len(own):7d} {sum(held):8d} {len(held):4d} {share:7.3f} "
            f"({low:.3f}-{high:.3f}) {before:8.2f} {after:7.3f} {above:10d} {strange:8d}")  # fmt: skip


def cable_of(one: Mapping[str, Any]) -> str:
    """Return the name of the row of a case with or without its cable."""
    return CABLES[0] if one["tethered"] else CABLES[1]


def is_reported(one: Mapping[str, Any]) -> bool:
    """Say whether a calibration was made, and not refused."""
    return bool(one["verdict"] == CALIBRATED)


def _interval(results: Sequence[Mapping[str, Any]]) -> tuple[float, float]:
    """Return the interval of 95 % of the coverage, from how cases differ: within one, numbers go together."""
    shares = [np.mean([row["held"] for row in one["numbers"].values()]) for one in results]
    if len(shares) < 2:
        return 0.0, 1.0
    half = 1.96 * float(np.std(shares, ddof=1)) / np.sqrt(len(shares))
    return max(float(np.mean(shares)) - half, 0.0), min(float(np.mean(shares)) + half, 1.0)


def _diagnosed_rows(results: Sequence[Mapping[str, Any]]) -> list[str]:
    own = [one["diagnosed"] for one in results if "diagnosed" in one]
    if not own:
        return []
    nothing = sum(one["before"]["verdict"] == "nothing_wrong" for one in own)
    first = {key: sum(one[key]["first"] == one["cause"] for one in own) for key in ("true", "calibrated")}
    both = sum(one["true"]["first"] == one["calibrated"]["first"] == one["cause"] for one in own)
    return [f"'nothing is wrong' of the uncalibrated vehicle: {nothing} of {len(own)}",
            f"planted cause first: {first['true']} of {len(own)} with the true vehicle, {first['calibrated']} with the "
            f"calibrated one, {both} with both"]  # fmt: skip


@app.default
def benchmark(
    *,
    count: int = 40,
    seed: int = 501,
    workers: int = 2,
    results: Path | None = None,
    resume: bool = False,
    diagnose: int = 0,
    begin: int = 0,
) -> None:
    """Calibrate vehicles whose numbers are off, and print how right that is.

    Args:
        count: how many.
        seed: of all cases.
        workers: processes.
        results: where they are kept, one JSON object a line; nowhere if not given.
        resume: keep the results of an interrupted run, and go on behind them.
        diagnose: so many of the cases, the first ones, are diagnosed too.
        begin: number of the first.
    """
    if results and not resume:
        results.unlink(missing_ok=True)
    known = read(results) if results else []
    done = {one["index"] for one in known}
    numbers = [i for i in range(begin, begin + count) if i not in done]
    wanted = [Case(seed=seed, index=i, diagnosed=i < begin + diagnose) for i in numbers]
    with multiprocessing.get_context("fork").Pool(workers) as pool:
        for one in pool.imap_unordered(result_of, wanted):
            known.append(one)
            print(line_of(one), flush=True)
            if results:
                with results.open("a") as file:
                    file.write(line(one))
    print(table(known))


if __name__ == "__main__":
    app()
