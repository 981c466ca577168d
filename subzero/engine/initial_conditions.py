"""The start of a run: the constants and the state of a run, from a trial and a model.

The cable is laid straight behind the vehicle, or hangs at rest between it and a drum that is somewhere else.

The vehicle starts in the state that the trial gives, or in trim: the steady level motion (`subzero.steady_motion`) at
the start's speed over ground, with the wet cable in steady tow. Pitch, heave, propeller and fins are those that hold
it. The water around the vehicle is taken as uniform.

A model may change in mid-run (a fin is struck, the cable is caught, a current sets in): the run then starts again
from where it stands, with other numbers. Vehicle, cable and drum keep position and speed. The energy that a sudden
change of a mass would take is not recorded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import degrees
from typing import Any

import numba
import numpy as np

import scenarios
from cable import CableProperties, SeaBed
from cable.drum import FREE, LENGTH
from cable.drum_motion import SETPOINT, lead_drum
from cable.hold import hold
from cable.moving_end import (
    FLOWS,
    NOW,
    STORED,
    Line,
    accept,
    energy_flow,
    lay_held,
    lay_straight,
    new_line,
    new_load,
    start_in_water,
    take_jolt,
    try_step,
)
from cable.task import START_LENGTH
from subzero.engine.environment import drum_direction, drum_of
from subzero.engine.external_wrench import sample_current, tow_direction, tow_point
from subzero.engine.prescribed_motion import knots
from subzero.engine.recording import new_recording, record_row
from subzero.engine.run_state import LINEAR_ROWS, Fixed, HullWork, Ledger, Live, Now, Orders, Setup
from subzero.engine.station_keeping import INTEGRALS, station_of
from subzero.engine.vehicle_step import pose
from subzero.errors import UserError, printable, short, suggestion
from subzero.external_force import MissingForce
from subzero.jit import Call, allocating, compile_in_parallel, compiled, made_once
from subzero.model import Model
from vehicle import POWERS, Vehicle, initial_state, kinetic_energy, rotation
from vehicle.channels import FIRST_COMMAND
from vehicle.state import LINKAGE, POSITION, SERVO, VELOCITY

FORCE_TOLERANCE = 1e-9
"""Hull and cable agree when their forces differ by less than this fraction (and 1e-11 N)."""
RUN_IN = 2.0
"""A cable that begins shorter than this, on a free drum, has shorter segments up to here: `spacing` in
`cable.moving_end.state`. With even ones it is a straight line until it is 1.5 of them long; then its force jumps, by
an error of first order. A winch may pay out slack, which short segments would fold. [m]"""
NO_WEIGHT = 1e-4
"""A cable that weighs less in water is neutral. [N/m]"""
NOTHING = MissingForce()
FIRST_SPARE_SEGMENTS = 16
"""Segments that are allocated for a new cable, beyond those that are in the water."""


def prepare(
    trial: scenarios.Trial,
    model: Model,
    tethered: bool,
    state: np.ndarray | None = None,
    longest_exchange: float | None = None,
    run_in: float = RUN_IN,
    spare: int = FIRST_SPARE_SEGMENTS,
) -> tuple[Setup, Live]:
    """Return the constants and the state of a run at its start: the cable laid straight behind the vehicle.

    Args:
        trial: the trial to simulate.
        model: vehicle, cable, drum and water.
        tethered: with the cable of the default scheme.
        state: another first state than that of the trial.
        longest_exchange: longest exchange to allocate the hull's steps for; that of the trial by default. [s]
        run_in: length up to which a cable that begins shorter, on a free drum, has short segments; 0 for even ones. [m]
        spare: number of segments to allocate beyond those in the water.

    Raises:
        UserError: a start that cannot be.
    """
    wet = _wet_length(trial)
    size = model.vehicle.state_size + (INTEGRALS if trial.station is not None else 0)
    longest = longest_exchange or max(trial.cable_step, float(np.diff(trial.times()).max()))
    steps = most_hull_steps(longest, trial.hull_step)
    setup = setup_of(trial, model, tethered)
    first = first_state(trial, model, tethered) if state is None else state
    live = Live(
        now=_new_now(),
        state=first if first.size == size else np.concatenate([first, np.zeros(size - first.size)]),
        path=np.zeros((steps + 1, size)),
        stages=np.zeros((5, size)),
        powers=np.zeros((steps, len(POWERS))),
        line=new_line(int((wet + RUN_IN) / trial.segment_length) + spare),
        load=new_load(),
    )
    live.line.ends.solver.pulls_only = setup.fixed.snaps
    if tethered and setup.fixed.dtype not in _seen_before:
        _seen_before.add(setup.fixed.dtype)
        compile_in_parallel(lambda: _needed_last(setup, live))
    live.now.length = wet if tethered else 0.0
    layout = live.line.ends.layout
    layout.segment_length, layout.grading = trial.segment_length, trial.grading
    layout.far_length, layout.far_grading = trial.far_length, trial.far_grading
    layout.run_in = run_in if wet < run_in and _can_run_in(setup.fixed) else 0.0
    lay_out(setup, live, wet)
    if trial.start.drum is not None and tethered:
        hang_between(setup, live, trial, model)
    elif trial.start.drum is not None:
        live.now.ledger.cable_old[:] = live.now.ledger.cable_new[:] = (
            0.0  # no cable loses anything in the current
        )
    elif setup.fixed.drum.control != FREE:
        _hang(live.line, float(live.now.guess[2] * setup.fixed.cable.weight))
    return setup, live


_seen_before: set[Any] = set()
"""Types of the constants of tethered runs so far: to name the functions that each needs takes longer than some runs."""


def _needed_last(setup: Setup, live: Live) -> list[Call]:
    """Return the last functions that a run calls, in its order, and their arguments: half of the code that it
    compiles.
    """
    kind, now = numba.typeof, numba.typeof(live.now)
    line, work, c, drum = (kind(each) for each in (live.line, live.load, setup.fixed.cable, setup.fixed.drum))
    step, vector, row = numba.float64, numba.float64[::1], numba.int64
    run = tuple(kind(each) for each in (setup, live, new_recording(1, 1, 1, live.state.size)))
    return [
        (take_jolt, (line, vector, c, drum, work, vector)),
        (try_step, (line, step, now.typeof("tow"), kind(setup.water), c, drum, work, numba.boolean)),
        (accept, (line, step, c, work)),
        (record_row, (*run, row, step, row)),
    ]


@made_once
def _new_now() -> Now:
    """Return the beginning of a run, with a cable that does not pull."""
    work = HullWork(np.zeros((3, 3)), np.zeros(3), np.zeros(6), np.zeros(3))
    ledger = Ledger(
        total=np.zeros(7),
        hull_old=np.zeros(4),
        hull_new=np.zeros(4),
        cable_old=np.zeros(FLOWS),
        cable_new=np.zeros(FLOWS),
        kinetic=0.0,
    )
    vectors = {
        name: np.zeros(3)
        for name in ("force", "force_before", "missed", "guess", "change", "tow", "tow_before", "tug")
    }
    matrices = {name: np.zeros((3, 3)) for name in ("Z", "mobility")}
    return Now(
        **vectors, **matrices, last_step=0.0, pace=np.inf, iterations=0, length=0.0, hull=work, ledger=ledger
    )


def _can_run_in(fixed: Fixed) -> bool:
    """Return whether a cable may begin with short segments: one on a free drum, that is held there or weighs nothing.

    Else its direction at the drum is open (all waves leave), and short segments would follow whatever comes.
    """
    return bool(
        fixed.drum.control == FREE and (fixed.drum.friction > 0.0 or abs(fixed.cable.weight) < NO_WEIGHT)
    )


def setup_of(trial: scenarios.Trial, model: Model, tethered: bool) -> Setup:
    """Return the constants of a run; the place of its drum is still to be filled in."""
    added, terms = (model.missing or NOTHING).numbers()
    return Setup(
        fixed=_fixed(trial, model, tethered, bool(added.size or terms.size)),
        orders=_orders(trial, model.vehicle),
        track=_track(trial),
        water=model.water().numbers(),
        led=drum_direction(trial, model, _wet_length(trial)),
        station=station_of(trial, model.vehicle),
        added=added,
        terms=terms,
    )


def most_hull_steps(span: float, hull_step: float) -> int:
    """Return how many hull steps an exchange of `span` [s] takes at most, as `coupling.hull_steps` counts."""
    return max(1, int(np.ceil(span / hull_step - 1e-6)))


def _wet_length(trial: scenarios.Trial) -> float:
    """Return the length of cable in the water at the start; there is always some, for its direction. [m]."""
    return max(trial.start.wet_length, START_LENGTH)


@compiled
def lay_out(setup: Setup, live: Live, wet: float) -> None:
    """Lay `wet` metres of cable straight behind the tow point, on its way, and put the drum at their end."""
    fixed, now, state = setup.fixed, live.now, live.state
    if setup.fixed.prescribed:
        pose(setup.track, 0.0, state)
    tow_point(state, fixed.r_c, now.hull.rotation, now.tow)
    speed = tow_direction(state, fixed.r_c, now.hull.rotation, now.guess)
    for i in range(3):
        fixed.drum_place[i] = now.tow[i] - wet * now.guess[i]
        setup.water.points[i] = live.line.ends.origin[i] = fixed.drum_place[i]
        pull = fixed.cable.tangential_drag * speed * abs(speed) * wet if fixed.tethered else 0.0
        now.force[i], now.change[i] = -pull * now.guess[i], speed * now.guess[i]
    lead_drum(setup.led, 0.0, fixed.drum)
    lay_straight(live.line, wet, now.guess, now.change, fixed.drum, fixed.cable)
    start_in_water(live.line, setup.water, fixed.cable, live.load)
    energy_flow(live.line, fixed.cable, live.load, now.ledger.cable_new)
    for i in range(FLOWS):
        now.ledger.cable_old[i] = now.ledger.cable_new[i]
    sample_current(setup, state, 0.0, now.hull)
    now.ledger.kinetic = kinetic_energy(state, now.hull.current, fixed.vehicle)


def _hang(line: Line, weight: float) -> None:
    """Add the weight that a winch carries, `weight` [N/m] per length of a straight cable below it."""
    N = int(line.ends.count)
    lengths = np.append(line.length[1:N], line.ends.last_length[NOW])
    along = np.cumsum(lengths)
    line.tension[:, 1 : N + 1] += max(weight, 0.0) * (along - 0.5 * lengths)
    line.node_tension[1 : N + 1] += max(weight, 0.0) * along


def _fixed(trial: scenarios.Trial, model: Model, tethered: bool, lacking: bool) -> Fixed:
    """Return the numbers of a run; the drum's place is still to be filled in."""
    cable, drum = model.cable, drum_of(model).numbers()
    coupled, held = tethered and trial.motion is None, drum.control == LENGTH
    return Fixed(
        vehicle=model.vehicle.own_numbers,
        cable=(_as_joint(cable, model.vehicle, _wet_length(trial)) if coupled and held else cable).numbers(
            _bed_below(trial, model)
        ),
        drum=drum,
        r_c=model.vehicle.tow_point.position(),
        drum_place=np.zeros(3),
        hull_step=trial.hull_step,
        agreement=FORCE_TOLERANCE,
        strength=cable.strength or np.inf,
        tethered=tethered,
        prescribed=trial.motion is not None,
        booked=True,
        lacking=lacking,
        snaps=coupled and held,
        joint=coupled and held and cable.compliance == 0.0,
    )


