"""A model as a value: a function, and its declared channels, parameters, causes and unknown inputs.

def spring(p, u, t):
    ...                                    # any code; returns {channel: values at t}

model = Model(spring, channels={"place": Sensor(noise=0.01, unit="m")}, inputs=["force"],
    parameters=[Number("stiffness", 4.0, tolerance=0.05), Start("place0", 0.0, tolerance=0.1)],
    causes=[Cause("soft", "the spring has another stiffness", changes={"stiffness": 1.0})],
    unknown=[Unknown("command:force", size=0.02, time=0.5)])
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from subzero.errors import UserError

Simulate = Callable[[Mapping[str, Any], Mapping[str, Any], np.ndarray], Mapping[str, Any]]
"""(parameters by name, inputs by name at the times, times (n,)) → readings by channel (n,)."""

COMMAND = "command:"
"""An unknown input of this prefix is added to the input of that name."""


class ModelError(UserError):
    """A model that cannot be used, with the reason and the parameters that showed it."""


def finite(what: str, value: float) -> float:
    """Return a finite number.

    Raises:
        ModelError: it is not one.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not math.isfinite(value):
        raise ModelError(f"{what} is {value!r}; it must be a finite number.")
    return float(value)


def positive(what: str, value: float) -> float:
    """Return a number greater than 0.

    Raises:
        ModelError: it is not one.
    """
    if finite(what, value) <= 0.0:
        raise ModelError(f"{what} is {value!r}; it must be greater than 0.")
    return float(value)


class Number:
    """A number of a model: ``Number("k", 0.05, tolerance=0.03, low=0)``; of a cause: ``Number(10, scale=2)``.

    Attributes:
        name: as in ``p[name]``; "" for a number of a cause, which has its name there.
        nominal: its value in the nominal model; of a cause: where the search begins. [its unit]
        tolerance: τ, standard deviation of its usual error; of a number of a cause its scale. [its unit]
        low, high: bounds. [its unit]
        unit: as it is shown.
    """

    def __init__(
        self,
        *given: str | float,
        tolerance: float | None = None,
        scale: float | None = None,
        low: float = -math.inf,
        high: float = math.inf,
        unit: str = "",
    ) -> None:
        name, nominal = given if len(given) == 2 else ("", *given) if len(given) == 1 else ("", None)
        self.name, self.unit = str(name), unit
        what = f"the number {self.name!r}" if name else "a number"
        self.nominal = finite(f"the nominal value of {what}", nominal)  # type: ignore[arg-type]
        spread = tolerance if tolerance is not None else scale
        if spread is None:
            raise ModelError(
                f"{what} has neither tolerance nor scale; give the standard deviation of its error."
            )
        self.tolerance = positive(f"the tolerance of {what}", spread)
        self.low, self.high = float(low), float(high)
        if not self.low <= self.nominal <= self.high:
            raise ModelError(
                f"the nominal value of {what} is {nominal!r}; its bounds are {self.low:g} and {self.high:g}."
            )

    def __repr__(self) -> str:
        return f"Number({self.name!r}, {self.nominal:g}, tolerance={self.tolerance:g})"


class Start(Number):
    """A number of each record: a state at its beginning. ``Start("level0", 5, tolerance=4)``.

    It must not be read off a sensor that is itself under suspicion.
    """


@dataclass(frozen=True)
class Sensor:
    """A channel: what a sensor shows, and how well.

    Attributes:
        noise: standard deviation of its error from sample to sample; None if it is to be read off the record. [unit]
        spread: how well that is known: standard deviation of its logarithm. [-]
        unit: as it is shown; an angle is in "rad" or "deg".
        angle: whether whole turns make no difference.
        resolution: what it rounds to; None if it is to be read off the record. [unit]
        low, high: where it saturates. [unit]
        zero, scale, late: standard deviations of the usual error of its zero [unit], its scale [-] and its clock [s],
            which is part of every explanation.
        trusted: no error in its data is considered.
        logger: channels of one logger share their errors: a second one is more likely than the first.
    """

    noise: float | None = None
    spread: float = 0.1
    unit: str = ""
    angle: bool = False
    resolution: float | None = None
    low: float = -math.inf
    high: float = math.inf
    zero: float = 0.0
    scale: float = 0.0
    late: float = 0.0
    trusted: bool = False
    logger: str = ""

    def __post_init__(self) -> None:
        if self.noise is not None:
            positive("the noise of a sensor", self.noise)
        positive("the spread of the noise of a sensor", self.spread)
        for what in ("resolution", "zero", "scale", "late"):
            value = getattr(self, what)
            if value is not None and finite(f"{what} of a sensor", value) < 0.0:
                raise ModelError(f"{what} of a sensor is {value!r}; it must not be negative.")
        if not self.low < self.high:
            raise ModelError(f"a sensor saturates at {self.low:g} and {self.high:g}: the first must be less.")

    @property
    def turn(self) -> float:
        """A whole turn, in its unit; 0 if it shows no angle."""
        if not self.angle:
            return 0.0
        return 360.0 if self.unit.startswith(("deg", "°")) else 2.0 * math.pi


