"""A run that is killed and started again ends as if nothing had happened, to the last bit.

Verifies: `subzero.simulation.checkpoint`. Configuration: stop_and_drift, whose accuracy takes several runs; a model
that changes in mid-run; a winch on a moving drum; no cable; a command that is killed. Tolerance: identity of every
value and every attribute. Each run is broken off at each of many operations on the disk, and the command by SIGKILL
at random times (slow: once, and 20 times).
"""

from __future__ import annotations

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr

import scenarios
import subzero
from subzero.cli.app import FINE, MISTAKE, main
from subzero.simulation.checkpoint import MANIFEST, STATE, Checkpoint


class Killed(BaseException):
    """The process ends here."""


@pytest.fixture
def killed_at(monkeypatch):
    """Return a function that lets a process end at its n-th renaming, before or behind it."""
    real = os.replace

    def arm(n, behind):
        left = [n]

        def replace(*paths):
            left[0] -= 1
            if left[0] == 0 and not behind:
                raise Killed
            real(*paths)
            if left[0] == 0:
                raise Killed

        monkeypatch.setattr("os.replace", replace)

    yield arm
    monkeypatch.setattr("os.replace", real)


def changed(name, **fields):
    return dataclasses.replace(subzero.load_scenario(name), **fields)


def later_of(trial):
    model = subzero.Model.of(trial)
    return [(4.0, dataclasses.replace(model, current=(0.1, 0.05, 0.0))), (8.0, model)]


CASES = {
    "several runs": lambda: (changed("stop_and_drift", duration=22.0), {}),
    "kept seldom": lambda: (changed("fig6", duration=12.0), {"every": 0.7}),
    "changes in mid-run": lambda: (changed("fig6", duration=12.0), {"later": later_of(changed("fig6"))}),
    "a winch at sea": lambda: (changed("rov_umbilical", duration=30.0, rtol=0.0), {}),
    "no cable": lambda: (changed("dive"), {"tethered": False}),
}


@pytest.mark.long
@pytest.mark.parametrize("case", CASES)
def test_a_run_that_is_broken_off_at_any_file_ends_the_same(case, tmp_path, killed_at):
    trial, options = CASES[case]()
    plain = subzero.simulate(trial, **options)
    checkpoint = Checkpoint(folder=tmp_path / "kept", minutes=0.0)
    rng, kills, run = np.random.default_rng(3), 0, None
    while run is None:
        killed_at(int(rng.integers(2, 20)) if kills > 1 else 2, behind=bool(kills % 2))
        try:
            run = subzero.simulate(trial, **options, checkpoint=checkpoint)
        except Killed:
            kills += 1
        assert kills < 100
    assert kills > 1
    xr.testing.assert_identical(run, plain)


def test_what_is_finished_is_not_run_again(tmp_path, monkeypatch):
    checkpoint = Checkpoint(folder=tmp_path / "kept", minutes=60.0)
    plain = subzero.simulate("fig6", checkpoint=checkpoint)
    assert checkpoint.kept_until() is not None
    monkeypatch.setattr("subzero.simulation.run.run_rows", None)
    xr.testing.assert_identical(subzero.simulate("fig6", checkpoint=checkpoint), plain)
    (tmp_path / "kept" / "mine.txt").write_text("mine", encoding="utf-8")
    checkpoint.remove()
    assert [path.name for path in (tmp_path / "kept").iterdir()] == ["mine.txt"]
    assert checkpoint.kept_until() is None


@pytest.mark.parametrize("what", ["trial", "model", "later models", "version of subzero", "processor"])
def test_another_simulation_is_refused_with_what_differs(what, tmp_path, monkeypatch):
    trial, checkpoint = changed("fig6", duration=1.0), Checkpoint(folder=tmp_path, minutes=0.0)
    subzero.simulate(trial, checkpoint=checkpoint)
    model = subzero.Model.of(trial)
    options = {"scenario": trial, "model": model}
    if what == "trial":
        options["scenario"] = dataclasses.replace(trial, duration=1.0 + 1e-9)
    elif what == "model":
        options["model"] = dataclasses.replace(model, current=(1e-300, 0.0, 0.0))
    elif what == "later models":
        options["later"] = [(0.5, model)]
    else:
        monkeypatch.setattr(
            f"subzero.simulation.run.{'code_digest' if what.startswith('version') else 'processor'}",
            lambda: "another",
        )
    with pytest.raises(
        subzero.UserError, match=rf"belongs to another simulation: its {what} differs\. Give another"
    ):
        subzero.simulate(**options, checkpoint=checkpoint)


