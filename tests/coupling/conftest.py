"""Trials to change, and a hull that is integrated by SciPy instead of by the coupled loop."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import scenarios
import subzero
import vehicle
from scenarios.steps import fitting_step


@pytest.fixture(scope="session")
def simulate():
    """Return a run that reached its end, of a scenario's name or a trial."""

    def call(trial, **kwargs):
        run = subzero.simulate(trial, **kwargs)
        assert run.attrs["outcome"] == "completed", run.attrs["outcome_message"]
        return run

    return call


@pytest.fixture(scope="session")
def trial_of():
    """Return a shipped trial with fields, cable, drum or start changed, or held commands; steps as they are."""

    def call(name="fig6", *, cable=None, drum=None, start=None, held=None, **fields):
        trial = subzero.load_scenario(name)
        if held is not None:
            fields["commands"] = scenarios.Commands(time=np.zeros(1), values=np.array([held], dtype=float))
        if "cable_step" in fields:
            fields = {"hull_step": fitting_step(fields["cable_step"], trial.hull_step)} | fields
        fields = {"rtol": 0.0} | fields
        return dataclasses.replace(
            trial,
            cable=dict(trial.cable) | (cable or {}),
            drum=dict(trial.drum) | (drum or {}),
            start=dataclasses.replace(trial.start, **(start or {})),
            **fields,
        )

    return call


@pytest.fixture(scope="session")
def hull_alone():
    """Return the states of a trial's hull, pulled by `wrench(t, state, rate)`, at the trial's cable steps (n, …).

    `rate(wrench)` gives the rate of the state under a wrench, so that a pull may depend on the acceleration.
    `wrench` may return a second value, rates of further states that start at `more`.
    """

    def call(trial, wrench, more=()):
        hull = subzero.Model.of(trial).vehicle.numbers()
        start, current = trial.start, np.array(trial.current, dtype=float)
        initial = vehicle.initial_state(
            position=(0.0, 0.0, start.depth),
            pitch=start.pitch,
            heading=start.heading,
            velocity=(start.surge_speed, 0, 0, 0, 0, 0),
        )

        def rates(t, y):
            state = np.ascontiguousarray(y[: vehicle.STATE_SIZE])
            command = trial.commands.values[np.searchsorted(trial.commands.time, t + 1e-9, side="right") - 1]

            def rate(force):
                out = np.empty(vehicle.STATE_SIZE)
                vehicle.derivative(state, command, current, np.asarray(force, dtype=float), hull, out)
                return out

            pull, further = wrench(t, y, rate)
            return np.concatenate([rate(pull), further])

        times = np.linspace(0.0, trial.duration, round(trial.duration / trial.cable_step) + 1)
        y0 = np.concatenate([initial, more])
        solved = solve_ivp(
            rates, (0.0, trial.duration), y0, t_eval=times, rtol=1e-8, atol=1e-9, max_step=trial.hull_step
        )
        assert solved.success, solved.message
        return solved.y.T

    return call
