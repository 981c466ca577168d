"""What may be wrong with a run that has reached its end: `CHECKS`, each a pure function of the labelled result.

A check takes a run, its trial and its model, and answers with sentences, none if all is well. A sentence says what, how
much, since when, and what to do. They stand in ``attrs["warnings"]`` of the run (`warnings_of` reads them), in
``summary.json``, on the terminal and in the footer of figures.

The first seven checks doubt the numbers; the others say that what was asked for cannot be, or that an equation does not
hold where the run went: there is no air and no sea bed in them, and nothing breaks. A check that has no say, such as
that of the energies under the paper's scheme, which keeps no balance, is silent.

To add a check, add a row to `CHECKS`, and a test that it warns and one that it does not (`tests/validity`).
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from subzero.channels import DEGREE

if TYPE_CHECKING:
    import xarray as xr

    import scenarios
    from cable.properties import CableProperties, DrumProperties
    from subzero.model import Model

    Check = Callable[[xr.Dataset, scenarios.Trial, Model], list[str]]

RESIDUAL = 0.01
"""A residual above this share of the largest energy so far is too much. [-]"""
STARTING = 0.3
"""Energies below this share of the run's largest are those of a start, too small to hold a residual against: a cable
that begins with a jolt loses some millijoules in it, which is all the energy that there is at first. [-]"""
NO_ENERGY, NO_FORCE = 1e-9, 1e-6
"""Below this nothing has happened yet. [J], [N]"""

ROUGH = 0.03
"""A tow force whose second difference from sample to sample exceeds this share of the largest force is not resolved by
the steps. Of 160 trials of `benchmarks.trust` all 117 that were wrong by more than 3 % had more, and none of the 13
that were right within 1 % (0.2 to 2.5 %). [-]"""

OVERRUN, SAGGING, ILL_POSED_TIME = 1.2, 0.2, 2.0
"""A drum that runs so many times faster than the tow point goes away feeds itself; a cable whose weight is more than
this share of its drag hangs off the drum at an angle; both count when they last longer than this. Of 171 trials of
`benchmarks.trust` on drums without friction that were wrong, 112 had it, and none of the 5 that were right.
[-], [-], [s]"""
SLOWEST = 0.02
"""Pay-out rates below this are none. [m/s]"""

LIMP = 1e-6
"""A cable with less tension than this at both ends of a segment does not pull there. [N]"""
SLACK_SHARE, SLACK_TIME = 0.05, 1.0
"""Slack is warned of from this share of the length on, and when it lasts longer than this. [-], [s]"""
FOLDED = 1e-3
"""A cable whose segments are shorter than their cable by more than this share is folded somewhere. [-]"""

ROUNDING = 1e-6
"""What is beyond surface or bed by less than this is at it. [m]"""
TAUT = 1e-4
"""A bend counts where the cable pulls harder than this. [N]"""
STRAIGHT = 1e-6
"""Two segments with less than this between their directions are straight: rounding says no more. [rad]"""
CLOSED = 0.01
"""A cable that ends farther from the tow point than this share of its length is not the cable of this vehicle. [-]"""
PUSHED = 1e-3
"""A cable that pushes harder than this share of its hardest pull is none. [-]"""

MOST_OF_THE_RUN, LONG, SHORT = 0.9, 10.0, 2.0
"""At a limit throughout: for more than this share of the run, or for longer than this at a stretch; a shorter stretch
than the last is none: an actuator takes its time. [-], [s], [s]"""
BEHIND = 0.95
"""A propeller slower than this share of its command is behind it. [-]"""
FINS = {"rudder": "rudder_servo", "stern_plane_port": "stern_plane_port_servo",
        "stern_plane_starboard": "stern_plane_starboard_servo"}  # fmt: skip
"""Fin → its servo in the vehicle."""
ENERGIES = ("propeller_work", "hull_loss", "cable_loss", "kinetic_change", "drum", "added_mass_term")


class RunWarning(NamedTuple):
    """A doubt about a run: the check that has it, and a sentence."""

    check: str
    message: str


def check_run(run: xr.Dataset, trial: scenarios.Trial, model: Model) -> list[RunWarning]:
    """Return everything that may be wrong with a run of a trial with a model, in the order of `CHECKS`."""
    return [RunWarning(name, words) for name, check in CHECKS.items() for words in check(run, trial, model)]


def warnings_of(run: xr.Dataset) -> tuple[RunWarning, ...]:
    """Return the warnings that a run carries in its attributes; none from a version that did not know them."""
    told = json.loads(run.attrs.get("warnings", "[]"))
    return tuple(RunWarning(one["check"], one["message"]) for one in told)


def as_json(warnings: list[RunWarning]) -> str:
    """Return warnings as they stand in the attributes of a run."""
    return json.dumps([one._asdict() for one in warnings], ensure_ascii=False)


# ---- the numbers ----


def energy_residual(run: xr.Dataset, trial: scenarios.Trial, _: Model) -> list[str]:
    """The balance of all energies does not close, at any time: a residual that cancels later counts too."""
    if run.attrs["prescribed"] and not run.attrs["tethered"]:
        return []  # whatever moves the vehicle does unknown work
    residual = np.abs(run["energy_residual"].values)
    terms = np.abs([run[f"energy_{name}"].values for name in ENERGIES]).max(axis=0)
    if not (np.isfinite(residual).all() and np.isfinite(terms).all()) or terms.max() < NO_ENERGY:
        return []
    largest = np.maximum(np.maximum.accumulate(terms), STARTING * terms.max())
    share = residual / largest
    if share.max() <= RESIDUAL:
        return []
    time, worst = run["time"].values, int(share.argmax())
    return [
        f"The energy balance leaves up to {_percent(share.max())} of the largest term unexplained "
        f"({residual[worst]:.3g} J of {largest[worst]:.3g} J at {time[worst]:g} s; above {_percent(RESIDUAL)} "
        f"since {_first(time, share > RESIDUAL):g} s): the steps do not follow what happens. {_finer(trial)}"
    ]


def resolution(run: xr.Dataset, trial: scenarios.Trial, _: Model) -> list[str]:
    """Steps and segments twice as long give another tow force, however fine they are: `subzero.convergence`."""
    accuracy = json.loads(run.attrs.get("accuracy", "{}"))
    if not accuracy or is_resolved(run):
        return []
    error, finer = accuracy["force_error"], 2 ** accuracy["halvings"]
    how = f"by {_percent(error)} of its largest value" if error is not None else "beyond where that can go on"
    return [
        f"The tow force depends on steps and segments: from twice as long ones to these ({finer} times as fine as "
        f"given) it changes {how} (at {accuracy['time']:g} s; run.rtol allows {_percent(trial.rtol)}). Either they are "
        "still too long, or the problem is ill-posed: a heavy cable, or one in a cross current, on a drum that does "
        "not hold it, or a cable that snaps taut. Give the drum friction_torque or a [winch], or the cable "
        "bending_stiffness."
    ]


def is_resolved(run: xr.Dataset) -> bool:
    """Say whether a coarser run has confirmed the tow force of this one within its trial's rtol."""
    accuracy = json.loads(run.attrs.get("accuracy", "{}"))
    error = accuracy.get("force_error")
    return error is not None and error <= accuracy["rtol"]


