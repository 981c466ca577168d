"""The same trial with and without its cable, side by side, and beside what was measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import scenarios
from subzero.channels import UNITS
from subzero.engine.initial_conditions import Later
from subzero.model import Model, load
from subzero.overview import Overview
from subzero.records.record import Fit, Record, beside, fits, read_record
from subzero.simulation import simulate
from subzero.summary import summarise, summary_of

if TYPE_CHECKING:
    import xarray as xr

SHOWN = {
    "peak_speed_m_s": "m/s",
    "speed_at_end_m_s": "m/s",
    "heading_at_end_deg": "degree",
    "path_length_m": "m",
    "cable_length_at_end_m": "m",
    "largest_cable_force_N": "N",
}
"""Key of a summary that is shown of both runs → its unit."""

Progress = Callable[[float], None]
"""Called now and then with the fraction that is done, 0 to 1."""


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A trial, simulated with its cable and without.

    Args:
        tethered: the run with the cable.
        untethered: the same commands, the same code, no cable.
        trial: what was simulated.
        measured: what was measured in that trial, if it was.
    """

    tethered: xr.Dataset
    untethered: xr.Dataset
    trial: scenarios.Trial
    measured: Record | None = None

    def __repr__(self) -> str:
        """Return both runs in a few lines."""
        return self._overview().text()

    def _repr_html_(self) -> str:
        """Return the same for a notebook."""
        return self._overview().html()

    def _overview(self) -> Overview:
        """Return the numbers that one reads first, one column a run."""
        both = [summarise(run) for run in self.runs.values()]
        rows: list[tuple[str, ...]] = [("", *self.runs)]
        for key, unit in SHOWN.items():
            words = key.removesuffix(f"_{UNITS[unit][0]}").replace("_", " ")
            rows.append((words, *("–" if one[key] is None else f"{one[key]:.4g} {unit}" for one in both)))
        rows.append(("warnings", *(str(len(one["warnings"])) for one in both)))
        if self.measured is not None:
            rows.append(("measured", f"{', '.join(self.measured.values)} ({self.measured.source})"))
        return Overview(f"{self.trial.name}: {self.trial.description}", rows)

    @property
    def runs(self) -> dict[str, xr.Dataset]:
        """The two runs by name, the tethered one first."""
        return {"tethered": self.tethered, "untethered": self.untethered}

    def fits(self) -> dict[str, dict[str, Fit]]:
        """Return channel → run → how well that run explains what was measured."""
        return {} if self.measured is None else fits(self.runs, self.measured)

    def summary(self) -> dict[str, Any]:
        """Return the comparison in plain numbers and texts, ready for JSON; keys carry their units."""
        return summary_of(self.runs, self.measured)


def compare(
    scenario: str | Path | scenarios.Trial,
    *,
    measured: str | Path | Record | None = None,
    model: Model | None = None,
    later: Later = (),
    progress: Progress | None = None,
) -> Comparison:
    """Simulate a trial with its cable and without.

    Args:
        scenario: name of a shipped scenario, path of a scenario file, or a trial.
        measured: a measured record or the path of one, to set beside both runs.
        model: another model than the one that the scenario describes.
        later: times of results [s] and the model that holds from each of them on.
        progress: told the fraction that is done, from 0 to 1, over both runs.

    Raises:
        scenarios.ScenarioError: if the scenario cannot be used.
        UserError: if the measured record cannot be used, or does not look like this trial.
    """
    trial = scenario if isinstance(scenario, scenarios.Trial) else load(scenario)
    record = read_record(measured) if isinstance(measured, str | Path) else measured
    sidecar = _checked(record, trial)
    other: dict[str, Any] = {"model": model, "later": later} if model or later else {}
    tethered = simulate(trial, tethered=True, **other, progress=_half(progress, 0.0))
    untethered = simulate(trial, tethered=False, **other, progress=_half(progress, 0.5))
    record = beside(record, tethered) if record is not None else None
    if record is not None:
        from subzero.diagnosis.read_trials import check_beside

        check_beside(record, {"tethered": tethered, "untethered": untethered}, sidecar)
    return Comparison(tethered=tethered, untethered=untethered, trial=trial, measured=record)


def _checked(record: Record | None, trial: scenarios.Trial) -> Any:
    """Check before the runs that a record belongs to them; return its sidecar, None if there is no record."""
    if record is None:
        return None
    from subzero.diagnosis.read_trials import check_epoch

    return check_epoch(record, trial)


def _half(progress: Progress | None, start: float) -> Progress | None:
    """Return a progress that fills one half of another."""
    return (lambda fraction: progress(start + 0.5 * fraction)) if progress is not None else None
