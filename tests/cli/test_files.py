"""A command leaves files that a person and a program can read: complete, with units, or none at all."""

from __future__ import annotations

import csv
import json
import sys
import tracemalloc

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

from subzero.channels import BY_COLUMN, CHANNELS, column_name
from subzero.cli.app import FINE, STOPPED, main
from subzero.records.record import read_record
from subzero.results.netcdf_csv import open_output_folder, storage, write_netcdf

PICTURES = {"fig6.png", "attitude.png", "cable.png", "tension.png", "forces.png"}
RUN_KEYS = """outcome outcome_message time_at_end_s peak_speed_m_s time_of_peak_speed_s speed_at_end_m_s
    heading_at_end_deg depth_at_end_m path_length_m cable_length_at_end_m largest_cable_force_N
    time_of_largest_cable_force_s largest_cable_moment_N_m time_of_largest_cable_moment_s energy diagnostics
    warnings notes thinned refinement"""
BOTH = {"tethered.nc", "tethered.csv", "untethered.nc", "untethered.csv", "summary.json", "report.html"}


def names(folder):
    return {path.name for path in folder.iterdir()}


@pytest.fixture
def folder(compared):
    return compared.here / "fig6"


def test_compare_leaves_all_files_in_a_folder_named_after_the_scenario(compared, folder):
    assert compared.code == FINE
    assert names(compared.here) == {"fig6"}
    assert names(folder) == BOTH | PICTURES
    assert [tethered for _, tethered in compared.asked] == [True, False]


def test_it_says_which_files_it_wrote(compared):
    assert compared.said.endswith(f"Wrote fig6/: {', '.join(sorted(BOTH | PICTURES))}\n")


@pytest.mark.long
@pytest.mark.parametrize("flag, kind", [([], "tethered"), (["--untethered"], "untethered")])
def test_simulate_leaves_one_run(flag, kind, tmp_path, rails):
    assert main(["simulate", "fig6", *flag, "--out", str(tmp_path / "new" / "deep")]) == FINE
    assert [tethered for _, tethered in rails] == [kind == "tethered"]
    pictures = PICTURES if kind == "tethered" else PICTURES - {"cable.png", "tension.png"}
    assert (
        names(tmp_path / "new" / "deep")
        == {f"{kind}.nc", f"{kind}.csv", "summary.json", "report.html"} | pictures
    )


def test_columns_carry_their_units(folder):
    with open(folder / "tethered.csv", encoding="utf-8") as file:
        header = next(csv.reader(file))
    expected = ["time_s", "surge_speed_m_s", "heading_deg", "depth_m", "cable_tension_N", "cable_length_m",
                "cable_moment_yaw_N_m", "propeller_speed_rps", "yaw_rate_deg_s"]  # fmt: skip
    assert set(expected) <= set(header)
    assert header == ["time_s", *(channel.column for channel in CHANNELS)]


def test_every_channel_of_the_netcdf_file_has_its_unit(folder):
    with xr.open_dataset(folder / "tethered.nc") as run:
        for channel in CHANNELS:
            assert run[channel.name].attrs["units"] == channel.unit
        assert run.attrs["scenario_text"] == "[run]"
        assert run.sizes["time"] == 301


def test_netcdf_and_csv_say_the_same(folder):
    record = read_record(folder / "tethered.csv")
    with xr.open_dataset(folder / "tethered.nc") as run:
        for name, values in record.values.items():
            assert_allclose(values, run[name].values, rtol=1e-9, atol=1e-12)  # ten digits are written


def test_column_names_lead_back_to_their_channels():
    for channel in CHANNELS:
        assert BY_COLUMN[column_name(channel.name)] is channel


@pytest.mark.long
def test_two_runs_leave_the_same_bytes(folder, rails, tmp_path):
    assert main(["compare", "fig6", "--out", str(tmp_path / "again")]) == FINE
    for path in folder.iterdir():
        assert path.read_bytes() == (tmp_path / "again" / path.name).read_bytes(), path.name


def test_the_summary_has_plain_numbers_with_units_in_their_names(folder):
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert list(summary) == [
        "scenario", "title", "subzero_version", "prescribed", "tethered", "untethered", "measured"
    ]  # fmt: skip
    assert set(summary["tethered"]) == set(summary["untethered"]) == set(RUN_KEYS.split())
    assert summary["measured"] is None
    assert set(summary["tethered"]["energy"]) == {
        "propeller_work_J", "hull_loss_J", "cable_loss_J", "kinetic_change_J", "drum_J", "added_mass_term_J",
        "residual_J", "unexplained_share",
    }  # fmt: skip