def tow_force(run: xr.Dataset, trial: scenarios.Trial, model: Model) -> list[str]:
    """The tow force jumps from sample to sample, and no coarser run has confirmed it.

    A kink that a winch was asked for is none: where its setpoint changes its slope, a right force has one too.
    """
    if not run.attrs["tethered"] or is_resolved(run):
        return []
    jump, time = roughness(run), run["time"].values[2:-1]
    for kink in model.winch.time[1:] if model.winch is not None and jump.size else ():
        jump = np.where(np.abs(time - kink) <= trial.cable_step * (1.0 + 1e-6), 0.0, jump)
    rough = jump > ROUGH
    if not rough.any():
        return []
    return [
        f"The tow force jumps from sample to sample, by up to {_percent(jump.max())} of its largest value "
        f"(at {time[jump.argmax()]:g} s; by more than {_percent(ROUGH)} in {rough.sum()} of {jump.size} samples, "
        f"first at {_first(time, rough):g} s): the steps do not resolve it. {_finer(trial)}"
    ]


def roughness(run: xr.Dataset) -> np.ndarray:
    """Return |F(t−h) − 2F(t) + F(t+h)| of the tow force, as a share of its largest value (samples − 3,). [-].

    Between evenly spaced samples an eighth of it is what a straight line misses. The first sample is left out: the
    force at the start is a guess.
    """
    F = np.array([run[f"cable_force_{axis}"].values for axis in ("forward", "starboard", "down")])
    largest = np.linalg.norm(F, axis=0).max()
    if largest < NO_FORCE or F.shape[1] < 4:
        return np.zeros(0)
    return np.linalg.norm(F[:, 3:] - 2.0 * F[:, 2:-1] + F[:, 1:-2], axis=0) / largest


