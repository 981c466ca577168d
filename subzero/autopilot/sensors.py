"""Sensors: from the true state to the measurements that a controller gets.

    sample = quantised(truth + bias + drift + noise), every period, delivered after the delay, or dropped

Each stage has a neutral value that switches it off exactly. Between samples, and when one is dropped, the last sample
holds. Every sensor has its own random numbers, all from one seed: adding a sensor does not change the others, and the
same seed gives the same run.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from subzero.channels import Observation
from subzero.errors import UserError, real, short, suggestion, whole

GRACE = 1e-9
"""Times that differ by less than this are the same. [s]"""

UNKNOWN = Observation(*[math.nan] * len(Observation._fields))


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """One sensor of one channel; all in the unit of `Observation`: SI, radians.

    Attributes:
        channel: the channel that it measures, a field of `Observation`.
        period: time between samples; 0 samples whenever it is asked. [s]
        noise: standard deviation of each sample, white.
        bias: constant error.
        drift: growth of a random walk: its standard deviation is drift·√t. [unit/√s]
        quantum: samples are whole multiples of this; 0 is exact.
        delay: from the sample to its reading. [s]
        drop_out: probability that a sample is lost.

    Raises:
        UserError: no such channel, or a number that is not in its range.
    """

    channel: str
    period: float = 0.0
    noise: float = 0.0
    bias: float = 0.0
    drift: float = 0.0
    quantum: float = 0.0
    delay: float = 0.0
    drop_out: float = 0.0

    def __post_init__(self) -> None:
        """Raise an error if the fields do not describe a possible sensor."""
        allowed = Observation._fields[1:]
        if not isinstance(self.channel, str) or self.channel not in allowed:
            raise UserError(
                f"Sensor: there is no channel {short(self.channel)}.{suggestion(self.channel, allowed)}"
                f" Allowed: {', '.join(allowed)}."
            )
        for field in fields(self)[1:]:
            value = getattr(self, field.name)
            least = -math.inf if field.name == "bias" else 0.0
            most = 1.0 if field.name == "drop_out" else math.inf
            number = real(value)
            if number is None or not least <= number <= most:
                said = "a finite number" if field.name == "bias" else f"{least:g} to {most:g}"
                raise UserError(f"Sensor of {self.channel}: {field.name} is {short(value)}. Allowed: {said}.")
            object.__setattr__(self, field.name, number)


DEGREE = math.pi / 180.0

ESTIMATED = (
    Sensor(channel="surge_speed", period=0.2, noise=0.02, quantum=0.005, delay=0.1),
    Sensor(channel="heading", period=0.1, noise=0.5 * DEGREE, delay=0.1),
    Sensor(channel="roll", period=0.1, noise=0.5 * DEGREE, delay=0.1),
    Sensor(channel="pitch", period=0.1, noise=0.5 * DEGREE, delay=0.1),
    Sensor(channel="roll_rate", period=0.1, noise=0.5 * DEGREE, drift=0.01 * DEGREE, delay=0.1),
    Sensor(channel="pitch_rate", period=0.1, noise=0.5 * DEGREE, drift=0.01 * DEGREE, delay=0.1),
    Sensor(channel="yaw_rate", period=0.1, noise=0.5 * DEGREE, drift=0.01 * DEGREE, delay=0.1),
    Sensor(channel="depth", period=0.2, noise=0.02, quantum=0.005, delay=0.1),
    Sensor(channel="cable_length", period=0.1, quantum=0.01),
    Sensor(channel="drum_tension", period=0.1, noise=0.01),
)
"""A set of the class that the paper names (speed, heading, attitude, rates, depth on board; length and tension at the
drum), 5 to 10 Hz. None of the numbers is published for Subzero: they are estimates."""

PERFECT = tuple(Sensor(channel=sensor.channel) for sensor in ESTIMATED)
"""The same channels without any error."""


class Sensors:
    """A set of sensors at work.

    Args:
        sensors: which; at most one for a channel.
        seed: of all their random numbers.

    Raises:
        UserError: two sensors of one channel.
    """

    def __init__(self, sensors: Sequence[Sensor] = PERFECT, *, seed: int = 0) -> None:
        if not all(isinstance(sensor, Sensor) for sensor in sensors):
            raise UserError("Sensors: each must be a Sensor.")
        names = [sensor.channel for sensor in sensors]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise UserError(f"Sensors: there are two of {', '.join(twice)}. Allowed: one for a channel.")
        self.sensors, self.seed = tuple(sensors), whole("seed", seed)
        self.reset()

    def reset(self) -> None:
        """Begin again, with the same random numbers."""
        self._running = [_Running(sensor, self.seed) for sensor in self.sensors]

    def read(self, seen: Observation) -> Observation:
        """Return the readings of the sensors now; NaN for channels without a sensor. (Clocks are exact.)"""
        reported = {sensor.sensor.channel: sensor.read(seen) for sensor in self._running}
        return UNKNOWN._replace(time=seen.time, **reported)


class _Running:
    """A sensor with its state: drift, and samples that have not arrived yet."""

    def __init__(self, sensor: Sensor, seed: int) -> None:
        self.sensor = sensor
        own = Observation._fields.index(sensor.channel)
        self._rng = np.random.default_rng([seed, own])
        self._next, self._last_time, self._walk = -math.inf, math.nan, 0.0
        self._waiting: deque[tuple[float, float]] = deque()
        self._reported = math.nan

    def read(self, seen: Observation) -> float:
        """Return the newest sample that has arrived."""
        if seen.time >= self._next - GRACE:
            self._take(seen)
        while self._waiting and self._waiting[0][0] <= seen.time + GRACE:
            self._reported = self._waiting.popleft()[1]
        return self._reported

    def _take(self, seen: Observation) -> None:
        """Take a sample, and set the time of the next; the first one is delivered at once, and never dropped."""
        first = math.isnan(self._last_time)
        passed = 0.0 if first else seen.time - self._last_time
        sample = self._sample(getattr(seen, self.sensor.channel), passed)
        lost = self._rng.random() < self.sensor.drop_out
        if first:
            self._reported, self._next = sample, seen.time
        elif not lost:
            self._waiting.append((seen.time + self.sensor.delay, sample))
        self._last_time = seen.time
        if self.sensor.period > 0.0:
            behind = math.floor((seen.time - self._next + GRACE) / self.sensor.period)
            self._next += (behind + 1) * self.sensor.period

    def _sample(self, truth: float, passed: float) -> float:
        """Return the reading of the sensor for a true value, `passed` seconds after the sample before."""
        s = self.sensor
        self._walk += s.drift * math.sqrt(passed) * self._rng.standard_normal()
        value = truth + s.bias + self._walk + s.noise * self._rng.standard_normal()
        steps = value / s.quantum if s.quantum > 0.0 else math.inf
        return s.quantum * round(steps) if math.isfinite(steps) else value
