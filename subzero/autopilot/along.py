"""A linear time-varying model along a run: a cable that grows, a turn, a winch, a current, without steady motion.

    δx_{k+1} = A_k δx_k + B_k δu_k,   A_k = ∂Φ/∂x, B_k = ∂Φ/∂u at (x_k, u_k) of the run

with Φ one exchange of the coupled simulation (`coupled_plant`): hull, actuators as they are, the cable's shape at two
times, its drum. A_k is large and never formed: its product with a deviation is a directional central difference,

    A_k δx_k + B_k δu_k = (Φ(x_k + h δx_k, u_k + h δu_k) − Φ(x_k − h δx_k, u_k − h δu_k))/2h

The result is linear in δu, and holds for small disturbances. How small is set by the cable: its normal drag
½ρdC_n |V_n| V_n has no linear part where the cable is straight, and outweighs inertia from a few millimetres a second
on. After 2 s of rudder at 1 m/s on 20 m of cable, the largest error is 2 % of the largest deviation for 0.06° of
rudder, 13 % for 0.6°, 37 % for 5°.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scenarios import Trial
from scenarios.steps import whole_steps
from subzero.autopilot.coupled_plant import CABLE_OUTPUTS, HULL_SIZE, NoSpaceError, Tethered, blank_trial
from subzero.channels import BY_NAME
from subzero.errors import UserError
from subzero.model import Model, load
from subzero.simulation.refinement import resolved
from subzero.simulation.run import simulate
from subzero.steady_motion.hull_state_space import INPUT_NAMES, STATE_NAMES, UNITS
from subzero.steady_motion.trim_point import Trim

if TYPE_CHECKING:
    import xarray as xr

SIZE = 1e-5
"""Largest entry of h δx and h δu [m, m/s, rad, N …]: 0.1 % of it for the drag across the cable, 1e-6 for rounding."""
SMALLEST = 1e-8
"""Where the disturbed steps do not do the same, such as to split a segment, smaller ones are tried down to this."""
SPARE_LENGTH = 32.0
"""Initial capacity for cable, beyond the cable that is out; doubled as often as needed. [m]"""


@dataclass(frozen=True, kw_only=True, eq=False)
class Along:
    """A run, and its response to small deviations; from `linearise_along`.

    Attributes:
        time: of the run, one cable step apart (n + 1,). [s]
        commands: that were given (n, 4), as `INPUTS`. [rev/s, rad]
        parts: so many steps of the simulation make a cable step: more than one where the accuracy of the run needs it.
        states: of hull and cable, one such part apart (n parts + 1, m): `STATES` first, then what only the simulation
            knows.
        step: the simulation.
    """

    time: np.ndarray
    commands: np.ndarray
    parts: int
    states: np.ndarray
    step: Tethered

    def respond(self, commands: np.ndarray, start: np.ndarray | None = None) -> xr.Dataset:
        """Return how the run deviates when its commands do, to first order.

        Args:
            commands: deviations of the commands, held over each cable step (n, 4), as `INPUTS`; large or small is the
                same, as the answer is linear. [rev/s, rad]
            start: deviation of the hull at the start (16,), as `STATES`; none by default.

        Returns:
            deviations over `time` by name: `STATES`, and length, tensions and pull of the cable
            (`coupled_plant.CABLE_OUTPUTS`), in SI units, rad and rev/s.

        Raises:
            UserError: deviations of another shape, or not finite; a step of the run that has no derivative.
        """
        import xarray as xr

        change = self._checked(commands, "commands", self.commands.shape)
        x = np.zeros(self.states.shape[1])
        if start is not None:
            x[: len(STATE_NAMES)] = self._checked(start, "start", (len(STATE_NAMES),))
            x[len(STATE_NAMES) + 1 : HULL_SIZE] = x[13 : len(STATE_NAMES)]
        rows = [self._seen(0, x)]
        for k, du in enumerate(np.repeat(change, self.parts, axis=0)):
            x = self._moved_on(k, x, du)
            if (k + 1) % self.parts == 0:
                rows.append(self._seen(k + 1, x))
        values = np.array(rows).T
        names = (*STATE_NAMES, *CABLE_OUTPUTS)
        units = UNITS | {name: BY_NAME[name].unit for name in CABLE_OUTPUTS}
        variables = {
            name: ("time", value, {"units": units[name], "long_name": f"deviation of {name}"})
            for name, value in zip(names, values, strict=True)
        }
        return xr.Dataset(variables, coords={"time": ("time", self.time, {"units": "s"})})

    def _moved_on(self, k: int, dx: np.ndarray, du: np.ndarray) -> np.ndarray:
        """Return A_k δx + B_k δu of part k."""
        t, u = self._at(k)
        largest = max(float(np.max(np.abs(dx))), float(np.max(np.abs(du))))
        if largest == 0.0:
            return dx
        size = SIZE
        while size >= SMALLEST:
            h = size / largest
            ends = [self.step.update(t, self.states[k] + s * h * dx, u + s * h * du, {}) for s in (1.0, -1.0)]
            if self.step.events(ends[0]) == self.step.events(ends[1]):
                column: np.ndarray = (ends[0] - ends[1]) / (2.0 * h)
                return column
            size *= 0.1
        raise UserError(
            f"linearise_along: at t = {t:g} s the drum begins or stops to turn, or the cable is split, just"
            " then: the run has no derivative there. Allowed: a run that starts, or is commanded, a little otherwise."
        )

    def _seen(self, k: int, dx: np.ndarray) -> np.ndarray:
        """Return hull states and cable outputs of a deviation."""
        largest = float(np.max(np.abs(dx)))
        if largest == 0.0:
            return np.zeros(len(STATE_NAMES) + len(CABLE_OUTPUTS))
        h, x, (t, u) = SIZE / largest, self.states[k], self._at(k)
        ends = [self.step.output(t, x + s * h * dx, u, {}) for s in (1.0, -1.0)]
        column: np.ndarray = (ends[0] - ends[1]) / (2.0 * h)
        return column

    def _at(self, k: int) -> tuple[float, np.ndarray]:
        """Return the time at which part k begins, and the commands that hold then."""
        row, part = divmod(k, self.parts)
        if row == len(self.commands):
            return float(self.time[row]), self.commands[-1]
        return float(
            self.time[row] + part * (self.time[row + 1] - self.time[row]) / self.parts
        ), self.commands[row]

    def _checked(self, values: np.ndarray, what: str, shape: tuple[int, ...]) -> np.ndarray:
        """Return deviations as an array of a shape, or refuse them."""
        array = np.asarray(values, dtype=float)
        if array.shape != shape or not np.all(np.isfinite(array)):
            raise UserError(
                f"respond: {what} of shape {array.shape}. Allowed: finite numbers of shape {shape}, in the order"
                f" {', '.join(INPUT_NAMES if what == 'commands' else STATE_NAMES)}."
            )
        return array


def linearise_along(
    scenario: str | Path | Trial,
    *,
    model: Model | None = None,
    start: Trim | None = None,
    duration: float | None = None,
) -> Along:
    """Return the linear model along a run of the coupled simulation, the cable growing as it does there.

    Steps and segments are those of `subzero.simulate`: finer than the trial's where its `rtol` asks for it.

    Args:
        scenario: the scenario to run: its start, commands, water and steps.
        model: another model than the scenario's.
        start: a steady motion to begin with instead, its cable straight behind, its commands held to the end; heading,
            depth and steps remain those of the scenario.
        duration: how long; the scenario's by default. [s]

    Raises:
        UserError: a prescribed motion, another scheme than moving_end, a run that could not go on.
    """
    trial = scenario if isinstance(scenario, Trial) else load(scenario)
    if trial.motion is not None or trial.scheme != "moving_end":
        raise UserError(
            f"linearise_along: '{trial.name}' prescribes its motion, or has the scheme '{trial.scheme}'. Allowed:"
            " commands, and the scheme 'moving_end'."
        )
    model, end = model or Model.of(trial), trial.duration if duration is None else duration
    if not (np.isfinite(end) and end >= trial.cable_step):
        raise UserError(f"linearise_along: the duration is {end!r}. Allowed: at least one cable step.")
    time = whole_steps(trial.cable_step, round(end / trial.cable_step) + 1)
    commands = _commands(trial, time[:-1]) if start is None else np.tile(start.command, (time.size - 1, 1))
    x, parts = None, 1
    if start is None:
        trial, parts = _as_it_is_run(trial, model, end)
    else:
        x = start.state.copy()
        x[2], x[5] = trial.start.depth, trial.start.heading
        steps = {
            name: getattr(trial, name) for name in ("cable_step", "hull_step", "segment_length", "grading")
        }
        trial = blank_trial(model, x, start.wet_length, steps)
    capacity = trial.start.wet_length + SPARE_LENGTH
    while True:
        step = Tethered(trial, model, capacity, x=x, exact=True)
        try:
            states = _run(step, time, commands, parts)
            return Along(time=time, commands=commands, parts=parts, states=states, step=step)
        except NoSpaceError:
            capacity *= 2.0


def _commands(trial: Trial, time: np.ndarray) -> np.ndarray:
    """Return the commands of a trial at times (n, 4)."""
    if trial.commands is None:
        return np.zeros((time.size, 4))
    return trial.commands.at(time)


def _as_it_is_run(trial: Trial, model: Model, end: float) -> tuple[Trial, int]:
    """Return a trial with steps and segments as fine as its run takes them, and into how many parts a step is cut."""
    run = simulate(dataclasses.replace(trial, duration=end), model=model)
    halvings = int((json.loads(run.attrs.get("accuracy", "null")) or {}).get("halvings") or 0)
    fine = resolved(trial, 0.5**halvings) or trial
    return dataclasses.replace(fine, cable_step=trial.cable_step / 2**halvings), 2**halvings


def _run(step: Tethered, time: np.ndarray, commands: np.ndarray, parts: int) -> np.ndarray:
    """Return the states of a run, so many parts to each step (n parts + 1, m)."""
    states = [step.initial]
    for begin, end, u in zip(time[:-1], time[1:], commands, strict=True):
        for part in range(parts):
            states.append(step.update(float(begin + part * (end - begin) / parts), states[-1], u, {}))
    return np.array(states)
