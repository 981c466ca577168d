"""Plants for python-control are the simulation itself.

Verifies: the hull alone against `vehicle.free_run`, with the cable against `subzero.simulate`; that python-control's
own operating point and linearisation find our trim and our linear model. Tolerance: 1e-6 for the hull (another
integrator, run at 1e-9), 1e-9 for hull and cable (the same steps; Euler angles for quaternions leave rounding), 1e-4 of
the largest entry for python-control's one-sided differences of 1e-6.
"""

import control
import numpy as np
import pytest

import subzero
import vehicle
from subzero import autopilot
from subzero.channels import RENAMED_CHANNELS
from subzero.steady_motion.hull_state_space import INPUT_NAMES, PLACE, STATE_NAMES, from_vehicle


@pytest.fixture(scope="module")
def model():
    return subzero.Model.of(subzero.load_scenario("fig6"))


@pytest.fixture(scope="module")
def steady(model):
    return autopilot.trim(model, speed=1.0)


def test_the_hull_runs_like_the_free_run(model):
    time = np.linspace(0.0, 6.0, 61)
    command = np.array([25.0, 0.1, 0.05, -0.02])
    plant = autopilot.plant(model)
    response = control.input_output_response(
        plant, time, np.outer(command, np.ones_like(time)), plant.initial_state,
        solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-10},
    )  # fmt: skip
    run = vehicle.free_run(model.vehicle, vehicle.initial_state(), command, 6.0, 0.005)
    expected = np.array([from_vehicle(state) for state in run.states[::20]]).T
    assert np.asarray(response.states) == pytest.approx(expected, abs=1e-6)


def test_an_operating_point_of_python_control_is_our_trim(model, steady):
    plant = autopilot.plant(model)
    moving = [i for i, name in enumerate(STATE_NAMES) if name not in ("north", "east")]
    held = ("north", "east", "depth", "roll", "heading", "surge_speed")
    guess = np.zeros(16)
    guess[PLACE["surge_speed"]], guess[PLACE["propeller_speed"]] = 1.0, 20.0
    wanted = np.zeros(16)
    wanted[PLACE["surge_speed"]] = 1.0
    x, u = control.find_operating_point(
        plant, guess, [20.0, 0.0, 0.0, 0.0], wanted, input_indices=[],
        output_indices=[PLACE[name] for name in held], deriv_indices=moving,
    )  # fmt: skip
    assert x == pytest.approx(steady.state, abs=1e-6)
    assert u == pytest.approx(steady.command, abs=1e-6)


def test_a_linearisation_of_python_control_is_our_linear_model(model, steady):
    theirs = control.linearize(autopilot.plant(model), steady.state, steady.command)
    ours = autopilot.linearise(model, steady)
    assert np.asarray(theirs.A)[2:, 2:] == pytest.approx(
        np.asarray(ours.A), abs=1e-4 * np.max(np.abs(ours.A))
    )
    assert np.asarray(theirs.B)[2:] == pytest.approx(np.asarray(ours.B), abs=1e-4 * np.max(np.abs(ours.B)))


def fig6_on_the_plant(model, longest=40.0):
    trial = subzero.load_scenario("fig6")
    plant = autopilot.plant(
        model, tethered=True, depth=trial.start.depth, heading=trial.start.heading,
        discretisation=autopilot.Discretisation(longest=longest),
    )  # fmt: skip
    time = np.linspace(0.0, 15.0, 151)
    rows = np.searchsorted(trial.commands.time, time + 1e-9, side="right") - 1
    return control.input_output_response(
        plant, time, trial.commands.values[rows].T, plant.initial_state
    ), time


def test_hull_and_cable_run_like_the_simulation(model):
    response, time = fig6_on_the_plant(model)
    run = subzero.simulate("fig6").isel(time=slice(0, time.size))
    for name in response.output_labels:
        channel = run[RENAMED_CHANNELS.get(name, name)]
        scale = np.radians(1.0) if channel.attrs["units"].startswith("degree") else 1.0
        expected = channel.values * scale
        found = np.asarray(response.outputs)[response.output_labels.index(name)]
        size = np.max(np.abs(expected)) + 1e-3
        assert found[1:] == pytest.approx(expected[1:], abs=1e-9 * size), name


