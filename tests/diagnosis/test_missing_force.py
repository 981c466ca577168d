"""A force that the model lacks: what it adds is what its words say, and no force at all changes nothing.

Verifies: `subzero.external_force`, and the loop that feels it. Configuration: fig6 with and without the cable.
Tolerance: a term that repeats a term of the hull gives the same run within the rounding of its numbers; the energy
balance keeps the 1e-3 of the work that every run keeps.
"""

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
from subzero.external_force import AXES, FACTORS, FEATURES, MissingForce, Term, history_at

FIG6 = subzero.load_scenario("fig6")
MODEL = subzero.Model.of(FIG6)
PULSE = MissingForce(time=(10.0, 14.0), wrench=((-0.3, 0.0, 0.0, 0.0, 0.0, 0.0),) * 2)


def lacking(*terms, pulse=MissingForce(), model=MODEL):  # noqa: B008
    force = MissingForce(terms=tuple(Term(*term) for term in terms)) + pulse
    return dataclasses.replace(model, missing=force)


def test_an_empty_force_changes_no_bit():
    plain, empty = subzero.simulate(FIG6), subzero.simulate(FIG6, model=lacking())
    for name in plain.data_vars:
        assert np.array_equal(plain[name].values, empty[name].values, equal_nan=True), name


def test_a_term_on_the_squared_speed_is_more_hull_drag():
    """X = −c u|u| beside axial drag ½ρ(π/4)d²C_D u|u|: the same run as with a larger C_D."""
    vehicle = MODEL.vehicle
    more = vehicle.with_parameter("axial_drag.drag_coefficient", 1.2 * vehicle.axial_drag.drag_coefficient)
    added = more.numbers().axial_drag - vehicle.numbers().axial_drag
    one = subzero.simulate(FIG6, model=dataclasses.replace(MODEL, vehicle=more))
    other = subzero.simulate(FIG6, model=lacking(("X", "u|u|", -added)))
    for name in ("surge_speed", "heading", "cable_tension", "energy_hull_loss"):
        assert_allclose(other[name], one[name], rtol=1e-9, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("axis", AXES)
def test_every_axis_pushes_the_way_it_is_called(axis):
    rates = ("surge_speed", "sway_speed", "heave_speed", "roll_rate", "pitch_rate", "yaw_rate")
    rate = rates[AXES.index(axis)]
    size = 0.05 if axis in "XYZ" else 0.002
    short = dataclasses.replace(FIG6, duration=0.1)
    plain = subzero.simulate(short, tethered=False)
    pushed = subzero.simulate(short, tethered=False, model=lacking((axis, "constant", size)))
    assert pushed[rate][-1] > plain[rate][-1]


@pytest.mark.long
@pytest.mark.parametrize("feature", FEATURES)
def test_every_feature_acts_and_the_energy_balances(feature):
    """On the axis where it does not lead the vehicle astray, of a size of some tenths of a newton."""
    factors = FEATURES[feature].factors
    sizes = {"n": 25.0, "|n|": 25.0, "rudder": 0.08, "stern": 0.05, "length": 20.0, "time": 20.0}
    small = dict.fromkeys(("v", "w", "q", "p", "r", "|v|", "|w|", "|p|", "|q|", "|r|"), 0.05)
    typical = np.prod([{**sizes, **small}.get(factor, 1.0) for factor in factors])
    shift = np.array([0.0, 0.0, 0.03, 0.05])
    commands = dataclasses.replace(FIG6.commands, values=FIG6.commands.values + shift)
    trial = dataclasses.replace(FIG6, duration=12.0, commands=commands)
    plain = subzero.simulate(trial)
    run = subzero.simulate(trial, model=lacking(("X", feature, -0.05 / typical)))
    assert run.attrs["outcome"] == "completed"
    assert np.abs(run["surge_speed"] - plain["surge_speed"]).max() > 1e-5
    assert np.abs(run["energy_residual"]).max() < 1e-3 * run["energy_propeller_work"].max()
    assert np.abs(run["cable_force_forward"]).max() < 2.0, (
        "the record of the cable's pull holds the cable alone"
    )


def test_a_history_acts_between_its_times_only():
    plain, run = subzero.simulate(FIG6), subzero.simulate(FIG6, model=lacking(pulse=PULSE))
    before = plain["time"] < 9.95
    assert np.array_equal(plain["surge_speed"][before], run["surge_speed"][before])
    slowed = plain["surge_speed"] - run["surge_speed"]
    assert float(slowed.sel(time=14.0)) > 0.04
    assert float(slowed.sel(time=24.0)) < 0.5 * float(slowed.sel(time=14.0)), "it recovers"
    assert np.abs(run["energy_residual"]).max() < 1e-3 * run["energy_propeller_work"].max()


def test_a_pulse_gives_the_impulse_that_it_should():
    """At rest without water: m u = ∫X dt, as far as the drag lets it; 10 ms after a short strong pulse."""
    still = dataclasses.replace(FIG6.commands, values=np.zeros((1, 4)), time=np.zeros(1))
    trial = dataclasses.replace(FIG6, commands=still, duration=0.2, cable_step=0.1, hull_step=0.002)
    shape = ((0.0,) * 6, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0,) * 6)
    pulse = MissingForce(time=(0.02, 0.06, 0.1), wrench=shape)
    run = subzero.simulate(trial, tethered=False, model=lacking(pulse=pulse))
    mass = MODEL.vehicle.numbers().mass_matrix[0, 0]
    assert float(run["surge_speed"][1]) == pytest.approx(0.04 / mass, rel=1e-3)


