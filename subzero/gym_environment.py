"""A Gymnasium environment: hold a heading while the cable grows.

    >>> import gymnasium
    >>> env = gymnasium.make("subzero.gym_environment:subzero/TetheredHeading-v0")

What stands before the colon is imported, and registers the name; once it is imported,
``gymnasium.make("subzero/TetheredHeading-v0")`` will do. (Gymnasium looks for no environments in installed packages
since 1.0.)

It needs the extra ``subzero[gym]``. The vehicle starts from rest as in a scenario, with a constant propeller command;
the action is the rudder, and the reward punishes the heading error and the work of the rudder. A new heading is drawn
at each reset.
"""

from __future__ import annotations

from math import cos, pi, radians, sin
from typing import Any

import numpy as np

from subzero.channels import Observation
from subzero.errors import UserError
from subzero.model import load
from subzero.simulator import RunStoppedError, Simulator

try:
    import gymnasium
except ImportError as missing:  # pragma: no cover - told to the user
    raise UserError(
        "The environment needs Gymnasium. Install it with: pip install 'subzero[gym]'"
    ) from missing

ENVIRONMENT = "subzero/TetheredHeading-v0"
STEPS = 300
LARGEST_TURN = radians(30.0)
"""New headings lie within this of the one at the start. [rad]"""
RUDDER_PRICE = 0.1
"""How much a rudder command at its limit costs, in rad² of heading error."""

LIMITS = {
    "sine of the heading error": (-1.0, 1.0),
    "cosine of the heading error": (-1.0, 1.0),
    "yaw rate [rad/s]": (-pi, pi),
    "surge speed [m/s]": (-5.0, 5.0),
    "rudder angle [rad]": (-1.0, 1.0),
    "cable length [m]": (0.0, 1000.0),
}
"""What is observed, in this order, with the limits of the observation space."""


class TetheredHeading(gymnasium.Env[np.ndarray, np.ndarray]):
    """Turn to a heading and hold it; rudder in −1 … 1 of its limit, positive to starboard.

    The reward of a step is −(e² + 0.1 a²) Δt, e the heading error [rad] and a the action. An episode is cut off after
    300 steps; it ends early only if the simulation cannot go on.

    Args:
        scenario: where the vehicle starts, with what cable; its commands are not used.
        propeller_rps: constant propeller command. [rev/s]
        tethered: with the cable.
        sample_time: of an action. [s]
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012  # as Gymnasium declares it

    def __init__(
        self,
        scenario: str = "fig6",
        *,
        propeller_rps: float = 25.0,
        tethered: bool = True,
        sample_time: float | None = None,
    ) -> None:
        self._sim = Simulator(load(scenario), tethered=tethered, sample_time=sample_time)
        self._propeller = float(propeller_rps)
        self._most = float(self._sim.model.vehicle.rudder_servo.deflection_limit)
        low, high = np.array(list(LIMITS.values()), dtype=np.float32).T
        self.observation_space = gymnasium.spaces.Box(low, high, dtype=np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), dtype=np.float32)
        self._wanted, self._taken = 0.0, 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin again; a heading to turn to is drawn, or is options["turn"] [rad], from the one at the start."""
        super().reset(seed=seed)
        drawn = self.np_random.uniform(-LARGEST_TURN, LARGEST_TURN)
        seen = self._sim.reset()
        self._wanted = seen.heading + float((options or {}).get("turn", drawn))
        self._taken = 0
        return self._observed(seen), self._info(seen)

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold the rudder for one sample time."""
        share = float(np.clip(np.asarray(action, dtype=float).reshape(-1)[0], -1.0, 1.0))
        try:
            seen, stopped = self._sim.step((self._propeller, self._most * share, 0.0, 0.0)), False
        except RunStoppedError:
            seen, stopped = self._sim.observation, True
        self._taken += 1
        error = self._wanted - seen.heading
        reward = -(error**2 + RUDDER_PRICE * share**2) * self._sim.sample_time
        return self._observed(seen), reward, stopped, self._taken >= STEPS, self._info(seen)

    def _observed(self, seen: Observation) -> np.ndarray:
        """Return what the agent sees, within the limits of its space."""
        error = self._wanted - seen.heading
        values = (
            sin(error),
            cos(error),
            seen.yaw_rate,
            seen.surge_speed,
            seen.rudder_angle,
            seen.cable_length,
        )
        space: Any = self.observation_space
        return np.clip(np.array(values, dtype=np.float32), space.low, space.high)

    def _info(self, seen: Observation) -> dict[str, Any]:
        """Return the whole truth, by name, and the heading that is wanted [rad]."""
        return {"wanted_heading": self._wanted, **seen._asdict()}


def register() -> None:
    """Make the environment known to `gymnasium.make`; done when this module is imported."""
    if ENVIRONMENT not in gymnasium.registry:
        gymnasium.register(ENVIRONMENT, entry_point="subzero.gym_environment:TetheredHeading")


register()
