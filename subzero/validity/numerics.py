"""Doubts about the numbers of a run: what the steps, the segments or an ill-posed drum may have spoiled."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np

from cable import doubts
from cable.doubts import LIMP, NO_FORCE, RESIDUAL, ROUGH, SLACK_SHARE
from subzero.channels import ENERGY_CHANNELS
from subzero.validity.limits import blocks_of, first_time, longest_span, percent

if TYPE_CHECKING:
    import scenarios
    from cable import CableProperties, DrumProperties
    from subzero.channels import AnyRun
    from subzero.model import Model

NO_ENERGY = 1e-9
"""Below this nothing has happened yet. [J]"""

OVERRUN, SAGGING, ILL_POSED_TIME = 1.2, 0.2, 2.0
"""A drum that runs so many times faster than the tow point goes away feeds itself; a cable whose weight is more than
this share of its drag hangs off the drum at an angle; both count when they last longer than this. Of 171 trials of
`benchmarks.trust` on drums without friction that were wrong, 112 had it, and none of the 5 that were right.
[-], [-], [s]"""
PROOF, DRUM_PROOF = 4, 8
"""A run so many times as fine, and all that are coarser, have to confirm a force that is doubted; the second on a drum
that does not hold its cable: a wave in it may be hidden from four times as many segments. [-]"""
SLOWEST = 0.02
"""Pay-out rates below this count as zero. [m/s]"""
LEAN = 0.03
"""A load across the cable of this share of its drag turns it by as many radians within the last m1 U²/(½ρπdC_t U²)
metres before the drum; more counts where no wave comes back to the drum. [-]"""
BARELY, NEARLY = 0.5, 0.75
"""A coarser run that differs by more than the first share of `rtol` only just confirms a force where none is sure to;
an error that is estimated at more than the second may be larger than `rtol`: where a cable comes taut again and again,
no order holds, and estimates are good to a third at best. Of 216 trials of `benchmarks.trust` without a warning, one
of 41 above it was off by more than 3 %, and none of the others by more than 2.3 %. [-]"""

SLACK_TIME = 1.0
"""Slack is warned of, too, when it lasts longer than this. [s]"""

CLOSED = 0.01
"""A cable that ends farther from the tow point than this share of its length is not the cable of this vehicle. [-]"""
PUSHED = 1e-3
"""A cable that pushes harder than this share of its hardest pull is not a cable. [-]"""


def energy_residual(run: AnyRun, trial: scenarios.Trial, _: Model) -> list[str]:
    """The balance of all energies does not close, at any time: a residual that cancels later counts too.

    As errors of the force are, a residual is held against the largest of the run: a cable that begins with a jolt loses
    some millijoules in it, which is all the energy that there is at first.
    """
    if run.attrs["prescribed"] and not run.attrs["tethered"]:
        return []  # whatever moves the vehicle does unknown work
    residual = np.abs(run["energy_residual"].values)
    largest = float(np.abs([run[name].values for name in ENERGY_CHANNELS[:-1]]).max())
    # Residuals are compared with the largest energy: without one there is nothing to compare.
    if not (np.isfinite(residual).all() and np.isfinite(largest)) or largest < NO_ENERGY:
        return []
    share = residual / largest
    if share.max() <= RESIDUAL:
        return []
    time, worst = run["time"].values, int(share.argmax())
    return [
        f"The energy balance leaves up to {percent(share.max())} of the largest term unexplained "
        f"({residual[worst]:.3g} J of {largest:.3g} J at {time[worst]:g} s; above {percent(RESIDUAL)} "
        f"since {first_time(time, share > RESIDUAL):g} s): the steps do not follow what happens. {_finer(trial)}"
    ]


def resolution(run: AnyRun, trial: scenarios.Trial, model: Model) -> list[str]:
    """Steps and segments twice as long give another tow force, however fine they are:
    `subzero.simulation.refinement`.
    """
    accuracy = json.loads(run.attrs.get("accuracy", "{}"))
    # Without an accuracy no coarser run was made.
    if not accuracy or is_resolved(run):
        return []
    finer = f"({2 ** accuracy['halvings']} times as fine as given)"
    asked = f"run.rtol allows {percent(trial.rtol)}"
    start, change = _share(accuracy["start_error"]), _share(accuracy["change"])
    # A contradiction by a finer run is the strongest evidence, so it is reported first.
    if accuracy["proof_error"] > trial.rtol:
        same = "" if change > trial.rtol else ", though with twice as long ones it is the same"
        return [
            f"The tow force depends on steps and segments: {accuracy['proof_finer']} times as fine as these {finer} "
            f"they change it by {_percent(accuracy['proof_error'])} (at {accuracy['proof_time']:g} s; {asked}){same}. "
            "Give the drum friction_torque or a [winch], or the cable bending_stiffness."
        ]
    # An error in the start only has another cause, and another remedy.
    if start > max(trial.rtol, change):
        return [
            f"The tow force of the start depends on steps and segments: four times as fine as these {finer} they "
            f"change it by {_percent(start)} (at {accuracy['start_time']:g} s; {asked}). The cable is jerked out of "
            f"its shape at rest{_start_imbalance(run, trial, model)}, and the samples do not follow how that fades or "
            "rings. Shorten cable_step_s, let these begin gently, or leave the first samples out."
        ]
    spent = (
        " Finer runs would take longer than [run] budget_s allows." if accuracy.get("budget_spent") else ""
    )
    return [
        f"The tow force depends on steps and segments: from twice as long ones to these {finer} it changes by "
        f"{_percent(change)} (at {accuracy['time']:g} s; {asked}). Either they are "
        "still too long, or the problem is ill-posed: a heavy cable, or one in a cross current, on a drum that does "
        "not hold it, or a cable that snaps taut. Give the drum friction_torque or a [winch], or the cable "
        f"bending_stiffness.{spent}"
    ]


def _start_imbalance(run: AnyRun, trial: scenarios.Trial, model: Model) -> str:
    """Return the motions and forces at time 0 of a run, where a cable at rest is laid: ": the water by 0.3 m/s,
    …".
    """
    winch, vessel = model.winch, model.vessel
    flow = model.water().at((0.0, 0.0, trial.start.depth))
    speeds = {  # a cable that hangs is at rest in the current, one that is laid straight is not
        "the water": float(np.linalg.norm(flow)) if trial.start.drum is None else 0.0,
        "the vessel": float(np.linalg.norm(vessel.velocity[0])) if vessel else 0.0,
        "the vehicle": abs(float(run["surge_speed"].values[0])),
        "the winch": abs(winch.setpoint[0]) if winch and winch.control == "pay_out_rate" else 0.0,
    }
    found = [f"{name} by {speed:.2g} m/s" for name, speed in speeds.items() if speed > 0.0]
    if winch and winch.control == "constant_tension":
        excess = winch.setpoint[0] - float(run["drum_tension"].values[0])
        found.append(f"the winch asks for {excess:+.2g} N")
    return f": {', '.join(found)}" if found else " by the propeller"


def _share(number: float | None) -> float:
    """Return a number of an accuracy; an infinite one is stored as None in it."""
    return np.inf if number is None else number


def _percent(share: float) -> str:
    """Return a change of the force in words."""
    return f"{percent(share)} of its largest value" if np.isfinite(share) else "from stopping to going on"


def is_resolved(run: AnyRun) -> bool:
    """Return whether a coarser run has confirmed the tow force of this one within its trial's rtol."""
    accuracy = json.loads(run.attrs.get("accuracy", "{}"))
    error = accuracy.get("force_error")
    return error is not None and error <= accuracy["rtol"]


