"""The steady turn of a cable with a free tail as an ordinary differential equation, solved without the cable code.

Seen from axes that turn at ω about the centre, nothing moves. With places as complex numbers z(s), the tangent
t = e^{iθ}, V = iωz and T(L) = 0, equation (7) in its vector form reads

    d(T t)/ds = iω p + D,     p = mV + ρA V_⊥,     D = ½ρπdC_t |V_t| V_t t + ½ρdC_n |V_⊥| V_⊥

It is integrated from the tail, where T = 0 asks for a load along the cable only: that gives the angle there, and the
linear terms of an expansion start the integration, in the logarithm of the distance (no stiffness is left). The radius
of the tail is found by shooting at the tow point's. A tail with a radius below m/½ρdC_n has no angle that balances its
centrifugal force: shorter radii do not exist.
"""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import cable

START = 1e-5
"""The expansion at the tail is used over this fraction of the length."""


@dataclass(frozen=True)
class SteadyTurn:
    """A steady shape, the tow point on the real axis and moving along the imaginary one.

    Attributes:
        place: z at distances x from the tail, x increasing (n,). [m]
        tension: T there (n,). [N]
        force: on the vehicle, outward + i forward. [N]
    """

    place: np.ndarray
    tension: np.ndarray
    force: complex


def load(z: complex, angle: float, rate: float, c: cable.CableProperties) -> complex:
    """Return iωp + D at a place, for a tangent at an angle: along the cable + i across it. [N/m]."""
    t, V = cmath.exp(1j * angle), 1j * rate * z
    along = (V * t.conjugate()).real
    across = V - along * t
    momentum = c.mass_per_length * V + c.water_density * c.cross_section_area * across
    drag = c.tangential_drag * abs(along) * along * t + c.normal_drag * abs(across) * across
    return (1j * rate * momentum + drag) * t.conjugate()


def tail_start(tail: float, rate: float, length: float, c: cable.CableProperties) -> tuple[float, np.ndarray]:
    """Return x, a little from a tail at the radius `tail`, and [Re z, Im z, θ, T] there."""

    def across(a: float) -> float:
        return load(tail, a, rate, c).imag

    angle = brentq(across, -0.5 * np.pi - 1.5, -0.5 * np.pi + 1.5, xtol=1e-15)
    step, back = 1e-6, -cmath.exp(1j * angle)
    by_angle = (across(angle + step) - across(angle - step)) / (2.0 * step)
    along_x = load(tail + step * back, angle, rate, c) - load(tail - step * back, angle, rate, c)
    growth = -load(tail, angle, rate, c).real
    bend = -along_x.imag / (2.0 * step) / (growth + by_angle)
    x = START * length
    z = tail + x * back
    return x, np.array([z.real, z.imag, angle + bend * x, growth * x])


@cache
def from_tail(tail: float, rate: float, length: float, c: cable.CableProperties) -> SteadyTurn:
    """Integrate from a tail at the radius `tail` over a length of cable that turns at ω = `rate`."""

    def slope(log_x: float, y: np.ndarray) -> np.ndarray:
        q, t = load(complex(y[0], y[1]), y[2], rate, c), cmath.exp(1j * y[2])
        return -np.exp(log_x) * np.array([t.real, t.imag, q.imag / y[3], q.real])

    x, start = tail_start(tail, rate, length, c)
    places = np.log(np.linspace(x, length, 301))
    found = solve_ivp(slope, places[[0, -1]], start, "DOP853", places, rtol=1e-10, atol=1e-12)
    place, tension = found.y[0] + 1j * found.y[1], found.y[3]
    turned = abs(place[-1]) / place[-1]
    return SteadyTurn(place * turned, tension, complex(tension[-1] * np.exp(1j * found.y[2, -1]) * turned))


def smallest_tail(c: cable.CableProperties) -> float:
    """Return the radius below which no tail can turn. [m]."""
    return 1.02 * c.mass_per_length / c.normal_drag


def critical_radius(length: float, c: cable.CableProperties) -> float:
    """Return the radius of the tightest steady turn: that of the smallest tail; no speed comes in. [m]."""
    return float(from_tail(smallest_tail(c), 1.0, length, c).place[-1].real)


def longest(radius: float, c: cable.CableProperties) -> float:
    """Return the longest cable that can turn steadily at a radius. [m]."""
    return float(brentq(lambda length: critical_radius(length, c) - radius, radius, 10.0 * radius, xtol=1e-9))


@cache
def steady_turn(radius: float, speed: float, length: float, c: cable.CableProperties) -> SteadyTurn:
    """Return the steady shape behind a tow point at `radius` [m] and `speed` [m/s].

    Raises:
        ValueError: the turn is tighter than any steady shape.
    """
    if radius < critical_radius(length, c):
        message = f"{length:g} m of cable have no steady shape at a radius of {radius:g} m."
        raise ValueError(message)
    rate, least = speed / radius, smallest_tail(c)

    def miss(tail: float) -> float:
        return from_tail(tail, rate, length, c).place[-1].real - radius

    return from_tail(brentq(miss, least, radius, xtol=1e-12), rate, length, c)
