"""The hull as an ordinary system x' = f(x, u): one table of its states and inputs, and f.

    x = (x, y, z, φ, θ, ψ, u, v, w, p, q, r, n, δ_r, δ_p, δ_s),   u = (n_c, δ_rc, δ_pc, δ_sc)

    φ' = p + tan θ (q sin φ + r cos φ),   θ' = q cos φ − r sin φ,   ψ' = (q sin φ + r cos φ)/cos θ

with the forces of `vehicle.derivative`. A control engineer's state: Euler angles for the quaternion (pitch remains
away from ±90°), a full battery, and no play in the linkages, which is an event and no differential equation. A vehicle
with listed actuators has a state and an input more for each of its `channels`, behind these (`states_of`, `inputs_of`).

Trim needs more of propeller and fins: the vehicle without their limits, the demands of a state on them compared with
those limits, and the commands that lead to a state.
"""

from __future__ import annotations

from dataclasses import replace
from math import cos, degrees, inf, isinf, pi, sin, tan
from typing import Any, NamedTuple

import numpy as np

from vehicle import (
    STATE_SIZE,
    Servo,
    Vehicle,
    VehicleNumbers,
    derivative,
    euler_angles,
    quaternion_from_euler,
)
from vehicle.motor import battery_current, motor_numbers, voltage
from vehicle.state import LINKAGE, QUICKEST, SERVO, SHAFT


class Signal(NamedTuple):
    """A state or an input: its name (a channel of `subzero.channels`), symbol and unit."""

    name: str
    symbol: str
    unit: str


STATES = (
    Signal("north", "x", "m"),
    Signal("east", "y", "m"),
    Signal("depth", "z", "m"),
    Signal("roll", "φ", "rad"),
    Signal("pitch", "θ", "rad"),
    Signal("heading", "ψ", "rad"),
    Signal("surge_speed", "u", "m/s"),
    Signal("sway_speed", "v", "m/s"),
    Signal("heave_speed", "w", "m/s"),
    Signal("roll_rate", "p", "rad/s"),
    Signal("pitch_rate", "q", "rad/s"),
    Signal("yaw_rate", "r", "rad/s"),
    Signal("propeller_speed", "n", "rev/s"),
    Signal("rudder_angle", "δ_r", "rad"),
    Signal("stern_plane_port_angle", "δ_p", "rad"),
    Signal("stern_plane_starboard_angle", "δ_s", "rad"),
)
INPUTS = (
    Signal("propeller_command", "n_c", "rev/s"),
    Signal("rudder_command", "δ_rc", "rad"),
    Signal("stern_plane_port_command", "δ_pc", "rad"),
    Signal("stern_plane_starboard_command", "δ_sc", "rad"),
)
STATE_NAMES = tuple(signal.name for signal in STATES)
INPUT_NAMES = tuple(signal.name for signal in INPUTS)

MIXED = (
    Signal("stern_planes_angle", "δ_e", "rad"),
    Signal("stern_planes_difference", "δ_d", "rad"),
    Signal("stern_planes_command", "δ_ec", "rad"),
    Signal("stern_planes_difference_command", "δ_dc", "rad"),
)
"""The planes together, (port + starboard)/2, and unlike, (starboard − port)/2: positive rolls to starboard."""

UNITS = {signal.name: signal.unit for signal in (*STATES, *INPUTS, *MIXED)}
"""Name of a state or input → its unit."""

PLACE = {name: i for i, name in enumerate(STATE_NAMES)}
DEPTH, ROLL, PITCH, HEADING, SURGE = 2, 3, 4, 5, 6
VELOCITY, ACTUATORS, CHANNELS = slice(6, 12), slice(12, 16), slice(16, None)

NO_CURRENT, NO_WRENCH = np.zeros(3), np.zeros(6)


def states_of(hull: Vehicle) -> tuple[Signal, ...]:
    """Return the states of a vehicle: `STATES`, and one for each of its channels."""
    return STATES + tuple(Signal(f"{each.name}_state", each.name, each.unit) for each in hull.channels)


def inputs_of(hull: Vehicle) -> tuple[Signal, ...]:
    """Return the inputs of a vehicle: `INPUTS`, and one for each of its channels."""
    return INPUTS + tuple(Signal(f"{each.name}_command", each.name, each.unit) for each in hull.channels)


