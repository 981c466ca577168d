"""REMUS 100 as a file: a second hull without a line of code, with Prestero's numbers in it.

Verifies: that a trial takes `vehicle = "remus100"`; that velocity products and fins of the file make the coefficients
of the adjusted set (2001), and its cruise; and that it differs from another simulator's REMUS 100 by terms that have
names. Tolerance: 2 % for coefficients, printed to three digits; 5 % for what is left when all terms are exchanged.
"""

import re

import numpy as np
import pytest

import subzero
import vehicle
from benchmarks.validation import remus
from subzero import autopilot


@pytest.fixture(scope="module")
def hull():
    return remus.ours()


def force(hull, velocity, rudder=0.0, plane=0.0):
    """Return the force of everything but weight, propeller, drag that is even, and the rigid body (6,)."""
    state = vehicle.initial_state(velocity=velocity)
    state[14:17] = state[18:21] = rudder, plane, plane
    table = vehicle.breakdown_table(hull, state)
    left_out = ("restoring", "propeller", "rigid_body_coriolis", "quadratic_damping")
    return sum(values for name, values in table.items() if name not in left_out)


LISTED = {
    ("Y", "v"): -28.6, ("N", "v"): -24.0, ("Y", "r"): 5.22, ("N", "r"): -2.0,
    ("Z", "w"): -28.6, ("M", "w"): 24.0, ("Z", "q"): -5.22, ("M", "q"): -2.0,
}  # fmt: skip


@pytest.mark.parametrize("axis,speed", LISTED)
def test_a_velocity_beside_surge_makes_the_listed_force(hull, axis, speed):
    nudge = np.zeros(6)
    nudge["uvwpqr".index(speed)] = 1e-4
    ahead = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    slope = (force(hull, ahead + nudge) - force(hull, ahead - nudge)) / 2e-4
    assert slope["XYZKMN".index(axis)] == pytest.approx(LISTED[axis, speed], rel=0.02)


def test_the_fins_push_as_listed(hull):
    """Y_uu_dr 9.64 kg/(m rad) and N_uu_dr −6.15 kg/rad; our positive rudder pushes the stern to port."""
    ahead = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    rudder, planes = force(hull, ahead, rudder=1e-3) * 1e3, force(hull, ahead, plane=1e-3) * 1e3
    assert rudder[[1, 5]] == pytest.approx([-9.64, 6.15], rel=0.02)
    assert planes[[2, 4]] == pytest.approx([9.64, 6.15], rel=0.02)


def test_the_cruise_needs_the_listed_thrust(hull):
    """X_prop 3.86 N at 1.54 m/s."""
    drag = force(hull, (1.54, 0.0, 0.0, 0.0, 0.0, 0.0))[0]
    assert drag == pytest.approx(-3.86, rel=0.02)


def test_a_trial_takes_the_vehicle_by_its_name(tmp_path):
    text = subzero.load_scenario("turning_circle").text.replace('"subzero2"', '"remus100"')
    trial = tmp_path / "circle.toml"
    trial.write_text(text, encoding="utf-8")
    run = subzero.simulate(trial, tethered=False)
    assert run.attrs["outcome"] == "completed"
    assert float(run["yaw_rate"][-1]) > 1.0


@pytest.fixture(scope="module")
def fig6(tmp_path_factory):
    path = tmp_path_factory.mktemp("remus100") / "fig6.toml"
    text = subzero.load_scenario("fig6").text.replace('"subzero2"', '"remus100"')
    path.write_text(text, encoding="utf-8")
    return subzero.load_scenario(path)


def test_a_speed_too_slow_for_its_buoyancy_is_refused_with_the_slowest_that_it_holds(fig6):
    """7 N of net buoyancy: at 1 m/s hull and planes have too little lift."""
    with pytest.raises(autopilot.NoTrimError) as caught:
        autopilot.manoeuvre("zigzag", fig6, speed=1.0)
    slowest = float(re.search(r"the hull holds ([0-9.]+) m/s at least", str(caught.value)).group(1))
    autopilot.trim(subzero.Model.of(fig6), speed=slowest)
    with pytest.raises(autopilot.NoTrimError):
        autopilot.trim(subzero.Model.of(fig6), speed=0.99 * slowest)


@pytest.mark.parametrize("name", autopilot.MANOEUVRES)
def test_every_manoeuvre_flies_at_a_speed_that_it_holds(fig6, name):
    run, measured = autopilot.manoeuvre(name, fig6, speed=2.0, tethered=False)
    assert run.attrs["outcome"] == "completed"
    assert np.isfinite(list(measured.values())).all()


@pytest.mark.long
@pytest.mark.parametrize("pilot", ["pid", "lqr"])
def test_an_autopilot_is_designed_at_speeds_that_it_holds_and_keeps_the_depth(fig6, pilot):
    run, measured = autopilot.step(
        "heading_step", fig6, speed=2.0, tethered=False, pilot=autopilot.Pilot(autopilot=pilot)
    )
    assert abs(measured["steady_error_deg"]) < 1.0
    assert abs(run["depth"].values - 1.0).max() < 0.5
    assert "unstable_pitch" not in {warning.check for warning in subzero.warnings_of(run)}


def test_a_dive_that_planes_held_still_do_not_ask_for_is_warned_of(fig6):
    run = subzero.simulate(fig6, tethered=False)
    (said,) = [warning.message for warning in subzero.warnings_of(run)]
    assert run["depth"].max() > 30.0
    assert "stern-planes that are held still from 0 s on" in said
    assert "unstable in pitch" in said
    assert said.endswith("Let an autopilot steer it (subzero autopilot).")


@pytest.mark.long
def test_nothing_unnamed_is_left_between_ours_and_the_other_simulator():
    judged = [row for row in remus.rows(quick=True) if row.judged]
    assert len(judged) == 8
    assert all(row.passed for row in judged), [row for row in judged if not row.passed]


def test_the_pitch_rate_differs_by_the_cross_flow_in_the_vertical_plane():
    """The other's strips feel sway and yaw only: with it our pitch rate is a third off, without it within 2 %."""
    rows = [row for row in remus.rows(quick=True) if "pitch rate" in row.name]
    ours, without = rows[:2], rows[2:]
    assert all(0.2 < row.error < 0.5 and not row.judged for row in ours), ours
    assert all(row.passed and row.gate == 0.02 for row in without), without


def test_what_is_taken_out_is_what_heave_and_pitch_add(hull):
    numbers = hull.with_parameter("cross_flow_drag.drag_coefficient", 1.2).numbers()
    assert not remus.vertical_cross_flow(np.array([1.0, 0.2, 0.0, 0.1, 0.0, 0.3]), numbers).any()
    heaving = remus.vertical_cross_flow(np.array([1.0, 0.0, 0.2, 0.0, 0.0, 0.0]), numbers)
    assert heaving[2] < 0.0  # a hull that sinks is pushed up
    pitching = remus.vertical_cross_flow(np.array([1.0, 0.0, 0.0, 0.0, 0.2, 0.0]), numbers)
    assert pitching[4] < 0.0  # and one whose nose rises is held back


def test_a_part_has_unit_range_and_source_for_every_number():
    import tomllib

    for leaves in tomllib.loads(remus.FILE.read_text(encoding="utf-8")).values():
        for leaf in leaves.values():
            assert leaf["range"][0] <= leaf["value"] <= leaf["range"][1]
            assert leaf["unit"]
            assert leaf["source"]
