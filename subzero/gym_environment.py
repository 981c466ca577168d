"""A Gymnasium environment: hold a heading while the cable grows.

    >>> import gymnasium
    >>> env = gymnasium.make("subzero.gym_environment:subzero/TetheredHeading-v0")

What stands before the colon is imported, and registers the name; once it is imported,
``gymnasium.make("subzero/TetheredHeading-v0")`` will do. (Gymnasium looks for no environments in installed packages
since 1.0.)

It needs the extra ``subzero[gym]``. The vehicle starts from rest as in a scenario, with a constant propeller command;
the action is the rudder, and the reward punishes the heading error and the work of the rudder. A new heading is drawn
at each reset. ``gymnasium.make_vec("subzero/TetheredHeading-v0", num_envs=8)`` gives many, in threads of one process.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import chain, repeat
from math import cos, pi, radians, sin
from typing import Any

import numpy as np

from subzero.channels import Observation
from subzero.errors import UserError, whole
from subzero.model import load
from subzero.simulator import RunStoppedError, Simulator

try:
    import gymnasium
    import gymnasium.vector
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


class TetheredHeadings(gymnasium.vector.SyncVectorEnv):
    """Many environments, stepped at once in threads: the compiled simulation lets go of Python's lock.

    They give what ``gymnasium.vector.SyncVectorEnv`` gives, to the last bit: one that has ended begins again in the
    step behind.

    Args:
        num_envs: how many.
        workers: threads; one for each processor, if not given.
        **how: of each, see `TetheredHeading`.
    """

    def __init__(self, num_envs: int = 1, *, workers: int | None = None, **how: Any) -> None:
        super().__init__([lambda: TetheredHeading(**how)] * num_envs)
        threads = (
            (os.cpu_count() or 1) if workers is None else whole("TetheredHeadings: workers", workers, least=1)
        )
        self._shares = np.array_split(np.arange(num_envs), min(threads, num_envs))
        self._pool = ThreadPoolExecutor(len(self._shares))

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Hold each rudder for one sample time, (num_envs, 1); return the same in arrays as each environment does."""
        seen = list(chain.from_iterable(self._pool.map(self._step_some, self._shares, repeat(actions))))
        observed, rewards, ended, cut, told = zip(*seen, strict=True)
        self._autoreset_envs = np.logical_or(ended, cut)
        infos: dict[str, Any] = {}
        for i, info in enumerate(told):
            infos = self._add_info(infos, info, i)
        return np.stack(observed), np.array(rewards, dtype=float), np.array(ended), np.array(cut), infos

    def _step_some(self, which: np.ndarray, actions: np.ndarray) -> list[tuple[Any, ...]]:
        """Step some environments, one after another; one whose episode is over begins again."""
        return [
            _begun(self.envs[i].reset()) if self._autoreset_envs[i] else self.envs[i].step(actions[i])
            for i in which
        ]

    def close_extras(self, **kwargs: Any) -> None:
        """Let the threads end."""
        super().close_extras(**kwargs)
        self._pool.shutdown()


def _begun(first: tuple[np.ndarray, dict[str, Any]]) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
    """Return what a step tells of an environment that has just begun again."""
    observed, info = first
    return observed, 0.0, False, False, info


def register() -> None:
    """Make the environment known to `gymnasium.make` and `make_vec`; done when this module is imported."""
    if ENVIRONMENT not in gymnasium.registry:
        gymnasium.register(
            ENVIRONMENT,
            entry_point="subzero.gym_environment:TetheredHeading",
            vector_entry_point="subzero.gym_environment:TetheredHeadings",
        )


register()
