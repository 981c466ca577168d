"""Run a scheme that solves equation (7) in its angles, and hand back the default scheme's `History`.

"paper_tangent" and "paper_drum": (20)-(26) as printed, `printed_scheme`. "equation7": our independent
second-order formulation, `box_scheme`. Imported only when one of them is asked for, so the default
scheme compiles nothing of it.
"""

from __future__ import annotations

import numpy as np

from cable.drum import DrumProperties
from cable.feng_allen.box_history import BoxHistory, TowVelocity
from cable.feng_allen.box_scheme import pull_out_boxes
from cable.feng_allen.printed_scheme import pull_out_paper
from cable.history import History, Outcome
from cable.properties import CableProperties
from cable.tow_path import sample_path

READINGS = {"paper": "tangent", "paper_tangent": "tangent", "paper_drum": "drum"}


def pull_out_as_printed(
    tow_velocity: TowVelocity,
    duration: float,
    step: float,
    cable: CableProperties,
    drum: DrumProperties,
    current: np.ndarray,
    scheme: str,
    segment_length: float = 0.5,
) -> History:
    """Pull cable off the drum with a scheme of the angle formulation; arguments as `cable.pull_out`.

    `segment_length` counts for "equation7" only; the paper ties it to the step.
    """
    step = duration / max(1, round(duration / step))
    water = tuple(float(x) for x in current)
    if scheme in READINGS:
        reading = READINGS[scheme]
        run = pull_out_paper(tow_velocity, duration, step, cable, drum, water, reading=reading)
    else:
        run = pull_out_boxes(tow_velocity, duration, step, cable, drum, water, segment_length=segment_length)
    return _as_history(run, sample_path(tow_velocity, duration, step).place, scheme)


def _as_history(run: BoxHistory, tow: np.ndarray, scheme: str) -> History:
    """Return a run of the angle formulation as the default scheme's history."""
    outcome = Outcome(
        completed=run.converged,
        message="The run reached its end." if run.converged else run.message,
        iterations=int(run.iterations.sum()),
        worst_residual=run.residual,
    )
    return History(
        time=run.time,
        tow_force=run.tow_force,
        tow_tension=run.tow_tension,
        drum_tension=run.drum_tension,
        length=run.length,
        tow_point=tow[: len(run.time)],
        shapes=tuple(run.positions),
        tensions=tuple(state[:, 0] for state in run.states),
        outcome=outcome,
        scheme=scheme,
    )
