"""A Gymnasium environment: hold a heading while the cable grows.

    >>> import gymnasium
    >>> env = gymnasium.make("subzero.gym_environment:subzero/TetheredHeading-v0")

What stands before the colon is imported, and registers the name; once it is imported,
``gymnasium.make("subzero/TetheredHeading-v0")`` will do. (Gymnasium looks for no environments in installed packages
since 1.0.)

It needs the extra ``subzero-auv[gym]``. The vehicle starts from rest as in a scenario, with a constant propeller;
the action is the rudder, and the reward punishes the heading error and the work of the rudder. A new heading is drawn
at each reset. ``gymnasium.make_vec("subzero/TetheredHeading-v0", num_envs=8)`` gives many in one process.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from math import cos, degrees, pi, radians, sin
from typing import Any

import numpy as np

from subzero.arguments import checked_arguments
from subzero.channels import Observation
from subzero.errors import BadValueError, checked, missing_extra, short, whole
from subzero.model import load
from subzero.simulation.stepper import RunStoppedError, Simulator, SteppingGroup

try:
    import gymnasium
    import gymnasium.vector
except ImportError as missing:  # pragma: no cover - reported to the user
    raise missing_extra("The environment", "Gymnasium", "gym") from missing

ENVIRONMENT = "subzero/TetheredHeading-v0"
STEPS = 300
LARGEST_TURN = radians(30.0)
"""New headings lie within this of the one at the start. [rad]"""
RUDDER_PRICE = 0.1
"""How much a rudder command at its limit costs, in rad² of heading error."""

MOST_ENVIRONMENTS = 100_000
"""More of them are a slip of the pen: each takes a tenth of a megabyte and more. [-]"""

LIMITS = {
    "sine of the heading error": (-1.0, 1.0),
    "cosine of the heading error": (-1.0, 1.0),
    "yaw rate [rad/s]": (-pi, pi),
    "surge speed [m/s]": (-5.0, 5.0),
    "rudder angle [rad]": (-1.0, 1.0),
    "cable length [m]": (0.0, 1000.0),
}
"""The observed channels, in this order, with the limits of the observation space."""
LOW, HIGH = np.array(list(LIMITS.values()), dtype=np.float32).T.copy()
"""These limits as arrays (6,)."""
TRUTH = ("wanted_heading", *Observation._fields)
"""The contents of an info: the reference heading [rad], and the true values."""
HEADING = Observation._fields.index("heading")
FELT = np.array(
    [Observation._fields.index(name) for name in ("yaw_rate", "surge_speed", "rudder_angle", "cable_length")]
)
"""Places of true values that are observed as they are."""


class TetheredHeading(gymnasium.Env[np.ndarray, np.ndarray]):
    """Turn to a heading and hold it; rudder in −1 … 1 of its limit, positive to starboard.

    The reward of a step is −(e² + 0.1 a²) Δt, e the heading error [rad] and a the action. An episode is cut off after
    300 steps; it ends early only if the simulation cannot go on.

    Args:
        scenario: the start of the vehicle, and its cable; its commands are not used.
        propeller_rps: constant propeller command. [rev/s]
        tethered: with the cable.
        sample_time: of an action. [s]
        render_mode: "rgb_array" for `render`.

    Attributes:
        simulator: the simulation.
        wanted: the heading to turn to. [rad]
        taken: steps of the episode so far.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"]}  # noqa: RUF012  # as Gymnasium declares it

    @checked_arguments
    def __init__(
        self,
        scenario: str = "fig6",
        *,
        propeller_rps: float = 25.0,
        tethered: bool = True,
        sample_time: float | None = None,
        render_mode: str | None = None,
    ) -> None:
        self.simulator = Simulator(load(scenario), tethered=tethered, sample_time=sample_time)
        self.render_mode = render_mode
        self.metadata = self.metadata | {"render_fps": round(1.0 / self.simulator.sample_time)}
        self._propeller = float(propeller_rps)
        self._most = float(self.simulator.model.vehicle.rudder_servo.deflection_limit)
        self.observation_space = gymnasium.spaces.Box(LOW, HIGH, dtype=np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,), dtype=np.float32)
        self.wanted, self.taken = 0.0, 0

    @checked_arguments
    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin again; a heading to turn to is drawn, or is options["turn"] [rad], from the one at the start."""
        super().reset(seed=None if seed is None else whole("TetheredHeading.reset: seed", seed))
        drawn = self.np_random.uniform(-LARGEST_TURN, LARGEST_TURN)
        turn = checked("TetheredHeading.reset", "turn", (options or {}).get("turn", drawn), unit="rad")
        self.wanted = self.simulator.reset().heading + turn
        self.taken = 0
        return self._observed(), self._info()

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Hold the rudder for one sample time."""
        shares = _shares(action, 1)
        stopped = self.hold(self.orders(shares)[0])
        error = np.array([self._error])
        reward = float(_rewards(error, shares, self.simulator.sample_time)[0])
        return self._observed(), reward, stopped, self.taken >= STEPS, self._info()

    def render(self) -> Any:
        """Return the way, the cable, the tow point and the wanted heading from above (height, width, 3), or None."""
        if self.render_mode is None:
            return None
        from subzero.figures import style
        from subzero.figures.cable import in_scale

        run = self.simulator.result()
        words = f"Heading {degrees(self.seen.heading):.0f}°, wanted {degrees(self.wanted):.0f}°"
        figure, (axes,) = style.sheet(1, 1, style.Title(words=words, scenario=self.simulator.trial.name))
        way = run[["east", "north"]].to_array().values.T
        if run.attrs["tethered"]:
            way, cable = run["cable_position"].values[:, 0, 1::-1], run["cable_position"].values[-1]
            axes.plot(cable[:, 1], cable[:, 0], color=style.BLUE, label="cable")
        axes.plot(*way.T, color=style.GREY, linestyle=":", label="way of the tow point")
        axes.plot(*way[-1], "o", color=style.INK, label="tow point")
        axes.quiver(*way[-1], sin(self.wanted), cos(self.wanted), color=style.ORANGE, label="wanted heading")
        style.label(axes, "east [m]", "north [m]")
        in_scale(axes)
        style.legend(axes)
        canvas: Any = figure.canvas
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()

    def hold(self, order: np.ndarray) -> bool:
        """Hold a command (4,) for one sample time; return whether the simulation stopped."""
        self.taken += 1
        try:
            self.simulator.hold(*order.tolist())
        except RunStoppedError:
            return True
        return False

    def orders(self, shares: np.ndarray) -> np.ndarray:
        """Return commands with the rudder at shares of its limit (n,): propeller [rev/s], three fins [rad] (n, 4)."""
        orders = np.zeros((shares.size, 4))
        orders[:, 0], orders[:, 1] = self._propeller, self._most * shares + 0.0  # no negative zero
        return orders

    @property
    def seen(self) -> Observation:
        """The true values now."""
        return self.simulator.observation

    @property
    def _error(self) -> float:
        """How far the heading is from the wanted one. [rad]"""
        return self.wanted - float(self.simulator.seen[HEADING])

    def _observed(self) -> np.ndarray:
        """Return the observation of the agent, within the limits of its space."""
        felt: np.ndarray = _observations(np.array([self._error]), self.simulator.seen[None])[0]
        return felt

    def _info(self) -> dict[str, Any]:
        """Return the whole truth, by name, and the heading that is wanted [rad]."""
        return dict(zip(TRUTH, (self.wanted, *self.simulator.seen.tolist()), strict=True))


