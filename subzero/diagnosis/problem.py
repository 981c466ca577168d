"""The least-squares problem behind a diagnosis: all parameters, all records, one whitened residual.

r(z) = W (y − h(z)),    J = ∂(W h)/∂z
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from os import cpu_count
from typing import NamedTuple

import numpy as np

from subzero.diagnosis.effect import Effect, Parameter
from subzero.diagnosis.noise import Noise
from subzero.diagnosis.response import TRUTHS, multiples, sensed, tracked
from subzero.diagnosis.setting import Setting

ROUGH = (0.1, 0.5, 1.0)
"""Hull step, cable step [s] and segment length [m] for sensitivities: their error counts only in second order."""
STEP = 0.2
"""Step of a sensitivity, in tolerances; a whole one from a state of rest (a play, a friction), where slopes jump."""
LATE = ("sensors", "clock")
"""Slots that act on a finished run."""


class Entry(NamedTuple):
    """A number of z: a parameter of an effect; of one record only, for a start (else −1)."""

    effect: Effect
    place: int
    record: int

    @property
    def parameter(self) -> Parameter:
        """The parameter."""
        return self.effect.parameters[self.place]

    @property
    def name(self) -> str:
        """The parameter's name, unique."""
        where = f"@{self.record}" if self.record >= 0 else ""
        return f"{self.effect.id}.{self.parameter.name}{where}"


@dataclass(frozen=True, kw_only=True, eq=False)
class Observed:
    """A record, ready: times [s] (n,), channel → values (n,), channel → noise, its nominal setting, and the levels of
    noise that the user knows.
    """

    name: str
    time: np.ndarray
    values: dict[str, np.ndarray]
    noise: dict[str, Noise]
    setting: Setting
    known: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem:
    """Records and all that is free.

    Attributes:
        records: what was measured.
        entries: what z holds, in order.
        pool: threads for runs side by side; compiled code runs in them freely.
        runs: how many runs were made, for reports.
    """

    records: tuple[Observed, ...]
    entries: tuple[Entry, ...]
    pool: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(cpu_count() or 1))
    runs: list[int] = field(default_factory=lambda: [0])

    def setting(self, record: int, z: np.ndarray, *, late: bool = True) -> Setting:
        """Return the setting of a record with deviations z (k,); without those of the sensors if not `late`."""
        setting = self.records[record].setting
        for effect, own, where in _grouped(self.entries):
            values = z[own]
            if where in (-1, record) and np.any(values != 0.0) and (late or effect.slot not in LATE):
                setting = effect.apply(setting, *values.tolist())
        return setting

    def residual(self, z: np.ndarray) -> np.ndarray:
        """Return r(z) (m,); NaN if a run could not go on."""
        tracks = self._tracks([(i, z) for i in range(len(self.records))])
        return np.concatenate([
            self._whitened(i, self.setting(i, z), track, measured=True) for i, track in enumerate(tracks)
        ])  # fmt: skip

    def jacobian(
        self, z: np.ndarray, columns: Sequence[int] | None = None, *, rough: bool = True
    ) -> np.ndarray:
        """Return J (m, k) at z by one-sided differences; only some of its columns, if asked, others 0."""
        wanted = range(len(self.entries)) if columns is None else columns
        at_z = [(i, z) for i in range(len(self.records))]
        fine = self._tracks(at_z)
        base = self._tracks(at_z, rough=True) if rough else fine
        shown = [self._whitened(i, self.setting(i, z), track) for i, track in enumerate(base)]
        finely = [self._whitened(i, self.setting(i, z), track) for i, track in enumerate(fine)]
        jobs = [(k, i, self._moved(z, k)) for k in wanted for i in range(len(self.records))
                if self.entries[k].record in (-1, i)]  # fmt: skip
        runs = iter(self._tracks([(i, moved) for k, i, moved in jobs if not self._late(k)], rough=rough))
        J = np.zeros((sum(part.size for part in shown), len(self.entries)))
        first = np.cumsum([0, *(part.size for part in shown)])
        for k, i, moved in jobs:
            track, old = (fine[i], finely[i]) if self._late(k) else (next(runs), shown[i])
            change = self._whitened(i, self.setting(i, moved), track) - old
            J[first[i] : first[i + 1], k] = change / (moved[k] - z[k])
        return np.nan_to_num(J)

    def change(self, z: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """Return W (h(moved) − h(z)) (m,)."""
        return self.residual(z) - self.residual(moved)

    def _late(self, k: int) -> bool:
        return self.entries[k].effect.slot in LATE

    def _moved(self, z: np.ndarray, k: int) -> np.ndarray:
        """Return z with entry k moved by a step, away from the nearer bound."""
        parameter, moved = self.entries[k].parameter, z.copy()
        at_rest = parameter.low == 0.0 and z[k] < parameter.tolerance
        step = (1.0 if at_rest else STEP) * parameter.tolerance
        moved[k] += step if z[k] + step <= parameter.high else -step
        return moved

    def _tracks(
        self, jobs: list[tuple[int, np.ndarray]], *, rough: bool = False
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return the track of each (record, z), side by side."""
        self.runs[0] += len(jobs)

        def run(job: tuple[int, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
            setting = self.setting(*job, late=False)
            return tracked(_rough(setting) if rough else setting)

        return list(self.pool.map(run, jobs)) if len(jobs) > 1 else [run(job) for job in jobs]

    def _whitened(
        self, record: int, setting: Setting, track: tuple[np.ndarray, np.ndarray], *, measured: bool = False
    ) -> np.ndarray:
        """Return W h of a record, or W (y − h)."""
        seen, grid, parts = self.records[record], track[0], []
        earlier = seen.time - setting.clock_offset
        for channel, noise in seen.noise.items():
            shown = sensed(setting.sensing.get(channel), grid, TRUTHS[channel](track[1]))
            values = np.interp(earlier, grid, shown)
            parts.append(noise.whiten(seen.values[channel] - values if measured else values))
        return np.concatenate(parts)


def _grouped(entries: tuple[Entry, ...]) -> list[tuple[Effect, list[int], int]]:
    """Return (effect, its places in z, its record), in order."""
    found: dict[tuple[str, int], tuple[Effect, list[int], int]] = {}
    for k, entry in enumerate(entries):
        found.setdefault((entry.effect.id, entry.record), (entry.effect, [], entry.record))[1].append(k)
    return list(found.values())


def _rough(setting: Setting) -> Setting:
    """Return a setting in the coarse steps of sensitivities, where commands allow them."""
    hull_step, cable_step, segment = ROUGH
    trial = setting.trial
    told = trial.commands is None or multiples(trial.commands.time, hull_step)
    if trial.cable_step > cable_step or setting.later or not told:
        return setting
    made = replace(
        trial, hull_step=max(trial.hull_step, hull_step), segment_length=max(trial.segment_length, segment)
    )
    if abs(trial.duration / cable_step - round(trial.duration / cable_step)) < 1e-6:
        made = replace(made, cable_step=cable_step)
    return replace(setting, trial=made)


def entries_of(effects: Sequence[Effect], start: Sequence[Effect], records: int) -> tuple[Entry, ...]:
    """Return the entries of z: effects that all records share, and the start of each record."""
    shared = [Entry(effect, i, -1) for effect in effects for i in range(len(effect.parameters))]
    own = [
        Entry(effect, i, record)
        for record in range(records)
        for effect in start
        for i in range(len(effect.parameters))
    ]
    return (*shared, *own)


Progress = Callable[[float, str], None]
"""Called with the fraction that is done and what is being tried."""
