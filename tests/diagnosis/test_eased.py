"""Runs of a diagnosis are quicker than those of a simulation, and the same: no energies, and forces that agree less.

Verifies: what the ledger fills is read by nothing in the loop; small forces of a slack cable need not agree to the last
digit, which costs Newton's method twice as much. Configuration: 4 s of fig6, with forces that depend on the wet length;
43 s of stop_and_drift with a drum that rubs, after which 15 m of slack cable drift beside the vehicle. Tolerance: none,
bit for bit; a thousandth of the noise of a speed log. The runs of the engine are asked for what no face of it offers.
"""

from dataclasses import replace

import numpy as np
import pytest

import subzero
from subzero.diagnosis import Setting, catalogue
from subzero.diagnosis.inference import economical, simulate_track, simulator
from subzero.external_force import MissingForce, Term

from .conftest import nominal


def test_a_run_without_its_energies_is_the_same_run(monkeypatch):
    force = MissingForce(terms=(Term("X", "wet_length*u2", -0.02), Term("N", "time*u2", 0.01)))
    setting = nominal(4.0).with_model(missing=force)
    without, eased = simulate_track(setting)[1], simulator._ease

    def ease(setup):
        eased(setup)
        assert not setup.fixed.booked
        setup.fixed.booked = True

    monkeypatch.setattr(simulator, "_ease", ease)
    assert np.array_equal(simulate_track(setting)[1], without)


def test_small_forces_of_a_slack_cable_agree_soon_enough_and_well_enough(monkeypatch):
    """Where a ten thousandth of a newton had to agree to 1e-10 N, exchanges took sixty evaluations, and then their
    halves: 4300 iterations here, and 13 000 in the fits of a record of the benchmark, in the place of 1800.
    """
    trial, causes = subzero.load_scenario("stop_and_drift"), catalogue(("surge_speed",))
    setting = causes["drum_friction"].apply(Setting(trial=trial, model=subzero.Model.of(trial)), 0.3)
    setting, spent = economical(causes["current"].apply(setting, -0.01, 0.02), 43.0), []
    prepare, eased = simulator.prepare, simulator._ease

    def prepared(*given, **named):
        setup, live = prepare(*given, **named)
        spent.append(live.now)
        return setup, live

    monkeypatch.setattr(simulator, "prepare", prepared)
    loose = simulate_track(setting)[1]

    def ease(setup):
        eased(setup)
        setup.fixed.agreement = 1e-9

    monkeypatch.setattr(simulator, "_ease", ease)
    apart = simulate_track(setting)[1] - loose
    assert spent[0].iterations < 3000
    assert np.abs(apart[:, 7:10]).max() < 1.5e-5


def weighed(newtons_per_metre):
    """Return stop_and_drift with a cable of a weight in water: slack behind a vehicle that stops, it whips about."""
    trial = subzero.load_scenario("stop_and_drift")
    model = subzero.Model.of(trial)
    mass = model.cable.mass_per_length + newtons_per_metre / 9.81
    return economical(Setting(trial=trial, model=model).with_cable(mass_per_length=mass), 43.0)


@pytest.mark.long
def test_a_run_may_take_many_times_what_the_nominal_one_takes_and_no_more():
    limited, nominal_run = simulator.with_limit(weighed(0.0))
    assert np.array_equal(simulate_track(limited)[1], nominal_run[1])
    heavy = limited.with_model(cable=weighed(1.2).model.cable)
    assert np.isnan(simulate_track(heavy)[1][-1]).all(), "it is given up, where it goes on for ever"
    assert np.isfinite(simulate_track(replace(heavy, most_work=None))[1]).all(), "... which it need not"


@pytest.mark.long
def test_a_nominal_cable_that_whips_about_may_do_so():
    """A user's heavy cable takes dozens of iterations an exchange, and nothing is wrong with it; one twice as heavy
    takes twice as many.
    """
    limited, nominal_run = simulator.with_limit(weighed(0.6))
    heavier = simulate_track(limited.with_model(cable=weighed(1.2).model.cable))[1]
    assert np.isfinite(nominal_run[1]).all()
    assert np.isfinite(heavier).all()
