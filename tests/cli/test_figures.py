"""Figures show what they promise, in one style, with units, for every kind of run."""

from __future__ import annotations

import re

import numpy as np
import pytest
from matplotlib.text import Text
from numpy.testing import assert_allclose

from subzero.errors import UserError
from subzero.figures import draw, exact_tension, page_width
from subzero.records.record import Record


@pytest.fixture(scope="module")
def comparison(compared):
    """Two runs on rails (made once)."""
    import xarray as xr

    return {
        name: xr.open_dataset(compared.here / "fig6" / f"{name}.nc") for name in ("tethered", "untethered")
    }


def texts(figure):
    return [axes.get_title(loc="left") for axes in figure.axes]


def line(axes, label):
    return next(one for one in axes.get_lines() if one.get_label() == label)


@pytest.mark.long
def test_figure_6_has_the_four_panels_of_the_paper(comparison):
    assert texts(draw(comparison)["fig6"]) == [
        "(a) Propeller command", "(b) Forward speed", "(c) Rudder, positive to starboard",
        "(d) Heading, clockwise from north",
    ]  # fmt: skip


def test_figure_6_shows_where_the_rudder_is_beside_its_command_and_whether_that_is_fed_back(make_run):
    """An offset of a degree to starboard, without feedback of the fin's position and with it."""
    crooked, fed_back = make_run(), make_run(tethered=False)
    crooked["rudder_angle"] = crooked["rudder_command"] + 1.0
    fed_back["rudder_angle"] = fed_back["rudder_command"]
    reported = '"vehicle": {"rudder_servo": {"position_feedback": 1.0}}'
    fed_back.attrs["parameters"] = fed_back.attrs["parameters"].replace('"vehicle": {}', reported)
    panel = draw({"tethered": crooked, "untethered": fed_back})["fig6"].axes[2]
    commanded = line(panel, "commanded").get_ydata()
    assert_allclose(line(panel, "actual, without feedback").get_ydata(), commanded + 1.0)
    assert_allclose(line(panel, "actual, with feedback, untethered").get_ydata(), commanded)
    alike = draw({"tethered": crooked, "untethered": crooked})["fig6"].axes[2]
    assert [one.get_label() for one in alike.get_lines()] == ["commanded", "actual, without feedback"]


@pytest.mark.long
def test_tethered_is_solid_untethered_dashed_and_measured_are_dots(comparison):
    run = comparison["tethered"]
    record = Record(source="", time=np.array([0.0, 9.0]), values={"surge_speed": np.array([0.1, 0.9])})
    speed = draw(comparison, record)["fig6"].axes[1]
    assert line(speed, "tethered").get_linestyle() == "-"
    assert line(speed, "untethered").get_linestyle() == "--"
    assert line(speed, "measured").get_linestyle() == "None"
    assert line(speed, "measured").get_marker() == "o"
    assert_allclose(line(speed, "tethered").get_ydata(), run["surge_speed"].values)
    assert_allclose(line(speed, "measured").get_ydata(), [0.1, 0.9])


@pytest.mark.long
def test_a_measured_channel_without_a_panel_gets_one(comparison):
    values = {name: np.zeros(2) for name in ("cable_tension", "heading", "yaw_rate", "sway_speed")}
    record = Record(source="", time=np.array([0.0, 9.0]), values=values)
    assert texts(draw(comparison, record)["measured"]) == [
        "(a) Cable tension at the tow point", "(b) Yaw rate, positive to starboard", "(c) Speed to starboard"
    ]  # fmt: skip
    assert "measured" not in draw(comparison)


@pytest.mark.long
def test_every_panel_names_its_unit_and_every_figure_its_trial(comparison, make_run):
    figures = [*draw(comparison).values(), *draw({"tethered": make_run(prescribed="dive")}).values()]
    for figure in [*figures, *draw({"tethered": make_run(prescribed="straight")}).values()]:
        assert all("[" in axes.get_ylabel() for axes in figure.axes)
        assert all("[" in axes.get_xlabel() for axes in figure.axes[-2:])
        assert [words.get_text() for words in figure.texts] == ["a synthetic trial", "fig6"]


def test_figure_4_sets_the_computed_tension_on_the_exact_line(make_run):
    run = make_run(prescribed="straight")
    tension, error = draw({"tethered": run})["fig4"].axes
    exact = 0.5 * 1000.0 * np.pi * 0.0025 * 0.01 * line(tension, "exact, equation (37)").get_xdata()
    assert_allclose(np.diff(line(tension, "exact, equation (37)").get_ydata()), np.diff(exact))
    assert error.get_lines()[0].get_xdata().size == run.sizes["time"]  # every step, odd and even


