"""A run that is written for another program is read by that program's own library as it is, to the last bit.

Verifies: `subzero.export` and ``--export``, read back with mcap, scipy, pyarrow and xarray; the CF file by the checker
of IOOS. Configuration: fig6, which turns, rolls, dives a little and pulls 22 m of cable. Tolerance: none for numbers;
1e-9 for places, which go through a rotation.
"""

import dataclasses
import json
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from mcap.reader import make_reader
from scipy.io import loadmat
from scipy.spatial.transform import Rotation

import scenarios
import subzero
from subzero.channels import CHANNELS, TIME
from subzero.cli.app import FINE, MISTAKE, main


@pytest.fixture(scope="module")
def run():
    """A run with a gap in one channel, and a warning."""
    made = subzero.simulate("fig6")
    voltage = made["battery_voltage"].copy(data=made["battery_voltage"].values.copy())
    voltage[7] = np.nan
    warned = json.dumps([{"check": "slack", "message": "Some of it is folded."}])
    return made.assign(battery_voltage=voltage).assign_attrs(warnings=warned)


def exported(run, folder, kind):
    subzero.export(run, folder / f"run.{kind}")
    return folder / f"run.{kind}"


def describes(schema, message):
    """Say whether a schema describes all of a message but what is empty; a viewer refuses a topic otherwise."""
    if message == []:
        return True
    if schema["type"] == "object":
        return all(
            describes(schema["properties"].get(name, {"type": ""}), part) for name, part in message.items()
        )
    if schema["type"] == "array":
        return all(describes(schema["items"], part) for part in message)
    kinds = {"number": (int, float), "string": str, "boolean": bool}
    return isinstance(message, kinds.get(schema["type"], ()))


def logged(path):
    """Return topic → [(time [s], message)], and the metadata of the run."""
    topics = {}
    with open(path, "rb") as stream:
        reader = make_reader(stream)
        for schema, channel, message in reader.iter_messages():
            assert schema.encoding == "jsonschema"
            said = json.loads(message.data)
            assert describes(json.loads(schema.data), said), (schema.name, said)
            topics.setdefault(channel.topic, []).append((1e-9 * message.log_time, said))
        (about,) = reader.iter_metadata()
    return topics, about.metadata


def test_a_log_has_every_number_of_every_channel_but_gaps(run, tmp_path):
    topics, about = logged(exported(run, tmp_path, "mcap"))
    rows = topics["/channels"]
    np.testing.assert_allclose([at for at, _ in rows], run["time"], atol=1e-9)
    for channel in CHANNELS:
        values = np.array([message.get(channel.column, np.nan) for _, message in rows])
        np.testing.assert_array_equal(values, run[channel.name])
    assert [channel.column not in rows[7][1] for channel in CHANNELS].count(True) == 1
    assert about["scenario_text"] == run.attrs["scenario_text"]
    ((at, reported),) = topics["/log"]
    assert (round(at, 9), reported["message"]) == (30.0, "slack: Some of it is folded.")


def turned(transform, vector):
    """Return a vector of the child's axes in those of the parent."""
    return Rotation.from_quat([transform["rotation"][axis] for axis in "xyzw"]).apply(vector)


def test_a_viewer_sees_the_vehicle_where_it_is_and_the_cable_at_its_tow_point(run, tmp_path):
    topics, _ = logged(exported(run, tmp_path, "mcap"))
    (_, earth), *poses = topics["/tf"]
    assert (earth["parent_frame_id"], earth["child_frame_id"]) == ("map", "ned")
    for north_east_down, east_north_up in (
        ([1, 0, 0], [0, 1, 0]),
        ([0, 1, 0], [1, 0, 0]),
        ([0, 0, 1], [0, 0, -1]),
    ):
        np.testing.assert_allclose(turned(earth, north_east_down), east_north_up, atol=1e-12)
    lines = [(at, one["entities"][0]) for at, one in topics["/scene"] if one["entities"][0]["lines"]]
    tow = json.loads(run.attrs["parameters"])["vehicle"]["tow_point"]
    assert len(poses) == len(lines) == run.sizes["time"]
    for row in (0, 150, 300):
        now, (at, pose), (also_at, cable) = run.isel(time=row), poses[row], lines[row]
        assert at == also_at == pytest.approx(float(now["time"]), abs=1e-9)
        roll, pitch, heading = (np.radians(float(now[name])) for name in ("roll_angle", "pitch", "heading"))
        ahead = [np.cos(pitch) * np.cos(heading), np.cos(pitch) * np.sin(heading), -np.sin(pitch)]
        np.testing.assert_allclose(turned(pose, [1, 0, 0]), ahead, atol=1e-9)
        assert turned(pose, [0, 1, 0])[2] == pytest.approx(np.sin(roll) * np.cos(pitch), abs=1e-9)
        place = np.array([pose["translation"][axis] for axis in "xyz"])
        np.testing.assert_array_equal(place, [float(now[name]) for name in ("north", "east", "depth")])
        points = np.array([[point[axis] for axis in "xyz"] for point in cable["lines"][0]["points"]])
        assert (cable["frame_id"], len(points)) == ("ned", int(now["node_count"]))
        np.testing.assert_allclose(points[0], place + turned(pose, [tow[axis] for axis in "xyz"]), atol=1e-9)