def starts_otherwise(run: AnyRun) -> bool:
    """Return whether finer runs of the start alone give another tow force there."""
    accuracy = json.loads(run.attrs.get("accuracy", "{}"))
    return bool(accuracy) and _share(accuracy["start_error"]) > accuracy["rtol"]


def is_proved(run: AnyRun, finer: int) -> bool:
    """Return whether a run so many times as fine has confirmed the tow force, too."""
    return is_resolved(run) and json.loads(run.attrs["accuracy"]).get("proof_finer", 0) >= finer


def tow_force(run: AnyRun, trial: scenarios.Trial, model: Model) -> list[str]:
    """The tow force jumps from sample to sample, and no coarser run has confirmed it.

    A kink that a winch was asked for is none: where its setpoint changes its slope, a right force has one too.
    """
    if not run.attrs["tethered"] or is_resolved(run):
        return []
    # Second differences lose one sample at each end, and the force of time 0 is a guess.
    jump, time = roughness(run), run["time"].values[2:-1]
    for kink in model.winch.time[1:] if model.winch is not None and jump.size else ():
        jump = np.where(np.abs(time - kink) <= trial.cable_step * (1.0 + 1e-6), 0.0, jump)
    rough = jump > ROUGH
    if not rough.any():
        return []
    return [
        f"The tow force jumps from sample to sample, by up to {percent(jump.max())} of its largest value "
        f"(at {time[jump.argmax()]:g} s; by more than {percent(ROUGH)} in {rough.sum()} of {jump.size} samples, "
        f"first at {first_time(time, rough):g} s): the steps do not resolve it. {_finer(trial)}"
    ]


