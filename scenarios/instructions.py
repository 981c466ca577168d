"""The instructions of a vehicle, as values: commands to its actuators, or a motion that is prescribed.

Commands are sampled and held: `Commands.at` says what holds at a time, and nothing else in the product does.

The paper evaluates the cable from the states (u, v, w, p, q, r, φ, θ, ψ) of the vehicle, "measured by the on-board
sensors or predicted by the dynamical model" (section 3, step 2), and shows it on an idealised vehicle (section 4.1),
whose motion is linear between a few times. Both are a `Motion`.
`subzero.engine.prescribed_motion` makes a smooth one of its samples.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from scenarios.checks import Checks
from scenarios.heading import continuous, expected
from scenarios.quantities import COMMANDS, INTERPOLATIONS, LINEAR, MOTION, SMOOTH, Quantity, by_field
from scenarios.steps import held
from subzero.errors import short as shown

REQUIRED = tuple(by_field(tuple(q for q in MOTION if q.default is None)))
"""Fields of every motion; those of a motion of the paper's idealised vehicle."""
LONGEST_GAP = 1.0
"""A smooth motion is not known where samples are further apart than this … [s]"""
GAP_RATIO = 5.0
"""… and than so many of its usual (median) sampling intervals. [-]"""

REACH_THE_END = "Give samples to the end of the run, or shorten the duration to the last of them."


