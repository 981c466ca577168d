"""The one table of autopilots, and of feed-forward models, by name.

To add one of your own: a small file with a class as `flight.Autopilot` says, and a line here; or hand the object to
`fly`; or give the path of the file as the name (`from_file`), on the command line too:

    def make(tuning, sample_time, cable):
        return Mine(tuning, sample_time, cable)

The file has to have a function `make`; what it returns has to be as `flight.Autopilot` says. `tuning` holds the gains
and trims of the vehicle, `cable.wrench(reading, last_command)` returns the cable's wrench on it, and need not be
used.
"""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path

import scenarios
from subzero.autopilot.estimator import EstimatorLoop, estimates
from subzero.autopilot.feed_forward import CableModel, FormulaCable, NoCable, TwinCable
from subzero.autopilot.flight import Autopilot
from subzero.autopilot.stability_margins import check_stable
from subzero.autopilot.standard import StandardAutopilot
from subzero.autopilot.tuning import Tuning, tune
from subzero.errors import UserError, chosen, real, short
from subzero.files.read_file import MOST_OF_A_PROGRAM, read_bytes
from subzero.model import Model, model_of

Build = Callable[[Tuning, float, CableModel], Autopilot]
"""The factory of an autopilot, from a tuning, a sample time [s] and a cable model."""


def from_file(path: str | Path) -> Build:
    """Return the function `make` of a Python file, which is run.

    Raises:
        UserError: there is no such file, it cannot be run, or it has no such function.
    """
    if not Path(path).is_file():
        raise UserError(f"There is no autopilot file '{path}'. Allowed: the path of a Python file.")
    read_bytes(path, MOST_OF_A_PROGRAM)
    try:
        build = runpy.run_path(str(path)).get("make")
    except Exception as error:
        raise UserError(
            f"'{path}' cannot be run: {type(error).__name__}: {error}. Allowed: a Python file that runs by itself."
        ) from error
    if not callable(build):
        raise UserError(
            f"'{path}' has no function 'make'. Allowed: def make(tuning, sample_time, cable), which returns an"
            " autopilot."
        )
    make: Build = build
    return make


def built(path: str | Path, build: Build, tuning: Tuning, sample_time: float, cable: CableModel) -> Autopilot:
    """Return the autopilot that the function `make` of a file makes.

    Raises:
        UserError: it raised an error of its own.
    """
    try:
        return build(tuning, sample_time, cable)
    except UserError:
        raise
    except Exception as error:
        raise UserError(
            f"'{path}': its function 'make' broke: {type(error).__name__}: {error}. Allowed: one that"
            " returns an autopilot."
        ) from error


def _pid(tuning: Tuning, sample_time: float, cable: CableModel) -> StandardAutopilot:
    check_stable(tuning, sample_time)
    return StandardAutopilot(tuning, sample_time, cable=cable, name="pid")


def _lqr(tuning: Tuning, sample_time: float, cable: CableModel) -> StandardAutopilot:
    matrices = estimates(tuning, sample_time)
    check_stable(tuning, sample_time, matrices)
    heading = EstimatorLoop(matrices, sample_time)
    return StandardAutopilot(tuning, sample_time, cable=cable, heading=heading, name="lqr")


LONGEST_SAMPLE_S = 60.0
"""A controller that sleeps longer holds nothing. [s]"""

AUTOPILOTS: dict[str, Build] = {"pid": _pid, "lqr": _lqr}
"""Name → factory of an autopilot, from a tuning, a sample time [s] and a cable model."""

FEED_FORWARD: dict[str, Callable[[Tuning, scenarios.Trial, float, Model], CableModel]] = {
    "none": lambda tuning, trial, sample_time, believed: NoCable(),
    "formula": lambda tuning, trial, sample_time, believed: FormulaCable(tuning, believed),
    "model": lambda tuning, trial, sample_time, believed: TwinCable(trial, sample_time, believed),
}
"""Name → factory of a cable model, from a tuning, a trial, a sample time [s] and the assumed model."""


def make(
    name: str,
    trial: scenarios.Trial,
    *,
    feed_forward: str = "none",
    sample_time: float = 0.1,
    tuning: Tuning | None = None,
    believed: Model | None = None,
) -> Autopilot:
    """Return an autopilot by name.

    Args:
        name: one of `AUTOPILOTS`, or the path of a Python file with one (`from_file`).
        trial: the trial to fly.
        feed_forward: one of `FEED_FORWARD`.
        sample_time: of the controller. [s]
        tuning: gains; those of `tune` on the trial's vehicle by default.
        believed: the autopilot's assumed vehicle, cable and water; the trial's by default.

    Raises:
        UserError: there is no such autopilot or feed-forward; a sample time of nothing; with these gains and this
            sample time the hull is unstable.
    """
    time = real(sample_time)
    if time is None or not 0.0 < time <= LONGEST_SAMPLE_S:
        raise UserError(
            f"make: the sample time is {short(sample_time)}. Allowed: a time above 0 s, up to {LONGEST_SAMPLE_S:g} s."
        )
    is_path = isinstance(name, str) and name.endswith(".py")
    build = from_file(name) if is_path else chosen(AUTOPILOTS, name, "autopilot")
    cable = chosen(FEED_FORWARD, feed_forward, "feed-forward")
    believed = model_of(trial, believed)
    tuning = tuning or tune(believed)
    ahead = cable(tuning, trial, time, believed)
    return built(name, build, tuning, time, ahead) if is_path else build(tuning, time, ahead)
