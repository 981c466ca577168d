"""Effects of rudders and stern-planes."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import degrees, radians

from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter


def rudder_lag(setting: Setting, seconds: float) -> Setting:
    """Time constant of the rudder servo + seconds."""
    return setting.with_vehicle(rudder_servo__lag=lambda old: max(old + seconds, 0.0))


def rudder_rate_limit(setting: Setting, slowness: float) -> Setting:
    """1/rate + slowness, in s/degree."""
    return setting.with_vehicle(rudder_servo__rate_limit=lambda old: 1.0 / (1.0 / old + degrees(slowness)))


def rudder_offset(setting: Setting, angle: float) -> Setting:
    """Rudder angle at zero command + angle."""
    return setting.with_vehicle(rudder_servo__offset=lambda old: old + radians(angle))


def rudder_lift_slope(setting: Setting, share: float) -> Setting:
    """C_Lα (1 + share)."""
    return setting.with_vehicle(rudder__lift_slope=lambda old: old * (1.0 + share))


def rudder_backlash(setting: Setting, half_gap: float) -> Setting:
    """Half the play of the linkage + half_gap."""
    return setting.with_vehicle(rudder_servo__half_backlash=lambda old: old + radians(half_gap))


def stern_plane_offset(setting: Setting, common: float, differential: float) -> Setting:
    """Plane angles at zero command: common to both, and starboard minus port over two."""
    return setting.with_vehicle(
        stern_plane_port_servo__offset=lambda old: old + radians(common - differential),
        stern_plane_starboard_servo__offset=lambda old: old + radians(common + differential),
    )


def _jam(servo: str, setting: Setting, lost: float, angle: float) -> Setting:
    """The servo loses a share of its command, and its fin has an offset by an angle."""
    changes: dict[str, Callable[[float], float]] = {
        f"{servo}__lost_command": lambda old: min(old + lost, 1.0),
        f"{servo}__offset": lambda old: old + radians(angle),
    }
    return setting.with_vehicle(**changes)


def _lag(setting: Setting) -> float:
    return setting.model.vehicle.rudder_servo.lag


def _slowness(setting: Setting) -> float:
    return 1.0 / degrees(setting.model.vehicle.rudder_servo.rate_limit)


def _offset(setting: Setting) -> float:
    return degrees(setting.model.vehicle.rudder_servo.offset)


def _half_gap(setting: Setting) -> float:
    return degrees(setting.model.vehicle.rudder_servo.half_backlash)


def _angle(name: str) -> Parameter:
    return Parameter(name=name, unit="degree", tolerance=0.15, scale=2.0, low=-20.0, high=20.0)


EFFECTS = (
    Effect(
        id="rudder_lag",
        sentence="the rudder servo lags",
        slot="fins",
        parameters=(
            Parameter(
                name="time_constant",
                unit="s",
                tolerance=0.03,
                scale=0.4,
                low=-0.09,
                high=5.0,
                least=0.06,
                nominal=_lag,
            ),
        ),
        apply=rudder_lag,
    ),
    Effect(
        id="rudder_rate_limit",
        sentence="the rudder servo turns slowly",
        slot="fins",
        parameters=(
            Parameter(
                name="inverse_rate",
                unit="s/degree",
                tolerance=0.004,
                scale=0.1,
                low=0.0,
                high=2.0,
                nominal=_slowness,
            ),
        ),
        apply=rudder_rate_limit,
    ),
    Effect(
        id="rudder_offset",
        sentence="the rudder is off its centre",
        slot="fins",
        parameters=(
            Parameter(
                name="angle", unit="degree", tolerance=0.15, scale=2.0, low=-20.0, high=20.0, nominal=_offset
            ),
        ),
        apply=rudder_offset,
        sudden=True,
    ),
    Effect(
        id="rudder_lift_slope",
        sentence="the rudder lifts more or less",
        slot="fins",
        parameters=(Parameter(name="share", unit="1", tolerance=0.03, scale=0.30, low=-0.95, high=3.0),),
        apply=rudder_lift_slope,
        sudden=True,
    ),
    Effect(
        id="rudder_backlash",
        sentence="the rudder linkage has play",
        slot="fins",
        parameters=(
            Parameter(
                name="half_gap",
                unit="degree",
                tolerance=0.05,
                scale=1.0,
                low=0.0,
                high=15.0,
                nominal=_half_gap,
            ),
        ),
        apply=rudder_backlash,
    ),
    Effect(
        id="stern_plane_offset",
        sentence="the stern-planes are off their centre",
        slot="fins",
        parameters=(_angle("common"), _angle("differential")),
        apply=stern_plane_offset,
        sudden=True,
    ),
)
"""To add one: a function (setting, deviation) → setting, and a line here."""


def _jammed(fin: str, servo: str, words: str, offset: str) -> Effect:
    """Return the jam of a fin, whose angle may also be an offset of it."""
    return Effect(
        id=f"{fin}_jam",
        sentence=f"{words} no longer follows its command: it is jammed or slips",
        parameters=(
            Parameter(name="lost_share", unit="1", tolerance=0.02, scale=0.6, low=0.0, high=1.0),
            Parameter(
                name="angle", unit="degree", tolerance=0.15, scale=5.0, low=-25.0, high=25.0, also_of=offset
            ),
        ),
        slot="fins",
        apply=partial(_jam, servo),
        sudden=True,
    )


ONSETS = (
    _jammed("rudder", "rudder_servo", "the rudder", "rudder_offset"),
    _jammed("stern_plane_port", "stern_plane_port_servo", "the port stern-plane", "stern_plane_offset"),
    _jammed(
        "stern_plane_starboard",
        "stern_plane_starboard_servo",
        "the starboard stern-plane",
        "stern_plane_offset",
    ),
)
"""Effects that can only begin in mid-trial."""