class Cause:
    """Something that may be wrong: a parameter that changes by more than its tolerance, or an effect that is off.

        Cause("soft", "the spring is softer", changes={"stiffness": 1.0})
        Cause("overflow", "the tank overflows", lip=Number(10, scale=2), share=Number(0.5, scale=0.3), off={"share": 0})

    The function finds the numbers of an effect in ``p["overflow"]["share"]``, or ``p["overflow.share"]``. With
    `onset` it may begin in the middle of a record: the function finds the time in ``p["overflow"]["since"]``, −∞ if it
    holds throughout; a change of a parameter that begins there is in ``p["soft"]["stiffness"]``, to be added.

    Attributes:
        id: short name.
        sentence: what it is, in words.
        changes: parameter → usual size of its change (one standard deviation).
        numbers: of the effect, when it acts.
        off: numbers for which it does nothing.
        onset: whether the function uses ``since``.
        throughout: whether it may hold throughout; one with an onset may not, such as a growth.
        sizes: where a search begins: standard deviations of all its numbers from their nominal values.
    """

    def __init__(
        self,
        id: str,
        sentence: str,
        *,
        changes: Mapping[str, float] | None = None,
        off: Mapping[str, float] | None = None,
        onset: bool = False,
        throughout: bool = True,
        sizes: Sequence[float] = (0.0, -1.0, 1.0),
        **numbers: Number,
    ) -> None:
        self.id, self.sentence, self.onset, self.throughout = id, sentence, onset, throughout
        self.sizes = tuple(finite(f"a size of the cause {id!r}", size) for size in sizes)
        self.changes = {
            name: positive(f"the change of {name!r} in the cause {id!r}", size)
            for name, size in (changes or {}).items()
        }
        self.numbers, self.off = dict(numbers), dict(off or {})
        if not self.changes and not self.numbers:
            raise ModelError(
                f"the cause {id!r} changes nothing: give changes={{parameter: size}}, or its numbers."
            )
        unknown = [name for name in self.off if name not in self.numbers]
        if unknown or (self.numbers and not self.off):
            have = ", ".join(self.numbers)
            raise ModelError(
                f"the cause {id!r}: off={self.off} must give one or more of its numbers ({have}) the value for which "
                "it does nothing."
            )

    @property
    def is_effect(self) -> bool:
        """Whether the function finds it in ``p[id]``: it has numbers of its own, or an onset."""
        return bool(self.numbers) or self.onset


@dataclass(frozen=True)
class Unknown:
    """An input that is not known: where it acts, how large it usually is, and how quickly it changes.

    The function finds it in ``u[name]``; of "command:pump", added to ``u["pump"]``. It is 0 but for a Gaussian process,
    which is part of every explanation if it is usual. If not, it is 0 in a healthy model, and a term of an explanation
    where it acts: ``Unknown("push", size=0.5, time=2.0, usual=False)``.

    Attributes:
        name: of the input.
        size: its usual standard deviation in a healthy model, or where it acts if it is not usual. [unit of the input]
        time: over which it changes. [s]
        usual: whether it is part of every explanation.
        sentence: what a verdict says if it acts, in words; as one that is not usual.
        unit: as it is shown.
    """

    name: str
    size: float
    time: float
    usual: bool = True
    sentence: str = ""
    unit: str = ""

    def __post_init__(self) -> None:
        positive(f"the size of the unknown input {self.name!r}", self.size)
        positive(f"the time of the unknown input {self.name!r}", self.time)


