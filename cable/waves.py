"""Waves, and the motion of a vessel in them: what moves an end of a cable.

    >>> waves = Waves.jonswap(2.0, 8.0, seed=1, depth=50.0)
    >>> heaves = VesselResponse(frequency=[0.3, 2.0], amplitude=[[0, 0, 1.0, 0, 0, 0]] * 2, phase=[[0] * 6] * 2)
    >>> motion = heaves.motion(waves, hang_off=(5.0, 0.0, 0.0), ramp=20.0)
    >>> motion.place(0.0).tolist(), motion(0.0).tolist()               # it begins at rest: for cable.hold, and pull_out
    ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])

Airy waves: with θ = k·x − ωt + ε, depth h, and d the depth below the mean surface,

    ω² = g k tanh kh,   η = Σ a cos θ (up),   u = Σ aω cosh k(h−d)/sinh kh cos θ,   w = Σ aω sinh k(h−d)/sinh kh sin θ

u along the waves, w up; above the mean surface the velocity is that at it. The water's motion at a cable is
`cable.Current.sampled(waves.velocity, down=…, time=…)`. Irregular waves are components of equal energy with random
phases, of the JONSWAP spectrum (Hasselmann and others, 1973),

    S(ω) ∝ ω⁻⁵ exp(−1.25 (ω_p/ω)⁴) γ^exp(−(ω−ω_p)²/(2σ²ω_p²)),   σ = 0.07 below ω_p, else 0.09,   ∫S dω = H_s²/16

which is that of Pierson and Moskowitz for γ = 1. A vessel answers linearly, as its response amplitude operators say.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cable.properties import GRAVITY
from subzero.arguments import numbers_in
from subzero.errors import BadValueError, checked, short, whole

Numbers = Sequence[Any] | np.ndarray
HIGHEST, FINE = 6.0, 4001
"""The spectrum is cut off at so many peak frequencies (1e-3 of its energy is beyond), at so many points."""


def wave_number(frequency: np.ndarray, depth: float) -> np.ndarray:
    """Return k of ω² = g k tanh kh, by Newton's method. [1/m]"""
    deep: np.ndarray = np.asarray(frequency, dtype=float) ** 2 / GRAVITY
    if depth == np.inf:
        return deep
    k = deep / np.sqrt(np.tanh(deep * depth))
    for _ in range(8):
        tanh = np.tanh(k * depth)
        k = k - (k * tanh - deep) / (tanh + k * depth * (1.0 - tanh**2))
    return k


def jonswap(frequency: np.ndarray, significant_height: float, peak_period: float, gamma: float) -> np.ndarray:
    """Return the spectrum S of the module [m² s] at dense frequencies [rad/s], over which its integral is H_s²/16."""
    omega, peak = np.asarray(frequency, dtype=float), 2.0 * np.pi / peak_period
    width = np.where(omega < peak, 0.07, 0.09)
    shape = (peak / omega) ** 5 * np.exp(-1.25 * (peak / omega) ** 4)
    shape *= gamma ** np.exp(-0.5 * ((omega / peak - 1.0) / width) ** 2)
    spectrum: np.ndarray = shape * significant_height**2 / 16.0 / np.trapezoid(shape, omega)
    return spectrum


