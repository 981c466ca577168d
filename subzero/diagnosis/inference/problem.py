"""The least-squares problem of a diagnosis: all parameters, all records, one whitened residual.

    r(z) = W (y − h(z)),    J = ∂(W h)/∂z by finite differences

`posing` makes it from records.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from os import cpu_count
from typing import TYPE_CHECKING

import numpy as np

from subzero.diagnosis.hypothesis.configuration import sensed, truth
from subzero.diagnosis.hypothesis.hypotheses import Entry, grouped
from subzero.diagnosis.hypothesis.noise import Noise, innovations_of_each
from subzero.diagnosis.inference.simulator import (
    RunCache,
    Stop,
    Track,
    rougher,
    simulate_on,
    simulate_track,
    with_stops,
)

if TYPE_CHECKING:
    from subzero.diagnosis.hypothesis.configuration import Setting
    from subzero.diagnosis.hypothesis.effect import Effect

JACOBIAN_STEP = 0.2
"""Step of a sensitivity, in tolerances; a whole tolerance from a state of rest (a play, a friction), where slopes
jump.
"""
JACOBIAN_STEP_SHARE = 0.03
"""... and at least this share of the deviation itself: far from the nominal model simulations are less smooth."""
ROUGH_LEVELS = 0.5
"""Simulations in coarser steps with an error of this many levels of the noise (root mean square) are used for no
sensitivity. [-]
"""
POST_RUN_SLOTS = ("sensors", "clock")
"""Slots of effects that act on a finished simulation."""
Job = tuple[int, np.ndarray, Stop | None]
"""A simulation to be run: of a record, with deviations, from a stop on if there is one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Observed:
    """A record, prepared for fits.

    Attributes:
        name: short.
        time: of its samples (n,). [s]
        values: channel → as measured (n,), NaN in gaps.
        noise: channel → its noise.
        setting: the nominal one, in economical steps.
        known: channel → level of noise that the user knows.
        correction: channel → correction added to the simulation (n,): the error of its economical steps, a drift.
    """

    name: str
    time: np.ndarray
    values: dict[str, np.ndarray]
    noise: dict[str, Noise]
    setting: Setting
    known: Mapping[str, float] = field(default_factory=dict)
    correction: Mapping[str, np.ndarray] = field(default_factory=dict)

    def corrected(self, more: Mapping[str, np.ndarray]) -> Observed:
        """Return the record with more added to the correction of the simulation; the measured values are
        unchanged.
        """
        both = {name: self.correction.get(name, 0.0) + column for name, column in more.items()}
        return replace(self, correction={**self.correction, **both})

    def whiten(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return values whitened by the noise of every channel: channel → (n,) to its used samples, one channel after
        the other (m,).
        """
        known = np.concatenate([values[name][noise.used] for name, noise in self.noise.items()])
        white = np.empty(known.size)
        innovations_of_each(*self._filters, known, white)
        return white

    @cached_property
    def _filters(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Where the channels end, and their filters, one after the other."""
        filters = zip(*(noise.filter for noise in self.noise.values()), strict=True)
        kept, gain, scale = (np.concatenate(each) for each in filters)
        return np.cumsum([0, *(noise.count for noise in self.noise.values())]), kept, gain, scale


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem:
    """Records and free parameters.

    Attributes:
        records: what was measured.
        entries: the parameters in z, in order.
        onsets: effects that are no part of z, as they can only begin in mid-trial.
        pool: threads for runs side by side; compiled code runs in them freely.
        kept: how many simulations were requested, and the last ones made.
    """

    records: tuple[Observed, ...]
    entries: tuple[Entry, ...]
    onsets: tuple[Effect, ...] = ()
    pool: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(cpu_count() or 1))
    kept: RunCache = field(default_factory=RunCache)

    def setting(self, record: int, z: np.ndarray, *, late: bool = True) -> Setting:
        """Return the setting of a record with deviations z (k,); without those of the sensors if not `late`."""
        setting = self.records[record].setting
        early = self.kept.setting(
            setting,
            self.entries,
            np.where(self._is_early, z, 0.0),
            lambda: self._changed(setting, record, z, late=False),
        )
        return self._changed(early, record, z, late=True) if late else early

    def roughly(self, z: np.ndarray) -> Problem:
        """Return the same in coarser steps, for the sensitivities to a force; itself if the error of such
        steps at deviations z (k,) is visible above the noise.
        """
        whole = np.zeros(0)
        made = [
            self.kept.setting(record.setting, rougher, whole, partial(rougher, record.setting))
            for record in self.records
        ]
        records = (
            replace(record, setting=setting) for record, setting in zip(self.records, made, strict=True)
        )
        rough = replace(self, records=tuple(records))
        apart = rough.residual(z) - self.residual(z)
        return rough if float(np.mean(apart**2)) < ROUGH_LEVELS**2 else self

    def _changed(self, setting: Setting, record: int, z: np.ndarray, *, late: bool) -> Setting:
        """Return a setting with the deviations that change a simulation, or with those of the sensors (`late`)."""
        numbers = z.tolist()
        for effect, own, where in self._groups[late]:
            values = [numbers[k] for k in own]
            if where in (-1, record) and any(values):
                setting = effect.apply(setting, *values)
        return setting

    @cached_property
    def _is_early(self) -> np.ndarray:
        """Which entries change a simulation (k,)."""
        return np.array([not self._late(k) for k in range(len(self.entries))])

    @property
    def sudden_effects(self) -> list[Effect]:
        """All effects that may begin in mid-trial."""
        throughout = {entry.effect.id: entry.effect for entry in self.entries if entry.record < 0}
        return [effect for effect in throughout.values() if effect.sudden] + list(self.onsets)

    @cached_property
    def _groups(self) -> Mapping[bool, list[tuple[Effect, list[int], int]]]:
        """Effects with their entries: those that change a simulation (False), and those of the sensors (True)."""
        every = grouped(self.entries)
        return {
            late: [each for each in every if late == (each[0].slot in POST_RUN_SLOTS)]
            for late in (False, True)
        }

    def residual(self, z: np.ndarray) -> np.ndarray:
        """Return r(z) (m,); NaN if a simulation failed."""
        return self.residuals([z])[0]

    def residuals(
        self, several: Sequence[np.ndarray], records: Sequence[int] | None = None
    ) -> list[np.ndarray]:
        """Return r(z) (m,) of several z, run side by side; of some records only, if given."""
        wanted = range(len(self.records)) if records is None else records
        jobs = [(i, z) for z in several for i in wanted]
        shown = [
            self.whitened(i, self.setting(i, z), track, measured=True)
            for (i, z), track in zip(jobs, self.tracks(jobs), strict=True)
        ]
        count = len(wanted)
        return [np.concatenate(shown[at : at + count]) for at in range(0, len(shown), count)]

    def jacobian(
        self, z: np.ndarray, columns: Sequence[int] | None = None, *, side: float = 1.0
    ) -> np.ndarray:
        """Return J (m, k) at z by one-sided differences, upwards (1) or downwards (-1) where bounds let them; only
        some of its columns, if asked, others 0.
        """
        wanted = range(len(self.entries)) if columns is None else columns
        base = self.tracks([(i, z) for i in range(len(self.records))])
        true = [self.true(i, self.setting(i, z, late=False), track) for i, track in enumerate(base)]
        shown = [self.whitened(i, self.setting(i, z), track, true=true[i]) for i, track in enumerate(base)]
        jobs = [
            (k, i, self.moved(z, k, side))
            for k in wanted
            for i in range(len(self.records))
            if self.entries[k].record in (-1, i)
        ]
        stops = [self._stops(i, z, wanted) for i in range(len(self.records))]
        early = [(k, i, moved) for k, i, moved in jobs if not self._late(k)]
        started = [stops[i].get(self.entries[k].parameter.begins) for k, i, _ in early]
        runs = iter(self.tracks([(i, moved) for _, i, moved in early], started))
        J = np.zeros((sum(part.size for part in shown), len(self.entries)))
        first = np.cumsum([0, *(part.size for part in shown)])
        for k, i, moved in jobs:
            track, known = (base[i], true[i]) if self._late(k) else (next(runs), None)
            change = self.whitened(i, self.setting(i, moved), track, true=known) - shown[i]
            if moved[k] != z[k]:  # a number that is zero has no tolerance in shares of itself
                J[first[i] : first[i + 1], k] = change / (moved[k] - z[k])
        return np.nan_to_num(J)

    def change(self, z: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """Return W (h(moved) − h(z)) (m,)."""
        return self.residual(z) - self.residual(moved)

    def _late(self, k: int) -> bool:
        return self.entries[k].effect.slot in POST_RUN_SLOTS

    def central_jacobian(self, z: np.ndarray) -> np.ndarray:
        """Return J (m, k) at z by central differences, whose error is of the second order; one-sided at bounds.

        Where simulations diverge quickly, as those of an unstable vehicle, and columns nearly cancel, one-sided
        differences show information where there is none.
        """
        return 0.5 * (self.jacobian(z) + self.jacobian(z, side=-1.0))

    def moved(self, z: np.ndarray, k: int, side: float = 1.0) -> np.ndarray:
        """Return z with entry k moved by a step to a side, or to the other one if a bound is nearer than that."""
        parameter, moved = self.entries[k].parameter, z.copy()
        at_rest = parameter.low == 0.0 and z[k] < parameter.tolerance
        step = parameter.step or (1.0 if at_rest else JACOBIAN_STEP) * parameter.tolerance
        step = max(step, JACOBIAN_STEP_SHARE * abs(z[k]))
        step *= side
        moved[k] += step if parameter.low <= z[k] + step <= parameter.high else -step
        return moved

    def tracks(
        self, jobs: Sequence[tuple[int, np.ndarray]], stops: Sequence[Stop | None] | None = None
    ) -> list[Track]:
        """Return the track of each (record, z), side by side; none is run twice, and each only from its stop on,
        where it has one.
        """
        self.kept.count(len(jobs))
        asked = [(i, np.where(self._is_early, z, 0.0)) for i, z in jobs]
        names, found = [(i, z.tobytes()) for i, z in asked], dict[tuple[int, bytes], Track]()
        for name, (i, z) in zip(names, asked, strict=True):
            if track := self.kept.get(self.records[i].setting, self.entries, z):
                found[name] = track
        new = {
            name: (*job, stop)
            for name, job, stop in zip(names, asked, stops or [None] * len(jobs), strict=True)
            if name not in found
        }
        for (name, (i, z, _)), track in zip(new.items(), self._run(list(new.values())), strict=True):
            found[name] = track
            self.kept.keep(self.records[i].setting, self.entries, z, track)
        return [found[name] for name in names]

    def _stops(self, record: int, z: np.ndarray, columns: Iterable[int]) -> dict[float, Stop]:
        """Return the states of a record's simulation at the onsets of columns: onset [s] → stop, none for those at
        the start.
        """
        begins = {self.entries[k].parameter.begins for k in columns} - {0.0}
        return with_stops(self.setting(record, z, late=False), begins)[1] if begins else {}

    def _run(self, jobs: list[Job]) -> Iterable[Track]:
        """Return the track of each job, side by side."""

        def run(job: Job) -> Track:
            record, z, stop = job
            setting = self.setting(record, z, late=False)
            return simulate_on(setting, stop) if stop else simulate_track(setting)

        return self.pool.map(run, jobs) if len(jobs) > 1 else map(run, jobs)

    def whitened(
        self,
        record: int,
        setting: Setting,
        track: Track,
        *,
        measured: bool = False,
        true: Mapping[str, np.ndarray] | None = None,
    ) -> np.ndarray:
        """Return W h of a record, or W (y − h); quicker if the true values of the channels along the track are given
        as `true`.
        """
        seen, shown = self.records[record], self.shown(record, setting, track, true)
        if measured:
            shown = {
                name: seen.values[name] - values - seen.correction.get(name, 0.0)
                for name, values in shown.items()
            }
        return seen.whiten(shown)

    def shown(
        self, record: int, setting: Setting, track: Track, true: Mapping[str, np.ndarray] | None = None
    ) -> dict[str, np.ndarray]:
        """Return what the sensors of a record would show: channel → (n,), in its display unit."""
        grid, true = track[0], self.true(record, setting, track) if true is None else true
        time = self.records[record].time
        return {
            name: np.interp(
                setting.happened(time, name), grid, sensed(setting.sensing.get(name), grid, values)
            )
            for name, values in true.items()
        }

    def true(self, record: int, setting: Setting, track: Track) -> dict[str, np.ndarray]:
        """Return the true values of the channels of a record along a track: channel → (times of the track,)."""
        return {name: truth(setting, track[1], name) for name in self.records[record].noise}


Progress = Callable[[float, str], None]
"""Called with the fraction that is done and a description of the current step."""
