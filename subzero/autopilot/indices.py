"""Indices of manoeuvres: turning circle, zig-zag, step response, spiral, crash stop.

Plain arrays in, plain numbers out; SI and radians. An index that the run is too short for is NaN. Definitions after the
IMO standards for ship manoeuvrability, MSC.137(76): advance and transfer are those of the hull centre when the heading
has changed by 90°, along and across the first heading; the tactical diameter is the transfer at 180°.
"""

from __future__ import annotations

from itertools import pairwise
from math import cos, nan, pi, sin

import numpy as np


def crossing_time(time: np.ndarray, values: np.ndarray, level: float, start: float = -np.inf) -> float:
    """Return when values (n,) first reach a level from the side they start on, by straight interpolation [s].

    Args:
        time: of the samples (n,). [s]
        values: (n,).
        level: to be reached.
        start: not before. [s]
    """
    after = np.flatnonzero(time >= start)
    if after.size == 0:
        return nan
    t, v = time[after], values[after]
    side = np.sign(v[0] - level)
    if side == 0.0:
        return float(t[0])
    reached = np.flatnonzero((v - level) * side <= 0.0)
    if reached.size == 0:
        return nan
    k = int(reached[0])
    return float(t[k - 1] + (level - v[k - 1]) / (v[k] - v[k - 1]) * (t[k] - t[k - 1]))


def turning_circle(
    time: np.ndarray, north: np.ndarray, east: np.ndarray, heading: np.ndarray, start: float
) -> dict[str, float]:
    """Return advance_m, transfer_m, tactical_diameter_m, final_diameter_m, final_turn_rate_deg_s, speed_loss of a turn.

    Args:
        time: (n,). [s]
        north: place of the hull centre (n,). [m]
        east: likewise. [m]
        heading: continuous (n,). [rad]
        start: when the rudder is put over. [s]

    The last quarter of the turn's time counts as steady; the speed loss is the share of the speed at `start` that is
    gone then, both along the track.
    """
    x0, y0, psi0 = (float(np.interp(start, time, values)) for values in (north, east, heading))
    turned = heading - psi0
    side = 1.0 if turned[-1] >= 0.0 else -1.0
    along = (north - x0) * np.cos(psi0) + (east - y0) * np.sin(psi0)
    across = side * ((east - y0) * np.cos(psi0) - (north - x0) * np.sin(psi0))
    quarter, half = (crossing_time(time, side * turned, angle, start) for angle in (0.5 * pi, pi))

    def at(t: float, values: np.ndarray) -> float:
        return float(np.interp(t, time, values)) if t == t else nan

    speed = np.hypot(np.gradient(north, time), np.gradient(east, time))
    steady = time >= time[-1] - 0.25 * (time[-1] - start)
    rate = float(np.polyfit(time[steady], heading[steady], 1)[0]) if steady.sum() > 1 else nan
    final = float(np.mean(speed[steady]))
    return {
        "advance_m": at(quarter, along),
        "transfer_m": at(quarter, across),
        "tactical_diameter_m": at(half, across),
        "final_diameter_m": 2.0 * final / abs(rate) if rate else nan,
        "final_turn_rate_deg_s": float(np.degrees(rate)),
        "speed_loss": 1.0 - final / float(np.interp(start, time, speed)),
    }


def zigzag(
    time: np.ndarray, angle: np.ndarray, command: np.ndarray, limit: float, start: float
) -> dict[str, float]:
    """Return overshoot_1_deg, overshoot_2_deg, initial_turning_time_s and period_s of a zig-zag.

    Args:
        time: (n,). [s]
        angle: heading, or pitch, in the unit of `limit` (n,). [rad]
        command: of the fin (n,), that changes sign at each execute.
        limit: change of the angle at which the fin is reversed. [rad]
        start: the first execute. [s]

    An overshoot is how far the angle goes on beyond the limit after the fin has been reversed; the period is the time
    from the second execute to the fourth.
    """
    off = angle - float(np.interp(start, time, angle))
    signs = np.sign(command)
    executes = [
        float(time[k]) for k in range(1, time.size) if signs[k] != signs[k - 1] and time[k] >= start - 1e-9
    ]
    overshoots = [
        float(np.max(np.abs(off[(time >= a) & (time <= b)]))) - limit
        for a, b in pairwise([*executes[1:], time[-1]])
    ]
    whole = overshoots[: max(0, len(executes) - 2)]
    first = [*whole, nan, nan]
    return {
        "overshoot_1_deg": float(np.degrees(first[0])),
        "overshoot_2_deg": float(np.degrees(first[1])),
        "initial_turning_time_s": executes[1] - executes[0] if len(executes) > 1 else nan,
        "period_s": executes[3] - executes[1] if len(executes) > 3 else nan,
    }