def test_steps_from_outside_feel_it_too():
    model = lacking(("Y", "u|u|", 0.1), ("N", "n|n|", 1e-5), pulse=PULSE)
    run = subzero.simulate(FIG6, model=model)
    sim = subzero.Simulator(FIG6, model=model)
    while sim.time < 30.0 - 1e-6:
        sim.step()
    assert np.array_equal(sim.result()["surge_speed"], run["surge_speed"])
    assert np.array_equal(sim.result()["heading"], run["heading"])


def test_two_forces_add_up():
    ramp = MissingForce(time=(12.0, 20.0), wrench=((0.0, 0.2, 0, 0, 0, 0), (0.0, 0.4, 0, 0, 0, 0)))
    both, times = PULSE + ramp, np.linspace(0.0, 30.0, 601) + 0.01
    assert_allclose(history_at(both, times), history_at(PULSE, times) + history_at(ramp, times), atol=1e-6)
    assert (PULSE + None) == PULSE
    assert Term("X", "u|u|", 1.0).unit == "N s2/m2"
    assert Term("N", "constant", 1.0).unit == "N m"


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: Term("X", "u", float("nan")), "must be finite"),
        (lambda: Term("x", "u", 1.0), "Did you mean 'X'"),
        (lambda: Term("X", "u|u", 1.0), "Did you mean 'u|u|'"),
        (lambda: MissingForce(time=(0.0, 1.0), wrench=((0.0,) * 6,)), "six numbers a time"),
        (lambda: MissingForce(time=(1.0, 0.0), wrench=((0.0,) * 6,) * 2), "decrease"),
        (lambda: MissingForce(time=(1.0,), wrench=((np.inf,) * 6,)), "not finite"),
    ],
)
def test_what_is_no_force_is_refused_in_words(make, words):
    with pytest.raises(ValueError, match=words.replace("|", r"\|")):
        make()


def test_every_factor_is_used_and_every_feature_is_told_in_words():
    used = {factor for feature in FEATURES.values() for factor in feature.factors}
    assert set(FACTORS) - used <= {"v", "w", "p", "q", "r"}
    assert len({feature.words for feature in FEATURES.values()}) == len(FEATURES)
