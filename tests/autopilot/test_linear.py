"""The linear model moves like the hull itself as long as the motion is small.

Verifies: `autopilot.linearise` and `subsystem` against runs of the nonlinear hull and of the coupled simulation; poles
against the decay of a run that starts on an eigenvector. Tolerance: 2 % of the largest deviation for the whole model
(inputs of a tenth of a degree leave 1 % to the quadratic terms); 1e-3 of a pole; 5 % for a
subsystem, which leaves the others out, and for the cable, which the linear model takes as straight.
"""

import dataclasses

import control
import numpy as np
import pytest

import subzero
import vehicle
from subzero import autopilot
from subzero.autopilot.linear import KEPT
from subzero.steady_motion.hull_state_space import INPUT_NAMES, from_vehicle, to_vehicle


@pytest.fixture(scope="module")
def model():
    return subzero.Model.of(subzero.load_scenario("fig6"))


@pytest.fixture(scope="module")
def steady(model):
    return autopilot.trim(model, speed=1.0)


def nonlinear(model, steady, push, duration=8.0, step=0.01):
    """Return times and deviations (n, 14) of the hull from the steady motion, pushed by a constant command."""
    command = steady.command + push
    runs = [
        vehicle.free_run(model.vehicle, to_vehicle(steady.state), one, duration, step, wrench_b=steady.wrench)
        for one in (command, steady.command)
    ]
    moved, still = (np.array([from_vehicle(state) for state in run.states]) for run in runs)
    return runs[0].time, (moved - still)[:, 2:]


PUSHES = {
    "propeller_command": 0.05,
    "rudder_command": np.radians(0.1),
    "stern_plane_port_command": np.radians(0.1),
    "stern_plane_starboard_command": np.radians(0.1),
}


@pytest.mark.parametrize("name", INPUT_NAMES)
@pytest.mark.parametrize(
    "asked", [{"speed": 1.0}, {"speed": 0.6, "depth_rate": 0.1}, {"speed": 1.0, "turn_rate": 0.1}]
)
def test_a_small_step_moves_hull_and_linear_model_alike(model, name, asked):
    steady = autopilot.trim(model, **asked)
    push = np.array([PUSHES[name] if one == name else 0.0 for one in INPUT_NAMES])
    time, deviation = nonlinear(model, steady, push)
    linear = control.forced_response(
        autopilot.linearise(model, steady), time, np.outer(push, np.ones_like(time))
    )
    largest = np.max(np.abs(deviation), axis=0)
    for i, state in enumerate(KEPT):
        if largest[i] > 0.02 * np.max(largest):  # states that hardly move are the others' quadratic terms
            assert np.max(np.abs(linear.states[i] - deviation[:, i])) < 0.02 * largest[i], state


@pytest.mark.parametrize(
    "name,push,seen",
    [
        ("surge", (0.05, 0, 0, 0), {"surge_speed": "surge_speed"}),
        (
            "yaw_sway",
            (0, 2e-3, 0, 0),
            {"yaw_rate": "yaw_rate", "heading": "heading", "sway_speed": "sway_speed"},
        ),
        ("pitch_heave", (0, 0, 2e-3, 2e-3), {"pitch_rate": "pitch_rate", "pitch": "pitch", "depth": "depth"}),
        ("roll", (0, 0, -2e-3, 2e-3), {"roll": "roll", "roll_rate": "roll_rate"}),
    ],
)
def test_a_subsystem_moves_like_its_part_of_the_hull(model, steady, name, push, seen):
    part = autopilot.subsystem(autopilot.linearise(model, steady), name)
    time, deviation = nonlinear(model, steady, np.array(push), duration=5.0)
    size = max(push)
    response = control.forced_response(part, time, np.full_like(time, size))
    for state in seen:
        whole = deviation[:, KEPT.index(state)]
        own = response.states[part.state_labels.index(state)]
        assert np.max(np.abs(own - whole)) < 0.05 * np.max(np.abs(whole)), state


@pytest.mark.parametrize("speed", [0.6, 1.0, 1.4])
def test_every_pole_is_the_decay_of_the_hull_itself(model, speed):
    """A run that starts a little off along an eigenvector decays, and swings, with that pole: ln(l·x(t)/l·x(0))/t.

    l is the left eigenvector, so that what else is set off by the quadratic terms does not count. 2 % are asked for;
    what is left, 1.7e-4, is the curvature of drag over a deviation of 1e-4.
    """
    steady = autopilot.trim(model, speed=speed)
    poles, vectors = np.linalg.eig(np.asarray(autopilot.linearise(model, steady).A))
    lefts = np.linalg.inv(vectors)
    chosen = [i for i, pole in enumerate(poles) if abs(pole) > 1e-6 and pole.imag >= 0.0]
    assert len(chosen) >= 10, "of 14 two integrate: depth and heading"
    for i in chosen:
        vector = np.real(vectors[:, i])
        off = np.concatenate([[0.0, 0.0], 1e-4 * vector / np.max(np.abs(vector))])
        duration = 1.0 / abs(poles[i])
        ends = [
            vehicle.free_run(
                model.vehicle, to_vehicle(steady.state + sign * off), steady.command, duration, duration / 200
            )
            for sign in (1.0, -1.0)
        ]
        left = 0.5 * (from_vehicle(ends[0].states[-1]) - from_vehicle(ends[1].states[-1]))[2:]
        found = np.log((lefts[i] @ left + 0j) / (lefts[i] @ off[2:])) / duration
        assert abs(found - poles[i]) < 1e-3 * abs(poles[i]), poles[i]


