"""An extended model is a file: written, read back the same, applied, and refused in words when it is wrong."""

from __future__ import annotations

import math
import tomllib

import pytest
from numpy.testing import assert_allclose

import subzero
from subzero.diagnosis import (
    Extended,
    Setting,
    all_effects,
    apply_extended,
    extended_toml,
    load_effects,
    read_extended,
    unseen,
)
from subzero.errors import UserError
from subzero.external_force import MissingForce, Term
from subzero.model import Model


@pytest.fixture(scope="module")
def setting():
    trial = subzero.load_scenario("fig6")
    return Setting(trial=trial, model=Model.of(trial))


FOUND = Extended(
    deviations={
        "rudder_lag": {"time_constant": 0.21},
        "stern_plane_offset": {"common": 0.3333333, "differential": -0.1},
        "sensor_bias:heading": {"shift": 2.5},
    },
    start_times={"stern_plane_offset": 12.0},
    calibration={"hull_drag": {"share": 0.012}, "start:heading": {"heading": -0.2}},
    missing=MissingForce(
        time=(0.0, 2.0, 4.0),
        wrench=((0.0,) * 6, (-0.3, 0.0, 0.0, 0.0, 0.0, 0.1), (-0.2, 0.0, 0.0, 0.0, 0.0, 0.05)),
        terms=(Term("X", "u|u|", -1.2), Term("N", "rudder_angle*u2", 0.4)),
    ),
)


def written(tmp_path, text):
    path = tmp_path / "extended.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_what_is_written_is_read_back_the_same(setting, tmp_path):
    found = read_extended(written(tmp_path, extended_toml(FOUND, setting, source="record.csv")))
    assert found.extended == FOUND
    assert found.scenario == "fig6"


def test_the_file_carries_units_in_its_keys_and_tells_the_whole_value_beside_the_nominal_one(setting):
    text = extended_toml(FOUND, setting)
    table = tomllib.loads(text)
    assert table["effects"]["rudder_lag"] == {"time_constant_s": 0.21}
    assert table["effects"]["stern_plane_offset"]["starts_at_s"] == 12.0
    nominal = setting.model.vehicle.rudder_servo.lag
    assert f"as a whole {nominal + 0.21:.6g} s, the model has {nominal:.6g} s" in text
    assert "# the rudder servo lags" in text
    assert "# N s2/m2: the square of the speed through the water" in text


def test_nothing_found_is_the_nominal_model(setting, tmp_path):
    found = read_extended(written(tmp_path, extended_toml(Extended(), setting)))
    assert apply_extended(found.extended, setting, found.effects) == setting


def test_an_extended_model_is_applied_each_part_in_its_place(setting):
    changed = apply_extended(FOUND, setting, all_effects())
    old, new = setting.model.vehicle, changed.model.vehicle
    assert_allclose(new.rudder_servo.lag - old.rudder_servo.lag, 0.21)
    assert new.stern_plane_port_servo.offset == old.stern_plane_port_servo.offset  # not yet
    ((start, later),) = changed.later
    assert start == 12.0
    assert_allclose(later.vehicle.stern_plane_port_servo.offset, math.radians(0.4333333))
    assert_allclose(later.vehicle.rudder_servo.lag, new.rudder_servo.lag)
    assert later.missing == changed.model.missing == FOUND.missing
    assert changed.sensing["heading"].bias == 2.5
    assert_allclose(changed.trial.start.heading, setting.trial.start.heading - math.radians(0.2))


def test_a_cause_whose_id_says_when_it_began_is_written_and_applied_too(setting, tmp_path):
    found = Extended(deviations={"hull_drag": {"share": 0.1}, "hull_drag@12": {"share": 0.3}})
    back = read_extended(written(tmp_path, extended_toml(found, setting)))
    changed = apply_extended(back.extended, setting, back.effects)
    ((start, later),) = changed.later
    assert start == pytest.approx(12.0)
    assert later != changed.model != setting.model


def test_two_causes_that_begin_one_after_the_other_add_up(setting):
    found = Extended(
        deviations={"rudder_offset": {"angle": 2.0}, "hull_drag": {"share": 0.3}},
        start_times={"rudder_offset": 20.04, "hull_drag": 10.0},
    )
    changed = apply_extended(found, setting, all_effects())
    (first, dragged), (second, both) = changed.later
    assert_allclose((first, second), (10.0, 20.0))  # on the grid of the exchange
    assert dragged.vehicle.rudder_servo.offset == setting.model.vehicle.rudder_servo.offset
    assert_allclose(both.vehicle.rudder_servo.offset, math.radians(2.0))


