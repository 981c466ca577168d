"""The commands ``subzero manoeuvre`` and ``subzero autopilot``: everything heavy is imported inside them."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import Parameter

import scenarios
from subzero.cli.output_mode import FINE, NOT_STRICT, STOPPED, Flag, StrictOutputMode

if TYPE_CHECKING:
    from collections.abc import Callable

    import xarray as xr

    from subzero.autopilot.steps import Pilot
    from subzero.cli.write_flights import Measured
    from subzero.simulation.refinement import Progress

    Fly = Callable[[str, Progress], tuple[xr.Dataset, dict[str, float]]]

RUNS = ("tethered", "untethered")

MANOEUVRE_COMMANDS = {
    "vertical_zigzag": ("pitch", "stern_plane_port_command"),
    "crash_stop": ("heading", "propeller_command"),
}
THRUSTER_CHANNELS = {"vertical_zigzag": ("pitch", "pitch_rate"), "crash_stop": ("heading", "yaw_rate")}
"""The same of a vehicle on thrusters, whose commands are those of many."""
STEP_COMMANDS = {
    "heading_step": ("heading", "rudder_command"),
    "depth_step": ("depth", "stern_plane_port_command"),
    "speed_step": ("heading", "propeller_command"),
}
"""Channels in the figure: the response of the vehicle and the command."""


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class PilotOptions:
    """Who flies.

    Attributes:
        autopilot: pid, lqr, or the path of a Python file with one (see subzero/autopilot/registry.py).
        feed_forward: none, formula or model: what it knows of the cable.
        noisy: through estimated sensors instead of perfect ones.
        seed: of the sensors.
    """

    autopilot: str = "pid"
    feed_forward: str = "none"
    noisy: Flag = False
    seed: int = 0

    def of(self, label: str) -> Pilot:
        """Return the autopilot that flies with the cable or without it."""
        from subzero.autopilot.sensors import ESTIMATED, PERFECT, Sensors
        from subzero.autopilot.steps import Pilot

        return Pilot(
            autopilot=self.autopilot,
            feed_forward=self.feed_forward if label == "tethered" else "none",
            sensors=Sensors(ESTIMATED if self.noisy else PERFECT, seed=self.seed),
        )


PID = PilotOptions()


def manoeuvre(
    name: str,
    scenario: str = "fig6",
    *,
    rudder: float | None = None,
    planes: float | None = None,
    speed: float | None = None,
    vehicle: str | None = None,
    out: Path | None = None,
    output_mode: StrictOutputMode = NOT_STRICT,
) -> int:
    """Fly a manoeuvre with the cable and without, and measure it.

    Args:
        name: turning_circle, zigzag, vertical_zigzag, spiral or crash_stop.
        scenario: whose vehicle, cable and start: a name (see "subzero list") or a path.
        rudder: size of a manoeuvre with the rudder, in degrees.
        planes: size of a manoeuvre with the stern-planes, in degrees.
        speed: of the bare hull before it, in m/s; by default 1, or more if the hull needs more to be held level.
        vehicle: another vehicle than the scenario's: a name of "subzero list --vehicles", or the path of a file.
        out: folder for the files; by default one named after the manoeuvre, here.
        output_mode: the form of the output.
    """
    trial = scenarios.load(scenario)  # a mistake in it answers at once
    from subzero.autopilot.manoeuvres import MANOEUVRES
    from subzero.autopilot.manoeuvres import manoeuvre as run

    size = _size(name, rudder, planes)
    if vehicle is not None:
        from scenarios.parameters import with_vehicle

        trial = with_vehicle(trial, vehicle)[0]

    def fly(label: str, progress: Progress) -> tuple[xr.Dataset, dict[str, float]]:
        return run(name, trial, size=size, speed=speed, tethered=label == "tethered", progress=progress)

    meaning = f": {MANOEUVRES[name].meaning}" if name in MANOEUVRES else ""
    commands = THRUSTER_CHANNELS if trial.vehicle.get("thrusters") else MANOEUVRE_COMMANDS
    shown = commands.get(name, ("heading", "yaw_rate" if commands is THRUSTER_CHANNELS else "rudder_command"))
    return _deliver(trial, fly, out or Path(name), f"{name}{meaning}", shown, output_mode)


def fly_step(
    name: str,
    scenario: str = "fig6",
    *,
    pilot: PilotOptions = PID,
    size: float | None = None,
    speed: float = 1.0,
    out: Path | None = None,
    output_mode: StrictOutputMode = NOT_STRICT,
) -> int:
    """Fly a step with an autopilot, with the cable and without, and measure it.

    Args:
        name: heading_step, depth_step or speed_step.
        scenario: whose vehicle, cable and start: a name (see "subzero list") or a path.
        pilot: who flies.
        size: of the step, in degrees, m or m/s.
        speed: to hold, in m/s.
        out: folder for the files; by default one named after the step, here.
        output_mode: the form of the output.
    """
    trial = scenarios.load(scenario)  # a mistake in it answers at once
    from subzero.autopilot.steps import step as run

    def fly(label: str, progress: Progress) -> tuple[xr.Dataset, dict[str, float]]:
        return run(
            name,
            scenario,
            pilot=pilot.of(label),
            size=size,
            speed=speed,
            tethered=label == "tethered",
            progress=progress,
        )

    cable = "not fed forward" if pilot.feed_forward == "none" else f"fed forward by {pilot.feed_forward}"
    title = f"{name.replace('_', ' ').capitalize()}: autopilot {pilot.autopilot}, the cable {cable}"
    shown = STEP_COMMANDS.get(name, ("heading", "rudder_command"))
    return _deliver(trial, fly, out or Path(name), title, shown, output_mode)


def _size(name: str, rudder: float | None, planes: float | None) -> float | None:
    """Return the size that was asked for, in degrees; refuse the fin that the manoeuvre does not use."""
    from subzero.errors import UserError

    if name == "vertical_zigzag" and rudder is not None:
        raise UserError("vertical_zigzag moves the stern-planes. Use --planes.")
    if name != "vertical_zigzag" and planes is not None:
        raise UserError(f"{name} does not move the stern-planes. Use --rudder.")
    return planes if rudder is None else rudder


def _deliver(
    trial: scenarios.Trial,
    fly: Fly,
    folder: Path,
    title: str,
    shown: tuple[str, str],
    output_mode: StrictOutputMode,
) -> int:
    """Fly with the cable and without, write the results and print a summary; return the exit code."""
    from subzero.autopilot import AutopilotWarning
    from subzero.cli import write_flights
    from subzero.cli.progress import costs_of, progress_bar
    from subzero.cli.write_results import is_well
    from subzero.results.netcdf_csv import open_output_folder

    with open_output_folder(folder) as output_folder:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", AutopilotWarning)  # the outcome reports it, below
            measured: Measured = {}
            for label in RUNS:
                costs = partial(costs_of, trial, label == "tethered")
                with progress_bar(f"Flying {trial.name}, {label}", costs) as progress:
                    measured[label] = fly(label, progress)
        summary = write_flights.write(measured, title, *shown, output_folder)
    write_flights.print_flights(summary, list(measured), output_folder, output_mode)
    return FINE if is_well(summary, output_mode) else STOPPED
