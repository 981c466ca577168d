"""Runs that go on from where another was, and runs that are not made twice: nothing may be any different."""

import dataclasses

import numpy as np
import pytest

from subzero.diagnosis import catalogue, with_onset
from subzero.diagnosis.inference import (
    RunCache,
    history,
    simulate_on,
    simulate_track,
    with_missing_force,
    with_stops,
)

from .conftest import CHANNELS, nominal

SETTING, CATALOGUE = nominal(6.0), catalogue(CHANNELS)


def pushed(size, setting=SETTING):
    """Return a setting with a force that begins at 2 s."""
    return with_missing_force(
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


class Counting(RunCache):
    """Keeps runs, and counts those that are made to be kept."""

    made = 0

    def keep(self, setting, entries, z, track):
        self.made += 1
        super().keep(setting, entries, z, track)


def test_no_run_is_made_twice_and_sensors_need_none(plant):
    problem = dataclasses.replace(plant(duration=6.0).problem, kept=Counting())
    z = np.zeros(len(problem.entries))
    bias = next(k for k, entry in enumerate(problem.entries) if entry.effect.id == "sensor_bias:heading")
    drag = next(k for k, entry in enumerate(problem.entries) if entry.effect.id == "hull_drag")
    moved, other = z.copy(), z.copy()
    moved[bias], other[drag] = 2.0, 0.1
    plain, shifted, again = problem.residuals([z, moved, z])
    assert problem.kept.made == 1
    assert not np.array_equal(plain, shifted), "the sensor shows another value"
    assert np.array_equal(plain, again)
    problem.residual(other)
    assert problem.kept.made == 2, "another drag is another run"


def test_runs_of_another_setting_are_others(plant):
    """The same deviations from another nominal model: identities must not be mistaken."""
    problem = plant(duration=6.0).problem
    z = np.zeros(len(problem.entries))
    here = problem.residual(z)
    record = dataclasses.replace(problem.records[0], setting=pushed(0.05))
    there = dataclasses.replace(problem, records=(record,)).residual(z)
    assert not np.array_equal(here, there)


def test_old_runs_are_forgotten_when_there_is_no_room(plant):
    problem = dataclasses.replace(plant(duration=6.0).problem, kept=Counting())
    z = np.zeros(len(problem.entries))
    problem.residual(z)
    terabyte = np.broadcast_to(0.0, (125_000_000_000,))  # says so, and takes none
    RunCache.keep(problem.kept, None, None, z, (z, terabyte))
    problem.residual(z)
    assert problem.kept.made == 2


def test_a_setting_refuses_what_a_model_does_not_have():
    with pytest.raises(TypeError, match="Model has no vehicel; it has vehicle"):
        SETTING.with_model(vehicel=None)
