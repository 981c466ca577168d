"""The least-squares problem of a trial's effects, its fit, and histories of unknown forces in it.

subject                                                   file
--------------------------------------------------------  -----------------
parameter vector z, its prior                             ../hypothesis/hypotheses
noise of a channel, whitening                             ../hypothesis/noise
h(z): what the sensors would have measured                ../hypothesis/configuration
one simulation, from its start or from a stop             simulator
r(z) and J of all records                                 problem
records → problem                                         posing
evidence and posterior of the linear problem              linear_gaussian
MAP fit with real simulations                             map_fit
a force or a drift over time, and shapes of a formula     latent_force
its history                                               input_estimation
a formula for a latent force                              force_formula

Which explanations are probable is the subject of `subzero.identification`; here stands the fit of those that are
reported, and of a calibration.

`__all__` lists the public names; everything else is internal (a contract in ``pyproject.toml`` enforces this for code
outside the diagnosis).
"""

# ruff: noqa: I001 - in the order of dependence, not alphabetical

from subzero.diagnosis.hypothesis.hypotheses import (
    columns_of,
    entries_of,
    moves_nothing,
    variances,
    with_tolerances,
)
from subzero.diagnosis.hypothesis.noise import (
    Noise,
    as_noise,
    prior_of,
    resolution_of,
    spikes,
)
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
from subzero.diagnosis.inference.linear_gaussian import (
    ForceInformation,
    Quadratic,
    log_gains,
    posterior,
    seen,
)
from subzero.diagnosis.inference.map_fit import (
    SETTLED_GAIN,
    Fit,
    bounded_step,
    bounds,
    broyden_update,
    is_noise,
    objective,
    quadratic_step,
    refit,
    runnable,
)
from subzero.diagnosis.inference.posing import (
    SensitiveRun,
    pose,
    rewhitened,
    sensitive_runs,
    with_change_point,
    with_finer_steps,
    with_residual_noise,
)
from subzero.diagnosis.inference.latent_force import (
    AXIS_WORDS,
    MAX_DRIFT_LEVELS,
    force_columns,
    history,
    knots_of,
    samples_of,
    with_missing_force,
)
from subzero.diagnosis.inference.input_estimation import (
    EstimatedForce,
    estimate_drift,
    estimate_force,
    fit_with_drift,
)
from subzero.diagnosis.inference.force_formula import Formula, describe

__all__ = [
    "AXIS_WORDS",
    "MAX_DRIFT_LEVELS",
    "SETTLED_GAIN",
    "TRUTHS",
    "EstimatedForce",
    "Fit",
    "ForceInformation",
    "Formula",
    "Noise",
    "Observed",
    "Problem",
    "Progress",
    "Quadratic",
    "RunCache",
    "SensitiveRun",
    "as_noise",
    "bounded_step",
    "bounds",
    "broyden_update",
    "columns_of",
    "describe",
    "economical",
    "entries_of",
    "estimate_drift",
    "estimate_force",
    "fit_with_drift",
    "force_columns",
    "history",
    "is_noise",
    "knots_of",
    "log_gains",
    "moves_nothing",
    "objective",
    "pose",
    "posterior",
    "prior_of",
    "quadratic_step",
    "refit",
    "resolution_of",
    "respond",
    "rewhitened",
    "runnable",
    "samples_of",
    "seen",
    "sensitive_runs",
    "simulate_on",
    "simulate_track",
    "spikes",
    "variances",
    "with_change_point",
    "with_finer_steps",
    "with_missing_force",
    "with_residual_noise",
    "with_stops",
    "with_tolerances",
]
