"""Sweeps: the same numbers as runs one by one, whatever runs them; nothing lost, nothing twice, nothing mixed.

Verifies: a member is `subzero.simulate` of its trial, to the last bit of what is kept; workers, executor and an end in
between change nothing; a run that fails is a member with a reason. Configuration: `fig6` for half a second or two.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import subzero
from scenarios.parameters import with_parameters
from subzero.summary import summarise

SHORT = {"run.duration_s": 0.5, "run.rtol": 0.0}
LENGTHS = [0.0, 15.0, 30.0]
SPEC = """
trial = "fig6"
design = "sobol"
samples = 64
[parameters]
"start.wet_length_m" = { from = 0.0, to = 30.0 }
[changes]
"run.duration_s" = 0.5
"run.rtol" = 0.0
[outcomes]
scalars = ["peak_speed_m_s"]
channels = ["surge_speed"]
every_s = 0.1
"""


def numbers(runs):
    return {name: one.values.tobytes() for name, one in runs.data_vars.items() if one.dtype.kind == "f"}


@pytest.fixture(scope="module")
def runs():
    return subzero.sweep("fig6", {"start.wet_length_m": LENGTHS}, changes=SHORT, workers=1)


def test_a_member_is_a_simulation_of_its_trial(runs):
    trial = with_parameters(subzero.load_scenario("fig6"), {**SHORT, "start.wet_length_m": 15.0})
    run = subzero.simulate(trial)
    assert runs["peak_speed_m_s"].values[1] == summarise(run)["peak_speed_m_s"]
    assert np.float32(run["cable_tension"].values[-1]) == runs["cable_tension"].values[1, -1]


def test_longer_cable_is_slower_and_pulls_more(runs):
    assert np.all(np.diff(runs["peak_speed_m_s"]) < 0.0)
    assert np.all(np.diff(runs["largest_cable_force_N"]) > 0.0)


def test_whatever_runs_them_members_are_the_same(runs):
    with ThreadPoolExecutor(2) as threads:
        others = subzero.sweep("fig6", {"start.wet_length_m": LENGTHS}, changes=SHORT, client=threads)
    assert numbers(others) == numbers(runs)


def test_random_points_are_those_of_their_seed_and_within_their_bounds():
    def points(seed):
        spread = {"start.wet_length_m": {"from": 5.0, "to": 9.0}}
        with ThreadPoolExecutor(1) as one:
            runs = subzero.sweep("fig6", spread, design="latin_hypercube", samples=4, seed=seed, changes=SHORT,
                                 channels=[], client=one)  # fmt: skip
        return runs["start.wet_length_m"].values

    first, again, other = points(1), points(1), points(2)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    # a Latin hypercube has one point in each quarter
    assert sorted(np.floor(first - 5.0).astype(int)) == [0, 1, 2, 3]


def test_a_run_that_cannot_be_is_a_member_with_a_reason():
    """A cable as stiff as a rod cannot be bent by what pulls it; the other member is not touched by that."""
    with ThreadPoolExecutor(1) as one:
        runs = subzero.sweep(
            "fig6",
            {"cable.bending_stiffness": [0.0, 10.0]},
            changes={**SHORT, "run.duration_s": 3.0},
            channels=[],
            client=one,
        )
    assert runs["failed"].values.tolist() == [0, 1]
    assert np.isfinite(runs["peak_speed_m_s"].values[0])
    assert np.isnan(runs["peak_speed_m_s"].values[1])
    assert "could not be solved" in runs["reason"].values[1]


@pytest.mark.parametrize(
    "parameters, words",
    [
        ({"start.wet_lenght_m": [1.0]}, "start.wet_length_m"),
        ({"cable.diameter": [-1.0]}, "cable.diameter"),
        ({"start.wet_length_m": []}, "start.wet_length_m"),
        ({"start.wet_length_m": {"from": 3.0}}, "to"),
    ],
)
def test_what_cannot_be_swept_is_refused_before_anything_runs(parameters, words):
    with pytest.raises(subzero.UserError, match=words):
        subzero.sweep("fig6", parameters)


def test_a_folder_with_another_sweep_is_refused(tmp_path):
    with ThreadPoolExecutor(1) as one:
        subzero.sweep("fig6", {"start.wet_length_m": [1.0]}, changes=SHORT, out=tmp_path, client=one)
        with pytest.raises(subzero.UserError, match=r"another sweep|differ"):
            subzero.sweep("fig6", {"start.wet_length_m": [2.0]}, changes=SHORT, out=tmp_path, client=one)


@pytest.mark.slow
def test_a_sweep_that_is_killed_goes_on_and_has_the_same_result(tmp_path):
    """SIGKILL of the command, at random moments; what it has finished is kept, none of it is run twice."""
    spec, rng = tmp_path / "spec.toml", np.random.default_rng(3)
    spec.write_text(SPEC)
    whole = [sys.executable, "-m", "subzero", "sweep", str(spec), "--out"]
    subprocess.run([*whole, "whole"], cwd=tmp_path, check=True, capture_output=True)
    for _ in range(5):
        command = subprocess.Popen(
            [*whole, "killed"], cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        time.sleep(float(rng.uniform(0.5, 3.0)))
        if command.poll() is None:
            os.kill(command.pid, signal.SIGKILL)
        command.wait()
    subprocess.run([*whole, "killed"], cwd=tmp_path, check=True, capture_output=True)
    both = [(tmp_path / name / "members.csv").read_bytes() for name in ("whole", "killed")]
    assert both[0] == both[1]


@pytest.mark.slow
def test_a_cluster_of_two_workers_gives_the_same_members(runs):
    distributed = pytest.importorskip("distributed", reason="needs pip install 'subzero[cluster]'")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        others = subzero.sweep("fig6", {"start.wet_length_m": LENGTHS}, changes=SHORT, client=client)
    assert numbers(others) == numbers(runs)
