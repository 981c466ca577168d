"""Pull a cable off its drum with a tow point that moves as prescribed: the public entry point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cable.current import Current
from cable.drum import LENGTH, DrumProperties
from cable.drum_motion import PLACE, SETPOINT, VELOCITY, drum_path, resting
from cable.history import Equilibrium, History
from cable.moving_end.initial_shape import lay_held, lay_straight
from cable.moving_end.segment_load import new_load
from cable.moving_end.state import TOLERANCE, new_line
from cable.moving_end.time_loop import run
from cable.properties import CableProperties
from cable.tow_path import (
    TowVelocity,
    check_kinds,
    check_memory,
    check_motion,
    check_tolerance,
    checked_time,
    current_of,
    first_direction,
    sample_path,
    segments_needed,
)
from cable.winch import Brake, ConstantTension, PayOutRate, Winch
from subzero.errors import BadValueError, checked, real, short, suggestion

START_LENGTH = 1e-6
"""A run "without cable" starts with this length in the water, so that there is a direction. [m]"""
SCHEMES = ("moving_end", "paper", "paper_tangent", "paper_drum", "equation7", "lumped")


def pull_out(
    tow_velocity: TowVelocity,
    duration: float,
    step: float = 0.1,
    *,
    segment_length: float = 0.5,
    cable: CableProperties | None = None,
    drum: DrumProperties | Winch | None = None,
    current: Sequence[float] | np.ndarray | Current | None = None,
    scheme: str = "moving_end",
    wet_length: float = 0.0,
    drum_velocity: TowVelocity | None = None,
    rtol: float = 0.0,
    grading: float = 0.0,
    run_in: float = 0.0,
    tolerance: float = TOLERANCE,
    start: Equilibrium | None = None,
) -> History:
    """Pull a cable off a drum, starting with no cable in the water and the tow point at the drum.

        ∂(T t)/∂s = ∂p/∂t + D − w_c k,   ∂V/∂s = ∂((1 + eT) t)/∂t,   dS/dt = −V_t(S)   (7)-(19)

    The default scheme, "moving_end", is of second order in time and space (backward differences, segments between
    nodes, a last segment that grows); segment length and step are independent of one another. "paper_tangent" and
    "paper_drum" are the scheme of Feng & Allen (2004) as printed, (20)-(26), one new node a step, with the two
    readings of the new node ("paper" is the usable one, "paper_tangent"); there `segment_length` has no meaning.
    "equation7" is independent of both: the six unknowns of the paper in a scheme of second order with a moving end,
    for comparison; it has no slack law. "lumped" is a third formulation, of masses at nodes and stiff springs between
    them, that does all the default does but `rtol`, `grading` and `run_in`: the other code to compare with.

    Straight ahead at U the tension is ½ρπdC_t U² S, and the force points against the motion. A drum with no friction
    and no inertia gives T(S) = 0. The drum cannot take cable up: a vehicle that comes back makes the cable slack
    (tension tends to 0, it never pushes), and no node is made while the drum stands. What a slack bight looks like
    below one segment length is ill-posed for a cable without bending stiffness and not to be trusted.

    Args:
        tow_velocity: function of time [s] that gives the tow point's velocity north, east, down (3,). [m/s]
        duration: how long. [s]
        step: time between recorded results; a step that fails is retried in smaller pieces. [s]
        segment_length: Δs, length of a full segment. [m]
        cable: the cable; Table 1 of the source when not given.
        drum: a free drum, or a winch (`cable.winch`); the free drum of Table 1 when not given.
        current: velocity of the water north, east, down (3,) [m/s], or a `cable.Current` that changes with place and
            time (places relative to the drum at the start); still water when not given.
        scheme: one of `SCHEMES`.
        wet_length: cable in the water at the start, laid straight behind the tow point. [m]
        drum_velocity: function of time [s] that gives the velocity of a moving drum (a boat) north, east, down (3,); a
            drum on the shore when not given. [m/s]
        rtol: with a positive value, steps are made as small as needed for an error of the tow force of about this share
            of its largest (`moving_end.step_control`), but for jolts; 0 takes every step as it is.
        grading: new segments are Δs + grading · s long, s from the tow point: far from the vehicle a cable is coarser.
        run_in: segments are shorter up to this length L₀ from the tow point, node j at (jΔs)²/4L₀: for a start with no
            cable in a cross current, whose force is of second order then from the first step on. Coupled runs take
            2 m. [m]
        tolerance: how exactly the default scheme solves a step: balances of forces to this share of the largest
            tension, strains to a thousandth of it. With 1e-5 most steps take one Newton iteration, not two, and what
            that leaves is far below the error of the step; what compares runs with one another wants the 1e-9.
        start: a cable that hangs or streams between vehicle and drum, from `cable.hold`: the default scheme begins with
            it, its cable and its current (unless others are given), its length and its segments.

    Returns:
        the history from t = 0 on. Look at `history.outcome`: a run that could not go on keeps what it has.

    Raises:
        subzero.UserError: a duration, step or segment length that is not positive, an unknown scheme, a tow velocity or
            current that is not three finite numbers, a run that does not fit into memory. (Bad values are a ValueError,
            too.)

    Good values: step 0.1 s and segments of 0.5 m give the tension of a 60° dive at 1 m/s within 2e-4 and the direction
    of the tow force within 4e-4 (`python -m benchmarks.cable` measures both together).
    """
    origin = np.zeros(3)
    if start is not None:
        _check_start(start, scheme, wet_length)
        wet_length, segment_length = start.length, float(start.segment_lengths[0])
        cable, origin = (
            start.cable if cable is None else cable,
            start.shape[-1] if current is None else origin,
        )
        current = start.current if current is None else current
    cable, drum = CableProperties() if cable is None else cable, DrumProperties() if drum is None else drum
    duration, step, segment_length, rtol, grading, wet_length = _checked(
        duration, step, segment_length, rtol, grading, wet_length
    )
    run_in = checked("", "run_in", run_in, least=0.0, most=100.0, unit="m")
    _check_scheme(scheme)
    check_kinds(
        cable=(cable, (CableProperties,)), drum=(drum, (DrumProperties, PayOutRate, Brake, ConstantTension))
    )
    check_motion("tow_velocity", tow_velocity)
    if drum_velocity is not None:
        check_motion("drum_velocity", drum_velocity)
    tolerance = check_tolerance(tolerance)
    water = current_of(current)
    if scheme == "lumped":
        segments_needed(max(wet_length, segment_length), segment_length, 0.0)
    if scheme == "lumped" and rtol == grading == run_in == 0.0:
        from cable.lumped.history import pull_out_lumped

        return pull_out_lumped(
            tow_velocity,
            duration,
            step,
            segment_length=segment_length,
            cable=cable,
            drum=drum,
            current=water,
            wet_length=wet_length,
            drum_velocity=drum_velocity,
        )
    if scheme != "moving_end":
        plain = (
            wet_length == rtol == grading == run_in == 0.0
            and drum_velocity is None
            and water.velocity.size == 3
        )
        if not (plain and isinstance(drum, DrumProperties)):
            message = (
                f"scheme {scheme!r} knows a free drum on the shore and a uniform current, and no wet_length, rtol, "
                "grading or run_in ('lumped' knows all but these three); use 'moving_end'."
            )
            raise BadValueError(message)
        from cable.feng_allen.printed_history import pull_out_as_printed

        uniform = water.velocity.reshape(3)
        return pull_out_as_printed(tow_velocity, duration, step, cable, drum, uniform, scheme, segment_length)
    path, wet = sample_path(tow_velocity, duration, step), max(wet_length, START_LENGTH)
    led = _led_drum(drum, drum_velocity, path.times, wet)
    direction = first_direction(path.leaving - led[:, VELOCITY:SETPOINT])
    path.place[:] += wet * direction if start is None else start.shape[0] - start.shape[-1]
    reach = 1.5 * (_way(path.place) + _way(led[:, PLACE:VELOCITY]) + water.fastest * duration) + wet
    longest = led[:, SETPOINT].max() if isinstance(drum, PayOutRate | Brake) else 2.0 * reach + 5.0
    capacity = segments_needed(float(longest), segment_length, grading) + int(run_in / segment_length)
    capacity += 0 if start is None else start.segment_lengths.size
    check_memory(path.times.size, capacity)
    line, work, c, turning = new_line(capacity), new_load(), cable.numbers(), drum.numbers()
    line.ends.segment_length, line.ends.grading, line.ends.tolerance = segment_length, grading, tolerance
    line.ends.run_in = run_in
    turning.velocity[:] = led[0, VELOCITY:SETPOINT]
    if start is None:
        lay_straight(line, wet, direction, path.leaving[0], turning, c)
    else:
        rate = (led[1, SETPOINT] - led[0, SETPOINT]) / path.times[1] if turning.control == LENGTH else 0.0
        lay_held(line, start, path.leaving[0], turning.velocity, rate)
    return run(line, path, led, water.numbers(origin), c, turning, rtol, work, capacity)


def _check_start(start: object, scheme: str, wet_length: float) -> None:
    """Refuse a start that is none, and what does not go together with one."""
    check_kinds(start=(start, (Equilibrium,)))
    if not isinstance(scheme, str) or scheme != "moving_end" or real(wet_length) != 0.0:
        raise BadValueError(
            f"start goes with scheme 'moving_end' and without wet_length; got scheme {short(scheme)} and wet_length "
            f"{short(wet_length)}. The length is the start's own."
        )


def _led_drum(
    drum: DrumProperties | Winch, velocity: TowVelocity | None, times: np.ndarray, wet: float
) -> np.ndarray:
    """Return the drum's way and its winch's setpoints at times (n,)."""
    setpoints = np.zeros(times.size) if isinstance(drum, DrumProperties) else drum.setpoints(times, wet)
    if velocity is None:
        return resting(times, setpoints)
    way = sample_path(velocity, float(times[-1]), float(times[1] - times[0]), "drum_velocity")
    return drum_path(times, way.place, way.leaving, setpoints)


def _way(place: np.ndarray) -> float:
    """Return the length of the way through places (n, 3). [m]."""
    return float(np.linalg.norm(np.diff(place, axis=0), axis=1).sum())


def _checked(
    duration: float, step: float, segment_length: float, rtol: float, grading: float, wet_length: float
) -> tuple[float, ...]:
    """Return the numbers as floats; refuse the first that cannot be used, by name."""
    return (
        checked_time("duration", duration),
        checked_time("step", step),
        checked("", "segment_length", segment_length, above=0.0),
        checked("", "rtol", rtol, least=0.0, most=0.5),
        checked("", "grading", grading, least=0.0, most=0.5),
        checked("", "wet_length", wet_length, least=0.0, unit="m"),
    )


def _check_scheme(scheme: str) -> None:
    """Refuse a scheme that there is not."""
    if not isinstance(scheme, str) or scheme not in SCHEMES:
        raise BadValueError(
            f"scheme {short(scheme)} is unknown; choose one of {', '.join(SCHEMES)}.{suggestion(scheme, SCHEMES)}"
        )
