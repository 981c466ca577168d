"""The motor on its battery: how fast the propeller turns, and the charge that it takes.

    I  = P/(η V_full) + I_hotel,      P = 2π n Q, no less than zero
    V  = V_full − k q_e − R I,        q_e' = I
    n' = (target − n)/lag,  target = clip(command · [1 − l q_e] · [1 − s (1 − V/V_full)], ± c V)

The speed loop of the motor holds the commanded speed (s = 0) until the sagging voltage no longer allows it:
the ceiling is c revolutions a second per volt. An open-loop drive (s = 1) slows down with the voltage at
once; l says the same of the charge alone, whatever the voltage. The inertia of the shaft is inside the lag. Neutral
values: k = R = s = l = 0, c infinite, lag 0 (see `actuators`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from subzero.jit import Record, gated_inlined, inlined
from vehicle.parameters import Section, parameter
from vehicle.propeller import PropellerNumbers, torque
from vehicle.state import QUICKEST


class MotorNumbers(Record):
    """The parameters of motor and battery, as the compiled functions take them."""

    lag: float
    speed_per_volt: float
    voltage_sensitivity: float
    efficiency: float
    full_voltage: float
    voltage_drop_per_charge: float
    internal_resistance: float
    hotel_current: float
    speed_loss_per_charge: float


@dataclass(frozen=True, kw_only=True)
class Motor(Section):
    """The propeller's motor and its speed loop."""

    lag: float = parameter("time constant of the shaft speed", "s", low=0.0)
    speed_per_volt: float = parameter(
        "highest shaft speed per volt, c", "rev/(s V)", above=0.0, unlimited=True
    )
    voltage_sensitivity: float = parameter("share of a voltage loss that shows in the speed, s", "1", low=0.0)
    efficiency: float = parameter("shaft power over electric power", "1", above=0.0, high=1.0)


@dataclass(frozen=True, kw_only=True)
class Battery(Section):
    """The battery pack."""

    full_voltage: float = parameter("voltage when full, unloaded", "V", above=0.0)
    voltage_drop_per_charge: float = parameter("fall of the voltage with the charge drawn, k", "V/C", low=0.0)
    internal_resistance: float = parameter("internal resistance, R", "ohm", low=0.0)
    hotel_current: float = parameter("current of everything but the motor", "A", low=0.0)
    speed_loss_per_charge: float = parameter("share of the commanded speed lost per charge drawn, l", "1/C")


def motor_numbers(motor: Motor, battery: Battery) -> MotorNumbers:
    """Return the numbers that the compiled motor needs."""
    return MotorNumbers(*motor.values(), *battery.values())


@gated_inlined
def battery_current(n: float, u: float, motor: MotorNumbers, propeller: PropellerNumbers) -> float:
    """Return the current drawn [A] at shaft speed n [rev/s] and surge speed u through the water [m/s]."""
    shaft_power = max(0.0, 2.0 * math.pi * n * torque(n, u, propeller))
    return shaft_power / (motor.efficiency * motor.full_voltage) + motor.hotel_current


@gated_inlined
def voltage(charge: float, current: float, motor: MotorNumbers) -> float:
    """Return the battery voltage [V] after a charge drawn [C], under a current [A]; never below zero."""
    sag = motor.voltage_drop_per_charge * charge + motor.internal_resistance * current
    return max(0.0, motor.full_voltage - sag)


@inlined
def shaft_target(command: float, volts: float, motor: MotorNumbers) -> float:
    """Return the shaft speed that a command leads to at a battery voltage [rev/s]."""
    wanted = command * (1.0 - motor.voltage_sensitivity * (1.0 - volts / motor.full_voltage))
    if math.isinf(motor.speed_per_volt):
        return wanted
    ceiling = motor.speed_per_volt * volts
    return max(-ceiling, min(ceiling, wanted))


@inlined
def shaft_goal(
    n: float, charge: float, command: float, u: float, motor: MotorNumbers, propeller: PropellerNumbers
) -> float:
    """Return the shaft speed the motor heads for [rev/s], with the battery under the load of n and u."""
    left = max(0.0, 1.0 - motor.speed_loss_per_charge * charge)
    return shaft_target(
        command * left, voltage(charge, battery_current(n, u, motor, propeller), motor), motor
    )


@gated_inlined
def shaft_speed(
    n: float, charge: float, command: float, u: float, motor: MotorNumbers, propeller: PropellerNumbers
) -> float:
    """Return the shaft speed [rev/s]: the state n, or the goal itself if the motor has no lag."""
    if motor.lag == 0.0:
        return shaft_goal(n, charge, command, u, motor, propeller)
    return n


@inlined
def shaft_rate(n: float, target: float, motor: MotorNumbers) -> float:
    """Return n' [rev/s2]."""
    return (target - n) / max(motor.lag, QUICKEST)
