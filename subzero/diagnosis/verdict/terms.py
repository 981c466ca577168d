"""Terms of an explanation of any model in the words of a trial: causes of the catalogue, and errors in the data.

offset, scale of a channel, small delay of the clock     sensor_bias, sensor_scale, clock_offset of the catalogue
cause, cause from a time on                              "rudder_lag", "rudder_offset@12"
drift of a channel, unknown input                        "sensor_drift:heading", "unknown_force:X"
all other errors in the data                             a `DataError`, which can correct the record
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from subzero.channels import BY_NAME, HEADING
from subzero.diagnosis.hypothesis.data_error import COMMAND_GROUPS, LEAST, REFERENCES, DataError
from subzero.diagnosis.inference.latent_force import DRIFT, FORCE
from subzero.identification.explanation import CLOCK, Term, kinds_of
from subzero.identification.fit import Fit
from subzero.identification.problem import Problem
from subzero.identification.ranking import Key
from subzero.records.consistency import MISTAKEN

OF_SENSORS = {"offset": ("sensor_bias", "shift"), "scale": ("sensor_scale", "share")}
"""Kind of a term → effect of the catalogue, and its parameter."""
ENTRIES = {
    "offset": ("sensor_bias", "shift"),
    "gain": ("sensor_scale", "share"),
    "delay": ("clock_offset", "late"),
}
"""Kind of an entry of a sensor → effect of the catalogue, and its parameter."""
SAME_FACTOR = 0.02
"""A factor this close to that of a unit is that of the unit. [-]"""
GROUPS = {columns[0]: group for group, columns in COMMAND_GROUPS.items() if len(columns) == 1}
"""Command → group of which it is the only one."""


@dataclass(frozen=True)
class Size:
    """A number of a fit with its standard deviation."""

    value: float
    sd: float


def sizes(fit: Fit) -> dict[tuple[str, str], Size]:
    """Return (kind, name) of an entry that belongs to a term, or to a sensor → its size."""
    return {
        (entry.kind, entry.name): Size(value, math.sqrt(variance))
        for entry, value, variance in zip(fit.entries, fit.x.tolist(), fit.variance.tolist(), strict=True)
        if entry.kind not in ("start", "unknown")
    }


def ids_of(problem: Problem, fit: Fit) -> tuple[str, ...]:
    """Return the ids of all terms of an explanation, in alphabetical order; () where nothing is wrong."""
    return tuple(sorted({id_of(problem, fit, term) for term in fit.terms if term.kind != "tolerances"}))


def cause_of(fit: Fit, term: Term) -> str:
    """Return the id of a cause of the catalogue; "" for a term that is none."""
    if term.kind == "cause":
        since = _since(fit, term)
        return f"{term.target}@{since.value:.4g}" if since else term.target
    if term.kind in OF_SENSORS and math.isinf(term.begins):
        return f"{OF_SENSORS[term.kind][0]}:{term.target}"
    if term.id == f"delay:{CLOCK}" and abs(_size(fit, term).value) < LEAST["late_clock"]:
        return "clock_offset"
    return ""


def _since(fit: Fit, term: Term) -> Size | None:
    """Return the onset of a cause, if it has one. [s]"""
    return sizes(fit).get(("since", term.target)) if math.isfinite(term.begins) else None


def _size(fit: Fit, term: Term) -> Size:
    """Return the number of an error in the data that has one."""
    return next(
        size for (kind, name), size in sizes(fit).items() if name == term.target and kind in kinds_of(term)
    )


def id_of(problem: Problem, fit: Fit, term: Term) -> str:
    """Return the id of a term as it is reported."""
    if cause := cause_of(fit, term):
        return cause
    if term.kind == "unknown":
        return term.target if term.target.startswith(DRIFT) else f"{FORCE}{term.target}"
    if term.kind == "drift":
        return f"{DRIFT}{term.target}"
    error = data_error(problem, fit, term)
    return error.id if error else term.id


def ids_of_ranked(name: Key) -> tuple[str, ...]:
    """Return the ids of an explanation that was ranked and not fitted: without sizes and onsets."""
    return tuple(sorted({_id_of_ranked(id.partition("@")[0]) for id, *_ in name if id != "tolerances"}))


def _id_of_ranked(id: str) -> str:
    kind, _, target = id.partition(":")
    if kind in OF_SENSORS:
        return f"{OF_SENSORS[kind][0]}:{target}"
    return {f"delay:{CLOCK}": "clock_offset", f"drift:{target}": f"{DRIFT}{target}"}.get(id, id)


def data_error(problem: Problem, fit: Fit, term: Term) -> DataError | None:
    """Return an error in the data; None for a term that is none, or a cause of the catalogue."""
    if not term.is_data_error or cause_of(fit, term) or term.kind in ("drift", "unknown"):
        return None
    if term.kind == "stuck":
        return _stuck(problem, fit, term)
    return _OF_KIND[term.kind](fit, term)


def _unit(fit: Fit, term: Term) -> DataError:
    """Return y = a + b x of a channel: a known unit, the other sign, another reference of a compass, or any."""
    known, channel = sizes(fit), term.target
    gain, offset = (
        known.get(("gain", channel), Size(0.0, 0.0)),
        known.get(("offset", channel), Size(0.0, 0.0)),
    )
    factor, zero = term.factor, term.offset
    if term.kind != "unit":
        factor, zero = factor * (1.0 + gain.value), zero + factor * offset.value
    begins = term.begins if math.isfinite(term.begins) else 0.0
    if channel == HEADING and abs(factor) == 1.0 and zero:
        for how, (turned, direction) in REFERENCES.items():
            if direction == factor and math.isclose((turned - zero) % 360.0, 0.0, abs_tol=1e-6):
                return DataError(kind="reference", channels=(channel,), how=how)
    if factor == -1.0 and not zero and not begins:
        return DataError(kind="sign", channels=(channel,))
    for how, usual in MISTAKEN.get(BY_NAME[channel].unit, {}).items():
        if abs(factor / usual - 1.0) < SAME_FACTOR and (
            term.kind == "unit" or abs(offset.value) < 3.0 * offset.sd
        ):
            return DataError(kind="unit", channels=(channel,), how=how, since=begins)
    return DataError(kind="affine", channels=(channel,), amount=zero, scale=factor, since=begins)


def _stuck(problem: Problem, fit: Fit, term: Term) -> DataError:
    """Return readings that repeat a value: to the end, or here and there."""
    each, channel = problem.readings_of(term.target, fit.terms), term.target
    at = problem.where(each, term) & np.isfinite(each.values)
    times, values = each.time[at], np.unique(each.values[at])
    if (
        len(term.spans) == 1
        and times[-1] == each.time[np.isfinite(each.values) & (each.record == term.record)][-1]
    ):
        return DataError(kind="frozen", channels=(channel,), since=float(times[0]), at=tuple(times.tolist()))
    how = f"{values[0] + 0.0:.9g}" if values.size == 1 and len(term.spans) > 1 else ""
    return DataError(kind="dropout", channels=(channel,), how=how, at=tuple(times.tolist()))


def _late(fit: Fit, term: Term) -> DataError:
    late = _size(fit, term)
    if term.target == CLOCK:
        return DataError(kind="late_clock", amount=late.value, amount_sd=late.sd)
    return DataError(kind="latency", channels=(term.target,), amount=late.value, amount_sd=late.sd)


def _fast(fit: Fit, term: Term) -> DataError:
    rate = _size(fit, term)
    slow = 1.0 - rate.value
    return DataError(kind="clock_rate", amount=rate.value / slow, amount_sd=rate.sd / slow**2)


def _step(fit: Fit, term: Term) -> DataError:
    step = _size(fit, term)
    return DataError(
        kind="step", channels=(term.target,), since=term.begins, amount=step.value, amount_sd=step.sd
    )


def _command(fit: Fit, term: Term) -> DataError:
    columns = tuple(filter(None, (term.target, term.partner)))
    if term.factor == -1.0 and (groups := _groups_of(columns)):
        return DataError(kind="command_sign", channels=groups)
    return DataError(kind="command_unit", channels=columns, scale=term.factor)


def _groups_of(columns: tuple[str, ...]) -> tuple[str, ...]:
    """Return the groups of commands that some columns are; none if one of them is in no group."""
    for group, own in COMMAND_GROUPS.items():
        if set(own) == set(columns):
            return (group,)
    return tuple(GROUPS[name] for name in columns) if GROUPS.keys() >= set(columns) else ()


def _commands(fit: Fit, term: Term) -> DataError:
    channels = tuple(GROUPS.get(name, name) for name in (term.target, term.partner))
    return DataError(kind="command_swap", channels=channels)


_OF_KIND: Mapping[str, Callable[[Fit, Term], DataError]] = {
    "unit": _unit,
    "affine": _unit,
    "scale": _unit,
    "swapped": lambda fit, term: DataError(kind="swapped", channels=(term.target, term.partner)),
    "delay": _late,
    "rate": _fast,
    "offset": _step,
    "input": _command,
    "exchanged": _commands,
}
"""Kind of a term → the error in the data that it is."""
