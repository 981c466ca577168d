"""How much a run changes with half its steps: what `subzero.check` and ``--check`` say.

Verifies: the table against differences taken by hand, and that of the tow force against what is known of two runs.
"""

import dataclasses
import json

import numpy as np
import pytest
import xarray as xr

import scenarios
import subzero
from subzero.cli.app import FINE, STOPPED, main
from subzero.simulation.comparison import halved
from subzero.simulation.refinement import Budget, run_converged
from subzero.simulation.run import run_trial

SHORT = dataclasses.replace(subzero.load_scenario("fig6"), duration=4.0, rtol=0.0)


@pytest.fixture(scope="module")
def refinement():
    return subzero.check(SHORT)


def test_the_finer_run_has_half_the_steps_and_segments(refinement):
    assert refinement.finer.sizes["time"] == 2 * refinement.run.sizes["time"] - 1
    fine = halved(SHORT)
    assert (fine.hull_step, fine.cable_step, fine.segment_length) == (0.01, 0.05, 0.25)


@pytest.mark.parametrize("side_by_side", [True, False])
def test_the_accuracy_of_a_run_is_its_change_from_twice_as_long_steps_and_segments(side_by_side):
    trial, made = dataclasses.replace(SHORT, rtol=0.5), {}

    def take(each, grid, progress):
        made[each.segment_length, grid.times.size] = run = run_trial(
            each, subzero.Model.of(trial), True, progress, grid=grid
        )
        return run

    run, accuracy = run_converged(trial, take, Budget(), side_by_side=side_by_side)
    assert run is made[0.5, 41]
    fine, coarse = (each.recording.trace[:, :3] for each in (run, made[1.0, 21]))
    gap = np.linalg.norm(fine[::2] - coarse, axis=1)[3:]  # the first five steps are the start
    change = gap.max() / np.linalg.norm(fine, axis=1).max()
    assert accuracy.change == pytest.approx(change, rel=1e-12)


def test_the_table_holds_the_largest_change_of_every_channel_worst_first(refinement):
    ours, theirs = refinement.run["surge_speed"].values, refinement.finer["surge_speed"].values[::2]
    row = refinement.table.sel(channel="surge_speed")
    assert float(row["difference"]) == pytest.approx(np.abs(ours - theirs).max(), rel=1e-12)
    assert float(row["change"]) == pytest.approx(np.abs(ours - theirs).max() / theirs.max(), rel=1e-12)
    assert refinement.table["change"].values.tolist() == sorted(
        refinement.table["change"].values, reverse=True
    )
    assert refinement.worst == (
        str(refinement.table["channel"].values[0]),
        float(refinement.table["change"].values[0]),
    )


def test_the_tow_force_is_compared_as_a_vector(refinement):
    parts = [f"cable_force_{axis}" for axis in ("forward", "starboard", "down")]
    ours = np.array([refinement.run[name].values for name in parts])
    theirs = np.array([refinement.finer[name].values for name in parts])
    change = (
        np.linalg.norm(ours - theirs[:, ::2], axis=0).max() / np.linalg.norm(theirs[:, ::2], axis=0).max()
    )
    assert refinement.tow_force == pytest.approx(change, rel=1e-12)


def test_commands_and_what_stays_zero_are_left_out(refinement):
    names = refinement.table["channel"].values.tolist()
    assert not [name for name in names if name.endswith("_command")]
    assert "stern_plane_port_angle" not in names


def test_a_tow_force_that_changes_by_more_than_a_percent_is_warned_of():
    """Ten metres that are pulled from rest, with long steps that are taken as they are."""
    start = dataclasses.replace(SHORT.start, wet_length=10.0)
    steps = {"cable_step": 0.4, "hull_step": 0.04, "segment_length": 2.0, "rtol": 0.0}
    coarse = subzero.check(dataclasses.replace(SHORT, start=start, **steps))
    assert coarse.tow_force > 0.01
    (one,) = coarse.warnings
    assert one.check == "refinement"
    assert f"changes by {100.0 * coarse.tow_force:.3g} %" in one.message
    assert one in subzero.warnings_of(coarse.marked_run())


def test_a_run_that_is_fine_enough_is_not_warned_of(refinement):
    assert refinement.tow_force < 0.01
    assert refinement.warnings == ()


def test_an_untethered_run_can_be_checked_too():
    alone = subzero.check(SHORT, tethered=False)
    assert alone.tow_force == 0.0
    assert alone.worst[1] < 0.01
    assert "tow_force" not in alone.table["channel"].values


def test_its_representation_tells_the_worst_channels(refinement):
    assert repr(refinement).splitlines()[0] == "Refinement of 'fig6': change by half the steps and segments"
    assert repr(refinement).splitlines()[1].startswith(refinement.worst[0])


@pytest.fixture
def mine(tmp_path):
    """A short trial in a file, with steps of 0.4 s that are taken as they are, on ten metres of cable, or of 0.1 s."""
    text = scenarios.path("fig6").read_text(encoding="utf-8").replace("duration_s = 30.0", "duration_s = 4.0")
    coarse = text.replace("cable_step_s = 0.1", "cable_step_s = 0.4").replace(
        "hull_step_s = 0.02", "hull_step_s = 0.04"
    )
    (tmp_path / "fine.toml").write_text(text, encoding="utf-8")
    (tmp_path / "coarse.toml").write_text(
        coarse.replace("segment_length_m = 0.5", "segment_length_m = 2.0")
        .replace("rtol = 0.02", "rtol = 0.0")
        .replace("wet_length_m = 0.0", "wet_length_m = 10.0"),
        encoding="utf-8",
    )
    return tmp_path


@pytest.mark.long
def test_check_on_the_command_line_tells_table_and_warning_everywhere_and_strict_exits_with_3(mine, capsys):
    words = ["compare", str(mine / "coarse.toml"), "--check", "--strict", "--out", str(mine / "out")]
    assert main(words) == STOPPED
    reported = capsys.readouterr()
    said = " ".join(reported.out.split())
    assert "Warnings under --strict: " in reported.err
    for label in ("tethered", "untethered"):
        assert f"Change of the {label} run by half the steps and segments" in said
    summary = json.loads((mine / "out" / "summary.json").read_text(encoding="utf-8"))["tethered"]
    assert summary["refinement"]["tow_force"]["change"] > 0.01
    assert "refinement" in [one["check"] for one in summary["warnings"]]
    assert all(one["message"] in said for one in summary["warnings"])
    with xr.open_dataset(mine / "out" / "tethered.nc") as run:
        assert [one._asdict() for one in subzero.warnings_of(run)] == summary["warnings"]


@pytest.mark.long
def test_a_run_that_is_fine_enough_passes_strict(mine):
    words = ["simulate", str(mine / "fine.toml"), "--untethered", "--check", "--strict"]
    assert main([*words, "--out", str(mine / "fine")]) == FINE
    summary = json.loads((mine / "fine" / "summary.json").read_text(encoding="utf-8"))["untethered"]
    assert summary["warnings"] == []
    assert max(row["change"] for row in summary["refinement"].values()) < 0.01
