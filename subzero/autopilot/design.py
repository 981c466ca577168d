"""Gains from linear models: one recipe for every loop, and the user's own weights.

    minimise ∫ Σ (x_i/x_i,max)² + (∫e/i_max)² + (δ/δ_max)² dt,   δ = −k·x + k_I ∫e     (linear-quadratic, with integral)

on the part of the vehicle that a loop moves (`SUBSYSTEMS`). With all states of that part it is LQR, for a controller
that estimates what it cannot measure; with the fast and unmeasured ones left to follow at once, the feedback of an
angle, its rate and its integral is a PID. The largest acceptable deviations are the weights (Bryson's rule).

Numbers that change with the speed are designed at several speeds (`Schedule`). A rudder is worth u², so one set of
gains is too weak at half the speed and too strong at twice. Arrays of any shape are kept at a few speeds and read
linearly in between; beyond the ends the last ones hold.

`WEIGHTS` says what each loop of the standard autopilots feeds back, and its largest acceptable deviations.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import radians
from typing import TYPE_CHECKING

import numpy as np

from subzero.errors import UserError, suggestion
from subzero.files.text_repr import Overview

if TYPE_CHECKING:
    import control


INTEGRAL = "integral"
"""Name of ∫e among the weights."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Gains:
    """Gains of a design, with the matrices it was made from: δ = −feedback · x + integral ∫(wanted − y).

    Attributes:
        states: the states that are fed back.
        tracked: the state that follows the reference.
        feedback: gains of the states (n,).
        integral: gain of ∫e.
        A, B: the model with ∫e as its last state (n + 1, n + 1), (n + 1, 1); its derivative is −y.
        Q, R: the weights. (n + 1, n + 1), (1, 1)
        ahead: feed-forward gain, command per unit of the reference, in addition to the loop.
        loop: the loop opened at the plant's input, as a transfer from δ to δ, for margins.
    """

    states: tuple[str, ...]
    tracked: str
    feedback: np.ndarray
    integral: float
    A: np.ndarray
    B: np.ndarray
    Q: np.ndarray
    R: np.ndarray
    ahead: float
    loop: control.StateSpace

    def __repr__(self) -> str:
        """Return the gains by name."""
        rows = [(name, f"{gain:.4g}") for name, gain in zip(self.states, self.feedback, strict=True)]
        rows += [
            (f"integral of {self.tracked}", f"{self.integral:.4g}"),
            ("fed forward", f"{self.ahead:.4g}"),
        ]
        return Overview(
            f"Gains from a deviation [SI, rad] to a command, tracking {self.tracked}", rows
        ).text()

    @property
    def share(self) -> float:
        """b: share of a step of the reference that acts on the proportional part; the rest is left to the integral.

        The step response has a zero at −k_I/(δ_w + b k), with δ_w `ahead`; b puts it on the slowest pole, whose long
        tail is then not excited. (Without it a step that is fed forward must overshoot: its ∫e has to end at 0.)
        """
        K = np.append(self.feedback, -self.integral)[None]
        slowest = float(np.min(np.abs(np.linalg.eigvals(self.A - self.B @ K))))
        k = float(self.feedback[self.states.index(self.tracked)])
        return min(1.0, max(0.0, (self.integral / slowest - self.ahead) / k))

    def numbers(self) -> np.ndarray:
        """Return k of each state, k_I and b (n + 2,), as loops take them."""
        return np.array([*self.feedback, self.integral, self.share])