ANY_COMMAND = Quantity(
    name="", unit="1", low=-1e6, high=1e6, default=0.0, meaning="its unit and limits are the actuator's"
)
"""Of a listed actuator, as far as one knows without its vehicle."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Commands:
    """The commands to the actuators; each sample is held until the next, the last one to the end.

    Attributes:
        time: starts at 0 and increases. Shape (samples,). [s]
        values: propeller [rev/s], rudder [rad], port and starboard stern-plane [rad], and one for each of `listed`, in
            its own unit. Shape (samples, 4 and more).
        listed: names of listed actuators that are commanded, as in `vehicle.Vehicle.channels`; the others stand at 0.
    """

    time: np.ndarray
    values: np.ndarray
    listed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Raise an error if the fields do not form commands; keep arrays of their own that cannot be changed."""
        check = Checks(self)
        time = check.rows("time", COMMANDS[:1])
        if not (isinstance(self.listed, list | tuple) and all(isinstance(name, str) for name in self.listed)):
            check.say("listed", "these are no names", "Give a tuple of texts.", self.listed)
            check.refuse()
        object.__setattr__(self, "listed", tuple(self.listed))
        further = tuple(replace(ANY_COMMAND, name=name) for name in self.listed)
        values = check.rows("values", COMMANDS[1:] + further, None if time is None else time.size)
        if time is not None:
            check.increasing("time", time)
        if len(set(self.listed)) < len(self.listed):
            check.say("listed", "a name stands twice", "Give each actuator one column.", self.listed)
        check.refuse()
        assert time is not None and values is not None  # noqa: PT018  # `refuse` has seen to it
        check.freeze("time", time)
        check.freeze("values", values)

    def at(self, time: np.ndarray | float) -> np.ndarray:
        """Return the commands at some times, the sample that holds: shape of `time`, then (4 and more,).

        >>> fin = Commands(time=np.array([0.0, 2.0]), values=np.array([[9.0, 0.0, 0.0, 0.0], [9.0, 0.1, 0.0, 0.0]]))
        >>> fin.at(np.array([0.0, 1.9, 2.0, 50.0]))[:, 1].tolist()
        [0.0, 0.0, 0.1, 0.1]
        """
        return held(self.time, self.values, time)


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """A prescribed motion: of the paper's idealised vehicle (section 4.1), or one that was measured (section 3).

    *Linear* between the samples, with kinks that jolt the cable, and after the last sample the last values hold: so is
    a motion of speed, pitch and heading alone, unless it asks for the other. Sway, heave and roll are zero; pitch and
    yaw rates are the slopes of pitch and heading.

    *Smooth* between the samples, and known as far as the last one: so is a motion that says more. Its angles and its
    place are cubics through the samples with the rates and speeds given as slopes
    (`subzero.engine.prescribed_motion`). What is not given: sway, heave and roll are zero, rates the slopes of the
    angles, and the place is where the speeds lead. A place that is given is believed: its noise is noise in the speed
    of the tow point. Heading and roll may jump by whole turns.

    Attributes:
        time: starts at 0 and increases. Shape (samples,). [s]
        surge_speed: u. Shape (samples,). [m/s]
        pitch: θ, positive nose up. Shape (samples,). [rad]
        heading: ψ, clockwise from north. Shape (samples,). [rad]
        sway_speed: v, to starboard; None if it is not known, as all that follow. Shape (samples,). [m/s]
        heave_speed: w, along the body's down axis. Shape (samples,). [m/s]
        roll: φ, positive starboard side down. Shape (samples,). [rad]
        roll_rate: p; only together with a roll. Shape (samples,). [rad/s]
        pitch_rate: q. Shape (samples,). [rad/s]
        yaw_rate: r. Shape (samples,). [rad/s]
        north: place of the hull centre. Shape (samples,). [m]
        east: place of the hull centre. Shape (samples,). [m]
        depth: place of the hull centre, positive down; counts before the start's depth. Shape (samples,). [m]
        interpolation: one of `INTERPOLATIONS`; None: as said above.
    """

    time: np.ndarray
    surge_speed: np.ndarray
    pitch: np.ndarray
    heading: np.ndarray
    sway_speed: np.ndarray | None = None
    heave_speed: np.ndarray | None = None
    roll: np.ndarray | None = None
    roll_rate: np.ndarray | None = None
    pitch_rate: np.ndarray | None = None
    yaw_rate: np.ndarray | None = None
    north: np.ndarray | None = None
    east: np.ndarray | None = None
    depth: np.ndarray | None = None
    interpolation: str | None = None

    def __post_init__(self) -> None:
        """Raise an error if the fields do not form a motion; keep arrays of their own that cannot be changed."""
        check, columns = Checks(self), by_field(MOTION)
        given = [name for name in columns if name in REQUIRED or getattr(self, name) is not None]
        time = check.rows("time", MOTION[:1])
        count = None if time is None else time.size
        arrays = {name: check.rows(name, (columns[name],), count) for name in given}
        if time is not None:
            check.increasing("time", time)
        for name, why, remedy in motion_faults(given, self.interpolation):
            check.say(name, why, remedy)
        check.refuse()
        object.__setattr__(self, "interpolation", interpolation_of(given, self.interpolation))
        for name, array in arrays.items():
            if array is not None:
                check.freeze(name, self._continuous(name, array) if self.is_smooth else array)
        at = gap_at(self.time) if self.is_smooth else None
        if at is not None:
            check.say(f"time[{at}]", *gap_in_words(self.time, at), self.time[at])
        check.refuse()

    def _continuous(self, name: str, angle: np.ndarray) -> np.ndarray:
        """Return a heading or a roll without jumps of whole turns; other fields as they are."""
        rates = {"heading": self.yaw_rate, "roll": self.roll_rate}
        if name not in rates:
            return angle
        return continuous(angle, expected(np.asarray(self.time), rates[name]), math.tau)

    @property
    def is_smooth(self) -> bool:
        """Whether it is smooth between its samples."""
        return self.interpolation == SMOOTH

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the fields that are given over time."""
        return tuple(name for name in by_field(MOTION) if name != "time" and getattr(self, name) is not None)


def interpolation_of(given: Collection[str], asked: str | None) -> str:
    """Return how a motion that gives some fields goes on between its samples."""
    if asked is not None:
        return asked
    return SMOOTH if set(given) - set(REQUIRED) else LINEAR


def motion_faults(given: Collection[str], asked: str | None) -> list[tuple[str, str, str]]:
    """Return the problems of a motion that gives some fields: the field, the reason, and the remedy."""
    faults = []
    more = [name for name in given if name not in REQUIRED]
    if not (asked is None or (isinstance(asked, str) and asked in INTERPOLATIONS)):  # asked may be an array
        allowed = f"Allowed: {', '.join(INTERPOLATIONS)}."
        faults.append(("interpolation", f"a motion knows no interpolation {shown(asked)}", allowed))
    elif asked == LINEAR and more:
        why = f"a linear motion has speed, pitch and heading alone, and here is {', '.join(more)} too"
        faults.append(("interpolation", why, f'Leave out the others, or take "{SMOOTH}".'))
    if "roll_rate" in given and "roll" not in given:
        faults.append(("roll_rate", "a roll rate is given, and no roll", "Give both, or neither."))
    return faults


def gap_at(time: np.ndarray) -> int | None:
    """Return the first sample of a smooth motion that comes too late after the one before it; None if none does."""
    intervals = np.diff(time)
    if not intervals.size:
        return None
    late = np.flatnonzero(intervals > max(LONGEST_GAP, GAP_RATIO * float(np.median(intervals))))
    return int(late[0]) + 1 if late.size else None


def gap_in_words(time: np.ndarray, at: int) -> tuple[str, str]:
    """Return why a gap before sample `at` is not possible, and the remedy."""
    gap, usual = time[at] - time[at - 1], float(np.median(np.diff(time)))
    why = f"nothing is known for {gap:g} s before it, in a record with a sample every {usual:g} s"
    return why, "Fill the gap, or end the run before it."


def ends_early(duration: float) -> str:
    """Return why the last sample of a smooth motion comes too soon."""
    return f"the motion is known until then, and the run lasts {duration:g} s"