def resting_state(hull: Vehicle) -> np.ndarray:
    """Return x of a vehicle at rest, without any command: zeros, and listed fins at their offsets."""
    rest = [min(max(each.offset, each.low), each.high) for each in hull.channels]
    return np.concatenate([np.zeros(len(STATES)), rest])


def to_vehicle(x: np.ndarray) -> np.ndarray:
    """Return the state of `vehicle.STATE` for a state x (16 and one for each channel,)."""
    state = np.zeros(STATE_SIZE + x.size - len(STATES))
    state[:3] = x[:3]
    state[3:7] = quaternion_from_euler(float(x[ROLL]), float(x[PITCH]), float(x[HEADING]))
    state[7:13] = x[VELOCITY]
    state[SHAFT : SHAFT + 4] = x[ACTUATORS]
    state[LINKAGE : LINKAGE + 3] = state[SERVO : SERVO + 3]
    state[STATE_SIZE:] = x[CHANNELS]
    return state


def from_vehicle(state: np.ndarray, heading_near: float = 0.0, channels: int = 0) -> np.ndarray:
    """Return x (16 and more,) for a state of `vehicle.STATE`; the heading within half a turn of `heading_near` [rad],
    and so many states of `channels` behind.
    """
    roll, pitch, heading = euler_angles(state[3:7])
    turns = round((heading_near - heading) / (2.0 * pi))
    angles = (roll, pitch, heading + 2.0 * pi * turns)
    own = state[STATE_SIZE : STATE_SIZE + channels]
    return np.concatenate([state[:3], angles, state[7:13], state[SHAFT : SHAFT + 4], own])


def rate(
    x: np.ndarray,
    command: np.ndarray,
    numbers: VehicleNumbers,
    wrench_b: np.ndarray = NO_WRENCH,
    current_n: np.ndarray = NO_CURRENT,
) -> np.ndarray:
    """Return x' (16 and one for each channel,).

    Args:
        x: state, as in `states_of`.
        command: propeller [rev/s], rudder, port and starboard plane [rad], and that of each channel.
        numbers: of the vehicle.
        wrench_b: external force and moment about the hull centre, body axes (6,). [N, N m]
        current_n: velocity of the water, earth axes (3,). [m/s]
    """
    state = to_vehicle(x)
    out = np.empty(state.size)
    derivative(state, command, current_n, wrench_b, numbers, out)
    p, q, r = x[9:12]
    sr, cr = sin(x[ROLL]), cos(x[ROLL])
    turning = q * sr + r * cr
    angles = (p + tan(x[PITCH]) * turning, q * cr - r * sr, turning / cos(x[PITCH]))
    return np.concatenate([out[:3], angles, out[7:13], out[SHAFT : SHAFT + 4], out[STATE_SIZE:]])


class Demand(NamedTuple):
    """The demand on an actuator, and the most it can do: its name, both values, their unit for a message."""

    name: str
    value: float
    limit: float
    unit: str


def ideal(hull: Vehicle) -> Vehicle:
    """Return a vehicle whose actuators have no limit, dead band, offset, play or sag; lags remain (none:
    `QUICKEST`). Listed actuators are as quick as their lags.
    """

    def servo(servo: Servo) -> Servo:
        free = {
            "dead_band": 0.0,
            "offset": 0.0,
            "half_backlash": 0.0,
            "position_feedback": 0.0,
            "lost_command": 0.0,
        }
        return replace(servo, **free, lag=max(servo.lag, QUICKEST), rate_limit=inf, deflection_limit=inf)

    lag = max(hull.motor.lag, QUICKEST)
    return replace(
        hull,
        motor=replace(hull.motor, lag=lag, speed_per_volt=inf, voltage_sensitivity=0.0),
        rudder_servo=servo(hull.rudder_servo),
        stern_plane_port_servo=servo(hull.stern_plane_port_servo),
        stern_plane_starboard_servo=servo(hull.stern_plane_starboard_servo),
        fins=_quick(hull.fins),
        moving_masses=_quick(hull.moving_masses),
        buoyancy_engines=_quick(hull.buoyancy_engines),
    )


