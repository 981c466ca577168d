"""Runs that go on from where another was, and runs that are not made twice: nothing may be any different."""

import dataclasses

import numpy as np
import pytest

from subzero.diagnosis import catalogue, with_onset
from subzero.diagnosis.inference import (
    history,
    simulate_on,
    simulate_track,
    simulator,
    with_stops,
    without_force,
)
from subzero.diagnosis.inference import problem as problem_module
from subzero.external_force import MissingForce, Term

from .conftest import CHANNELS, nominal

SETTING, CATALOGUE = nominal(6.0), catalogue(CHANNELS)


def pushed(size, setting=SETTING):
    """Return a setting with a force that begins at 2 s."""
    return without_force(
        setting, history("N", np.array([0.0, 2.0, 4.0, 6.0]), np.array([0.0, 0.0, size, 0.0]))
    )


def test_a_run_that_goes_on_is_the_run_from_the_start_bit_for_bit():
    (_, plain), stops = with_stops(SETTING, [2.0])
    whole, part = simulate_track(pushed(0.05))[1], simulate_on(pushed(0.05), stops[2.0])[1]
    assert np.array_equal(plain, simulate_track(SETTING)[1]), "stops change nothing"
    assert np.array_equal(part, whole)
    assert not np.array_equal(plain, whole), "the force does something"


def test_a_stop_can_be_gone_on_from_again_and_again():
    stop = with_stops(SETTING, [2.0])[1][2.0]
    first = simulate_on(pushed(0.05), stop)[1]
    simulate_on(pushed(-0.3), stop)
    assert np.array_equal(simulate_on(pushed(0.05), stop)[1], first)


@pytest.mark.parametrize("time", [2.0, 2.5, 3.7])
def test_a_cause_that_begins_between_exchanges_begins_where_it_does_from_the_start(time):
    later = with_onset(CATALOGUE["rudder_offset"], time).apply(SETTING, 3.0)
    stop = with_stops(SETTING, [time])[1][time]
    assert np.array_equal(simulate_on(later, stop)[1], simulate_track(later)[1])


def test_a_cause_goes_on_beside_one_that_began_before():
    """The run that is gone on from has changed already: what holds at the stop is what had begun by then."""
    bent = with_onset(CATALOGUE["rudder_offset"], 1.0).apply(SETTING, 3.0)
    stop = with_stops(bent, [2.0])[1][2.0]
    for more in (with_onset(CATALOGUE["hull_drag"], 2.0).apply(bent, 0.5), pushed(0.05, bent)):
        assert np.array_equal(simulate_on(more, stop)[1], simulate_track(more)[1])


def test_a_time_behind_the_end_has_no_stop():
    assert with_stops(SETTING, [5.0, 60.0])[1].keys() == {5.0}


@pytest.fixture
def counted(monkeypatch):
    """Return a list that grows with every run that is really made."""
    runs = []

    def count(setting):
        runs.append(setting)
        return simulate_track(setting)

    monkeypatch.setattr(problem_module, "simulate_track", count)
    return runs


def test_no_run_is_made_twice_and_sensors_need_none(plant, counted):
    problem = dataclasses.replace(plant(duration=6.0).problem, kept=simulator.RunCache())
    counted.clear()
    z = np.zeros(len(problem.entries))
    bias = next(k for k, entry in enumerate(problem.entries) if entry.effect.id == "sensor_bias:heading")
    drag = next(k for k, entry in enumerate(problem.entries) if entry.effect.id == "hull_drag")
    moved, other = z.copy(), z.copy()
    moved[bias], other[drag] = 2.0, 0.1
    plain, shifted, again = problem.residuals([z, moved, z])
    assert len(counted) == 1
    assert not np.array_equal(plain, shifted), "the sensor shows another value"
    assert np.array_equal(plain, again)
    problem.residual(other)
    assert len(counted) == 2, "another drag is another run"


def test_runs_for_a_record_put_right_serve_for_it_as_it_was(plant, counted):
    problem = dataclasses.replace(plant(duration=6.0).problem, kept=simulator.RunCache())
    right = dataclasses.replace(problem, kept=problem.kept.again())
    counted.clear()
    z = np.zeros(len(problem.entries))
    assert np.array_equal(right.residual(z), problem.residual(z))
    assert len(counted) == 1
    assert (right.kept.asked, problem.kept.asked) == (1, 1), "each search counts what it asks for"


def test_runs_of_another_setting_are_others(plant):
    """The same deviations from another nominal model: identities must not be mistaken."""
    problem = plant(duration=6.0).problem
    z = np.zeros(len(problem.entries))
    here = problem.residual(z)
    record = dataclasses.replace(problem.records[0], setting=pushed(0.05))
    there = dataclasses.replace(problem, records=(record,)).residual(z)
    assert not np.array_equal(here, there)


def test_old_runs_are_forgotten_when_there_is_no_room(plant, counted, monkeypatch):
    problem = dataclasses.replace(plant(duration=6.0).problem, kept=simulator.RunCache())
    counted.clear()
    z = np.zeros(len(problem.entries))
    monkeypatch.setattr(simulator, "CACHE_BYTES", simulate_track(SETTING)[1].nbytes)
    other = z.copy()
    other[0] = 0.01
    for deviations in (z, other, z):
        problem.residual(deviations)
    assert len(counted) == 3


def test_a_run_without_its_energies_is_the_same_run(monkeypatch):
    """Bit for bit, with forces that depend on the wet length: nothing in the loop reads what the ledger fills."""
    force = MissingForce(terms=(Term("X", "wet_length*u2", -0.02), Term("N", "time*u2", 0.01)))
    trial = dataclasses.replace(SETTING.trial, duration=4.0)
    setting = dataclasses.replace(SETTING, trial=trial).with_model(missing=force)
    without, eased = simulate_track(setting)[1], simulator._ease

    def ease(setup):
        eased(setup)
        assert not setup.fixed.booked
        setup.fixed.booked = True

    monkeypatch.setattr(simulator, "_ease", ease)
    assert np.array_equal(simulate_track(setting)[1], without)


def test_a_setting_refuses_what_a_model_does_not_have():
    with pytest.raises(TypeError, match="Model has no vehicel; it has vehicle"):
        SETTING.with_model(vehicel=None)
