"""What no effect of the catalogue is, and the engine was not made with: six forces, and a sensor that wanders off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.external_force import AXES, MissingForce, Term


@dataclass(frozen=True, kw_only=True, eq=False)
class Strange:
    """Something outside the catalogue.

    Attributes:
        kind: its name.
        axis: of its force or moment, or the channel that drifts.
        force: what acts.
        drift: of the channel, at times. [display unit]
    """

    kind: str
    axis: str
    force: MissingForce | None = None
    drift: Callable[[np.ndarray], np.ndarray] | None = None

    @property
    def features(self) -> tuple[str, ...]:
        """The features of its formula; none for a history."""
        return tuple(term.feature for term in self.force.terms) if self.force else ()

    def on(self, setting: Setting) -> Setting:
        """Return a setting with it."""
        if self.force is None:
            return setting
        later = tuple((time, model) for time, model in setting.later)
        assert not later
        return setting.with_model(missing=self.force)


def _history(axis: str, end: float, shape: Callable[[np.ndarray], np.ndarray]) -> MissingForce:
    times = np.linspace(0.0, end, int(end / 0.1) + 1)
    wrench = np.zeros((times.size, len(AXES)))
    wrench[:, AXES.index(axis)] = shape(times)
    return MissingForce(time=tuple(times.tolist()), wrench=tuple(map(tuple, wrench.tolist())))


def _bump(times: np.ndarray, start: float, length: float) -> np.ndarray:
    """Return a smooth bump of height 1."""
    x = np.clip((times - start) / length, 0.0, 1.0)
    return np.sin(np.pi * x) ** 2


def snag(rng: np.random.Generator, end: float, size: float) -> Strange:
    """The cable is caught for some seconds, and comes free."""
    start, length = rng.uniform(0.25, 0.6) * end, rng.uniform(3.0, 6.0)
    return Strange(
        kind="snag", axis="X", force=_history("X", end, lambda t: -0.5 * size * _bump(t, start, length))
    )


def surges(rng: np.random.Generator, end: float, size: float) -> Strange:
    """Waves push it forward and back."""
    period, phase = rng.uniform(5.0, 8.0), rng.uniform(0.0, 6.28)
    force = _history("X", end, lambda t: 0.4 * size * np.sin(2.0 * np.pi * t / period + phase))
    return Strange(kind="surges", axis="X", force=force)


def knock(rng: np.random.Generator, end: float, size: float) -> Strange:
    """Something turns it, for some seconds."""
    start, length, side = rng.uniform(0.25, 0.7) * end, rng.uniform(3.0, 6.0), rng.choice([-1.0, 1.0])
    force = _history("N", end, lambda t: 0.03 * side * size * _bump(t, start, length))
    return Strange(kind="knock", axis="N", force=force)


def shifting(rng: np.random.Generator, end: float, size: float) -> Strange:
    """A weight inside slides forward and back."""
    start, length, side = rng.uniform(0.2, 0.4) * end, rng.uniform(8.0, 12.0), rng.choice([-1.0, 1.0])
    force = _history("M", end, lambda t: 0.02 * side * size * _bump(t, start, length))
    return Strange(kind="shifting", axis="M", force=force)


def weed(rng: np.random.Generator, end: float, size: float) -> Strange:
    """Weed gathers on the hull: its drag grows with time."""
    term = Term("X", "time*u2", -size * rng.uniform(0.8, 1.5) / end)
    return Strange(kind="weed", axis="X", force=MissingForce(terms=(term,)))


def tumbling(rng: np.random.Generator, end: float, size: float) -> Strange:
    """A loose part drags hardest when it turns: a force aside with the square of the yaw rate."""
    term = Term("N", "r|r|", -size * rng.uniform(1.0, 2.0))
    return Strange(kind="tumbling", axis="N", force=MissingForce(terms=(term,)))


def heeling(rng: np.random.Generator, end: float, size: float) -> Strange:
    """A hatch works itself open: the hull heels more and more."""
    term = Term("K", "time*u2", size * rng.uniform(0.01, 0.02) * rng.choice([-1.0, 1.0]) / end)
    return Strange(kind="heeling", axis="K", force=MissingForce(terms=(term,)))


def wandering(rng: np.random.Generator, end: float, size: float) -> Strange:
    """A compass wanders off and comes back."""
    start, length, side = rng.uniform(0.1, 0.3) * end, rng.uniform(0.4, 0.7) * end, rng.choice([-1.0, 1.0])
    return Strange(
        kind="wandering", axis="heading", drift=lambda t: 4.0 * side * size * _bump(t, start, length)
    )


KINDS = (snag, weed, surges, knock, shifting, heeling, tumbling, wandering)
