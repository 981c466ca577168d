"""A trial as values: everything a run needs, checked, in SI units and radians.

A `Trial` comes from `scenarios.load`. To change one, make a new one, with `Trial.with_changes` or
``dataclasses.replace(trial, duration=60.0)``: values are checked where they are made, with the limits of the files, and
a `ScenarioError` reports all problems. Propeller speeds are in revolutions per second, the one unit here that is not
SI.

Signs: axes are north-east-down; depth is positive down; heading runs clockwise from north; a positive rudder
turns the heading to starboard (it increases); positive stern-planes (both) pitch the nose up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import Any

import numpy as np

from scenarios.checks import Checks
from scenarios.command_columns import command_faults
from scenarios.errors import Problem, ScenarioError
from scenarios.instructions import REACH_THE_END, Commands, Motion, ends_early
from scenarios.quantities import (
    BED,
    CONTROLS,
    PROFILE,
    RUN,
    SCHEMES,
    START,
    STATION,
    VESSEL,
    WATER,
    WINCH,
    Quantity,
    by_field,
)
from scenarios.steps import even_times, misfits, run_times
from subzero.errors import short
from subzero.files.text_repr import Overview, shown

SETPOINT = dict(zip(CONTROLS, (*WINCH[1:], None), strict=True))
"""Control of a winch → the quantity that it follows."""

PLACES: dict[str, dict[str, int | slice]] = {
    "commands": {"time": 0, "values": slice(1, None)},
    "winch": {"time": 0, "setpoint": 1},
    "vessel": {"time": 0, "velocity": slice(1, None)},
    "station": {"time": 0, "place": slice(1, 4), "heading": 4},
    "water": {"depth": 0, "velocity": slice(1, None)},
}
"""Section → the fields of its value that hold its lists → the places of these lists in the table of quantities."""

ONLY_DEFAULT_CABLE = ("tangential_added_mass_coefficient", "internal_damping", "bending_stiffness")
"""Numbers of a cable that only the default scheme knows."""
ONLY_DEFAULT = "the paper's scheme knows a limp cable on a free drum on the shore, and a uniform current"


def only_default(asked: list[str]) -> str:
    """Return the remedy for features that only the default scheme has."""
    return f'Set scheme = "{SCHEMES[0]}", or leave out {" and ".join(asked)}.'


RUN_FIELDS, START_FIELDS = by_field(RUN), by_field(START)
"""Fields of a trial that hold the numbers of [run], and those of a start, with their quantities."""

GIVEN_AT_TRIM = {
    "heading",
    "roll",
    "depth",
    "surge_speed",
    "wet_length",
    "drum_north",
    "drum_east",
    "drum_down",
}
FOUND_BY_TRIM = tuple(name for name in START_FIELDS if name not in GIVEN_AT_TRIM)
"""Fields of a start that may not be given with a start in trim."""
FOUND_WHY = "a start with at_trim finds it"
TRIM_NEEDS_SPEED = "a start with at_trim holds a forward speed: fins need a flow"


@dataclass(frozen=True, kw_only=True)
class Start:
    """How the vehicle lies at t = 0.

    Attributes:
        heading: ψ, clockwise from north. [rad]
        pitch: θ, positive nose up. [rad]
        roll: φ, positive starboard side down. [rad]
        depth: of the hull centre, positive down. [m]
        surge_speed: u, forward speed over ground. [m/s]
        sway_speed: v, to starboard. [m/s]
        heave_speed: w, along the body's down axis. [m/s]
        roll_rate: p. [rad/s]
        pitch_rate: q, positive: the nose goes up. [rad/s]
        yaw_rate: r, positive to starboard. [rad/s]
        propeller_speed: n; a motor without lag runs as commanded from the first instant. [rev/s]
        rudder_angle: where the rudder stands; a servo without lag and rate limit stands as commanded. [rad]
        stern_plane_port_angle: the same of the port stern-plane. [rad]
        stern_plane_starboard_angle: the same of the starboard stern-plane. [rad]
        at_trim: begin in the steady level motion at this surge speed, depth and wet length, which determines the
            pitch, the other speeds and the actuators that hold it; commands remain those of the trial.
        wet_length: cable already in the water, laid straight behind the vehicle. [m]
        drum_north: where the drum is from the tow point, northwards: the cable then hangs at rest between them. [m]
        drum_east: the same, eastwards. [m]
        drum_down: the same, downwards; all three 0: the cable is laid straight. [m]
    """

    heading: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0
    depth: float = 0.0
    surge_speed: float = 0.0
    sway_speed: float = 0.0
    heave_speed: float = 0.0
    roll_rate: float = 0.0
    pitch_rate: float = 0.0
    yaw_rate: float = 0.0
    propeller_speed: float = 0.0
    rudder_angle: float = 0.0
    stern_plane_port_angle: float = 0.0
    stern_plane_starboard_angle: float = 0.0
    at_trim: bool = False
    wet_length: float = 0.0
    drum_north: float = 0.0
    drum_east: float = 0.0
    drum_down: float = 0.0

    def __post_init__(self) -> None:
        """Raise an error if the fields do not form a start."""
        check = Checks(self)
        check.numbers(START_FIELDS)
        if check.kind("at_trim", (bool,)) and self.at_trim:
            for name in FOUND_BY_TRIM:
                if getattr(self, name):
                    check.say(name, FOUND_WHY, "Leave it at 0.", getattr(self, name))
        check.refuse()
        if self.at_trim and not self.surge_speed > 0.0:
            check.say("surge_speed", TRIM_NEEDS_SPEED, "Above 0 m/s.", self.surge_speed)
        check.refuse()

    @property
    def velocity(self) -> tuple[float, float, float, float, float, float]:
        """u, v, w, p, q, r over ground, body axes. [m/s, rad/s]."""
        return (
            self.surge_speed,
            self.sway_speed,
            self.heave_speed,
            self.roll_rate,
            self.pitch_rate,
            self.yaw_rate,
        )

    @property
    def fins(self) -> tuple[float, float, float]:
        """Where rudder, port and starboard stern-plane stand. [rad]."""
        return self.rudder_angle, self.stern_plane_port_angle, self.stern_plane_starboard_angle

    @property
    def drum(self) -> tuple[float, float, float] | None:
        """Where the drum is from the tow point, north, east, down; None where a straight cable says so. [m]."""
        place = self.drum_north, self.drum_east, self.drum_down
        return place if any(place) else None


@dataclass(frozen=True, kw_only=True)
class Profile:
    """A current that changes with depth, linear between the depths; beyond them the first and the last value hold.

    Attributes:
        depth: increasing, positive down, of the water and not of the drum. [m]
        velocity: north, east, down at each depth, added to the uniform current. [m/s]
    """

    depth: tuple[float, ...]
    velocity: tuple[tuple[float, float, float], ...]

    def __post_init__(self) -> None:
        """Raise an error if the fields do not form a profile."""
        _keep_lists(self, Checks(self), "water", PROFILE, what="Depths", first=None)


@dataclass(frozen=True, kw_only=True)
class Winch:
    """The winch that turns the drum, linear between the times; after the last one the last value holds.

    Attributes:
        control: one of `CONTROLS`.
        time: starts at 0 and increases; none for a brake. [s]
        setpoint: rate at which cable comes off, negative to reel in [m/s]; or the tension at the drum [N].
    """

    control: str
    time: tuple[float, ...] = ()
    setpoint: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Raise an error if the fields do not form a winch."""
        check = Checks(self)
        if not isinstance(self.control, str) or self.control not in CONTROLS:
            check.say("control", "a winch cannot do this", f"Allowed: {', '.join(CONTROLS)}.", self.control)
            check.refuse()
        quantity = SETPOINT[self.control]
        if quantity is not None:
            _keep_lists(self, check, "winch", (WINCH[0], quantity))
            return
        for name in PLACES["winch"]:
            object.__setattr__(self, name, ())


