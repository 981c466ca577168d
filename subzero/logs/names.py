"""What loggers call a channel, and how they write its unit: two tables, and the way a name is looked up in them.

A name is cut into words, ``NAV_HEADING`` → nav heading, ``depth[cm]`` → depth in cm, ``yaw_rad`` → yaw in rad. Words of
a message or a sensor before it, and numbers of instances, do not count. Only whole names of the table are recognised:
``DesYaw`` is no heading. Where one logger always writes one unit, the table has it behind a colon.

To add a name or a unit, add it to its table.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

from subzero.channels import BY_COLUMN, BY_NAME, TIME

LATITUDE, LONGITUDE, PRESSURE = "latitude", "longitude", "pressure"
"""What becomes north, east and depth."""


class Unit(NamedTuple):
    """A unit that loggers use: what is written times `factor`, plus `offset`, is in the channel's unit."""

    factor: float
    offset: float = 0.0
    words: str = ""


_DEGREES = 57.29577951308232
_METRES_A_DBAR = 1e4 / (1025.0 * 9.81)
"""Depth that adds one dbar to the pressure in sea water of 1025 kg/m³; 2.5 % less than in fresh water. [m]"""
_AIR_DBAR = 10.1325


def _absolute(dbar: float, words: str) -> Unit:
    """Return a unit of a pressure that counts from a vacuum."""
    return Unit(dbar * _METRES_A_DBAR, -_AIR_DBAR * _METRES_A_DBAR, words)


UNITS: dict[str, dict[str, Unit]] = {
    "m": {
        "m": Unit(1.0, words="metre meter metres meters mtr"),
        "ft": Unit(0.3048, words="feet foot"),
        "cm": Unit(0.01, words="centimetre centimeter centimetres centimeters"),
        "mm": Unit(0.001, words="millimetre millimeter"),
        "km": Unit(1000.0),
        "m up": Unit(-1.0),
        "ft up": Unit(-0.3048),
    },
    "m/s": {
        "m/s": Unit(1.0, words="mps m_s m_per_s ms-1 m.s-1 ms^-1 meter/s metres/s"),
        "kn": Unit(1852.0 / 3600.0, words="kt kts knot knots"),
        "km/h": Unit(1.0 / 3.6, words="kmh kph km_h"),
        "ft/s": Unit(0.3048, words="fps ft_s"),
        "cm/s": Unit(0.01, words="cm_s cms-1 cmps"),
        "mm/s": Unit(0.001, words="mm_s"),
    },
    "degree": {
        "degree": Unit(1.0, words="deg degrees ° º grad"),
        "rad": Unit(_DEGREES, words="radian radians"),
        "centidegree": Unit(0.01, words="cdeg centidegrees centideg"),
        "mrad": Unit(_DEGREES / 1000.0, words="milliradian"),
    },
    "degree/s": {
        "degree/s": Unit(1.0, words="deg/s deg_s dps °/s º/s degrees/s degs-1 deg/sec"),
        "rad/s": Unit(_DEGREES, words="rad_s rads-1 radian/s radians/s rad/sec"),
        "mrad/s": Unit(_DEGREES / 1000.0, words="mrad_s"),
    },
    "rev/s": {
        "rev/s": Unit(1.0, words="rps 1/s hz"),
        "rpm": Unit(1.0 / 60.0, words="1/min rev/min r/min"),
        "rad/s": Unit(_DEGREES / 360.0, words="rad_s"),
    },
    "V": {"V": Unit(1.0, words="volt volts"), "mV": Unit(0.001, words="millivolt")},
    "N": {"N": Unit(1.0, words="newton"), "kN": Unit(1000.0), "kgf": Unit(9.80665, words="kg"), "lbf": Unit(4.44822, words="lb lbs")},
    "N m": {"N m": Unit(1.0, words="nm n_m n*m")},
    "J": {"J": Unit(1.0, words="joule"), "Wh": Unit(3600.0)},
    LATITUDE: {
        "degree": Unit(1.0, words="deg degrees ° degrees_north degrees_east"),
        "degE7": Unit(1e-7, words="1e-7deg dege-7 degx1e7"),
        "ddmm.mmmm": Unit(1.0, words="ddmm dddmm.mmmm nmea"),
        "rad": Unit(_DEGREES, words="radian radians"),
    },
    PRESSURE: {
        "dbar": Unit(_METRES_A_DBAR, words="decibar"),
        "bar": Unit(10.0 * _METRES_A_DBAR),
        "hPa absolute": _absolute(0.01, "hpa mbar millibar"),
        "Pa absolute": _absolute(1e-4, "pa pascal"),
        "kPa absolute": _absolute(0.1, "kpa"),
        "psi": Unit(0.689476 * _METRES_A_DBAR),
    },
}  # fmt: skip
"""Display unit of a channel → unit that a logger may use."""
UNITS[LONGITUDE] = UNITS[LATITUDE]

RARE = ("mm", "km", "mm/s", "mrad", "mrad/s", "psi")
"""Units that are only believed where a name says so."""

