"""Records with something planted, for tests: fig6 (or part of it), six channels, coloured noise, tolerances nominal."""

import dataclasses
from typing import NamedTuple

import numpy as np
import pytest

import subzero
from subzero.diagnosis import NOISE, START, Setting, catalogue
from subzero.diagnosis.inference import (
    Fit,
    Noise,
    Observed,
    Problem,
    economical,
    entries_of,
    refit,
    respond,
    variances,
)

CHANNELS = ("surge_speed", "heading", "yaw_rate", "pitch", "roll_angle", "depth")
COLOUR = 0.5


class Planted(NamedTuple):
    """A problem, its nominal residual and sensitivities."""

    problem: Problem
    r: np.ndarray
    J: np.ndarray

    def fit(self, *ids: str) -> Fit:
        """Return the fit of named causes."""
        zero = np.zeros(len(self.problem.entries))
        return refit(self.problem, zero, variances(self.problem.entries, ids, 1.0), J=self.J)


def coloured(random: np.random.Generator, size: int) -> np.ndarray:
    """Return AR(1) noise of level 1."""
    noise = random.standard_normal(size)
    for k in range(1, size):
        noise[k] = COLOUR * noise[k - 1] + np.sqrt(1.0 - COLOUR**2) * noise[k]
    return noise


def autoregressive(sd: float, rho: float, time: np.ndarray, step: float = 0.1) -> Noise:
    """Return the noise whose samples a step [s] apart are AR(1) with level sd and correlation rho, all of them used."""
    return Noise(
        white=0.0, slow=sd, correlation_time=-step / np.log(rho), used=np.ones(time.size, bool), time=time
    )


def nominal(duration: float, scenario: str = "fig6") -> Setting:
    """Return the nominal setting of a scenario."""
    trial = dataclasses.replace(subzero.load_scenario(scenario), duration=duration)
    return economical(Setting(trial=trial, model=subzero.Model.of(trial)), duration)


@pytest.fixture(scope="session")
def plant():
    """Return a maker of problems: (setting → setting with what is wrong, seconds, seed) → Planted."""

    def make(change=lambda setting: setting, duration=30.0, seed=1, drift=None) -> Planted:
        setting, random = nominal(duration), np.random.default_rng(seed)
        time = np.linspace(0.1, duration, round(10 * duration))
        values = respond(change(setting), time, CHANNELS)
        noise = {name: autoregressive(NOISE[name], COLOUR, time) for name in CHANNELS}
        seen = {name: value + NOISE[name] * coloured(random, time.size) for name, value in values.items()}
        for name, added in (drift or {}).items():
            seen[name] = seen[name] + added(time)
        record = Observed(name="planted", time=time, values=seen, noise=noise, setting=setting)
        entries = entries_of(tuple(catalogue(CHANNELS).values()), START, 1)
        problem = Problem(records=(record,), entries=entries)
        zero = np.zeros(len(entries))
        return Planted(problem, problem.residual(zero), problem.jacobian(zero))

    return make
