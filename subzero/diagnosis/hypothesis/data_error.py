"""Errors in the data, made by a logger, a file or a person in a record that a sensor measured correctly.

Each is a transformation of the record, or of the recorded commands, and so needs no physics:

    sign, unit, reference        y = ±x, a x, a₀ ± x of a channel (a compass that is turned, or counts the other way)
    step                         y = x + a from a time on
    affine                       y = a + b x, with any a and b
    frozen, dropout              a value that is repeated: from a time on, or here and there
    swapped                      two channels with each other's values
    late_clock, clock_rate       t = t′ + δ, (1 + ρ) t′ of all channels
    latency                      t = t′ + δ of one channel
    command_sign, command_swap   commands with the other sign, or in each other's column
    command_unit                 a command in another unit

`DataError.corrected` undoes the error in a record, and `DataError.planted` makes it. Probabilities of records are
compared as they were written, so that y = a x costs log|a| a sample (`DataError.log_jacobian`).

An offset of the clock within its `LEAST`, a first-order lag, a bias or a scale of a sensor are causes of the
catalogue and no errors in the data: they may have any size, errors in the data are discrete, or large.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from scenarios.heading import TURN, continuous, turned
from subzero.channels import BY_NAME, HEADING
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.hypothesis.noise import step_of
from subzero.errors import UserError
from subzero.records.consistency import MISTAKEN, REPORTED_COMMANDS
from subzero.records.record import Record

LEAST = {"late_clock": 1.5, "latency": 1.0, "clock_rate": 0.01}
"""Smaller delays belong to the catalogue: three of its scales of a clock [s], five of a lag [s]; a clock rate with a
smaller error is a good one.
"""

REFERENCES: dict[str, tuple[float, float]] = {
    "is 90 degrees too large": (90.0, 1.0),
    "is 90 degrees too small": (-90.0, 1.0),
    "is 180 degrees off": (180.0, 1.0),
    "counts counter-clockwise from east": (90.0, -1.0),
    "counts counter-clockwise from south": (180.0, -1.0),
    "counts counter-clockwise from west": (270.0, -1.0),
}
"""A wrong reference of a compass → (a₀, b): it shows a₀ + b × heading. Counter-clockwise from north is the sign."""

COMMANDS = tuple(REPORTED_COMMANDS)
PLANES = COMMANDS[2:]
COMMAND_GROUPS: dict[str, tuple[str, ...]] = {
    "rudder": COMMANDS[1:2],
    "stern_planes": PLANES,
    "stern_plane_port": PLANES[:1],
    "stern_plane_starboard": PLANES[1:],
}
"""Channels whose sign may be wrong."""
SWAPS: tuple[tuple[str, str], ...] = (
    ("rudder", "stern_plane_port"),
    ("rudder", "stern_plane_starboard"),
    ("rudder", "stern_planes"),
    ("stern_plane_port", "stern_plane_starboard"),
)
"""Channels whose columns may be exchanged; for both planes the port one stands for both."""


@dataclass(frozen=True, kw_only=True)
class DataError:
    """An error in the data of a record.

    Attributes:
        kind: a row of `KINDS`.
        channels: affected channels; none for a clock, groups of `COMMAND_GROUPS` for commands.
        how: which variant: a unit of `MISTAKEN`, a row of `REFERENCES`; "" where there is only one.
        amount: of a step or a regression [unit of the channel], a delay [s] or a rate [1].
        since: time from which on it holds. [s]
        at: samples that hold no measurement, by their times; of frozen values and drop-outs. [s]
        amount_sd: standard deviation of the amount; 0 where it is not known.
        scale: of a regression y = amount + scale x. [-]
    """

    kind: str
    channels: tuple[str, ...] = ()
    how: str = ""
    amount: float = 0.0
    since: float = 0.0
    at: tuple[float, ...] = ()
    amount_sd: float = 0.0
    scale: float = 1.0

    @property
    def id(self) -> str:
        """Such as "sign:heading", "unit:depth=feet", "late_clock"."""
        where = f":{'/'.join(self.channels)}" if self.channels else ""
        return f"{self.kind}{where}{f'={self.how}' if self.how else ''}"

    @property
    def is_of_commands(self) -> bool:
        """It is an error of the commands, not of the measurements."""
        return self.kind in ("command_sign", "command_swap", "command_unit")

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns of the record that it affects."""
        if self.is_of_commands and self.kind != "command_unit":
            return tuple(BY_NAME[error].column for group in self.channels for error in COMMAND_GROUPS[group])
        return tuple(BY_NAME[channel].column for channel in self.channels) or ("time_s",)

    @property
    def factor(self) -> float:
        """How many of the unit in the column make one of the right unit."""
        return MISTAKEN[BY_NAME[self.channels[0]].unit][self.how]

    def corrected(self, logged: Logged) -> Logged:
        """Return a record, with its trial, without this error."""
        return KINDS[self.kind].correct(self, logged)

    def planted(self, logged: Logged) -> Logged:
        """Return a record, with its trial, that has this error."""
        return KINDS[self.kind].plant(self, logged)

    def sentence(self) -> str:
        """Return a description of the error, in words."""
        return KINDS[self.kind].sentence(self)

    def remedy(self) -> str:
        """Return the remedy, in words."""
        return KINDS[self.kind].remedy(self)


