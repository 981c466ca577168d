"""What records can show, how the nominal model fails, what the extended one gains, and what to fly next.

what is computed                                          file
--------------------------------------------------------  ----------------
signal of a cause, and D to its closest rival             identifiability
residuals of the nominal model, channel by channel        residuals
gain on data that were not fitted                         cross_validation
the trial that best tells hypotheses apart                next_trial, trial_library

What others may use stands in `__all__` (for what stands outside the diagnosis, a contract holds it).
"""

from subzero.diagnosis.assessment.cross_validation import (
    BLOCKS,
    Fitted,
    gain,
    held_out,
    parts_of,
    raw,
    rows_of,
    share,
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
    next_trial,
    outlook,
    outlooks,
)
from subzero.diagnosis.assessment.residuals import curves, misfits
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

__all__ = ["BLOCKS", "DECISIVE_DISCRIMINATION", "LIBRARY", "PLANE_AMPLITUDE", "RUDDER_AMPLITUDE", "Belief", "Fitted",
           "cruise", "curves", "detectability", "fastest", "flown", "gain", "held_out", "information", "marginal",
           "misfits", "next_trial", "outlook", "outlooks", "parts_of", "raw", "rich", "rows_of", "rudder_doublets",
           "separation", "share", "with_whole_effects"]  # fmt: skip
