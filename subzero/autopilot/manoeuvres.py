"""Standard manoeuvres: a program of commands each, and the indices that are computed from its run.

Each begins with a straight run at the trim of the bare hull, with and without the cable, as in a sea trial: the
tethered vehicle then enters the manoeuvre with cable behind it, and slower. To add one: a program (a final class with
`after`, which gives the commands from what it sees, like an autopilot), a function for its indices (`indices`), and a
line in `MANOEUVRES`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import degrees, radians
from typing import TYPE_CHECKING, Any

import numpy as np

import scenarios
from subzero.autopilot import indices
from subzero.autopilot.flight import fly
from subzero.autopilot.helm import HARD_OVER, FinHelm, Helm, ThrusterHelm
from subzero.autopilot.standard import Wanted
from subzero.channels import Observation
from subzero.errors import UserError, checked, chosen
from subzero.model import Model, load, model_of
from subzero.simulation.refinement import Progress
from subzero.steady_motion.asked import NoTrimError
from subzero.steady_motion.hull_state_space import INPUT_NAMES
from subzero.steady_motion.thruster_motion import is_on_thrusters, unheld
from subzero.steady_motion.trim import trim
from subzero.steady_motion.trim_point import held_speeds

if TYPE_CHECKING:
    import xarray as xr

RUN_IN = 12.0
"""How long the straight run before a manoeuvre lasts. [s]"""

USUAL_SPEED = 1.0
"""Of the bare hull in the straight run. [m/s]"""
SPARE = 1.25
"""A hull that needs a faster flow gets so much more than the least that holds it level, for its fins. [-]"""

SHARE_OF_THE_FASTEST = 0.5
"""Of what thrusters hold straight ahead, where the usual speed is too fast. [-]"""

Command = tuple[float, ...]


@dataclass(kw_only=True)
class Program(ABC):
    """The straight run that all manoeuvres begin with; final classes add the rest in `after`.

    Attributes:
        helm: what moves the vehicle: propeller and fins, or thrusters.
        size: of the manoeuvre: rudder or planes; share of the propeller speed for a crash stop. [rad, 1]
        sample_time: [s]
        name: for messages.
    """

    helm: Helm
    size: float
    sample_time: float = 0.1
    name: str = "manoeuvre"
    started: Observation | None = field(default=None, init=False)
    side: float = field(default=1.0, init=False)

    def reset(self) -> None:
        """Begin again."""
        self.started, self.side = None, 1.0

    def update(self, reading: Observation, wanted: Wanted) -> Command:
        """Return the command for the next sample."""
        if reading.time < RUN_IN - 1e-9:
            return self.helm.straight
        self.started = self.started or reading
        return self.after(reading, self.started)

    @abstractmethod
    def after(self, now: Observation, started: Observation) -> Command:
        """Return the command after the start of the manoeuvre."""

    def turned(self, channel: str, now: Observation, started: Observation) -> float:
        """Return how far an angle has changed, to the side of the rudder or planes [rad]; refuse an unknown one."""
        change = self.side * (getattr(now, channel) - getattr(started, channel))
        if change != change:
            raise UserError(f"at t = {now.time:g} s the {channel} is not a number: no sensor measures it.")
        return float(change)


class TurningCircle(Program):
    """The rudder put over, and kept."""

    def after(self, now: Observation, started: Observation) -> Command:
        """Return the rudder over."""
        return self.helm.command(rudder=self.size)


class ZigZag(Program):
    """The rudder reversed each time the heading has changed by as much as the rudder."""

    fin, angle = "rudder", "heading"

    def after(self, now: Observation, started: Observation) -> Command:
        """Return the fin on its present side."""
        if self.turned(self.angle, now, started) >= abs(self.size):
            self.side = -self.side
        return self.helm.command(**{self.fin: self.side * self.size})


class VerticalZigZag(ZigZag):
    """The planes reversed each time the pitch has changed by as much as the planes."""

    fin, angle = "planes", "pitch"


TO_THE_OTHER_SIDE = (1.0, 0.5, 0.25, 0.1, 0.0, -0.1, -0.25, -0.5, -1.0)
SPIRAL_SHARES = TO_THE_OTHER_SIDE + TO_THE_OTHER_SIDE[-2::-1]
SPIRAL_HOLD = 6.0
"""Rudders of a spiral, as shares of the largest, and how long each is held [s]."""


class Spiral(Program):
    """Dieudonné's spiral: rudders in steps from one side to the other and back, each until the turn is steady."""

    def after(self, now: Observation, started: Observation) -> Command:
        """Return the rudder of the present step."""
        step = int((now.time - started.time + 1e-9) / SPIRAL_HOLD)
        return self.helm.command(rudder=self.size * SPIRAL_SHARES[min(step, len(SPIRAL_SHARES) - 1)])


