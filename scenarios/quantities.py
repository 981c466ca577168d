"""The one table of the numbers of a trial file: with unit, limits, default and meaning, and the words.

The unit is part of the name, as in ``hull_step_s``. Limits are hard: a number outside is a slip of the pen or
of the unit, and is refused. A quantity without a default must be given. The TOML reader, the CSV reader and
every message read this table; to add a number, add a row here and use it in `scenarios.reader`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

ROUNDING = 1e-12
"""A number given in degrees in a file may be beyond its limit by this rounding. [-]"""
INNER = {"degree": math.pi / 180.0, "degree/s": math.pi / 180.0}
"""Inner units per unit of a file: radians inside; all other units are kept."""


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One number: its name in files, its unit there, and its limits.

    Attributes:
        name: name of the key or of the column, with its unit.
        unit: unit in files.
        low: least allowed value, in that unit.
        high: greatest allowed value, in that unit.
        default: taken where the number is not given; None if it must be given.
        meaning: in words, with its sign.
        many: whether it is a list of numbers, one value a sample; a default then means that it may be left out.
    """

    name: str
    unit: str
    low: float
    high: float
    default: float | None
    meaning: str
    many: bool = False

    @property
    def scale(self) -> float:
        """Inner units per unit of the file."""
        return INNER.get(self.unit, 1.0)

    @cached_property
    def inner_limits(self) -> tuple[float, float]:
        """Least and greatest value in inner units, with a margin for the rounding of numbers given in degrees in a
        file.
        """
        low, high = self.low * self.scale, self.high * self.scale
        return low - ROUNDING * abs(low), high + ROUNDING * abs(high)

    @property
    def allowed(self) -> str:
        """The allowed values, as a sentence for a message."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        return f"Allowed: {self.low:g} to {self.high:g}{unit} ({self.meaning})."


def _read(table: str, *, many: bool = False) -> tuple[Quantity, ...]:
    """Turn the rows of a table, ``name | unit | low | high | default | meaning``, into quantities."""
    rows = [[cell.strip() for cell in line.split("|")] for line in table.strip().splitlines()]
    return tuple(
        Quantity(
            name=name,
            unit=unit,
            low=float(low),
            high=float(high),
            default=float(default) if default else None,
            meaning=meaning,
            many=many,
        )
        for name, unit, low, high, default, meaning in rows
    )


RUN = _read("""
duration_s       | s | 0.001  | 86400 |      | how long the run lasts
hull_step_s      | s | 0.0001 | 1     | 0.02 | time step of the vehicle
cable_step_s     | s | 0.0001 | 10    | 0.1  | time step of the cable
segment_length_m | m | 0.001  | 100   | 0.5  | length of a cable segment
grading          | 1 | 0      | 0.5   | 0    | how much longer segments get per metre of cable from the vehicle
far_length_m     | m | 0      | 100000 | 40  | farther from both ends of the cable, segments are joined to longer ones
far_grading      | 1 | 0      | 0.5   | 0.2  | by how much longer per metre of cable beyond; 0: none are joined
every_s          | s | 0      | 86400 | 0    | time between kept results, whole cable steps; 0: all, fewer of long runs
rtol             | 1 | 0      | 0.5   | 0.02 | error of the tow force that is allowed, as a share of its largest; 0: any
budget_s         | s | 0      | 86400 | 0    | time for finer runs where it errs by more; 0: ten times the run's, or 2 s
""")

START = _read("""
heading_deg     | degree | -360   | 360   | 0 | heading, clockwise from north
pitch_deg       | degree | -90    | 90    | 0 | pitch, positive nose up
roll_deg        | degree | -180   | 180   | 0 | roll, positive starboard side down
depth_m         | m      | 0      | 11000 | 0 | depth of the hull centre, positive down
surge_speed_m_s | m/s    | -20    | 20    | 0 | forward speed over ground
sway_speed_m_s  | m/s    | -20    | 20    | 0 | speed over ground to starboard
heave_speed_m_s | m/s    | -20    | 20    | 0 | speed over ground along the body's down axis
roll_rate_deg_s  | degree/s | -720 | 720 | 0 | roll rate, positive: the starboard side goes down
pitch_rate_deg_s | degree/s | -720 | 720 | 0 | pitch rate, positive: the nose goes up
yaw_rate_deg_s   | degree/s | -720 | 720 | 0 | yaw rate, positive to starboard
propeller_speed_rps | rev/s | -200 | 200 | 0 | propeller speed, positive drives forward
rudder_angle_deg | degree | -90 | 90 | 0 | where the rudder stands, positive turns to starboard
stern_plane_port_angle_deg | degree | -90 | 90 | 0 | where the port stern-plane stands, positive raises the nose
stern_plane_starboard_angle_deg | degree | -90 | 90 | 0 | where the starboard one stands, positive raises the nose
wet_length_m    | m      | 0      | 10000 | 0 | cable already in the water, laid straight
drum_north_m    | m      | -10000 | 10000 | 0 | drum from the tow point, northwards; the cable hangs between them
drum_east_m     | m      | -10000 | 10000 | 0 | the same, eastwards
drum_down_m     | m      | -10000 | 10000 | 0 | the same, downwards; all three 0: the cable is laid straight
""")

WATER = _read("""
current_north_m_s | m/s | -5 | 5 | 0 | velocity of the water to the north
current_east_m_s  | m/s | -5 | 5 | 0 | velocity of the water to the east
current_down_m_s  | m/s | -5 | 5 | 0 | velocity of the water downwards
""")

BED = _read("""
sea_bed_m | m | 0 | 11000 | 0 | depth of a flat sea bed that the cable lies on, positive down; 0: none
""")

PROFILE = _read(
    """
