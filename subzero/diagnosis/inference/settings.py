"""Settings of the search: how wide it is, how often it repeats a step, and when it stops.

None of these numbers belongs to the statistical model: with an unlimited budget, and simulations without non-smooth
points, the verdict would not depend on them. They save time. Constants of the model are defined with their concept:
prior probabilities, the most causes and causes without a slope (`hypotheses`), a poor fit (`map_fit`), priors of
noise (`noise`) and of latent forces (`linear_gaussian`), rules for a verdict (`model_average`). So are the steps of
differences and grids (`problem`, `change_point_scan`, `latent_force`). `benchmarks/diagnosis/settings.py` halves and
doubles each.

Log posteriors are in nats: 2 nats are odds of 7 to 1, 6 of 400 to 1. Distances of parameters are in tolerances τ.
"""

# Differences of log posterior, or of the objective of a fit. [nat]
NEGLIGIBLE_GAIN_NATS = 0.1
"""A step or a fit that gains less is not taken: no probability would change in its second digit."""
CONVERGED_GAIN_NATS = 0.5
"""A fit has converged if its linear model predicts a smaller gain and no step gains anything."""
CLOSE_NATS = 2.0
"""Explanations this close to the best may turn out better once they have converged: they are refined, and refitted
where the linear model predicts this much more.
"""
SCAN_GAIN_NATS = 3.0
"""A change point that gains less on the coarse grid of onsets is not scanned on the fine one."""
FURTHER_CAUSE_NATS = 4.0
"""A further cause is fitted even if the linear evidence is against it by this much: linear evidence errs."""
HOPELESS_NATS = 6.0
"""A hypothesis this far below the best is given up; one whose linear evidence exceeds that of its own fit by this
much is in a local minimum, and is fitted again.
"""
LINEAR_NATS = 12.0
"""Linear evidence far from a fit may err by this much: within it, screened hypotheses and one cause instead of two
are fitted, forces, drifts and large hypotheses are linearised at fits of their own, and onsets are scanned on the
fine grid.
"""
DECISIVE_NATS = 30.0
"""No sum of causes gains more over an explanation that leaves only noise; a fit that predicts this much more is
continued."""
FAR_NATS = 45.0
"""A latent force is not linearised at its own fit if its linear evidence is this far below the best."""
MAX_PREDICTED_GAIN_NATS = 300.0
"""A gain predicted with an old Jacobian counts up to this much."""

# Distances of parameters. [τ]
RESTART_TOLERANCES = 0.5
"""Restart value of non-smooth parameters: away from the non-smooth point, as in most vehicles."""
OWN_JACOBIAN_TOLERANCES = 1.0
"""A Jacobian made this close to a fit is its own."""
STRAYED_TOLERANCES = 2.0
"""A fit that moves non-smooth parameters of no named cause farther is in a bad local minimum."""
JACOBIAN_HOLDS_TOLERANCES = 4.0
"""A Jacobian serves to compare fits this far from where it was made."""
STRAINED_TOLERANCES, MAX_STRAINED = 5.0, 6
"""A wide fit that moves MAX_STRAINED parameters by more than this is close to the records by chance."""
BENT_TOLERANCES = 10.0
"""A cause that the wide fit moves by more than this is fitted by itself: linear evidence is inaccurate there."""

# Sizes and shares. [-]
POOR_MEAN_SQUARE = 1.08
"""A wide fit with a larger mean square of the whitened residual is not close to the records."""
STALE_GAIN_SHARE = 0.5
"""A step that gains less than this share of its predicted gain asks for a new Jacobian."""
NON_LINEAR_SHARE, NON_LINEAR_SHARE_OF_FIRST = 0.05, 0.75
"""Non-linearity may hide this share of a change point's linear gain, and this share of that of the first."""
SWEEP_SCALES = (0.25, 0.5, 1.0, 2.0)
"""Effect scales, either way, at which causes without a slope are simulated."""
MERGED_SCALES = (0.5, 1.5)
"""Effect scales, either way, at which a single cause is simulated as the whole explanation: instead of two causes,
and from the nominal model, instead of the parameters that a wide fit moves.
"""
LATER_SIZES = (1.0, 1.5)
"""A cause of a hypothesis is simulated from an onset on at these multiples of its size there."""

# Counts.
MAX_STEPS = 8
"""Most steps of a fit."""
MAX_ADDED = 2
"""Most fits with an addition (a further cause, a single cause that the wide fit moves far, along a force, from a
large hypothesis), and most repeats of a fit with its own result: rivals from one another's optimum, the noise of the
wide fit.
"""
MAX_TRIED = 3
"""Most fits of one kind in one round (swapped causes, restarts, change points, forces, rivals to refute), most peaks
of an onset, and most rounds: of change points, of candidates that have not converged, and of a fit that may continue.
"""
MAX_PAIRS = 4
"""Most screened pairs that are fitted; if the wide fit is far from the records, most single causes."""
MAX_RANKED = 7
"""Most hypotheses of a ranking: screened causes that are fitted; fits that are given a Jacobian of their own, are
started from one another's optimum, and have their own noise estimated.
"""
MAX_RUNS_PER_RECORD = 800
"""After so many simulations of each record only a candidate that is predicted to be the best is refined."""
