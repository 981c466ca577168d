"""A line of the validation page: our number, the number it should be, the error, and the gate for the error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Row:
    """One comparison.

    Attributes:
        name: what is compared, and in which configuration.
        ours: our number.
        reference: what it should be.
        unit: of both; "" for a pure number.
        error: what the gate judges; relative unless `measure` says otherwise.
        gate: the largest error that passes; infinite where the comparison is shown without a verdict.
        source: the equation or the code that the reference is from.
        measure: what the error is.
    """

    name: str
    ours: float
    reference: float
    error: float
    gate: float
    source: str
    unit: str = ""
    measure: str = "relative"

    @property
    def passed(self) -> bool:
        """Whether the error is a number and within the gate."""
        return bool(np.isfinite(self.error) and self.error <= self.gate)

    @property
    def judged(self) -> bool:
        """Whether there is a gate at all."""
        return bool(np.isfinite(self.gate))


@dataclass(frozen=True)
class Setting:
    """What the rows of one configuration have in common: its name, its source, the unit and the gate."""

    name: str
    source: str
    gate: float
    unit: str = "N"

    def row(self, ours: float, reference: float, scale: float | None = None, what: str = "") -> Row:
        """Compare two numbers, relative to `scale` (the reference when not given)."""
        scale = abs(reference) if scale is None else scale
        return self._row(what, ours, reference, abs(ours - reference) / scale)

    def worst(
        self, ours: np.ndarray, reference: np.ndarray, scale: np.ndarray | float | None = None, what: str = ""
    ) -> Row:
        """Compare series (n,), and show where they differ most, relative to `scale` (each reference when not given)."""
        ours, reference = np.broadcast_arrays(ours, np.asarray(reference, dtype=float))
        errors = np.abs(ours - reference) / (np.abs(reference) if scale is None else scale)
        k = int(np.argmax(errors))
        return self._row(what, float(ours[k]), float(reference[k]), float(errors[k]))

    def vector(self, ours: np.ndarray, reference: np.ndarray, what: str = "") -> Row:
        """Compare two vectors: their sizes are shown, the size of their difference is judged."""
        size = float(np.linalg.norm(reference))
        error = float(np.linalg.norm(np.subtract(ours, reference))) / size
        row = self._row(what, float(np.linalg.norm(ours)), size, error)
        return replace(row, measure="of the vector")

    def _row(self, what: str, ours: float, reference: float, error: float) -> Row:
        name = f"{self.name}: {what}" if what else self.name
        return Row(
            name=name,
            ours=ours,
            reference=reference,
            error=error,
            gate=self.gate,
            source=self.source,
            unit=self.unit,
        )


def order(sizes: Sequence[float], errors: Sequence[float]) -> float:
    """Return the slope of log error over log size, fitted to all refinements; no number where there is no error."""
    if not (np.asarray(errors) > 0.0).all():
        return float("nan")
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])


def order_row(name: str, sizes: Sequence[float], errors: Sequence[float], of: str, source: str) -> Row:
    """Compare an observed order with two: an order of 1.9 or more passes."""
    slope = order(sizes, errors)
    return Row(
        name=f"{name}: order in {of}, {len(sizes)} refinements",
        ours=slope,
        reference=2.0,
        error=max(2.0 - slope, 0.0) if np.isfinite(slope) else np.nan,
        gate=0.1,
        source=source,
        measure="2 − order",
    )


def refine(sizes: Sequence[float], measure: Callable[[float], Row]) -> tuple[list[Row], list[float]]:
    """Return the rows of a case measured at all sizes, and their errors."""
    rows = [measure(size) for size in sizes]
    return rows, [row.error for row in rows]
