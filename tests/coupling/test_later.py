"""A model that changes in mid-run: nothing before, everything behind, and nothing at all for the same model.

Verifies: `subzero.engine.initial_conditions`. Configuration: fig6, 30 s, changed at 12 s. Tolerance: identity to
the last bit where nothing may change; the energy balance keeps the 1e-3 of the work that every run keeps (a sudden
mass is not booked).
"""

import dataclasses

import numpy as np
import pytest

import subzero
from subzero.errors import UserError
from subzero.simulation.run import run_trial

AT = 12.0


@pytest.fixture(scope="module")
def fig6():
    return subzero.load_scenario("fig6")


@pytest.fixture(scope="module")
def model(fig6):
    return subzero.Model.of(fig6)


def channels(run):
    return [run[name].values for name in sorted(run.data_vars) if run[name].dims == ("time",)]


@pytest.mark.parametrize("tethered", [True, False])
def test_the_same_model_later_is_the_same_run_to_the_last_bit(fig6, model, tethered):
    plain = subzero.simulate(fig6, tethered=tethered)
    changed = subzero.simulate(fig6, tethered=tethered, later=[(0.0, model), (AT, model), (30.0, model)])
    for one, other in zip(channels(plain), channels(changed), strict=True):
        assert np.array_equal(one, other, equal_nan=True)
    assert "later" in changed.attrs
    assert "later" not in plain.attrs


def test_a_rudder_that_is_bent_at_12_s_changes_what_comes_after_and_nothing_before(fig6, model):
    bent = dataclasses.replace(
        model, vehicle=model.vehicle.with_parameter("rudder_servo.offset", np.radians(2.0))
    )
    plain, struck = subzero.simulate(fig6), subzero.simulate(fig6, later=[(AT, bent)])
    before, after = plain["time"] <= AT, plain["time"] > AT + 2.0
    assert np.array_equal(plain["heading"][before], struck["heading"][before])
    assert np.array_equal(plain["cable_tension"][before], struck["cable_tension"][before])
    assert np.all(struck["heading"][after] > plain["heading"][after] + 0.2)


def test_the_cable_and_the_current_may_change_and_the_energy_still_balances(fig6, model):
    rough = dataclasses.replace(
        model,
        cable=dataclasses.replace(model.cable, tangential_drag_coefficient=0.02, mass_per_length=0.0060),
        current=(0.1, 0.05, 0.0),
        vehicle=model.vehicle.with_parameter("rigid_body.mass", 7.5),
    )
    run = subzero.simulate(fig6, later=[(AT, rough)])
    plain = subzero.simulate(fig6)
    row = int(np.searchsorted(run["time"], AT))
    assert np.array_equal(plain["cable_tension"][: row + 1], run["cable_tension"][: row + 1])
    assert run["cable_tension"][row + 30] > 1.2 * plain["cable_tension"][row + 30]
    assert run.attrs["outcome"] == "completed"
    slower = subzero.simulate(fig6, later=[(AT, dataclasses.replace(rough, current=(0.0, 0.0, 0.0)))])
    residual = np.abs(slower["energy_residual"]).max() / slower["energy_propeller_work"].max()
    assert residual < 1e-3


def test_a_time_between_two_results_and_another_scheme_are_refused(fig6, model):
    with pytest.raises(UserError, match=r"12\.05.*whole multiples of 0\.1 s, from 0 to 30 s"):
        run_trial(fig6, model, True, later=[(12.05, model)])
    with pytest.raises(UserError, match="whole multiples"):
        run_trial(fig6, model, True, later=[(31.0, model)])
    printed = dataclasses.replace(fig6, scheme="paper_tangent")
    with pytest.raises(UserError, match="'moving_end'"):
        run_trial(printed, model, True, later=[(AT, model)])
