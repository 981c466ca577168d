"""Fins anywhere on the hull: tails in X, foreplanes, elevons, keels.

    s = (0, cos γ, sin γ)                                            span, away from the hull
    n = x × s = (0, −sin γ, cos γ)                                   across the fin
    δ = clip(own + r sin γ δ_r + e cos γ (δ_s + δ_p)/2 + d (δ_s − δ_p)/2, ± deflection limit)

γ turns the span about the hull's axis, from starboard (0) down (90°), to port (180°) and up (−90°). The force is that
of `vehicle.fins` in the flow at the fin's centre of pressure. A positive angle turns the leading edge towards n, so it
rolls the hull to starboard wherever the fin points: at γ = 0 it is a starboard stern-plane, at γ = 90° a lower rudder.

"own" is the state of the fin's channel. r, e and d are the shares in which a fin follows rudder, mean and difference of
the stern-planes (their angles, behind their servos): 1 for a fin at the tail, 0 for one that has its own command alone;
r and e are negative for a fin ahead of the hull's centre. So all that steers a rudder and two planes flies a tail in X.
A share of the command that is lost (`lost_command`) is lost of what a fin follows, too: with 1 it is jammed at its
offset.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from subzero.jit import Record, compiled, inlined
from vehicle.channels import Channel
from vehicle.fins import FinNumbers, FinShape, section_force
from vehicle.parameters import parameter
from vehicle.state import STATE_SIZE

MOST_FINS = 8
"""The compiled numbers hold so many fins: one layout, so that all vehicles share one machine code."""


class ListedFinNumbers(Record):
    """A fin as the compiled functions take it: channel, place, n, what it follows, limit, and its shape (`section`)."""

    channel: int
    x: float
    y: float
    z: float
    normal_y: float
    normal_z: float
    per_rudder: float
    per_port: float
    per_starboard: float
    limit: float
    section: FinNumbers


@dataclass(frozen=True, kw_only=True)
class Fin(FinShape):
    """One fin; its name is that of its table in the file."""

    x: float = parameter("centre of pressure, forward of the hull centre", "m")
    y: float = parameter("centre of pressure, to starboard", "m")
    z: float = parameter("centre of pressure, downward", "m")
    span_angle: float = parameter("direction of its span about the axis, 0 starboard, pi/2 down, g", "rad")
    rudder_share: float = parameter("share in which it follows the rudder, r", "1")
    plane_share: float = parameter("share in which it follows the mean of the stern-planes, e", "1")
    roll_share: float = parameter("share in which it follows their difference, d", "1")
    lag: float = parameter("time constant of its own servo", "s", low=0.0)
    rate_limit: float = parameter("fastest turn of its own servo", "rad/s", above=0.0, unlimited=True)
    offset: float = parameter("angle at zero command", "rad")
    deflection_limit: float = parameter("largest angle either way", "rad", low=0.0, high=math.pi)
    lost_command: float = parameter("share of the command that is lost; 1: jammed", "1", low=0.0, high=1.0)

    def channels(self, name: str) -> tuple[Channel, ...]:
        """Return its command: its own angle."""
        limit, meaning = self.deflection_limit, f"own angle of the fin {name}"
        row = {"lag": self.lag, "rate_limit": self.rate_limit, "offset": self.offset}
        lost = self.lost_command
        return (
            Channel(name=name, meaning=meaning, unit="rad", low=-limit, high=limit, lost_command=lost, **row),
        )

    def numbers(self, channel: int, density: float) -> ListedFinNumbers:
        """Return the numbers that the compiled fin needs; `channel` counts its command among all."""
        sine, cosine, kept = math.sin(self.span_angle), math.cos(self.span_angle), 1.0 - self.lost_command
        mean, unlike = 0.5 * self.plane_share * cosine, 0.5 * self.roll_share
        follows = (kept * self.rudder_share * sine, kept * (mean - unlike), kept * (mean + unlike))
        place = (self.x, self.y, self.z, -sine, cosine)
        return ListedFinNumbers(
            channel, *place, *follows, self.deflection_limit, self.shape_numbers(density, self.x, 0.0)
        )


@inlined
def listed_angle(state: np.ndarray, angles: tuple[float, float, float], fin: ListedFinNumbers) -> float:
    """Return the angle of a fin in the water [rad]; `angles` are those of rudder, port and starboard plane."""
    own = state[STATE_SIZE + fin.channel] if STATE_SIZE + fin.channel < state.size else 0.0
    angle = own + fin.per_rudder * angles[0] + fin.per_port * angles[1] + fin.per_starboard * angles[2]
    return max(-fin.limit, min(fin.limit, angle))


@compiled
def add_fins(
    state: np.ndarray,
    nu_r: np.ndarray,
    angles: tuple[float, float, float],
    fins: tuple[ListedFinNumbers, ...],
    count: int,
    out: np.ndarray,
) -> None:
    """Add the wrench of all listed fins to out (6,) [N, N m].

    Args:
        state: of the vehicle; those of the channels stand behind entry STATE_SIZE.
        nu_r: velocity relative to the water (u, v, w, p, q, r). [m/s, rad/s]
        angles: rudder, port plane, starboard plane in the water. [rad]
        fins: MOST_FINS of them.
        count: how many count.
        out: the six components, added to.
    """
    u, v, w, p, q, r = nu_r[0], nu_r[1], nu_r[2], nu_r[3], nu_r[4], nu_r[5]
    for i in range(count):
        fin = fins[i]
        x, y, z = fin.x, fin.y, fin.z
        across = fin.normal_y * (v + r * x - p * z) + fin.normal_z * (w + p * y - q * x)
        X, N = section_force(u + q * z - r * y, across, listed_angle(state, angles, fin), fin.section)
        Y, Z = N * fin.normal_y, N * fin.normal_z
        out[0] += X
        out[1] += Y
        out[2] += Z
        out[3] += y * Z - z * Y
        out[4] += z * X - x * Z
        out[5] += x * Y - y * X


NO_FIN = Fin(**dict.fromkeys(Fin.__dataclass_fields__, 1.0)).numbers(0, 0.0)
"""Fills the compiled list behind the last fin."""
