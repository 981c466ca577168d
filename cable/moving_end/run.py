"""Run the default scheme along sampled paths, and hand back its history."""

from __future__ import annotations

import numpy as np

from cable.current import Water
from cable.history import History, Outcome
from cable.moving_end.energy import LOSS, STORED
from cable.moving_end.initial_shape import start_in_water
from cable.moving_end.segment_load import Load
from cable.moving_end.state import Line, Solved
from cable.moving_end.stops import describe_stop
from cable.moving_end.time_loop import Record, follow_path, new_record
from cable.properties import CableNumbers, DrumNumbers
from cable.tow_path import TowPath


def run(
    line: Line,
    path: TowPath,
    led: np.ndarray,
    water: Water,
    c: CableNumbers,
    drum: DrumNumbers,
    rtol: float,
    work: Load,
    capacity: int,
) -> History:
    """Run a line that is laid out, and return its history."""
    start_in_water(line, water, c, work)
    record = new_record(path.times.size, capacity)
    rows = follow_path(line, path, led, water, c, drum, rtol, work, record)
    solved = line.ends.solved
    trouble = "" if rows == path.times.size else describe_stop(float(path.times[rows - 1]), line, drum, c)
    return as_history(path, record, rows, solved, trouble)


def as_history(path: TowPath, record: Record, rows: int, solved: Solved, trouble: str) -> History:
    """Return the record's filled rows as a history; `trouble` says what stopped it, if it was stopped."""
    times, tow, completed = path.times, path.place, rows == path.times.size
    message = "The run reached its end." if completed else trouble
    cuts = np.cumsum(record.segments[:rows] + 1).tolist()
    parts = [slice(first, last) for first, last in zip([0, *cuts], cuts, strict=False)]
    return History(
        time=times[:rows],
        tow_force=record.tow_force[:rows],
        tow_tension=record.tow_tension[:rows],
        drum_tension=record.drum_tension[:rows],
        length=record.length[:rows],
        tow_point=tow[:rows],
        shapes=tuple(record.position[part] for part in parts),
        tensions=tuple(record.tension[part] for part in parts),
        outcome=Outcome(
            completed=completed,
            message=message,
            iterations=int(record.iterations[:rows].sum()),
            worst_residual=float(solved.residual),
            steps=int(record.steps[:rows].sum()),
            largest_courant_number=float(record.courant[:rows].max()),
            energy_residual=float(abs(record.ledger[2, STORED]) / max(record.ledger[2, LOSS], 1e-30)),
        ),
        scheme="moving_end",
        tow_impulse=record.impulse[:rows],
    )