def _bed_below(trial: scenarios.Trial, model: Model) -> SeaBed | None:
    """Return the sea bed; none where the vehicle begins below it, which its warning says."""
    return model.bed if trial.start.depth <= model.sea_bed else None


JOINT_TIME = 0.03
"""A cable that does not stretch stops a vehicle within so long where a winch holds its length. [s]"""
JOINT_DAMPING = 2.0
"""Share of critical damping in it: the impact is plastic. At 1, 13 % of the velocity come back, at 2 some 5 %. [-]"""


def _as_joint(cable: CableProperties, vehicle: Vehicle, length: float) -> CableProperties:
    """Return a cable whose length a winch holds: a joint of vehicle and drum, if it does not stretch.

    A constraint, and the impulse with which it comes into force, are the limit of a spring with a parallel dashpot,

        e = t₀²/(L M),    τ = 2ζ t₀

    with the mass M of the vehicle along its axis, and t₀ = `JOINT_TIME`, shorter than a step. Impulse and loss are
    those of a plastic impact, whatever t₀ is; how hard the cable pulls within t₀ means nothing. At 2 N, 12 m of cable
    on Subzero II get 0.3 mm longer.

    Args:
        cable: its properties.
        vehicle: the vehicle on its end.
        length: L, in the water at the start. [m]
    """
    if cable.compliance > 0.0:
        return cable
    mass = 1.0 / vehicle.own_numbers.inverse_mass[0, 0]
    compliance = JOINT_TIME * JOINT_TIME / (max(length, 1.0) * mass)
    damping = 2.0 * JOINT_DAMPING * JOINT_TIME / compliance
    return replace(cable, compliance=compliance, internal_damping=damping)