@pytest.mark.parametrize("name", [STATE, MANIFEST])
@pytest.mark.parametrize("spoil", ["cut", "changed", "empty", "gone"])
def test_a_damaged_file_is_told_and_never_taken_for_a_run(name, spoil, tmp_path):
    trial, checkpoint = changed("fig6", duration=2.0, rtol=0.0), Checkpoint(folder=tmp_path, minutes=0.0)
    plain = subzero.simulate(trial, checkpoint=checkpoint)
    (path,) = tmp_path.glob(f"**/{name}")
    whole = path.read_bytes()
    half = len(whole) // 2
    if spoil == "gone":
        path.unlink()
    else:
        path.write_bytes(
            {"cut": whole[:half], "changed": whole[:half] + b"zzzz" + whole[half + 4 :], "empty": b""}[spoil]
        )
    if spoil == "gone":  # begun anew, or taken as it is
        xr.testing.assert_identical(subzero.simulate(trial, checkpoint=checkpoint), plain)
    else:
        with pytest.raises(subzero.UserError, match="emove it to begin anew"):
            subzero.simulate(trial, checkpoint=checkpoint)


def test_two_commands_do_not_share_one(tmp_path):
    from subzero.simulation.checkpoint import opened

    checkpoint = Checkpoint(folder=tmp_path)
    with (
        opened(checkpoint, "tethered", {}),
        pytest.raises(subzero.UserError, match="Another command is at work"),
    ):
        subzero.simulate("fig6", checkpoint=checkpoint)


def test_nothing_in_it_is_code(tmp_path):
    subzero.simulate(changed("fig6", duration=1.0), checkpoint=Checkpoint(folder=tmp_path, minutes=0.0))
    for path in tmp_path.glob("**/*.npz"):
        with np.load(path, allow_pickle=False) as file:
            assert all(file[name].dtype.kind in "fiu" for name in file.files)
    for path in tmp_path.glob(f"**/{MANIFEST}"):
        assert set(json.loads(path.read_text(encoding="utf-8"))) > {"trial", "model", "version of subzero"}


def test_the_papers_schemes_have_none(tmp_path):
    with pytest.raises(subzero.UserError, match="only 'moving_end' has checkpoints"):
        subzero.simulate(changed("fig6", scheme="paper_tangent"), checkpoint=Checkpoint(folder=tmp_path))


def test_a_disk_that_is_full_is_told_and_what_was_kept_stays(tmp_path, monkeypatch):
    trial, checkpoint, real, left = changed("fig6"), Checkpoint(folder=tmp_path, minutes=0.0), os.fsync, [9]

    def fsync(handle):
        left[0] -= 1
        if left[0] == 0:
            raise OSError(28, "No space left on device")
        real(handle)

    monkeypatch.setattr("os.fsync", fsync)
    with pytest.raises(
        subzero.UserError, match=r"cannot be written: No space left on device\. What it has is kept"
    ):
        subzero.simulate(trial, checkpoint=checkpoint)
    xr.testing.assert_identical(subzero.simulate(trial, checkpoint=checkpoint), subzero.simulate(trial))


def killed_and_resumed(folder, kills, longest, duration=900):
    """Run a command that is killed so many times, up to `longest` seconds after its start; return its run."""
    text = (
        scenarios.path("fig6")
        .read_text(encoding="utf-8")
        .replace("duration_s = 30.0", f"duration_s = {duration}")
    )
    (folder / "mine.toml").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "subzero", "simulate", "mine.toml", "--every", "10", "--checkpoint", "0"]
    rng, found = np.random.default_rng(5), 0
    for _ in range(kills):
        process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        started, wait = time.monotonic(), rng.uniform(0.0, longest)
        while time.monotonic() - started < 60.0 and not list(folder.glob(f"mine/checkpoint/**/{STATE}")):
            time.sleep(0.01)
        time.sleep(wait)
        process.send_signal(signal.SIGKILL)
        process.communicate()
        found += bool(list(folder.glob(f"mine/checkpoint/**/{STATE}")))
    assert found > 0, "killed before anything was kept, each time"
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == FINE, done.stderr
    assert "Going on from t = " in done.stderr or (folder / "mine" / "tethered.nc").exists()
    assert not (folder / "mine" / "checkpoint").exists()
    return folder / "mine" / "tethered.nc"


def same_files(path, folder):
    """Hold a run's file against that of the same command in one piece."""
    assert (
        main(["simulate", str(folder / "mine.toml"), "--every", "10", "--out", str(folder / "whole")]) == FINE
    )
    with xr.open_dataset(path) as run, xr.open_dataset(folder / "whole" / "tethered.nc") as plain:
        xr.testing.assert_identical(run.load(), plain.load())


@pytest.mark.slow
def test_a_command_that_is_killed_goes_on(tmp_path):
    same_files(killed_and_resumed(tmp_path, 1, 0.2, duration=120), tmp_path)


@pytest.mark.slow
def test_a_command_that_is_killed_twenty_times_goes_on(tmp_path):
    same_files(killed_and_resumed(tmp_path, 20, 0.3), tmp_path)


@pytest.mark.parametrize("minutes", ["-1", "nan", "x"])
def test_what_is_no_time_is_refused(minutes, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "fig6", "--checkpoint", minutes]) == MISTAKE
    assert not list(tmp_path.iterdir())