Change = Callable[[DataError, Logged], Logged]
Words = Callable[[DataError], str]


class Kind(NamedTuple):
    """A kind of error: functions that correct and plant it, its description and its remedy."""

    correct: Change
    plant: Change
    sentence: Words
    remedy: Words


def _with(logged: Logged, time: np.ndarray | None = None, **values: np.ndarray) -> Logged:
    """Return a record with some of its channels changed, or with other times."""
    record = logged.record
    made = Record(
        source=record.source,
        time=record.time if time is None else time,
        values={**record.values, **values},
    )
    steps = {name: step for name, step in logged.steps.items() if name not in values}
    return dataclasses.replace(logged, record=made, steps=steps)


def unturned(heading: np.ndarray) -> np.ndarray:
    """Return a heading (n,) without the whole turns that were added to compare it with a simulation: its first value
    is within ±180.
    """
    return turned(heading, 0.0)


def _values(change: Callable[[DataError, np.ndarray, np.ndarray], np.ndarray]) -> Change:
    """Return a change of a record that changes the values of one channel, from the time on from which an error holds:
    (error, time, values) → values.
    """

    def changed(error: DataError, logged: Logged) -> Logged:
        (channel,) = error.channels
        time, values = logged.record.time, logged.record.values[channel]
        return _with(logged, **{channel: np.where(time >= error.since, change(error, time, values), values)})

    return changed


