"""Read a trial with every check there is: what files may say, and what makes a vehicle.

`scenarios` knows no vehicle, so its reader takes the vehicle's own check from here; problems of both come
in one `scenarios.ScenarioError`, each with its file and line.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import scenarios
import vehicle


def load(
    name_or_path: str | Path,
    *,
    commands_csv: str | Path | None = None,
    motion_csv: str | Path | None = None,
) -> scenarios.Trial:
    """Return a shipped scenario or a user's, checked against the equations of the vehicle too.

    Args:
        name_or_path: a name of ``scenarios.names()``, or the path of a TOML file.
        commands_csv: a CSV file of commands that replaces those of the scenario.
        motion_csv: a CSV file of a motion, such as a run's own, that replaces the commands or the motion of the
            scenario, and what its start says besides the cable.

    Raises:
        scenarios.ScenarioError: with every problem of every file.
    """
    return scenarios.load(
        name_or_path, commands_csv=commands_csv, motion_csv=motion_csv, check_vehicle=_complaints
    )


def _complaints(numbers: Mapping[str, Any]) -> Iterable[Any]:
    """Return what the vehicle's own equations find wrong with its numbers."""
    try:
        vehicle.from_mapping(numbers)
    except vehicle.VehicleError as error:
        return error.problems
    return ()
