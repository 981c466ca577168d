"""The outcomes kept of each run: scalars by name, channels on a common grid, and numbers of a function of one's own.

    "peak_speed_m_s", "energy.hull_loss_J", "diagnostics.closure_error_m"      the numbers of a run's summary
    "cable_tension.max", "heading.end", "surge_speed.mean"                     a channel and a statistic of it

Scalars are float64, channels float32 (six to seven digits). A run that could not go on has none of them.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import CodeType
from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.arguments import checked_arguments
from subzero.channels import BY_NAME, ENERGY_CHANNELS, AnyRun
from subzero.errors import UserError, real, short, suggestion

if TYPE_CHECKING:
    from subzero.results.dataset import PlainRun

Function = Callable[[Any], Any]
"""Of one's own: takes a run, a dataset of xarray, returns a number, or numbers by name."""

STATISTICS: dict[str, Callable[[np.ndarray], float]] = {
    "max": lambda values: float(np.nanmax(values)),
    "min": lambda values: float(np.nanmin(values)),
    "mean": lambda values: float(np.nanmean(values)),
    "end": lambda values: float(values[-1]),
    "range": lambda values: float(np.nanmax(values) - np.nanmin(values)),
    "rms": lambda values: float(np.sqrt(np.nanmean(values**2))),
}
"""Of a channel over its samples, in its display unit; the mean counts every sample alike."""

SUMMARY = (
    "time_at_end_s",
    "peak_speed_m_s",
    "time_of_peak_speed_s",
    "speed_at_end_m_s",
    "heading_at_end_deg",
    "depth_at_end_m",
    "path_length_m",
    "cable_length_at_end_m",
    "largest_cable_force_N",
    "time_of_largest_cable_force_s",
    "largest_cable_moment_N_m",
    "time_of_largest_cable_moment_s",
)
"""Numbers of `subzero.results.summary.summarise`."""

TABLES = {
    "energy": (*(f"{name.removeprefix('energy_')}_J" for name in ENERGY_CHANNELS), "unexplained_share"),
    "diagnostics": (
        "closure_error_m",
        "energy_residual",
        "largest_courant_number",
        "smallest_tension_N",
        "newton_iterations",
    ),
}
"""Tables in it, and their numbers."""

OWN = "own"
"""Name of the number that a function of one's own returns without a name."""

DEFAULT_SCALARS = ("peak_speed_m_s", "heading.end", "path_length_m", "largest_cable_force_N")
DEFAULT_CHANNELS = ("surge_speed", "heading", "depth", "cable_tension")
MOST_GRID_TIMES = 100_000
DEFAULT_INTERVALS = 100
"""A run is kept at so many intervals where no `every` says otherwise."""


@checked_arguments
@dataclass(frozen=True, kw_only=True)
class Kept:
    """The outcomes that are requested of each run.

    Attributes:
        scalars: names of numbers, such as ``peak_speed_m_s`` or ``cable_tension.max``; `DEFAULT_SCALARS` if not given.
        channels: kept over time, on a common grid; `DEFAULT_CHANNELS` when not given.
        every: interval of that grid; a hundredth of the run when not given. [s]
        function: of one's own: takes a run, returns a number, or numbers by name.
    """

    scalars: Sequence[str] | None = None
    channels: Sequence[str] | None = None
    every: float | None = None
    function: Function | None = None


AS_USUAL = Kept()


@dataclass(frozen=True, kw_only=True)
class Outcomes:
    """The outcomes that are kept of each run, checked.

    Attributes:
        scalars: names, as this module says.
        channels: names of `subzero.channels`.
        every: interval of the common grid. [s]
        until: its end; a run that is over sooner has NaN behind its end. [s]
        function: of one's own.
    """

    scalars: tuple[str, ...]
    channels: tuple[str, ...]
    every: float
    until: float
    function: Function | None = None

    @property
    def times(self) -> np.ndarray:
        """The common grid (n,). [s]."""
        return np.arange(self._count) * self.every

    @property
    def _count(self) -> int:
        return math.floor(self.until / self.every + 1e-9) + 1 if self.channels else 0

    def digest(self) -> str:
        """SHA-256 of all settings of the outcomes; of a function its code, not the functions it calls."""
        parts = (self.scalars, self.channels, self.every, self.until, text_of(self.function))
        return hashlib.sha256(repr(parts).encode()).hexdigest()


def outcomes_of(kept: Kept, duration: float) -> Outcomes:
    """Return the outcomes to keep, checked.

    Args:
        kept: the outcomes that are asked for.
        duration: of the nominal run. [s]

    Raises:
        UserError: no such name, an interval that is none.
    """
    scalars = _names("scalars", kept.scalars, DEFAULT_SCALARS)
    channels = _names("channels", kept.channels, DEFAULT_CHANNELS)
    for name in scalars:
        _check_scalar(name)
    for name in channels:
        if name not in BY_NAME or name == "time":
            raise UserError(f"There is no channel {short(name)}.{suggestion(name, BY_NAME)}")
    if kept.function is not None and not callable(kept.function):
        raise UserError(f"function is {short(kept.function)}; it must be a function of a run.")
    step = duration / DEFAULT_INTERVALS if kept.every is None else real(kept.every)
    if step is None or not step > 0.0 or duration / step > MOST_GRID_TIMES:
        raise UserError(
            f"every is {short(kept.every)}. Allowed: a time from {duration / MOST_GRID_TIMES:g} s on, above 0."
        )
    return Outcomes(scalars=scalars, channels=channels, every=step, until=duration, function=kept.function)


