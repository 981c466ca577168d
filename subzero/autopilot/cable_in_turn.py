"""How a cable lies behind a vehicle that turns, and how hard it pulls: one angle and four sums.

A light cable without stretch slides along itself and is dragged sideways where it is curved. At the tow point, with
the speed V there split along and across the cable, V_t = V cos α and V_n = V sin α:

    T κ = ½ρdC_n V_n|V_n|,   θ' = V_t κ + V_n/S   the cable turns as it slides along its own curve, and about the drum
    dV_t/ds = −κ V_n                              the curve that is cut off is not paid out: the drum turns slower
    T = C_f/R_d + ½ρπdC_t ∫V_t² ds

(∂V_n/∂s beside V_t κ is taken for a straight line to the drum: good enough where it is small.) Between the tow point
and the drum V_t falls from V cos α to the drum's S'; where on the way it does, is taken from where κ V_n was lost when
the tow point came by. Then the integral needs no memory of the way but the sums P = ∫dp, A = ∫κ|V_n| dp, ∫A dp and
∫A² dp along it:

    V_t(p) = S' + (V cos α − S') A(p)/A
"""

from __future__ import annotations

from math import atan2, ceil, cos, hypot, pi, sin

from cable.properties import CableProperties

SHORTEST_STEP = 0.01
"""The angle is moved on in steps of at most this. [s]"""
LEAST_PULL = 0.02
"""With less tension than this a cable has no stiffness that the steps could follow. [N]"""
SHORTEST = 1.0
"""A cable shorter than this turns about the drum like this one. [m]"""
STRAIGHT = 1e-9
"""Below this A the way was straight. [1]"""


class Behind:
    """A cable behind a tow point, in the plane of a turn.

    Args:
        cable: whose drags count.
        friction: C_f/R_d of the drum. [N]

    Attributes:
        angle: of the cable's end against the hull's axis, positive to starboard [rad]; it pulls back along that.
        tension: at the tow point. [N]
        length: of the cable in the water. [m]
    """

    def __init__(self, cable: CableProperties, friction: float) -> None:
        self._along, self._friction = cable.tangential_drag, friction
        self._across = 0.5 * cable.water_density * cable.diameter * cable.normal_drag_coefficient
        self.angle, self.tension, self.length = 0.0, friction, 0.0
        self._way, self._lost, self._sum, self._square = 0.0, 0.0, 0.0, 0.0

    def move(self, passed: float, forward: float, starboard: float, yaw_rate: float) -> None:
        """Move the tow point on.

        Args:
            passed: time. [s]
            forward: speed of the tow point through the water along the hull. [m/s]
            starboard: across it. [m/s]
            yaw_rate: of the hull. [rad/s]
        """
        count = max(1, ceil(passed / SHORTEST_STEP))
        step, speed, course = passed / count, hypot(forward, starboard), atan2(starboard, forward)
        for _ in range(count):
            along, across = speed * cos(course - self.angle), speed * sin(course - self.angle)
            curvature = self._across * across * abs(across) / max(self.tension, LEAST_PULL)
            self.angle += step * (along * curvature + across / max(self.length, SHORTEST) - yaw_rate)
            self.angle -= 2.0 * pi * round(self.angle / (2.0 * pi))
            self._lost += step * max(along, 0.0) * curvature * across
            self._way += step * speed
            self._sum += step * speed * self._lost
            self._square += step * speed * self._lost**2

    def pull(self, length: float, paid_out: float, forward: float, starboard: float) -> float:
        """Return the tension at the tow point [N].

        Args:
            length: of the cable in the water. [m]
            paid_out: S', how fast the drum lets it go. [m/s]
            forward: speed of the tow point through the water along the hull. [m/s]
            starboard: across it. [m/s]
        """
        self.length, square = length, paid_out**2
        if self._lost > STRAIGHT:
            along = forward * cos(self.angle) + starboard * sin(self.angle)
            mean, mean_square = self._sum / self._lost / self._way, self._square / self._lost**2 / self._way
            more = max(along, 0.0) - paid_out
            square += 2.0 * paid_out * more * mean + more**2 * mean_square
        self.tension = self._friction + self._along * length * square
        return self.tension
