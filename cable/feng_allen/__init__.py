"""Equation (7) of Feng and Allen (2004) in its angles: the printed scheme (20)-(26), and a box scheme of our own.

`cable.Paper` and `cable.Equation7`. Loaded only when one of them is asked for. What may be used
from outside, to run a vehicle on the printed scheme, stands in `__all__`.
"""

from cable.feng_allen.box_equations import Ends
from cable.feng_allen.box_newton import (
    CONVERGED,
    NOTHING,
    OUTCOMES,
    ROW_NAMES,
    START,
    BoxWorkspace,
    NewtonReport,
    box_workspace,
    reported,
    start_paper,
)
from cable.feng_allen.equation7 import Equation7Numbers, angles_of, equation7_numbers, tangent
from cable.feng_allen.printed_scheme import advance_paper, node_force

__all__ = [
    "CONVERGED",
    "NOTHING",
    "OUTCOMES",
    "ROW_NAMES",
    "START",
    "BoxWorkspace",
    "Ends",
    "Equation7Numbers",
    "NewtonReport",
    "advance_paper",
    "angles_of",
    "box_workspace",
    "equation7_numbers",
    "node_force",
    "reported",
    "start_paper",
    "tangent",
]
