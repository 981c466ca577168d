"""The equations of motion: the rate of the whole state, and its breakdown into named forces and powers.

    η' = J(η) ν,    M ν' = Σ terms,    servos, motor and battery as in `actuators` and `motor`

The state is that of `vehicle.state`; the command is (propeller [rev/s], rudder, port plane, starboard plane
[rad]); `current_n` (3,) is the velocity of the water in earth axes, steady and uniform around the vehicle;
`wrench_b` (6,) is what pulls from outside, about the hull centre in body axes.

Every joule of the propeller can be found again:

    d/dt (½ ν_rᵀ M ν_r + V) = P_propeller + P_loss + P_external        (P_restoring = −dV/dt)

reckoned in the frame that moves with the steady, uniform current: there all terms are those of still water
and "turning_current" is absent. P is the wrench of a term times ν_r. The kinetic energy holds that of the
added mass. V is the potential of weight and buoyancy; in a vertical current its depth is that relative to the
water, so use P_restoring, not V, there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from subzero.jit import compiled, gated_inlined, inlined, scratch
from vehicle.actuators import fin_angle, servo_rate, settle
from vehicle.channels import channel_rates
from vehicle.kinematics import motion, normalise, rotation
from vehicle.motor import battery_current, shaft_goal, shaft_rate, shaft_speed, voltage
from vehicle.restoring import potential
from vehicle.state import CHARGE, LINKAGE, SERVO, SHAFT
from vehicle.terms import BREAKDOWN, POWER_OF_TERM, TERM_COUNT, fill_terms

if TYPE_CHECKING:
    from vehicle.vehicle import Vehicle, VehicleNumbers

POWERS = ("propeller", "loss", "restoring", "external")
"""Entries that `power` fills: thrust and reaction torque; fins, lift and drag; weight and buoyancy; from outside."""
NO_COMMAND, NO_CURRENT, NO_WRENCH = (0.0,) * 4, (0.0,) * 3, (0.0,) * 6


@gated_inlined
def relative_velocity(state: np.ndarray, R: np.ndarray, current_n: np.ndarray, nu_r: np.ndarray) -> None:
    """Fill nu_r (6,) with the velocity through the water in body axes [m/s, rad/s]; R is R_nb."""
    for i in range(3):
        flow = R[0, i] * current_n[0] + R[1, i] * current_n[1] + R[2, i] * current_n[2]
        nu_r[i] = state[7 + i] - flow
        nu_r[3 + i] = state[10 + i]


@gated_inlined
def deflections(
    state: np.ndarray, command: np.ndarray, numbers: VehicleNumbers
) -> tuple[float, float, float]:
    """Return the angles of rudder, port and starboard plane in the water [rad], after backlash."""
    servos = numbers.servos
    rudder = fin_angle(state[SERVO], state[LINKAGE], command[1], servos[0])
    port = fin_angle(state[SERVO + 1], state[LINKAGE + 1], command[2], servos[1])
    starboard = fin_angle(state[SERVO + 2], state[LINKAGE + 2], command[3], servos[2])
    return rudder, port, starboard


@compiled
def evaluate(
    state: np.ndarray,
    command: np.ndarray,
    current_n: np.ndarray,
    wrench_b: np.ndarray,
    numbers: VehicleNumbers,
    R: np.ndarray,
    nu_r: np.ndarray,
    out: np.ndarray,
) -> None:
    """Fill R_nb (3, 3), nu_r (6,) and all terms (terms, 6) of a state."""
    rotation(state[3:7], R)
    relative_velocity(state, R, current_n, nu_r)
    n = shaft_speed(state[SHAFT], state[CHARGE], command[0], nu_r[0], numbers.motor, numbers.propeller)
    fill_terms(state, nu_r, R, n, deflections(state, command, numbers), wrench_b, numbers, out)


@inlined
def actuators(
    state: np.ndarray, command: np.ndarray, u: float, numbers: VehicleNumbers, out: np.ndarray
) -> None:
    """Fill the rates of shaft, servos, charge and linkages; u is the surge speed through the water [m/s]."""
    motor, propeller = numbers.motor, numbers.propeller
    goal = shaft_goal(state[SHAFT], state[CHARGE], command[0], u, motor, propeller)
    out[SHAFT] = shaft_rate(state[SHAFT], goal, motor)
    for i in range(3):
        out[SERVO + i] = servo_rate(state[SERVO + i], state[LINKAGE + i], command[1 + i], numbers.servos[i])
        out[LINKAGE + i] = 0.0
    out[CHARGE] = battery_current(state[SHAFT], u, motor, propeller)
    if numbers.channel_count > 0:
        channel_rates(state, command, numbers.channels, numbers.channel_count, out)


@compiled
def _fill_rates(
    state: np.ndarray,
    command: np.ndarray,
    current_n: np.ndarray,
    wrench_b: np.ndarray,
    numbers: VehicleNumbers,
    R: np.ndarray,
    nu_r: np.ndarray,
    terms: np.ndarray,
    out: np.ndarray,
) -> None:
    """Fill out with the rate of the state, and the entries of `evaluate`."""
    rotation(state[3:7], R)
    relative_velocity(state, R, current_n, nu_r)
    # The motor first: its quotients wait for one another, and a processor sums up forces meanwhile.
    actuators(state, command, nu_r[0], numbers, out)
    motion(state, R, out)
    n = shaft_speed(state[SHAFT], state[CHARGE], command[0], nu_r[0], numbers.motor, numbers.propeller)
    fill_terms(state, nu_r, R, n, deflections(state, command, numbers), wrench_b, numbers, terms)
    _accelerations(terms, numbers, out)


@compiled
def derivative(
    state: np.ndarray,
    command: np.ndarray,
    current_n: np.ndarray,
    wrench_b: np.ndarray,
    numbers: VehicleNumbers,
    out: np.ndarray,
) -> None:
    """Fill out with the rate of the state.

    Args:
        state: as in `vehicle.STATE`, and the state of each channel behind it (`Vehicle.state_size`,).
        command: propeller [rev/s], rudder, port plane, starboard plane [rad], and that of each channel.
        current_n: velocity of the water, earth axes. [m/s]
        wrench_b: external force and moment about the hull centre, body axes. [N, N m]
        numbers: `Vehicle.numbers()`.
        out: the rates.
    """
    R, nu_r, terms = scratch(3, 3), scratch(1, 6)[0], scratch(TERM_COUNT, 6)
    _fill_rates(state, command, current_n, wrench_b, numbers, R, nu_r, terms, out)


@compiled
def derivative_and_power(
    state: np.ndarray,
    command: np.ndarray,
    current_n: np.ndarray,
    wrench_b: np.ndarray,
    numbers: VehicleNumbers,
    out: np.ndarray,
    powers: np.ndarray,
) -> None:
    """Fill out as `derivative` does and powers as `power` does, to the same last bit, from one look at the forces."""
    R, nu_r, terms = scratch(3, 3), scratch(1, 6)[0], scratch(TERM_COUNT, 6)
    _fill_rates(state, command, current_n, wrench_b, numbers, R, nu_r, terms, out)
    _powers(terms, nu_r, powers)


@inlined
def _accelerations(terms: np.ndarray, numbers: VehicleNumbers, out: np.ndarray) -> None:
    """Fill out[7:13] with ν' = M⁻¹ Σ terms."""
    wrench = scratch(1, 6)[0]
    for j in range(6):
        total = 0.0
        for i in range(TERM_COUNT):
            total += terms[i, j]
        wrench[j] = total
    for i in range(6):
        rate = 0.0
        for j in range(6):
            rate += numbers.inverse_mass[i, j] * wrench[j]
        out[7 + i] = rate