def _names(what: str, given: Any, default: tuple[str, ...]) -> tuple[str, ...]:
    """Return names that are given, each once."""
    if given is None:
        return default
    names = (given,) if isinstance(given, str) else tuple(given)
    if not all(isinstance(name, str) for name in names):
        raise UserError(f"{what} are {short(given)}. Allowed: a list of names.")
    return tuple(dict.fromkeys(names))


def _check_scalar(name: str) -> None:
    """Raise an error for a name that no run has."""
    head, _, tail = name.rpartition(".")
    if not (name in SUMMARY or tail in TABLES.get(head, ()) or (head in BY_NAME and tail in STATISTICS)):
        raise UserError(
            f"There is no scalar {short(name)}.{suggestion(name, scalar_names())} Allowed: a number of a run's summary,"
            f" such as {SUMMARY[1]}, or channel.statistic with {', '.join(STATISTICS)}."
        )


def scalar_names() -> list[str]:
    """Return every scalar of a run by name."""
    tables = [f"{table}.{name}" for table, names in TABLES.items() for name in names]
    return [
        *SUMMARY,
        *tables,
        *(f"{channel}.{each}" for channel in BY_NAME if channel != "time" for each in STATISTICS),
    ]


UNIT_ENDINGS = {"_N_m": "N m", "_m_s": "m/s", "_deg": "degree", "_m": "m", "_s": "s", "_N": "N", "_J": "J"}
"""How the name of a number of a summary ends → its unit."""


def unit_of(name: str) -> str:
    """Return the unit of a scalar, as its name or its channel says."""
    head, _, tail = name.rpartition(".")
    if head in BY_NAME and tail in STATISTICS:
        return BY_NAME[head].unit
    return next((unit for ending, unit in UNIT_ENDINGS.items() if name.endswith(ending)), "1")


def in_words(name: str) -> str:
    """Return a scalar as one says it, without its unit: "largest cable force", "end of heading"."""
    head, _, tail = name.rpartition(".")
    if head in BY_NAME and tail in STATISTICS:
        return f"{tail} of {head}".replace("_", " ")
    plain = next((name.removesuffix(ending) for ending in UNIT_ENDINGS if name.endswith(ending)), name)
    return plain.replace("_", " ").replace(".", ": ")


def scalars_of(run: AnyRun, names: tuple[str, ...]) -> np.ndarray:
    """Return scalars of a run (n,); NaN for one that this run does not have, such as an energy without a propeller."""
    needs_summary = any(name in SUMMARY or name.partition(".")[0] in TABLES for name in names)
    summary: dict[str, Any] = {}
    if needs_summary:
        from subzero.results.summary import summarise

        summary = summarise(run)
    return np.array([_scalar(run, name, summary) for name in names], dtype=float)


def _scalar(run: AnyRun, name: str, summary: Mapping[str, Any]) -> float | None:
    head, _, tail = name.rpartition(".")
    if head in BY_NAME:
        values = run[head].values
        return STATISTICS[tail](values) if not np.isnan(values).all() else None
    return (summary.get(head) or {}).get(tail) if head else summary.get(name)


def channels_of(run: AnyRun, outcomes: Outcomes) -> np.ndarray:
    """Return channels of a run on the common grid (channels, times), linear between samples, float32."""
    times, at = outcomes.times, run["time"].values
    rows = [np.interp(times, at, run[name].values, right=np.nan) for name in outcomes.channels]
    return np.array(rows, dtype=np.float32).reshape(len(outcomes.channels), times.size)


def own_numbers(run: PlainRun, function: Function | None) -> dict[str, float]:
    """Return the numbers that a function of one's own makes of a run, labelled for it; by name.

    Raises:
        UserError: it returned neither a number nor numbers by name.
    """
    if function is None:
        return {}
    made = function(run.labelled())
    named = made if isinstance(made, Mapping) else {OWN: made}
    try:
        return {str(name): float(value) for name, value in named.items()}
    except (TypeError, ValueError):
        raise UserError(
            f"The function {name_of(function)} returned {short(made)}. Allowed: a number, or numbers by name."
        ) from None


def name_of(function: Function) -> str:
    """Return the name of a function."""
    return getattr(function, "__qualname__", type(function).__name__)


def text_of(function: Function | None) -> str:
    """Return a description of a function, as text that changes with its code, constants, defaults and closure.

    What it calls is not looked at, and of an object that is no function only its name is.
    """
    if function is None:
        return ""
    code = getattr(function, "__code__", None)
    if code is None:
        return name_of(function)
    cells = [cell.cell_contents for cell in getattr(function, "__closure__", None) or ()]
    held = [
        cell for cell in (*(getattr(function, "__defaults__", None) or ()), *cells) if isinstance(cell, PLAIN)
    ]
    return f"{_code_text(code)} {held!r}"


PLAIN = (int, float, complex, str, bytes, tuple, type(None))
"""Kinds whose text is the same in every process."""


def _code_text(code: CodeType) -> str:
    """Return a piece of compiled Python as text, without lines and places."""
    inside = [_code_text(const) if isinstance(const, CodeType) else repr(const) for const in code.co_consts]
    return f"{code.co_code.hex()} {code.co_names} {inside}"
