"""Where the equations do not hold, or a command is impossible: air, sea bed, strength, bends, actuators, pitch.

Also the words for when and for how long, which all warnings share.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from cable import SeaBed
from cable.doubts import ROUNDING
from subzero.channels import DEGREE, AnyRun
from subzero.steady_motion.hull_state_space import ACTUATORS, PLACE, STATES, SURGE, ideal, rate
from vehicle.consistency import contradictions

if TYPE_CHECKING:
    import scenarios
    from subzero.model import Model


def longest_span(time: np.ndarray, holds: np.ndarray) -> tuple[float, float]:
    """Return how long something holds at a stretch, at most, and when that stretch begins. [s]."""
    if not holds.any():
        return 0.0, 0.0
    # The sentinels at both ends make every stretch begin and end inside the array.
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(int)))
    begin, end = edges[::2], edges[1::2] - 1
    spans = time[end] - time[begin]
    return float(spans.max()), float(time[begin[spans.argmax()]])


def first_time(time: np.ndarray, holds: np.ndarray) -> float:
    """Return when something first holds. [s]."""
    return float(time[int(np.argmax(holds))])


def percent(share: float) -> str:
    """Return a share as a percentage."""
    return f"{100.0 * share:.3g} %"


TAUT = 1e-4
"""A bend counts where the cable pulls harder than this. [N]"""
STRAIGHT = 1e-6
"""Two segments with less than this between their directions are straight: rounding says no more. [rad]"""

MOST_OF_THE_RUN, LONG, SHORT = 0.9, 10.0, 2.0
"""At a limit throughout: for more than this share of the run, or for longer than this at a stretch; a shorter stretch
than the last is none: an actuator takes its time. [-], [s], [s]"""
BEHIND = 0.95
"""A propeller slower than this share of its command lags it. [-]"""
FINS = {
    "rudder": "rudder_servo",
    "stern_plane_port": "stern_plane_port_servo",
    "stern_plane_starboard": "stern_plane_starboard_servo",
}
"""Fin → its servo in the vehicle."""


def contradictory_numbers(run: AnyRun, _: scenarios.Trial, model: Model) -> list[str]:
    """Return warnings of a vehicle whose numbers contradict one another; none where its motion is prescribed."""
    if run.attrs["prescribed"]:
        return []
    found = contradictions(model.vehicle)
    more = f" (and {len(found) - 1} more: subzero validate lists them)" if len(found) > 1 else ""
    return [f"Numbers of the vehicle contradict one another: {found[0]}{more}."] if found else []


def above_surface(run: AnyRun, _: scenarios.Trial, model: Model) -> list[str]:
    """Return warnings of a vehicle or cable in the air, where the equations are those of water."""
    radius = 0.5 * model.vehicle.hull.diameter
    words = "though the equations know only water: what follows is wrong. Start deeper, or command less."
    return _out_of_bounds(run, model, lambda depth: -depth - radius, "above the surface", words)


def below_sea_bed(run: AnyRun, trial: scenarios.Trial, model: Model) -> list[str]:
    """Return warnings of a vehicle below the sea bed of the trial, or of a cable that it takes there.

    The bed holds the cable, which sinks in a little.
    """
    if trial.sea_bed <= 0.0:
        return []
    words = (
        "where it cannot be: the bed holds the cable, and no vehicle. Change the trial, or water.sea_bed_m."
    )
    where = f"below the sea bed at {trial.sea_bed:g} m"
    # By a diameter, and twice as deep as at rest, a cable may be pressed in.
    sinks = model.cable.diameter + 2.0 * SeaBed(depth=trial.sea_bed).sinkage(model.cable)
    return _out_of_bounds(run, model, lambda depth: depth - trial.sea_bed, where, words, sinks)


def _out_of_bounds(
    run: AnyRun,
    model: Model,
    beyond: Callable[[np.ndarray], np.ndarray],
    where: str,
    words: str,
    sinks: float = 0.0,
) -> list[str]:
    """Return sentences about vehicle and cable where `beyond` of their depth is above zero [m], of the cable above
    `sinks` [m].
    """
    time, said = run["time"].values, []
    places = {"vehicle": (run["depth"].values[:, None], 0.0)}
    if run.attrs["tethered"] and run["node_count"].values.any():
        down = run["cable_position"].values[:, :, 2]
        # Places of the cable are relative to the drum; the depth of the tow point at the start fixes their zero.
        places["cable"] = down, _depth_of_start(run, model) - down[0, 0]
    for name, (down, offset) in places.items():
        farthest = np.concatenate([_farthest(beyond, down[block] + offset) for block in blocks_of(time.size)])
        row = int(farthest.argmax())
        limit = ROUNDING + (sinks if name == "cable" else 0.0)
        if farthest[row] > limit:
            depth, first = down[row] + offset, first_time(time, farthest > limit)
            worst = depth[np.nanargmax(beyond(depth))]
            said.append(
                f"The {name} is {where} from {first:g} s on, and at a depth of {worst:.3g} m at "
                f"{time[row]:g} s, {words}"
            )
    return said


def _farthest(beyond: Callable[[np.ndarray], np.ndarray], depth: np.ndarray) -> np.ndarray:
    """Return how far beyond the limit each sample's farthest node is, −∞ if there is none (samples,). [m]"""
    farthest: np.ndarray = np.fmax(np.fmax.reduce(beyond(depth), axis=1), -np.inf)  # fmax is blind to NaN
    return farthest


