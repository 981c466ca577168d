"""Why a run of the default scheme stopped: when, where, and the remedy for such stops.

What to try was found on random trials that stop (`python -m benchmarks.stops` follows the advice, and counts): a limp
cable wants shorter steps; a stiff one longer segments, in which it cannot fold (shorter steps make it worse); one that
a winch forces to a length wants a winch that gives way. A message names settings as the caller's users know them, and
how to change them, in words that a program can follow: "a shorter step", "more wet_length", "compliance = 1e-3".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cable.drum import FREE, LENGTH, TENSION, DrumNumbers
from cable.moving_end.state import NEW, NOW, Line
from cable.properties import CableNumbers
from subzero.errors import short

EQUATIONS = ("length", "northward balance", "eastward balance", "downward balance")
NEARLY_TAUT = 0.999
"""A cable whose ends are this share of its length apart, or more, and that has no solution, is too short."""
SHORT_SEGMENTS = 3.0
"""A cable of fewer segments than this has hardly left the drum."""


class Names(NamedTuple):
    """The names of the settings where the advice is read."""

    step: str = "step"
    segment: str = "segment_length"
    wet: str = "wet_length"
    rate: str = "rate"
    yielding: str = "a cable.ConstantTension"


def describe_stop(
    time: float, line: Line, drum: DrumNumbers, c: CableNumbers, names: Names | None = None
) -> str:
    """Return why a run could not go on beyond `time` [s], where, and the advice.

    Args:
        time: of the last result. [s]
        line: the cable, with the failed step on level NEW.
        drum: the drum or winch.
        c: the cable's numbers.
        names: of the settings.
    """
    # The most specific cause comes first; the last message is for all others.
    words, solved = names or Names(), line.ends.solved
    way = float(np.linalg.norm(line.position[NEW, 0] - drum.place))
    if drum.control == LENGTH and way >= NEARLY_TAUT * drum.setpoint:
        return (
            f"The cable is too short beyond t = {time:g} s: the winch has paid out {drum.setpoint:.5g} m, the vehicle "
            f"is {way:.5g} m away. Try {words.yielding}, or a higher {words.rate}."
        )
    # The step was solved, but there is no space for more cable.
    if solved.converged:
        return (
            f"The drum has given far more cable until t = {time:g} s than the ways of its ends ask for: nothing holds "
            "it back. Try more friction_torque, or a winch."
        )
    # The residual is within its tolerance: the step was refused because it takes up cable (`time_step`).
    if solved.residual <= 1.0 and drum.control == FREE:
        return (
            f"The cable would push itself back onto the drum beyond t = {time:g} s, and a free drum takes none up. "
            f"Try {_remedy(line, drum, c, words)}, or more friction_torque."
        )
    return (
        f"The cable could not be solved beyond t = {time:g} s: after {solved.iterations} Newton iterations "
        f"{_worst(line)}. Try {_remedy(line, drum, c, words)}."
    )


def _worst(line: Line) -> str:
    """Return which equation is off most."""
    solved = line.ends.solved
    place = f"the {EQUATIONS[solved.worst_equation]} at node {solved.worst_node}"
    if not np.isfinite(solved.residual):
        return f"{place} is not a number"
    return f"{place} is off by {max(solved.residual, 1.0):.1e} times its tolerance"


def _remedy(line: Line, drum: DrumNumbers, c: CableNumbers, words: Names) -> str:
    """Return the remedy for most stops of this kind, the surest first."""
    if hasattr(c, "bending_stiffness"):
        return f"a longer {words.segment}, or bending_stiffness = 0"
    length = float(line.ends.settled + line.ends.last_length[NOW])
    if drum.control == TENSION and length < SHORT_SEGMENTS * float(line.ends.layout.segment_length):
        return f"more {words.wet}, or a shorter {words.step}"
    if drum.control == LENGTH and not line.ends.layout.free_end:
        return f"{words.yielding}, compliance = 1e-3, or a higher {words.rate}"
    return f"a shorter {words.step}, or a longer {words.segment}"


def describe_jump(now: float, dt: float, here: np.ndarray, states: np.ndarray) -> str:
    """Return which end of a tether jumps, and how far; `here` and `states` are before and after it (ends, 2, 3)."""
    miss = states[:, 0] - here[:, 0] - 0.5 * dt * (here[:, 1] + states[:, 1])
    end = int(np.argmax(np.linalg.norm(miss, axis=1)))
    way, before, after = np.linalg.norm([states[end, 0] - here[end, 0], here[end, 1], states[end, 1]], axis=1)
    return (
        f"At t = {now:g} s ends[{end}] is to move {way:.4g} m within {dt:g} s, at {before:.4g} m/s before and "
        f"{after:.4g} m/s after: it jumps. Give the velocity that belongs to the motion, take shorter steps, or make "
        "another tether where the host was put elsewhere."
    )


def describe_bad_number(now: float, states: np.ndarray) -> str:
    """Return which end of a tether a host gave a place or a velocity that is no number; states (ends, 2, 3)."""
    end, row = np.argwhere(~np.isfinite(states).all(axis=2))[0]
    return (
        f"At t = {now:g} s the host gave ends[{end}] the {('place', 'velocity')[row]} "
        f"{short(states[end, row].tolist())}: three finite numbers are needed, north, "
        "east, down. Look one step earlier in the host for where it comes from."
    )


def describe_reach(now: float, states: np.ndarray, most: float, c: CableNumbers) -> str:
    """Return that the ends of a tether would be farther apart than `most` [m] of cable can be; states (ends, 2, 3)."""
    way = float(np.linalg.norm(states[0, 0] - states[-1, 0]))
    can = "be pulled to twice that" if c.compliance else "not stretch"
    return (
        f"At t = {now:g} s the ends are to be {way:.6g} m apart, and there are {most:.6g} m of cable, which can {can}. "
        "Pay out, hold the ends back, or give the cable a compliance."
    )
