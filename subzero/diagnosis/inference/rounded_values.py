"""How probable the values of a rounded channel are, one after the other: each is an interval, not a number with noise.

A sensor that rounds to steps of q shows the step in which what it measures lies:

    y_i = k q   if   (k − ½) q  ≤  h(t_i) + x(t_i) + w_i  <  (k + ½) q,      w ~ N(0, σ_w²),   x ~ OU(σ_s, τ_s)

So how often a channel flickers between two steps follows from its noise, and from where the prediction h lies between
them; with slow noise it flickers less. The state of the filter is x, taken to be normal, with its mean and variance
after each interval in which the sum was seen: what is left out is small, as the likelihood is log-concave. σ_w, σ_s and
τ_s are unknown: the evidence is mixed over a grid of them with what is usual of a sensor, and so the samples before a
run of equal values say how noisy the channel is.

A channel that froze at one of N samples repeats its value for certain; so the odds of that against a run up to the end

    log Σ_s p(y_1 … y_s) / p(y_1 … y_N) − log N,      s in the run
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from subzero.diagnosis.inference.linear_gaussian import log_sum
from subzero.diagnosis.inference.noise import Noise, Usual, log_prior_of

WHITE_LEVELS = (0.1, 0.18, 0.31, 0.55, 0.97, 1.7, 3.0)
SLOW_LEVELS = (0.1, 0.23, 0.51, 1.16, 2.64, 6.0)
"""σ_w and σ_s that are tried, in usual levels: even in their logarithms, as far as a sensor's noise may be. [-]"""
TIMES_S = (0.3, 1.0, 3.0, 10.0)
"""... and τ_s. [s]"""
OUTLIERS, FAR_LEVELS = 0.01, 50.0
"""So many samples are anywhere within so many usual levels: with less than that probability nothing is ruled out."""
LEAST = 1e-300
"""What is less probable is as improbable as that."""


class Steps(NamedTuple):
    """What the values of a rounded channel say: times of the measured samples (n,) [s]; between which deviations from
    the prediction each lies (n,) [unit of the channel]; the usual noise of its sensor.
    """

    time: np.ndarray
    low: np.ndarray
    high: np.ndarray
    usual: Usual


class _Belief(NamedTuple):
    """Mean and variance of x for every noise (g,)."""

    mean: np.ndarray
    variance: np.ndarray


def steps_of(time: np.ndarray, deviations: np.ndarray, usual: Usual) -> Steps:
    """Return what the values of a rounded channel say.

    Args:
        time: of the measured samples (n,). [s]
        deviations: measured − predicted (n,). [unit of the channel]
        usual: noise and resolution of its sensor.
    """
    half = 0.5 * usual.resolution
    return Steps(time, deviations - half, deviations + half, usual)


def log_odds_of_frozen(steps: Steps, run: np.ndarray) -> float:
    """Return the log odds that a channel froze in a run of equal values up to its end, against that it stands still; a
    fair share beforehand is up to the caller.

    Args:
        steps: all measured samples (n,).
        run: which of them repeat a value (n,): the last ones.
    """
    known, first = log_evidence_up_to(steps), int(np.argmax(run))
    before = np.concatenate([[0.0], known])[first:-1]  # of what comes before each sample of the run
    return float(log_sum(before - known[-1]) - np.log(steps.time.size))


def log_evidence_up_to(steps: Steps) -> np.ndarray:
    """Return the log probability of the values up to each sample (n,), mixed over all noises."""
    noises = _noises(steps.usual)
    white, slow, lasts, log = np.array([(n.white**2, n.slow**2, n.correlation_time, p) for n, p in noises]).T
    far = OUTLIERS * steps.usual.resolution / (FAR_LEVELS * steps.usual.level)
    gaps, found = np.diff(steps.time, prepend=steps.time[:1]), np.empty(steps.time.size)
    x = _Belief(np.zeros(white.size), slow)
    for i, gap in enumerate(gaps.tolist()):
        kept = np.exp(-gap / lasts)
        x = _Belief(kept * x.mean, kept**2 * x.variance + (1.0 - kept**2) * slow)
        inside, x_inside = _seen_between(x, white, float(steps.low[i]), float(steps.high[i]))
        inside = (1.0 - OUTLIERS) * inside
        log = log + np.log(inside + far)
        x = _mixed(x, x_inside, inside / (inside + far))
        found[i] = log_sum(log)
    return found


def _noises(usual: Usual) -> Sequence[tuple[Noise, float]]:
    """Return the noises that are tried, each with its log prior."""
    own, nothing = usual._replace(resolution=0.0), np.zeros(0)  # rounding is none of it
    each = [Noise(white=w * usual.level, slow=s * usual.level, correlation_time=t, used=nothing, time=nothing)
            for w in WHITE_LEVELS for s in SLOW_LEVELS for t in TIMES_S]  # fmt: skip
    logs = [log_prior_of(one, own) for one in each]
    total = log_sum(logs)
    return [(one, log - total) for one, log in zip(each, logs, strict=True)]


def _seen_between(x: _Belief, white: np.ndarray, low: float, high: float) -> tuple[np.ndarray, _Belief]:
    """Return how probable it is that x + w lies between two numbers (g,), and x if it does."""
    from scipy.special import ndtr

    sd = np.sqrt(x.variance + white)
    a, b = (low - x.mean) / sd, (high - x.mean) / sd
    upper = a > 0.0  # where both lie far above, the difference is that of the other tails
    inside = np.maximum(np.where(upper, ndtr(-a) - ndtr(-b), ndtr(b) - ndtr(a)), LEAST)
    at_a, at_b = (np.exp(-0.5 * end * end) / np.sqrt(2.0 * np.pi) for end in (a, b))
    mean = (at_a - at_b) / inside
    variance = np.clip(1.0 + (a * at_a - b * at_b) / inside - mean**2, 0.0, 1.0)
    gain = x.variance / sd
    return inside, _Belief(x.mean + gain * mean, x.variance - gain**2 * (1.0 - variance))


def _mixed(one: _Belief, other: _Belief, share: np.ndarray) -> _Belief:
    """Return mean and variance of two beliefs, of which the other has a share (g,)."""
    apart = other.mean - one.mean
    variance = share * other.variance + (1.0 - share) * one.variance + share * (1.0 - share) * apart**2
    return _Belief(one.mean + share * apart, variance)