depth_m             | m   | 0  | 11000 | 0 | depths of a profile that is added to the current, positive down
profile_north_m_s   | m/s | -5 | 5     | 0 | velocity of the water to the north at these depths
profile_east_m_s    | m/s | -5 | 5     | 0 | velocity of the water to the east at these depths
profile_down_m_s    | m/s | -5 | 5     | 0 | velocity of the water downwards at these depths
""",
    many=True,
)

WINCH = _read(
    """
time_s           | s   | 0    | 86400 | 0 | time since the start
pay_out_rate_m_s | m/s | -10  | 10    | 0 | rate at which cable comes off the drum, negative reels in
tension_N        | N   | 0.01 | 1e6   | 0 | tension at the drum, which a winch can keep
""",
    many=True,
)

VESSEL = _read(
    """
time_s             | s   | 0   | 86400 |   | time since the start
velocity_north_m_s | m/s | -20 | 20    | 0 | velocity of the vessel to the north
velocity_east_m_s  | m/s | -20 | 20    | 0 | velocity of the vessel to the east
velocity_down_m_s  | m/s | -20 | 20    | 0 | velocity of the vessel downwards
""",
    many=True,
)

STATION = _read("""
bandwidth_rad_s | rad/s | 0.01 | 10 | 0.8 | how fast station keeping answers, its natural frequency
""") + _read(
    """
time_s      | s      | 0      | 86400 | 0 | time since the start
north_m     | m      | -1e6   | 1e6   | 0 | place to hold, northwards of the start
east_m      | m      | -1e6   | 1e6   | 0 | the same, eastwards
depth_m     | m      | 0      | 11000 | 0 | depth to hold, positive down
heading_deg | degree | -36000 | 36000 | 0 | heading to hold, clockwise from north; it goes on beyond full turns
""",
    many=True,
)

COMMANDS = _read(
    """
time_s                   | s      | 0    | 86400 |   | time since the start
propeller_rps            | rev/s  | -200 | 200   |   | propeller speed, positive drives forward
rudder_deg               | degree | -90  | 90    |   | rudder, positive turns to starboard
stern_plane_port_deg     | degree | -90  | 90    |   | port stern-plane, positive raises the nose
stern_plane_starboard_deg | degree | -90 | 90    |   | starboard stern-plane, positive raises the nose
""",
    many=True,
)

MOTION = _read(
    """
