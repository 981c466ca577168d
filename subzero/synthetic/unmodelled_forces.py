"""Unmodelled forces that act on vehicles and are in no catalogue, to plant in a record: no cause can name them.

Each kind draws its size and times, and says which axis it acts on and, where there is one, which feature of
`subzero.external_force` its formula has. Sizes are shares of the drag of the hull at 1 m/s, so they fit any vehicle.

To add a kind: a function (draw) → `UnmodelledForce`, and a line in KINDS.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.external_force import AXES, FACTORS, MissingForce, Term, feature_value, fill_factors, history_at
from subzero.synthetic.reference_run import Truth


@dataclass(frozen=True, kw_only=True)
class UnmodelledForce:
    """A force that is not in the catalogue.

    Attributes:
        name: of its kind.
        sentence: its description.
        axis: where it acts, at most.
        feature: of its formula, "" for one that is a function of time alone.
        missing: the force.
        window: from when to when its formula holds; all the time if None. [s]
    """

    name: str
    sentence: str
    axis: str
    feature: str = ""
    missing: MissingForce
    window: tuple[float, float] | None = None

    def apply(self, setting: Setting) -> Setting:
        """Return the setting with the force."""
        without = setting.model
        with_it = replace(without, missing=self.missing + without.missing)
        if self.window is None:
            later = tuple((t, replace(m, missing=self.missing + m.missing)) for t, m in setting.later)
            return replace(setting, model=with_it, later=later)
        first, last = self.window
        return replace(setting, later=((first, with_it), (last, without)))


def force_along(unmodelled: UnmodelledForce, setting: Setting, truth: Truth) -> np.ndarray:
    """Return the force (n, 6) at the times of a truth of the setting, which a diagnosis should recover. [N, N m]"""
    times, factors = truth.run.times, factors_of(setting, truth)
    total = history_at(unmodelled.missing, times)
    for term in unmodelled.missing.terms:
        total[:, AXES.index(term.axis)] += term.coefficient * feature_value(term.feature, factors)
    if unmodelled.window is not None:
        inside = (times >= unmodelled.window[0] - 1e-9) & (times <= unmodelled.window[1] + 1e-9)
        total[~inside] = 0.0
    return total


def factors_of(setting: Setting, truth: Truth) -> np.ndarray:
    """Return the factors of features (n, len(FACTORS)) along a truth, see `subzero.external_force`."""
    r = truth.run.recording
    water = setting.model.water()
    out = np.zeros((truth.run.times.size, len(FACTORS)))
    for row, time in enumerate(truth.run.times):
        nu_r = r.state[row, 7:13].copy()
        nu_r[:3] -= r.rotation[row].T @ water.at(r.state[row, :3], time)
        rudder, port, starboard = r.fins[row]
        n, length, depth = r.state[row, 13], truth.length[row], r.state[row, 2]
        fill_factors(nu_r, n, rudder, 0.5 * (port + starboard), length, time, depth, out[row])
    return out


EDGE_S = 0.2
"""How long a sudden force takes to come. [s]"""
HISTORY_STEP_S = 0.1
"""Times of histories that are no straight lines, and grid of windows. [s]"""


@dataclass(frozen=True)
class Draw:
    """The inputs of a draw: a generator, duration of the trial [s], drag of the hull at 1 m/s [N], its length [m]."""

    rng: np.random.Generator
    duration: float
    force: float
    length: float

    def size(self, low: float, high: float) -> float:
        """Return a size between two, either sign, evenly in its logarithm."""
        return float(self.rng.choice([-1.0, 1.0]) * np.exp(self.rng.uniform(np.log(low), np.log(high))))

    def between(self, low: float, high: float) -> float:
        """Return a number between two."""
        return float(self.rng.uniform(low, high))

    def window(self, shortest: float, longest: float) -> tuple[float, float]:
        """Return when something begins and ends, in the middle of the trial, on the grid. [s]"""
        lasts = min(self.between(shortest, longest), 0.4 * self.duration)
        begins = self.between(0.25 * self.duration, 0.85 * self.duration - lasts)
        return round(begins / HISTORY_STEP_S) * HISTORY_STEP_S, round(
            (begins + lasts) / HISTORY_STEP_S
        ) * HISTORY_STEP_S


def _history(axis: str, time: np.ndarray, values: np.ndarray) -> MissingForce:
    """Return a history on one axis."""
    wrench = np.zeros((time.size, 6))
    wrench[:, AXES.index(axis)] = values
    return MissingForce(time=tuple(time.tolist()), wrench=tuple(map(tuple, wrench.tolist())))


def _pulse(axis: str, window: tuple[float, float], size: float) -> MissingForce:
    """Return a pulse with short edges."""
    first, last = window
    time = np.array([first, first + EDGE_S, last - EDGE_S, last])
    return _history(axis, time, size * np.array([0.0, 1.0, 1.0, 0.0]))


def _formula(
    name: str, sentence: str, term: Term, *more: Term, window: tuple[float, float] | None = None
) -> UnmodelledForce:
    """Return a force by a formula: on the axis, and with the feature, of its first term."""
    missing = MissingForce(terms=(term, *more))
    return UnmodelledForce(
        name=name, sentence=sentence, axis=term.axis, feature=term.feature, missing=missing, window=window
    )


def snag(draw: Draw) -> UnmodelledForce:
    """A weed, a net, a rope: held for some seconds."""
    size = -draw.force * abs(draw.size(0.25, 0.8))
    return UnmodelledForce(
        name="snag",
        sentence="the vehicle was held back for some seconds",
        axis="X",
        missing=_pulse("X", draw.window(2.5, 6.0), size),
    )


def fouling_shed(draw: Draw) -> UnmodelledForce:
    """Something caught on the hull, and shed again."""
    c = draw.force * abs(draw.size(0.25, 0.8))
    words = "something clung to the hull for a while"
    return _formula("fouling_shed", words, Term("X", "u|u|", -c), window=draw.window(6.0, 12.0))


def waves(draw: Draw) -> UnmodelledForce:
    """A slow swell across or from below."""
    axis = str(draw.rng.choice(["Y", "Z"]))
    time = np.arange(0.0, draw.duration + HISTORY_STEP_S, HISTORY_STEP_S)
    period, phase = draw.between(4.0, 6.0), draw.between(0.0, 2.0 * np.pi)
    wave = draw.force * abs(draw.size(0.25, 0.8)) * np.sin(2.0 * np.pi * time / period + phase)
    words = "sideways" if axis == "Y" else "up and down"
    return UnmodelledForce(
        name="waves", sentence=f"a swell pushed {words}", axis=axis, missing=_history(axis, time, wave)
    )


def fouling_grows(draw: Draw) -> UnmodelledForce:
    """A drag that grows all the time."""
    c = draw.force * abs(draw.size(0.4, 1.2)) / draw.duration
    return _formula("fouling_grows", "the drag of the hull grew all the time", Term("X", "time*u2", -c))


def asymmetric_nose(draw: Draw) -> UnmodelledForce:
    """A lateral force at the bow, with the square of the speed."""
    c = draw.force * draw.size(0.1, 0.3)
    terms = Term("Y", "u|u|", c), Term("N", "u|u|", 0.4 * draw.length * c)
    return _formula("bent_nose", "the water pushed the bow sideways", *terms)


def pitch_moment(draw: Draw) -> UnmodelledForce:
    """A pure moment with the square of the speed, without the force of a stern-plane."""
    c = draw.force * draw.length * draw.size(0.03, 0.1)
    return _formula("pitch_moment", "the water pitched the hull", Term("M", "u|u|", c))


def roll_pulse(draw: Draw) -> UnmodelledForce:
    """A heel that comes and goes."""
    size = draw.force * draw.length * draw.size(0.01, 0.03)
    return UnmodelledForce(
        name="roll_pulse",
        sentence="something heeled the hull for some seconds",
        axis="K",
        missing=_pulse("K", draw.window(3.0, 7.0), size),
    )


def dying_push(draw: Draw) -> UnmodelledForce:
    """A push at the launch that dies away."""
    time, lasts = np.arange(0.0, draw.duration + HISTORY_STEP_S, HISTORY_STEP_S), draw.between(3.0, 8.0)
    push = draw.force * draw.size(0.25, 0.8) * np.exp(-time / lasts)
    return UnmodelledForce(
        name="dying_push",
        sentence="a push at the launch died away",
        axis="X",
        missing=_history("X", time, push),
    )


def race_yaw(draw: Draw) -> UnmodelledForce:
    """A yaw moment of the propeller's race."""
    c = draw.force * draw.length * draw.size(0.02, 0.06) / 25.0**2
    return _formula("race_yaw", "the propeller's race turned the hull", Term("N", "n|n|", c))


