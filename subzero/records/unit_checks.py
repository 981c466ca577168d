"""Does a record look like the trial it is said to be? What looks like another unit is asked about, not guessed.

The nominal simulation is the yardstick: a channel that fits it much better in another unit, or with the
other sign, is probably in that unit. A vehicle that is merely wrong is not asked about:
its channel fits badly either way.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from subzero.channels import BY_NAME
from subzero.records.record import HEADING, TURN, turned

MISTAKEN: dict[str, dict[str, float]] = {
    "m/s": {"knots": 1.944, "km/h": 3.6, "feet per second": 3.281, "cm/s": 100.0},
    "degree": {"radians": np.pi / 180.0},
    "degree/s": {"radians per second": np.pi / 180.0},
    "m": {"feet": 3.281, "centimetres": 100.0},
    "rev/s": {"revolutions per minute": 60.0, "radians per second": 2.0 * np.pi},
    "N": {"kilograms": 0.1020, "pounds": 0.2248, "grams": 102.0},
    "V": {"millivolts": 1000.0},
}
"""Unit → what a column may be in by mistake → how many of those make one."""

CLEAR_MISFIT, WIDE_MISFIT, FAR_FACTOR = 0.2, 0.6, 5.0
"""How well (error over size) a channel has to fit in the other unit: well, or less well if the factor is
above FAR_FACTOR."""

BETTER_RATIO = 3.0
"""How many times better the other unit has to fit."""

MIN_SIZE_SIGMAS = 5.0
"""Channels that never exceed so many noise levels say nothing of their unit."""

MOVED_SIGMAS = 3.0
"""A sensor that never changes is stuck if the trial moves its channel by so many noise levels."""

REPEATED_SHARE = 0.6
"""A channel that repeats its last value in more than this share of samples is held by its logger."""


def unit_questions(
    values: Mapping[str, np.ndarray], simulated: Mapping[str, np.ndarray], noise: Mapping[str, float]
) -> list[str]:
    """Return a question for every channel that looks as if it were in another unit.

    Args:
        values: channel → measured. [display unit]
        simulated: channel → nominal simulation at the same times. [display unit]
        noise: channel → usual noise of its sensor. [display unit]
    """
    asked = []
    for name, measured in values.items():
        known = np.isfinite(measured) & np.isfinite(simulated[name])
        words = _other_unit(name, measured[known], simulated[name][known], noise[name])
        asked += [words] if words else []
    return asked


def stuck(
    values: Mapping[str, np.ndarray], simulated: Mapping[str, np.ndarray], noise: Mapping[str, float]
) -> list[str]:
    """Return a problem for every channel that never changes, although the trial moves it."""
    return [
        _stuck(name, float(np.nanmax(measured)), _span(simulated[name]))
        for name, measured in values.items()
        if is_constant(measured) and _span(simulated[name]) > MOVED_SIGMAS * noise[name]
    ]


def is_constant(values: np.ndarray) -> bool:
    """Return whether a channel is the same in every sample."""
    return bool(_span(values) == 0.0)


def repeating(values: Mapping[str, np.ndarray]) -> list[str]:
    """Return the channels of which most samples repeat the one before: their noise is hard to tell."""
    return [
        name
        for name, one in values.items()
        if np.mean(np.diff(one[np.isfinite(one)]) == 0.0) > REPEATED_SHARE
    ]


def _span(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.ptp(known)) if known.size else 0.0


def _stuck(name: str, value: float, moved: float) -> str:
    column = BY_NAME[name].column
    return (
        f"{column} is {value:g} in every sample, while the simulation moves it by {moved:.3g}: a sensor that is stuck. "
        f'Leave the column out, or say units_checked = ["{column}"] in the sidecar if it is true'
    )


def _other_unit(name: str, measured: np.ndarray, simulated: np.ndarray, noise: float) -> str:
    """Return the question about one channel, or nothing."""
    size = _rms(simulated)
    if measured.size < 5 or np.abs(simulated).max() < MIN_SIZE_SIGMAS * noise:
        return ""
    plain = _rms(measured - simulated) / size
    for words, factor in {**MISTAKEN.get(BY_NAME[name].unit, {}), "opposite": -1.0}.items():
        error = _rms(_converted(name, measured / factor, simulated) - simulated) / size
        is_far = max(abs(factor), 1.0 / abs(factor)) > FAR_FACTOR
        if error < (WIDE_MISFIT if is_far else CLEAR_MISFIT) and BETTER_RATIO * error < plain:
            return _question(name, words, factor)
    return ""


def _converted(name: str, values: np.ndarray, simulated: np.ndarray) -> np.ndarray:
    """Return values in another unit; a heading without the jumps at north that it may have there."""
    return turned(np.unwrap(values, period=TURN), simulated) if name == HEADING else values


def _question(name: str, words: str, factor: float) -> str:
    column = BY_NAME[name].column
    allowed = f'say units_checked = ["{column}"] in the sidecar'
    if words == "opposite":
        meant = f"here it is {BY_NAME[name].long_name}"
        return f"{column} has the opposite sign of the simulation. If so turn it ({meant}); if it is right {allowed}"
    times = f"{factor:.3g}" if factor >= 1.0 else f"1/{1.0 / factor:.3g}"
    return f"{column} looks like {words} ({times} times the simulation). If so convert it; if it is right {allowed}"


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