def test_an_update_depends_on_nothing_but_its_arguments(model):
    plant = autopilot.plant(model, tethered=True, start=autopilot.trim(model, speed=1.0, wet_length=5.0))
    u, x = np.array([28.0, 0.05, 0.0, 0.0]), plant.initial_state
    for _ in range(5):
        x = plant.dynamics(0.0, x, u)
    once = plant.dynamics(0.0, x, u)
    y = x
    for _ in range(7):
        y = plant.dynamics(0.0, y, -u)
    assert np.array_equal(once, plant.dynamics(0.0, x, u))


def test_a_steady_start_stays_steady_with_its_cable(model):
    steady = autopilot.trim(model, speed=1.0, wet_length=20.0)
    plant = autopilot.plant(model, tethered=True, start=steady)
    time = np.linspace(0.0, 1.0, 11)
    response = control.input_output_response(
        plant, time, np.outer(steady.command, np.ones_like(time)), plant.initial_state
    )
    speed = np.asarray(response.outputs)[PLACE["surge_speed"]]
    length = np.asarray(response.outputs)[response.output_labels.index("cable_length")]
    assert length == pytest.approx(20.0 + time, abs=0.01)
    assert speed == pytest.approx(np.ones(11), abs=0.01), "0.04 N more after a second"


@pytest.mark.parametrize("tethered", [False, True])
def test_plants_can_be_interconnected(model, tethered):
    """A proportional heading autopilot turns the hull to 10 degrees."""
    steady = autopilot.trim(model, speed=1.0)
    hull = autopilot.plant(model, tethered=tethered, start=steady)
    steer = control.NonlinearIOSystem(
        None, lambda t, x, u, params: np.array([1.0 * (u[0] - u[1])]), inputs=["wanted", "heading"],
        outputs=["rudder_command"], dt=hull.dt, name="steer",
    )  # fmt: skip
    others = [name for name in INPUT_NAMES if name != "rudder_command"]
    loop = control.interconnect(
        [hull, steer], inputs=["wanted", *others], outputs=["heading", "rudder_command"], check_unused=False
    )
    time = np.linspace(0.0, 10.0, 101)
    inputs = np.vstack(
        [np.full_like(time, 0.17), *(np.full_like(time, steady.command[i]) for i in (0, 2, 3))]
    )
    response = control.input_output_response(loop, time, inputs, hull.initial_state)
    heading = np.asarray(response.outputs)[0]
    assert heading[-1] == pytest.approx(0.17, abs=0.01)
    assert np.asarray(response.outputs)[1, 0] == pytest.approx(0.17)


def test_a_tethered_plant_has_a_linearisation(model):
    """Of a short cable; the surge column is that of our linear model over one sample, to 5 %."""
    steady = autopilot.trim(model, speed=1.0, wet_length=2.0)
    room = autopilot.Discretisation(longest=4.0)
    plant = autopilot.plant(model, tethered=True, start=steady, discretisation=room)
    linear = control.linearize(plant, plant.initial_state, steady.command)
    assert linear.dt == 0.1
    assert np.all(np.isfinite(linear.A))
    n = PLACE["propeller_speed"]
    assert linear.A[n, n] == pytest.approx(np.exp(-0.1 / model.vehicle.motor.lag), rel=1e-3)


def test_bad_plants_are_refused(model):
    with pytest.raises(subzero.UserError, match="shorter than the hull's step"):
        autopilot.Discretisation(sample_time=0.01)
    long = autopilot.trim(model, speed=1.0, wet_length=60.0)
    with pytest.raises(subzero.UserError, match="longest = 50 m"):
        autopilot.plant(model, tethered=True, start=long)
    with pytest.raises(subzero.UserError, match="no room for more than longest = 3 m"):
        fig6_on_the_plant(model, longest=3.0)
