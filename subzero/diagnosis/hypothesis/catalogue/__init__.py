"""The catalogue: every cause that a diagnosis can name, as data.

To add one of your own, without touching these files: a Python file with ``EFFECTS = [Effect(...)]``, given as
``--effects my_effects.py``; or a package with an entry point in the group ``subzero.effects`` that names such a list.
"""

from __future__ import annotations

import runpy
from collections.abc import Iterable
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

from subzero.arguments import checked_arguments
from subzero.diagnosis.hypothesis.catalogue import cable, fins, hull, listed, propulsion, sensors
from subzero.diagnosis.hypothesis.catalogue.sensors import NOISE, SAMPLED, SPECS, START
from subzero.diagnosis.hypothesis.effect import Effect
from subzero.errors import UserError
from subzero.files.read_file import MOST_OF_A_PROGRAM, read_bytes
from vehicle import Vehicle

__all__ = ["NOISE", "ONSETS", "SAMPLED", "SPECS", "START", "all_effects", "catalogue", "load"]
ONSETS = (*fins.ONSETS, *hull.ONSETS, *propulsion.ONSETS)
"""Effects that can only begin in mid-trial: a jam is no small deviation of a fin that follows its command, and a
growth has an onset. Neither has a tolerance in a healthy vehicle, and so they are no part of every fit.
"""


@checked_arguments
def catalogue(channels: Iterable[str], more: Iterable[Effect] = ()) -> dict[str, Effect]:
    """Return every effect by id, with those of the sensors of these channels."""
    shipped = (*propulsion.EFFECTS, *fins.EFFECTS, *hull.EFFECTS, *cable.EFFECTS)
    found = (*shipped, *sensors.sensor_effects(channels), sensors.CLOCK, *_installed(), *more)
    twice = sorted({effect.id for effect in found if [e.id for e in found].count(effect.id) > 1})
    if twice:
        raise UserError(f"Effects need ids of their own; there are two of {', '.join(twice)}.")
    return {effect.id: effect for effect in found}


def with_own(more: Iterable[Effect], hull: Vehicle) -> tuple[Effect, ...]:
    """Return further causes, and those that follow from the lists of a vehicle."""
    known = tuple(more)
    ids = {effect.id for effect in known}
    return (*known, *(effect for effect in listed.effects_of(hull) if effect.id not in ids))


@checked_arguments
def all_effects(more: Iterable[Effect] = ()) -> dict[str, Effect]:
    """Return every effect by id, with those of the start, of all sensors, and those that only begin in mid-trial."""
    return {**catalogue(sensors.SPECS, more), **{effect.id: effect for effect in (*START, SAMPLED, *ONSETS)}}


@checked_arguments
def load(path: str | Path) -> tuple[Effect, ...]:
    """Return the effects of a user's file, which is executed.

    Raises:
        UserError: there is no such file, or it has no list EFFECTS of effects.
    """
    if not Path(path).is_file():
        raise UserError(f"There is no effects file '{path}'. Allowed: the path of a Python file.")
    read_bytes(path, MOST_OF_A_PROGRAM)
    try:
        found = runpy.run_path(str(path)).get("EFFECTS")
    except Exception as error:
        raise UserError(
            f"'{path}' cannot be run: {type(error).__name__}: {error}. Allowed: a Python file that runs by itself."
        ) from error
    if not isinstance(found, (list, tuple)) or not all(isinstance(each, Effect) for each in found):
        raise UserError(f"'{path}' has no list EFFECTS of effects. Allowed: EFFECTS = [Effect(...)].")
    return tuple(found)


@cache
def _installed() -> tuple[Effect, ...]:
    """Return the effects of installed packages; finding them takes as long as several simulations."""
    return tuple(effect for entry in entry_points(group="subzero.effects") for effect in entry.load())
