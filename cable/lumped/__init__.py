"""Masses at nodes and springs between them, TR-BDF2 in time: an independent second opinion, `scheme="lumped"`.

Nothing of `cable.moving_end` is used. What may be used from outside, to run a vehicle on it, stands in `__all__`.
"""

from cable.lumped.history import Course, rope_off_drum, winch_rows
from cable.lumped.rope import OLD, REST, STATE, Rope
from cable.lumped.step import GAMMA, accept_step, begin, try_step

__all__ = [
    "GAMMA",
    "OLD",
    "REST",
    "STATE",
    "Course",
    "Rope",
    "accept_step",
    "begin",
    "rope_off_drum",
    "try_step",
    "winch_rows",
]
