"""A model is a value: a vehicle, a cable, a drum and the water, frozen. To change one, make a new one.

>>> import dataclasses, subzero
>>> model = subzero.Model.of(subzero.load_scenario("fig6"))
>>> heavy = dataclasses.replace(model, vehicle=model.vehicle.with_parameter("rigid_body.mass", 7.0))
>>> heavy.parameters()["vehicle"]["rigid_body"]["mass"]
7.0

`load` reads a trial with all checks. `scenarios` does not know the vehicle, so its reader takes the vehicle's own
check from here; problems of both come in one `scenarios.ScenarioError`, each with its file and line.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

import scenarios
from cable import CableProperties, DrumProperties, SeaBed
from cable.current import Current
from subzero.arguments import checked_arguments
from subzero.errors import BadValueError, checked, short, suggestion
from subzero.external_force import MissingForce
from vehicle import Vehicle, VehicleError, from_mapping, to_mapping

Part = TypeVar("Part", CableProperties, DrumProperties)


@checked_arguments
@dataclass(frozen=True, kw_only=True)
class Model:
    """Everything physical about a tethered vehicle.

    Attributes:
        vehicle: the hull with its propeller, fins and servos.
        cable: the cable.
        drum: the drum, free unless a winch turns it.
        current: velocity of the water, north, east, down, the same everywhere. [m/s]
        profile: velocity of the water that is added to the current by depth.
        winch: the winch that turns the drum; None for a free drum.
        vessel: how the drum moves; None for a drum on the shore.
        missing: a force that all of these lack; None for nothing.
        sea_bed: depth of a flat sea bed that the cable may lie on; 0 for none. [m]
    """

    vehicle: Vehicle
    cable: CableProperties
    drum: DrumProperties
    current: tuple[float, float, float] = (0.0, 0.0, 0.0)
    profile: scenarios.Profile | None = None
    winch: scenarios.Winch | None = None
    vessel: scenarios.Vessel | None = None
    missing: MissingForce | None = None
    sea_bed: float = 0.0

    def __post_init__(self) -> None:
        """Keep the current as plain numbers, and refuse a bed above the surface."""
        checked("Model", "sea_bed", self.sea_bed, least=0.0, unit="m")
        object.__setattr__(self, "current", tuple(map(float, self.current)))

    @classmethod
    @checked_arguments
    def of(cls, trial: scenarios.Trial) -> Model:
        """Return the model that a trial describes.

        Raises:
            UserError: its numbers do not make a vehicle, a cable or a drum (`subzero.load_scenario` has checked them).
        """
        return cls(
            vehicle=from_mapping(trial.vehicle),
            cable=_made(CableProperties, trial.cable),
            drum=_made(DrumProperties, trial.drum),
            current=trial.current,
            profile=trial.profile,
            winch=trial.winch,
            vessel=trial.vessel,
            sea_bed=trial.sea_bed,
        )

    def parameters(self) -> dict[str, Any]:
        """Return every number by name, ready for JSON."""
        return {
            "vehicle": to_mapping(self.vehicle),
            "cable": _numbers_of(self.cable),
            "drum": _numbers_of(self.drum),
            "current": list(self.current),
            **{name: _plain(getattr(self, name)) for name in ("profile", "winch", "vessel")},
            **({"missing": _plain(self.missing)} if self.missing else {}),
        }

    @property
    def bed(self) -> SeaBed | None:
        """The sea bed that the cable may lie on."""
        return SeaBed(depth=self.sea_bed) if self.sea_bed > 0.0 else None

    def water(self) -> Current:
        """Return the motion of the water: the uniform current, and the profile that is added to it by depth."""
        return _water_of(self.current, self.profile)


@lru_cache(maxsize=4)
def _water_of(current: tuple[float, float, float], profile: scenarios.Profile | None) -> Current:
    """Return how the water moves, of one of the last few models: those of a sweep or a diagnosis mostly share it."""
    if profile is None:
        return Current.uniform(current)
    added = np.array(profile.velocity, dtype=float)
    return Current.profile(down=profile.depth, velocity=added + np.array(current))


def model_of(trial: scenarios.Trial, model: object = None) -> Model:
    """Return the model that a trial describes, or another one that is given.

    Raises:
        UserError: the given object is not a model.
    """
    if model is None:
        return Model.of(trial)
    if not isinstance(model, Model):
        raise BadValueError(f"model is {short(model)}; it must be a Model or None.")
    return model


def _made(kind: type[Part], numbers: Mapping[str, Any]) -> Part:
    """Return a cable or a drum from numbers by name; refuse names that it does not have."""
    known = [field.name for field in dataclasses.fields(kind)]
    for name in numbers:
        if name not in known:
            hint = suggestion(name, known) or f" It has {', '.join(known)}."
            raise BadValueError(f"{kind.__name__} has no {short(name)}.{hint}")
    return kind(**numbers)


def _numbers_of(part: CableProperties | DrumProperties) -> dict[str, float]:
    """Return the numbers of a cable or a drum by name; `dataclasses.asdict` copies each."""
    return {field.name: getattr(part, field.name) for field in dataclasses.fields(part)}


def _plain(value: Any) -> dict[str, Any] | None:
    """Return the fields of a value by name, None for none."""
    return None if value is None else dataclasses.asdict(value)


@checked_arguments
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
    """Return the problems that the vehicle's own equations find with its numbers."""
    try:
        from_mapping(numbers)
    except VehicleError as error:
        return error.problems
    return ()
