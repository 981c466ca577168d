"""Which explanations fit the records, and how probable each is: from the noise of a channel to model averaging.

subject                                                   file
--------------------------------------------------------  -----------------
parameter vector z, its prior, prior of hypotheses        ../hypothesis/hypotheses
noise of a channel, whitening                             ../hypothesis/noise
its estimate from the residual of a fit               ../hypothesis/noise_estimate
h(z): what the sensors would have measured                ../hypothesis/configuration
one simulation, from its start or from a stop             simulator
r(z) and J of all records                                 problem
records → problem                                         posing
evidence and posterior of the linear problem              linear_gaussian
MAP fit with real simulations, evidence around it         map_fit
linear evidence of all hypotheses                         screening
the pool of fitted hypotheses, each with its noise        model_fits
add, drop, swap and merge causes                          model_search
probabilities, decision rule                              model_average
onsets, ranked by linear evidence                         change_point_scan
onsets, fitted                                            change_point_fit
a force or a drift over time, and shapes of a formula     latent_force
its evidence and its history                              input_estimation
a formula for a latent force                              force_formula
change points, forces and drifts added to hypotheses      out_of_catalogue
values that a record repeats in place of measurements     repeated_values
what physics may do with a record, its linear evidence    data_error_saturated_model
errors in the data, proposed by linear evidence           data_error_scan
how close a few causes come to a record                   sparse_explanation
errors in the data, suspected together                    data_error_search
... how probable a set of them is                         data_error_evidence
... and held against all else                             data_error_choice
all that only steers the search                           settings

`__all__` lists the public names; everything else is internal to the engine (a contract in ``pyproject.toml`` enforces
this for code outside the diagnosis).
"""

# ruff: noqa: I001 - in the order of dependence, not alphabetical

from subzero.diagnosis.hypothesis.data_error import (
    KINDS as KINDS_OF_DATA_ERRORS,
    DataError,
    corrected as data_errors_undone,
)
from subzero.diagnosis.hypothesis.hypotheses import (
    PRIOR,
    columns_of,
    entries_of,
    log_prior,
    moves_nothing,
    variances,
    with_tolerances,
)
from subzero.diagnosis.hypothesis.noise import (
    Noise,
    CorrelationTimes,
    SensorPrior,
    log_of_outlier,
    log_of_outliers,
    log_prior_of,
    resolution_of,
    spikes,
    correlation_times_of,
)
from subzero.diagnosis.hypothesis.noise_estimate import ResidualNoise, estimate, log_marginal
from subzero.diagnosis.hypothesis.configuration import TRUTHS
from subzero.diagnosis.inference.simulator import (
    RunCache,
    economical,
    respond,
    simulate_on,
    simulate_track,
    with_stops,
)
from subzero.diagnosis.inference.problem import Observed, Problem, Progress
from subzero.diagnosis.inference.posing import pose, rewhitened, with_finer_steps, with_residual_noise
from subzero.diagnosis.inference.linear_gaussian import (
    KAPPAS,
    ForceInformation,
    Linear,
    Quadratic,
    Scale,
    Terms,
    freed,
    log_evidence_process,
    log_evidence_term,
    log_gains,
    mixed,
    posterior,
    seen,
)
from subzero.diagnosis.inference.map_fit import (
    Candidate,
    Fit,
    at_bad_minimum,
    bounded_step,
    bounds,
    broyden_update,
    candidate_of,
    is_poor_fit,
    laplace,
    objective,
    quadratic_step,
    refit,
    restarted_where_smooth,
    runnable,
)
from subzero.diagnosis.inference.change_point_scan import (
    BaseRun,
    LinearisationPoint,
    change_point_columns,
    grown,
    scan,
    spacing_of,
    times_of,
)
from subzero.diagnosis.inference.change_point_fit import fit_change_points, linearised_at
from subzero.diagnosis.inference.latent_force import (
    AXIS_WORDS,
    FORCE,
    all_columns,
    force_columns,
    history,
    knots_of,
    one_terms,
    without_force,
)
from subzero.diagnosis.inference.input_estimation import (
    estimate_drift,
    estimate_force,
    latent_force_candidates,
    relinearised_force,
)
from subzero.diagnosis.inference.force_formula import describe
from subzero.diagnosis.inference.screening import Screening
from subzero.diagnosis.inference.model_average import (
    UNTRIED_LOG_POSTERIOR,
    Added,
    Beliefs,
    ChangePointSummary,
    decide,
    is_noise,
    occam_folded,
    practical_causes,
    is_near,
    qualified,
)
from subzero.diagnosis.inference.model_fits import gain_of_refitted_noise, log_evidence_of, refit_noise
from subzero.diagnosis.inference.out_of_catalogue import Findings, special_cases_folded

from subzero.diagnosis.inference.repeated_values import (
    may_be_measured,
    log_odds_of_frozen,
    repeated_values,
    steps_of,
)

__all__ = [
    "AXIS_WORDS",
    "FORCE",
    "KAPPAS",
    "KINDS_OF_DATA_ERRORS",
    "PRIOR",
    "TRUTHS",
    "UNTRIED_LOG_POSTERIOR",
    "Added",
    "BaseRun",
    "Beliefs",
    "Candidate",
    "ChangePointSummary",
    "CorrelationTimes",
    "DataError",
    "Findings",
    "Fit",
    "ForceInformation",
    "Linear",
    "LinearisationPoint",
    "Noise",
    "Observed",
    "Problem",
    "Progress",
    "Quadratic",
    "ResidualNoise",
    "RunCache",
    "Scale",
    "Screening",
    "SensorPrior",
    "Terms",
    "all_columns",
    "at_bad_minimum",
    "bounded_step",
    "bounds",
    "broyden_update",
    "candidate_of",
    "change_point_columns",
    "columns_of",
    "correlation_times_of",
    "data_errors_undone",
    "decide",
    "describe",
    "economical",
    "entries_of",
    "estimate",
    "estimate_drift",
    "estimate_force",
    "fit_change_points",
    "force_columns",
    "freed",
    "gain_of_refitted_noise",
    "grown",
    "history",
    "is_near",
    "is_noise",
    "is_poor_fit",
    "knots_of",
    "laplace",
    "latent_force_candidates",
    "linearised_at",
    "log_evidence_of",
    "log_evidence_process",
    "log_evidence_term",
    "log_gains",
    "log_marginal",
    "log_odds_of_frozen",
    "log_of_outlier",
    "log_of_outliers",
    "log_prior",
    "log_prior_of",
    "may_be_measured",
    "mixed",
    "moves_nothing",
    "objective",
    "occam_folded",
    "one_terms",
    "pose",
    "posterior",
    "practical_causes",
    "quadratic_step",
    "qualified",
    "refit",
    "refit_noise",
    "relinearised_force",
    "repeated_values",
    "resolution_of",
    "respond",
    "restarted_where_smooth",
    "rewhitened",
    "runnable",
    "scan",
    "seen",
    "simulate_on",
    "simulate_track",
    "spacing_of",
    "special_cases_folded",
    "spikes",
    "steps_of",
    "times_of",
    "variances",
    "with_finer_steps",
    "with_residual_noise",
    "with_stops",
    "with_tolerances",
    "without_force",
]
