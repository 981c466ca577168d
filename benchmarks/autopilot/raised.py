"""The gain margin of a flight itself: one loop's gain is raised until what it does to a fin or the propeller grows.

A flight of the coupled simulation begins with the cable that it would have paid out by then, settles for some seconds
at the autopilot's own gain, and then has one command's deviation from its steady value multiplied, at the plant's
input, where `autopilot.loop_margins` opens the loop. A small pulse of the command sets it off. Whether it grows is read
off the command's third difference from sample to sample, which does not know the slow change that a growing cable asks
for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from subzero import autopilot
from subzero.simulation.stepper import Simulator

from .trials import trial, tuning

SAMPLE = 0.1
"""Sample time of the autopilots. [s]"""
SETTLED = 5.0
"""The gain is raised then. [s]"""
EARLY, LATE = (1.5, 3.5), (7.0, 10.0)
"""Windows after that, between which the flight grows or does not. [s]"""
LOOPS = ("speed", "heading", "pitch", "roll")
PULSES = np.array([0.1, 1e-3, 1e-3, 1e-3])
"""Pulse of a sample's length on the command of each loop [rev/s, rad]."""


@dataclass(frozen=True, kw_only=True)
class Raised:
    """A flight with one loop's gain raised.

    Attributes:
        loop: speed, heading, pitch or roll.
        pilot: pid or lqr.
        speed: wanted. [m/s]
        wet_length: of the cable in the middle of what is looked at; without a cable for 0. [m]
    """

    loop: str
    pilot: str
    speed: float
    wet_length: float

    def grows(self, factor: float) -> bool:
        """Say whether the flight grows with this factor on the loop's gain."""
        rough = np.abs(np.diff(self._commanded(factor), n=3))
        early, late = (
            np.max(rough[round(begin / SAMPLE) : round(end / SAMPLE)]) for begin, end in (EARLY, LATE)
        )
        return bool(late > early)

    def margin(self, near: float, *, within: float = 0.3, to: float = 0.02) -> float:
        """Return the factor from which on the flight grows, to a share `to` of `near`; nan if not found `within`."""
        low, high = near * (1.0 - within), near * (1.0 + within)
        if self.grows(low) or not self.grows(high):
            return float("nan")
        while high - low > to * near:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.grows(middle) else (middle, high)
        return 0.5 * (low + high)

    def _commanded(self, factor: float) -> np.ndarray:
        """Return the command of the loop after the gain was raised (n,)."""
        fig6, seen = trial("fig6"), []
        wet = max(self.wet_length - self.speed * (SETTLED + 0.5 * (EARLY[0] + LATE[1])), 0.0)
        start = replace(fig6.start, surge_speed=self.speed, wet_length=wet)
        flown = replace(fig6, start=start, duration=SETTLED + LATE[1])
        sim = Simulator(flown, tethered=self.wet_length > 0.0, sample_time=SAMPLE)
        pilot = autopilot.make(self.pilot, flown, tuning=tuning())
        pilot.reset()
        goal, i = autopilot.Wanted(self.speed, start.heading), LOOPS.index(self.loop)
        steady, obs = np.zeros(4), sim.observation
        while sim.time < SETTLED + LATE[1] - 0.05:
            given = _loops(np.array(pilot.update(obs, goal)))
            if sim.time < SETTLED - 0.05:
                steady = given.copy()
            else:
                given[i] = steady[i] + factor * (given[i] - steady[i])
                seen.append(given[i])
                given[i] += PULSES[i] * (len(seen) == 1)
            obs = sim.step(_commands(given))
        return np.array(seen)


def _loops(command: np.ndarray) -> np.ndarray:
    """Return propeller, rudder, planes together and unlike of a command (4,)."""
    n, rudder, port, starboard = command
    return np.array([n, rudder, 0.5 * (starboard + port), 0.5 * (starboard - port)])


def _commands(loops: np.ndarray) -> np.ndarray:
    """Return the command (4,) of `_loops`."""
    n, rudder, together, unlike = loops
    return np.array([n, rudder, together - unlike, together + unlike])
