"""The default scheme: a cable whose end at the drum moves along it, in Cartesian balances, of second order.

The four unknowns of a segment are its tension and the place of its far node. The last segment grows at the drum; a
longer one is split, a shorter one merged (`remeshing`). What may be used from outside stands in `__all__`; everything
else of this package is its own (a contract in ``pyproject.toml`` holds it).

subject                                                       file
------------------------------------------------------------  -----------------------------------------------
the cable now, the steps before, the matrix, options          state
momentum, drag and weight of one segment                      segment_load, chord_correction
tension against stretch, and none when it is slack            slack_law
backward differences of second order in time                  bdf2
balance of every node, first and last                         assembly, bending
what lies on the sea bed; sections and bodies                 contact, composition
one step: Newton's method, and how the tow force answers      time_step, block_solver
a step made real; a node more or less at the drum             remeshing
a velocity that changes at once                               jolt
the run: start, steps by their error, results, why it stopped initial_shape, time_loop, stops
where a cable comes to rest                                   equilibrium
a step to where a host moves the ends                         host_step
where the work goes                                           energy
"""

from cable.moving_end.energy import (
    ADDED_MASS,
    AT_DRUM,
    CARRIED,
    FLOWS,
    GRAVITY_WORK,
    LOSS,
    STORED,
    STRAINED,
    TO_BED,
    TOWED,
    damping_loss,
    energy_flow,
)
from cable.moving_end.initial_shape import lay_held, lay_straight, start_in_water
from cable.moving_end.jolt import take_jolt
from cable.moving_end.remeshing import accept
from cable.moving_end.segment_load import Load, new_load
from cable.moving_end.state import LONGEST, NOW, Line, enlarged, in_water, new_line, paid_out
from cable.moving_end.stops import Names, describe_stop
from cable.moving_end.time_step import impedance, try_step

__all__ = [
    "ADDED_MASS",
    "AT_DRUM",
    "CARRIED",
    "FLOWS",
    "GRAVITY_WORK",
    "LONGEST",
    "LOSS",
    "NOW",
    "STORED",
    "STRAINED",
    "TOWED",
    "TO_BED",
    "Line",
    "Load",
    "Names",
    "accept",
    "damping_loss",
    "describe_stop",
    "energy_flow",
    "enlarged",
    "impedance",
    "in_water",
    "lay_held",
    "lay_straight",
    "new_line",
    "new_load",
    "paid_out",
    "start_in_water",
    "take_jolt",
    "try_step",
]