def test_the_exact_tension_counts_inertia_of_cable_and_drum(make_run):
    run = make_run(prescribed="straight", samples=11)
    run["surge_speed"] = ("time", 0.5 * run["time"].values)  # u' = 0.5 m/s², S = 0.25 t²
    run["cable_length"] = ("time", np.zeros(11))
    run.attrs["parameters"] = run.attrs["parameters"].replace('"inertia": 0.0', '"inertia": 0.02')
    S, u = 0.25 * run["time"].values ** 2, run["surge_speed"].values
    expected = (0.0049 * 0.5 + 0.0392699082 * u**2) * S + 0.02 * 0.5 / 0.1**2
    assert_allclose(exact_tension(run)[1:], expected[1:], rtol=1e-8)


def test_figure_5_has_the_six_panels_of_the_paper(make_run):
    assert texts(draw({"tethered": make_run(prescribed="dive")})["fig5"]) == [
        "(a) Pitch angle, positive nose up", "(b) Shape of the cable", "(c) Tension at the tow point",
        "(d) Velocity of the tow point, cable's axes", "(e) Force of the cable on the vehicle",
        "(f) Moment of the cable on the vehicle",
    ]  # fmt: skip


def test_down_is_down(make_run):
    shapes = draw({"tethered": make_run(prescribed="dive")})["fig5"].axes[1]
    assert shapes.yaxis_inverted()
    assert [one.get_label() for one in shapes.get_lines()] == ["10 s", "15 s", "20 s", "25 s", "30 s"]


def test_a_command_holds_until_the_next(comparison):
    rudder = draw(comparison)["fig6"].axes[2].get_lines()[0]
    assert rudder.get_drawstyle() == "steps-post"


def test_depth_is_drawn_downwards(comparison):
    figures = draw(comparison)
    assert figures["attitude"].axes[1].yaxis_inverted()
    assert figures["cable"].axes[1].yaxis_inverted()


def test_the_map_has_east_to_the_right_and_north_up(comparison):
    plan = draw(comparison)["cable"].axes[0]
    place = comparison["tethered"]["cable_position"].values[-1]
    assert any(np.array_equal(one.get_ydata(), place[:, 0], equal_nan=True) for one in plan.get_lines())
    assert any(np.array_equal(one.get_xdata(), place[:, 1], equal_nan=True) for one in plan.get_lines())


def test_forces_are_named_and_the_manoeuvre_chooses_its_components(comparison):
    forces = draw(comparison)["forces"]
    assert texts(forces)[2:5] == ["(c) Forward force by term", "(d) Force to starboard by term",
                                  "(e) Yaw moment by term"]  # fmt: skip
    named = [one.get_label() for one in forces.axes[2].get_lines()]
    assert named == ["propeller", "axial drag", "cable"]  # the largest first


def test_a_map_shows_both_directions_in_the_same_scale(comparison):
    plan = draw(comparison)["cable"].axes[0]
    box = plan.get_window_extent()
    per_metre = [box.width / np.ptp(plan.get_xlim()), box.height / np.ptp(plan.get_ylim())]
    assert per_metre[0] == pytest.approx(per_metre[1])


@pytest.mark.long
@pytest.mark.parametrize("prescribed", [None, "straight", "dive"])
def test_a_run_that_stopped_at_once_can_be_drawn(prescribed, make_run, tmp_path):
    for figure in draw({"tethered": make_run(samples=1, prescribed=prescribed)}).values():
        figure.savefig(tmp_path / "one.png")  # warnings are errors


def test_a_drum_that_moves_is_drawn_with_its_way_and_a_winch_with_what_it_does(make_run):
    run = make_run(prescribed="dive")
    reported = run.attrs["parameters"].replace('"current"', '"vessel": {"time": [0.0]}, "current"')
    still = draw({"tethered": run})
    assert "deployment" not in still
    assert still["cable"].axes[0].get_xlabel() == "east of the drum [m]"
    way = 0.3 * run["time"].values
    place = run["cable_position"].values.copy()
    for k, nodes in enumerate(run["node_count"].values):
        place[k, nodes - 1, 0] = way[k]
    run["cable_position"] = (run["cable_position"].dims, place)
    figures = draw({"tethered": run.assign_attrs(parameters=reported)})
    assert figures["cable"].axes[0].get_xlabel() == "east of the vessel's start [m]"
    for axes in (figures["cable"].axes[0], figures["deployment"].axes[3]):
        assert any(np.array_equal(one.get_ydata(), way) for one in axes.get_lines())
    rate = figures["deployment"].axes[1].get_lines()[0].get_ydata()
    assert_allclose(rate[5:-5].mean(), 1.0, rtol=1e-2)  # a vehicle at 1 m/s pulls it out at 1 m/s


def test_a_run_longer_than_the_papers_shows_the_cable_up_to_its_end(make_run):
    shapes = draw({"tethered": make_run(prescribed="dive", samples=1001)})["fig5"].axes[1]
    assert [one.get_label() for one in shapes.get_lines()] == ["20 s", "40 s", "60 s", "80 s", "100 s"]


@pytest.mark.parametrize("besides", ['"winch": {"control": "brake"}', '"profile": {"depth": [0.0]}'])
def test_a_straight_course_has_an_exact_tension_only_on_a_free_drum_in_still_water(besides, make_run):
    run = make_run(prescribed="straight")
    assert "fig4" in draw({"tethered": run})
    reported = run.attrs["parameters"].replace('"current"', f'{besides}, "current"')
    assert "fig4" not in draw({"tethered": run.assign_attrs(parameters=reported)})