def ill_posed_drum(run: xr.Dataset, _: scenarios.Trial, model: Model) -> list[str]:
    """A free drum that does not hold its cable: nothing in the equations says how the cable leaves it."""
    time, S = run["time"].values, run["cable_length"].values
    if not run.attrs["tethered"] or model.winch is not None or time.size < 3:
        return []
    T, payout, away = run["drum_tension"].values, np.gradient(S, time), _tow_speed(run, time)
    ill = drum_is_ill_posed(T, payout, away, model.cable, model.drum)
    longest, begin = _longest(time, ill)
    if longest <= ILL_POSED_TIME:
        return []
    momentum = model.cable.virtual_mass_per_length * payout**2
    here = ill & (time >= begin) & (time <= begin + longest)
    worst = int(np.where(here, payout, -np.inf).argmax())
    return [
        f"The free drum does not hold the cable against its weight, from {begin:g} s on for {longest:.3g} s: at "
        f"{time[worst]:g} s it comes off at U = {payout[worst]:.3g} m/s (the vehicle goes away at {away[worst]:.3g} "
        f"m/s) with a tension of {T[worst]:.2g} N (m1 U2 is {momentum[worst]:.2g} N). How it leaves the drum is "
        "ill-posed: shorter segments give another answer, not a better one. Give the drum a friction_torque well above "
        f"{max(momentum[worst], T[worst]) * model.drum.radius:.1g} N m, or a [winch]."
    ]


def drum_is_ill_posed(
    tension: np.ndarray,
    payout: np.ndarray,
    tow_speed: np.ndarray,
    cable: CableProperties,
    drum: DrumProperties,
) -> np.ndarray:
    """Say when a free drum does not hold its cable: it unwinds itself, or nothing says in which direction it goes.

        T(S) ≤ C_f/R_d,  U > 1.2 V                     it unwinds: its weight pulls, not the tow point
        T(S) < m1 U²,    |w_c| > 0.2 ½ρπdC_t U²        it swings: it is faster than its own waves

    In the second case all waves along the cable go away from the drum, so that nothing tells the direction in which it
    leaves; its weight turns it, unless its drag straightens it within the first m1/(½ρπdC_t) metres. Segments as long
    as that hide it: then a finer run is worse.

    Args:
        tension: T(S) at the drum (samples,). [N]
        payout: U = dS/dt (samples,). [m/s]
        tow_speed: V, speed of the tow point relative to the drum (samples,). [m/s]
        cable: the cable, with its weight in the water.
        drum: the drum, with its friction.
    """
    held = drum.friction_torque / drum.radius
    unwinds = (cable.weight_in_water > 0.0) & (tension <= held * (1.0 + 1e-3) + LIMP)
    unwinds &= payout > OVERRUN * tow_speed
    square = payout * payout
    swings = (tension < cable.virtual_mass_per_length * square) & (
        abs(cable.weight_in_water) > SAGGING * cable.tangential_drag * square
    )
    return (payout > SLOWEST) & (unwinds | swings)


def slack(run: xr.Dataset, trial: scenarios.Trial, _: Model) -> list[str]:
    """Part of the cable is folded: its ends, its drag and its inertia mean something, its shape does not."""
    if not run.attrs["tethered"]:
        return []
    time, share = run["time"].values, slack_share(run)
    share = np.where(
        run["cable_length"].values < trial.segment_length, 0.0, share
    )  # hardly any cable, no shape
    longest = _longest(time, share > 0.0)[0]
    if share.max() <= SLACK_SHARE and longest <= SLACK_TIME:
        return []
    worst = int(share.argmax())
    return [
        f"Up to {_percent(share[worst])} of the cable in the water is slack (at {time[worst]:g} s; first at "
        f"{_first(time, share > 0.0):g} s, {longest:.3g} s at a stretch): there its shape means nothing, and the tow "
        "force jumps when it comes taut. Pay out less, or give the drum friction, or the cable bending_stiffness."
    ]