def _orders(trial: scenarios.Trial, vehicle: Vehicle) -> Orders:
    """Return the commands, none for a prescribed motion; those of channels by name, zero for one that is not commanded,
    or written by station keeping.

    Raises:
        UserError: a command to an actuator that the vehicle does not have.
    """
    given, names = trial.commands, [channel.name for channel in vehicle.channels]
    if given is None or trial.station is not None:
        return Orders(np.zeros(1), np.zeros((1, FIRST_COMMAND + len(names))))
    unknown = [name for name in given.listed if name not in names]
    if unknown:
        has = f"It has {', '.join(names)}." if names else "It has none."
        raise UserError(
            f"'{trial.name}' commands {short(unknown[0])}, and this vehicle has no such actuator."
            f"{suggestion(unknown[0], names)} {has}"
        )
    values = np.zeros((given.time.size, FIRST_COMMAND + len(names)))
    values[:, :FIRST_COMMAND] = given.values[:, :FIRST_COMMAND]
    for name, column in zip(given.listed, given.values.T[FIRST_COMMAND:], strict=True):
        values[:, FIRST_COMMAND + names.index(name)] = column
    return Orders(np.array(given.time, dtype=float), values)


def _track(trial: scenarios.Trial) -> np.ndarray:
    """Return the prescribed motion, of one resting sample for a run with commands."""
    motion = trial.motion
    if motion is None:
        return np.zeros((LINEAR_ROWS, 1))
    if motion.is_smooth:
        return knots(motion, trial.start.depth)
    columns = (motion.time, motion.surge_speed, motion.pitch, motion.heading)
    return np.array(columns, dtype=float)