def test_an_untethered_prescribed_run_has_nothing_to_show(make_run):
    assert draw({"untethered": make_run(tethered=False, prescribed="dive")}) == {}


@pytest.mark.long
def test_a_title_is_plain_text_whatever_it_holds(make_run, tmp_path):
    run = make_run().assign_attrs(title=r"costs $5 and $6_{ [bold] \alpha", scenario="a_$b_{$")
    draw({"tethered": run})["fig6"].savefig(tmp_path / "money.png")


def test_the_range_graph_has_the_largest_and_smallest_tension_of_every_place(make_run):
    """A straight pull: the tension rises linearly from the drum to the vehicle and grows with time, so the largest is
    that of the end, and the smallest at s that of the moment when so much cable was out: 0.
    """
    run = make_run(prescribed="straight")
    image, graph = draw({"tethered": run})["tension"].axes[:2]
    s, high = line(graph, "largest").get_data()
    pieces = np.linalg.norm(np.diff(run["cable_position"].values[-1], axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(pieces[np.isfinite(pieces)])])
    T = run["cable_node_tension"].values[-1][: arc.size]
    assert_allclose(high, np.interp(s, arc, T), atol=1e-3 * T.max())
    assert_allclose(line(graph, "at the end").get_ydata(), high, atol=1e-3 * T.max())
    assert line(graph, "smallest").get_ydata().max() < 0.05 * T.max()
    drawn = image.collections[0].get_array()
    assert float(np.ma.max(drawn)) == pytest.approx(T.max(), rel=1e-6)
    assert np.ma.getmaskarray(drawn)[0].mean() > 0.9, "there is no cable yet where it is not out"


@pytest.mark.long
@pytest.mark.parametrize("width", [3.4, 7.2])
def test_at_every_width_letters_are_legible_and_no_legend_hides_a_curve(width, comparison, make_run):
    with page_width(width):
        figures = [*draw(comparison).values(), *draw({"tethered": make_run(prescribed="dive")}).values()]
    for figure in figures:
        assert figure.get_figwidth() == width
        figure.draw_without_rendering()
        for words in figure.findobj(Text):
            assert not words.get_text() or words.get_fontsize() >= 7.0, words
        for axes in figure.axes:
            box = axes.get_legend().get_window_extent() if axes.get_legend() else None
            for curve in axes.get_lines() if box else ():
                x, y = axes.transData.transform(np.column_stack(curve.get_data()).astype(float)).T
                inside = (x > box.x0) & (x < box.x1) & (y > box.y0) & (y < box.y1)
                assert not inside.any(), (axes.get_title(loc="left"), curve.get_label())


@pytest.mark.long
def test_a_narrow_figure_has_its_panels_below_one_another(comparison):
    with page_width(3.4):
        panels = draw(comparison)["fig6"].axes
    assert len({round(axes.get_position().x0, 3) for axes in panels}) == 1
    assert len({round(axes.get_position().x0, 3) for axes in draw(comparison)["fig6"].axes}) == 2


def test_a_width_that_no_page_has_is_refused():
    with pytest.raises(UserError, match=r"cannot be 1 inches wide\. Allowed: 3 to 20"), page_width(1.0):
        pass


def test_a_cable_that_would_be_a_flat_line_is_stretched_and_says_how_much(make_run):
    run = make_run(prescribed="straight")
    flat = run["cable_position"].values.copy()
    flat[..., 2] = 0.002 * flat[..., 0]
    run["cable_position"] = (run["cable_position"].dims, flat)
    side = draw({"tethered": run})["cable"].axes[1]
    found = re.search(r"depth stretched (\d+) times", side.get_title(loc="left"))
    assert found
    box = side.get_window_extent()
    real = (box.height / np.ptp(side.get_ylim())) / (box.width / np.ptp(side.get_xlim()))
    assert float(found[1]) == pytest.approx(real, rel=0.02)
    steep = draw({"tethered": make_run(prescribed="dive")})["cable"].axes[1]
    assert "stretched" not in steep.get_title(loc="left")


@pytest.mark.parametrize(
    "kind", [pytest.param("svg", marks=pytest.mark.long), pytest.param("pdf", marks=pytest.mark.slow)]
)
def test_figures_are_drawings_if_asked_for_and_two_are_alike_to_the_last_byte(kind, rails, tmp_path):
    from subzero.cli.app import FINE, main

    for folder in ("one", "two"):
        words = ["simulate", "fig6", "--figures", kind, "--width", "3.4", "--out", str(tmp_path / folder)]
        assert main(words) == FINE
    drawn = sorted(path.name for path in (tmp_path / "one").glob(f"*.{kind}"))
    assert drawn == [f"{name}.{kind}" for name in ("attitude", "cable", "fig6", "forces", "tension")]
    assert not list((tmp_path / "one").glob("*.png"))
    for name in drawn:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), name