@pytest.mark.long
def test_files_of_the_user_stay_and_old_results_are_replaced(tmp_path, rails):
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "summary.json").write_text("old")
    assert main(["simulate", "fig6", "--out", str(tmp_path)]) == FINE
    assert (tmp_path / "notes.txt").read_text() == "mine"
    assert json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))["scenario"] == "fig6"


def test_a_failure_while_writing_leaves_nothing_half_written(tmp_path):
    def write_half():
        with open_output_folder(tmp_path / "out") as output_folder:
            (output_folder.path / "half.csv").write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        write_half()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.long
def test_a_prescribed_run_gets_figure_4(tmp_path, rails):
    assert main(["simulate", "fig4", "--out", str(tmp_path)]) == FINE
    assert names(tmp_path) == {
        "fig4.png",
        "cable.png",
        "tension.png",
        "report.html",
        "summary.json",
        "tethered.csv",
        "tethered.nc",
    }
    assert json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))["tethered"]["energy"] is None


@pytest.mark.long
def test_commands_of_a_file_replace_those_of_the_scenario(tmp_path, rails):
    path = tmp_path / "commands.csv"
    path.write_text(
        "time_s,propeller_rps,rudder_deg,stern_plane_port_deg,stern_plane_starboard_deg\n0,5,1,0,0\n30,5,1,0,0\n"
    )
    assert main(["simulate", "fig6", "--commands", str(path), "--out", str(tmp_path / "out")]) == FINE
    assert rails[0][0].commands.values[0, 0] == 5.0


@pytest.mark.long
def test_a_run_that_stops_keeps_what_it_has_and_exits_with_3(tmp_path, rails, monkeypatch, capsys, make_run):
    def stops(_trial, *, tethered, progress):
        return make_run(outcome="stopped", samples=31) if tethered else make_run(tethered=False)

    monkeypatch.setattr(sys.modules["subzero.simulation.run"], "simulate", stops)
    assert main(["compare", "fig6", "--out", str(tmp_path)]) == STOPPED
    said = capsys.readouterr()
    assert said.err.endswith(
        "The tethered run stopped: The cable did not converge at t = 3 s, node 4. Try a shorter cable step.\n"
    )
    assert "stopped, 3 s" in said.out
    assert names(tmp_path) == BOTH | PICTURES
    assert (
        json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))["tethered"]["outcome"]
        == "stopped"
    )


@pytest.mark.parametrize(
    "name, folder", [("fig6", "fig6"), ("../up", "_up"), ("a b/c", "a_b_c"), ("..", "run")]
)
def test_the_folder_of_a_trial_is_always_here(name, folder):
    from types import SimpleNamespace

    from subzero.cli.write_results import default_folder

    assert str(default_folder(SimpleNamespace(name=name))) == folder  # type: ignore[arg-type]


def test_a_long_run_is_written_without_a_second_copy_of_its_shapes(tmp_path):
    """What writing takes beside 22 MB of shapes is less than a quarter of them: blocks of 1024 times are a fifteenth.

    xarray itself takes two thirds. The file has the same values, types, attributes and compression as xarray's.
    """
    shape = np.random.default_rng(1).normal(size=(15_000, 60, 3))
    about = {"units": "m", "long_name": "place"}
    run = xr.Dataset(
        {"cable_position": (("time", "node", "earth_axis"), shape, about), "depth": ("time", shape[:, 0, 0])},
        coords={"time": 0.1 * np.arange(15_000), "arc_length": (("time", "node"), shape[..., 1].copy())},
    )
    write_netcdf(run.isel(time=slice(10)), tmp_path / "short.nc")  # what is imported once
    tracemalloc.start()
    write_netcdf(run, tmp_path / "ours.nc")
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 0.25 * shape.nbytes
    run.to_netcdf(tmp_path / "theirs.nc", engine="netcdf4", encoding=storage(run))
    with xr.open_dataset(tmp_path / "ours.nc") as ours, xr.open_dataset(tmp_path / "theirs.nc") as theirs:
        assert ours.identical(theirs)
        for name in ("cable_position", "arc_length"):
            for key in ("dtype", "zlib", "complevel", "shuffle", "chunksizes"):
                assert ours[name].encoding[key] == theirs[name].encoding[key]