time_s          | s      | 0      | 86400 |  | time since the start
surge_speed_m_s | m/s    | -20    | 20    |  | forward speed
pitch_deg       | degree | -89    | 89    |  | pitch, positive nose up
heading_deg     | degree | -36000 | 36000 |  | heading, clockwise from north
sway_speed_m_s  | m/s    | -20    | 20    | 0 | speed to starboard
heave_speed_m_s | m/s    | -20    | 20    | 0 | speed along the body's down axis
roll_deg        | degree | -36000 | 36000 | 0 | roll, positive starboard side down
roll_rate_deg_s  | degree/s | -720 | 720 | 0 | roll rate, positive: the starboard side goes down
pitch_rate_deg_s | degree/s | -720 | 720 | 0 | pitch rate, positive: the nose goes up
yaw_rate_deg_s   | degree/s | -720 | 720 | 0 | yaw rate, positive to starboard
north_m         | m      | -1e6   | 1e6   | 0 | place of the hull centre, northwards
east_m          | m      | -1e6   | 1e6   | 0 | place of the hull centre, eastwards
depth_m         | m      | -100   | 11000 | 0 | depth of the hull centre, positive down
""",
    many=True,
)


KNOWN = _read("""
length_m            | m     | 0.05   | 50    | 0 | length over all
diameter_m          | m     | 0.01   | 10    | 0 | largest diameter
mass_kg             | kg    | 0.01   | 1e6   | 0 | mass with everything inside
net_buoyancy_N      | N     | -1e5   | 1e5   | 0 | buoyancy minus weight
speed_m_s           | m/s   | 0.01   | 20    | 0 | speed straight ahead, at propeller_rps if that is known
propeller_rps       | rev/s | 0.01   | 200   | 0 | command of the propeller at speed_m_s
propeller_diameter_m | m    | 0.005  | 5     | 0 | diameter of the propeller
fin_area_m2         | m2    | 1e-5   | 10    | 0 | plan area of one exposed fin; rudders and stern-planes alike
fin_station_m       | m     | -50    | 50    | 0 | centre of pressure of the fins, forward of the hull centre
tail_angle_deg      | degree | 0     | 89    | 0 | how far the tail is turned from a cross; 45: fins in X
tow_station_m       | m     | -50    | 50    | 0 | tow point, forward of the hull centre
water_density_kg_m3 | kg/m3 | 900    | 1100  | 0 | density of the water that it is ballasted for
""")
"""What a vehicle file may say of a vehicle that is like a shipped one: `scenarios.similar_vehicle`."""


def by_field(quantities: tuple[Quantity, ...]) -> dict[str, Quantity]:
    """Return quantities by the names of the fields that hold them, ``hull_step_s`` → ``hull_step``."""
    suffixes = {"1": "", "m/s": "_m_s", "degree": "_deg", "degree/s": "_deg_s", "rev/s": "_rps"}
    return {q.name.removesuffix(suffixes.get(q.unit, f"_{q.unit}")): q for q in quantities}


SECTIONS = {
    "run": RUN,
    "start": START,
    "water": WATER + BED + PROFILE,
    "winch": WINCH,
    "vessel": VESSEL,
    "station": STATION,
    "commands": COMMANDS,
    "motion": MOTION,
}
"""Section of a trial file → the numbers it may hold."""

SCHEMES = ("moving_end", "paper", "paper_tangent", "paper_drum")
"""How the cable is solved: our moving end, or the paper's scheme, with either reading of its new node
("paper" is the usable one, "paper_tangent")."""

CONTROLS = ("pay_out_rate", "constant_tension", "brake")
"""Controls of a winch; without a winch the drum is free, and the cable is pulled off it."""

LINEAR, SMOOTH = INTERPOLATIONS = ("linear", "smooth")
"""Interpolations of a motion between its samples: straight lines with kinks, or curves without."""
