"""Which explanations fit the records, and how probable each is: from the noise of a channel to model averaging.

what is computed                                          file
--------------------------------------------------------  -----------------
noise of a channel, whitening, its estimate               noise
h(z): what the sensors would have measured                measurement
one simulation, from its start or from a stop             simulator
r(z) and J of all records                                 problem
records → problem                                         posing
evidence and posterior of the linear problem              linear_gaussian
MAP fit with real simulations                             map_fit
evidence around a fit                                     laplace
linear evidence of all hypotheses                         screening
the pool of fitted hypotheses                             model_fits
add, drop, swap and merge causes                          model_search
probabilities, decision rule                              model_average
onsets, ranked by linear evidence                         change_point_scan
onsets, fitted                                            change_point_fit
a force or a drift as a process over time                 latent_force
its evidence and its history                              input_estimation
features and shapes of a formula                          basis
a formula for a latent force                              force_formula
change points, forces and drifts beside the hypotheses    out_of_catalogue
all that only steers the search                           settings

What others may use stands in `__all__`; everything else is the engine's own (a contract in ``pyproject.toml`` holds
it for what stands outside the diagnosis). Names come from their files when they are first used.
"""

from importlib import import_module
from typing import Any

_HOME = {
    "noise": (
        "Behind",
        "Noise",
        "Usual",
        "estimate",
        "resolution_of",
        "spikes",
    ),
    "measurement": (
        "TRUTHS",
        "economical",
        "respond",
    ),
    "problem": (
        "Observed",
        "Problem",
    ),
    "posing": ("pose",),
    "linear_gaussian": (
        "KAPPAS",
        "ForceInformation",
        "Quadratic",
        "Scale",
        "Terms",
        "freed",
        "log_evidence_process",
        "log_evidence_term",
        "log_gains",
        "mixed",
        "posterior",
        "seen",
    ),
    "map_fit": (
        "Fit",
        "at_bad_minimum",
        "broyden_update",
        "is_poor_fit",
        "quadratic_step",
        "refit",
        "restarted_where_smooth",
    ),
    "laplace": (
        "Candidate",
        "candidate_of",
        "laplace",
    ),
    "change_point_scan": (
        "BaseRun",
        "LinearisationPoint",
        "change_point_columns",
        "scan",
        "times_of",
    ),
    "change_point_fit": (
        "fit_change_points",
        "linearised_at",
    ),
    "latent_force": (
        "AXIS_WORDS",
        "FORCE",
        "all_columns",
        "force_columns",
        "history",
        "knots_of",
        "without_force",
    ),
    "input_estimation": (
        "estimate_drift",
        "estimate_force",
        "latent_force_candidates",
        "relinearised_force",
    ),
    "basis": ("one_terms",),
    "screening": ("Screening",),
    "model_average": (
        "UNTRIED_LOG_POSTERIOR",
        "Beliefs",
        "ChangePointSummary",
        "decide",
        "occam_folded",
        "practical_causes",
    ),
    "out_of_catalogue": ("Findings",),
}
"""File → names that others may use."""

__all__ = sorted(name for names in _HOME.values() for name in names)


def __getattr__(name: str) -> Any:
    """Fetch a name from its file, once."""
    for file, names in _HOME.items():
        if name in names:
            value = getattr(import_module(f"{__name__}.{file}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'; it has {', '.join(__all__)}")