def test_the_surge_pole_is_that_of_thrust_and_drag(model, steady):
    """(m + A11) u' = (1 − t) T(n, u) − X u²: λ = (∂T/∂u − 2 X u)/(m + A11), written from the numbers alone."""
    hull = model.vehicle
    p, m = hull.propeller, hull.rigid_body.mass + hull.added_mass.surge
    n, u, rho = steady.propeller_rps, 1.0, hull.water.density
    a = 1.0 - p.wake_fraction
    thrust = (
        -(1.0 - p.thrust_deduction)
        * rho
        * p.diameter**2
        * (p.thrust_slope * n * p.diameter * a + 2.0 * p.thrust_curvature * a * a * u)
    )
    drag = rho * np.pi / 8 * hull.hull.diameter**2 * hull.axial_drag.drag_coefficient
    fins = 2.0 * rho * hull.rudder.area * hull.rudder.profile_drag_coefficient
    slowest = min(
        autopilot.modes(autopilot.subsystem(autopilot.linearise(model, steady), "surge"), steady),
        key=abs_pole,
    )
    assert slowest.pole.real == pytest.approx((thrust - 2.0 * (drag + fins) * u) / m, rel=0.02)


def abs_pole(mode):
    return abs(mode.pole)


def test_modes_know_integrators_pairs_and_the_vehicles_own_time(model):
    steady = autopilot.trim(model, speed=0.5)
    linear = autopilot.linearise(model, steady)
    yaw = autopilot.modes(autopilot.subsystem(linear, "yaw_sway"), steady)
    assert yaw[0].time_constant == np.inf
    roll = autopilot.modes(autopilot.subsystem(linear, "roll"), steady)
    pair = next(mode for mode in roll if mode.period < np.inf)
    assert 0.0 < pair.damping < 1.0
    assert pair.scaled == pytest.approx(pair.pole * 1.0 / 0.5)
    assert pair.period == pytest.approx(2 * np.pi / pair.pole.imag)


def test_hydrodynamic_poles_scale_with_speed(model):
    """Without weight and propeller, sway and yaw know one time only, L/U."""
    scaled = []
    for speed in (0.6, 1.2):
        steady = autopilot.trim(model, speed=speed)
        part = autopilot.subsystem(autopilot.linearise(model, steady), "yaw_sway")
        scaled.append(sorted(mode.scaled.real for mode in autopilot.modes(part, steady))[1:3])
    servo = -model.vehicle.hull.length / 0.15
    hydrodynamic = [
        [s for s in one if abs(s - servo / v) > 1e-6] for one, v in zip(scaled, (0.6, 1.2), strict=True)
    ]
    assert hydrodynamic[0][-1] == pytest.approx(hydrodynamic[1][-1], rel=1e-3)


@pytest.mark.parametrize("heavier", [1.0, 10.0])
def test_on_the_cable_a_small_change_of_the_propeller_acts_like_in_the_coupled_run(model, heavier):
    """Two coupled runs, one with a little more propeller; their difference against the linear model, over 3 s.

    The second, a neutral cable of ten times the mass, adds a sixth to the mass that the propeller moves.
    """
    thick = {"mass_per_length": 0.0049 * heavier, "cross_section_area": 4.9e-6 * heavier}
    model = dataclasses.replace(model, cable=dataclasses.replace(model.cable, **thick))
    model = dataclasses.replace(model, vehicle=model.vehicle.with_parameter("motor.lag", 0.0))
    steady = autopilot.trim(model, speed=1.0, wet_length=20.0)  # (a run starts with the propeller at rest)
    trial = subzero.load_scenario("fig6")
    start = dataclasses.replace(trial.start, surge_speed=1.0, wet_length=20.0)

    def speed(extra):
        values = np.array([steady.command + np.array([extra, 0.0, 0.0, 0.0])])
        commands = dataclasses.replace(trial.commands, time=np.zeros(1), values=values)
        one = dataclasses.replace(trial, start=start, commands=commands, duration=3.0, cable_step=0.04)
        return subzero.simulate(one, model=model)["surge_speed"]

    difference = speed(0.5) - speed(0.0)
    time = difference["time"].values
    linear = control.forced_response(
        autopilot.linearise(model, steady), time, np.outer([0.5, 0, 0, 0], np.ones_like(time))
    )
    found = np.asarray(linear.states)[KEPT.index("surge_speed")]
    assert np.max(np.abs(found - difference.values)) < 0.05 * np.max(np.abs(found))


def test_names_and_units_are_those_of_the_channels(model, steady):
    from subzero.channels import BY_NAME, RENAMED_CHANNELS

    linear = autopilot.linearise(model, steady)
    assert tuple(linear.state_labels) == tuple(linear.output_labels) == KEPT
    assert tuple(linear.input_labels) == INPUT_NAMES
    for name in (*KEPT, *INPUT_NAMES):
        channel = BY_NAME[RENAMED_CHANNELS.get(name, name)]  # of a run, `roll` would hide a method of xarray
        assert autopilot.UNITS[name] == channel.unit.replace("degree", "rad")


def test_an_unknown_subsystem_is_told(model, steady):
    with pytest.raises(subzero.UserError, match="Did you mean 'yaw_sway'"):
        autopilot.subsystem(autopilot.linearise(model, steady), "yaw-sway")
