"""An autopilot of the user's own, from a small Python file.

    def make(tuning, sample_time, cable):
        return Mine(tuning, sample_time, cable)

The file has to have a function `make`; what it returns has to be as `flight.Autopilot` says. `tuning` holds the gains
and trims of the vehicle, `cable.wrench(reading, last_command)` tells what the cable does to it, and may be ignored.
"""

from __future__ import annotations

import runpy
from collections.abc import Callable
from pathlib import Path

from subzero.autopilot.feed_forward import CableModel
from subzero.autopilot.flight import Autopilot
from subzero.autopilot.tuning import Tuning
from subzero.errors import UserError
from subzero.user_file import MOST_OF_A_PROGRAM, read_bytes

Build = Callable[[Tuning, float, CableModel], Autopilot]
"""What makes an autopilot, from a tuning, a sample time [s] and a cable model."""


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
    return build


def built(path: str | Path, build: Build, tuning: Tuning, sample_time: float, cable: CableModel) -> Autopilot:
    """Return what the function `make` of a file makes.

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
