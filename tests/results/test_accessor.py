"""`run.subzero`: figures of a run in hand and of its file, and files of an earlier version.

What the figures must show is read from the drawn objects and held to the dataset.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
from subzero.figures.accessor import figures_of


@pytest.fixture(scope="module")
def run():
    return subzero.simulate("fig6")


@pytest.mark.long
@pytest.mark.parametrize("tethered", [True, False])
def test_every_figure_can_be_saved(tethered, run, tmp_path):
    drawn = run if tethered else subzero.simulate("fig6", tethered=False)
    figures = figures_of(drawn)
    assert set(figures) >= {"shape3d", "motion", "forces", "attitude"}
    assert ("tension" in figures) == ("cable" in figures) == tethered
    for name, figure in figures.items():
        figure.savefig(tmp_path / f"{name}.png")
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000


def test_without_a_cable_there_is_no_tension_to_draw():
    with pytest.raises(subzero.UserError, match="no cable in the water"):
        subzero.simulate("fig6", tethered=False).subzero.plot.tension()


def test_the_colours_of_the_tension_are_the_tension_along_the_cable(run):
    """At the tow point the colour of each time is the channel `cable_tension`; behind the drum there is none."""
    figure = run.subzero.plot.tension()
    (mesh,) = figure.axes[0].collections
    table = np.ma.filled(np.ma.asarray(mesh.get_array(), dtype=float), np.nan)
    shown = run.isel(time=slice(1, None))  # all times but the start
    assert_allclose(table[:, 0], shown["cable_tension"], atol=1e-9)
    along = np.linspace(0.0, float(run["arc_length"].max()), table.shape[1])
    step = along[1]
    assert np.isnan(table[along > shown["cable_length"].values[:, None] + step]).all()
    assert not np.isnan(table[along < shown["cable_length"].values[:, None] - step]).any()


def test_the_shapes_in_space_are_those_of_the_run_and_down_is_down(run):
    (axes,) = run.subzero.plot.shape3d().axes
    last = next(line for line in axes.lines if line.get_label() == "30 s")
    place = run["cable_position"].values[-1]
    assert_allclose(np.array(last.get_data_3d()).T, place[np.isfinite(place[:, 0])])
    assert axes.zaxis_inverted()


def test_the_channels_are_a_table_of_one_row_for_each_time(run):
    for one in (run, subzero.simulate("fig6", tethered=False), subzero.simulate("fig4")):
        table = one.subzero.to_dataframe()
        np.testing.assert_array_equal(table.index, one["time"])
        np.testing.assert_array_equal(table["surge_speed"], one["surge_speed"])
        assert "cable_node_tension" not in table


def test_a_file_of_a_run_is_opened_and_drawn_again(run, tmp_path):
    run.to_netcdf(tmp_path / "tethered.nc")
    again = subzero.open_run(tmp_path / "tethered.nc")
    assert again.identical(subzero.open_run(str(tmp_path / "tethered.nc")))
    assert_allclose(again["arc_length"], run["arc_length"])
    assert repr(again.subzero) == repr(run.subzero)
    assert len(repr(run.subzero).splitlines()) <= 12


def test_a_file_of_an_earlier_version_is_read_by_todays_names(run, tmp_path):
    terms = [str(term).replace("cable", "external") for term in run["term"].values]
    old = run.drop_vars(["arc_length", "node"]).assign_coords(term=terms)
    old.to_netcdf(tmp_path / "tethered.nc")
    again = subzero.open_run(tmp_path / "tethered.nc")
    assert "cable" in again["term"].values
    assert_allclose(again["arc_length"], run["arc_length"], rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize(
    "make, said",
    [
        (lambda path: None, "there is no such file"),
        (lambda path: path.write_text("no netCDF"), "it is no netCDF file"),
        (lambda path: path.mkdir(), "this is a folder"),
    ],
)
def test_what_is_no_run_is_refused_in_one_sentence(make, said, tmp_path):
    make(tmp_path / "run.nc")
    with pytest.raises(subzero.UserError, match=said):
        subzero.open_run(tmp_path / "run.nc")


def test_another_netcdf_file_is_no_run(run, tmp_path):
    run[["surge_speed"]].to_netcdf(tmp_path / "other.nc")
    with pytest.raises(subzero.UserError, match="holds no run of subzero: it has no cable_tension"):
        subzero.open_run(tmp_path / "other.nc")


def test_words_of_a_user_are_drawn_as_text(run):
    strange = run.assign_attrs(title="<b>x</b> $\\frac$ [bold] Zürich Ω " + "z" * 300)
    for name in ("tension", "shape3d", "motion", "forces"):
        figure = getattr(strange.subzero.plot, name)()
        figure.canvas.draw()
        assert "$\\frac$ [bold]" in " ".join(text.get_text() for text in figure.texts).replace("\n", " ")