def _negative(error: DataError, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    return -values


def _in_right_unit(error: DataError, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    if error.channels[0] != HEADING:
        return values / error.factor
    return continuous(unturned(values) / error.factor)


def _in_wrong_unit(error: DataError, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    if error.channels[0] != HEADING:
        return values * error.factor
    return np.mod(values + 0.5 * TURN, TURN) * error.factor - 0.5 * TURN * error.factor


def _to_north(error: DataError, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    zero, direction = REFERENCES[error.how]
    return direction * (values - zero)


def _from_reference(error: DataError, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    zero, direction = REFERENCES[error.how]
    return zero + direction * values


def _without_step(error: DataError, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.where(time >= error.since, values - error.amount, values)


def _with_step(error: DataError, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.where(time >= error.since, values + error.amount, values)


def _without_regression(error: DataError, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    return (values - error.amount) / error.scale


def _with_regression(error: DataError, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    return error.amount + error.scale * values


def _among(error: DataError, time: np.ndarray) -> np.ndarray:
    """Say which samples are no measurements (n,)."""
    return np.isin(np.round(time, 6), np.round(np.array(error.at), 6))


def _as_gaps(error: DataError, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.where(_among(error, time), np.nan, values)


def _repeated(error: DataError, time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return values that, where nothing is measured, repeat the last measured one, or are the number `how` if it is
    given.
    """
    lost, found = _among(error, time), values.copy()
    for k in np.flatnonzero(lost):
        found[k] = float(error.how) if error.how else found[k - 1] if k else values[0]
    return found


def _exchanged(error: DataError, logged: Logged) -> Logged:
    first, other = error.channels
    values = logged.record.values
    return _with(logged, **{first: values[other], other: values[first]})


def _inside(logged: Logged, time: np.ndarray) -> Logged:
    """Return a record at other times, without the samples outside its trial."""
    kept = (time >= -1e-9) & (time <= logged.setting.trial.duration + 1e-9)
    if not kept.any():
        raise UserError(f"'{logged.name}' has no sample within its trial once its clock is set right.")
    values = {name: column[kept] for name, column in logged.record.values.items()}
    record = Record(source=logged.record.source, time=np.maximum(time[kept], 0.0), values=values)
    return dataclasses.replace(logged, record=record, steps=_steps(logged, values))


def _steps(logged: Logged, channels: Iterable[str]) -> dict[str, float]:
    """Return channel → step between its values, from all samples: some are about to be put outside the trial."""
    values = logged.record.values
    shown = {name: step_of(name, values[name], logged.noise, logged.steps) for name in channels}
    return {**logged.steps, **shown}


def _earlier(error: DataError, logged: Logged) -> Logged:
    return _inside(logged, logged.record.time - error.amount)


def _slower(error: DataError, logged: Logged) -> Logged:
    return _inside(logged, logged.record.time / (1.0 + error.amount))


def _read_at(logged: Logged, when: np.ndarray, channels: tuple[str, ...]) -> Logged:
    """Return a record whose channels show at its times what they showed at others (n,); held at its ends."""
    time, values = logged.record.time, logged.record.values
    known = {name: np.isfinite(values[name]) for name in channels}
    shown = {
        name: np.where(
            _nearest(known[name], time, when),
            np.interp(when, time[known[name]], values[name][known[name]]),
            np.nan,
        )
        for name in channels
    }
    return _with(logged, **shown)


def _nearest(known: np.ndarray, time: np.ndarray, when: np.ndarray) -> np.ndarray:
    """Say whether the samples that are nearest to some times are known."""
    at = np.clip(np.searchsorted(time, when), 1, time.size - 1)
    at -= (when - time[at - 1]) < (time[at] - when)
    return known[at]


def _later(error: DataError, logged: Logged) -> Logged:
    return _read_at(logged, logged.record.time - error.amount, tuple(logged.record.values))


def _faster(error: DataError, logged: Logged) -> Logged:
    return _read_at(logged, logged.record.time / (1.0 + error.amount), tuple(logged.record.values))


def _delayed(error: DataError, logged: Logged) -> Logged:
    return _read_at(logged, logged.record.time - error.amount, error.channels)


def _in_time(error: DataError, logged: Logged) -> Logged:
    """Return a record in which one channel has times of its own, earlier by the delay; all others have gaps there."""
    (channel,) = error.channels
    record, own = logged.record, logged.record.time - error.amount
    inside = (own >= -1e-9) & (own <= logged.setting.trial.duration + 1e-9)
    time, place = np.unique(np.round(np.concatenate([record.time, own[inside]]), 9), return_inverse=True)
    values = {
        name: _spread(column, place[: record.time.size], time.size) for name, column in record.values.items()
    }
    values[channel] = _spread(record.values[channel][inside], place[record.time.size :], time.size)
    made = Record(source=record.source, time=time, values=values)
    return dataclasses.replace(logged, record=made, steps=_steps(logged, [channel]))


def _spread(values: np.ndarray, place: np.ndarray, size: int) -> np.ndarray:
    """Return values in their places among gaps (size,)."""
    found = np.full(size, np.nan)
    found[place] = values
    return found


def _with_commands(logged: Logged, values: np.ndarray) -> Logged:
    trial = logged.setting.trial
    assert trial.commands is not None
    commands = dataclasses.replace(trial.commands, values=values)
    setting = dataclasses.replace(logged.setting, trial=dataclasses.replace(trial, commands=commands))
    return dataclasses.replace(logged, setting=setting)


def _columns(group: str) -> list[int]:
    return [COMMANDS.index(error) for error in COMMAND_GROUPS[group]]


def _commands_turned(error: DataError, logged: Logged) -> Logged:
    assert logged.setting.trial.commands is not None
    values = logged.setting.trial.commands.values.copy()
    values[:, [at for group in error.channels for at in _columns(group)]] *= -1.0
    return _with_commands(logged, values)


def _commands_scaled(error: DataError, logged: Logged) -> Logged:
    return _commands_times(error, logged, error.scale)


def _commands_right(error: DataError, logged: Logged) -> Logged:
    return _commands_times(error, logged, 1.0 / error.scale)


def _commands_times(error: DataError, logged: Logged, factor: float) -> Logged:
    assert logged.setting.trial.commands is not None
    values = logged.setting.trial.commands.values.copy()
    values[:, [COMMANDS.index(name) for name in error.channels]] *= factor
    return _with_commands(logged, values)


def _commands_exchanged(error: DataError, logged: Logged) -> Logged:
    assert logged.setting.trial.commands is not None
    old = logged.setting.trial.commands.values
    values, (found, other) = old.copy(), map(_columns, error.channels)
    values[:, found], values[:, other] = old[:, other[:1]], old[:, found[:1]]
    return _with_commands(logged, values)


def _long(channel: str) -> str:
    return BY_NAME[channel].column


def _both(error: DataError) -> str:
    return " and ".join(_long(channel) for channel in error.channels)


def _groups(error: DataError) -> str:
    return " and ".join(channel.replace("_", " ") for channel in error.channels)


def _spans(times: tuple[float, ...]) -> str:
    """Return the number of these samples, and their first and last time, in words."""
    return f"{len(times)} samples between {times[0]:g} and {times[-1]:g} s" if times else "no sample"


def _since(error: DataError) -> str:
    return f" from {error.since:.3g} s on" if error.since else ""


def _number(error: DataError, scale: float = 1.0) -> str:
    """Return the size of an error's number, with half its interval of 95 %."""
    sd = f" ± {1.96 * scale * error.amount_sd:.2g}" if error.amount_sd else ""
    return f"{abs(scale * error.amount):.3g}{sd}"


def _unit_remedy(error: DataError) -> str:
    factor, unit = error.factor, BY_NAME[error.channels[0]].unit
    how = f"divide it by {factor:.4g}" if factor >= 1.0 else f"multiply it by {1.0 / factor:.4g}"
    return f"{how}, so that it is in {unit}"


def _reference_remedy(error: DataError) -> str:
    zero, direction = REFERENCES[error.how]
    return (
        f"subtract {zero:g} degrees"
        if direction > 0.0
        else f"replace it by {zero:g} degrees minus what it shows"
    )


KINDS: Mapping[str, Kind] = {
    "sign": Kind(
        _values(_negative),
        _values(_negative),
        lambda suspect: f"{_both(suspect)} has the other sign",
        lambda suspect: f"change its sign ({BY_NAME[suspect.channels[0]].long_name})",
    ),
    "unit": Kind(
        _values(_in_right_unit),
        _values(_in_wrong_unit),
        lambda suspect: f"{_both(suspect)} is in {suspect.how}{_since(suspect)}",
        _unit_remedy,
    ),
    "reference": Kind(
        _values(_to_north),
        _values(_from_reference),
        lambda suspect: f"{_both(suspect)} {suspect.how}",
        _reference_remedy,
    ),
    "step": Kind(
        _values(_without_step),
        _values(_with_step),
        lambda suspect: (
            f"{_both(suspect)} jumps {'up' if suspect.amount > 0.0 else 'down'} by {_number(suspect)} "
            f"{BY_NAME[suspect.channels[0]].unit} at {suspect.since:.3g} s, and nothing else does"
        ),
        lambda suspect: (
            f"subtract {suspect.amount:.3g} {BY_NAME[suspect.channels[0]].unit} from {suspect.since:.3g} s on, or "
            "leave gaps there"
        ),
    ),
    "frozen": Kind(
        _values(_as_gaps),
        _values(_repeated),
        lambda suspect: f"{_both(suspect)} is frozen from {suspect.since:.3g} s on",
        lambda suspect: f"leave its cells empty from {suspect.since:.3g} s on",
    ),
    "dropout": Kind(
        _values(_as_gaps),
        _values(_repeated),
        lambda suspect: (
            f"{_both(suspect)} {f'shows {suspect.how}' if suspect.how else 'repeats a value'} in place of "
            f"measurements ({_spans(suspect.at)})"
        ),
        lambda suspect: "leave these cells empty",
    ),
    "affine": Kind(
        _values(_without_regression),
        _values(_with_regression),
        lambda suspect: (
            f"{_both(suspect)} shows {suspect.scale:.4g} times what it should"
            f"{f', and {suspect.amount:+.3g} {BY_NAME[suspect.channels[0]].unit}' if suspect.amount else ''}"
            f"{_since(suspect)}"
        ),
        lambda suspect: (
            f"{f'subtract {suspect.amount:.3g}, and ' if suspect.amount else ''}divide it by {suspect.scale:.4g}"
        ),
    ),
    "command_unit": Kind(
        _commands_right,
        _commands_scaled,
        lambda suspect: f"{_both(suspect)} is {suspect.scale:.4g} times what was commanded",
        lambda suspect: f"divide it by {suspect.scale:.4g}",
    ),
    "swapped": Kind(
        _exchanged,
        _exchanged,
        lambda suspect: f"{_both(suspect)} have each other's values",
        lambda suspect: "exchange the headers of the two columns",
    ),
    "late_clock": Kind(
        _earlier,
        _later,
        lambda suspect: (
            f"the clock of the record is {_number(suspect)} s "
            f"{'late' if suspect.amount > 0.0 else 'early'} against the commands'"
        ),
        lambda suspect: (
            f"{'subtract' if suspect.amount > 0.0 else 'add'} {abs(suspect.amount):.3g} s "
            f"{'from' if suspect.amount > 0.0 else 'to'} time_s"
        ),
    ),
    "clock_rate": Kind(
        _slower,
        _faster,
        lambda suspect: (
            f"the clock of the record runs {_number(suspect, 100.0)} % too "
            f"{'fast' if suspect.amount > 0.0 else 'slow'}"
        ),
        lambda suspect: f"divide time_s by {1.0 + suspect.amount:.4g}",
    ),
    "latency": Kind(
        _in_time,
        _delayed,
        lambda suspect: (
            f"{_both(suspect)} is {_number(suspect)} s {'late' if suspect.amount > 0.0 else 'early'} "
            "against the other channels"
        ),
        lambda suspect: f"shift that column by {-suspect.amount:+.3g} s",
    ),
    "command_sign": Kind(
        _commands_turned,
        _commands_turned,
        lambda suspect: f"the command of the {_groups(suspect)} has the other sign",
        lambda suspect: "change the sign of that command",
    ),
    "command_swap": Kind(
        _commands_exchanged,
        _commands_exchanged,
        lambda suspect: f"the commands of the {_groups(suspect)} are in each other's columns",
        lambda suspect: "exchange these columns of the commands",
    ),
}
"""Kind → its definition."""


CORRECTED_FIRST = {"swapped": 0, "frozen": 1, "dropout": 1}
"""Kind → its turn among corrections, before all others."""


def corrected(logged: Logged, errors: tuple[DataError, ...]) -> Logged:
    """Return a record without some errors, corrected in turn: columns and times as they were written first."""
    for error in sorted(errors, key=lambda each: CORRECTED_FIRST.get(each.kind, len(CORRECTED_FIRST))):
        logged = error.corrected(logged)
    return logged
