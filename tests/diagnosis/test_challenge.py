"""A challenge hides what it says, says nothing by accident, and hides nothing that the catalogue could name.

Verifies: `subzero.synthetic`. Configuration: fig6, and 10 s of it where that is enough.
"""

import dataclasses
import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
from subzero.diagnosis import NOISE, START, Setting, catalogue
from subzero.errors import UserError
from subzero.external_force import AXES
from subzero.records.record import read_record
from subzero.synthetic.challenge import BASIC, KIND_PROBABILITIES, challenge, draw_hidden
from subzero.synthetic.planted import (
    Hidden,
    SensorErrors,
    apply_all,
    draw_deviations,
    draw_effect,
    hide,
    make_record,
)
from subzero.synthetic.reference_run import simulate_reference, truth_of
from subzero.synthetic.sealed_answer import SEALED, Answer, reveal
from subzero.synthetic.unmodelled_forces import KINDS, draw_unmodelled, force_along

FIG6 = subzero.load_scenario("fig6")
NOMINAL = Setting(trial=FIG6, model=subzero.Model.of(FIG6))
EFFECTS = catalogue(BASIC)
TIMES = np.linspace(0.0, 30.0, 301)


def still(setting, times, channels):
    return {name: np.zeros(times.size) for name in channels}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hidden")
    return challenge("fig6", 3, folder, kind="single"), folder


def test_the_record_can_be_read_and_says_nothing_of_the_answer(made):
    what, folder = made
    record = read_record(folder / "record.csv")
    assert set(BASIC) < set(record.values)
    for name in BASIC:
        assert_allclose(record.values[name], what.record.values[name], rtol=1e-6, atol=1e-9)
    reported = "".join(path.read_text() for path in folder.iterdir())
    assert what.answer.names
    assert what.answer.names[0] not in reported


def test_the_answer_is_told_as_it_was_hidden(made):
    what, folder = made
    answer = reveal(folder)
    assert answer.names == what.answer.names == what.hidden.names
    assert answer.deviations == what.answer.deviations
    assert answer.names[0] in str(answer)
    effect = EFFECTS[answer.names[0]]
    for one in effect.parameters:
        size, unit = answer.deviations[effect.id][one.name], one.unit
        said = f"{100.0 * size:+.3g} %" if unit == "1" else f"{size:+.3g} {unit}"
        assert f"{one.name.replace('_', ' ')} {said}" in str(answer)


def test_what_no_catalogue_has_is_told_without_symbols():
    leak = Answer(
        kind="outside", names=("outside:leak",), sentences=("water came in",), axis="Z", feature="time"
    )
    assert (
        "something pushes the hull up and down, with the time since the start; it is in no catalogue"
        in str(leak)
    )


def test_a_changed_or_missing_answer_is_refused(made, tmp_path):
    _, folder = made
    with pytest.raises(UserError, match="no sealed answer"):
        reveal(tmp_path)
    sealed = json.loads((folder / SEALED).read_text())
    for broken in ({**sealed, "sha256": "0"}, {"sealed": "x"}, []):
        (tmp_path / SEALED).write_text(json.dumps(broken))
        with pytest.raises(UserError, match="has been changed"):
            reveal(tmp_path)


@pytest.mark.long
def test_a_seed_gives_the_same_record_and_another_seed_another(made):
    what, _ = made
    again, other = challenge("fig6", 3, kind="single"), challenge("fig6", 4, kind="single")
    for name in BASIC:
        assert np.array_equal(what.record.values[name], again.record.values[name], equal_nan=True)
        assert not np.array_equal(what.record.values[name], other.record.values[name], equal_nan=True)


@pytest.mark.long
def test_the_hidden_effect_shows(made):
    what, _ = made
    healthy = hide(what.nominal, (*EFFECTS.values(), *START), what.answer.tolerances, Hidden())
    clean, wrong = (simulate_reference(s, TIMES, BASIC) for s in (healthy, what.true))
    assert max(np.nanmax(np.abs(clean[name] - wrong[name])) / NOISE[name] for name in BASIC) > 0.5


