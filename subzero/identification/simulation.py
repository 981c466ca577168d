"""Runs of a model's function: checked, kept, in batches where the function can."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from os import cpu_count
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from subzero.identification.model import COMMAND, Model, ModelError

KEPT = 2000
"""So many runs are kept."""


class Asked(NamedTuple):
    """A run: numbers by name, causes' numbers included, unknown inputs at the times (n,), and inputs that are recorded
    wrongly: input → column that holds it, and by which factor it is too large there.
    """

    numbers: Mapping[str, float]
    unknown: Mapping[str, np.ndarray]
    wrong: Mapping[str, tuple[str, float]] = MappingProxyType({})

    @property
    def key(self) -> tuple[Any, ...]:
        """What makes it another run."""
        return (
            tuple(self.numbers.values()),
            *(values.tobytes() for values in self.unknown.values()),
            *self.wrong.items(),
        )


class Runs:
    """Runs of a model with the inputs of one record at its times."""

    def __init__(self, model: Model, time: np.ndarray, inputs: Mapping[str, np.ndarray], source: str) -> None:
        self.model, self.time, self.inputs, self.source = model, time, inputs, source
        self.count = 0
        self._kept: OrderedDict[tuple[Any, ...], dict[str, np.ndarray] | None] = OrderedDict()

    def serves(self, time: np.ndarray, inputs: Mapping[str, np.ndarray]) -> bool:
        """Return whether these are runs with some inputs at some times (n,)."""
        same = [np.array_equal(values, self.inputs[name]) for name, values in inputs.items()]
        return np.array_equal(time, self.time) and all(same)

    def readings(self, asked: Sequence[Asked], *, must: bool = False) -> list[dict[str, np.ndarray] | None]:
        """Return channel → readings (n,) of each run; None of one that failed.

        Args:
            asked: the runs.
            must: whether a run that fails is refused.

        Raises:
            ModelError: what the function returns cannot be used.
        """
        new = list({run.key: run for run in asked if run.key not in self._kept}.values())
        for run, found in zip(new, self._computed(new), strict=True):
            self._keep(
                run.key, found if all(np.isfinite(values).all() for values in found.values()) else None
            )
            if must and self._kept[run.key] is None:
                bad = [name for name, values in found.items() if not np.isfinite(values).all()]
                at = int(np.argmax(~np.isfinite(found[bad[0]])))
                raise ModelError(
                    f"{self.source}: the model gives {found[bad[0]][at]} for {bad[0]} at {self.time[at]:g} s, with "
                    f"{shown(run.numbers)}."
                )
        return [self._found(run) for run in asked]

    def _found(self, run: Asked) -> dict[str, np.ndarray] | None:
        if run.key not in self._kept:  # more were asked at once than are kept
            return self.readings([run])[0]
        self._kept.move_to_end(run.key)
        return self._kept[run.key]

    def _keep(self, key: tuple[Any, ...], found: dict[str, np.ndarray] | None) -> None:
        self._kept[key] = found
        while len(self._kept) > KEPT:
            self._kept.popitem(last=False)

    def _computed(self, runs: Sequence[Asked]) -> list[dict[str, np.ndarray]]:
        self.count += len(runs)
        if self.model.batch and runs:
            return self._batch(runs)
        if self.model.parallel and len(runs) > 1:
            with ThreadPoolExecutor(cpu_count()) as pool:
                return list(pool.map(self._single, runs))
        return [self._single(run) for run in runs]

    def _single(self, run: Asked) -> dict[str, np.ndarray]:
        return self._checked(self._call(run.numbers, run.unknown, run), run, 0)

    def _batch(self, runs: Sequence[Asked]) -> list[dict[str, np.ndarray]]:
        """Return the readings of runs with the same inputs."""
        numbers = {name: np.array([run.numbers[name] for run in runs]) for name in runs[0].numbers}
        unknown = {name: np.stack([run.unknown[name] for run in runs], axis=1) for name in runs[0].unknown}
        found = self._call(numbers, unknown, runs[0])
        return [self._checked(found, run, len(runs), k) for k, run in enumerate(runs)]

    def _call(self, numbers: Mapping[str, Any], unknown: Mapping[str, Any], run: Asked) -> Mapping[str, Any]:
        inputs: dict[str, Any] = {}
        for name in self.inputs:
            column, factor = run.wrong.get(name, (name, 1.0))
            values = self.inputs[column] / factor
            inputs[name] = values[:, None] if self.model.batch else values
        for name, values in unknown.items():
            of = name.removeprefix(COMMAND)
            inputs[of] = inputs[of] + values if name.startswith(COMMAND) else values
        try:
            with np.errstate(all="ignore"):
                return self.model.simulate(nested(numbers), inputs, self.time)
        except Exception as error:
            if run.wrong:  # inputs of another unit may be absurd, and a model may say so
                sets = np.shape(next(iter(numbers.values()), 0.0))
                return dict.fromkeys(self.model.channels, np.full((self.time.size, *sets), np.nan))
            raise ModelError(
                f"{self.source}: the model raises {type(error).__name__}: {error}, with {shown(run.numbers)}."
            ) from error

    def _checked(self, found: Mapping[str, Any], run: Asked, batch: int, k: int = 0) -> dict[str, np.ndarray]:
        shape = (self.time.size, batch) if batch else (self.time.size,)
        if not isinstance(found, Mapping):
            raise ModelError(
                f"the model returns {type(found).__name__}; it must return {{channel: readings}}."
            )
        readings = {}
        for name in self.model.channels:
            if name not in found:
                raise ModelError(
                    f"the model returns no {name!r}; it returns {', '.join(map(str, found)) or 'nothing'}."
                )
            try:
                values = np.asarray(found[name], dtype=float)
            except (TypeError, ValueError):
                raise ModelError(f"the model returns no numbers for {name!r}.") from None
            if values.shape != shape:
                raise ModelError(
                    f"{self.source}: the model returns {values.shape} readings of {name!r} for {shape}, with "
                    f"{shown(run.numbers)}."
                )
            own, turn = values[:, k] if batch else values, self.model.channels[name].turn
            is_angle = turn > 0.0 and np.isfinite(own).all()
            readings[name] = np.unwrap(own, period=turn) if is_angle else own.copy()  # to be interpolated
        return readings

    def check(self, run: Asked) -> None:
        """Refuse a model that gives two answers to one question.

        Raises:
            ModelError: it does, or its answer cannot be used.
        """
        (first,) = self.readings([run], must=True)
        self._kept.clear()
        (second,) = self.readings([run], must=True)
        assert first is not None
        assert second is not None
        for name in first:
            if not np.array_equal(first[name], second[name]):
                apart = float(np.max(np.abs(first[name] - second[name])))
                raise ModelError(
                    f"{self.source}: called twice with the same parameters, the model gives two answers, up to "
                    f"{apart:.3g} apart in {name}. It depends on something that is no argument (a random number, a "
                    "state that it keeps); make that an argument or remove it."
                )


def nested(numbers: Mapping[str, Any]) -> dict[str, Any]:
    """Return numbers by name, with those of a cause also together: "overflow.lip" and ["overflow"]["lip"]."""
    found = dict(numbers)
    for name, value in numbers.items():
        cause, dot, number = name.partition(".")
        if dot:
            found.setdefault(cause, {})[number] = value
    return found


def shown(numbers: Mapping[str, float]) -> str:
    """Return numbers in words, for messages."""
    return (
        ", ".join(f"{name} = {value:.6g}" for name, value in numbers.items() if np.isfinite(value))
        or "no parameter"
    )
