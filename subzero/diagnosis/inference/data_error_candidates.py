"""Which errors the data of a record may have: all that are to be judged, with numbers on a grid (`possible`)."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from subzero.channels import BY_NAME, HEADING, turned
from subzero.diagnosis.hypothesis.data_error import COMMAND_GROUPS, LEAST, REFERENCES, SWAPS, DataError
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.inference.data_error_yardstick import Yardstick
from subzero.diagnosis.inference.noise import resolution_of, usual_noise
from subzero.diagnosis.inference.posing import usual_of
from subzero.records.consistency import MISTAKEN

FEWEST = 6
"""A channel with fewer samples says nothing."""
LATEST_SHARE, CLOCK_STEP_S, LATEST_CHANNEL_S = 0.5, 0.5, 6.0
"""Clocks are late by up to this share of the record, tried every so often; one channel by no more than that. [s]"""
RATES, RATE_STEP = (0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.14, 0.16, 0.18, 0.2), 0.02
"""By how much a clock may run too fast, or too slow. [-]"""
CHANNEL_STEP_S = 1.0
"""Delays of one channel are tried every so often: its lag and the clock are free about each. [s]"""
STEP_MARGIN = 0.1
"""No step is looked for so close to the ends of a record, as a share of it: there it is a bias, or nothing."""
STEP_TIMES, STEP_LEVELS = 40, 30.0
"""A step in a sensor is looked for at so many times; its usual size in levels of the noise."""
LOUDEST = 6.0
"""Noise of a sensor is never so many usual levels: what is louder in another unit is not in that unit. [-]"""


class Group(NamedTuple):
    """Errors of a kind that share its probability; `step` of a number that is tried on a grid, 0 if there is none."""

    each: list[DataError]
    step: float = 0.0


def possible(yardstick: Yardstick, trusted: frozenset[str]) -> list[Group]:
    """Return all errors that a record may have, but for repeated values."""
    values, time = yardstick.logged.record.values, yardstick.logged.record.time
    names = [name for name in values if name in yardstick.nominal]
    open_ = [name for name in names if name not in trusted]
    units = [DataError(kind="unit", channels=(name,), how=how)
             for name in open_ for how in MISTAKEN.get(BY_NAME[name].unit, {})]  # fmt: skip
    units = [one for one in units if _is_quiet(yardstick, one)]
    pairs = [DataError(kind="swapped", channels=pair) for pair in itertools.combinations(open_, 2)]
    found = [
        Group([DataError(kind="sign", channels=(name,)) for name in open_]),
        Group(units),
        Group(
            [
                DataError(kind="reference", channels=(HEADING,), how=how)
                for how in REFERENCES
                if HEADING in open_
            ]
        ),
        Group(pairs),
        Group([one for one in yardstick.repeated if one.channels[0] in open_]),
    ]
    found += [Group([one for name in open_ for one in _step(yardstick, name)]), *_clocks(time, open_)]
    if yardstick.logged.setting.trial.commands is not None:
        found += _commands(yardstick.logged)
    return [group for group in found if group.each]


def _is_quiet(yardstick: Yardstick, error: DataError) -> bool:
    """Say whether a channel's noise from sample to sample is that of a sensor, once it is in the right unit.

    Where the prediction fails, any unit that makes a record smaller than it would be as likely; but not its noise.
    """
    (name,) = error.channels
    record = error.corrected(yardstick.logged).record
    known = record.values[name][np.isfinite(record.values[name])]
    level = usual_of(name, known, yardstick.logged.noise).level
    if known.size < FEWEST or np.ptp(known) == 0.0:
        return False
    expected = yardstick.at(yardstick.nominal[name], record.time)
    jitter = _jitter(known) + resolution_of(known, level) / np.sqrt(12.0)
    return jitter < LOUDEST * level + 2.0 * _jitter(expected)


def _jitter(values: np.ndarray) -> float:
    """Return the standard deviation of white noise whose second differences are as large (median)."""
    return 1.4826 * float(np.median(np.abs(np.diff(values, 2)))) / np.sqrt(6.0) if values.size > 2 else 0.0


def _clocks(time: np.ndarray, names: Sequence[str]) -> list[Group]:
    span = float(time[-1] - time[0])
    least = LEAST["late_clock"]
    late = np.arange(least, max(LATEST_SHARE * span, 2.0 * least), CLOCK_STEP_S)
    own = np.arange(LEAST["latency"], min(LATEST_CHANNEL_S, LATEST_SHARE * span) + 1e-9, CHANNEL_STEP_S)
    found = [_numbered("late_clock", late, CLOCK_STEP_S), _numbered("clock_rate", RATES, RATE_STEP)]
    return found + [_numbered("latency", own, CHANNEL_STEP_S, name) for name in names if len(names) > 1]


def _numbered(kind: str, sizes: Iterable[float], step: float, *channels: str) -> Group:
    """Return errors of a kind of these sizes, either way."""
    both = [side * float(x) for x in sizes for side in (1.0, -1.0)]
    return Group([DataError(kind=kind, channels=channels, amount=x) for x in both], step)


def _commands(logged: Logged) -> list[Group]:
    """Return the errors of commands that change any."""
    turned_ = [DataError(kind="command_sign", channels=(group,)) for group in COMMAND_GROUPS]
    exchanged = [DataError(kind="command_swap", channels=pair) for pair in SWAPS]
    return [Group(_different(logged, some)) for some in (turned_, exchanged)]


def _different(logged: Logged, errors: Iterable[DataError]) -> list[DataError]:
    """Return those errors that change commands, each change once."""
    found: dict[bytes, DataError] = {}
    own = logged.setting.trial.commands
    assert own is not None
    for one in errors:
        changed = one.corrected(logged).setting.trial.commands
        assert changed is not None
        if not np.array_equal(changed.values, own.values):
            found.setdefault((changed.values + 0.0).tobytes(), one)
    return list(found.values())


def _step(yardstick: Yardstick, name: str) -> list[DataError]:
    """Return the step in a sensor that explains most of what the generous fit leaves of its channel."""
    record, here = yardstick.logged.record, yardstick.as_is
    values, time = record.values[name], record.time
    expected = yardstick.at(yardstick.nominal[name], time)
    values = turned(values, expected) if name == HEADING else values
    usual = usual_of(name, values, yardstick.logged.noise)
    used = np.isfinite(values)
    noise = usual_noise(time, used, usual)
    begins = time[0] + (time[-1] - time[0]) * np.linspace(STEP_MARGIN, 1.0 - STEP_MARGIN, STEP_TIMES)
    steps = (time[:, None] >= begins).astype(float)
    rows = np.column_stack([values - expected - yardstick.at(yardstick.slopes[name], time) @ here.z, steps,
                            yardstick.at(yardstick.slopes[name], time)])  # fmt: skip
    white = noise.whiten(rows) / here.scales[name]
    r, C, J = white[:, 0], white[:, 1 : 1 + begins.size], white[:, 1 + begins.size :]
    cross = J.T @ C
    M = np.sum(C * C, axis=0) - np.sum(cross * (here.M @ cross), axis=0)
    q, prior = C.T @ r, (STEP_LEVELS * usual.level) ** -2
    best = int(np.argmax(q**2 / (np.maximum(M, 0.0) + prior)))
    size = float(q[best] / (max(M[best], 0.0) + prior))
    return [DataError(kind="step", channels=(name,), amount=size, since=_first(time, begins[best]))]


def _first(time: np.ndarray, at: float) -> float:
    return float(time[np.searchsorted(time, at)])
