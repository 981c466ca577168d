"""Points of a sweep are what their names say, and the same for the same seed.

Verifies: `subzero.sweeps.design` by the definition of each design. Configuration: fig6. Tolerance: none where a design
is defined by counts; means and deviations of random ones within four standard errors.
"""

import itertools

import numpy as np
import pytest

import scenarios
import subzero
from subzero.sweeps import Design
from subzero.sweeps.design import DESIGNS, points_of

SPREADS = {
    "start.wet_length_m": {"from": 0.0, "to": 40.0},
    "cable.diameter": {"from": 0.001, "to": 0.1, "log": True},
    "water.current_east_m_s": {"normal": [0.1, 0.02]},
}
SIZED = [name for name in DESIGNS if name not in ("grid", "together")]


@pytest.fixture(scope="module")
def fig6():
    return scenarios.load("fig6")


def test_a_grid_has_every_value_with_every_other(fig6):
    spreads = {
        "start.wet_length_m": {"from": 0.0, "to": 10.0, "count": 3},
        "water.current_east_m_s": [0.0, 0.1],
    }
    found = points_of(fig6, spreads)
    assert found.values.tolist() == [list(row) for row in itertools.product([0.0, 5.0, 10.0], [0.0, 0.1])]


def test_lists_that_belong_together_are_rows(fig6):
    spreads = {"start.wet_length_m": [1.0, 2.0], "water.current_east_m_s": [0.3, 0.1]}
    assert points_of(fig6, spreads, Design(kind="together")).values.tolist() == [[1.0, 0.3], [2.0, 0.1]]


@pytest.mark.parametrize("design", SIZED)
def test_the_same_seed_gives_the_same_points_and_another_seed_others(design, fig6):
    first, again, other = (
        points_of(fig6, SPREADS, Design(kind=design, samples=16, seed=seed)) for seed in (3, 3, 4)
    )
    assert first.digest == again.digest
    assert first.digest != other.digest


def test_a_latin_hypercube_has_one_point_in_each_slice_of_each_parameter(fig6):
    found = points_of(
        fig6, {name: SPREADS[name] for name in list(SPREADS)[:2]}, Design(kind="latin_hypercube", samples=50)
    )
    length, diameter = found.values.T
    for slices in (length / 40.0, np.log(diameter / 0.001) / np.log(100.0)):
        assert sorted((50 * slices).astype(int)) == list(range(50))


def test_sobol_points_halve_every_parameter_evenly(fig6):
    found = points_of(fig6, SPREADS, Design(kind="sobol", samples=64))
    assert (found.values[:, 0] < 20.0).sum() == 32
    assert (found.values[:, 1] < 0.01).sum() == 32
    assert (found.values[:, 2] < 0.1).sum() == 32


def test_monte_carlo_has_the_mean_and_the_deviation_that_were_asked_for(fig6):
    n = 4000
    values = points_of(fig6, SPREADS, Design(kind="monte_carlo", samples=n)).values[:, 2]
    assert abs(values.mean() - 0.1) < 4.0 * 0.02 / np.sqrt(n)
    assert abs(values.std() - 0.02) < 4.0 * 0.02 / np.sqrt(2 * n)


def test_a_declared_range_is_that_of_the_file_and_a_star_stands_for_all_that_have_one(fig6):
    found = points_of(
        fig6, {"vehicle.axial_drag.*": "declared", "cable.*": "declared"}, Design(kind="sobol", samples=8)
    )
    assert "vehicle.axial_drag.drag_coefficient" in found.names
    assert "cable.diameter" in found.names
    ends = {spread.name: spread.ends for spread in found.spreads}
    assert ends["vehicle.axial_drag.drag_coefficient"] == (0.18, 0.43)


@pytest.mark.parametrize(
    ("spreads", "options", "said"),
    [
        ({}, {}, "needs parameters"),
        ({"start.wet_length": [1.0]}, {}, "Did you mean 'start.wet_length_m'?"),
        ({"start.wet_length_m": [-1.0]}, {}, "outside its limits"),
        ({"start.wet_length_m": []}, {}, "the list is empty"),
        ({"start.wet_length_m": {"from": 1.0, "too": 2.0}}, {}, "Did you mean 'to'?"),
        ({"start.wet_length_m": {"from": 2.0, "to": 1.0}}, {}, "is not below"),
        ({"start.wet_length_m": {"from": 1.0, "to": 2.0}}, {}, "needs values"),
        ({"start.wet_length_m": [1.0]}, {"kind": "gird"}, "Did you mean 'grid'?"),
        ({"start.wet_length_m": [1.0]}, {"kind": "sobol"}, "needs samples"),
        ({"start.wet_length_m": [1.0]}, {"samples": 5}, "Leave it out"),
        ({"start.heading_deg": "declared"}, {"kind": "sobol", "samples": 4}, "no file declares a range"),
        ({"start.wet_length_m": [1.0, 2.0], "start.depth_m": [1.0]}, {"kind": "together"}, "same length"),
        ({"start.wet_length_m": {"from": 1, "to": 2}}, {"kind": "saltelli", "samples": 12}, "power of two"),
    ],
)
def test_what_cannot_be_a_plan_is_refused_with_what_to_do(spreads, options, said, fig6):
    with pytest.raises(subzero.UserError) as caught:
        points_of(fig6, spreads, Design(**options))
    assert said in str(caught.value)


@pytest.mark.parametrize(
    "spread",
    [range(10**9), range(10**20), {"values": range(10**9)}, {"from": 0.01, "to": 0.02, "count": 10**9}],
)
def test_more_values_than_a_sweep_can_have_are_refused_before_there_are_so_many(spread):
    """A range of a billion numbers was expanded first: it took the machine."""
    with pytest.raises(subzero.UserError, match=r"run\.rtol"):
        subzero.plan_sweep("fig6", {"run.rtol": spread})
