"""Records and a model, as residuals of any explanation: e = corrected record − simulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType

import numpy as np

from subzero.errors import UserError
from subzero.identification.explanation import (
    AFFINE,
    CLOCK,
    KNOWN,
    Entry,
    Identity,
    Term,
    Terms,
    entries_of,
)
from subzero.identification.model import Model, Unknown
from subzero.identification.noise import MEDIAN_TO_SD, NoisePrior
from subzero.identification.readings import SPIKE, Readings, are_turns, jumps, outliers_of
from subzero.identification.record import Record
from subzero.identification.simulation import Asked, Runs

STEP, STEP_DELAY = 0.01, 1e-3
"""Step of a sensitivity, over the standard deviation of a number's prior; of a delay in sampling intervals, where a
longer step would pass a corner of the simulation, which is interpolated between samples. [-]"""
DELAY_INTERVALS, DELAY_SHARE = 5.0, 0.03
"""Usual size of a delay, in sampling intervals, or over the duration of a record if that is more. [-]"""
FEWEST_SAMPLES = 8
"""A channel with fewer readings in all records is not used."""
RARE = 0.05
"""Largest share of a channel's readings that are set aside as outliers: more of them say something. [-]"""
FREE_TURNS = 2.0
"""So many turns readings of an angle may span besides twice the turns of the nominal model: its logger wraps it. [-]"""
FOLLOWS = 0.25
"""Residuals of an angle that change by less between neighbours, in turns, are followed beyond half a turn. [-]"""
MAX_KNOTS = 200
"""Most knots of one unknown input in one record: its time is lengthened where there would be more."""
FIXED = 1e-6
"""Prior standard deviation of a number that is fixed, over its own. [-]"""
CORRECTIONS = ("offset", "step", "gain", "drift", "delay", "rate")
"""Entries that change the record, not the simulation."""

Progress = Callable[[float, str], None]
"""(share that is done, present step)."""