def test_effects_of_sensors_are_told_apart_for_a_run_does_not_show_them():
    assert unseen(FOUND, all_effects()) == ["sensor_bias:heading"]


OWN = """
from subzero.diagnosis import Effect, Parameter

def lost(setting, mass):
    return setting.with_vehicle(rigid_body__mass=lambda old: old - mass)

EFFECTS = [Effect(id="lost_ballast", sentence="ballast was lost", slot="hull", apply=lost,
                  parameters=(Parameter(name="mass", unit="kg", tolerance=0.01, scale=0.5),))]
"""
LOST = 'effects_file = "mine.py"\n[effects.lost_ballast]\nmass_kg = 0.4\n'


def test_effects_of_the_users_own_are_those_that_are_given(setting, tmp_path):
    (tmp_path / "mine.py").write_text(OWN)
    found = read_extended(written(tmp_path, LOST), load_effects(tmp_path / "mine.py"))
    changed = apply_extended(found.extended, setting, found.effects)
    assert_allclose(changed.model.vehicle.rigid_body.mass, setting.model.vehicle.rigid_body.mass - 0.4)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[effects.ruder_lag]\ntime_constant_s = 0.2", "line 1, effects.ruder_lag: there is no effect 'ruder_lag'"),
        ("[effects.rudder_lag]\ntime_constant = 0.2", "there is no 'time_constant'. Did you mean 'time_constant_s'?"),
        ("[effects.rudder_lag]\ntime_constant_s = 99.0", "time_constant_s is 99. Allowed: -0.09 to 5 (a deviation)."),
        ("[effects.rudder_lag]\ntime_constant_s = nan", "which is not a finite number"),
        ("[effects.rudder_lag]\ntime_constant_s = 0.2\nstarts_at_s = 3.0", "does not begin in mid-trial"),
        ("[effects.rudder_offset]\nangle_deg = 0.2\nstarts_at_s = -3.0", "must be above 0"),
        ('[effects."hull_drag@noon"]\nshare = 0.1', "behind the @ stands when it begins, in seconds: hull_drag@12"),
        ("[effect.rudder_lag]\n", "there is no such key. Did you mean 'effects'?"),
        ("[effects]\nrudder_lag = 3", "this is not a section; write [effects.rudder_lag]"),
        ("missing_force = 3", "write [[missing_force]]"),
        ('[[missing_force]]\naxis = "X"\ntime_s = [0.0]\nforce_N = [1.0, 2.0]', "time_s has 1 numbers and force_N"),
        ('[[missing_force]]\naxis = "Q"\ntime_s = [0.0]\nforce_N = [1.0]', "axis is 'Q'. Allowed: X, Y, Z, K, M, N."),
        ('[[missing_force]]\naxis = "N"\ntime_s = [0.0]\nforce_N = [1.0]', "moment_N_m is missing"),
        ('[[missing_force]]\naxis = "X"\ntime_s = [2.0, 1.0]\nforce_N = [1.0, 2.0]', "times that decrease"),
        ('[[missing_term]]\naxis = "X"\nfeature = "uu"\ncoefficient = 1.0', "Known:"),
        ("effects_file = 3", "line 1, effects_file: found 3, but this is not a text in quotes"),
        (LOST, "If it is in 'mine.py', give that file with --effects"),
        ("[effects", "this is not valid TOML"),
    ],
)  # fmt: skip
def test_a_file_that_cannot_be_used_is_refused_in_words(tmp_path, text, says):
    with pytest.raises(UserError) as refused:
        read_extended(written(tmp_path, text))
    assert says in str(refused.value)


def test_a_file_that_is_not_there_is_refused():
    with pytest.raises(UserError, match="there is no such file"):
        read_extended("nowhere/extended.toml")


def test_numbers_keep_more_digits_than_they_are_good_for(setting, tmp_path):
    found = Extended(deviations={"rudder_lag": {"time_constant": 0.1 / 3.0}})
    back = read_extended(written(tmp_path, extended_toml(found, setting)))
    assert_allclose(back.extended.deviations["rudder_lag"]["time_constant"], 0.1 / 3.0, rtol=1e-7)