@dataclass(frozen=True)
class Model:
    """A model that can be diagnosed.

    Attributes:
        simulate: the function. It must depend on its arguments alone.
        channels: name → its sensor.
        inputs: names of the inputs that it reads from a record.
        parameters: its numbers, and the states at the beginning of a record.
        causes: what may be wrong.
        unknown: inputs that are not known: part of every explanation, or offered as a term of one.
        tuned_on: parameter → channels through which it was tuned: an error of such a channel moves the parameter.
        trusted_inputs: those in which no error is considered.
        batch: whether it computes many sets at once: numbers are (k,), inputs (n, 1) or (n, k), readings (n, k).
        parallel: whether it may be called by several threads at once.
    """

    simulate: Simulate
    channels: Mapping[str, Sensor]
    inputs: Sequence[str] = ()
    parameters: Sequence[Number] = ()
    causes: Sequence[Cause] = ()
    unknown: Sequence[Unknown] = ()
    tuned_on: Mapping[str, Sequence[str]] = field(default_factory=dict)
    trusted_inputs: Sequence[str] = ()
    batch: bool = False
    parallel: bool = False

    def __post_init__(self) -> None:
        if not callable(self.simulate):
            raise ModelError(
                f"simulate is {self.simulate!r}; it must be a function of parameters, inputs and times."
            )
        if not self.channels:
            raise ModelError("the model has no channel: give channels={name: Sensor(...)}.")
        names = [number.name for number in self.parameters]
        _unique("cause", [cause.id for cause in self.causes])
        _unique("parameter or effect", [*names, *(cause.id for cause in self.causes if cause.is_effect)])
        _unique("unknown input", [unknown.name for unknown in self.unknown])
        if "" in names:
            raise ModelError('a parameter has no name: Number("name", value, tolerance=...).')
        for cause in self.causes:
            _known(f"the cause {cause.id!r} changes", cause.changes, names)
        _known("tuned_on names the parameter", self.tuned_on, names)
        for channels in self.tuned_on.values():
            _known("tuned_on names the channel", channels, list(self.channels))
        _known("trusted_inputs names the input", self.trusted_inputs, list(self.inputs))
        for unknown in self.unknown:
            if unknown.name.startswith(COMMAND):
                _known(
                    "an unknown input is added to", [unknown.name.removeprefix(COMMAND)], list(self.inputs)
                )

    @property
    def shared(self) -> list[Number]:
        """Parameters that all records share."""
        return [number for number in self.parameters if not isinstance(number, Start)]

    @property
    def starts(self) -> list[Start]:
        """Parameters that each record has its own of."""
        return [number for number in self.parameters if isinstance(number, Start)]

    @property
    def always(self) -> list[Unknown]:
        """Unknown inputs that are part of every explanation."""
        return [unknown for unknown in self.unknown if unknown.usual]

    @property
    def offered(self) -> list[Unknown]:
        """Unknown inputs that are terms of an explanation: 0 in a healthy model."""
        return [unknown for unknown in self.unknown if not unknown.usual]

    def nominal(self) -> dict[str, Any]:
        """Return the nominal parameters, with every cause off."""
        found: dict[str, Any] = {number.name: number.nominal for number in self.parameters}
        for cause in filter(lambda cause: cause.is_effect, self.causes):
            changes = dict.fromkeys(cause.changes, 0.0) if cause.onset else {}
            on = {name: number.nominal for name, number in cause.numbers.items()}
            found |= effect_numbers(cause, {**changes, **on, **cause.off})
        return found


def effect_numbers(cause: Cause, values: Mapping[str, Any], since: Any = -math.inf) -> dict[str, Any]:
    """Return the numbers of a cause as a function finds them: ``p[id][name]`` and ``p[id.name]``."""
    both = {**values, "since": since}
    return {cause.id: both, **{f"{cause.id}.{name}": value for name, value in both.items()}}


def _unique(what: str, names: Sequence[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise ModelError(f"{what} {name!r} is there {names.count(name)} times; names must differ.")


def _known(what: str, names: Any, known: Sequence[str]) -> None:
    for name in names:
        if name not in known:
            raise ModelError(f"{what} {name!r}, which is not there. There are: {', '.join(known) or 'none'}.")