def slack_share(run: xr.Dataset) -> np.ndarray:
    """Return which share of the cable is slack, or folded away in segments that are too short (samples,). [-]."""
    S, chord, T = run["cable_length"].values, _chords(run), run["cable_node_tension"].values
    S = np.maximum(S, 1e-9)
    folded = 1.0 - np.nansum(chord, axis=1) / S
    limp = (T[:, 1:] < LIMP) & (T[:, :-1] < LIMP)
    share = np.nansum(np.where(limp, chord, 0.0), axis=1) / S + folded
    return np.where(folded > FOLDED, np.clip(share, 0.0, 1.0), 0.0)


def closure(run: xr.Dataset, trial: scenarios.Trial, _: Model) -> list[str]:
    """The cable does not end at the tow point."""
    gap, S = run["closure_error"].values, np.maximum.accumulate(run["cable_length"].values)
    open_ = gap > CLOSED * np.maximum(S, trial.segment_length)
    if not open_.any():
        return []
    time, worst = run["time"].values, int(gap.argmax())
    return [
        f"The cable, summed up from the drum, ends {gap[worst]:.3g} m from the tow point at {time[worst]:g} s, with "
        f"{S[worst]:.3g} m in the water (more than {_percent(CLOSED)} since {_first(time, open_):g} s): its shape is "
        f'not that of a cable between both. Use scheme = "moving_end", which closes it, or a shorter cable_step_s.'
    ]


def push(run: xr.Dataset, _: scenarios.Trial, __: Model) -> list[str]:
    """The cable pushes, which no cable can."""
    T = run["cable_node_tension"].values
    if not np.isfinite(T).any() or np.nanmin(T) >= -PUSHED * max(np.nanmax(T), NO_FORCE):
        return []
    time, least = run["time"].values, np.nanmin(np.where(np.isnan(T), np.inf, T), axis=1)
    worst = int(least.argmin())
    return [
        f"The cable pushes, by up to {-least[worst]:.3g} N (at {time[worst]:g} s; first at "
        f"{_first(time, least < 0.0):g} s), which no cable can: the paper's scheme has nothing that keeps it from it. "
        'Use scheme = "moving_end".'
    ]


# ---- where the equations do not hold ----


def above_surface(run: xr.Dataset, _: scenarios.Trial, model: Model) -> list[str]:
    """Vehicle or cable in the air, where the equations know only water."""
    radius = 0.5 * model.vehicle.hull.diameter
    words = "though the equations know only water: what follows is wrong. Start deeper, or command less."
    return _outside(run, model, lambda depth: -depth - radius, "above the surface", words)


def below_sea_bed(run: xr.Dataset, trial: scenarios.Trial, model: Model) -> list[str]:
    """Vehicle or cable below the sea bed that the trial tells."""
    if trial.sea_bed <= 0.0:
        return []
    words = "which no equation knows: nothing holds it up there. Change the trial, or water.sea_bed_m."
    where = f"below the sea bed at {trial.sea_bed:g} m"
    return _outside(run, model, lambda depth: depth - trial.sea_bed, where, words)


def _outside(
    run: xr.Dataset, model: Model, beyond: Callable[[np.ndarray], np.ndarray], where: str, words: str
) -> list[str]:
    """Return sentences about vehicle and cable where `beyond` of their depth is above zero [m]."""
    time, said = run["time"].values, []
    places = {"vehicle": run["depth"].values[:, None]}
    if run.attrs["tethered"] and run["node_count"].values.any():
        places["cable"] = _node_depths(run, model)
    for name, depth in places.items():
        out = np.nan_to_num(beyond(depth), nan=-np.inf)
        row, node = np.unravel_index(int(out.argmax()), out.shape)
        if out[row, node] > ROUNDING:
            first = _first(time, out.max(axis=1) > ROUNDING)
            said.append(
                f"The {name} is {where} from {first:g} s on, and at a depth of {depth[row, node]:.3g} m at "
                f"{time[row]:g} s, {words}"
            )
    return said