@dataclass(frozen=True, kw_only=True)
class Vessel:
    """How the drum moves, linear between the times; after the last one the last velocity holds.

    Attributes:
        time: starts at 0 and increases. [s]
        velocity: north, east, down at each time, over ground. [m/s]
    """

    time: tuple[float, ...]
    velocity: tuple[tuple[float, float, float], ...]

    def __post_init__(self) -> None:
        """Raise an error if the fields do not form a vessel."""
        _keep_lists(self, Checks(self), "vessel", VESSEL)


@dataclass(frozen=True, kw_only=True)
class Station:
    """The place, depth and heading that the thrusters hold or follow, linear between the times; then the last hold.

    Attributes:
        time: starts at 0 and increases. [s]
        place: north and east of the start, and depth, at each time. [m]
        heading: at each time, clockwise from north, beyond full turns. [rad]
        bandwidth: natural frequency of station keeping. [rad/s]
    """

    time: tuple[float, ...] = (0.0,)
    place: tuple[tuple[float, float, float], ...] = ((0.0, 0.0, 0.0),)
    heading: tuple[float, ...] = (0.0,)
    bandwidth: float = STATION[0].default or 1.0

    def __post_init__(self) -> None:
        """Raise an error if the fields do not form a station."""
        check = Checks(self)
        check.number("bandwidth", STATION[0])
        _keep_lists(self, check, "station", STATION[1:])


