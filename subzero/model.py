"""A model is a value: a vehicle, a cable, a drum and the water, frozen. To change one, make a new one.

>>> import dataclasses, subzero
>>> model = subzero.Model.of(subzero.load_scenario("fig6"))
>>> heavy = dataclasses.replace(model, vehicle=model.vehicle.with_parameter("rigid_body.mass", 7.0))
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import scenarios
from cable.properties import CableProperties, DrumProperties
from subzero.missing_force import MissingForce
from vehicle import Vehicle, from_mapping, to_mapping


@dataclass(frozen=True, kw_only=True)
class Model:
    """Everything physical about a tethered vehicle.

    Attributes:
        vehicle: the hull with its propeller, fins and servos.
        cable: the cable.
        drum: the drum, free unless a winch turns it.
        current: velocity of the water, north, east, down, the same everywhere. [m/s]
        profile: what is added to the current by depth.
        winch: what turns the drum; None for a free drum.
        vessel: how the drum moves; None for a drum on the shore.
        missing: a force that all of these lack; None for nothing.
    """

    vehicle: Vehicle
    cable: CableProperties
    drum: DrumProperties
    current: tuple[float, float, float] = (0.0, 0.0, 0.0)
    profile: scenarios.Profile | None = None
    winch: scenarios.Winch | None = None
    vessel: scenarios.Vessel | None = None
    missing: MissingForce | None = None

    @classmethod
    def of(cls, trial: scenarios.Trial) -> Model:
        """Return the model that a trial describes.

        Raises:
            vehicle.VehicleError: its numbers do not make a vehicle (`subzero.load_scenario` has checked them).
            ValueError: its numbers do not make a cable or a drum.
        """
        return cls(
            vehicle=from_mapping(trial.vehicle),
            cable=CableProperties(**trial.cable),
            drum=DrumProperties(**trial.drum),
            current=trial.current,
            profile=trial.profile,
            winch=trial.winch,
            vessel=trial.vessel,
        )

    def parameters(self) -> dict[str, Any]:
        """Return every number by name, ready for JSON."""
        return {
            "vehicle": to_mapping(self.vehicle),
            "cable": dataclasses.asdict(self.cable),
            "drum": dataclasses.asdict(self.drum),
            "current": list(self.current),
            **{name: _plain(getattr(self, name)) for name in ("profile", "winch", "vessel")},
            **({"missing": _plain(self.missing)} if self.missing else {}),
        }


def _plain(value: Any) -> dict[str, Any] | None:
    """Return the fields of a value by name, None for none."""
    return None if value is None else dataclasses.asdict(value)
