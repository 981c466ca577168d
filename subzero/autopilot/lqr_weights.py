"""What each loop of the standard autopilots feeds back, and the largest deviations that are acceptable: its weights."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import radians

from subzero.errors import UserError, suggestion


@dataclass(frozen=True, kw_only=True)
class Weights:
    """What a loop feeds back, the tracked state last, and the largest acceptable deviations (`design_gains`).

    `foreseen`: whether what is wanted is fed forward too, with the steady command that it needs.
    """

    part: str
    measured: tuple[str, ...]
    largest: Mapping[str, float]
    largest_command: float
    foreseen: bool = False


WEIGHTS: dict[str, Weights] = {
    "speed": Weights(
        part="surge",
        measured=("surge_speed",),
        largest={"surge_speed": 0.1, "integral": 0.2},
        largest_command=4.0,
        foreseen=True,
    ),
    "heading": Weights(
        part="yaw_sway",
        measured=("yaw_rate", "heading"),
        largest={"yaw_rate": radians(20.0), "heading": radians(8.0), "integral": radians(16.0)},
        largest_command=radians(10.0),
    ),
    "pitch": Weights(
        part="pitch_heave",
        measured=("pitch_rate", "pitch"),
        largest={"pitch_rate": radians(20.0), "pitch": radians(8.0), "integral": radians(16.0)},
        largest_command=radians(10.0),
    ),
    "roll": Weights(
        part="roll",
        measured=("roll_rate", "roll"),
        largest={"roll_rate": radians(60.0), "roll": radians(8.0), "integral": radians(16.0)},
        largest_command=radians(6.0),
    ),
}
"""Loop → its weights."""


def with_weights(name: str, **changes: float | Mapping[str, float]) -> dict[str, Weights]:
    """Return one loop's weights with changes, for `tune(weights=...)`."""
    return {name: replace(WEIGHTS[name], **changes)}  # type: ignore[arg-type]


def checked(weights: dict[str, Weights]) -> dict[str, Weights]:
    """Return weights, or refuse what they are not."""
    for name, value in weights.items():
        if name not in WEIGHTS:
            raise UserError(
                f"tune: there is no loop '{name}'.{suggestion(name, WEIGHTS)} Allowed: {', '.join(WEIGHTS)}."
            )
        if not isinstance(value, Weights) or value.measured != WEIGHTS[name].measured:
            raise UserError(f"tune: the weights of '{name}' are {value!r}. Allowed: those of `with_weights`.")
    return weights
