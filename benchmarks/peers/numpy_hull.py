"""The hull as an engineer would write it first: `vehicle.derivative` with NumPy's matrices and vectors, step by step.

The same equations and numbers as `vehicle.terms`, in still water without a cable; `tests/hull/test_numpy_hull.py` holds
the two against one another. `rk4` takes classic Runge-Kutta steps, `solved` hands the same right-hand side to
`scipy.integrate.solve_ivp`.
"""

from __future__ import annotations

import numpy as np

from vehicle.state import CHARGE, LINKAGE, QUICKEST, SERVO, SHAFT, STATE_SIZE


def rotation(q):
    """Return R_nb of a quaternion that need not have length one."""
    w, v = q[0], q[1:]
    S = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    return np.eye(3) + 2.0 / (q @ q) * (w * S + S @ S)


def coriolis(M, nu):
    """Return −C(ν)ν of a mass matrix."""
    v, omega = nu[:3], nu[3:]
    P, L = (M @ nu)[:3], (M @ nu)[3:]
    return np.concatenate([np.cross(P, omega), np.cross(P, v) + np.cross(L, omega)])


def quadratic(coefficients, velocities):
    """Return coefficients times velocity times its size."""
    return coefficients @ (velocities * np.abs(velocities))


def body_terms(nu, c):
    """Return what acts on the bare hull (6,): lift, drag of strips and of the axis, further damping. [N, N m]"""
    u, v, w, _, q, r = nu
    a, out = c.body_lift, np.zeros(6)
    out[[1, 5]] = a[0] * abs(u) * v + a[1] * u * r, a[2] * u * v + a[3] * abs(u) * r
    out[[2, 4]] = a[4] * abs(u) * w + a[5] * u * q, a[6] * u * w + a[7] * abs(u) * q
    x, size = c.strips
    across = np.array([v + x * r, w - x * q])
    drag = size * np.linalg.norm(across, axis=0) * across
    out[[1, 2, 4, 5]] += -drag[0].sum(), -drag[1].sum(), x @ drag[1], -(x @ drag[0])
    out[0] -= c.axial_drag * u * abs(u)
    d = c.quadratic_damping
    out[[1, 5]] += quadratic(np.array([[d[0], d[1]], [d[2], d[3]]]), nu[[1, 5]])
    out[[2, 4]] += quadratic(np.array([[d[4], d[5]], [d[6], d[7]]]), nu[[2, 4]])
    out[3] += d[8] * nu[3] * abs(nu[3])
    return out + c.linear_damping * nu


def fin(place, normal, angle, nu, f):
    """Return the wrench of a fin at a place, whose force acts across the flow along `normal`. [N, N m]"""
    velocity = nu[:3] + np.cross(nu[3:], place)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    along, across = turn @ (velocity[0], velocity @ normal)
    speed = np.hypot(along, across)
    if speed < 1e-8:
        return np.zeros(6)
    sine, cosine = -across / speed, along / speed
    attached = 1.0 / (1.0 + (sine / f.stall) ** 8)
    lift, plate = f.lift_slope * sine * cosine, (1.0 - attached) * f.plate * sine
    drag = f.profile + attached * f.induced * lift**2 + plate * sine
    lift = attached * lift + plate * cosine
    local = (
        f.half_density_area * speed * np.array([-lift * across - drag * along, lift * along - drag * across])
    )
    ahead, sideways = turn.T @ local
    force = np.array([ahead, 0.0, 0.0]) + sideways * normal
    return np.concatenate([force, np.cross(place, force)])


def curve(n, u, nn, nu, uu):
    """Return thrust or torque of the propeller."""
    return nn * n * abs(n) - nu * abs(n) * u - uu * u * abs(u)


def shaft(state, command, u, c):
    """Return the speed that the motor heads for [rev/s], and the current [A]."""
    m, p, n = c.motor, c.propeller, state[SHAFT]
    power = max(0.0, 2.0 * np.pi * n * curve(n, u, p.torque_nn, p.torque_nu, p.torque_uu))
    amperes = power / (m.efficiency * m.full_voltage) + m.hotel_current
    volts = m.full_voltage - m.voltage_drop_per_charge * state[CHARGE] - m.internal_resistance * amperes
    volts = max(0.0, volts)
    wanted = command * max(0.0, 1.0 - m.speed_loss_per_charge * state[CHARGE])
    wanted *= 1.0 - m.voltage_sensitivity * (1.0 - volts / m.full_voltage)
    ceiling = np.inf if np.isinf(m.speed_per_volt) else m.speed_per_volt * volts
    return np.clip(wanted, -ceiling, ceiling), amperes


