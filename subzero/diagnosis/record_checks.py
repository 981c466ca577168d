"""The checks of a diagnosis for a record that is only set beside a run: its epoch, its units, its signs.

A comparison has its simulation anyway, so what is asked costs nothing. What a diagnosis needs besides (a length, a
sampling rate) is not asked for here.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import scenarios
from subzero.diagnosis.effects.sensors import NOISE
from subzero.diagnosis.plausible import stuck, unit_questions
from subzero.diagnosis.sidecar import Sidecar, read_sidecar
from subzero.diagnosis.timing import epoch_problems
from subzero.errors import UserError, listed
from subzero.records.goodness_of_fit import fits, modelled
from subzero.records.record import Record

if TYPE_CHECKING:
    import xarray as xr


def check_epoch(record: Record, trial: scenarios.Trial) -> Sidecar:
    """Check before a run that a record was measured in it, and return what its sidecar says.

    Raises:
        UserError: it was not, or the sidecar cannot be used.
    """
    _refuse(record, epoch_problems(record, trial))
    path = Path(record.source)
    return read_sidecar(path.with_suffix(".toml")) if path.suffix.lower() == ".csv" else Sidecar()


def check_beside(record: Record, runs: Mapping[str, xr.Dataset], sidecar: Sidecar) -> None:
    """Check that a record looks like one of the runs of its trial, the tethered one first.

    Raises:
        UserError: no sample can be compared, or a channel looks like another unit, another sign, or a stuck sensor.
    """
    if not any(one.samples for by_run in fits(dict(runs), record).values() for one in by_run.values()):
        _refuse(record, ["none of its samples can be compared: where the runs are, it has gaps"])
    suspects = {
        name: values for name, values in record.values.items() if name in NOISE and not sidecar.trusts(name)
    }
    found: list[list[str]] = []
    for run in runs.values():
        simulated = {name: modelled(run, name, record.time) for name in suspects}
        known = {name: values for name, values in suspects.items() if _overlaps(values, simulated[name])}
        found.append(stuck(known, simulated, NOISE) + unit_questions(known, simulated, NOISE))
    # A cable changes how much, never which unit: what fits the run without one is in the right unit too.
    _refuse(record, min(found, key=len, default=[]))


def _overlaps(measured: np.ndarray, simulated: np.ndarray) -> bool:
    return bool(np.isfinite(measured + simulated).any())


def _refuse(record: Record, problems: list[str]) -> None:
    if problems:
        raise UserError(listed(f"The measured record {record.source} cannot be compared:", problems))