def test_matlab_gets_every_variable_with_its_unit(run, tmp_path):
    read = loadmat(exported(run, tmp_path, "mat"), squeeze_me=True, simplify_cells=True)
    for name, variable in run.data_vars.items():
        np.testing.assert_array_equal(read[name], variable)
        assert read["units"][name] == variable.attrs["units"]
    assert list(read["term"]) == list(run["term"].values)
    assert read["axes"]["force_breakdown"] == "time, term, component"
    assert read["about"]["outcome"] == "completed"


def test_a_table_has_the_columns_of_the_csv_and_the_cable_as_lists(run, tmp_path):
    from pyarrow.parquet import read_table

    table = read_table(exported(run, tmp_path, "parquet"))
    lists = ["cable_north_m", "cable_east_m", "cable_depth_m", "cable_node_tension_N"]
    assert table.column_names == [TIME.column, *(one.column for one in CHANNELS), *lists]
    for channel in (TIME, *CHANNELS):
        np.testing.assert_array_equal(table[channel.column].to_numpy(), run[channel.name])
        assert table.schema.field(channel.column).metadata[b"units"].decode() == channel.unit
    tension = table["cable_node_tension_N"].to_pylist()
    assert [len(one) for one in tension] == run["node_count"].values.tolist()
    assert tension[300] == run["cable_node_tension"].values[300, : len(tension[300])].tolist()
    assert table.schema.metadata[b"scenario"] == b"fig6"


CHECKED = """
import sys
from compliance_checker.runner import CheckSuite, ComplianceChecker
CheckSuite.load_all_available_checkers()
ComplianceChecker.run_checker(
    sys.argv[1], ["cf:1.11"], verbose=0, criteria="strict", output_filename=sys.argv[2], output_format="json"
)
"""


def issues(path, found):
    """Return what the checker of the CF conventions finds, at any priority."""
    subprocess.run([sys.executable, "-c", CHECKED, str(path), str(found)], check=True, capture_output=True)
    said = json.loads(found.read_text(encoding="utf-8"))["cf:1.11"]
    assert said["scored_points"] > 0
    kinds = ("high_priorities", "medium_priorities", "low_priorities")
    return [one["msgs"] for kind in kinds for one in said[kind] if one["msgs"]]


@pytest.mark.long
def test_netcdf_for_others_passes_a_checker_of_the_cf_conventions(run, tmp_path):
    assert issues(exported(run, tmp_path, "nc"), tmp_path / "found.json") == []
    subzero.simulate("fig6", tethered=False).to_netcdf(tmp_path / "plain.nc")
    assert len(issues(tmp_path / "plain.nc", tmp_path / "plain.json")) > 2  # it can find something


def test_netcdf_for_others_has_the_numbers_of_the_run_and_leaves_it_as_it_was(run, tmp_path):
    before = run.copy(deep=True)
    path = exported(run, tmp_path, "nc")
    xr.testing.assert_identical(run, before)
    with xr.open_dataset(path) as read:
        since = (read["time"] - np.datetime64("2000-01-01")) / np.timedelta64(1, "s")
        np.testing.assert_allclose(since, run["time"], atol=1e-9)
        for channel in CHANNELS:
            np.testing.assert_array_equal(read[channel.name], run[channel.name])
        assert list(read["term_label"].values) == list(run["term"].values)
        for name, axes in (("force", ["X", "Y", "Z"]), ("moment", ["K", "M", "N"])):
            mine = run["force_breakdown"].sel(component=axes)
            theirs = read[f"{name}_breakdown_by_term"].transpose("time", "term", f"{name}_axis")
            np.testing.assert_array_equal(theirs, mine)
            assert list(read[f"{name}_axis_label"].values) == axes


@pytest.mark.parametrize("kind", ["mcap", "mat", "parquet", "nc"])
def test_a_vehicle_without_a_cable_is_written_too(kind, tmp_path):
    trial = dataclasses.replace(subzero.load_scenario("fig6"), duration=1.0)
    path = exported(subzero.simulate(trial, tethered=False), tmp_path, kind)
    if kind == "mcap":
        topics, _ = logged(path)
        assert [one["entities"][0]["id"] for _, one in topics["/scene"]] == ["vehicle"]


@pytest.mark.long
def test_the_command_writes_them_beside_its_files(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = scenarios.path("fig6").read_text(encoding="utf-8")
    (tmp_path / "short.toml").write_text(
        text.replace("duration_s = 30.0", "duration_s = 1.0"), encoding="utf-8"
    )
    assert main(["simulate", "short.toml", "--out", "out", "--export", "mcap", "--export", "cf"]) == FINE
    made = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"tethered.mcap", "tethered_cf.nc", "tethered.nc"} <= made
    assert "tethered_cf.nc" in capsys.readouterr().out


def test_what_cannot_be_exported_is_refused_before_the_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "fig6", "--export", "mcp"]) == MISTAKE
    assert "Did you mean 'mcap'? Allowed: mcap, mat, parquet, cf." in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    assert main(["compare", "fig6", "--export", "parquet"]) == MISTAKE
    assert "needs pyarrow: pip install 'subzero-auv[export]'" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
