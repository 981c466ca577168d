"""Is Laplace's evidence that of the model? ``python -m benchmarks.diagnosis.evidence_audit`` asks nested sampling.

Two small problems on fig6, three parameters each with their tolerances, a record of its own noise: the log evidence
−objective − ½ log det(D P) of the program, and that of dynesty, which knows nothing of slopes or fits.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from subzero.diagnosis.hypothesis.hypotheses import variances
from subzero.diagnosis.inference import Problem, laplace, pose, refit

from .world import Drawn, record_of

LIVE = 150
"""Live points of the sampler: its own standard deviation is then some 0.1 nat."""
CASES = {
    "surge": ("hull_drag", "propeller_thrust_gain", "sensor_bias:surge_speed"),
    "yaw": ("rudder_lift_slope", "yaw_damping", "yaw_inertia"),
}
"""Name → the causes whose parameters are free."""


class Audited(NamedTuple):
    """Log evidence by Laplace and by nested sampling, and the sampler's own standard deviation. [nat]"""

    laplace: float
    sampled: float
    sd: float


def small_problem(name: str) -> Problem:
    """Return a problem with the parameters of a case only."""
    logged, _ = record_of(Drawn(seed=5, index=0, flown="fig6", family="mild", cause=""))
    whole = pose([logged])
    entries = tuple(one for one in whole.entries if one.effect.id in CASES[name])
    return replace(whole, entries=entries)


def audited(name: str, live: int = LIVE) -> Audited:
    """Return both evidences of a case."""
    from dynesty import NestedSampler

    problem = small_problem(name)
    D = variances(problem.entries, (), 1.0)
    zero, sd = np.zeros(D.size), np.sqrt(D)
    fit = refit(problem, zero, problem.jacobian(zero), D, most_fresh=2)
    sampler = NestedSampler(
        lambda z: _log_likelihood(problem, z),
        lambda u: sd * norm.ppf(u),
        D.size,
        nlive=live,
        rstate=np.random.default_rng(0),
    )
    sampler.run_nested(print_progress=False)
    found = sampler.results
    return Audited(
        laplace(problem.entries, fit, {1.0: D})[1.0], float(found.logz[-1]), float(found.logzerr[-1])
    )


def _log_likelihood(problem: Problem, z: np.ndarray) -> float:
    """Return −½ |r(z)|², the constant left out as the program does."""
    r = problem.residual(z)
    return -0.5 * float(r @ r) if np.isfinite(r).all() else -1e30


if __name__ == "__main__":
    print("case       Laplace     sampled    difference")
    for case in CASES:
        one = audited(case)
        print(
            f"{case:8s} {one.laplace:9.2f} {one.sampled:9.2f} ± {one.sd:.2f} {one.laplace - one.sampled:+9.2f}",
            flush=True,
        )