def _quick(listed: tuple[tuple[str, Any], ...]) -> tuple[tuple[str, Any], ...]:
    """Return listed actuators without a limit of their rates; fins turn as far as a half circle."""
    free = dict.fromkeys(("rate_limit", "slide_rate", "turn_rate", "pump_rate"), inf) | {
        "deflection_limit": pi
    }
    return tuple(
        (name, replace(part, **{key: value for key, value in free.items() if hasattr(part, key)}))
        for name, part in listed
    )


def thruster_demands(hull: Vehicle, x: np.ndarray) -> list[Demand]:
    """Return the demands of a state (16 and one for each channel,) on each thruster, but for those that are dead."""
    return [
        Demand(f"thruster {name}", abs(float(share)), 1.0 - thruster.lost_command, "of full command")
        for (name, thruster), share in zip(hull.thrusters, x[CHANNELS], strict=False)
        if thruster.lost_command < 1.0
    ]


def demands(hull: Vehicle, x: np.ndarray) -> list[Demand]:
    """Return the demands of a state (16 and more,) on propeller and fins."""
    propeller = Demand("propeller", abs(float(x[12])), fastest_propeller(hull, float(x[SURGE])), "rev/s")
    fins = zip(("rudder", "port stern-plane", "starboard stern-plane"), x[13:16], servos(hull), strict=True)
    return [propeller] + [_fin_demand(name, float(angle), servo) for name, angle, servo in fins]


def _fin_demand(name: str, angle: float, servo: Servo) -> Demand:
    """Return the demand on a fin: to stand at an angle [rad]; if it is jammed, to leave its offset."""
    if servo.lost_command == 1.0:
        return Demand(f"jammed {name}", degrees(abs(angle - servo.offset)), 1e-9, "degrees")
    return Demand(name, degrees(abs(angle)), degrees(servo.deflection_limit), "degrees")


def servos(hull: Vehicle) -> tuple[Servo, Servo, Servo]:
    """Return the servos of rudder, port and starboard plane."""
    return hull.rudder_servo, hull.stern_plane_port_servo, hull.stern_plane_starboard_servo


def commands(hull: Vehicle, x: np.ndarray) -> np.ndarray:
    """Return the commands (4 and one for each channel,) that lead to the actuators of a state: offset, dead band and
    sag undone.
    """
    volts = _loaded_voltage(hull, float(x[12]), float(x[SURGE]))
    sag = hull.motor.voltage_sensitivity * (1.0 - volts / hull.battery.full_voltage)
    fins = [_command(float(angle), servo) for angle, servo in zip(x[13:16], servos(hull), strict=True)]
    return np.array([float(x[12]) / (1.0 - sag), *fins, *listed_commands(hull, x)])


def listed_commands(hull: Vehicle, x: np.ndarray) -> list[float]:
    """Return the commands that lead the listed actuators to where they are in a state; none for one that is dead."""
    return [
        (float(state) - each.offset) / (1.0 - each.lost_command) if each.lost_command < 1.0 else 0.0
        for each, state in zip(hull.channels, x[CHANNELS], strict=True)
    ]


def _command(angle: float, servo: Servo) -> float:
    """Return the command that leads a fin to an angle [rad]: what feedback leaves of offset, dead band, loss undone."""
    arrives = 1.0 - servo.lost_command
    k = arrives * servo.position_feedback
    moved, own = angle - (1.0 - k) * servo.offset, (1.0 - k) * arrives
    if own + k > 0.0 and abs(moved) > max(k * servo.dead_band, 1e-12):
        return (moved + float(np.sign(moved)) * own * servo.dead_band) / (own + k)
    return moved / k if k > 0.0 else 0.0


def fastest_propeller(hull: Vehicle, u: float) -> float:
    """Return the highest shaft speed [rev/s] that a full battery allows under its load, at surge speed u [m/s]."""
    from scipy.optimize import brentq

    per_volt = hull.motor.speed_per_volt
    if isinf(per_volt):
        return inf
    most = per_volt * hull.battery.full_voltage
    return float(brentq(lambda n: n - per_volt * _loaded_voltage(hull, n, u), 0.0, most))


def _loaded_voltage(hull: Vehicle, n: float, u: float) -> float:
    """Return the voltage of a full battery that turns the propeller at n [rev/s] and surge speed u [m/s]. [V]."""
    motor, propeller = motor_numbers(hull.motor, hull.battery), hull.propeller.numbers(hull.water.density)
    return float(voltage(0.0, battery_current(n, u, motor, propeller), motor))
