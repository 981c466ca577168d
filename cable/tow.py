"""Tow a cable of fixed length with a free tail, or with a drogue at its end."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, sqrt

import numpy as np

from cable.current import Current
from cable.drum import DrumProperties
from cable.drum_motion import resting
from cable.history import History
from cable.moving_end.initial_shape import lay_straight
from cable.moving_end.segment_load import new_load
from cable.moving_end.state import NOW, TOLERANCE, Line, new_line
from cable.moving_end.time_loop import run
from cable.properties import CableProperties
from cable.tow_path import (
    TowVelocity,
    check_kinds,
    check_memory,
    check_motion,
    check_tolerance,
    checked_time,
    current_of,
    first_direction,
    sample_path,
    segments_needed,
)
from subzero.errors import BadValueError, checked, short


def tow(
    tow_velocity: TowVelocity,
    length: float,
    duration: float,
    step: float = 0.1,
    *,
    segment_length: float = 0.5,
    cable: CableProperties | None = None,
    current: Sequence[float] | np.ndarray | Current | None = None,
    drogue_drag_area: float = 0.0,
    rtol: float = 0.0,
    tolerance: float = TOLERANCE,
    scheme: str = "moving_end",
) -> History:
    """Tow a cable of fixed length, starting from the exact steady straight tow.

    A neutral cable trails straight behind, T(s) = (½ρπdC_t (L − s) + ½ρC_dA) U². A cable with weight and no drogue lies
    straight at the critical angle φ, ½ρdC_n U² sin²φ = |w_c| cosφ, below or above the tow point; at rest it hangs.

    Args:
        tow_velocity: function of time [s] that gives the tow point's velocity north, east, down (3,). [m/s]
        length: L. [m]
        duration: how long. [s]
        step: time between recorded results. [s]
        segment_length: Δs; taken a little smaller where L is not a whole number of it. [m]
        cable: the cable; Table 1 of the source when not given.
        current: velocity of the water north, east, down (3,) [m/s], or a `cable.Current` that changes with place and
            time (places relative to the tow point at the start); still water when not given.
        drogue_drag_area: C_d A of a drogue at the free end; 0 is a free tail. [m²]
        rtol: as in `cable.pull_out`.
        tolerance: as in `cable.pull_out`.
        scheme: "moving_end" or "lumped", as in `cable.pull_out`.

    Returns:
        the history; positions are relative to where the tail is at the start, `drum_tension` is the one at the tail.

    Raises:
        subzero.UserError: a length, duration, step or segment length that is not positive, or a scheme that cannot tow.

    Checked by: tests/exact/test_tow.py
    """
    length, segment_length = (
        checked("", *each, above=0.0) for each in (("length", length), ("segment_length", segment_length))
    )
    duration, step = checked_time("duration", duration), checked_time("step", step)
    drogue_drag_area = checked("", "drogue_drag_area", drogue_drag_area, least=0.0)
    rtol = checked("", "rtol", rtol, least=0.0, most=0.5)
    check_motion("tow_velocity", tow_velocity)
    tolerance = check_tolerance(tolerance)
    cable, water = CableProperties() if cable is None else cable, current_of(current)
    check_kinds(cable=(cable, (CableProperties,)))
    if not isinstance(scheme, str) or scheme not in ("moving_end", "lumped"):
        raise BadValueError(f"scheme {short(scheme)} cannot tow a free end; choose 'moving_end' or 'lumped'.")
    if scheme == "lumped":
        from cable.lumped.history import tow_lumped

        return tow_lumped(
            tow_velocity,
            length,
            duration,
            step,
            segment_length=segment_length,
            cable=cable,
            current=water,
            drogue_drag_area=drogue_drag_area,
        )
    path = sample_path(tow_velocity, duration, step)
    segments_needed(length, segment_length, 0.0)  # refuses a cable of countless ones
    count = max(1, int(np.ceil(length / segment_length - 1e-9)))
    check_memory(path.times.size, count)
    line, work, c, idle = new_line(count), new_load(), cable.numbers(), DrumProperties().numbers()
    tail_drag, J = 0.5 * cable.water_density * drogue_drag_area, water.at((0.0, 0.0, 0.0))
    uphill = _steady_direction(path.leaving, J, cable, tail_drag)
    line.ends.segment_length = length / count
    lay_straight(line, length, uphill, path.leaving[0], idle, c)
    line.ends.free_end, line.ends.tail_drag, line.ends.tolerance = True, tail_drag, tolerance
    _set_steady_tow(line, path.leaving[0], J, cable, tail_drag)
    path.place[:] += line.position[NOW, 0]
    origin = -line.position[NOW, 0]
    return run(line, path, resting(path.times), water.numbers(origin), c, idle, rtol, work, count)


def _steady_direction(
    velocity: np.ndarray, J: np.ndarray, cable: CableProperties, tail_drag: float
) -> np.ndarray:
    """Return the direction from the tail to the tow point in a steady tow, a unit vector (3,)."""
    speed, weight = float(np.linalg.norm(velocity[0] - J)), cable.weight_in_water
    if speed == 0.0 and weight != 0.0:
        return np.array([0.0, 0.0, -np.sign(weight)])
    ahead = first_direction(velocity - J)
    if weight == 0.0 or tail_drag > 0.0 or speed == 0.0 or abs(ahead[2]) > 1e-9:
        return ahead
    phi = cable.critical_angle(speed)
    return np.cos(phi) * ahead + np.array([0.0, 0.0, -np.sign(weight) * np.sin(phi)])


def _set_steady_tow(
    line: Line, velocity: np.ndarray, J: np.ndarray, cable: CableProperties, tail_drag: float
) -> None:
    """Give every node the tow point's velocity, and the segments tension and stretch of a steady straight tow."""
    N, U = line.ends.count, velocity - J
    t = -line.position[NOW, 0] / np.linalg.norm(line.position[NOW, 0])
    drag, weight = cable.tangential_drag * abs(U @ t) * -(U @ t), cable.weight_in_water * t[2]
    line.velocity[:, : N + 1] = velocity
    line.ends.payout[:] = 0.0
    pulls, middles = [tail_drag * float(U @ U)], []
    lengths = [*line.length[1:N].tolist(), line.ends.last_length[NOW]]
    for length in reversed(lengths):
        middles.append(_grown(pulls[-1], 0.5 * length, drag, weight, cable.compliance))
        pulls.append(_grown(middles[-1], 0.5 * length, drag, weight, cable.compliance))
    line.tension[:, 1 : N + 1], line.node_tension[: N + 1] = middles[::-1], pulls[::-1]
    chords = np.array(lengths) * (1.0 + cable.compliance * np.array(middles[::-1]))
    behind = np.cumsum(chords[::-1])[::-1]
    line.position[:, :N] = line.position[NOW, N] - behind[:, None] * t
    line.ends.tow_force[:], line.ends.drum_pull = pulls[-1] * t, pulls[0]


def _grown(T: float, length: float, drag: float, weight: float, e: float) -> float:
    """Return the tension `length` further up, dT/ds = drag √(1 + eT) + weight; none where it would push. [N]."""
    end, before = T, inf
    while abs(end - before) > 1e-15 * abs(end):
        before, end = end, T + length * (drag * sqrt(1.0 + e * 0.5 * (T + end)) + weight)
    return max(end, 0.0)