@compiled
def breakdown(
    state: np.ndarray,
    command: np.ndarray,
    current_n: np.ndarray,
    wrench_b: np.ndarray,
    numbers: VehicleNumbers,
    out: np.ndarray,
) -> None:
    """Fill out (len(BREAKDOWN), 6) with every named term [N, N m], M ν' in sum. Arguments: `derivative`."""
    evaluate(state, command, current_n, wrench_b, numbers, scratch(3, 3), scratch(1, 6)[0], out)


@compiled
def finish_step(state: np.ndarray, command: np.ndarray, numbers: VehicleNumbers) -> None:
    """Tidy a state after a step: quaternion to length one, linkages behind their servos."""
    normalise(state)
    settle(state, command, numbers.servos)


@compiled
def battery_voltage(
    state: np.ndarray, command: np.ndarray, current_n: np.ndarray, numbers: VehicleNumbers
) -> float:
    """Return the battery voltage under load [V]."""
    R, nu_r = scratch(3, 3), scratch(1, 6)[0]
    rotation(state[3:7], R)
    relative_velocity(state, R, current_n, nu_r)
    motor, propeller = numbers.motor, numbers.propeller
    n = shaft_speed(state[SHAFT], state[CHARGE], command[0], nu_r[0], motor, propeller)
    return voltage(state[CHARGE], battery_current(n, nu_r[0], motor, propeller), motor)


