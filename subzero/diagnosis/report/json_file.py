"""A verdict as ``diagnosis.json``: plain numbers and texts, NaN as null; docs/diagnosis_files.md explains every key."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, fields, is_dataclass
from typing import Any

import numpy as np

from subzero.channels import BY_NAME
from subzero.diagnosis.report import words
from subzero.diagnosis.report.summary import summary
from subzero.diagnosis.results import Cause, ChannelGain, Gain, Rival, Verdict

FORMAT = "subzero diagnosis 1"
NUMBERS = ("value", "low", "high", "unit", "nominal", "deviation", "deviation_sd")


def mapping(
    verdict: Verdict, records: Mapping[str, Mapping[str, Any]] | None = None, scenario: str = "SCENARIO"
) -> dict[str, Any]:
    """Return a verdict in plain numbers and texts, ready for JSON.

    Args:
        verdict: of `subzero.diagnose`.
        records: name → data on a record, such as its file and its scenario.
        scenario: the trial as the user named it, a name or a path, for lines of the shell.
    """
    known = words.sentences(verdict)
    return {
        "format": FORMAT,
        "verdict": verdict.verdict,
        "sentence": words.sentence(verdict),
        "summary": [each._asdict() for each in summary(verdict, scenario)],
        "complete": verdict.complete,
        "data_errors": [_plain(error) for error in verdict.data_errors],
        "then": verdict.then,
        "causes": [_cause(cause) for cause in verdict.causes],
        "rivals": [_rival(rival) for rival in verdict.rivals],
        "probabilities": _plain(verdict.probabilities),
        "explanations": {name: words.explanation(name, known) for name in verdict.probabilities},
        "tolerance_scale": {f"{scale:g}": p for scale, p in verdict.tolerance_scale.items()},
        "gain": _gain(verdict.gain),
        "gain_overall": _overall(verdict.gain),
        "next_trial": _next_trial(verdict),
        "unknown": _unknown(verdict),
        "detectable": [_plain(each) for each in verdict.detectable],
        "misfit": _plain(verdict.misfit),
        "extended": _extended(verdict),
        "deviations": {name: {"mean": mean, "sd": sd} for name, (mean, sd) in verdict.deviations.items()},
        "records": _plain(records or {}),
        "notes": list(verdict.notes),
        "unstable": list(verdict.unstable),
        "seconds": _plain(verdict.seconds),
        "seed": verdict.seed,
    }


def text(
    verdict: Verdict, records: Mapping[str, Mapping[str, Any]] | None = None, scenario: str = "SCENARIO"
) -> str:
    """Return a verdict as JSON."""
    return (
        json.dumps(
            _finite(mapping(verdict, records, scenario)), indent=2, ensure_ascii=False, allow_nan=False
        )
        + "\n"
    )


def _cause(cause: Cause) -> dict[str, Any]:
    parameters = {name: _plain(estimate) for name, estimate in cause.parameters.items()}
    return {
        "id": cause.id,
        "sentence": cause.sentence,
        "probability": cause.probability,
        "start_time_s": cause.start_time,
        "start_sd_s": None if cause.start_time is None else cause.start_sd,
        "parameters": parameters,
    }


def _rival(rival: Rival) -> dict[str, Any]:
    """A rival of one cause reads like a cause; of several, its parameters are named by cause."""
    tables = {name: {key: _plain(e) for key, e in table.items()} for name, table in rival.parameters.items()}
    parameters = next(iter(tables.values()), {}) if len(rival.ids) < 2 else tables
    return {
        "id": " + ".join(rival.ids) or "none",
        "ids": list(rival.ids),
        "sentence": rival.sentence,
        "probability": rival.probability,
        "discrimination": rival.discrimination,
        "parameters": parameters,
    }


def _gain(gain: Gain | None) -> dict[str, Any]:
    """Return channel → before, after and floor on held-out data (fitted, if none were held out), and both in full."""
    if gain is None:
        return {}
    names = dict.fromkeys((*gain.held_out, *gain.fitted))
    return {name: _channel_gain(name, gain.held_out.get(name), gain.fitted.get(name)) for name in names}


def _channel_gain(name: str, held_out: ChannelGain | None, fitted: ChannelGain | None) -> dict[str, Any]:
    best = held_out or fitted
    unit = BY_NAME[name].unit if name in BY_NAME else ""
    short = {key: getattr(best, key) for key in ("before", "after", "floor")}
    return {**short, "unit": unit, "held_out": _plain(held_out), "fitted": _plain(fitted)}


def _overall(gain: Gain | None) -> dict[str, Any] | None:
    if gain is None:
        return None
    return {"total": gain.total, "owed": gain.owed, "owed_low": gain.owed_low, "how": gain.how}


def _next_trial(verdict: Verdict) -> dict[str, Any] | None:
    next_trial = verdict.next_trial
    if next_trial is None:
        return None
    names = ("time_s", "propeller_rps", "rudder_deg", "stern_plane_port_deg", "stern_plane_starboard_deg")
    rows = [(*row[:2], *(math.degrees(angle) for angle in row[2:])) for row in next_trial.commands]
    columns = [list(column) for column in zip(*rows, strict=True)] if rows else [[] for _ in names]
    return {
        **{key: value for key, value in _plain(next_trial).items() if key != "commands"},
        "commands": dict(zip(names, columns, strict=True)),
    }


def _unknown(verdict: Verdict) -> dict[str, Any] | None:
    unknown = verdict.unknown
    if unknown is None:
        return None
    names = ("words", "feature", "coefficient", "low", "high")
    return {
        "axis": unknown.axis,
        "unit": unknown.unit,
        "time_s": unknown.time.tolist(),
        "force": unknown.force.tolist(),
        "band": unknown.band.tolist(),
        "formula": [dict(zip(names, term, strict=True)) for term in unknown.formula],
        "features": dict(unknown.features),
    }


def _extended(verdict: Verdict) -> dict[str, Any]:
    extended = verdict.extended
    return {
        "deviations": _plain(extended.deviations),
        "start_times_s": _plain(extended.start_times),
        "calibration": _plain(extended.calibration),
        "missing": None if extended.missing is None else _plain(asdict(extended.missing)),
    }


def _plain(value: Any) -> Any:
    """Return values of our own as mappings, lists and numbers."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    return value.item() if isinstance(value, np.generic) else value


def _finite(value: Any) -> Any:
    """Return None for every number that JSON cannot hold."""
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_finite(each) for each in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
