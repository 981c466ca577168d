"""From the explanations of a search to a verdict: terms in the words of a trial, estimates, the extended model.

subject                                                   file
--------------------------------------------------------  ----------------
terms as causes of the catalogue and errors in the data   terms
explanations, and their fits as least-squares problems    pool
numbers with intervals, the extended model                estimates
unknown force, gain, next trial, curves                   follow_up
the verdict                                               conclude

`__all__` lists the public names.
"""

from subzero.diagnosis.verdict.conclude import Asked, concluded
from subzero.diagnosis.verdict.pool import deviations
from subzero.diagnosis.verdict.terms import cause_of, data_error

__all__ = ["Asked", "cause_of", "concluded", "data_error", "deviations"]