def strength(run: xr.Dataset, _: scenarios.Trial, model: Model) -> list[str]:
    """The cable pulls harder than it may."""
    most = model.cable.strength
    if most <= 0.0 or not run.attrs["tethered"]:
        return []
    time, T = run["time"].values, np.nan_to_num(run["cable_node_tension"].values).max(axis=1)
    if T.max() <= most:
        return []
    worst, since = int(T.argmax()), _first(time, most < T)
    return [
        f"The cable pulls with {T[worst]:.4g} N at {time[worst]:g} s, and may carry {most:g} N (cable.strength; above "
        f"it since {since:g} s): a real one might part. Go slower, or take a stronger cable."
    ]


def bend_radius(run: xr.Dataset, _: scenarios.Trial, model: Model) -> list[str]:
    """The cable is bent tighter than it may be."""
    least = model.cable.minimum_bend_radius
    if least <= 0.0 or not run.attrs["tethered"]:
        return []
    time, radius = run["time"].values, bend_radii(run)
    if not radius.size or radius.min() >= least:
        return []
    tightest = radius.min(axis=1)
    worst = int(tightest.argmin())
    node, since = int(radius[worst].argmin()) + 1, _first(time, tightest < least)
    return [
        f"The cable is bent to a radius of {tightest[worst]:.2g} m at {time[worst]:g} s, node {node} from the vehicle, "
        f"and may be bent to {least:g} m (cable.minimum_bend_radius; below it since {since:g} s). "
        "Turn more gently, or give the cable its bending_stiffness."
    ]


def bend_radii(run: xr.Dataset) -> np.ndarray:
    """Return the radius of the circle through three neighbouring nodes, ∞ in slack parts (samples, nodes − 2). [m].

    R = abc/4A of a triangle with the sides a, b, c; 4A = 2 |a × b| = 2 √(a²b² − (a·b)²).
    """
    P, T = run["cable_position"].values, run["cable_node_tension"].values
    if P.shape[1] < 3:
        return np.full((P.shape[0], 1), np.inf)
    side = np.diff(P, axis=1)
    a, b = side[:, :-1], side[:, 1:]
    aa, bb, ab = (np.einsum("tni,tni->tn", one, two) for one, two in ((a, a), (b, b), (a, b)))
    product = np.sqrt(aa * bb * (aa + bb + 2.0 * ab))
    square = aa * bb - ab * ab
    pulls = np.minimum(np.minimum(T[:, :-2], T[:, 1:-1]), T[:, 2:]) > TAUT
    bent = square > STRAIGHT**2 * aa * bb  # false where nodes coincide, and where there are none: NaN
    return np.where(pulls & bent, product / (2.0 * np.sqrt(np.where(bent, square, 1.0))), np.inf)


# ---- what was asked for ----


def actuators(run: xr.Dataset, _: scenarios.Trial, model: Model) -> list[str]:
    """A command beyond what the vehicle can do, or an actuator at its limit throughout."""
    if run.attrs["prescribed"]:
        return []
    said = [sentence for fin in FINS for sentence in _fin(run, model, fin)]
    return said + _propeller(run, model)


def _fin(run: xr.Dataset, model: Model, fin: str) -> list[str]:
    """Return what is wrong with a fin: cut off, at its limit, or turning as fast as it can all the time."""
    time, servo = run["time"].values, getattr(model.vehicle, FINS[fin])
    command, angle = run[f"{fin}_command"].values, run[f"{fin}_angle"].values
    name, limit = fin.replace("_", " "), servo.deflection_limit * DEGREE
    moved = np.sign(command) * np.maximum(np.abs(command) - servo.dead_band * DEGREE, 0.0)
    cut = np.abs(moved + servo.offset * DEGREE) - limit
    said, key = [], f"vehicle.{FINS[fin]}"
    if cut.max() > 1e-6:
        worst = int(cut.argmax())
        said.append(
            f"The {name} is commanded to {command[worst]:.4g}° and goes to {limit:.4g}° ({key}.deflection_limit): up "
            f"to {cut[worst]:.3g}° are cut off, first at {_first(time, cut > 1e-6):g} s. Command less."
        )
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