@dataclass(frozen=True, kw_only=True)
class Waves:
    """Waves of one direction, as a sum of components.

    Attributes:
        frequency: ω of the components (n,). [rad/s]
        amplitude: a (n,). [m]
        phase: ε (n,); at 0 there is a crest at the origin at time 0. [rad]
        direction: towards which they run, from north to east. [rad]
        depth: h; infinite when not given. [m]

    Raises:
        subzero.UserError: numbers that are not finite, not positive, or not equally many.
    """

    frequency: np.ndarray
    amplitude: np.ndarray
    phase: np.ndarray
    direction: float = 0.0
    depth: float = np.inf

    def __post_init__(self) -> None:
        """Raise an error if the fields are no waves."""
        for name in ("frequency", "amplitude", "phase"):
            object.__setattr__(self, name, _array("Waves", name, getattr(self, name), 1))
        if (
            not self.frequency.size == self.amplitude.size == self.phase.size
            or not (self.frequency > 0.0).all()
        ):
            raise BadValueError(
                "Waves: give a frequency above 0, an amplitude and a phase of every component."
            )
        checked("Waves", "direction", self.direction, unit="rad")
        if self.depth != np.inf:
            checked("Waves", "depth", self.depth, above=0.0, unit="m")

    @classmethod
    def regular(cls, height: float, period: float, *, phase: float = 0.0, **where: float) -> Waves:
        """Return one wave of a height [m] and a period [s]; `direction` and `depth` as the attributes."""
        height = checked("Waves.regular", "height", height, least=0.0, unit="m")
        omega = 2.0 * np.pi / checked("Waves.regular", "period", period, above=0.0, unit="s")
        return cls(
            frequency=np.array([omega]), amplitude=np.array([0.5 * height]), phase=np.array([phase]), **where
        )

    @classmethod
    def jonswap(
        cls,
        significant_height: float,
        peak_period: float,
        *,
        seed: int,
        gamma: float = 3.3,
        components: int = 200,
        **where: float,
    ) -> Waves:
        """Return irregular waves of the JONSWAP spectrum; γ = 1 is that of Pierson and Moskowitz.

        Args:
            significant_height: H_s. [m]
            peak_period: T_p. [s]
            seed: of the phases: the same seed gives the same waves.
            gamma: γ, 1 to 7. [-]
            components: how many; each has an equal share of the energy.
            where: `direction` and `depth` as the attributes.
        """
        height = checked("Waves.jonswap", "significant_height", significant_height, least=0.0, unit="m")
        peak = 2.0 * np.pi / checked("Waves.jonswap", "peak_period", peak_period, above=0.0, unit="s")
        gamma = checked("Waves.jonswap", "gamma", gamma, least=1.0, most=7.0)
        n = whole("Waves.jonswap: components", components, least=1)
        omega = np.linspace(0.3 * peak, HIGHEST * peak, FINE)
        spectrum = jonswap(omega, 1.0, 2.0 * np.pi / peak, gamma)
        energy = np.concatenate([[0.0], np.cumsum(0.5 * (spectrum[1:] + spectrum[:-1]) * np.diff(omega))])
        middles = np.interp((np.arange(n) + 0.5) / n * energy[-1], energy, omega)
        phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, n)
        return cls(frequency=middles, amplitude=np.full(n, height / np.sqrt(8.0 * n)), phase=phases, **where)

    def angle(self, north: float, east: float, time: float) -> np.ndarray:
        """Return θ of the components (n,). [rad]"""
        along = np.cos(self.direction) * north + np.sin(self.direction) * east
        theta: np.ndarray = (
            wave_number(self.frequency, self.depth) * along - self.frequency * time + self.phase
        )
        return theta

    def elevation(self, north: float, east: float, time: float) -> float:
        """Return η, upwards, at a place [m] and time [s]. [m]"""
        return float(self.amplitude @ np.cos(self.angle(north, east, time)))

    def velocity(self, north: float, east: float, down: float, time: float) -> tuple[float, float, float]:
        """Return the velocity of the water north, east, down (3,) at a place [m] and time [s]. [m/s]"""
        theta, k, d = self.angle(north, east, time), wave_number(self.frequency, self.depth), max(down, 0.0)
        # cosh and sinh of k(h−d) over sinh kh, without numbers that overflow
        near, far, left = np.exp(-k * d), np.zeros(1), np.ones(1)
        if self.depth != np.inf:
            far = np.exp(k * (min(d, self.depth) - 2.0 * self.depth))
            left = 1.0 - np.exp(-2.0 * k * self.depth)
        size = self.amplitude * self.frequency / left
        u, w = float(size * (near + far) @ np.cos(theta)), float(size * (near - far) @ np.sin(theta))
        return u * float(np.cos(self.direction)), u * float(np.sin(self.direction)), -w


