"""The one table of channels: every number that a run gives at every time, by name.

A channel has one name everywhere: in the dataset (`surge_speed`), in a CSV file with its unit behind it
(`surge_speed_m_s`), in a measured record, a figure, a report. Results carry the *display* unit of this table
(degrees, rev/s), so the numbers in a file are those in a figure; ``scale`` converts to it from SI.

Signs: axes are north-east-down for the earth and forward-starboard-down for the body. Depth is positive
down, heading runs clockwise from north and is continuous (no jump at 360 degrees), a positive rudder
turns the heading clockwise, positive stern-planes raise the nose. Forces and moments of the cable are
those *on the vehicle*, and moments are about the hull centre.

To add a channel, add a row here and fill it in `subzero.results.dataset.channel_values`; files, records and reports
follow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, runtime_checkable

DEGREE = 180.0 / math.pi
REVOLUTION = 1.0

UNITS: dict[str, tuple[str, float]] = {
    "s": ("s", 1.0),
    "m": ("m", 1.0),
    "m/s": ("m_s", 1.0),
    "degree": ("deg", DEGREE),
    "degree/s": ("deg_s", DEGREE),
    "rev/s": ("rps", REVOLUTION),
    "V": ("V", 1.0),
    "N": ("N", 1.0),
    "N m": ("N_m", 1.0),
    "J": ("J", 1.0),
    "m3": ("m3", 1.0),
    "1": ("", 1.0),
}
"""Display unit → (suffix of the CSV column, display units per unit used inside: SI, but rev/s)."""


STANDARD_NAMES = {
    "depth": "depth",
    "roll_angle": "platform_roll_starboard_down",
    "pitch": "platform_pitch_fore_up",
    "heading": "platform_orientation",
    "speed_over_ground": "platform_speed_wrt_ground",
}
"""Channel → its name in the CF conventions. Theirs for rates are about the horizontal, not about the body's axes."""


COLUMN_STEMS = {"roll_angle": "roll"}
"""Channel → name of its column without the unit, where that is not its own name.

``run.roll`` is a method of xarray, so the variable is ``roll_angle``; the column ``roll_deg`` hides nothing, and is
kept.
"""