class CrashStop(Program):
    """The propeller full astern."""

    def after(self, now: Observation, started: Observation) -> Command:
        """Return the propeller astern, the fins as they were."""
        return self.helm.command(propulsion=-self.size)


@dataclass(frozen=True, kw_only=True)
class Manoeuvre:
    """A line of the table.

    Attributes:
        meaning: in words.
        program: the program that commands it.
        size: by default. [degree; 1]
        unit: of the size.
        duration: of the manoeuvre after the straight run. [s]
        index: the function that measures it, from `indices`.
        channels: channels of a run that the index takes, in its order, SI and radians.
        numbers: further arguments of it, by name.
        takes_size_as: the name of the size among these, if it takes it.
    """

    meaning: str
    program: type[Program]
    size: float
    unit: str = "degree"
    duration: float
    index: Callable[..., dict[str, float]]
    channels: tuple[str, ...]
    numbers: Mapping[str, float] = field(default_factory=lambda: {"start": RUN_IN})
    takes_size_as: str = ""

    def measure(self, run: Mapping[str, np.ndarray], size: float) -> dict[str, float]:
        """Return the indices of a run; the size in radians (or a share)."""
        sized = {self.takes_size_as: size} if self.takes_size_as else {}
        return self.index(*(run[name] for name in self.channels), **self.numbers, **sized)


MANOEUVRES: dict[str, Manoeuvre] = {
    "turning_circle": Manoeuvre(
        meaning="rudder put over and kept",
        program=TurningCircle,
        size=10.0,
        duration=45.0,
        index=indices.turning_circle,
        channels=("time", "north", "east", "heading"),
    ),
    "zigzag": Manoeuvre(
        meaning="rudder reversed when the heading has changed by as much",
        program=ZigZag,
        size=10.0,
        duration=30.0,
        index=indices.zigzag,
        channels=("time", "heading", "rudder_command"),
        takes_size_as="limit",
    ),
    "vertical_zigzag": Manoeuvre(
        meaning="stern-planes reversed when the pitch has changed by as much",
        program=VerticalZigZag,
        size=10.0,
        duration=40.0,
        index=indices.zigzag,
        channels=("time", "pitch", "planes"),
        takes_size_as="limit",
    ),
    "spiral": Manoeuvre(
        meaning="rudder in steps to the other side and back",
        program=Spiral,
        size=15.0,
        duration=SPIRAL_HOLD * len(SPIRAL_SHARES),
        index=indices.spiral,
        channels=("time", "yaw_rate", "rudder_command"),
        numbers={"start": RUN_IN, "hold": SPIRAL_HOLD},
    ),
    "crash_stop": Manoeuvre(
        meaning="propeller astern, size times as fast",
        program=CrashStop,
        size=1.0,
        unit="1",
        duration=15.0,
        index=indices.crash_stop,
        channels=("time", "north", "east", "surge_speed", "heading"),
    ),
}
"""Manoeuvre by name."""


def manoeuvre(
    name: str,
    scenario: str | scenarios.Trial = "fig6",
    *,
    size: float | None = None,
    speed: float | None = None,
    tethered: bool = True,
    model: Model | None = None,
    progress: Progress | None = None,
) -> tuple[xr.Dataset, dict[str, float]]:
    """Return the run of a manoeuvre, and its indices (units in their names).

    Args:
        name: one of `MANOEUVRES`.
        scenario: whose vehicle, cable and start; its commands are not used.
        size: rudder or planes [degree], or the share of the propeller speed of a crash stop; by default the table's, as
            far as the fins go. Of a vehicle on thrusters, of the moments and the thrust that stand for these (`helm`).
        speed: of the bare hull in the straight run, which the propeller is set for; by default `USUAL_SPEED`, or more
            if the hull needs more to be held level. [m/s]
        tethered: with the cable.
        model: another model than the scenario's.
        progress: called with the fraction that is done.

    Raises:
        UserError: there is no such manoeuvre, a size of nothing or beyond the fins, no steady motion at this speed.
    """
    line = chosen(MANOEUVRES, name, "manoeuvre")
    trial = scenario if isinstance(scenario, scenarios.Trial) else load(scenario)
    model = model_of(trial, model)
    _check_actuators(line, name, model)
    speed = usual_speed(model) if speed is None else speed
    inner = _checked_size(line, min(line.size, _largest(line, model)) if size is None else size, model)
    helm = _helm(model, speed)
    program = line.program(helm=helm, size=inner, name=name, sample_time=trial.cable_step)
    start = replace(trial.start, surge_speed=speed)
    begin = replace(trial, start=start, duration=RUN_IN + line.duration, station=None)
    run = fly(begin, program, lambda t: _NOTHING, tethered=tethered, model=model, progress=progress)
    run = run.drop_vars(["wanted_speed", "wanted_heading", "wanted_depth"])
    return run, line.measure(_inner(run, helm), inner)