def roughness(run: AnyRun) -> np.ndarray:
    """Return how the tow force jumps from sample to sample, as `cable.doubts.roughness` (samples − 3,). [-]."""
    return doubts.roughness(
        np.stack([run[f"cable_force_{axis}"].values for axis in ("forward", "starboard", "down")], axis=1)
    )


def ill_posed_drum(run: AnyRun, _: scenarios.Trial, model: Model) -> list[str]:
    """A free drum that does not hold its cable: nothing in the equations says how the cable leaves it.

    If the friction outweighs m1 U², waves come back to the drum and determine it. A cable that unwinds there
    nevertheless is only doubted as long as no coarser run has confirmed its force. Nor is a cable doubted whose
    segments do determine it: the error is found to be small (`DRUM_PROOF`).
    """
    time, S = run["time"].values, run["cable_length"].values
    if not run.attrs["tethered"] or model.winch is not None or time.size < 3 or is_proved(run, DRUM_PROOF):
        return []
    T, payout, away = run["drum_tension"].values, np.gradient(S, time), _tow_speed(run, time)
    ill = drum_is_ill_posed(T, payout, away, model.cable, model.drum)
    momentum = model.cable.virtual_mass_per_length * payout**2
    # A confirmed force leaves the second case only: where m1 U² > T, no waves come back to the drum.
    if is_resolved(run):
        ill &= momentum > T
    longest, begin = longest_span(time, ill)
    if longest <= ILL_POSED_TIME:
        return []
    # The worst sample is taken from the longest stretch, which the sentence is about.
    here = ill & (time >= begin) & (time <= begin + longest)
    worst = int(np.where(here, payout, -np.inf).argmax())
    return [
        f"The free drum does not hold the cable against its weight, from {begin:g} s on for {longest:.3g} s: at "
        f"{time[worst]:g} s it comes off at U = {payout[worst]:.3g} m/s (the vehicle goes away at {away[worst]:.3g} "
        f"m/s) with a tension of {T[worst]:.2g} N (m1 U2 is {momentum[worst]:.2g} N). How it leaves the drum is "
        "ill-posed: shorter segments give another answer, not a better one. Give the drum a friction_torque well above "
        f"{max(momentum[worst], T[worst]) * model.drum.radius:.1g} N m, or a [winch]."
    ]


def is_left_open(run: AnyRun, trial: scenarios.Trial, model: Model) -> bool:
    """Return whether nothing determines how the cable leaves its free drum, so that a coarser run confirms too
    little.

        T(S) < m1 U²,    |q⊥| > 0.03 ½ρπdC_t U²        q⊥: what water and weight do across the cable

    No wave comes back to the drum, and nothing says in which direction the cable leaves it. Without a load across, its
    drag does, within the first m1/(½ρπdC_t) metres. With one it is bent there, the more, the shorter the segments are.
    Longer segments hide it, so that is no reason to warn; but one to look again if they are shorter than that, or if
    the coarser run only just confirms the force.
    """
    accuracy = json.loads(run.attrs.get("accuracy", "{}"))
    if model.winch is not None or not accuracy:
        return False
    # The segments of the run after its halvings.
    cable, segment = model.cable, trial.segment_length / 2.0 ** accuracy["halvings"]
    is_hidden = segment * cable.tangential_drag > cable.virtual_mass_per_length
    if is_hidden and _share(accuracy["force_error"]) <= BARELY * accuracy["rtol"]:
        return False
    time = run["time"].values
    payout = np.gradient(run["cable_length"].values, time)
    faster = run["drum_tension"].values < cable.virtual_mass_per_length * payout**2
    leans = load_across(run, model) > LEAN * cable.tangential_drag * payout**2
    return longest_span(time, faster & leans & (payout > SLOWEST))[0] > ILL_POSED_TIME