LIMITS = {
    "m": 12_000.0, "m/s": 30.0, "degree": 720.0, "degree/s": 720.0, "rev/s": 200.0, "V": 1000.0,
    LATITUDE: 90.0, LONGITUDE: 360.0, PRESSURE: 12_000.0,
}  # fmt: skip
"""Display unit → no underwater vehicle measures more: depth of the deepest sea, two turns, poles of the earth."""

_NAMES: Mapping[str, str] = {
    "heading": """heading hdg yaw psi compass compass_heading true_heading heading_true c_true_heading magnetic_heading
        c_magnetic_heading mag_heading nav_heading:degree att_yaw:degree vfr_hud_heading:degree attitude_yaw:rad
        m_heading:rad eng_head:degree head kurs""",
    "pitch": """pitch theta pitch_angle angle_pitch nav_pitch:rad att_pitch:degree attitude_pitch:rad m_pitch:rad
        eng_pitch_ang:degree trim""",
    "roll_angle": """roll phi heel roll_angle angle_roll nav_roll:rad att_roll:degree attitude_roll:rad m_roll:rad
        eng_roll_ang:degree""",
    "depth": """depth nav_depth:m dfs_depth m_depth:m ctun_b_alt:m_up depth_m_from_surface tiefe water_depth_of_vehicle
        z nav_z:m_up alt_rel relative_alt rel_alt baro_alt:m_up ctun_alt:m_up vfr_hud_alt:m_up""",
    "surge_speed": """surge_speed speed velocity stw speed_through_water nav_speed:m/s u surge forward_speed
        speed_forward log_speed water_speed est_velocity fahrt airspeed""",
    "sway_speed": "sway_speed sway v speed_starboard",
    "heave_speed": "heave_speed heave w speed_down",
    "speed_over_ground": """speed_over_ground sog nav_sog:m/s gps_speed ground_speed groundspeed gnd_speed
        vfr_hud_groundspeed:m/s""",
    "yaw_rate": "yaw_rate yawrate r yaw_speed yawspeed attitude_yawspeed:rad/s heading_rate turn_rate rot gyro_z gyr_z drehrate nav_yaw_rate",
    "pitch_rate": "pitch_rate pitchrate q pitch_speed pitchspeed attitude_pitchspeed:rad/s gyro_y gyr_y",
    "roll_rate": "roll_rate rollrate p roll_speed rollspeed attitude_rollspeed:rad/s gyro_x gyr_x",
    "north": "north northing pos_north position_north y_north nav_y:m local_position_ned_x:m",
    "east": "east easting pos_east position_east x_east nav_x:m local_position_ned_y:m",
    LATITUDE: "latitude lat nav_lat:degree gps_lat m_gps_lat:ddmm.mmmm global_position_int_lat:degE7 lat_deg_e:degE7",
    LONGITUDE: """longitude lon lng long nav_long:degree gps_lng gps_lon m_gps_lon:ddmm.mmmm
        global_position_int_lon:degE7 lon_deg_e:degE7""",
    PRESSURE: "pressure press press_abs baro_press:pa_absolute scaled_pressure_press_abs:hpa_absolute p_abs",
    "propeller_speed": "propeller_speed shaft_speed motor_speed rpm:rpm rps:rev/s propeller_rpm:rpm prop_rpm:rpm motor_rpm:rpm thruster_rpm:rpm",
    "rudder_angle": "rudder rudder_angle rudder_position",
    "rudder_command": "rudder_command rudder_cmd cmd_rudder desired_rudder:degree",
    "propeller_command": "propeller_command propeller_cmd motor_speed_cmd cmd_rpm:rpm",
    "cable_tension": "tension cable_tension tether_tension load_cell line_tension",
    "cable_length": "cable_length tether_length cable_out tether_out payout",
    "battery_voltage": "battery_voltage voltage battery volt volts batt_volt:v bat_volt:v battery_voltage_v",
}  # fmt: skip

PREFIXES = frozenset("""nav att ahr ahrs ekf imu gps ctd dvl vehicle auv rov uuv ins vfr hud attitude baro ctun est
    estimated measured sensor state pose pos data vru compass filtered xkf nkf local position odom navigation m vd
    scaled pressure log eng""".split())  # fmt: skip
"""Words before a name that say which message or sensor it is of."""

TIME_NAMES = """time_s time timestamp t datetime date_time utc utc_time time_utc epoch unix unix_time unixtime time_us
    timeus time_ms time_boot_ms time_boot time_unix_usec time_usec time_ns stamp secs seconds sec elapsed elapsed_time
    datenum m_present_time zeit zeitstempel uhrzeit clock gps_time date datum header_stamp log_time""".split()
"""Names of times, the most telling first."""
_TIME_WORDS = {"us": "us", "usec": "us", "timeus": "us", "ms": "ms", "msec": "ms", "ns": "ns", "nsec": "ns", "s": "s",
               "sec": "s", "secs": "s", "seconds": "s", "epoch": "", "datenum": "datenum", "µs": "us", "min": "min"}  # fmt: skip