def _helm(model: Model, speed: float) -> Helm:
    """Return what moves a vehicle in a manoeuvre from a steady speed [m/s]."""
    steady = trim(model, speed=speed)
    if is_on_thrusters(model.vehicle):
        return ThrusterHelm.of(model.vehicle, steady)
    return FinHelm(tuple(steady.command.tolist()))


def _check_actuators(line: Manoeuvre, name: str, model: Model) -> None:
    """Raise an error for a vehicle that lacks what a manoeuvre moves."""
    hull = model.vehicle
    if is_on_thrusters(hull):
        if line.program is VerticalZigZag and "pitch" in (unheld(hull) or ()):
            raise UserError(f"{name} needs thrusters that pitch the vehicle, and its own do not.")
        return
    lacking = [] if hull.propeller.thrust_constant > 0.0 else ["a propeller"]
    fins = {"a rudder": hull.has_rudder, "stern-planes": hull.has_stern_planes}
    moved = dict.fromkeys((ZigZag, TurningCircle, Spiral), "a rudder") | {VerticalZigZag: "stern-planes"}
    lacking += [fin for fin, there in fins.items() if moved.get(line.program) == fin and not there]
    if lacking:
        raise UserError(f"{name} needs {' and '.join(lacking)}, and this vehicle has none.")


def usual_speed(model: Model) -> float:
    """Return the speed that manoeuvres are flown at: `USUAL_SPEED` where the hull holds it, else what it holds. [m/s]

    Fins that are small for the net buoyancy, or for the reaction torque of the propeller, need a faster flow.
    """
    try:
        trim(model, speed=USUAL_SPEED)
    except NoTrimError:
        slowest, most = held_speeds(model)
        if is_on_thrusters(model.vehicle):  # the rest of the thrust is for the manoeuvre
            return SHARE_OF_THE_FASTEST * most
        return min(SPARE * slowest, most) if slowest > USUAL_SPEED else most or USUAL_SPEED
    return USUAL_SPEED


_NOTHING = Wanted(float("nan"), float("nan"))


def _checked_size(line: Manoeuvre, asked: float, model: Model) -> float:
    """Return a size in radians (or as a share), if fins can do it."""
    size = checked("", "size", asked)
    most = _largest(line, model)
    if not 0.0 < abs(size) <= most:
        unit = "" if line.unit == "1" else " degrees"
        raise UserError(f"A size of {size:g}{unit} cannot be done. Allowed: up to {most:.3g}{unit}, not 0.")
    return size if line.unit == "1" else radians(size)


def _largest(line: Manoeuvre, model: Model) -> float:
    """Return the largest size that fins, or a propeller astern, can do. [degree; 1]"""
    if is_on_thrusters(model.vehicle):
        return 1.0 if line.unit == "1" else degrees(HARD_OVER)
    return 5.0 if line.unit == "1" else degrees(model.vehicle.rudder_servo.deflection_limit)


def _inner(run: xr.Dataset, helm: Helm) -> dict[str, np.ndarray]:
    """Return the channels that are measured, in SI and radians; of thrusters the angles that their moments stand
    for.
    """
    names = ("north", "east", "heading", "pitch", "surge_speed", "yaw_rate", *INPUT_NAMES)
    found: dict[str, Any] = {"time": run["time"].values}
    for name in names:
        scale = np.pi / 180.0 if run[name].attrs["units"].startswith("degree") else 1.0
        found[name] = run[name].values * scale
    together = 0.5 * (found["stern_plane_port_command"] + found["stern_plane_starboard_command"])
    found["planes"] = np.where(np.abs(together - together[0]) < 1e-9, 0.0, together - together[0])
    if isinstance(helm, ThrusterHelm):
        commands = np.column_stack([run[f"{name}_command"].values for name in helm.names])
        found |= {"rudder_command": helm.angles("yaw", commands), "planes": helm.angles("pitch", commands)}
    return found