BLOCK = 256
"""So many samples are looked at together: all of a long run would take as much memory again. [-]"""


def blocks_of(samples: int) -> list[slice]:
    """Return the blocks that samples are looked at in."""
    return [slice(at, at + BLOCK) for at in range(0, samples, BLOCK)]


def strength(run: AnyRun, _: scenarios.Trial, model: Model) -> list[str]:
    """The cable pulls harder than it may."""
    most = model.cable.strength
    if most <= 0.0 or not run.attrs["tethered"]:
        return []
    time, T = run["time"].values, np.nan_to_num(run["cable_node_tension"].values).max(axis=1)
    snap = json.loads(run.attrs.get("snap", "{}"))
    if snap.get("peak_tension_N", 0.0) > max(most, float(T.max())):
        return [
            f"The cable snaps taut with {snap['peak_tension_N']:.4g} N by {snap['time_of_peak_s']:g} s, and may carry "
            f"{most:g} N (cable.strength; above it for {snap['time_above_strength_s']:.3g} s): a real one might part. "
            "Go slower, or take a stronger cable, or one that stretches more."
        ]
    if T.max() <= most:
        return []
    worst, since = int(T.argmax()), first_time(time, most < T)
    return [
        f"The cable pulls with {T[worst]:.4g} N at {time[worst]:g} s, and may carry {most:g} N (cable.strength; above "
        f"it since {since:g} s): a real one might part. Go slower, or take a stronger cable."
    ]


def bend_radius(run: AnyRun, _: scenarios.Trial, model: Model) -> list[str]:
    """The cable is bent tighter than it may be."""
    least = model.cable.minimum_bend_radius
    if least <= 0.0 or not run.attrs["tethered"]:
        return []
    time, radius = run["time"].values, bend_radii(run)
    if not radius.size or radius.min() >= least:
        return []
    tightest = radius.min(axis=1)
    worst = int(tightest.argmin())
    node, since = int(radius[worst].argmin()) + 1, first_time(time, tightest < least)
    return [
        f"The cable is bent to a radius of {tightest[worst]:.2g} m at {time[worst]:g} s, node {node} from the vehicle, "
        f"and may be bent to {least:g} m (cable.minimum_bend_radius; below it since {since:g} s). "
        "Turn more gently, or give the cable its bending_stiffness."
    ]


