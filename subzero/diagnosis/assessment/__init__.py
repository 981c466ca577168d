"""Detectability of causes, misfit of the nominal model, gain of the extended one, and the next trial.

subject                                                   file
--------------------------------------------------------  ----------------
signal of a cause, and D to its closest rival             identifiability
residuals of the nominal model; gain on held-out data     goodness_of_fit
the trial that best tells hypotheses apart                next_trial, trial_library

`__all__` lists the public names (a contract enforces this for code outside the diagnosis).
"""

from subzero.diagnosis.assessment.goodness_of_fit import (
    BLOCKS,
    Fitted,
    curves,
    gain,
    held_out,
    misfits,
    parts_of,
    raw,
    rows_of,
    share,
    whiteness,
)
from subzero.diagnosis.assessment.identifiability import (
    detectability,
    information,
    marginal,
    separation,
    with_whole_effects,
)
from subzero.diagnosis.assessment.next_trial import (
    DECISIVE_DISCRIMINATION,
    Belief,
    is_safe,
    next_trial,
    outlook,
    prepared_trial,
)
from subzero.diagnosis.assessment.trial_library import (
    LIBRARY,
    PLANE_AMPLITUDE,
    RUDDER_AMPLITUDE,
    cruise,
    fastest,
    flown,
    rich,
    rudder_doublets,
)
from subzero.diagnosis.assessment.trial_library import rows_of as trial_rows

__all__ = [
    "BLOCKS",
    "DECISIVE_DISCRIMINATION",
    "LIBRARY",
    "PLANE_AMPLITUDE",
    "RUDDER_AMPLITUDE",
    "Belief",
    "Fitted",
    "cruise",
    "curves",
    "detectability",
    "fastest",
    "flown",
    "gain",
    "held_out",
    "information",
    "is_safe",
    "marginal",
    "misfits",
    "next_trial",
    "outlook",
    "parts_of",
    "prepared_trial",
    "raw",
    "rich",
    "rows_of",
    "rudder_doublets",
    "separation",
    "share",
    "trial_rows",
    "whiteness",
    "with_whole_effects",
]
