"""What a result carries: units and words on everything, and the arc length beside shape and tension.

The arc length is held to two things that do not come from it: the channel `cable_length`, and the distances between the
nodes of a straight, inextensible cable. Names are held to xarray's own methods, which they would hide.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import subzero

STRAIGHT = 1e-9
"""A cable of Fig. 4 is straight and does not stretch: nodes lie as far apart as the cable between them is long. [m]"""


@cache
def run(name, scheme="moving_end", duration=5.0):
    trial = subzero.load_scenario(name)
    return subzero.simulate(replace(trial, scheme=scheme, duration=duration))


@pytest.mark.parametrize("scheme", ["moving_end", "paper"])
def test_the_arc_length_runs_from_the_tow_point_to_the_length_of_the_cable(scheme):
    result = run("fig4", scheme)
    arc, nodes = result["arc_length"].values, result["node_count"].values
    assert nodes[-1] > 3
    assert_allclose(arc[:, 0], 0.0, atol=0.0)
    assert_allclose(arc[np.arange(nodes.size), nodes - 1], result["cable_length"], atol=1e-12)
    place = result["cable_position"].values
    assert_allclose(np.linalg.norm(place - place[:, :1], axis=2), arc, atol=STRAIGHT)
    assert np.array_equal(np.isnan(arc), np.isnan(result["cable_node_tension"].values))


def test_the_arc_length_is_a_coordinate_of_shape_and_tension():
    result = run("fig6")
    for name in ("cable_position", "cable_node_tension"):
        assert "arc_length" in result[name].coords


@pytest.mark.parametrize("name", ["fig6", "fig4"])
def test_every_variable_and_coordinate_says_what_it_is_and_in_which_unit(name):
    for label, variable in run(name).variables.items():
        assert variable.attrs.get("long_name"), label
        assert variable.attrs.get("units") or variable.dtype.kind == "U", label


def test_the_force_of_the_cable_is_called_cable():
    """Its X, Y, Z, K, M, N are the six channels of the cable's force and moment."""
    result = run("fig6")
    names = [f"cable_force_{axis}" for axis in ("forward", "starboard", "down")]
    names += [f"cable_moment_{axis}" for axis in ("roll", "pitch", "yaw")]
    share = result["force_breakdown"].sel(term="cable").values
    assert_allclose(share, np.array([result[name].values for name in names]).T, atol=1e-12)


def test_attributes_outlive_a_file(tmp_path):
    run("fig6").to_netcdf(tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc") as again:
        assert again["arc_length"].attrs["units"] == "m"
        assert again["heading"].attrs["standard_name"] == "platform_orientation"
        assert "arc_length" in again["cable_position"].coords