def bend_radii(run: AnyRun) -> np.ndarray:
    """Return the radius of the circle through three neighbouring nodes, ∞ in slack parts (samples, nodes − 2). [m].

    R = abc/4A of a triangle with the sides a, b, c; 4A = 2 |a × b| = 2 √(a²b² − (a·b)²).
    """
    P, T = run["cable_position"].values, run["cable_node_tension"].values
    if P.shape[1] < 3:
        return np.full((P.shape[0], 1), np.inf)
    side = np.diff(P, axis=1)
    a, b = side[:, :-1], side[:, 1:]
    aa, bb, ab = (np.einsum("tni,tni->tn", each, two) for each, two in ((a, a), (b, b), (a, b)))
    # c = a + b, so the product of the three sides is √(a² b² (a² + b² + 2 a·b)).
    product = np.sqrt(aa * bb * (aa + bb + 2.0 * ab))
    square = aa * bb - ab * ab
    pulls = np.minimum(np.minimum(T[:, :-2], T[:, 1:-1]), T[:, 2:]) > TAUT
    bent = square > STRAIGHT**2 * aa * bb  # false where nodes coincide, and where there are none: NaN
    return np.where(pulls & bent, product / (2.0 * np.sqrt(np.where(bent, square, 1.0))), np.inf)


def actuators(run: AnyRun, _: scenarios.Trial, model: Model) -> list[str]:
    """A command beyond what the vehicle can do, or an actuator at its limit throughout."""
    if run.attrs["prescribed"]:
        return []
    said = [sentence for fin in FINS for sentence in _fin(run, model, fin)]
    return said + _propeller(run, model)


def _fin(run: AnyRun, model: Model, fin: str) -> list[str]:
    """Return the warnings of a fin: cut off, at its limit, or turning as fast as it can all the time."""
    time, servo = run["time"].values, getattr(model.vehicle, FINS[fin])
    command, angle = run[f"{fin}_command"].values, run[f"{fin}_angle"].values
    name, limit = fin.replace("_", " "), servo.deflection_limit * DEGREE
    # A command inside the dead band does not move the fin; beyond it, the band is subtracted.
    moved = np.sign(command) * np.maximum(np.abs(command) - servo.dead_band * DEGREE, 0.0)
    cut = np.abs(moved + servo.offset * DEGREE) - limit
    said, key = [], f"vehicle.{FINS[fin]}"
    if cut.max() > 1e-6:
        worst = int(cut.argmax())
        said.append(
            f"The {name} is commanded to {command[worst]:.4g}° and goes to {limit:.4g}° ({key}.deflection_limit): up "
            f"to {cut[worst]:.3g}° are cut off, first at {first_time(time, cut > 1e-6):g} s. Command less."
        )
    # A command that is cut off has been reported above: being at the limit is not a second fault.
    elif throughout := _throughout(time, (0.0 < limit < np.inf) & (np.abs(angle) >= 0.999 * limit)):
        said.append(
            f"The {name} is at its limit of {limit:.4g}° {throughout}: it has nothing left to steer with."
        )
    if time.size > 1 and np.isfinite(servo.rate_limit):
        rate = np.abs(np.diff(angle)) / np.diff(time)
        if throughout := _throughout(time[1:], rate >= 0.98 * servo.rate_limit * DEGREE):
            most = servo.rate_limit * DEGREE
            said.append(f"The {name} turns as fast as it can, {most:.4g}°/s, {throughout}: it cannot follow.")
    return said


def _propeller(run: AnyRun, model: Model) -> list[str]:
    """Return the warnings of the propeller: a command above its limit, or a speed that lags its command."""
    time, c = run["time"].values, model.vehicle.motor.speed_per_volt
    command, speed = run["propeller_command"].values, run["propeller_speed"].values
    most = c * model.vehicle.battery.full_voltage
    if np.abs(command).max() > most * (1.0 + 1e-9):
        worst = int(np.abs(command).argmax())
        return [
            f"The propeller is commanded to {command[worst]:.4g} rev/s, and the full battery drives it at "
            f"{most:.4g} rev/s at most (first at {first_time(time, np.abs(command) > most):g} s). Command less."
        ]
    # With the sign of the command, a propeller that turns the wrong way counts as lagging, too.
    behind = np.sign(command) * speed < BEHIND * np.abs(command)
    spun_up = 10.0 * model.vehicle.motor.lag
    if throughout := _throughout(time, behind, max(SHORT, spun_up)):
        lack = np.where(behind, np.abs(command) - np.abs(speed), 0.0)
        return [
            f"The propeller is up to {lack.max():.3g} rev/s behind its command {throughout}: the battery does not "
            "give more. Command less, or give it a stronger battery."
        ]
    return []