def only_just_fits(run: AnyRun) -> bool:
    """Return whether the error of the tow force was estimated, and so close to `rtol` that it may be larger."""
    accuracy = json.loads(run.attrs.get("accuracy", "{}"))
    return (
        bool(accuracy)
        and not accuracy["proof_finer"]
        and _share(accuracy["force_error"]) > NEARLY * accuracy["rtol"]
    )


def load_across(run: AnyRun, model: Model) -> np.ndarray:
    """Return the load across the cable where it leaves the drum, of water and weight (samples,). [N/m]

    The current is that at the drum; along the cable it only adds to the pay-out rate.
    """
    time, P, nodes = run["time"].values, run["cable_position"].values, run["node_count"].values
    # Rows without cable have no last segment; index 1 keeps the indexing valid.
    rows, last = np.arange(time.size), np.maximum(nodes - 1, 1)
    drum, side = P[rows, last], P[rows, last - 1] - P[rows, last]
    along = side / np.maximum(np.linalg.norm(side, axis=1, keepdims=True), np.finfo(float).tiny)
    water = model.water()
    flow = np.array([water.at(place, when) for place, when in zip(drum, time, strict=True)])
    # The drum may be on a moving vessel: the flow relative to it counts.
    flow = flow - np.gradient(drum, time, axis=0)
    flow -= np.sum(flow * along, axis=1, keepdims=True) * along
    load = model.cable.normal_drag * np.linalg.norm(flow, axis=1, keepdims=True) * flow
    load[:, 2] += model.cable.weight_in_water
    load -= np.sum(load * along, axis=1, keepdims=True) * along
    across: np.ndarray = np.linalg.norm(load, axis=1)
    return across


def drum_is_ill_posed(
    tension: np.ndarray,
    payout: np.ndarray,
    tow_speed: np.ndarray,
    cable: CableProperties,
    drum: DrumProperties,
) -> np.ndarray:
    """Return when a free drum does not hold its cable: it unwinds itself, or the direction of the cable is
    undetermined.

        T(S) ≤ C_f/R_d,  U > 1.2 V                     it unwinds: its weight pulls, not the tow point
        T(S) < m1 U²,    |w_c| > 0.2 ½ρπdC_t U²        it swings: it is faster than its own waves

    In the second case all waves along the cable go away from the drum, so that the direction in which it leaves the
    drum is not determined; its weight turns it, unless its drag straightens it within the first m1/(½ρπdC_t) metres.
    Segments as long as that hide it: then a finer run is worse.

    Args:
        tension: T(S) at the drum (samples,). [N]
        payout: U = dS/dt (samples,). [m/s]
        tow_speed: V, speed of the tow point relative to the drum (samples,). [m/s]
        cable: the cable, with its weight in the water.
        drum: the drum, with its friction.
    """
    held = drum.friction_torque / drum.radius
    # A tension at the friction of the drum, or below it, cannot turn the drum.
    unwinds = (cable.weight_in_water > 0.0) & (tension <= held * (1.0 + 1e-3) + LIMP)
    unwinds &= payout > OVERRUN * tow_speed
    square = payout * payout
    swings = (tension < cable.virtual_mass_per_length * square) & (
        abs(cable.weight_in_water) > SAGGING * cable.tangential_drag * square
    )
    gives_way: np.ndarray = (payout > SLOWEST) & (unwinds | swings)
    return gives_way


def slack(run: AnyRun, trial: scenarios.Trial, _: Model) -> list[str]:
    """Part of the cable is folded: the tow force jumps when it comes taut, and no finer run has confirmed it."""
    if not run.attrs["tethered"] or is_proved(run, PROOF):
        return []
    share, longest = _slack(run, trial)
    if share.max() <= SLACK_SHARE and longest <= SLACK_TIME:
        return []
    return [
        f"{_how_slack(run, share, longest)}: there its shape means nothing, and the "
        "tow force jumps when it comes taut. Pay out less, or give the drum friction, or the cable bending_stiffness."
    ]


def slack_shape(run: AnyRun, trial: scenarios.Trial, _: Model) -> list[str]:
    """More of the cable is folded than means nothing, where finer runs have confirmed the tow force."""
    if not run.attrs["tethered"] or not is_proved(run, PROOF):
        return []
    share, longest = _slack(run, trial)
    if share.max() <= SLACK_SHARE:
        return []
    accuracy = json.loads(run.attrs["accuracy"])
    return [
        f"{_how_slack(run, share, longest)}: there its shape means nothing. The tow force is not doubted: up to "
        f"{accuracy['proof_finer']} times as fine, steps and segments change it by "
        f"{_percent(accuracy['force_error'])}."
    ]


