"""Where the propeller's work goes: the ledger closes, and each of its terms has the sign that its words say.

Verifies: W = L_hull + L_cable + ΔE + W_drum + W_added mass + residual (`subzero.engine.energy`,
`cable.moving_end.energy`). Tolerance: the issue's 1e-3 of the work at every time, not only at the end; measured:
2e-6 on fig6, 6e-5 in tight turns, 3e-4 in the cross current, whose cable hangs slack at the start. What is recomputed
here from the recorded forces is sampled at 0.1 s and summed by the trapezoidal rule: 2e-3 of the work.
"""

import dataclasses
from functools import cache

import numpy as np
import pytest

import subzero
import vehicle

CLOSED = 1e-3
TERMS = ("hull_loss", "cable_loss", "kinetic_change", "drum", "added_mass_term", "residual")
SCENARIOS = (
    "fig4",
    "fig5",
    "fig5_turn",
    "fig6",
    "wide_turn",
    "turning_circle",
    "zigzag",
    "spiral",
    "current",
    "dive",
)


@cache
def run(name):
    result = subzero.simulate(name)
    assert result.attrs["outcome"] == "completed", result.attrs["outcome_message"]
    return result


def energy(name, term):
    return run(name)[f"energy_{term}"].values


def variant(name, *, cable=None, drum=None, **settings):
    """Return a run of a scenario with some numbers of its cable, its drum or its own changed."""
    trial = subzero.load_scenario(name)
    changed = dataclasses.replace(
        trial, cable=dict(trial.cable) | (cable or {}), drum=dict(trial.drum) | (drum or {}), **settings
    )
    result = subzero.simulate(changed)
    assert result.attrs["outcome"] == "completed", result.attrs["outcome_message"]
    return {term: result[f"energy_{term}"].values for term in (*TERMS, "propeller_work")}


def unexplained(terms):
    """Return the largest residual as a share of the largest work."""
    return np.abs(terms["residual"]).max() / np.abs(terms["propeller_work"]).max()


@pytest.mark.long
@pytest.mark.parametrize("name", [*SCENARIOS, "stop_and_drift"])
def test_the_ledger_closes_at_every_time(name):
    work = energy(name, "propeller_work")
    assert np.abs(energy(name, "residual")).max() <= CLOSED * np.abs(work).max()
    total = sum(energy(name, term) for term in TERMS)
    np.testing.assert_allclose(total, work, rtol=0, atol=1e-12 * np.abs(work).max())


def test_fig6_closes_a_hundred_times_better_than_asked():
    assert np.abs(energy("fig6", "residual")).max() <= 1e-5 * energy("fig6", "propeller_work")[-1]


@pytest.mark.long
@pytest.mark.parametrize(
    ("cable", "drum"),
    [
        ({}, {"inertia": 1e-3, "friction_torque": 0.003}),
        ({"mass_per_length": 0.006}, {"friction_torque": 0.01}),
        ({"compliance": 0.05}, {}),
        ({"compliance": 0.05}, {"inertia": 1e-3, "friction_torque": 0.003}),
    ],
    ids=["heavy rubbing drum", "sinking cable", "stretching cable", "stretching cable, heavy rubbing drum"],
)
@pytest.mark.parametrize("name", ["fig6", "spiral"])
def test_it_closes_with_weight_stretch_friction_and_inertia_of_the_drum(name, cable, drum):
    assert unexplained(variant(name, cable=cable, drum=drum)) <= CLOSED


@pytest.mark.parametrize("name", SCENARIOS)
def test_hull_and_cable_never_give_energy_back_to_the_water(name):
    """Losses only grow: drag opposes the motion through the water, everywhere and always."""
    assert (np.diff(energy(name, "cable_loss")) >= 0.0).all()
    assert (np.diff(energy(name, "hull_loss")) >= 0.0).all()


def test_a_prescribed_motion_pays_for_the_cable_alone():
    assert energy("fig5", "hull_loss")[-1] == 0.0
    assert energy("fig5", "propeller_work")[-1] > 0.0  # whoever moves the tow point does work on the cable