def _throughout(time: np.ndarray, at_limit: np.ndarray, short: float = SHORT) -> str:
    """Return for how long a limit holds, if it is most of the run or a long stretch, and not a short one [s]."""
    longest, begin = longest_span(time, at_limit)
    if longest > max(LONG, short):
        return f"from {begin:g} s on for {longest:.3g} s"
    most = longest > short and at_limit.mean() > MOST_OF_THE_RUN
    return f"for {percent(at_limit.mean())} of the run" if most else ""


def unstable_pitch(run: AnyRun, _: scenarios.Trial, model: Model) -> list[str]:
    """The nose goes far up or down although the planes are held still: the hull is unstable in pitch."""
    if run.attrs["prescribed"]:
        return []
    time, pitch = run["time"].values, run["pitch"].values
    steep = np.abs(pitch) > model.vehicle.stern_planes.stall_angle * DEGREE
    if not steep.any():
        return []
    planes = np.stack([run[f"stern_plane_{side}_command"].values for side in ("port", "starboard")])
    # The planes have been held since the last change of their command before the pitch became steep.
    row = int(np.argmax(steep))
    moved = np.flatnonzero(np.any(np.diff(planes[:, : row + 1]) != 0.0, axis=0))
    since = float(time[moved[-1] + 1] if moved.size else time[0])
    speed = float(run["surge_speed"].values[row])
    growth = pitch_growth(model, speed) if speed > 0.0 else 0.0
    # Less time than one doubling: the pitch may be the result of the last command.
    if growth * (time[row] - since) < np.log(2.0):
        return []
    worst, deepest = pitch[np.abs(pitch).argmax()], float(run["depth"].values.max())
    doubles = np.log(2.0) / growth
    return [
        f"The pitch passes {pitch[row]:.3g}° at {time[row]:g} s and reaches {worst:.3g}° (greatest depth: "
        f"{deepest:.3g} m), with stern-planes that are held still from {since:g} s on: at {speed:.2g} m/s this hull "
        f"is unstable in pitch, a deviation doubles in {doubles:.2g} s. Let an autopilot steer it (subzero autopilot)."
    ]


def pitch_growth(model: Model, speed: float) -> float:
    """Return how fast pitch, heave and pitch rate of the hull, fins fixed, grow at most about level motion. [1/s]

    The largest real part of the eigenvalues of ∂(θ', w', q')/∂(θ, w, q), below 0 of a stable hull.
    """
    numbers, level = ideal(model.vehicle).numbers(), np.zeros(len(STATES))
    level[SURGE] = speed
    kept = [PLACE[name] for name in ("pitch", "heave_speed", "pitch_rate")]
    # Central differences: their error is of second order.
    nudges = 1e-5 * np.eye(len(STATES))[kept]
    pairs = [
        rate(level + nudge, level[ACTUATORS], numbers) - rate(level - nudge, level[ACTUATORS], numbers)
        for nudge in nudges
    ]
    return float(np.linalg.eigvals(np.array(pairs)[:, kept] / 2e-5).real.max())


def _depth_of_start(run: AnyRun, model: Model) -> float:
    """Return the depth of the tow point at the start. [m]"""
    pitch, roll = (np.radians(float(run[name].values[0])) for name in ("pitch", "roll_angle"))
    x, y, z = model.vehicle.tow_point.position()
    tow = -np.sin(pitch) * x + np.cos(pitch) * (np.sin(roll) * y + np.cos(roll) * z)
    return float(run["depth"].values[0] + tow)
