"""Reasons why the numbers of a cable may be wrong; runs of a cable alone and trials with a vehicle share them.

    energy      residual of the balance of work and losses, as a share of them
    roughness   |F(t−h) − 2F(t) + F(t+h)| / max |F|: a tow force that jumps from sample to sample is not resolved
    slack       cable that is longer than the way between its nodes, or pulls at neither end of a segment
    surface     cable above down = 0 and above its ends: in the air, if down is depth

Pure functions of arrays; `subzero.validity` says the same of coupled runs, with times and remedies of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

RESIDUAL = 0.01
"""A residual above this share of the largest energy of the run is too much. [-]"""
NO_FORCE = 1e-6
"""A smaller force counts as zero. [N]"""
ROUGH = 0.03
"""A tow force whose second difference from sample to sample exceeds this share of the largest force is not resolved by
the steps. Of 160 trials of `benchmarks.trust` all 117 that were wrong by more than 3 % had more, and none of the 13
that were right within 1 % (0.2 to 2.5 %). [-]"""
LIMP = 1e-6
"""A cable with less tension than this at both ends of a segment does not pull there. [N]"""
SLACK_SHARE = 0.05
"""Slack is warned of from this share of the length on. [-]"""
ROUNDING = 1e-6
"""A point beyond surface or bed by less than this is at it. [m]"""
FOLDED = 1e-3
"""A cable whose segments are shorter than their cable by more than this share is folded somewhere. [-]"""


def roughness(force: np.ndarray) -> np.ndarray:
    """Return how a force (samples, 3) jumps from sample to sample, as a share of its largest value (samples − 3,). [-].

    Between evenly spaced samples an eighth of it is what a straight line misses. The first sample is left out: the
    force at the start is a guess.
    """
    largest = np.linalg.norm(force, axis=1).max()
    if largest < NO_FORCE or force.shape[0] < 4:
        return np.zeros(0)
    jumps: np.ndarray = np.linalg.norm(force[3:] - 2.0 * force[2:-1] + force[1:-2], axis=1) / largest
    return jumps


def slack_share(length: np.ndarray, chord: np.ndarray, tension: np.ndarray) -> np.ndarray:
    """Return which share of a cable is slack, or folded away in segments that are too short (samples,). [-].

    Args:
        length: of the cable (samples,). [m]
        chord: distances between neighbouring nodes (samples, nodes − 1), 0 after the last. [m]
        tension: at the nodes (samples, nodes). [N]
    """
    length = np.maximum(length, 1e-9)
    folded = 1.0 - chord.sum(axis=1) / length
    if not (folded > FOLDED).any():
        return np.zeros(length.shape)
    limp = (tension[:, 1:] < LIMP) & (tension[:, :-1] < LIMP)
    share = np.where(limp, chord, 0.0).sum(axis=1) / length + folded
    return np.where(folded > FOLDED, np.clip(share, 0.0, 1.0), 0.0)


def above_surface(shapes: Sequence[np.ndarray], held: Sequence[np.ndarray]) -> tuple[str, ...]:
    """Say by how much a cable is above down = 0 and above the ends that it is held at; nothing if it is not.

    Args:
        shapes: node positions, an array (nodes, 3) a sample. [m]
        held: of each sample, places that a cable is held at (ends, 3). [m]
    """
    above = [min(0.0, ends[:, 2].min()) - shape[:, 2].min() for shape, ends in zip(shapes, held, strict=True)]
    if max(above) <= ROUNDING:
        return ()
    highest = min(float(shape[:, 2].min()) for shape in shapes)
    return (
        f"Part of the cable is above down = 0, by up to {-highest:.3g} m: where that is the surface, it is in the air, "
        "and the equations know only water. Hold its ends deeper, or take a heavier cable.",
    )


def doubts_of(
    time: np.ndarray,
    tow_force: np.ndarray,
    length: np.ndarray,
    shapes: Sequence[np.ndarray],
    tensions: Sequence[np.ndarray],
    energy_residual: float,
) -> tuple[str, ...]:
    """Return why the numbers of a run may be wrong, in sentences; none if no check finds a reason.

    Args:
        time: of the samples (samples,). [s]
        tow_force: of the cable on the vehicle (samples, 3). [N]
        length: of the cable (samples,). [m]
        shapes: node positions, an array (nodes, 3) a sample. [m]
        tensions: at the nodes, an array (nodes,) a sample. [N]
        energy_residual: residual of the energy balance; NaN where no energies are recorded. [-]
    """
    found = []
    if energy_residual > RESIDUAL:
        found.append(
            f"The energy balance leaves {100.0 * energy_residual:.3g} % unexplained (more than {100.0 * RESIDUAL:g} "
            "%): the steps do not follow what happens. Shorten time_step and segment_length."
        )
    jump = roughness(tow_force)
    if jump.size and jump.max() > ROUGH:
        found.append(
            f"The tow force jumps from sample to sample, by up to {100.0 * jump.max():.3g} % of its largest value, at "
            f"{time[2 + int(jump.argmax())]:g} s: the steps do not resolve it. Shorten time_step and segment_length."
        )
    share = np.array([_share(*sample) for sample in zip(length, shapes, tensions, strict=True)])
    if share.max(initial=0.0) > SLACK_SHARE:
        found.append(
            f"Up to {100.0 * share.max():.3g} % of the cable is slack (at {time[int(share.argmax())]:g} s): there its "
            "shape means nothing, and the tow force jumps when it comes taut."
        )
    return (*found, *above_surface(shapes, [shape[:1] for shape in shapes]))


def _share(length: float, shape: np.ndarray, tension: np.ndarray) -> float:
    """Return which share of the cable is slack in one sample."""
    chord = np.linalg.norm(np.diff(shape, axis=0), axis=1)
    return float(slack_share(np.array([length]), chord[None], tension[None])[0])
