"""The programs of manoeuvres: commands that look at the vehicle, flown like an autopilot.

Each begins with a straight run at the trim of the bare hull. To add one: a final class with `after`, and a line in
`manoeuvres.MANOEUVRES`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field

from subzero.autopilot.standard import Wanted
from subzero.errors import UserError
from subzero.simulator import Observation

RUN_IN = 12.0
"""How long the straight run before a manoeuvre lasts. [s]"""

Command = tuple[float, float, float, float]


@dataclass(kw_only=True)
class Program(ABC):
    """What all manoeuvres have: the straight run. Final classes say what comes then, in `after`.

    Attributes:
        straight: command of the straight run: propeller [rev/s], rudder, port and starboard plane [rad].
        size: of the manoeuvre: rudder or planes; share of the propeller speed for a crash stop. [rad, 1]
        sample_time: [s]
        name: for messages.
    """

    straight: Command
    size: float
    sample_time: float = 0.1
    name: str = "manoeuvre"
    begun: Observation | None = field(default=None, init=False)
    side: float = field(default=1.0, init=False)

    def reset(self) -> None:
        """Begin again."""
        self.begun, self.side = None, 1.0

    def update(self, reading: Observation, wanted: Wanted) -> Command:
        """Return the command for the next sample."""
        if reading.time < RUN_IN - 1e-9:
            return self.straight
        self.begun = self.begun or reading
        return self.after(reading, self.begun)

    @abstractmethod
    def after(self, now: Observation, begun: Observation) -> Command:
        """Return the command once the manoeuvre has begun."""

    def turned(self, channel: str, now: Observation, begun: Observation) -> float:
        """Return how far an angle has changed, to the side of the rudder or planes [rad]; refuse an unknown one."""
        change = self.side * (getattr(now, channel) - getattr(begun, channel))
        if change != change:
            raise UserError(f"at t = {now.time:g} s the {channel} is not a number: no sensor measures it.")
        return change

    def with_rudder(self, angle: float) -> Command:
        """Return the straight command with a rudder [rad]."""
        n, _, port, starboard = self.straight
        return n, angle, port, starboard

    def with_planes(self, angle: float) -> Command:
        """Return the straight command with both planes moved [rad]."""
        n, rudder, port, starboard = self.straight
        return n, rudder, port + angle, starboard + angle


class TurningCircle(Program):
    """The rudder put over, and kept."""

    def after(self, now: Observation, begun: Observation) -> Command:
        """Return the rudder over."""
        return self.with_rudder(self.size)


class ZigZag(Program):
    """The rudder reversed each time the heading has changed by as much as the rudder."""

    def after(self, now: Observation, begun: Observation) -> Command:
        """Return the rudder on its present side."""
        if self.turned("heading", now, begun) >= abs(self.size):
            self.side = -self.side
        return self.with_rudder(self.side * self.size)


class VerticalZigZag(Program):
    """The planes reversed each time the pitch has changed by as much as the planes."""

    def after(self, now: Observation, begun: Observation) -> Command:
        """Return the planes on their present side."""
        if self.turned("pitch", now, begun) >= abs(self.size):
            self.side = -self.side
        return self.with_planes(self.side * self.size)


SPIRAL_SHARES = (
    1.0,
    0.5,
    0.25,
    0.1,
    0.0,
    -0.1,
    -0.25,
    -0.5,
    -1.0,
    -0.5,
    -0.25,
    -0.1,
    0.0,
    0.1,
    0.25,
    0.5,
    1.0,
)
SPIRAL_HOLD = 6.0
"""Rudders of a spiral, as shares of the largest, and how long each is held [s]."""


class Spiral(Program):
    """Dieudonné's spiral: rudders in steps from one side to the other and back, each until the turn is steady."""

    def after(self, now: Observation, begun: Observation) -> Command:
        """Return the rudder of the present step."""
        step = int((now.time - begun.time + 1e-9) / SPIRAL_HOLD)
        return self.with_rudder(self.size * SPIRAL_SHARES[min(step, len(SPIRAL_SHARES) - 1)])


class CrashStop(Program):
    """The propeller full astern."""

    def after(self, now: Observation, begun: Observation) -> Command:
        """Return the propeller astern, the fins as they were."""
        n, *fins = self.straight
        return (-self.size * n, *fins)  # type: ignore[return-value]