def test_cable_enters_at_the_drum_with_its_speed_so_a_free_drum_gives_energy():
    """½ m U² a metre: straight ahead W_drum = −½ m U² S, and the cable in the water has just that kinetic energy."""
    expected = 0.5 * 0.0049 * 30.0
    assert energy("fig4", "drum")[-1] == pytest.approx(-expected, rel=2e-3)
    assert energy("fig4", "kinetic_change")[-1] == pytest.approx(expected, rel=1e-6)


def test_friction_and_inertia_of_the_drum_cost_work():
    """C_f/R_d over the length, and ½ I_d/R_d² U²; less the energy that comes with the cable."""
    free, rubbing = variant("fig4"), variant("fig4", drum={"friction_torque": 0.005})
    assert rubbing["drum"][-1] - free["drum"][-1] == pytest.approx(0.05 * 30.0, rel=2e-3)


def test_kinetic_energy_comes_with_speed_and_goes_with_it():
    kinetic = energy("stop_and_drift", "kinetic_change")
    at_speed = kinetic[200]
    assert at_speed > 2.0
    assert abs(kinetic[-1]) < 0.05 * at_speed


def test_straight_ahead_the_added_mass_gives_and_takes_nothing():
    assert np.abs(energy("fig4", "added_mass_term")).max() < 1e-12


def test_in_a_turn_the_balance_does_not_close_without_the_added_mass_term():
    """−(m1 − m)∫V_tV_nβ̇ds: the paper's added mass is not the gradient of an energy.

    Seen with a thick cable, m = ρA = 0.1 kg/m, in the dive of Fig. 5. With Table 1's thin one the term is small,
    but still the larger part of what would be left, seven times what is: the step behind the jolt at 20 s is booked
    with the force before it.
    """
    thick = variant("fig5", cable={"mass_per_length": 0.1, "cross_section_area": 1e-4})
    assert unexplained(thick) <= CLOSED
    assert (
        np.abs(thick["residual"] + thick["added_mass_term"]).max()
        > 5.0 * CLOSED * thick["propeller_work"][-1]
    )
    thin = energy("fig5", "residual")
    assert np.abs(thin + energy("fig5", "added_mass_term")).max() > 7.0 * np.abs(thin).max()


def test_an_untethered_run_has_no_cable_in_its_ledger_and_closes_to_rounding_of_the_steps():
    ledger = subzero.simulate("fig6", tethered=False)
    for term in ("cable_loss", "drum", "added_mass_term"):
        assert np.abs(ledger[f"energy_{term}"].values).max() == 0.0
    work = ledger["energy_propeller_work"].values[-1]
    assert np.abs(ledger["energy_residual"].values).max() < 1e-6 * work


@pytest.mark.parametrize("name", ["fig6", "wide_turn", "spiral"])
def test_the_ledger_is_what_the_recorded_forces_say(name):
    """Propeller work and the cable's share, recomputed from the force breakdown times the velocities."""
    result = run(name)
    rates = np.radians([result[f"{axis}_rate"].values for axis in ("roll", "pitch", "yaw")])
    nu = np.vstack([[result[f"{axis}_speed"].values for axis in ("surge", "sway", "heave")], rates])
    shares = result["force_breakdown"].transpose("term", "component", "time")

    def work_of(term):
        power = (shares.sel(term=term).values * nu).sum(axis=0)
        return np.concatenate([[0.0], np.cumsum(0.05 * (power[1:] + power[:-1]))])

    work = energy(name, "propeller_work")
    np.testing.assert_allclose(work_of("propeller"), work, rtol=0, atol=2e-3 * work[-1])
    assert "cable" in vehicle.BREAKDOWN
    taken = sum(energy(name, term) for term in ("cable_loss", "drum", "added_mass_term"))
    in_cable = (
        -work_of("cable") - taken
    )  # what is left is the kinetic energy of the moving cable, and the residual
    assert np.abs(in_cable).max() < 4e-3 * work[-1]


def test_the_kinetic_change_of_the_hull_is_its_mass_matrix_at_work():
    """Untethered: ½νᵀMν and the potential energy of the restoring forces, from the state at the end."""
    ledger = subzero.simulate("fig6", tethered=False)
    hull = subzero.Model.of(subzero.load_scenario("fig6")).vehicle
    u = float(ledger["surge_speed"][-1])
    mass = hull.rigid_body.mass + hull.added_mass.surge
    assert float(ledger["energy_kinetic_change"][-1]) == pytest.approx(0.5 * mass * u * u, rel=5e-3)