@dataclass(frozen=True)
class Motion:
    """A prescribed motion of a point: called with a time [s] it gives the velocity north, east, down (3,). [m/s]

    So it is a `tow_velocity` of `cable.pull_out` and `cable.tow`, or the `velocity` of a `cable.MovingDrum`;
    `place(0.0)` is an end for `cable.hold`, and `state(t)` one for `cable.Tether`.

    Attributes:
        state: function of time [s] that gives place [m] and velocity [m/s], north, east, down (2, 3).
    """

    state: Callable[[float], np.ndarray]

    def __call__(self, time: float) -> np.ndarray:
        """Return the velocity (3,). [m/s]"""
        velocity: np.ndarray = self.state(time)[1]
        return velocity

    def place(self, time: float) -> np.ndarray:
        """Return the place (3,). [m]"""
        place: np.ndarray = self.state(time)[0]
        return place

    @classmethod
    def of_record(cls, time: Numbers, place: Numbers, velocity: Numbers | None = None) -> Motion:
        """Return the smooth motion through recorded places: a cubic spline, by the velocities where there are any.

        Args:
            time: increasing (n,); at least 4, or 2 with velocities. [s]
            place: north, east, down (n, 3). [m]
            velocity: (n, 3). [m/s]

        Raises:
            subzero.UserError: numbers that make no sense; later, a time that the record does not cover.
        """
        from scipy.interpolate import CubicHermiteSpline, CubicSpline  # heavy

        t, x = _array("Motion", "time", time, 1), _array("Motion", "place", place, 2)
        v = None if velocity is None else _array("Motion", "velocity", velocity, 2)
        if t.size < (4 if v is None else 2) or not (np.diff(t) > 0.0).all() or x.shape != (t.size, 3):
            raise BadValueError(
                f"Motion: {t.size} times that increase need as many places (n, 3); got {x.shape}."
            )
        if v is not None and v.shape != x.shape:
            raise BadValueError(
                f"Motion: velocity has the shape {v.shape}; give one for every place, {x.shape}."
            )
        path: Any = CubicSpline(t, x) if v is None else CubicHermiteSpline(t, x, v)
        rate = path.derivative()

        def state(now: float) -> np.ndarray:
            if not t[0] - 1e-9 <= now <= t[-1] + 1e-9:
                raise BadValueError(
                    f"Motion: the record covers {t[0]:g} to {t[-1]:g} s, and {now:g} s was asked for. Run shorter."
                )
            return np.array([path(now), rate(now)])

        return cls(state)

    @classmethod
    def read(cls, path: str | Path) -> Motion:
        """Return the motion in a CSV file: a row of names, then time, north, east, down, and velocities if known.

        Raises:
            subzero.UserError: a file that is not there or holds something else.
        """
        try:
            rows = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
        except (OSError, ValueError) as error:
            raise BadValueError(f"Motion.read: {path} is no table of numbers with commas: {error}") from error
        if rows.shape[1] not in (4, 7):
            raise BadValueError(
                f"Motion.read: {path} has {rows.shape[1]} columns; it must have 4 (time, north, east, down) or 7 (with"
                " the velocities north, east, down)."
            )
        return cls.of_record(rows[:, 0], rows[:, 1:4], rows[:, 4:] if rows.shape[1] == 7 else None)