def _shares(actions: Any, count: int) -> np.ndarray:
    """Return so many rudders (count,), each as a share of its limit; raise an error for others."""
    try:
        if not isinstance(actions, Sequence) or len(actions) == count:
            given = np.asarray(actions)
            if given.size == count and given.dtype.kind in "iuf" and not np.isnan(given).any():
                shares: np.ndarray = given.reshape(-1).astype(float).clip(-1.0, 1.0)
                return shares
    except (TypeError, ValueError, OverflowError):
        pass
    raise BadValueError(f"The action is {short(actions)}; it must be {count} numbers from -1 to 1.")


def _rewards(errors: np.ndarray, shares: np.ndarray, sample_time: float) -> np.ndarray:
    """Return the rewards of a sample time (n,): heading errors at its end [rad], rudders as shares of their limits."""
    rewards: np.ndarray = -(errors * errors + RUDDER_PRICE * shares * shares) * sample_time
    return rewards


def _observations(errors: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Return what agents observe (n, 6), from heading errors (n,) [rad] and true values (n, 27)."""
    felt: np.ndarray = np.empty((errors.size, len(LIMITS)), dtype=np.float32)
    felt[:, 0], felt[:, 1] = np.sin(errors), np.cos(errors)
    felt[:, 2:] = seen.take(FELT, axis=1)
    return felt.clip(LOW, HIGH)


class TetheredHeadings(gymnasium.vector.SyncVectorEnv):
    """Many environments, one after another or in threads: the compiled simulation lets go of Python's lock.

    They give what ``gymnasium.vector.SyncVectorEnv`` gives, to the last bit, but put together at once and not one by
    one: one that has ended begins again in the step behind.

    Args:
        num_envs: how many.
        workers: threads, one for each processor if not given (``python -m benchmarks.throughput --learning``).
        **how: of each, see `TetheredHeading`.
    """

    @checked_arguments
    def __init__(self, num_envs: int = 1, *, workers: int | None = None, **how: Any) -> None:
        num_envs = int(checked("TetheredHeadings", "num_envs", num_envs, least=1, most=MOST_ENVIRONMENTS))
        super().__init__([lambda: TetheredHeading(**how)] * num_envs)
        self._ours: list[Any] = list(self.envs)
        workers = (os.cpu_count() or 1) if workers is None else workers
        threads = min(whole("TetheredHeadings: workers", workers, least=1), num_envs)
        self._group = SteppingGroup([our.simulator for our in self._ours], threads)
        every = np.ones(num_envs, dtype=bool)
        every.flags.writeable = False  # all steps give the same one
        self._known = dict.fromkeys([f"_{name}" for name in TRUTH], every)

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Hold each rudder for one sample time, (num_envs, 1); return the same in arrays as each environment does."""
        shares, ours = _shares(actions, self.num_envs), self._ours
        held = self._held_one_by_one if self._autoreset_envs.any() else self._held
        ended, seen = held(ours[0].orders(shares))
        wanted = np.array([our.wanted for our in ours])
        errors = wanted - seen[:, HEADING]
        rewards = _rewards(errors, shares, ours[0].simulator.sample_time)
        rewards[self._autoreset_envs] = 0.0
        cut = np.array([our.taken for our in ours]) >= STEPS
        self._autoreset_envs = ended | cut
        infos = dict(zip(TRUTH, [wanted, *seen.T.copy()], strict=True))
        return _observations(errors, seen), rewards, ended, cut, infos | self._known

    def _held(self, orders: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step all environments, side by side; return which simulations stopped, and the true values."""
        for our in self._ours:
            our.taken += 1
        return self._group.hold(orders)

    def _held_one_by_one(self, orders: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Step the environments, and start those again whose episode is over; return the same."""
        for i in np.flatnonzero(self._autoreset_envs):
            self._ours[i].reset()
        each = zip(self._ours, orders, self._autoreset_envs.tolist(), strict=True)
        stopped = [not again and our.hold(order) for our, order, again in each]
        return np.array(stopped), np.array([our.simulator.seen for our in self._ours])

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads."""
        super().close_extras(**kwargs)
        self._group.close()


def register() -> None:
    """Make the environment known to `gymnasium.make` and `make_vec`; done when this module is imported."""
    if ENVIRONMENT not in gymnasium.registry:
        gymnasium.register(
            ENVIRONMENT,
            entry_point="subzero.gym_environment:TetheredHeading",
            vector_entry_point="subzero.gym_environment:TetheredHeadings",
        )


register()
