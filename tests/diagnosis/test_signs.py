"""Every sign of a diagnosis, in words: what each cause does to a run, and that all parts mean the same by it.

Configuration: fig6 for 12 s with the cable, economical steps, no noise; deviations of half an effect scale.
"""

import dataclasses
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from subzero.diagnosis import START, catalogue
from subzero.diagnosis.assessment import with_whole_effects
from subzero.diagnosis.inference import Noise, Observed, Problem, entries_of, respond

from .conftest import CHANNELS, nominal

TIME = np.linspace(0.1, 12.0, 120)
CATALOGUE = catalogue(CHANNELS)
SETTING = nominal(12.0)


@cache
def plain():
    """Return what the nominal trial records, by channel (n,)."""
    return respond(SETTING, TIME, CHANNELS)


def changed(name, *size):
    """Return channel → what a cause changes (n,)."""
    shown = respond(CATALOGUE[name].apply(SETTING, *size), TIME, CHANNELS)
    return {channel: shown[channel] - plain()[channel] for channel in CHANNELS}


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("hull_drag", -0.3),
        ("cable_tangential_drag", -0.6),
        ("drum_friction", None),
        ("propeller_thrust_gain", 0.2),
        ("battery_sag", -0.2),
        ("cable_initial_length", None),
    ],
)
def test_less_drag_or_more_thrust_is_faster(name, size):
    faster = changed(name, size or 0.4 * CATALOGUE[name].parameters[0].scale)["surge_speed"][-1]
    assert (faster > 0.0) if size else (faster < 0.0), "a rubbing drum and more cable hold back"


def test_a_buoyant_hull_rises_until_the_munk_moment_turns_its_nose_down():
    shown = changed("net_buoyancy", 0.5)
    assert np.all(shown["depth"][:40] < 0.0)
    assert shown["pitch"][-1] < -1.0, "the flow comes from above: a body turns across it"


def test_a_late_clock_shows_what_was_before():
    late = respond(CATALOGUE["clock_offset"].apply(SETTING, 0.5), TIME, CHANNELS)
    assert_allclose(late["surge_speed"][10:], plain()["surge_speed"][5:-5], atol=1e-12)


def test_a_current_goes_where_its_parameters_say():
    north, east, _ = CATALOGUE["current"].apply(SETTING, 0.1, 0.2).model.current
    assert (north, east) == (0.1, 0.2)


def test_a_sensor_shows_too_much_by_its_bias_and_its_share():
    assert_allclose(changed("sensor_bias:pitch", 1.5)["pitch"], 1.5, atol=1e-12)
    assert_allclose(changed("sensor_scale:pitch", 0.1)["pitch"], 0.1 * plain()["pitch"], atol=1e-12)


def problem(values):
    """Return the problem of a record without noise, of level 1."""
    noise = {
        name: Noise(white=0.5, slow=0.9, correlation_time=0.2, used=np.ones(TIME.size, bool), time=TIME)
        for name in CHANNELS
    }
    record = Observed(name="plain", time=TIME, values=values, noise=noise, setting=SETTING)
    return Problem(records=(record,), entries=entries_of(tuple(CATALOGUE.values()), START, 1))


@pytest.mark.parametrize("name", sorted(CATALOGUE))
def test_a_residual_vanishes_at_the_truth(name):
    sizes = [0.5 * min(one.scale, one.high) for one in CATALOGUE[name].parameters]
    made = problem(respond(CATALOGUE[name].apply(SETTING, *sizes), TIME, CHANNELS))
    z = np.zeros(len(made.entries))
    z[[k for k, entry in enumerate(made.entries) if entry.effect.id == name]] = sizes
    assert_allclose(made.residual(z), 0.0, atol=1e-9)


def test_secants_mean_by_a_column_what_sensitivities_mean():
    """R falls by J z: for a limit that is not felt when it is wide, along the whole effect."""
    made = problem(plain())
    k = next(k for k, entry in enumerate(made.entries) if entry.effect.id == "rudder_rate_limit")
    scale, zero = made.entries[k].parameter.scale, np.zeros(len(made.entries))
    there = zero.copy()
    there[k] = scale
    J = with_whole_effects(made, np.zeros((made.residual(zero).size, zero.size)))
    assert np.linalg.norm(J[:, k]) > 0.0
    assert_allclose(made.residual(there), made.residual(zero) - scale * J[:, k], atol=1e-9)


def test_a_correction_is_added_to_what_is_simulated():
    """A record that shows half a metre more than the simulation fits one that half a metre is added to."""
    more = {"depth": np.full(TIME.size, 0.5)}
    made = problem({**plain(), "depth": plain()["depth"] + more["depth"]})
    (record,) = made.records
    corrected = dataclasses.replace(made, records=(record.corrected(more),))
    assert_allclose(corrected.residual(np.zeros(len(made.entries))), 0.0, atol=1e-9)
