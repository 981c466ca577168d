"""Station keeping: thrusters hold a place, a depth and a heading, or follow them, in the compiled loop.

    τ = K_p e + K_i ∫e dt + K_d ė,   K_p = M ω²,  K_d = 2 ζ M ω,  K_i = K_p ω/10       (Fossen 2021, section 15.3.4)

in the body's axes, with e the error of place (north, east, down, turned into body axes) and of heading, M the diagonal
of the mass matrix with added mass, ω the bandwidth (three times as high for angles), ζ = 1. Roll and pitch are held
level in the same way, without the integral, by thrusters that can; else they are left to the righting moment. The
wrench goes to the thrusters by `vehicle.thrusters.allocation`; where they meet a limit, the integrals stand still. The
law is evaluated at the beginning of each hull step, as a digital controller does, from the true state: sensors and
their errors are those of `subzero.autopilot`.
"""

from __future__ import annotations

import numpy as np

import scenarios
from subzero.engine.run_state import BANDWIDTH, Station
from subzero.errors import UserError
from subzero.jit import compiled, scratch
from vehicle import Vehicle, VehicleNumbers, euler_angles, rotation
from vehicle.thrusters import AXES, allocation, commands_of_wrench, unheld_axes

INTEGRALS = 4
"""Entries of a state behind those of the vehicle: integrals of the errors, north, east, down [m s], heading [rad s]."""
HELD, LEVELLED = ("surge", "sway", "heave", "yaw"), ("roll", "pitch")
ATTITUDE_RATIO = 3.0
"""The angles answer so many times faster than the place: a loop inside another must. [-]"""
DAMPING_RATIO, INTEGRAL_SHARE = 1.0, 0.1
"""ζ, and K_i over K_p ω: critically damped, and ten times slower in the integral (Fossen's rule of thumb). [-]"""


def station_of(trial: scenarios.Trial, vehicle: Vehicle) -> Station:
    """Return the station that a trial asks its vehicle to keep; an empty one if it asks for none.

    Raises:
        UserError: thrusters that cannot push along all of `HELD`: which, and why.
    """
    station = trial.station
    if station is None:
        return Station(np.zeros((0, 5)), np.zeros(7), np.zeros((0, 6)), np.zeros(INTEGRALS))
    lacking = unheld_axes(vehicle.thruster_list, HELD)
    if lacking:
        count = len(vehicle.thrusters)
        why = (
            f"its {count} thrusters cannot push along {', '.join(lacking)} alone"
            if count
            else "it has no thrusters"
        )
        raise UserError(
            f"'{trial.name}' asks its vehicle to keep a station, but {why}."
            " Take a vehicle such as bluerov2_heavy, or give [commands] in place of [station]."
        )
    mass = np.diag(vehicle.own_numbers.mass_matrix).copy()
    for axis in unheld_axes(vehicle.thruster_list, LEVELLED):
        mass[AXES.index(axis)] = 0.0
    track = np.column_stack([station.time, np.array(station.place), station.heading]).astype(float)
    return Station(
        track, np.append(mass, station.bandwidth), allocation(vehicle.thruster_list), np.zeros(INTEGRALS)
    )


@compiled
def _wanted(track: np.ndarray, time: float, place: np.ndarray, rate: np.ndarray) -> None:
    """Fill place, heading (4,) and their rates (4,) at a time: linear between the rows, then held."""
    last = track.shape[0] - 1
    row = 0
    while row < last and track[row + 1, 0] <= time:
        row += 1
    for i in range(4):
        place[i], rate[i] = track[row, 1 + i], 0.0
        if row < last:
            slope = (track[row + 1, 1 + i] - track[row, 1 + i]) / (track[row + 1, 0] - track[row, 0])
            place[i] += slope * (time - track[row, 0])
            rate[i] = slope


@compiled
def steer(
    station: Station, numbers: VehicleNumbers, state: np.ndarray, time: float, command: np.ndarray
) -> None:
    """Fill the commands of the thrusters, command[4 …], at a state; `station.error` keeps what the integrals grow by.

    Args:
        station: which place and heading, gains, allocation.
        numbers: of the vehicle.
        state: of the vehicle, its last four entries the integrals.
        time: since the start. [s]
        command: of the vehicle; its thrusters stand behind the first four entries.
    """
    R, place, rate, wrench = scratch(3, 3), scratch(1, 4)[0], scratch(1, 4)[0], scratch(1, 6)[0]
    earth, body = scratch(3, 3), scratch(3, 3)
    rotation(state[3:7], R)
    _wanted(station.track, time, place, rate)
    w, last = station.gains[BANDWIDTH], state.size - INTEGRALS
    roll, pitch, heading = euler_angles(state[3:7])
    turn = place[3] - heading
    turn -= 2.0 * np.pi * np.round(turn / (2.0 * np.pi))
    for i in range(3):
        earth[0, i], earth[1, i], earth[2, i] = place[i] - state[i], rate[i], state[last + i]
    for k in range(3):
        for i in range(3):
            body[k, i] = R[0, i] * earth[k, 0] + R[1, i] * earth[k, 1] + R[2, i] * earth[k, 2]
    for i in range(3):
        damped = 2.0 * DAMPING_RATIO * w * (body[1, i] - state[7 + i])
        wrench[i] = station.gains[i] * (w * w * (body[0, i] + INTEGRAL_SHARE * w * body[2, i]) + damped)
    w *= ATTITUDE_RATIO
    wrench[3] = -station.gains[3] * w * (w * roll + 2.0 * DAMPING_RATIO * state[10])
    wrench[4] = -station.gains[4] * w * (w * pitch + 2.0 * DAMPING_RATIO * state[11])
    damped = 2.0 * DAMPING_RATIO * w * (rate[3] - state[12])
    wrench[5] = station.gains[5] * (w * w * (turn + INTEGRAL_SHARE * w * state[last + 3]) + damped)
    made = commands_of_wrench(wrench, station.allocate, numbers.thrusters, numbers.thruster_count, command)
    for i in range(3):
        station.error[i] = earth[0, i] if made == 1.0 else 0.0  # wound up no further than the thrusters reach
    station.error[3] = turn if made == 1.0 else 0.0
