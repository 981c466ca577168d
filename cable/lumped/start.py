"""The initial state of the lumped cable: straight, in steady motion, with the tension that the drum holds."""

from __future__ import annotations

import numpy as np

from cable.drum import DrumProperties
from cable.lumped.rope import DIRECTION, OLD, PULL, REST, STATE, Rope
from cable.lumped.springs import LEAST_COMPLIANCE, spring_law, spring_state
from cable.properties import CableProperties
from cable.winch import SHORTEST, ConstantTension, PayOutRate, Winch

STRAIGHT_UP = np.array([0.0, 0.0, -1.0])
FAINTEST = 1e-11
"""Least tension that a cable starts with. [N]"""
CRUMPLED = 1e-6
"""Springs that pull with T are shorter by 1e-12 N/T of their length: a cable is laid no more than this too long. [m]"""


def lay(
    rope: Rope,
    cable: CableProperties,
    lengths: np.ndarray,
    tensions: np.ndarray,
    tow: np.ndarray,
    ahead: np.ndarray,
) -> None:
    """Lay springs of given lengths and tensions (n,) straight behind the tow point, on all levels."""
    n = lengths.size
    rope.ends.count = n
    least = max(FAINTEST, 1e-12 / CRUMPLED * float(lengths.sum()))
    rope.ends.stretch = cable.compliance
    rope.ends.compliance = max(cable.compliance, LEAST_COMPLIANCE)
    rope.ends.bending = cable.bending_stiffness
    rope.spring[REST, 1 : n + 1] = lengths
    rope.ends.last[:] = lengths[-1]
    behind = 0.0
    rope.position[:, 0] = tow
    for j in range(1, n + 1):
        rope.spring[STATE, j] = spring_state(max(tensions[j - 1], least))
        rope.spring[PULL, j], _, strain, _ = spring_law(rope.spring[STATE, j], rope.ends.compliance)
        rope.stretched[:, j] = lengths[j - 1] * (1.0 + strain)
        behind += rope.stretched[OLD, j]
        rope.position[:, j] = tow - behind * ahead
        rope.vector[DIRECTION, j] = -ahead


def winch_rows(drum: DrumProperties | Winch, times: np.ndarray, wet: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the setpoint of a winch at times (n,), and its rate: dS/dt where the length is prescribed."""
    if isinstance(drum, DrumProperties):
        return np.zeros(times.size), np.zeros(times.size)
    setpoint = drum.setpoints(times, wet)
    if not isinstance(drum, PayOutRate):
        return setpoint, np.gradient(setpoint, times)
    rate = drum.rate
    rates = np.array([float(rate(t) if callable(rate) else rate) for t in times])
    return setpoint, np.where((setpoint <= SHORTEST) & (rates < 0.0), 0.0, rates)


def held_at_drum(drum: DrumProperties | Winch, setpoint: float, payout: float) -> float:
    """Return the tension at the drum that a run starts with: a winch's, or that of friction. [N]."""
    if isinstance(drum, DrumProperties):
        return drum.friction_torque / drum.radius if payout > 0.0 else 0.0
    return setpoint if isinstance(drum, ConstantTension) else 0.0


def steady_direction(
    U: np.ndarray, ahead: np.ndarray, cable: CableProperties, tail_drag: float
) -> np.ndarray:
    """Return the direction from the tail to the tow point in a steady tow, a unit vector (3,)."""
    speed, weight = float(np.linalg.norm(U)), cable.weight_in_water
    if speed == 0.0 and weight != 0.0:
        return np.sign(weight) * STRAIGHT_UP
    if weight == 0.0 or tail_drag > 0.0 or speed == 0.0 or abs(ahead[2]) > 1e-9:
        return ahead
    phi = cable.critical_angle(speed)
    return np.cos(phi) * ahead + np.sin(phi) * np.sign(weight) * STRAIGHT_UP


def steady_tensions(
    U: np.ndarray, ahead: np.ndarray, cable: CableProperties, lengths: np.ndarray, tail: float
) -> np.ndarray:
    """Return the tensions at the nodes of a steady straight tow (n + 1,), √(1 + eT) in the drag and all. [N]."""
    tensions = np.full(lengths.size + 1, tail)
    drag, weight = cable.tangential_drag * abs(U @ ahead) * float(U @ ahead), cable.weight_in_water * ahead[2]
    for j in range(lengths.size - 1, -1, -1):
        here = tensions[j + 1]
        for _ in range(4):
            middle = max(0.5 * (here + tensions[j + 1]), 0.0)
            here = tensions[j + 1] + lengths[j] * (drag * np.sqrt(1.0 + cable.compliance * middle) - weight)
        tensions[j] = here
    return tensions
