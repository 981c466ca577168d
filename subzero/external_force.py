"""A force that the model lacks: as a history, as a formula of named features, or both. A value, and a part of a model.

    w(t) = w_history(t) + Σ c · feature(state) on one axis each,      feature = a · b · c of FACTORS

Forces and moments act on the hull, about its centre, along the body's axes. Velocities in the features are those
relative to the water. What is deliberately left out: features of the past (a lag, a play) and of the cable's shape.

To add a feature, add a row to FEATURES; to add a factor, one to FACTORS and one line to `fill_factors`.

`subzero.engine.external_wrench` adds it, at an instant, to the wrench on the hull, in the compiled loop.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from subzero.errors import BadValueError, real, short, suggestion
from subzero.jit import compiled

AXES = ("X", "Y", "Z", "K", "M", "N")
"""Forward, to starboard, down [N]; roll, pitch and yaw moment [N m]."""

FACTORS = (
    *("1", "u", "v", "w", "p", "q", "r", "|u|", "|v|", "|w|", "|p|", "|q|", "|r|"),
    *("n", "|n|", "rudder", "stern", "length", "time", "depth"),
)
"""What features are products of; velocities relative to the water [m/s, rad/s], shaft speed [rev/s], angles of rudder
and stern-planes (their mean) in the water [rad], length of cable in the water at the last exchange [m], time since the
start [s], depth [m]."""


@dataclass(frozen=True)
class Feature:
    """A product of up to three factors.

    Attributes:
        factors: three names of FACTORS.
        unit: of a coefficient, per newton (or per newton metre): "s2/m2" makes N s2/m2; "1" leaves N.
        words: its description.
    """

    factors: tuple[str, str, str]
    unit: str
    words: str


def _read(table: str) -> dict[str, Feature]:
    """Turn rows ``name ; factors ; unit ; words`` into features by name."""
    rows = [[cell.strip() for cell in line.split(";")] for line in table.strip().splitlines()]
    padded = {name: (*factors.split(), "1", "1")[:3] for name, factors, _, _ in rows}
    return {name: Feature(padded[name], unit, words) for name, _, unit, words in rows}  # type: ignore[arg-type]


FEATURES = _read("""
constant       ; 1             ; 1     ; nothing: it is constant
u              ; u             ; s/m   ; the speed through the water
u|u|           ; u |u|         ; s2/m2 ; the square of the speed through the water
uv             ; u v           ; s2/m2 ; speed times sway speed
ur             ; u r           ; s2/m  ; speed times yaw rate
v|v|           ; v |v|         ; s2/m2 ; the square of the sway speed
r|r|           ; r |r|         ; s2    ; the square of the yaw rate
uw             ; u w           ; s2/m2 ; speed times heave speed
uq             ; u q           ; s2/m  ; speed times pitch rate
w|w|           ; w |w|         ; s2/m2 ; the square of the heave speed
q|q|           ; q |q|         ; s2    ; the square of the pitch rate
p|p|           ; p |p|         ; s2    ; the square of the roll rate
rudder_angle*u2; rudder u u    ; s2/m2 ; rudder angle times the square of the speed
stern_plane*u2 ; stern u u     ; s2/m2 ; stern-plane angle times the square of the speed
n|n|           ; n |n|         ; s2    ; the square of the propeller speed
n u            ; n u           ; s2/m  ; propeller speed times speed through the water
wet_length     ; length        ; 1/m   ; the length of cable in the water
wet_length*u2  ; length u u    ; s2/m3 ; the length of cable in the water times the square of the speed
time           ; time          ; 1/s   ; the time since the start
time*u2        ; time u u      ; s/m2  ; the time since the start times the square of the speed
depth          ; depth         ; 1/m   ; the depth
""")
"""Every feature by name."""


@dataclass(frozen=True)
class Term:
    """A coefficient times a feature, on one axis.

    Attributes:
        axis: one of AXES.
        feature: one of FEATURES.
        coefficient: in `unit`.

    Raises:
        UserError: an axis or a feature that is not known, or a coefficient that is no finite number.
    """

    axis: str
    feature: str
    coefficient: float

    def __post_init__(self) -> None:
        """Raise an error for a name that is not in the tables."""
        for word, known in ((self.axis, AXES), (self.feature, tuple(FEATURES))):
            if not isinstance(word, str) or word not in known:
                raise BadValueError(
                    f"A missing force has the term {short(word)}.{suggestion(word, known)}"
                    f" Known: {', '.join(known)}."
                )
        coefficient = real(self.coefficient)
        if coefficient is None:
            name = f"The coefficient of {self.feature!r} on {self.axis}"
            raise BadValueError(f"{name} is {short(self.coefficient)}; it must be finite.")
        object.__setattr__(self, "coefficient", coefficient)

    @property
    def unit(self) -> str:
        """Unit of the coefficient, such as N s2/m2."""
        force, per = "N" if self.axis in "XYZ" else "N m", FEATURES[self.feature].unit
        return force if per == "1" else f"{force} {per}"


@dataclass(frozen=True, kw_only=True)
class MissingForce:
    """A force that a model lacks.

    Attributes:
        time: of the history, not decreasing; a time that stands twice is a jump. Outside, the history is 0. [s]
        wrench: X, Y, Z [N], K, M, N [N m] at these times, linear in between.
        terms: the formula.

    Raises:
        UserError: a history that is no history.
    """

    time: tuple[float, ...] = ()
    wrench: tuple[tuple[float, ...], ...] = ()
    terms: tuple[Term, ...] = ()

    def __post_init__(self) -> None:
        """Raise an error if the fields do not form a history."""
        try:
            time, wrench = np.array(self.time), np.array(self.wrench)
        except (ValueError, TypeError, OverflowError):
            time = wrench = np.array(None)
        if not {time.dtype.kind, wrench.dtype.kind} <= set("iuf"):
            raise BadValueError("A missing force has a history of what are no numbers.")
        if wrench.shape != (*time.shape, 6) and (time.size or wrench.size):
            raise BadValueError(
                f"A missing force has {time.size} times and a wrench of shape {wrench.shape};"
                " allowed: six numbers a time."
            )
        if not (np.isfinite(time).all() and np.isfinite(wrench).all()):
            raise BadValueError("A missing force has a history with numbers that are not finite.")
        if np.any(np.diff(time) < 0.0):
            raise BadValueError("A missing force has times that decrease; they must be in order.")
        if not isinstance(self.terms, tuple) or not all(isinstance(term, Term) for term in self.terms):
            raise BadValueError("A missing force has terms that are none; they must be a tuple of Term.")
        object.__setattr__(self, "time", tuple(time.astype(float).tolist()))
        object.__setattr__(self, "wrench", tuple(map(tuple, wrench.astype(float).tolist())))

    def __add__(self, other: MissingForce | None) -> MissingForce:
        """Return both forces together."""
        if other is None:
            return self
        terms = self.terms + other.terms
        if not (self.time and other.time):
            first = self if self.time else other
            return MissingForce(time=first.time, wrench=first.wrench, terms=terms)
        times = sorted({*self.time, *other.time} | _edges(self) | _edges(other))
        total = history_at(self, np.array(times)) + history_at(other, np.array(times))
        return MissingForce(time=tuple(times), wrench=tuple(map(tuple, total.tolist())), terms=terms)

    def numbers(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the history, rows time and components (7, n), and the terms (m, 5): axis, factors, coefficient."""
        added = np.zeros((7, len(self.time)))
        added[0], added[1:] = self.time, np.reshape(self.wrench, (-1, 6)).T
        rows = [
            (AXES.index(t.axis), *map(FACTORS.index, FEATURES[t.feature].factors), t.coefficient)
            for t in self.terms
        ]
        return added, np.array(rows, dtype=float).reshape(-1, 5)


