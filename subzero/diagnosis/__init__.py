"""Diagnosis: which physical cause explains where a simulation differs from measured records, and how sure that is.

    records + nominal model → residuals → linearisation → evidence of every hypothesis → MAP fits → verdict

Bayesian variable selection on the parameters of a simulator. A hypothesis is a set of causes: their parameters have the
wide prior N(0, s²), all others the narrow one N(0, (κτ)²). Its evidence is Laplace's, around a MAP fit with real
simulations, mixed over κ. Change points and latent forces compete with the causes on the same scale.

symbol       name                                                     unit          module
-----------  -------------------------------------------------------  ------------  --------------------------
z            deviations of all parameters from the nominal model      their own     hypothesis.effect
τ, s         prior standard deviations: tolerance, size of an effect  as z          hypothesis.effect
h(z)         what the sensors would have measured                     channel's     inference.simulator
W            whitening by the noise: level, colour, gaps              1             inference.noise
r, J         whitened residual W (y − h(z)), and ∂(W h)/∂z            1             inference.problem
κ            scale of all tolerances, mixed over 1, 2, 4              1             inference.linear_gaussian
D            squared Mahalanobis distance to the closest rival        1             assessment.identifiability

`api` is the way in; `results` are the values that come out. Reading order: hypothesis, inference, assessment, verdict,
report.
"""