def _keep_lists(
    value: Any, check: Checks, section: str, rows: tuple[Quantity, ...], **increasing: Any
) -> None:
    """Check the lists of a value that is being made, of which the first increases, and keep them as tuples.

    Args:
        value: of a section of `PLACES`.
        check: its checks, which are refused here.
        section: its name.
        rows: the quantities of its lists.
        increasing: how the first one increases, see `Checks.increasing`.
    """
    first, *others = PLACES[section].items()
    main = check.rows(first[0], rows[:1])
    arrays = {first[0]: main}
    for name, place in others:
        own = rows[place] if isinstance(place, slice) else (rows[place],)
        arrays[name] = check.rows(name, own, None if main is None else main.size)
    if main is not None:
        check.increasing(first[0], main, **increasing)
    check.refuse()
    for name, array in arrays.items():
        listed = [] if array is None else array.tolist()
        object.__setattr__(value, name, tuple(tuple(x) if isinstance(x, list) else x for x in listed))


@shown
@dataclass(frozen=True, kw_only=True)
class Trial:
    """A vehicle on a cable in water, and its instructions; one of `commands` and `motion` is None.

    Attributes:
        name: name of the shipped scenario, or of the user's file without its ending.
        description: one line.
        text: the TOML source, for the record.
        source: the scenario as the user named it, name or path.
        duration: how long the run lasts; where it is no whole number of cable steps, the last step is another. [s]
        hull_step: time step of the vehicle. [s]
        cable_step: time step of the cable and of the exchange, a whole number of hull steps. [s]
        segment_length: length of a cable segment, at the vehicle. [m]
        grading: segments get longer by this much per metre of cable from the vehicle. [-]
        far_length: farther than this from both ends of the cable, they are joined to longer ones: [m]
        far_grading: by this much per metre; 0 leaves them as they are. [-]
        every: time between results that are kept, a whole number of cable steps; 0 keeps all. The last is kept. [s]
        rtol: error of the tow force that is allowed, as a share of its largest: where the run and a coarser one differ
            by more, steps and segments are halved (`subzero.simulation.refinement`); 0 takes them as they are. [-]
        budget: how long runs with halved steps may take in all; 0 for ten times the plain run. [s]
        scheme: one of `SCHEMES`.
        start: how the vehicle lies at t = 0.
        vehicle: section → key → SI value; sections may hold sections.
        cable: key → SI value, the fields of ``cable.CableProperties``.
        drum: key → SI value, the fields of ``cable.DrumProperties``.
        tolerances: dotted name of a number of vehicle, cable or drum → how far a healthy vehicle may be from it, of
            those whose file or trial says so; one standard deviation, in the number's unit.
        current: velocity of the water, north, east, down, the same everywhere. [m/s]
        profile: velocity of the water that is added to it by depth.
        sea_bed: depth of a flat sea bed, which a run that goes below it warns of; 0 is not known. [m]
        winch: the winch that turns the drum; None for a free drum.
        vessel: how the drum moves; None for a drum on the shore.
        station: that the thrusters of the vehicle keep; None for none.
        commands: the commands to the actuators.
        motion: the prescribed motion.
    """

    name: str
    description: str
    text: str
    source: str
    duration: float
    hull_step: float = 0.02
    cable_step: float = 0.1
    segment_length: float = 0.5
    grading: float = 0.0
    far_length: float = 40.0
    far_grading: float = 0.2
    every: float = 0.0
    rtol: float = 0.02
    budget: float = 0.0
    scheme: str = "moving_end"
    start: Start
    vehicle: Mapping[str, Any]
    cable: Mapping[str, float]
    drum: Mapping[str, float]
    tolerances: Mapping[str, float] = field(default_factory=dict)
    current: tuple[float, float, float] = (0.0, 0.0, 0.0)
    profile: Profile | None = None
    sea_bed: float = 0.0
    winch: Winch | None = None
    vessel: Vessel | None = None
    station: Station | None = None
    commands: Commands | None = None
    motion: Motion | None = None

    def __post_init__(self) -> None:
        """Raise an error if the fields do not form a trial."""
        check = Checks(self)
        for name in ("name", "description", "text", "source"):
            check.kind(name, (str,))
        check.numbers(RUN_FIELDS)
        if not isinstance(self.scheme, str) or self.scheme not in SCHEMES:
            check.say("scheme", "this is not a scheme", f"Allowed: {', '.join(SCHEMES)}.", self.scheme)
        check.vector("current", WATER)
        check.number("sea_bed", BED[0])
        check.kind("start", (Start,))
        parts = {"commands": Commands, "motion": Motion, "profile": Profile, "winch": Winch, "vessel": Vessel}
        parts |= {"station": Station}
        there = {name for name, kind in parts.items() if check.kind(name, (kind,), optional=True)}
        if {"commands", "motion"} <= there:
            check.say("motion", "commands are given too", "Keep one of commands and motion.")
        if {"station", "motion"} <= there:
            check.say("station", "a prescribed motion keeps no station", "Keep one of station and motion.")
        for name in ("vehicle", "cable", "drum", "tolerances"):
            check.mapping(name)
        check.refuse()
        if self.motion is not None and self.motion.is_smooth and self.motion.time[-1] < self.duration - 1e-9:
            check.say("motion", ends_early(self.duration), REACH_THE_END, float(self.motion.time[-1]))
        if self.motion is not None and self.start.at_trim:
            check.say("start", "a prescribed motion says how it starts", "Leave out at_trim.")
        for name, value, why, remedy in misfits({n: getattr(self, n) for n in RUN_FIELDS} | vars(self.start)):
            check.say(name, why, remedy, value)
        if self.commands is not None and self.commands.listed:
            for key, found, why, remedy in command_faults(
                self.commands.listed, self.commands.values, self.vehicle
            ):
                check.say(key, why, remedy, found)
        asked = [name for name in ("profile", "winch", "vessel", "grading") if getattr(self, name)]
        asked += [name for name in ONLY_DEFAULT_CABLE if self.cable.get(name, 0.0) > 0.0]
        if self.scheme != SCHEMES[0] and asked:
            check.say("scheme", ONLY_DEFAULT, only_default(asked), self.scheme)
        check.refuse()

    @property
    def stride(self) -> int:
        """Every so many times a result is kept. [-]"""
        return max(1, round(self.every / self.cable_step))

    def with_changes(self, changes: Mapping[str, float | Sequence[float]]) -> Trial:
        """Return a trial with other values for some of its numbers; this one is not changed.

        >>> import scenarios
        >>> thick = scenarios.load("fig6").with_changes({"cable.diameter": 0.003, "start.heading_deg": 90.0})
        >>> thick.cable["diameter"]
        0.003

        Args:
            changes: dotted name → value, in the units of the files: "vehicle.rigid_body.mass", "run.duration_s",
                "water.current_east_m_s", "commands.rudder_deg[1]" (`scenarios.parameters` has them all). A list
                takes one value for all its elements, or a sequence of as many.

        Raises:
            ScenarioError: as the reader of files says it, all that is wrong at once: names that the trial does not
                have, values outside their limits, values that do not fit together.
        """
        # The names of all numbers stand above trials, and are fetched only where they are needed.
        parameters = import_module("scenarios.parameters")
        if not isinstance(changes, Mapping) or not all(isinstance(name, str) for name in changes):
            why, remedy = "this is no mapping of names to values", 'Write {"cable.diameter": 0.003}.'
            raise ScenarioError([Problem(file=self.name, found=short(changes), why=why, remedy=remedy)])
        single: dict[str, float] = parameters.element_values(self, changes)
        changed: Trial = parameters.with_parameters(self, single)
        changes_made = "".join(f"# changed: {name} = {float(value)!r}\n" for name, value in single.items())
        return replace(changed, text=f"{self.text.rstrip()}\n{changes_made}" if changes_made else self.text)

    def _overview(self) -> Overview:
        """Return the kind of trial, its duration, its start, and the instructions of the vehicle."""
        start, cable = self.start, self.cable
        heading, speed = np.degrees(start.heading), start.surge_speed
        diameter, mass = (1e3 * cable.get(name, 0.0) for name in ("diameter", "mass_per_length"))
        lies = f"heading {heading:g}°, depth {start.depth:g} m, speed {speed:g} m/s"
        flow = f"north {self.current[0]:g}, east {self.current[1]:g} m/s"
        drum = self.winch.control.replace("_", " ") if self.winch else "free"
        made = f"{diameter:g} mm, {mass:g} g/m, segments of {self.segment_length:g} m, scheme {self.scheme}"
        reported = self.commands if self.commands is not None else self.motion
        rows = [
            ("duration", f"{self.duration:g} s, hull in steps of {self.hull_step:g} s"),
            ("start", f"{lies}, {start.wet_length:g} m of cable out"),
            ("cable", made),
            ("current", flow + (", with a profile" if self.profile else "")),
            ("drum", drum + (", on a vessel" if self.vessel else "")),
        ]
        if reported is not None:
            kind = "commands" if reported is self.commands else "motion"
            rows.append((kind, f"{len(reported.time)} rows, to {float(reported.time[-1]):g} s"))
        rows.append(("change it", 'trial.with_changes({"cable.diameter": 0.003})'))
        return Overview(f"Trial {self.name}: {self.description}", rows)

    def times(self) -> np.ndarray:
        """Return the times of a run (n,): whole cable steps from 0, and a last step that ends the run. [s]."""
        return run_times(self.duration, self.cable_step)

    def even_times(self) -> np.ndarray:
        """Return times that are one cable step apart (n,): to the end, or to the first whole step beyond it. [s]."""
        return even_times(self.duration, self.cable_step)