def reduced(part: control.StateSpace, keep: Sequence[str]) -> control.StateSpace:
    """Return a linear model of fewer states, the others following at once: exact at rest, good for slow motions.

    A cable's bearing from the drum follows over a whole length of the cable: it is never left out.

    Args:
        part: from `subsystem`.
        keep: names of the states to keep.

    Raises:
        UserError: there is no such state, or the others cannot follow (they integrate, or are a cable's bearing).
    """
    import control

    labels = list(part.state_labels)
    missing = [name for name in keep if name not in labels]
    if missing:
        raise UserError(f"There is no state '{missing[0]}' in '{part.name}'. Allowed: {', '.join(labels)}.")
    slow = [name for name in labels if name in ("cable_bearing", "cable_dip") and name not in keep]
    if slow:
        raise UserError(
            f"'{part.name}' without {slow[0]} is wrong for slow motions: it follows over a whole length of the cable."
            f" Keep {slow[0]} too, or linearise the hull alone (trim with wet_length=0)."
        )
    A, B = np.asarray(part.A), np.asarray(part.B)
    k = [labels.index(name) for name in keep]
    f = [i for i in range(len(labels)) if i not in k and np.any(A[:, i])]  # depth, say, moves nothing
    if f and np.linalg.cond(A[np.ix_(f, f)]) > 1e9:
        raise UserError(
            f"'{part.name}' without {', '.join(labels[i] for i in f)} means nothing: they do not settle."
        )
    follow = (
        np.linalg.solve(A[np.ix_(f, f)], np.hstack([A[np.ix_(f, k)], B[f]]))
        if f
        else np.zeros((0, len(k) + 1))
    )
    A11 = A[np.ix_(k, k)] - A[np.ix_(k, f)] @ follow[:, : len(k)]
    B1 = B[k] - A[np.ix_(k, f)] @ follow[:, len(k) :]
    names = {"states": list(keep), "outputs": list(keep), "inputs": list(part.input_labels)}
    return control.ss(A11, B1, np.eye(len(k)), np.zeros(B1.shape), name=part.name, **names)


def design_gains(
    part: control.StateSpace,
    *,
    tracked: str,
    largest: Mapping[str, float],
    largest_command: float,
    ahead: float = 0.0,
) -> Gains:
    """Return the linear-quadratic gains of a loop with integral action.

    Args:
        part: the linear model: all its states are fed back; from `subsystem`, or `reduced`.
        tracked: the state that has to follow the reference.
        largest: state, or "integral" → the largest deviation that is acceptable [its unit, integral in unit·s]; a
            state that is not named costs nothing.
        largest_command: the same for the command.
        ahead: feed-forward gain, command per unit of the reference, in addition to this loop; changes `Gains.share`
            only.

    Raises:
        UserError: a weight of nothing, a weight that is not above 0, a loop that cannot be stabilised.
    """
    import control

    _check_part(part)
    labels = tuple(part.state_labels)
    _check_weights(labels, tracked, largest, largest_command)
    n, y = len(labels), labels.index(tracked)
    A, B = np.zeros((n + 1, n + 1)), np.zeros((n + 1, 1))
    A[:n, :n], B[:n] = np.asarray(part.A), np.asarray(part.B)
    A[n, y] = -1.0
    Q = np.diag([1.0 / largest[name] ** 2 if name in largest else 0.0 for name in (*labels, INTEGRAL)])
    R = np.array([[1.0 / largest_command**2]])
    try:
        K = np.asarray(control.lqr(A, B, Q, R)[0])[0]
    except (np.linalg.LinAlgError, ValueError) as error:
        raise UserError(
            f"'{part.name}' cannot be stabilised with these weights: {str(error).rstrip('.')}. Allowed: a model whose"
            " command reaches all that does not settle by itself, and weights that see it."
        ) from error
    return Gains(
        states=labels,
        tracked=tracked,
        feedback=K[:n],
        integral=-float(K[n]),
        A=A,
        B=B,
        Q=Q,
        R=R,
        ahead=ahead,
        loop=control.ss(A, B, K[None], [[0.0]], name=f"{part.name}_loop"),
    )


def _check_part(part: control.StateSpace) -> None:
    """Raise an error for a model that the recipe does not hold for."""
    import control

    allowed = "Allowed: a continuous control.StateSpace with one input and no feedthrough, of finite numbers."
    if not isinstance(part, control.StateSpace):
        raise UserError(f"design_gains: the model is a {type(part).__name__}. {allowed}")
    wrong = (
        (part.isdtime(strict=True), f"is sampled every {part.dt!r} s"),
        (part.ninputs != 1, f"has {part.ninputs} inputs"),
        (bool(np.any(part.D)), "feeds its input through: it is not strictly proper"),
        (
            not (np.all(np.isfinite(part.A)) and np.all(np.isfinite(part.B))),
            "has a number that is not finite",
        ),
    )
    for is_wrong, words in wrong:
        if is_wrong:
            raise UserError(f"design_gains: '{part.name}' {words}. {allowed}")


