"""Rudders and stern-planes, each fin in its own local flow.

A fin at r_f moves through the water with V = v_r + ω × r_f. With V_c along its chord and V_m across it (chord
axes, turned by the fin's angle), sin α = −V_m/V and cos α = V_c/V, and

    C_L = a C_Lα sin α cos α + (1 − a) C_N sin α cos α                  attached | stalled (flat plate)
    C_D = C_D0 + a (C_Lα sin α cos α)²/(π e AR) + (1 − a) C_N sin² α
    a = 1 / (1 + (sin α / sin α_s)⁸)                                    smooth stall around α_s

which holds at every incidence, in reversed flow and at rest; drag opposes V, so a fin never adds energy,
however it is turned. Lift slopes are those on the hull (Whicker and Fehlner; hull_parameters: 2.4 to 3.0 per
radian). The flow is that of the undisturbed water: no wake of the hull, no propeller race, no interference
between fins.

Signs: a positive rudder pushes the stern to port, so the heading increases; a positive stern-plane pushes the
stern down, so the nose goes up. Starboard plane more positive than port plane: roll to starboard.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from subzero.jit import Record, gated_inlined, inlined
from vehicle.parameters import Section, parameter

STILL = 1e-16
"""Square of a speed below which a fin feels nothing [m2/s2]: forces there are under 1e-16 N."""


class FinNumbers(Record):
    """Place of the centre of pressure on starboard or below, ½ρS, and the shape of lift and drag."""

    x: float
    arm: float
    half_density_area: float
    lift_slope: float
    induced: float
    profile: float
    plate: float
    stall: float


@dataclass(frozen=True, kw_only=True)
class FinShape(Section):
    """Area and coefficients of a fin, wherever it stands."""

    area: float = parameter("plan area of one exposed fin, S", "m2", low=0.0)
    lift_slope: float = parameter("lift slope on the hull, C_La", "1/rad", low=0.0)
    aspect_ratio: float = parameter("effective aspect ratio on the hull, AR", "1", above=0.0)
    span_efficiency: float = parameter("span efficiency in induced drag, e", "1", above=0.0)
    profile_drag_coefficient: float = parameter("profile drag coefficient on plan area, C_D0", "1", low=0.0)
    normal_force_coefficient: float = parameter("normal force coefficient across the flow, C_N", "1", low=0.0)
    stall_angle: float = parameter(
        "incidence at which half the lift is lost, a_s", "rad", above=0.0, high=1.5
    )

    def shape_numbers(self, density: float, x: float, arm: float) -> FinNumbers:
        """Return the numbers that the compiled fin needs."""
        return FinNumbers(
            x,
            arm,
            0.5 * density * self.area,
            self.lift_slope,
            1.0 / (math.pi * self.span_efficiency * self.aspect_ratio),
            self.profile_drag_coefficient,
            self.normal_force_coefficient,
            math.sin(self.stall_angle),
        )


@dataclass(frozen=True, kw_only=True)
class Fins(FinShape):
    """One of two equal fins on opposite sides of the hull."""

    station: float = parameter("centre of pressure, forward of the hull centre, x_f", "m")
    arm: float = parameter("centre of pressure, distance from the axis", "m", low=0.0)

    def numbers(self, density: float) -> FinNumbers:
        """Return the numbers that the compiled fin needs."""
        return self.shape_numbers(density, self.station, self.arm)


@gated_inlined
def section_force(ux: float, un: float, angle: float, fin: FinNumbers) -> tuple[float, float]:
    """Return the force along the body x axis and along the fin's normal axis [N].

    Args:
        ux: velocity of the fin through the water along the body x axis. [m/s]
        un: velocity of the fin through the water along the normal axis. [m/s]
        angle: how far the leading edge is turned towards the positive normal axis. [rad]
        fin: the fin's numbers.
    """
    return _turned_force(ux, un, math.cos(angle), math.sin(angle), fin)


@inlined
def _turned_force(ux: float, un: float, c: float, s: float, fin: FinNumbers) -> tuple[float, float]:
    """Return the same as `section_force`, from cosine and sine of the angle."""
    Vc = ux * c + un * s
    Vm = un * c - ux * s
    V2 = Vc * Vc + Vm * Vm
    if V2 < STILL:
        return 0.0, 0.0
    V = math.sqrt(V2)
    sin_a, cos_a = -Vm / V, Vc / V
    ratio = sin_a / fin.stall
    ratio *= ratio
    ratio *= ratio
    attached = 1.0 / (1.0 + ratio * ratio)
    lift = fin.lift_slope * sin_a * cos_a
    plate = (1.0 - attached) * fin.plate * sin_a
    drag = fin.profile + attached * fin.induced * lift * lift + plate * sin_a
    lift = attached * lift + plate * cos_a
    scale = fin.half_density_area * V
    Fc = -scale * (lift * Vm + drag * Vc)
    Fm = scale * (lift * Vc - drag * Vm)
    return Fc * c - Fm * s, Fc * s + Fm * c


@gated_inlined
def rudder(nu_r: np.ndarray, angle: float, fin: FinNumbers, out: np.ndarray) -> None:
    """Fill out (6,) with the wrench of the linked upper and lower rudder [N, N m].

    Args:
        nu_r: velocity relative to the water (u, v, w, p, q, r). [m/s, rad/s]
        angle: rudder angle, positive turns the heading to starboard. [rad]
        fin: one of the two fins, above (z = −arm) and below (z = +arm) the axis.
        out: the six components.
    """
    u, v, p, q, r = nu_r[0], nu_r[1], nu_r[3], nu_r[4], nu_r[5]
    x, z = fin.x, fin.arm
    cosine, sine = math.cos(-angle), math.sin(-angle)
    X_lower, Y_lower = _turned_force(u + q * z, v + r * x - p * z, cosine, sine, fin)
    X_upper, Y_upper = _turned_force(u - q * z, v + r * x + p * z, cosine, sine, fin)
    out[0] = X_lower + X_upper
    out[1] = Y_lower + Y_upper
    out[2] = 0.0
    out[3] = -z * (Y_lower - Y_upper)
    out[4] = z * (X_lower - X_upper)
    out[5] = x * (Y_lower + Y_upper)


@gated_inlined
def stern_plane(nu_r: np.ndarray, angle: float, side: float, fin: FinNumbers, out: np.ndarray) -> None:
    """Fill out (6,) with the wrench of one stern-plane [N, N m].

    A positive angle raises the trailing edge: the plane is pushed down, the nose goes up. On the starboard
    side that also pushes the starboard side down (positive roll), on the port side the port side (negative
    roll).

    Args:
        nu_r: velocity relative to the water (u, v, w, p, q, r). [m/s, rad/s]
        angle: plane angle, positive pitches the nose up. [rad]
        side: +1 starboard, −1 port.
        fin: the plane's numbers; its centre of pressure lies at y = side · arm.
        out: the six components.
    """
    u, w, p, q, r = nu_r[0], nu_r[2], nu_r[3], nu_r[4], nu_r[5]
    x, y = fin.x, side * fin.arm
    X, Z = section_force(u - r * y, w + p * y - q * x, angle, fin)
    out[0] = X
    out[1] = 0.0
    out[2] = Z
    out[3] = y * Z
    out[4] = -x * Z
    out[5] = -y * X
