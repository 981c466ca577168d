"""A task as a value: a cable that is pulled off a drum, or one of a fixed length that is towed.

`cable.pull_out` and `cable.tow` make a task of what they are given, and every scheme takes it from there: all of them
compute the same thing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cable.clamps import Clamps
from cable.current import Current
from cable.drum import DrumProperties
from cable.history import Equilibrium
from cable.properties import CableProperties
from cable.schemes import SHORTEST_S
from cable.sea_bed import SeaBed
from cable.sections import AnyCable, SectionedCable
from cable.tow_path import Velocity
from cable.winch import Winch
from subzero.arguments import checked_arguments
from subzero.errors import BadValueError, checked

Drum = DrumProperties | Winch
START_LENGTH = 1e-6
"""A run "without cable" starts with this length in the water, so that there is a direction. [m]"""

WINCH, MOVING_DRUM, UNEVEN_CURRENT = "a winch", "a drum that moves", "a current that changes"
WET_LENGTH, EQUILIBRIUM = "cable in the water at the start", "a start from cable.hold"
INTERNAL_DAMPING = "internal damping of the cable"
SEA_BED = "a sea bed"
SECTIONS = "a cable of several sections"
CLAMPS = "clamped ends"
SURFACE = "a free surface"
MASS_ALONG = "added mass along the cable"
EVERYTHING = frozenset(
    {WINCH, MOVING_DRUM, UNEVEN_CURRENT, WET_LENGTH, EQUILIBRIUM, INTERNAL_DAMPING, SEA_BED, SECTIONS}
    | {MASS_ALONG, CLAMPS, SURFACE}
)
"""Features that a task may ask for beyond a free drum on the shore, uniform water and no cable at the start."""


@checked_arguments
@dataclass(frozen=True, kw_only=True)
class MovingDrum:
    """A drum that is carried, by a boat for example.

    Attributes:
        velocity: function of time [s] that gives the velocity of the drum north, east, down (3,). [m/s]
        drum: the drum itself, free or with a winch; the free drum of Table 1 when not given.
    """

    velocity: Velocity
    drum: Drum = field(default_factory=DrumProperties)


@dataclass(frozen=True, kw_only=True)
class _Task:
    """What both kinds of tasks are made of.

    Attributes:
        tow_velocity: function of time [s] that gives the tow point's velocity north, east, down (3,). [m/s]
        duration: how long. [s]
        cable: the cable.
        current: how the water moves, at places relative to `PullOut.origin`, or to the tow point at the start.
        bed: the sea bed, in the axes of the current; None without.
        clamps: directions in which it leaves its ends; None for hinges.
        surface: depth of the free surface, in the axes of the current; None for water everywhere. [m]

    Raises:
        subzero.UserError: a duration that is too short to be halved.
    """

    tow_velocity: Velocity
    duration: float
    cable: AnyCable = field(default_factory=CableProperties)
    current: Current = field(default_factory=lambda: Current.uniform(np.zeros(3)))
    bed: SeaBed | None = None
    clamps: Clamps | None = None
    surface: float | None = None

    def __post_init__(self) -> None:
        """Raise an error if the duration is not valid."""
        duration = checked("", "duration", self.duration, least=SHORTEST_S, unit="s")
        object.__setattr__(self, "duration", duration)

    def asks_for(self) -> list[str]:
        """Return the features of `EVERYTHING` that it asks for."""
        asked = {
            SEA_BED: self.bed is not None,
            CLAMPS: self.clamps is not None,
            SURFACE: self.surface is not None,
            SECTIONS: isinstance(self.cable, SectionedCable),
            MASS_ALONG: getattr(self.cable, "tangential_added_mass_coefficient", 0.0) > 0.0,
        }
        return [what for what, is_asked in asked.items() if is_asked]


@dataclass(frozen=True, kw_only=True)
class PullOut(_Task):
    """A cable that is pulled off a drum by a tow point whose motion is prescribed.

    Attributes:
        drum: a free drum, or a winch.
        drum_velocity: the same as of the tow point; None for a drum on the shore.
        start: length of cable in the water at the start, laid straight behind the tow point [m]; or how it hangs.
        origin: place of the drum at the start, in the axes of the current (3,). [m]

    Raises:
        subzero.UserError: a start or a duration that makes no sense.
    """

    drum: Drum = field(default_factory=DrumProperties)
    drum_velocity: Velocity | None = None
    start: float | Equilibrium = 0.0
    origin: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        """Raise an error if the start or the duration is not valid."""
        if not isinstance(self.start, Equilibrium):
            start = checked("", "start", self.start, least=0.0, unit="m, or what cable.hold gives")
            object.__setattr__(self, "start", start)
        super().__post_init__()

    @property
    def wet_length(self) -> float:
        """Cable in the water at the start. [m]."""
        return self.start.length if isinstance(self.start, Equilibrium) else max(self.start, START_LENGTH)

    def asks_for(self) -> list[str]:
        """Return the features of `EVERYTHING` that it asks for."""
        asked = {
            WINCH: not isinstance(self.drum, DrumProperties),
            MOVING_DRUM: self.drum_velocity is not None,
            UNEVEN_CURRENT: self.current.velocity.size != 3,
            WET_LENGTH: not isinstance(self.start, Equilibrium) and self.start > 0.0,
            EQUILIBRIUM: isinstance(self.start, Equilibrium),
            INTERNAL_DAMPING: self.cable.internal_damping > 0.0,
        }
        return [what for what, is_asked in asked.items() if is_asked] + super().asks_for()


@dataclass(frozen=True, kw_only=True)
class Tow(_Task):
    """A cable of a fixed length with a free tail, towed by a point whose motion is prescribed.

    Attributes:
        length: L. [m]
        drogue_drag_area: C_d A of a drogue at the free end; 0 is a free tail. [m²]

    Raises:
        subzero.UserError: a length, a duration or a drogue that makes no sense.
    """

    length: float
    drogue_drag_area: float = 0.0

    def __post_init__(self) -> None:
        """Raise an error if the length, the duration or the drogue is not valid."""
        object.__setattr__(self, "length", checked("", "length", self.length, above=0.0))
        super().__post_init__()
        area = checked("", "drogue_drag_area", self.drogue_drag_area, least=0.0)
        object.__setattr__(self, "drogue_drag_area", area)

    @property
    def tail_drag(self) -> float:
        """½ρC_dA of the drogue. [kg/m]."""
        return 0.5 * self.cable.water_density * self.drogue_drag_area


def current_of(current: Sequence[float] | np.ndarray | Current | None) -> Current:
    """Return a current from the argument of a user: nothing, three numbers, or a current."""
    if isinstance(current, Current):
        return current
    return Current.uniform(np.zeros(3) if current is None else current)


def uniform(cable: AnyCable) -> CableProperties:
    """Return a cable that is one section, for a scheme that knows no others."""
    if isinstance(cable, SectionedCable):
        raise BadValueError(f"This scheme does not know {SECTIONS}; use 'moving_end'.")
    return cable