def servo(angle, linkage, command, s):
    """Return the angle of a fin in the water, and how fast its servo turns. [rad, rad/s]"""
    k, most = (1.0 - s.lost_command) * s.position_feedback, s.deflection_limit
    moved = np.sign(command) * max(0.0, abs(command) - s.dead_band)
    target = (1.0 - k) * np.clip((1.0 - s.lost_command) * moved + s.offset, -most, most)
    target += k * np.clip(command, -most, most)
    rests = s.lag == 0.0 and np.isinf(s.rate_limit)
    at, play = (target, (1.0 - k) * s.half_backlash) if rests else (angle, s.half_backlash)
    seen = (1.0 - k) * angle + k * np.clip(linkage, angle - s.half_backlash, angle + s.half_backlash)
    rate = np.clip((target - seen) / max(s.lag, QUICKEST), -s.rate_limit, s.rate_limit)
    return np.clip(linkage, at - play, at + play), rate


def servos(state, command, c):
    """Return the angles of rudder, port and starboard plane, and the rates of their servos."""
    each = [servo(state[SERVO + i], state[LINKAGE + i], command[1 + i], c.servos[i]) for i in range(3)]
    return tuple(zip(*each, strict=True))


def derivative(state, command, c):
    """Return the rate of the state (STATE_SIZE,); c is `Vehicle.numbers()`."""
    q, nu, rate = state[3:7], state[7:13], np.zeros(STATE_SIZE)
    R = rotation(q)
    goal, amperes = shaft(state, command[0], nu[0], c)
    n = goal if c.motor.lag == 0.0 else state[SHAFT]
    (rudder, port, starboard), rate[SERVO : SERVO + 3] = servos(state, command, c)
    force = coriolis(c.mass_matrix, nu) + body_terms(nu, c)
    A = np.diag(c.added_mass)
    force[3:] += -c.munk_excess * np.array(
        [(A[2] - A[1]) * nu[1] * nu[2], -(A[2] - A[0]) * nu[0] * nu[2], (A[1] - A[0]) * nu[0] * nu[1]]
    )
    down, r = R[2], c.restoring
    force += np.concatenate([r.net_weight * down, np.cross([r.arm_x, r.arm_y, r.arm_z], down)])
    p = c.propeller
    force[0] += curve(n, nu[0], p.thrust_nn, p.thrust_nu, p.thrust_uu)
    force[3] -= p.reaction * curve(n, nu[0], p.torque_nn, p.torque_nu, p.torque_uu)
    across, up, down_ = np.array([0.0, 1.0, 0.0]), c.rudder, np.array([0.0, 0.0, 1.0])
    for side in (-1.0, 1.0):
        force += fin(np.array([up.x, 0.0, side * up.arm]), across, -rudder, nu, up)
        plane, angle = c.stern_planes, port if side < 0.0 else starboard
        force += fin(np.array([plane.x, side * plane.arm, 0.0]), down_, angle, nu, plane)
    rate[:3] = R @ nu[:3]
    omega = nu[3:]
    rate[3] = -0.5 * (q[1:] @ omega)
    rate[4:7] = 0.5 * (q[0] * omega + np.cross(q[1:], omega))
    rate[7:13] = c.inverse_mass @ force
    rate[SHAFT] = (goal - state[SHAFT]) / max(c.motor.lag, QUICKEST)
    rate[CHARGE] = amperes
    return rate


def finished(state, command, c):
    """Return a state at the end of a step: quaternion of length one, linkages behind their servos."""
    state[3:7] /= np.linalg.norm(state[3:7])
    state[LINKAGE : LINKAGE + 3] = servos(state, command, c)[0]
    return state


def rk4(state, command, c, steps, h):
    """Return the states (steps + 1, STATE_SIZE) of classic Runge-Kutta steps of h [s] under one command."""
    states = [np.array(state)]
    for _ in range(steps):
        y = states[-1]
        k1 = derivative(y, command, c)
        k2 = derivative(y + 0.5 * h * k1, command, c)
        k3 = derivative(y + 0.5 * h * k2, command, c)
        k4 = derivative(y + h * k3, command, c)
        states.append(finished(y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4), command, c))
    return np.array(states)


def solved(state, command, c, duration, method, rtol):
    """Return the state at the end of a run, as `scipy.integrate.solve_ivp` finds it."""
    from scipy.integrate import solve_ivp

    done = solve_ivp(
        lambda _, y: derivative(y, command, c),
        (0.0, duration),
        state,
        method=method,
        rtol=rtol,
        atol=0.01 * rtol,
    )
    if not done.success:
        raise RuntimeError(done.message)
    return done.y[:, -1]