def test_noise_has_its_level_its_colour_its_outliers_and_its_gaps():
    times = 0.1 * np.arange(20_000)
    record = make_record(
        NOMINAL, times, ["depth"], seed=1, simulate=still, errors=SensorErrors(outliers=0.0, missing=0.0)
    )
    values = record.values["depth"]
    assert values.std() == pytest.approx(NOISE["depth"], rel=0.03)
    assert np.corrcoef(values[1:], values[:-1])[0, 1] == pytest.approx(0.5, abs=0.03)
    full = make_record(
        NOMINAL, times, ["depth"], seed=1, simulate=still, errors=SensorErrors(dropout=100.0)
    ).values["depth"]
    assert np.isnan(full).mean() == pytest.approx(0.02 + 0.05, abs=0.006)
    assert (np.abs(full) > 7.0 * NOISE["depth"]).mean() == pytest.approx(0.0095, abs=0.002)
    coarse = make_record(
        NOMINAL, times, ["heading"], seed=1, simulate=still, errors=SensorErrors(quantum={"heading": 1.0})
    )
    assert set(np.unique(coarse.values["heading"][np.isfinite(coarse.values["heading"])]) % 1.0) == {0.0}


def test_every_number_is_drawn_within_its_tolerance_and_its_bounds():
    effects = (*EFFECTS.values(), *START)
    drawn = [draw_deviations(effects, seed) for seed in range(300)]
    for effect in effects:
        values = np.array([one[effect.id] for one in drawn])
        for column, parameter in zip(values.T, effect.parameters, strict=True):
            assert parameter.low <= column.min() < column.max() <= parameter.high
            size = np.sqrt(np.mean(column**2))
            assert size == pytest.approx(parameter.tolerance, rel=0.25), effect.id


def test_effects_have_both_signs_and_sizes_from_a_half_to_two_scales():
    for effect in EFFECTS.values():
        drawn = np.array([draw_effect(effect, seed) for seed in range(60)])
        sizes = np.linalg.norm(drawn / [p.scale for p in effect.parameters], axis=1)
        assert 0.49 < sizes.min() < sizes.max() <= 2.0 + 1e-9
        for column, p in zip(drawn.T, effect.parameters, strict=True):
            both = p.low <= -0.5 * p.scale
            assert {True, False} == set((column > 0.0).tolist()) if both else np.all(column > 0.0)


def test_every_kind_is_drawn_about_as_often_as_it_should_be():
    drawn = [draw_hidden(NOMINAL, EFFECTS, seed) for seed in range(400)]
    shares = {
        "none": np.mean([not hidden.names for hidden in drawn]),
        "pair": np.mean([len(hidden.effects) == 2 for hidden in drawn]),
        "sudden": np.mean([bool(hidden.starts) for hidden in drawn]),
        "outside": np.mean([hidden.unmodelled is not None for hidden in drawn]),
    }
    for kind, share in shares.items():
        assert share == pytest.approx(KIND_PROBABILITIES[kind], abs=0.06), kind


def test_an_effect_that_begins_at_t_changes_nothing_before():
    hidden = Hidden(effects={"rudder_offset": (2.0,)}, starts={"rudder_offset": 12.0})
    assert hidden.names == ("rudder_offset@t",)
    true = hide(NOMINAL, EFFECTS.values(), {}, hidden)
    struck, plain = (simulate_reference(s, TIMES, ["heading"])["heading"] for s in (true, NOMINAL))
    assert np.array_equal(struck[:121], plain[:121])
    assert np.abs(struck - plain)[150:].min() > 0.5


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_outside_the_catalogue_shows_on_its_axis(kind):
    assert kind not in EFFECTS
    outside = draw_unmodelled(NOMINAL, 5, kind)
    trial = dataclasses.replace(FIG6, cable_step=0.1, hull_step=0.02, segment_length=0.5)
    true = outside.apply(dataclasses.replace(NOMINAL, trial=trial))
    force = force_along(outside, true, truth_of(true))
    assert np.abs(force[:, AXES.index(outside.axis)]).max() > 0.0
    wrong, plain = (simulate_reference(s, TIMES, BASIC) for s in (true, NOMINAL))
    assert max(np.abs(wrong[name] - plain[name]).max() / NOISE[name] for name in BASIC) > 1.5


def test_no_effect_at_all_leaves_the_setting_as_it_was():
    assert apply_all(NOMINAL, EFFECTS.values(), {}) == NOMINAL
    assert hide(NOMINAL, EFFECTS.values(), {}, Hidden()) == NOMINAL


@pytest.mark.parametrize("scenario", ["fig4", "rov_umbilical"])
def test_nothing_can_be_hidden_in_a_motion_that_is_prescribed(scenario):
    with pytest.raises(UserError, match=f"{scenario} prescribes the motion.*such as fig6"):
        challenge(scenario, 1)