def _propeller(run: xr.Dataset, model: Model) -> list[str]:
    """Return what is wrong with the propeller: asked for too much, or behind its command."""
    time, c = run["time"].values, model.vehicle.motor.speed_per_volt
    command, speed = run["propeller_command"].values, run["propeller_speed"].values
    most = c * model.vehicle.battery.full_voltage
    if np.abs(command).max() > most * (1.0 + 1e-9):
        worst = int(np.abs(command).argmax())
        return [
            f"The propeller is commanded to {command[worst]:.4g} rev/s, and the full battery drives it at "
            f"{most:.4g} rev/s at most (first at {_first(time, np.abs(command) > most):g} s). Command less."
        ]
    behind = np.sign(command) * speed < BEHIND * np.abs(command)
    spun_up = 10.0 * model.vehicle.motor.lag
    if throughout := _throughout(time, behind, max(SHORT, spun_up)):
        lack = np.where(behind, np.abs(command) - np.abs(speed), 0.0)
        return [
            f"The propeller is up to {lack.max():.3g} rev/s behind its command {throughout}: the battery does not "
            "give more. Command less, or give it a stronger battery."
        ]
    return []


# ---- helpers ----


def _throughout(time: np.ndarray, at_limit: np.ndarray, short: float = SHORT) -> str:
    """Say for how long a limit holds, if it is most of the run or a long stretch, and not a short one [s]."""
    longest, begin = _longest(time, at_limit)
    if longest > max(LONG, short):
        return f"from {begin:g} s on for {longest:.3g} s"
    most = longest > short and at_limit.mean() > MOST_OF_THE_RUN
    return f"for {_percent(at_limit.mean())} of the run" if most else ""


def _longest(time: np.ndarray, holds: np.ndarray) -> tuple[float, float]:
    """Return how long something holds at a stretch, at most, and when that stretch begins. [s]."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], holds, [False]]).astype(int)))
    begin, end = edges[::2], edges[1::2] - 1
    if not begin.size:
        return 0.0, 0.0
    spans = time[end] - time[begin]
    return float(spans.max()), float(time[begin[spans.argmax()]])


def _first(time: np.ndarray, holds: np.ndarray) -> float:
    """Return when something first holds. [s]."""
    return float(time[int(np.argmax(holds))])


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


def _finer(trial: scenarios.Trial) -> str:
    """Say what to do about steps that are too long."""
    return (
        f"Halve cable_step_s ({trial.cable_step:g} s), hull_step_s ({trial.hull_step:g} s) and segment_length_m "
        f"({trial.segment_length:g} m), and see what changes (--check)."
    )


def _chords(run: xr.Dataset) -> np.ndarray:
    """Return the distances between neighbouring nodes, NaN behind the last (samples, nodes − 1). [m]."""
    side = np.diff(run["cable_position"].values, axis=1)
    return np.sqrt(np.einsum("tni,tni->tn", side, side))


def _tow_speed(run: xr.Dataset, time: np.ndarray) -> np.ndarray:
    """Return the speed of the tow point relative to the drum (samples,). [m/s]."""
    P, nodes = run["cable_position"].values, run["node_count"].values
    drum = P[np.arange(time.size), np.maximum(nodes - 1, 0)]
    return np.linalg.norm(np.gradient(P[:, 0] - drum, time, axis=0), axis=1)


def _node_depths(run: xr.Dataset, model: Model) -> np.ndarray:
    """Return the depths of the cable's nodes (samples, nodes). [m]."""
    pitch, roll = (np.radians(float(run[name].values[0])) for name in ("pitch", "roll"))
    x, y, z = model.vehicle.tow_point.position()
    tow = -np.sin(pitch) * x + np.cos(pitch) * (np.sin(roll) * y + np.cos(roll) * z)
    down = run["cable_position"].values[:, :, 2]
    return down + (float(run["depth"].values[0]) + tow - down[0, 0])


CHECKS: dict[str, Check] = {
    "energy_residual": energy_residual,
    "resolution": resolution,
    "tow_force": tow_force,
    "ill_posed_drum": ill_posed_drum,
    "slack": slack,
    "closure": closure,
    "push": push,
    "above_surface": above_surface,
    "below_sea_bed": below_sea_bed,
    "strength": strength,
    "bend_radius": bend_radius,
    "actuators": actuators,
}
"""Name → check; the names stand in ``summary.json`` and in the attributes of a run."""