class Problem:
    """Records and a model.

    Args:
        model: of the records.
        records: one or more.
        fixed: numbers that a fit may not move: identity of an entry → value.
        before: a problem of the same model; where its records have the same inputs, its runs are used.

    Raises:
        UserError: a record has no channel or not all inputs of the model.
        ModelError: the model cannot be used.
    """

    def __init__(
        self,
        model: Model,
        records: Sequence[Record],
        fixed: Mapping[Identity, float] = MappingProxyType({}),
        before: Problem | None = None,
    ) -> None:
        self.model, self.records, self.fixed = model, list(records), fixed
        self._hats: dict[tuple[int, int], np.ndarray] = {}
        if not self.records:
            raise UserError("there is no record. Give one, or several.")
        self.inputs = [{name: _input(record, name) for name in model.inputs} for record in self.records]
        known: list[Runs] = before.runs if before else []
        self.runs: list[Runs] = [
            next((run for run in known if run.serves(record.time, inputs)), None)
            or Runs(model, record.time, inputs, record.name)
            for record, inputs in zip(self.records, self.inputs, strict=True)
        ]
        self.channels = {
            name: found for name in model.channels if (found := self._readings(name)) is not None
        }
        if not self.channels:
            have = ", ".join(self.records[0].columns) or "nothing"
            raise UserError(
                f"{self.records[0].name}: no channel of the model has {FEWEST_SAMPLES} readings. The model has "
                f"{', '.join(model.channels)}; the record has {have}."
            )
        empty = self.entries(())
        for k, run in enumerate(self.runs):
            if run in known:
                continue
            own = [entry for entry in empty if _moves(entry, k)]
            run.check(self._asked(k, own, np.array([entry.centre for entry in own])))

    def with_fixed(self, fixed: Mapping[Identity, float]) -> Problem:
        """Return the same problem with more numbers fixed; runs are shared."""
        found = copy(self)
        found.fixed = {**self.fixed, **fixed}
        return found

    def _readings(self, name: str) -> Readings | None:
        """Return a channel in all records; None if it has too few readings."""
        sensor = self.model.channels[name]
        having = [(k, record) for k, record in enumerate(self.records) if name in record.columns]
        if not having:
            return None
        time = np.concatenate([record.times_of(name) for _, record in having])
        values = np.concatenate([record.columns[name] for _, record in having])
        of = np.concatenate([np.full(record.times_of(name).size, k) for k, record in having])
        inside = np.concatenate(
            [
                (record.times_of(name) >= record.time[0]) & (record.times_of(name) <= record.time[-1])
                for _, record in having
            ]
        )
        if (np.isfinite(values) & inside).sum() < FEWEST_SAMPLES:
            return None
        away = self._wrapped(name, values - self._at_nominal(name, having))
        return Readings.of(sensor, time, values, of, inside, away)

    def _at_nominal(self, name: str, having: Sequence[tuple[int, Record]]) -> np.ndarray:
        """Return what the nominal model shows of a channel at its times in some records (m,); NaN where it fails."""
        found = []
        for k, record in having:
            unknown = {each.name: np.zeros(record.time.size) for each in self.model.unknown}
            (readings,) = self.runs[k].readings([Asked(self._nominal, unknown)])
            times = record.times_of(name)
            shown = np.interp(times, record.time, readings[name]) if readings else np.full(times.size, np.nan)
            found.append(shown)
        return np.concatenate(found)

    def prior(self, name: str, terms: Terms = ()) -> NoisePrior:
        """Return the prior knowledge of a sensor under an explanation: a level that was read off readings of a wrong
        unit is in that unit, and goes with them.
        """
        own, held, sensor = (
            self.channels[name].prior,
            self.readings_of(name, terms).prior,
            self.model.channels[name],
        )
        prior = replace(
            own,
            level=held.level if sensor.noise is None else own.level,
            resolution=held.resolution if sensor.resolution is None else own.resolution,
        )
        wrong = [t for t in terms if t.target == name and t.slot[0] == AFFINE and not np.isfinite(t.begins)]
        if not wrong:
            return prior
        factor = abs(wrong[0].factor)
        return replace(
            prior,
            level=prior.level / (factor if sensor.noise is None else 1.0),
            resolution=prior.resolution / (factor if sensor.resolution is None else 1.0),
        )

    def levels(self, terms: Terms = ()) -> dict[str, float]:
        """Return channel → level of its sensor with its rounding under an explanation. [unit]"""
        priors = {name: self.prior(name, terms) for name in self.channels}
        return {
            name: float(np.hypot(each.level, each.resolution / np.sqrt(12.0)))
            for name, each in priors.items()
        } | {CLOCK: 1.0}

    def may_read(self, name: str, factor: float) -> bool:
        """Return whether readings of a channel may be a factor too large. Those of an angle may not, if it would then
        turn more often than the nominal model: wrapped, they would agree with any simulation.
        """
        turn, each = self.model.channels[name].turn, self.channels[name]
        if not turn or abs(factor) == 1.0:
            return True
        alone = jumps(each.values[each.used])
        turns = [turn * abs(known) for known, *_ in KNOWN if are_turns(alone, turn * abs(known))]
        if turns and not are_turns(alone, turn * abs(factor)):
            return False  # the logger wraps what it takes for an angle
        having = [(k, record) for k, record in enumerate(self.records) if name in record.columns]
        most = FREE_TURNS * turn + 2.0 * float(np.ptp(self._at_nominal(name, having)))
        return not float(np.ptp(each.values[each.used])) > most * abs(factor)

    def outliers(self, terms: Terms, e: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return channel → which readings (m,) are outliers of an explanation: their residuals are alone far from those
        next to them, by the rule for readings.

        A signal that jumps hides an outlier from the rule for readings, and only an explanation shows it.

        Args:
            terms: the explanation.
            e: channel → its residuals (m,).
        """
        levels, found = self.levels(terms), {}
        for name, each in self.channels.items():
            used = self.used(name, terms)
            # Where an explanation leaves more than the sensor errs, that is its own error.
            usual = max(levels[name], MEDIAN_TO_SD * float(np.median(np.abs(e[name][used]))))
            left, far = np.where(used, e[name], np.nan), SPIKE * usual
            alone = outliers_of(left, self.recorded(name, terms) - e[name], each.record, far)
            if 0 < alone.sum() <= RARE * each.used.sum():
                found[_column(name, terms)] = alone
        return found

    def without(self, outliers: Mapping[str, np.ndarray]) -> list[Record]:
        """Return the records with gaps in the place of some readings: channel → which (m,)."""
        found = []
        for k, record in enumerate(self.records):
            columns = dict(record.columns)
            for name, outlier in outliers.items():
                if name in columns:
                    columns[name] = np.where(outlier[self.channels[name].record == k], np.nan, columns[name])
            found.append(replace(record, columns=columns))
        return found

    @cached_property
    def intervals(self) -> dict[str, float]:
        """Channel → its sampling interval. [s]"""
        own = {name: each.prior.interval for name, each in self.channels.items()}
        return {**own, CLOCK: float(np.median(np.diff(self.records[0].time)))}

    @cached_property
    def delays(self) -> dict[str, float]:
        """Channel → usual size of a delay: some sampling intervals, or some per cent of the longest record. [s]"""
        share = DELAY_SHARE * self._longest
        return {name: max(DELAY_INTERVALS * interval, share) for name, interval in self.intervals.items()}

    @cached_property
    def moving_inputs(self) -> set[str]:
        """Inputs that change within a record."""
        return {name for each in self.inputs for name, values in each.items() if np.ptp(values) > 0.0}

    def differ(self, a: str, b: str) -> bool:
        """Return whether two inputs are not the same in all records, so that an exchange of their columns matters."""
        return any(not np.array_equal(each[a], each[b]) for each in self.inputs)

    @cached_property
    def _longest(self) -> float:
        """Duration of the longest record. [s]"""
        return max(float(np.ptp(record.time)) for record in self.records)

    def intervals_of(self, k: int, unknown: Unknown) -> int:
        """Return how many intervals an unknown input has between its knots in record k, as its time asks for."""
        return int(np.clip(np.ceil(np.ptp(self.records[k].time) / unknown.time), 1, MAX_KNOTS))

    def knots(self, k: int, intervals: int) -> np.ndarray:
        """Return the times of knots in record k (intervals + 1,). [s]"""
        time = self.records[k].time
        return np.linspace(time[0], time[-1], intervals + 1)

    def unknown(self, terms: Terms) -> list[Unknown]:
        """Return the unknown inputs of an explanation: the usual ones, and those that its terms say."""
        acting = {term.target for term in terms if term.kind == "unknown"}
        return [each for each in self.model.unknown if each.usual or each.name in acting]

    def entries(self, terms: Terms) -> list[Entry]:
        """Return all free numbers of an explanation: of the model, its terms, starts and unknown inputs."""
        own = entries_of(terms, self.model, self.levels(terms), self.delays)
        starts = [
            Entry("start", number.name, number.nominal, number.tolerance, k, number.low, number.high)
            for k in range(len(self.records))
            for number in self.model.starts
        ]
        unknown = [
            Entry("unknown", each.name, 0.0, each.size, k, knot=i, intervals=intervals)
            for k in range(len(self.records))
            for each in self.unknown(terms)
            for i, intervals in self._acting(k, each, terms)
        ]
        return [self._as_fixed(entry) for entry in (*own, *starts, *unknown)]

    def _acting(self, k: int, unknown: Unknown, terms: Terms) -> list[tuple[int, int]]:
        """Return the knots of record k at which an unknown input acts in an explanation, each with the number of
        intervals between the first and the last knot of the record.
        """
        own = [term for term in terms if term.kind == "unknown" and term.target == unknown.name]
        spans = [(term.intervals, term.begins, term.ends) for term in own if term.record in (-1, k)]
        found: list[tuple[int, int]] = []
        for intervals, begins, ends in [(0, -np.inf, np.inf)] if unknown.usual else spans:
            count = intervals or self.intervals_of(k, unknown)
            times = self.knots(k, count)
            acts = np.flatnonzero((times >= begins) & (times <= ends))
            found += [(i, count) for i in acts.tolist()]
        return found

    def _as_fixed(self, entry: Entry) -> Entry:
        """Return an entry, at its value where it is fixed."""
        if entry.identity not in self.fixed:
            return entry
        return replace(entry, centre=self.fixed[entry.identity], sd=FIXED * entry.sd)

    def _readings_of(
        self, k: int, terms: Terms, entries: Sequence[Entry], sets: Sequence[np.ndarray], *, must: bool
    ) -> list[dict[str, np.ndarray] | None]:
        """Return readings of record k with sets of entries; only what moves an entry of its own is asked for."""
        wrong = _wrong_inputs(terms)
        own = [i for i, entry in enumerate(entries) if _moves(entry, k)]
        mine = [entries[i] for i in own]
        keys = [x[own].tobytes() for x in sets]
        new = {
            key: self._asked(k, mine, x[own])._replace(wrong=wrong) for key, x in zip(keys, sets, strict=True)
        }
        found = dict(zip(new, self.runs[k].readings(list(new.values()), must=must), strict=True))
        return [found[key] for key in keys]

    def _asked(self, k: int, entries: Sequence[Entry], x: np.ndarray) -> Asked:
        """Return the run of record k with entries at x."""
        numbers = dict(self._nominal)
        time = self.records[k].time
        unknown = {each.name: np.zeros(time.size) for each in self.model.unknown}
        for entry, value in zip(entries, x.tolist(), strict=True):
            if entry.kind == "unknown":
                unknown[entry.name] += value * self._hat(k, entry.intervals, entry.knot)
            else:
                numbers[f"{entry.name}.since" if entry.kind == "since" else entry.name] = value
        shared = {number.name: number for number in self.model.shared}
        for name in (entry.name for entry in entries if entry.kind == "change"):
            own = shared[name.partition(".")[2]]  # with its change it is within its bounds, too
            now = numbers[own.name]
            numbers[name] = min(max(numbers[name], own.low - now), own.high - now)
        return Asked(numbers, unknown)

    def _hat(self, k: int, intervals: int, knot: int) -> np.ndarray:
        """Return the function that is 1 at a knot of record k, 0 at the others, and linear in between (n,)."""
        if (k, intervals) not in self._hats:
            knots = self.knots(k, intervals)
            rows = [np.interp(self.records[k].time, knots, row) for row in np.eye(intervals + 1)]
            self._hats[k, intervals] = np.array(rows)
        return self._hats[k, intervals][knot]

    @cached_property
    def _nominal(self) -> dict[str, float]:
        """The numbers of the nominal model, those of its causes off, by their names "cause.number"."""
        return {name: value for name, value in self.model.nominal().items() if not isinstance(value, dict)}

    def residuals(
        self,
        terms: Terms,
        entries: Sequence[Entry],
        sets: Sequence[np.ndarray],
        channels: Sequence[str] | None = None,
        *,
        must: bool = False,
    ) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """Return channel → residuals (m, k) of k sets of entries, of some channels or of all, and which sets could be
        simulated (k,).
        """
        runs = [self._readings_of(k, terms, entries, sets, must=must) for k in range(len(self.records))]
        valid = np.array([all(of[j] is not None for of in runs) for j in range(len(sets))])
        found = {}
        for name in self.channels if channels is None else channels:
            columns = np.full((self.channels[name].values.size, len(sets)), np.nan)
            recorded, sensor = self.recorded(name, terms), self.model.channels[name]
            for j in np.flatnonzero(valid).tolist():
                simulated = self._simulated(name, [of[j] or {} for of in runs], entries, sets[j])
                shown = self.shown(name, terms, entries, sets[j], simulated)
                e = recorded - np.clip(shown, sensor.low, sensor.high)
                columns[:, j] = self._turned(name, terms, e)
            found[name] = columns
        return found, valid

    def _simulated(
        self, name: str, readings: Sequence[Mapping[str, np.ndarray]], entries: Sequence[Entry], x: np.ndarray
    ) -> np.ndarray:
        """Return simulated readings of a channel at its times (m,)."""
        each = self.channels[name]
        late, fast = (
            sum(x[i] for i, entry in enumerate(entries) if entry.kind == kind and entry.name in (name, CLOCK))
            for kind in ("delay", "rate")
        )
        found = np.empty(each.values.size)
        for k, record in enumerate(self.records):
            at = each.record == k
            if at.any():
                true = each.time[at] - late - fast * (each.time[at] - record.time[0])
                found[at] = np.interp(true, record.time, readings[k][name])
        return found

    def recorded(self, name: str, terms: Terms) -> np.ndarray:
        """Return the readings of a channel with its known errors undone: (y − a)/b (m,), noise with them."""
        each = self.readings_of(name, terms)
        values = each.values.copy()
        for term in self._errors(name, terms):
            at = self.where(each, term)
            values[at] = (values[at] - term.offset) / term.factor
        return values

    def readings_of(self, name: str, terms: Terms) -> Readings:
        """Return the readings of a channel, which are in the column of another one if the two are swapped."""
        return self.channels[_column(name, terms)]

    def may_be_swapped(self, a: str, b: str) -> bool:
        """Return whether two channels have the same times, so that their readings may be exchanged."""
        return np.array_equal(self.channels[a].time, self.channels[b].time)

    def shown(
        self, name: str, terms: Terms, entries: Sequence[Entry], x: np.ndarray, simulated: np.ndarray
    ) -> np.ndarray:
        """Return what a sensor with its errors shows of simulated readings h: a + (1 + g) h + d τ + step (m,)."""
        each = self.channels[name]
        free = {
            entry.kind: x[i]
            for i, entry in enumerate(entries)
            if entry.name == name and entry.kind in CORRECTIONS
        }
        values = free.get("offset", 0.0) + (1.0 + free.get("gain", 0.0)) * simulated
        for term in self._errors(name, terms):
            at = self.where(each, term)
            if term.kind == "drift":
                values[at] += free["drift"] * self._ramp(each)[at]
            elif term.kind == "offset" and "step" in free:
                values[at] += free["step"]
        return values

    def _errors(self, name: str, terms: Terms) -> list[Term]:
        """Return the errors of the readings of a channel."""
        return [term for term in terms if term.is_data_error and term.target == name and term.kind != "stuck"]

    def log_jacobian(self, terms: Terms, e: Mapping[str, np.ndarray]) -> float:
        """Return log |∂(record as it should be)/∂(record)|, which makes evidences of corrected records comparable; and
        how much less probable it is that readings are equal in a row by chance than as they are stuck.

        Args:
            terms: the explanation.
            e: channel → its residuals (m,).
        """
        total = 0.0
        for term in terms:
            if not term.is_data_error or term.target not in self.channels:
                continue
            each = self.readings_of(term.target, terms)
            if term.kind == "stuck":
                total -= self._log_equal(terms, term, self.recorded(term.target, terms) - e[term.target])
            else:
                total -= int((self.where(each, term) & each.used).sum()) * np.log(abs(term.factor))
        return float(total)

    def _log_equal(self, terms: Terms, term: Term, simulated: np.ndarray) -> float:
        """Return the log probability that readings of a time are equal by chance: as neighbours are in the rest of the
        record; or, where a sensor rounds, as its step is longer than what the simulation (m,) moves.

        A value that moves by d is rounded to another multiple of q with the probability d/q.
        """
        each, step = self.readings_of(term.target, terms), self.prior(term.target, terms).resolution
        at, equal = self.where(each, term), np.diff(each.values) == 0.0
        inside = at[1:] & at[:-1]
        rest = (equal[~inside].sum() + 1.0) / ((~inside).sum() + 2.0)
        chance = np.full(equal.size, rest)
        if step > 0.0:
            chance = np.maximum(chance, 1.0 - np.abs(np.diff(simulated)) / step)
        return float(np.sum(np.log(chance[inside & equal])))

    def used(self, name: str, terms: Terms) -> np.ndarray:
        """Return which readings of a channel an explanation uses (m,)."""
        each = self.readings_of(name, terms)
        stuck = [self.where(each, term) for term in terms if term.kind == "stuck" and term.target == name]
        return each.used & ~np.any(stuck, axis=0) if stuck else each.used

    def steps(self, entries: Sequence[Entry], x: np.ndarray) -> np.ndarray:
        """Return the step of the sensitivity to each entry (n,), to the side that its bounds leave."""
        step = np.array(
            [
                STEP_DELAY * self.intervals[entry.name] / (self._longest if entry.kind == "rate" else 1.0)
                if entry.kind in ("delay", "rate")
                else STEP * entry.sd
                for entry in entries
            ]
        )
        high = np.array([entry.high for entry in entries])
        return np.where(x + step <= high, step, -step)

    def jacobian(
        self,
        terms: Terms,
        entries: Sequence[Entry],
        x: np.ndarray,
        wanted: Sequence[int] | None = None,
        *,
        must: bool = False,
    ) -> dict[str, np.ndarray]:
        """Return channel → −∂e/∂x (m, n) at x, of some entries or of all; 0 where neither side can be simulated, and of
        numbers that are fixed.

        Args:
            terms: of the explanation.
            entries: its free numbers.
            x: the point (n,), which can be simulated.
            wanted: places of some entries.
            must: whether a model that cannot be simulated a small step away is refused.
        """
        asked = range(len(entries)) if wanted is None else wanted
        free = np.array([entries[i].identity not in self.fixed for i in asked], dtype=bool)
        places = np.asarray(asked, dtype=int)[free]
        steps = self.steps(entries, x)[places]
        columns, valid = self._columns(terms, entries, x, places, steps, must=must)
        if not valid.all():
            steps[~valid] *= -1.0
            again, _ = self._columns(terms, entries, x, places[~valid], steps[~valid], must=False)
            for name, column in again.items():
                columns[name][:, ~valid] = np.nan_to_num(column)
        found = {name: np.zeros((column.shape[0], free.size)) for name, column in columns.items()}
        for name, column in columns.items():
            found[name][:, free] = column
        return found

    def _columns(
        self,
        terms: Terms,
        entries: Sequence[Entry],
        x: np.ndarray,
        places: np.ndarray,
        steps: np.ndarray,
        *,
        must: bool,
    ) -> tuple[dict[str, np.ndarray], np.ndarray]:
        moved = np.repeat(x[None, :], places.size, axis=0)
        moved[np.arange(places.size), places] += steps
        found, valid = self.residuals(terms, entries, [x, *moved], must=must)
        return {name: self._wrapped(name, e[:, :1] - e[:, 1:]) / steps for name, e in found.items()}, valid[
            1:
        ]

    def _wrapped(self, name: str, values: np.ndarray) -> np.ndarray:
        turn = self.model.channels[name].turn
        return values - turn * np.rint(values / turn) if turn else values

    def _turned(self, name: str, terms: Terms, e: np.ndarray) -> np.ndarray:
        """Return residuals (m,) of an angle: continuous from the first reading of each record on, which is less than
        half a turn off, where the readings follow the angle; else all less than half a turn.
        """
        turn = self.model.channels[name].turn
        if not turn:
            return e
        found, of = self._wrapped(name, e), self.channels[name].record
        for record in np.unique(of).tolist():
            at = np.flatnonzero(self.used(name, terms) & (of == record))
            steps = self._wrapped(name, np.diff(e[at]))
            if at.size and not (np.abs(steps) > FOLLOWS * turn).any():
                found[at] += np.concatenate([[0.0], np.cumsum(steps)]) - (found[at] - found[at[0]])
        return found

    def where(self, each: Readings, term: Term) -> np.ndarray:
        """Return which readings of a channel (m,) an error in the data is about."""
        of = np.ones(each.time.size, dtype=bool) if term.record < 0 else each.record == term.record
        spans = term.spans or ((term.begins, term.ends),)
        return of & np.any([(each.time >= first) & (each.time <= last) for first, last in spans], axis=0)

    def _ramp(self, each: Readings) -> np.ndarray:
        """Return time as −½ at the beginning of each record and ½ at its end (m,)."""
        start = np.array([record.time[0] for record in self.records])[each.record]
        span = np.array([np.ptp(record.time) for record in self.records])[each.record]
        return (each.time - start) / span - 0.5


def _column(name: str, terms: Terms) -> str:
    """Return the channel in whose column the readings of a channel are."""
    pairs = [(term.target, term.partner) for term in terms if term.kind == "swapped"]
    return next((b if name == a else a for a, b in pairs if name in (a, b)), name)


def _wrong_inputs(terms: Terms) -> dict[str, tuple[str, float]]:
    """Return input → column that holds it, and by which factor it is too large there."""
    found: dict[str, tuple[str, float]] = {}
    for term in (term for term in terms if term.kind == "input"):
        for name in filter(None, (term.target, term.partner)):
            found[name] = (name, found.get(name, (name, 1.0))[1] * term.factor)
    for a, b in [(term.target, term.partner) for term in terms if term.kind == "exchanged"]:
        found[a], found[b] = (b, found.get(a, (a, 1.0))[1]), (a, found.get(b, (b, 1.0))[1])
    return found


def _moves(entry: Entry, k: int) -> bool:
    """Return whether an entry changes the simulation of record k."""
    return entry.record in (-1, k) and entry.kind not in CORRECTIONS


def _input(record: Record, name: str) -> np.ndarray:
    """Return an input of a record (n,), without gaps."""
    if name not in record.columns:
        raise UserError(
            f"{record.name}: there is no input {name!r}; it has {', '.join(record.columns) or 'nothing'}."
        )
    values, at = record.columns[name], record.times_of(name)
    known = np.isfinite(values)
    if not known.any():
        raise UserError(f"{record.name}: the input {name!r} has no value.")
    return np.interp(record.time, at[known], values[known])