def thrust_lost(draw: Draw) -> UnmodelledForce:
    """Air or weed in the propeller for some seconds."""
    c = draw.force * abs(draw.size(0.5, 1.2)) / 25.0**2
    words = "the propeller lost thrust for some seconds"
    return _formula("thrust_lost", words, Term("X", "n|n|", -c), window=draw.window(3.5, 5.0))


def leak(draw: Draw) -> UnmodelledForce:
    """Water that comes in, all the time."""
    c = draw.force * abs(draw.size(0.2, 0.6)) / draw.duration
    return _formula("leak", "the vehicle took in water", Term("Z", "time", c))


KINDS: dict[str, Callable[[Draw], UnmodelledForce]] = {
    kind.__name__: kind
    for kind in (
        *(snag, fouling_shed, waves, fouling_grows, asymmetric_nose, pitch_moment),
        *(roll_pulse, dying_push, race_yaw, thrust_lost, leak),
    )
}
"""Every kind by name."""
ALSO_CAUSES = {"leak": "flooding", "fouling_grows": "fouling"}
"""Kinds that come close to a cause of the catalogue, which may be named for them."""


def draw_unmodelled(
    setting: Setting, seed: int | np.random.Generator, kind: str | None = None
) -> UnmodelledForce:
    """Return a force that is not in the catalogue, of a given kind or of any."""
    rng, hull = np.random.default_rng(seed), setting.model.vehicle
    name = kind or str(rng.choice(list(KINDS)))
    force = abs(hull.numbers().axial_drag)
    return KINDS[name](Draw(rng, setting.trial.duration, force, hull.hull.length))
