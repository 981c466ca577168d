"""Diagnosis: what a simulation gets wrong, which physical cause explains it, and what that explains of new data.

    records + nominal model → simulated beside measured → sensitivities → evidence for every cause → refits → verdict

symbol       name                                                     unit          file
-----------  -------------------------------------------------------  ------------  -----------
z            deviations of all parameters from the nominal model      their own     effect
τ, s         tolerance of the nominal model; size of an effect        as z          effect
h(z)         what the sensors would have measured                     channel's     response
W            whitening: noise level, colour, gaps                     1             noise
r, J         whitened residual, ∂(W h)/∂z                             1             problem
κ            scale of all tolerances, mixed over 1, 2, 4              1             evidence
D            squared distance to the closest rival                    1             evidence
"""