RENAMED_CHANNELS = {"roll": "roll_angle"}
"""Name of a channel in version 0.2 → its name today."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Channel:
    """One scalar that a run gives at every time.

    Args:
        name: name in datasets and in the API.
        unit: display unit, in which results carry it.
        symbol: symbol of the source, for the axis of a figure (matplotlib mathtext).
        long_name: its name in words, with its sign where there are two.
    """

    name: str
    unit: str
    symbol: str
    long_name: str

    @property
    def suffix(self) -> str:
        """The unit as the end of a column name, such as ``m_s``."""
        return UNITS[self.unit][0]

    @property
    def scale(self) -> float:
        """Display units per inner unit: multiply a number of the simulation by this."""
        return UNITS[self.unit][1]

    @property
    def column(self) -> str:
        """Name of the CSV column, such as ``surge_speed_m_s``."""
        return f"{COLUMN_STEMS.get(self.name, self.name)}_{self.suffix}".removesuffix("_")

    @property
    def attributes(self) -> dict[str, str]:
        """The attributes of a variable of a dataset: units, long name, symbol, and CF's standard name where it has
        one.
        """
        named = {"standard_name": STANDARD_NAMES[self.name]} if self.name in STANDARD_NAMES else {}
        return {"units": self.unit, "long_name": self.long_name, "symbol": self.symbol, **named}


def _read(table: str) -> tuple[Channel, ...]:
    """Turn the rows of a table, ``name | unit | symbol | long name``, into channels."""
    rows = [line for line in table.strip().splitlines() if not line.startswith("#")]
    cells = [[cell.strip() for cell in row.split("|")] for row in rows]
    return tuple(
        Channel(name=name, unit=unit, symbol=sym, long_name=words) for name, unit, sym, words in cells
    )


(TIME,) = _read("time | s | t | time since the start")

CHANNELS: tuple[Channel, ...] = _read(r"""
# where the vehicle is, and how it lies
north                         | m        | x           | position, north
east                          | m        | y           | position, east
depth                         | m        | z           | depth of the hull centre, positive down
roll_angle                    | degree   | \phi        | roll angle, positive starboard side down
pitch                         | degree   | \theta      | pitch angle, positive nose up
heading                       | degree   | \psi        | heading, clockwise from north, continuous
# how the hull centre moves, over ground, in body axes
surge_speed                   | m/s      | u           | forward speed
sway_speed                    | m/s      | v           | speed to starboard
heave_speed                   | m/s      | w           | speed along the body's down axis
roll_rate                     | degree/s | p           | roll rate
pitch_rate                    | degree/s | q           | pitch rate, positive nose going up
yaw_rate                      | degree/s | r           | yaw rate, positive to starboard
speed_over_ground             | m/s      | U_g         | speed over ground, never negative
# what the actuators do, and what they were told to do
propeller_speed               | rev/s    | n           | propeller speed
rudder_angle                  | degree   | \delta_r    | rudder angle, positive turns to starboard
stern_plane_port_angle        | degree   | \delta_p    | port stern-plane, positive: nose up
stern_plane_starboard_angle   | degree   | \delta_s    | starboard stern-plane, positive: nose up
battery_voltage               | V        | U           | battery voltage
propeller_command             | rev/s    | n_c         | propeller command
rudder_command                | degree   | \delta_{rc} | rudder command, positive turns to starboard
stern_plane_port_command      | degree   | \delta_{pc} | port stern-plane command, positive: nose up
stern_plane_starboard_command | degree   | \delta_{sc} | starboard stern-plane command, likewise
# the cable, and what it does to the vehicle
cable_tension                 | N        | T(0)        | cable tension at the tow point
drum_tension                  | N        | T(S)        | cable tension at the drum
cable_length                  | m        | S           | length of cable that has left the drum
cable_force_forward           | N        | F_{cX}      | force of the cable on the vehicle, forward
cable_force_starboard         | N        | F_{cY}      | force of the cable on the vehicle, to starboard
cable_force_down              | N        | F_{cZ}      | force of the cable on the vehicle, body's down axis
cable_moment_roll             | N m      | M_{cX}      | roll moment of the cable, positive to starboard
cable_moment_pitch            | N m      | M_{cY}      | pitch moment of the cable, positive nose up
cable_moment_yaw              | N m      | M_{cZ}      | yaw moment of the cable, positive to starboard
tow_velocity_tangential       | m/s      | V_t         | tow point's speed along the cable (negative: out)
tow_velocity_normal           | m/s      | V_n         | tow point's speed along the cable's normal
tow_velocity_binormal         | m/s      | V_b         | tow point's speed along the cable's binormal
# energy since the start
energy_propeller_work         | J        | W_p         | work of the propulsion (propeller, thrusters) on the hull
energy_hull_loss              | J        | E_h         | energy lost in the water by hull and fins
energy_cable_loss             | J        | E_c         | energy lost in the water by the cable
energy_kinetic_change         | J        | \Delta E_k  | change of kinetic and potential energy
energy_drum                   | J        | E_d         | energy left at the drum
energy_added_mass_term        | J        | E_m         | energy by the cable's added-mass form
energy_residual               | J        | E_r         | energy that the balance leaves unexplained
""")

ENERGY_CHANNELS = tuple(channel.name for channel in CHANNELS if channel.name.startswith("energy_"))
"""In the order of `subzero.engine.energy`."""

BY_NAME: dict[str, Channel] = {channel.name: channel for channel in (TIME, *CHANNELS)}
BY_COLUMN: dict[str, Channel] = {channel.column: channel for channel in (TIME, *CHANNELS)}


def column_name(name: str) -> str:
    """Return the CSV column of a channel: its name with its unit, ``surge_speed`` → ``surge_speed_m_s``.

    Raises:
        KeyError: if the table has no such channel.
    """
    return BY_NAME[name].column


@runtime_checkable
class AnyRun(Protocol):
    """A run by the names of its variables: the dataset of `subzero.simulate`, or a
    `subzero.results.dataset.PlainRun`.
    """

    @property
    def attrs(self) -> dict[Any, Any]:
        """Its provenance, its outcome, and the warnings."""

    def __getitem__(self, name: str, /) -> Any:
        """Return a variable; its ``values`` are an array."""


class Observation(NamedTuple):
    """The true values at one time, by the names of `CHANNELS`, in SI units, radians and rev/s.

    The roll angle is `roll` here, ``roll_angle`` there, where `roll` is a method of xarray. The heading is continuous:
    no jump at a full turn. Forces and moments of the cable are those on the hull, body axes.
    """

    time: float
    north: float
    east: float
    depth: float
    roll: float
    pitch: float
    heading: float
    surge_speed: float
    sway_speed: float
    heave_speed: float
    roll_rate: float
    pitch_rate: float
    yaw_rate: float
    propeller_speed: float
    rudder_angle: float
    stern_plane_port_angle: float
    stern_plane_starboard_angle: float
    battery_voltage: float
    cable_length: float
    cable_tension: float
    drum_tension: float
    cable_force_forward: float
    cable_force_starboard: float
    cable_force_down: float
    cable_moment_roll: float
    cable_moment_pitch: float
    cable_moment_yaw: float


HEADING = "heading"

LISTED = "listed_actuator"
"""Attribute of a variable that is the state or the command of a listed actuator: the name of its command."""


class Listed(Protocol):
    """The command of a listed actuator, such as a `vehicle.channels.Channel`."""

    @property
    def name(self) -> str:
        """Of the command."""

    @property
    def meaning(self) -> str:
        """In words."""

    @property
    def unit(self) -> str:
        """SI: 1, rad, m or m3."""


def listed_channels(command: Listed) -> tuple[Channel, Channel]:
    """Return the channels of the state and the command of a listed actuator: a fin's are angles in degrees."""
    unit = {"rad": "degree"}.get(command.unit, command.unit)
    symbol = rf"\mathrm{{{command.name.replace('_', '~')}}}"
    return (
        Channel(
            name=f"{command.name}_state", unit=unit, symbol=symbol, long_name=f"{command.meaning}, lagged"
        ),
        Channel(
            name=f"{command.name}_command",
            unit=unit,
            symbol=symbol,
            long_name=f"{command.meaning}, commanded",
        ),
    )


def channels_of(run: Any) -> tuple[Channel, ...]:
    """Return the channels that a run has: those of the table, then those of the listed actuators of its vehicle.

    Args:
        run: a dataset or a `subzero.results.dataset.PlainRun`.
    """
    variables = run.variables
    listed = [(str(name), values) for name, values in variables.items()]
    own = [
        Channel(name=name, unit=about["units"], symbol=about["symbol"], long_name=about["long_name"])
        for name, values in listed
        if LISTED in (about := values.attributes if hasattr(values, "attributes") else values.attrs)
    ]
    return (*(channel for channel in CHANNELS if channel.name in variables), *own)
