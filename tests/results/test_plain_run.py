"""A run in plain arrays is its dataset, and shapes that are spread where they lie are those that are copied.

Verifies: `subzero.simulation.run.simulate_plainly` against `subzero.simulate`; `spends` of
`subzero.results.dataset.plain_run`, in blocks of a few rows. Configuration: three seconds of fig6, whose cable grows
by a node a second or so, and a vehicle alone. Tolerance: identity.
"""

import dataclasses

import numpy as np
import pytest

import subzero
import subzero.results.dataset
from subzero.results.dataset import plain_run
from subzero.simulation.run import run_trial, simulate_plainly

FIG6 = dataclasses.replace(subzero.load_scenario("fig6"), duration=3.0)


@pytest.mark.parametrize("tethered", [True, False])
def test_what_stands_in_plain_arrays_is_what_is_labelled(tethered):
    plain, labelled = simulate_plainly(FIG6, tethered=tethered), subzero.simulate(FIG6, tethered=tethered)
    assert {*plain.variables, *plain.coordinates} == {*labelled.variables}
    assert plain.attrs == labelled.attrs
    for name, variable in labelled.variables.items():
        np.testing.assert_array_equal(plain[name].values, variable.values)
        assert dict(plain[name].attributes) == variable.attrs


@pytest.mark.parametrize("rows", [1, 4, 1000])
def test_shapes_that_are_spread_where_they_lie_are_those_that_are_copied(rows, monkeypatch):
    monkeypatch.setattr(subzero.results.dataset, "BLOCK", rows)
    model = subzero.Model.of(FIG6)
    copied = plain_run(FIG6, model, True, run_trial(FIG6, model, True))
    run = run_trial(FIG6, model, True)
    spent = plain_run(FIG6, model, True, run, spends=True)
    assert len(set(copied["node_count"].values)) > 2
    for name in ("cable_position", "cable_node_tension", "arc_length"):
        np.testing.assert_array_equal(spent[name].values, copied[name].values)
        field = {"cable_position": "position", "cable_node_tension": "tension"}.get(name, name)
        assert np.shares_memory(spent[name].values, getattr(run.recording, field))
