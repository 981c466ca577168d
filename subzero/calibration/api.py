"""`subzero.calibrate`: from records to a calibrated vehicle, in one call."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from time import perf_counter

import numpy as np
from threadpoolctl import threadpool_limits

import scenarios
from scenarios.parameters import changes_of, part_file, ranges_in, with_vehicle
from subzero.arguments import checked_arguments
from subzero.calibration import assessment, vehicle_file
from subzero.calibration.fit import Fitted, fitted
from subzero.calibration.numbers import USUAL, Number, full_name, numbers_of, with_free_numbers
from subzero.calibration.results import Advice, Calibration, Profile, Source
from subzero.diagnosis.assessment import curves
from subzero.diagnosis.hypothesis.logged import NO_RECORD, Logged
from subzero.diagnosis.inference import Progress, pose
from subzero.diagnosis.read_trials import read_trials
from subzero.errors import DISTRIBUTION, UserError
from subzero.model import Model

Given = Logged | str | Path


@checked_arguments
def calibrate(
    records: Given | Sequence[Given],
    scenario: str | Path | None = None,
    *,
    free: Sequence[str] = (),
    vehicle: str | Path | None = None,
    commands: str | None = None,
    progress: Progress | None = None,
    quick: bool = False,
) -> Calibration:
    """Estimate numbers of a vehicle from measured records, all at once.

        >>> found = subzero.calibrate(["zigzag.csv", "dive.csv", "stop.csv"])
        >>> found["axial_drag.drag_coefficient"].value
        >>> Path("my_vehicle.toml").write_text(found.vehicle)

    Args:
        records: CSV files of one vehicle, folders of them, or `Logged` of `read_trials`; several manoeuvres say more.
        scenario: the trial of every record whose sidecar does not name one.
        free: dotted names of the numbers to estimate, such as "rudder.lift_slope" or "cable.normal_drag_coefficient";
            if empty, the twelve that records usually determine.
        vehicle: name or file of the vehicle to begin with, instead of those of the trials.
        commands: "record" or "scenario", if a record's commands may differ from the scenario's.
        progress: called with the fraction that is done, and the task in progress.
        quick: the fit and its intervals only, without profiles and advice.

    Raises:
        UserError: a record, a name or the vehicle cannot be used.
        scenarios.ScenarioError: a scenario cannot be used.
    """
    names = list(dict.fromkeys(full_name(name) for name in free)) or list(USUAL)
    logged = read(
        [records] if isinstance(records, Logged | str | Path) else records, scenario, vehicle, commands
    )
    _check(logged)
    work = _Work(progress or (lambda share, words: None))
    with threadpool_limits(limits=1, user_api="blas"):  # runs have the cores; matrices are small
        return work.calibration(logged, names, vehicle, quick)


@checked_arguments
def read(
    records: Sequence[Given],
    scenario: str | Path | None,
    vehicle: str | Path | None,
    commands: str | None = None,
) -> list[Logged]:
    """Return records with their trials, with another vehicle in them if one is given.

    Raises:
        UserError: a record or a sidecar cannot be used.
        scenarios.ScenarioError: a scenario or the vehicle cannot be used.
    """
    found = [record for record in records if isinstance(record, Logged)]
    paths = [record for record in records if not isinstance(record, Logged)]
    found += read_trials(paths, scenario=scenario, commands=commands) if paths else []
    return found if vehicle is None else [_with_vehicle(trial, vehicle) for trial in found]


def _with_vehicle(found: Logged, vehicle: str | Path) -> Logged:
    trial, _ = with_vehicle(found.setting.trial, vehicle)
    setting = dataclasses.replace(found.setting, trial=trial, model=Model.of(trial))
    return dataclasses.replace(found, setting=setting)


def _check(logged: Sequence[Logged]) -> None:
    """Raise an error for records that no number of one vehicle can be estimated from."""
    if not logged:
        raise UserError(NO_RECORD)
    first = logged[0]
    for trial in logged:
        if trial.setting.trial.commands is None:
            raise UserError(
                f"The trial of '{trial.name}' prescribes the motion: it moves alike with any numbers. "
                "Calibrate with trials that give commands."
            )
    for each in logged[1:]:
        if each.setting.model.vehicle != first.setting.model.vehicle:
            raise UserError(
                f"'{first.name}' and '{each.name}' were flown with different vehicles. Calibrate records of "
                "one vehicle, or give it with --vehicle."
            )


@dataclasses.dataclass(frozen=True)
class _Work:
    """A calibration in progress.

    Attributes:
        progress: called with the fraction that is done, and the task in progress.
        seconds: task → how long it took. [s]
    """

    progress: Progress
    seconds: dict[str, float] = dataclasses.field(default_factory=dict)

    def calibration(
        self, logged: Sequence[Logged], names: Sequence[str], vehicle: str | Path | None, quick: bool
    ) -> Calibration:
        """Return the calibration of some records."""
        files = files_of(logged[0], names, vehicle)
        ranges = {name: each for part in files.values() for name, each in part.ranges.items()}
        with self._part("fit", 0.0, 0.5) as progress:
            whole = pose(logged)
            numbers = numbers_of(whole, names, ranges)
            problem, D = with_free_numbers(whole, numbers)
            work = fitted(problem, len(numbers), D, progress)
        refused = assessment.refused(numbers, work)
        with self._part("held out", 0.5, 0.6) as progress:
            held = assessment.held_out(work, progress)
        profiles: dict[str, Profile] = {}
        advice: tuple[Advice, ...] = ()
        if not (quick or refused):
            with self._part("profiles", 0.6, 0.8) as progress:
                profiles = assessment.profiles(numbers, work, progress)
            with self._part("advice", 0.8, 1.0) as progress:
                advice = assessment.advice(numbers, work, progress)
        found = assessment.estimates(numbers, work)
        sources, free = tuple(source_of(trial) for trial in logged), range(len(numbers))
        M = work.M[np.ix_(free, free)]
        made = Calibration(
            estimates=found,
            correlation=assessment.correlation(M),
            directions=assessment.directions(numbers, M),
            profiles=profiles,
            held_out=held,
            how="other trials" if len(logged) > 1 else "blocks of the same trial",
            advice=advice,
            nuisances=assessment.nuisances(work, len(numbers)),
            strange=assessment.strange(work),
            refused=refused,
            curves=curves(assessment.at_nominal(work.problem), {"before": None, "calibrated": work.fit}),
            records=sources,
            files={},
            notes=tuple(_notes(logged, numbers, work)),
            converged=work.settled,
            seconds=self.seconds,
        )
        if made.refused:
            return made
        return dataclasses.replace(made, files={kind: part.text(made) for kind, part in files.items()})

    @contextmanager
    def _part(self, name: str, begin: float, end: float) -> Iterator[Progress]:
        """Give the progress of a part that goes from one fraction of the whole to another, and keep its time."""
        start = perf_counter()
        yield lambda share, words: self.progress(begin + share * (end - begin), words)
        self.seconds[name] = perf_counter() - start


@dataclasses.dataclass(frozen=True)
class PartFile:
    """The file of a vehicle or a cable, before.

    Attributes:
        name: as it was named.
        before: its text; "" if there is no file.
        ranges: dotted name → the range that the file declares as plausible.
        names: dotted names of the free numbers in it.
    """

    name: str
    before: str
    ranges: dict[str, tuple[float, float]]
    names: tuple[str, ...]

    def text(self, found: Calibration) -> str:
        """Return its text with the estimates; "" if there were none."""
        if not self.before:
            return ""
        own = {vehicle_file.section_of(name)[1]: found[name] for name in self.names}
        error = f"{found.error('before'):.3g} noise levels before, {found.error():.3g} after ({found.how})"
        said = vehicle_file.provenance(
            found.records,
            self.name,
            datetime.now(UTC).isoformat(timespec="seconds"),
            version(DISTRIBUTION),
            error,
        )
        return vehicle_file.text_of(self.before, own, said)


def files_of(given: Logged, names: Sequence[str], vehicle: str | Path | None) -> dict[str, PartFile]:
    """Return the file of the vehicle, and that of the cable if numbers of it are free."""
    found = {}
    for kind in ("vehicle", "cable"):
        own = tuple(name for name in names if vehicle_file.section_of(name)[0] == kind)
        if not own and kind == "cable":
            continue
        try:
            trial = given.setting.trial
            named = kind == "vehicle" and vehicle is not None
            source = with_vehicle(trial, str(vehicle))[1] if named else part_file(trial, kind)
            above = "vehicle." if kind == "vehicle" else ""
            ranges = {f"{above}{key}": ends for key, ends in ranges_in(source).items()}
            found[kind] = PartFile(source.name, source.text, ranges, own)
        except scenarios.ScenarioError:
            if vehicle is not None:
                raise
            found[kind] = PartFile("", "", {}, own)
    return found


def source_of(trial: Logged) -> Source:
    """Return the provenance of a record for a calibrated file: its bytes if it is a file, else its values."""
    path = Path(trial.record.source)
    if path.is_file():
        digest = hashlib.sha256(path.read_bytes())
    else:
        digest = hashlib.sha256(trial.record.time.tobytes())
        for name in sorted(trial.record.values):
            digest.update(name.encode() + np.ascontiguousarray(trial.record.values[name]).tobytes())
    time = trial.record.time
    return Source(
        name=trial.name,
        file=path.name,
        sha256=digest.hexdigest(),
        trial=trial.setting.trial.name,
        samples=int(time.size),
        duration=float(time[-1]),
    )


def _notes(logged: Sequence[Logged], numbers: Sequence[Number], work: Fitted) -> Iterator[str]:
    """Yield further remarks."""
    for trial in logged:
        yield from trial.notes
    if len(logged) == 1:
        yield "One record alone: what it says of another manoeuvre is not known. Fly a second one."
    if not work.settled:
        yield "The fit did not settle: a further step would still gain. Its intervals are too narrow."
    for each in logged:
        own = [number.name for number in numbers if number.name in changes_of(each.setting.trial)]
        if own:
            yield (
                f"The trial {each.setting.trial.name} changes {', '.join(own)} itself, and will go on to: remove "
                "that from its [changes] to fly the calibrated vehicle."
            )