SETTLED = 0.05
"""Share of a step within which it has settled. [-]"""


def step_response(time: np.ndarray, values: np.ndarray, goal: float, start: float) -> dict[str, float]:
    """Return rise_time_s (10 to 90 %), overshoot (share of the step), settling_time_s and steady_error of a step.

    Args:
        time: (n,). [s]
        values: the stepped quantity (n,).
        goal: where to.
        start: when. [s]

    The steady error, in the unit of the values, is the mean over the last tenth of the time after the step.
    """
    first = float(np.interp(start, time, values))
    share = (values - first) / (goal - first)
    after = time >= start
    beyond = np.flatnonzero(after & (np.abs(share - 1.0) > SETTLED))
    settled = float(time[min(beyond[-1] + 1, time.size - 1)]) - start if beyond.size else 0.0
    late = time >= time[-1] - 0.1 * (time[-1] - start)
    return {
        "rise_time_s": crossing_time(time, share, 0.9, start) - crossing_time(time, share, 0.1, start),
        "overshoot": max(0.0, float(np.max(share[after])) - 1.0),
        "settling_time_s": nan if beyond.size and beyond[-1] == time.size - 1 else settled,
        "steady_error": float(np.mean(values[late])) - goal,
    }


def spiral(
    time: np.ndarray, yaw_rate: np.ndarray, rudder: np.ndarray, hold: float, start: float
) -> dict[str, float]:
    """Return indices of a Dieudonné spiral: slope_per_s at small rudders, loop_height_deg_s and residual_deg_s at
    zero.

    Args:
        time: (n,). [s]
        yaw_rate: (n,). [rad/s]
        rudder: commanded, in steps that go down and up again (n,). [rad]
        hold: how long each step lasts. [s]
        start: of the first step. [s]

    Of each step the last fifth counts as steady. The height of the loop is the difference of the two yaw rates at zero
    rudder, coming from either side: an unstable hull keeps turning.
    """
    count = int(np.floor((time[-1] - start) / hold + 1e-6))
    ends = [start + hold * (k + 1) for k in range(count)]
    steady = [
        (time > end - 0.2 * hold) & (time < end - 1e-9) for end in ends
    ]  # at its end the next one is commanded
    rates = np.array([float(np.mean(yaw_rate[where])) for where in steady])
    angles = np.array([float(np.mean(rudder[where])) for where in steady])
    at_zero = rates[np.abs(angles) < 1e-9]
    small = np.abs(angles) <= np.radians(5.0) + 1e-9
    slope = float(np.polyfit(angles[small], rates[small], 1)[0]) if small.sum() > 1 else nan
    return {
        "slope_per_s": slope,
        "loop_height_deg_s": float(np.degrees(np.ptp(at_zero))) if at_zero.size > 1 else nan,
        "residual_deg_s": float(np.degrees(np.mean(at_zero))) if at_zero.size else nan,
    }


def crash_stop(
    time: np.ndarray,
    north: np.ndarray,
    east: np.ndarray,
    surge_speed: np.ndarray,
    heading: np.ndarray,
    start: float,
) -> dict[str, float]:
    """Return stopping_time_s, head_reach_m (along the first heading), track_reach_m and side_reach_m until u = 0."""
    stopped = crossing_time(time, surge_speed, 0.0, start)
    if stopped != stopped:
        return dict.fromkeys(("stopping_time_s", "head_reach_m", "track_reach_m", "side_reach_m"), nan)
    x, y = ([float(np.interp(t, time, values)) for t in (start, stopped)] for values in (north, east))
    psi = float(np.interp(start, time, heading))
    during = (time >= start) & (time <= stopped)
    track = float(np.sum(np.hypot(np.diff(north[during]), np.diff(east[during]))))
    return {
        "stopping_time_s": stopped - start,
        "head_reach_m": (x[1] - x[0]) * cos(psi) + (y[1] - y[0]) * sin(psi),
        "track_reach_m": track,
        "side_reach_m": (y[1] - y[0]) * cos(psi) - (x[1] - x[0]) * sin(psi),
    }