@dataclass(frozen=True, kw_only=True)
class VesselResponse:
    """Response amplitude operators of a vessel at its reference point, for the direction of the waves.

    Surge is ahead, sway to starboard, heave up; roll starboard down, pitch bow up, yaw bow to starboard.

    Attributes:
        frequency: increasing (n,); beyond the first and the last the values there hold. [rad/s]
        amplitude: of surge, sway, heave [m/m], roll, pitch, yaw [rad/m] per amplitude of the wave (n, 6).
        phase: by which each lags behind the crest at the reference point (n, 6). [rad]

    Raises:
        subzero.UserError: numbers that are not finite, do not increase, or have other shapes.
    """

    frequency: np.ndarray
    amplitude: np.ndarray
    phase: np.ndarray

    def __post_init__(self) -> None:
        """Raise an error if the fields are no response."""
        for name, dimensions in (("frequency", 1), ("amplitude", 2), ("phase", 2)):
            object.__setattr__(self, name, _array("VesselResponse", name, getattr(self, name), dimensions))
        shape = (self.frequency.size, 6)
        if (
            self.amplitude.shape != shape
            or self.phase.shape != shape
            or not (np.diff(self.frequency) > 0.0).all()
        ):
            raise BadValueError(
                f"VesselResponse: amplitude and phase must be {shape} (frequencies, degrees of freedom), at"
                f" frequencies that increase; got {self.amplitude.shape} and {self.phase.shape}."
            )

    def motion(
        self,
        waves: Waves,
        *,
        hang_off: Numbers = (0.0, 0.0, 0.0),
        heading: float = 0.0,
        place: Numbers = (0.0, 0.0, 0.0),
        velocity: Numbers = (0.0, 0.0, 0.0),
        ramp: float = 0.0,
    ) -> Motion:
        """Return the motion of the point at which a cable hangs: surge, sway, heave and (small) angles × lever.

        Args:
            waves: what the vessel is in, of any direction; the operators must be those for it.
            hang_off: ahead, to starboard and down of the reference point (3,). [m]
            heading: of the vessel, from north to east. [rad]
            place: of the hang-off at time 0, in calm water (3,). [m]
            velocity: of the vessel under way (3,); waves are met as it goes. [m/s]
            ramp: the answer grows smoothly within so long, from rest; 0 begins at once. [s]
        """
        given = {"hang_off": hang_off, "place": place, "velocity": velocity}
        lever, start, speed = (_array("motion", name, values, 1) for name, values in given.items())
        if not lever.shape == start.shape == speed.shape == (3,):
            raise BadValueError("VesselResponse.motion: hang_off, place and velocity are three numbers each.")
        ramp = checked("VesselResponse.motion", "ramp", ramp, least=0.0, unit="s")
        answer = self._at_hang_off(
            waves, lever, checked("VesselResponse.motion", "heading", heading, unit="rad")
        )
        to_reference = start - _turned(lever, heading)
        ahead = np.array([np.cos(waves.direction), np.sin(waves.direction), 0.0])
        met = wave_number(waves.frequency, waves.depth) * float(ahead @ speed) - waves.frequency

        def state(t: float) -> np.ndarray:
            at = to_reference + t * speed
            turning = np.exp(1j * waves.angle(at[0], at[1], t))
            moved, rate = (answer @ turning).real, (answer @ (1j * met * turning)).real
            u = min(t / ramp, 1.0) if ramp > 0.0 else 1.0
            share = u**3 * (10.0 - 15.0 * u + 6.0 * u * u)
            growth = 30.0 * (u * (1.0 - u)) ** 2 / max(ramp, 1e-30)
            return np.array([start + t * speed + share * moved, speed + share * rate + growth * moved])

        return Motion(state)

    def _at_hang_off(self, waves: Waves, lever: np.ndarray, heading: float) -> np.ndarray:
        """Return the complex amplitudes of the hang-off north, east, down (3, components); times exp(iθ). [m]"""
        table = self.amplitude * np.exp(1j * self.phase)  # θ falls with time: a lag adds to it
        six = (
            np.array([np.interp(waves.frequency, self.frequency, column) for column in table.T])
            * waves.amplitude
        )
        six[2] *= -1.0  # heave is up, the third axis down
        arm = np.cross(six[3:], lever[:, None], axis=0)
        return _turned(six[:3] + arm, heading)


def _turned(vector: np.ndarray, heading: float) -> np.ndarray:
    """Return vectors (3, …) ahead, to starboard, down as north, east, down."""
    c, s = np.cos(heading), np.sin(heading)
    turned: np.ndarray = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ vector
    return turned


def _array(owner: str, name: str, values: object, dimensions: int) -> np.ndarray:
    """Return finite numbers as an array of so many dimensions; raise an error for anything else."""
    array = numbers_in(values)
    if array is None or array.ndim != dimensions or not np.isfinite(array).all():
        raise BadValueError(
            f"{owner}: {name} is {short(values)}; it must be finite numbers, {dimensions}-dimensional."
        )
    return array