def _slack(run: AnyRun, trial: scenarios.Trial) -> tuple[np.ndarray, float]:
    """Return which share of the cable is slack (samples,) [-], and how long some is at a stretch, at most [s]."""
    share = slack_share(run)
    share = np.where(
        run["cable_length"].values < trial.segment_length, 0.0, share
    )  # hardly any cable, no shape
    return share, longest_span(run["time"].values, share > 0.0)[0]


def _how_slack(run: AnyRun, share: np.ndarray, longest: float) -> str:
    """Return how much of the cable is slack, when, and how long."""
    time, worst = run["time"].values, int(share.argmax())
    return (
        f"Up to {percent(share[worst])} of the cable that is paid out is slack (at {time[worst]:g} s; first at "
        f"{first_time(time, share > 0.0):g} s, {longest:.3g} s at a stretch)"
    )


def slack_share(run: AnyRun) -> np.ndarray:
    """Return which share of the cable is slack, or folded away in segments that are too short (samples,). [-]."""
    S, P, T = (run[name].values for name in ("cable_length", "cable_position", "cable_node_tension"))
    return np.concatenate([doubts.slack_share(S[at], _chords(P[at]), T[at]) for at in blocks_of(S.size)])


def closure(run: AnyRun, trial: scenarios.Trial, _: Model) -> list[str]:
    """The cable does not end at the tow point."""
    # The length at its largest so far: a cable that is reeled in keeps the tolerance of its longest shape.
    gap, S = run["closure_error"].values, np.maximum.accumulate(run["cable_length"].values)
    open_ = gap > CLOSED * np.maximum(S, trial.segment_length)
    if not open_.any():
        return []
    time, worst = run["time"].values, int(gap.argmax())
    return [
        f"The cable, summed up from the drum, ends {gap[worst]:.3g} m from the tow point at {time[worst]:g} s, with "
        f"{S[worst]:.3g} m in the water (more than {percent(CLOSED)} since {first_time(time, open_):g} s): its shape "
        f'is not that of a cable between both. Use scheme = "moving_end", which closes it, or a shorter cable_step_s.'
    ]


def push(run: AnyRun, _: scenarios.Trial, __: Model) -> list[str]:
    """The cable pushes, which no cable can."""
    T = run["cable_node_tension"].values
    least, most = np.fmin.reduce(T, axis=None), np.fmax.reduce(T, axis=None)  # NaN only if all are
    if not np.isfinite(least) or least >= -PUSHED * max(most, NO_FORCE):
        return []
    time, lowest = run["time"].values, np.nanmin(np.where(np.isnan(T), np.inf, T), axis=1)
    worst = int(lowest.argmin())
    return [
        f"The cable pushes, by up to {-lowest[worst]:.3g} N (at {time[worst]:g} s; first at "
        f"{first_time(time, lowest < 0.0):g} s), which no cable can: the paper's scheme has nothing that keeps it from "
        'it. Use scheme = "moving_end".'
    ]


def _finer(trial: scenarios.Trial) -> str:
    """Return the remedy for steps that are too long."""
    return (
        f"Halve cable_step_s ({trial.cable_step:g} s), hull_step_s ({trial.hull_step:g} s) and segment_length_m "
        f"({trial.segment_length:g} m), and see what changes (--check)."
    )


def _chords(P: np.ndarray) -> np.ndarray:
    """Return the distances between neighbouring nodes, 0 after the last (samples, nodes − 1). [m]."""
    squares = (P[:, 1:] - P[:, :-1]) ** 2
    lengths: np.ndarray = np.sqrt(squares[..., 0] + squares[..., 1] + squares[..., 2])
    # Rows are padded with NaN after the last node.
    lengths[np.isnan(lengths)] = 0.0
    return lengths


def _tow_speed(run: AnyRun, time: np.ndarray) -> np.ndarray:
    """Return the speed of the tow point relative to the drum (samples,). [m/s]."""
    P, nodes = run["cable_position"].values, run["node_count"].values
    # The drum is the last node of each row, and rows differ in their number of nodes.
    drum = P[np.arange(time.size), np.maximum(nodes - 1, 0)]
    speed: np.ndarray = np.linalg.norm(np.gradient(P[:, 0] - drum, time, axis=0), axis=1)
    return speed
