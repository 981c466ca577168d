"""What a trial is, as values: everything a run needs, checked, in SI units and radians.

A `Trial` comes from `scenarios.load`. To change one, make a new one, as in
``dataclasses.replace(trial, duration=60.0)``. Propeller speeds are in revolutions per second, the one
unit here that is not SI.

Signs: axes are north-east-down; depth is positive down; heading runs clockwise from north; a positive rudder
turns the heading to starboard (it increases); positive stern-planes (both) pitch the nose up.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

SCHEMES = ("moving_end", "paper", "paper_tangent", "paper_drum")
"""How the cable is solved: our moving end, or the paper's scheme, with either reading of its new node
("paper" is the usable one, "paper_tangent")."""

CONTROLS = ("pay_out_rate", "constant_tension", "brake")
"""What a winch does; without a winch the drum is free, and the cable is pulled off it."""


@dataclass(frozen=True, kw_only=True)
class Start:
    """How the vehicle lies at t = 0.

    Attributes:
        heading: ψ, clockwise from north. [rad]
        pitch: θ, positive nose up. [rad]
        roll: φ, positive starboard side down. [rad]
        depth: of the hull centre, positive down. [m]
        surge_speed: u, forward speed over ground. [m/s]
        wet_length: cable already in the water, laid straight behind the vehicle. [m]
    """

    heading: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    depth: float = 0.0
    surge_speed: float = 0.0
    wet_length: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Commands:
    """What the actuators are told; each sample is held until the next, the last one to the end.

    Attributes:
        time: starts at 0 and increases. Shape (samples,). [s]
        values: propeller [rev/s], rudder [rad], port and starboard stern-plane [rad]. Shape (samples, 4).
    """

    time: np.ndarray
    values: np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """A prescribed motion of an idealised vehicle (section 4.1 of the paper), linear between the samples.

    Sway, heave and roll are zero; pitch and yaw rates are the slopes of pitch and heading. After the last
    sample the last values hold.

    Attributes:
        time: starts at 0 and increases. Shape (samples,). [s]
        surge_speed: u. Shape (samples,). [m/s]
        pitch: θ, positive nose up. Shape (samples,). [rad]
        heading: ψ, clockwise from north. Shape (samples,). [rad]
    """

    time: np.ndarray
    surge_speed: np.ndarray
    pitch: np.ndarray
    heading: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Profile:
    """A current that changes with depth, linear between the depths; beyond them the first and the last value hold.

    Attributes:
        depth: increasing, positive down, of the water and not of the drum. [m]
        velocity: north, east, down at each depth, added to the uniform current. [m/s]
    """

    depth: tuple[float, ...]
    velocity: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, kw_only=True)
class Winch:
    """What turns the drum, linear between the times; after the last one the last value holds.

    Attributes:
        control: one of `CONTROLS`.
        time: starts at 0 and increases; none for a brake. [s]
        setpoint: rate at which cable comes off, negative to reel in [m/s]; or the tension at the drum [N].
    """

    control: str
    time: tuple[float, ...] = ()
    setpoint: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Vessel:
    """How the drum moves, linear between the times; after the last one the last velocity holds.

    Attributes:
        time: starts at 0 and increases. [s]
        velocity: north, east, down at each time, over ground. [m/s]
    """

    time: tuple[float, ...]
    velocity: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A vehicle on a cable in water, and what it is told to do; one of `commands` and `motion` is None.

    Attributes:
        name: name of the shipped scenario, or of the user's file without its ending.
        description: one line.
        text: the TOML source, for the record.
        source: the scenario as the user named it, name or path.
        duration: how long the run lasts, a whole number of cable steps. [s]
        hull_step: time step of the vehicle. [s]
        cable_step: time step of the cable and of the exchange, a whole number of hull steps. [s]
        segment_length: length of a cable segment, at the vehicle. [m]
        grading: segments get longer by this much per metre of cable from the vehicle. [-]
        scheme: one of `SCHEMES`.
        start: how the vehicle lies at t = 0.
        vehicle: section → key → SI value; sections may hold sections.
        cable: key → SI value, the fields of ``cable.CableProperties``.
        drum: key → SI value, the fields of ``cable.DrumProperties``.
        current: velocity of the water, north, east, down, the same everywhere. [m/s]
        profile: what is added to it by depth.
        winch: what turns the drum; None for a free drum.
        vessel: how the drum moves; None for a drum on the shore.
        commands: what the actuators are told.
        motion: the prescribed motion.
    """

    name: str
    description: str
    text: str
    source: str
    duration: float
    hull_step: float = 0.02
    cable_step: float = 0.1
    segment_length: float = 0.5
    grading: float = 0.0
    scheme: str = "moving_end"
    start: Start
    vehicle: Mapping[str, Any]
    cable: Mapping[str, float]
    drum: Mapping[str, float]
    current: tuple[float, float, float] = (0.0, 0.0, 0.0)
    profile: Profile | None = None
    winch: Winch | None = None
    vessel: Vessel | None = None
    commands: Commands | None = None
    motion: Motion | None = None