def _check_weights(
    labels: tuple[str, ...], tracked: str, largest: Mapping[str, float], largest_command: float
) -> None:
    """Raise an error for weights that are not valid."""
    allowed = (*labels, INTEGRAL)
    for name in (tracked, *largest):
        if name not in allowed:
            raise UserError(f"design_gains: there is no state '{name}' here. Allowed: {', '.join(allowed)}.")
    for name, value in {**largest, "largest_command": largest_command}.items():
        if not (np.isfinite(value) and value > 0.0):
            raise UserError(f"design_gains: the largest {name} is {value!r}. Allowed: a number above 0.")
    if INTEGRAL not in largest:
        raise UserError('design_gains: "integral" has no weight. Allowed: a number above 0 [unit s].')


@dataclass(frozen=True, eq=False)
class Schedule:
    """Arrays over speed.

    Attributes:
        speeds: increasing (n,). [m/s]
        values: one array a speed (n, ...).
    """

    speeds: np.ndarray
    values: np.ndarray

    @classmethod
    def of(cls, speeds: np.ndarray, make: Callable[[float], np.ndarray | float]) -> Schedule:
        """Return the schedule that `make` gives, asked at each speed."""
        return cls(np.asarray(speeds, dtype=float), np.array([make(float(speed)) for speed in speeds]))

    def __post_init__(self) -> None:
        """Raise an error if the fields do not form a schedule."""
        if self.speeds.ndim != 1 or self.speeds.size == 0 or np.any(np.diff(self.speeds) <= 0.0):
            raise UserError(f"Schedule: the speeds are {self.speeds}. Allowed: numbers that increase.")
        if not np.all(np.isfinite(self.values)):
            raise UserError("Schedule: a value is not a finite number.")

    def at(self, speed: float) -> np.ndarray:
        """Return the array at a speed [m/s].

        Raises:
            UserError: the speed is not a number: nothing is wanted, or no sensor measures it.
        """
        if speed != speed:
            raise UserError("there are no gains for a speed that is not a number. Allowed: a speed in m/s.")
        place = float(np.interp(speed, self.speeds, np.arange(self.speeds.size)))
        low = min(int(place), self.speeds.size - 1)
        high = min(low + 1, self.speeds.size - 1)
        values = self.values[low] + (place - low) * (self.values[high] - self.values[low])
        return np.asarray(values)


@dataclass(frozen=True, kw_only=True)
class Weights:
    """States that a loop feeds back, the tracked state last, and the largest acceptable deviations (`design_gains`).

    `foreseen`: whether the reference is fed forward too, with the steady command that it needs.
    """

    part: str
    measured: tuple[str, ...]
    largest: Mapping[str, float]
    largest_command: float
    foreseen: bool = False


def _of_angle(part: str, angle: str, rate: str, fastest: float, largest_command: float) -> Weights:
    """Return the weights of a loop that holds an angle, with its largest rate and command. [degree/s, degree]"""
    largest = {rate: radians(fastest), angle: radians(8.0), INTEGRAL: radians(16.0)}
    return Weights(
        part=part, measured=(rate, angle), largest=largest, largest_command=radians(largest_command)
    )


WEIGHTS: dict[str, Weights] = {
    "speed": Weights(
        part="surge",
        measured=("surge_speed",),
        largest={"surge_speed": 0.1, "integral": 0.2},
        largest_command=4.0,
        foreseen=True,
    ),
    "heading": _of_angle("yaw_sway", "heading", "yaw_rate", 20.0, 10.0),
    "pitch": _of_angle("pitch_heave", "pitch", "pitch_rate", 20.0, 10.0),
    "roll": _of_angle("roll", "roll", "roll_rate", 60.0, 6.0),
}
"""Loop → its weights."""


def with_weights(name: str, **changes: float | Mapping[str, float]) -> dict[str, Weights]:
    """Return one loop's weights with changes, for `tune(weights=...)`."""
    return {name: replace(WEIGHTS[name], **changes)}  # type: ignore[arg-type]


def checked(weights: dict[str, Weights]) -> dict[str, Weights]:
    """Return weights; raise an error if they are not valid."""
    for name, value in weights.items():
        if name not in WEIGHTS:
            raise UserError(
                f"tune: there is no loop '{name}'.{suggestion(name, WEIGHTS)} Allowed: {', '.join(WEIGHTS)}."
            )
        if not isinstance(value, Weights) or value.measured != WEIGHTS[name].measured:
            raise UserError(f"tune: the weights of '{name}' are {value!r}. Allowed: those of `with_weights`.")
    return weights
