"""Causes that begin in mid-trial, as the benchmark hides them, and how far they are from all that looks like them."""

import pytest

from benchmarks.diagnosis.cases import GRID, cases, make
from benchmarks.diagnosis.distance import sensitivities, sudden_distance
from benchmarks.diagnosis.draws import with_begun
from benchmarks.diagnosis.manoeuvres import nominal, sudden
from subzero.diagnosis.inference import pose


def test_what_begins_in_mid_trial_adds_to_what_the_tolerances_have_drawn():
    setting, values = nominal("fig6"), {"hull_drag": (0.05,), "net_buoyancy": (-0.02,)}
    made = with_begun(setting, values, {"hull_drag": (0.4,)}, {"hull_drag": 12.0})
    drag = setting.model.vehicle.axial_drag.drag_coefficient
    assert made.model.vehicle.axial_drag.drag_coefficient == pytest.approx(1.05 * drag)
    ((time, later),) = made.later
    assert time == 12.0
    assert later.vehicle.axial_drag.drag_coefficient == pytest.approx(1.45 * drag)
    assert later.vehicle.hull == made.model.vehicle.hull, "all else stays as it is"


def test_thrust_and_drag_from_then_on_look_alike_and_a_rudder_like_nothing_else():
    made = make(next(one for one in cases(7) if one.kind == "healthy" and one.manoeuvre == "fig6"))
    problem = pose([made.logged])
    J = sensitivities(problem)
    D, rival = sudden_distance(problem, J, "hull_drag", (0.3,), 14.0)
    assert rival.startswith("propeller_thrust_gain@")
    assert D < 9.0
    assert sudden_distance(problem, J, "rudder_offset", (2.0,), 14.0)[0] > 100.0


def test_sudden_cases_begin_within_the_trial_and_keep_their_turn():
    every = [one for one in cases(7) if one.kind == "sudden"]
    assert {one.causes[0] for one in every} == set(sudden())
    case = next(one for one in every if one.manoeuvre == "fig6")
    (begins,) = make(case).starts.values()
    assert 0.2 * 30.0 <= begins <= 0.7 * 30.0
    assert begins / GRID == pytest.approx(round(begins / GRID))