MOMENT = 1e-9
"""Just outside a history, for its sudden ends. [s]"""


def _edges(force: MissingForce) -> set[float]:
    """Return times just outside a history, where it is 0 already."""
    return {force.time[0] - MOMENT, force.time[-1] + MOMENT}


def history_at(force: MissingForce, times: np.ndarray) -> np.ndarray:
    """Return the history (n, 6) at times (n,), without the terms. [N, N m]."""
    if not force.time:
        return np.zeros((times.size, 6))
    columns = np.asarray(force.wrench, dtype=float).T
    return np.stack([np.interp(times, force.time, column, left=0.0, right=0.0) for column in columns], axis=1)


@compiled
def fill_factors(
    nu_r: np.ndarray,
    n: float,
    rudder: float,
    stern: float,
    length: float,
    time: float,
    depth: float,
    out: np.ndarray,
) -> None:
    """Fill out (len(FACTORS),) with the factors, from the velocity relative to the water (6,) and the rest of them."""
    out[0] = 1.0
    for i in range(6):
        out[1 + i], out[7 + i] = nu_r[i], abs(nu_r[i])
    out[13], out[14], out[15], out[16] = n, abs(n), rudder, stern
    out[17], out[18], out[19] = length, time, depth


def feature_value(name: str, factors: np.ndarray) -> np.ndarray:
    """Return a feature of factors (…, len(FACTORS)), as `fill_factors` fills them or `factors_of` returns them."""
    a, b, c = (factors[..., FACTORS.index(factor)] for factor in FEATURES[name].factors)
    return a * b * c