def hang_between(setup: Setup, live: Live, trial: scenarios.Trial, model: Model) -> None:
    """Move the drum to its place in the trial, with the cable in the water hanging between it and the tow point.

    Raises:
        cable.HoldError: a cable that does not reach, or has no equilibrium.
    """
    fixed, now, wet = setup.fixed, live.now, trial.start.wet_length
    places = np.array([now.tow, now.tow + np.array(trial.start.drum)])
    held = hold(
        places,
        wet,
        model.water(),
        cable=model.cable,
        segment_length=trial.segment_length,
        bed=_bed_below(trial, model),
    )
    fixed.drum_place[:] = setup.water.points[:3] = live.line.ends.origin[:] = places[1]
    led = setup.led
    rate = (
        (led[1, SETPOINT] - led[0, SETPOINT]) / (led[1, 0] - led[0, 0])
        if fixed.drum.control == LENGTH
        else 0.0
    )
    lay_held(live.line, held, now.change.copy(), fixed.drum.velocity, rate)
    live.line.ends.layout.segment_length = trial.segment_length
    now.force[:] = held.tow_force
    start_at_rest(setup, live)


@compiled
def start_at_rest(setup: Setup, live: Live) -> None:
    """Fill the state of a cable that is laid out at the start: the water around it, its momenta, its energy."""
    start_in_water(live.line, setup.water, setup.fixed.cable, live.load)
    energy_flow(live.line, setup.fixed.cable, live.load, live.now.ledger.cable_new)
    for i in range(FLOWS):
        live.now.ledger.cable_old[i] = live.now.ledger.cable_new[i]


PASSES = 4
"""The speed through the water depends on the pitch, and that on the speed: three digits a pass."""
FINS = ("rudder", "stern_plane_port", "stern_plane_starboard")


def first_state(trial: scenarios.Trial, model: Model, tethered: bool) -> np.ndarray:
    """Return the vehicle's state at t = 0, as in `vehicle.STATE` (of a prescribed run, its place only).

    Raises:
        UserError: a fin that stands where its servo cannot take it; no steady motion (`autopilot.NoTrimError`).
    """
    start = trial.start
    if start.at_trim:
        return _steady(trial, model, tethered)
    _check_fins(start, model)
    state = initial_state(
        position=(0.0, 0.0, start.depth),
        roll=start.roll,
        pitch=start.pitch,
        heading=start.heading,
        velocity=start.velocity,
        propeller_speed=start.propeller_speed,
    )
    state[SERVO : SERVO + 3] = state[LINKAGE : LINKAGE + 3] = start.fins
    return state