@compiled
def power(
    state: np.ndarray,
    command: np.ndarray,
    current_n: np.ndarray,
    wrench_b: np.ndarray,
    numbers: VehicleNumbers,
    out: np.ndarray,
) -> None:
    """Fill out (len(POWERS),) with the powers on the hull relative to the water [W]; losses are negative, whatever the
    motion. Arguments: `derivative`.
    """
    nu_r, terms = scratch(1, 6)[0], scratch(TERM_COUNT, 6)
    evaluate(state, command, current_n, wrench_b, numbers, scratch(3, 3), nu_r, terms)
    _powers(terms, nu_r, out)


@inlined
def _powers(terms: np.ndarray, nu_r: np.ndarray, out: np.ndarray) -> None:
    """Fill out (len(POWERS),) with the powers of all terms (terms, 6) at a velocity through the water."""
    for i in range(len(POWERS)):
        out[i] = 0.0
    for i in range(TERM_COUNT):
        which = POWER_OF_TERM[i]
        if which >= 0:
            for j in range(6):
                out[which] += terms[i, j] * nu_r[j]


@compiled
def kinetic_energy(state: np.ndarray, current_n: np.ndarray, numbers: VehicleNumbers) -> float:
    """Return ½ ν_rᵀ M ν_r, hull and added mass together [J]."""
    R, nu_r = scratch(3, 3), scratch(1, 6)[0]
    rotation(state[3:7], R)
    relative_velocity(state, R, current_n, nu_r)
    total = 0.0
    for i in range(6):
        for j in range(6):
            total += nu_r[i] * numbers.mass_matrix[i, j] * nu_r[j]
    return 0.5 * total


@compiled
def potential_energy(state: np.ndarray, numbers: VehicleNumbers) -> float:
    """Return the potential energy of weight and buoyancy [J]."""
    R = scratch(3, 3)
    rotation(state[3:7], R)
    return potential(state[2], R, numbers.restoring)


def breakdown_table(
    vehicle: Vehicle,
    state: Sequence[float] | np.ndarray,
    command: Sequence[float] = NO_COMMAND,
    *,
    current_n: Sequence[float] = NO_CURRENT,
    wrench_b: Sequence[float] = NO_WRENCH,
) -> dict[str, np.ndarray]:
    """Return every named force on the vehicle: name → (X, Y, Z, K, M, N) in body axes [N, N m].

    Args:
        vehicle: whose forces.
        state: as in `vehicle.STATE`, for example from `initial_state`.
        command: propeller [rev/s], rudder, port plane, starboard plane [rad].
        current_n: velocity of the water, earth axes. [m/s]
        wrench_b: external force and moment about the hull centre. [N, N m]
    """
    out = np.empty((len(BREAKDOWN), 6))
    inputs = [np.asarray(values, dtype=float) for values in (state, command, current_n, wrench_b)]
    breakdown(inputs[0], inputs[1], inputs[2], inputs[3], vehicle.numbers(), out)
    return dict(zip(BREAKDOWN, out, strict=True))
