"""Propeller and fins as a steady motion sees them: without their limits, their limits, and the commands to them."""

from __future__ import annotations

from dataclasses import replace
from math import degrees, inf, isinf
from typing import NamedTuple

import numpy as np

from subzero.steady_motion.hull_state_space import SURGE
from vehicle import Servo, Vehicle
from vehicle.motor import battery_current, motor_numbers, voltage
from vehicle.state import QUICKEST


class Demand(NamedTuple):
    """What an actuator has to do, and the most it can: its name, both values, their unit for a message."""

    name: str
    value: float
    limit: float
    unit: str


def ideal(hull: Vehicle) -> Vehicle:
    """Return a vehicle whose actuators know no limit, dead band, offset, play or sag; lags stay (none: `QUICKEST`)."""

    def servo(one: Servo) -> Servo:
        free = {"dead_band": 0.0, "offset": 0.0, "half_backlash": 0.0, "position_feedback": 0.0,
                "lost_command": 0.0}  # fmt: skip
        return replace(one, **free, lag=max(one.lag, QUICKEST), rate_limit=inf, deflection_limit=inf)

    lag = max(hull.motor.lag, QUICKEST)
    return replace(
        hull,
        motor=replace(hull.motor, lag=lag, speed_per_volt=inf, voltage_sensitivity=0.0),
        rudder_servo=servo(hull.rudder_servo),
        stern_plane_port_servo=servo(hull.stern_plane_port_servo),
        stern_plane_starboard_servo=servo(hull.stern_plane_starboard_servo),
    )


def demands(hull: Vehicle, x: np.ndarray) -> list[Demand]:
    """Return what a state (16,) asks of each actuator."""
    propeller = Demand("propeller", abs(float(x[12])), fastest_propeller(hull, float(x[SURGE])), "rev/s")
    fins = zip(("rudder", "port stern-plane", "starboard stern-plane"), x[13:], servos(hull), strict=True)
    return [propeller] + [_fin_demand(name, float(angle), servo) for name, angle, servo in fins]


def _fin_demand(name: str, angle: float, servo: Servo) -> Demand:
    """Return what is asked of a fin: to stand at an angle [rad]; of one that is jammed, to leave its offset."""
    if servo.lost_command == 1.0:
        return Demand(f"jammed {name}", degrees(abs(angle - servo.offset)), 1e-9, "degrees")
    return Demand(name, degrees(abs(angle)), degrees(servo.deflection_limit), "degrees")


def servos(hull: Vehicle) -> tuple[Servo, Servo, Servo]:
    """Return the servos of rudder, port and starboard plane."""
    return hull.rudder_servo, hull.stern_plane_port_servo, hull.stern_plane_starboard_servo


def commands(hull: Vehicle, x: np.ndarray) -> np.ndarray:
    """Return the commands (4,) that lead to the actuators of a state: offset, dead band and sag undone."""
    volts = _loaded_voltage(hull, float(x[12]), float(x[SURGE]))
    sag = hull.motor.voltage_sensitivity * (1.0 - volts / hull.battery.full_voltage)
    fins = [_command(float(angle), servo) for angle, servo in zip(x[13:], servos(hull), strict=True)]
    return np.array([float(x[12]) / (1.0 - sag), *fins])


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