def _check_fins(start: scenarios.Start, model: Model) -> None:
    """Raise an error for fins beyond the range of their servos."""
    for fin, angle in zip(FINS, start.fins, strict=True):
        most = getattr(model.vehicle, f"{fin}_servo").deflection_limit
        if abs(angle) > most * (1.0 + 1e-12):
            raise UserError(
                f"The run starts with {fin}_angle at {degrees(angle):.4g} degrees; its servo reaches "
                f"{degrees(most):.4g} degrees either way. Allowed: an angle within that."
            )


def _steady(trial: scenarios.Trial, model: Model, tethered: bool) -> np.ndarray:
    """Return the state of a trial that starts in trim."""
    from subzero.steady_motion.asked import Asked
    from subzero.steady_motion.hull_state_space import to_vehicle
    from subzero.steady_motion.trim_point import steady_motion

    start, water = trial.start, _water_at_the_start(model, trial.start.depth)
    wet, speed, R = start.wet_length if tethered else 0.0, start.surge_speed, np.empty((3, 3))
    for _ in range(PASSES if water.any() else 1):
        try:
            x = steady_motion(model, Asked(speed=speed, wet_length=wet, roll=start.roll)).state.copy()
        except UserError as error:
            what = f"'{printable(trial.name)}' cannot start in trim at {start.surge_speed:g} m/s over ground"
            raise type(error)(f"{what}: {error}") from None
        x[5] = start.heading
        state = to_vehicle(x)
        rotation(state[3:7], R)
        speed = start.surge_speed - float(R[:, 0] @ water)
    state[POSITION : POSITION + 3] = 0.0, 0.0, start.depth
    state[VELOCITY : VELOCITY + 3] += R.T @ water
    return state


def _water_at_the_start(model: Model, depth: float) -> np.ndarray:
    """Return the velocity of the water at the vehicle, north, east, down (3,). [m/s]."""
    water = np.array(model.current, dtype=float)
    if model.profile is not None:
        water += [
            np.interp(depth, model.profile.depth, axis) for axis in np.transpose(model.profile.velocity)
        ]
    return water


Later = Sequence[tuple[float, Model]]
"""(time [s], model) from which on another model holds."""

CLOSE = 1e-6
"""A time of a change is that of a row if it is as near as this. [s]"""


def rows_of_changes(
    trial: scenarios.Trial, tethered: bool, times: np.ndarray, later: Later
) -> dict[int, Model]:
    """Return the rows from which on other models hold; raise an error for changes that are not possible.

    Raises:
        UserError: a scheme that cannot change, or a time that is none of the run's.
    """
    if later and tethered and trial.scheme != "moving_end":
        raise UserError(
            f"'{trial.name}' has the scheme '{trial.scheme}'; only 'moving_end' can go on with another model."
        )
    changes = {}
    for time, model in later:
        row = int(np.argmin(np.abs(times - time)))
        if not abs(times[row] - time) < CLOSE:
            raise UserError(
                f"Another model holds from t = {time!r} s on, which is no time of a result of '{trial.name}'. "
                f"Allowed: whole multiples of {times[1]:g} s, from 0 to {times[-1]:g} s."
            )
        changes[row] = model
    return changes


def go_on_with(
    model: Model, setup: Setup, live: Live, trial: scenarios.Trial, tethered: bool, time: float
) -> Setup:
    """Return the constants of a run that continues with another model from `time` [s]; update `live` for that
    model.
    """
    other = setup_of(trial, model, tethered)
    other.fixed.drum_place[:] = setup.fixed.drum_place
    other.water.points[:3] = setup.water.points[:3]
    restart_at(other, live, time)
    return other


@allocating
def restart_at(setup: Setup, live: Live, time: float) -> None:
    """Take the energies that are stored now, with the numbers that hold from now on, as those of the start."""
    ledger, flows = live.now.ledger, np.zeros(FLOWS)
    sample_current(setup, live.state, time, live.now.hull)
    ledger.kinetic = kinetic_energy(live.state, live.now.hull.current, setup.fixed.vehicle)
    if setup.fixed.tethered:
        energy_flow(live.line, setup.fixed.cable, live.load, flows)
        ledger.cable_old[STORED] = flows[STORED]