def _spelling(unit: str) -> str:
    """Return a unit as it is looked up: small, without blanks, with one sign for micro and for a degree."""
    return re.sub(r"[\s_]+", "", unit.lower().replace("μ", "µ").replace("º", "°").replace("**", "^"))


def _spellings() -> dict[tuple[str, str], str]:
    found = {}
    for kind, units in UNITS.items():
        for name, unit in units.items():
            for word in (name, *unit.words.split()):
                found[kind, _spelling(word)] = name
    return found


SPELLINGS = _spellings()
"""(Display unit, spelling) → unit."""
_ALL_SPELLINGS = (
    {spelling for _, spelling in SPELLINGS} | {_spelling(word) for word in _TIME_WORDS} | {"-", "1", "%"}
)


def _known_names() -> dict[str, tuple[str, str, int]]:
    """Return name → channel, the unit that its logger writes, and its rank among the names of the channel."""
    found = {}
    for channel, text in _NAMES.items():
        for rank, entry in enumerate(text.split()):
            name, _, unit = entry.partition(":")
            found[name] = channel, unit and SPELLINGS[kind_of(channel), _spelling(unit)], rank
    return found


def kind_of(channel: str) -> str:
    """Return where the units of a channel stand in `UNITS`: its display unit, or its own name."""
    return channel if channel in UNITS else BY_NAME[channel].unit


KNOWN = _known_names()


class Named(NamedTuple):
    """What a name says: channel, unit (empty: nothing), why, and its rank; a lower one is the better measurement."""

    channel: str
    unit: str
    reason: str
    rank: int


def is_unit(text: str) -> bool:
    """Say whether a text is a unit that is known."""
    return _spelling(text.strip("[]() ")) in _ALL_SPELLINGS


def unit_of(kind: str, text: str) -> str:
    """Return the unit in `UNITS` that a text means; empty if none."""
    return SPELLINGS.get((kind, _spelling(text.strip("[]() "))), "")


def words_of(name: str) -> list[str]:
    """Return the words of a name in small letters: parted by signs, capitals and numbers, which are left out."""
    return [word.lower() for word in re.findall(r"[A-ZÄÖÜ]?[a-zäöü]+|[A-ZÄÖÜ]+(?![a-z])", name)]


def recognised(name: str, unit: str = "") -> Named | None:
    """Return what the name of a column, and the unit that the file has for it, say; None if no channel.

    Args:
        name: as the logger wrote it.
        unit: of a row of units, or an attribute; empty if there is none.
    """
    if name in BY_COLUMN and name != TIME.column:
        channel = BY_COLUMN[name]
        return Named(channel.name, unit_of(channel.unit, unit) or channel.unit, "name", 0)
    plain, bracket = (
        re.sub(r"[\[(][^\])]*[^\d\])][^\])]*[\])]?", " ", name),
        re.search(r"[\[(]([^\])]*[^\d\])][^\])]*)", name),
    )
    words, written = words_of(plain), unit or (bracket.group(1) if bracket else "")
    for cut in (0, 1, 2):  # the last words may be a unit
        known = _looked_up(words[: len(words) - cut])
        if known is None:
            continue
        channel, usual, rank = known
        ending = (
            unit_of(kind_of(channel), "".join(words[-cut:]) if cut == 1 else "/".join(words[-cut:]))
            if cut
            else ""
        )
        if cut and not ending:
            continue
        stated = unit_of(kind_of(channel), written) or ending
        reason = (
            "unit in the file"
            if unit and stated
            else "unit in the name"
            if stated
            else "name of its logger"
            if usual
            else "name"
        )
        return Named(channel, stated or usual, reason, rank)
    return None


def _looked_up(words: list[str]) -> tuple[str, str, int] | None:
    """Return what stands in the table for some words, without those of a message before them."""
    while words:
        key = "_".join(words)
        if key in KNOWN:
            return KNOWN[key]
        if key in BY_NAME and key != TIME.name:
            return key, "", 0
        if words[0] not in PREFIXES:
            return None
        words = words[1:]
    return None


def time_name(name: str) -> tuple[int, str] | None:
    """Return the rank of a name among those of times, and the unit in it; None if it is no time."""
    words = words_of(re.sub(r"[\[(].*", "", name))
    bracket = re.search(r"[\[(]\s*([a-zµμ]+)", name)
    unit = _TIME_WORDS.get(bracket.group(1).replace("μ", "µ") if bracket else words[-1] if words else "", "")
    for start in range(len(words)):
        rest = words[start:]
        for key in ("_".join(rest), "_".join(rest[:-1]) if len(rest) > 1 and rest[-1] in _TIME_WORDS else ""):
            if key in TIME_NAMES and set(words[:start]) <= PREFIXES | {
                "unix",
                "gps",
                "boot",
                "header",
                "utc",
            }:
                return TIME_NAMES.index(key), unit
    return None
