"""A sweep gives each member what a run of its own would give, loses none, counts none twice, whoever runs it.

Verifies: `subzero.sweep` and its store against single runs, against itself in another order, and after accidents.
Configuration: two seconds of fig6 without refinement, executors that run in this process unless a process is what is
looked at. Tolerance: none; channels are float32.
"""

import json
import os
import random
import re
import signal
import sqlite3
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import suppress

import numpy as np
import pytest
import xarray as xr

import subzero
from scenarios.parameters import with_parameters
from subzero.cli.app import main
from subzero.cli.sweep import _in_words
from subzero.results.summary import summarise
from subzero.sweeps import Design, Kept
from subzero.sweeps.api import finished
from subzero.sweeps.design import points_of
from subzero.sweeps.member import OtherVersionError, run_members
from subzero.sweeps.page import page_of_sweep
from subzero.sweeps.plan import plan_sweep
from subzero.sweeps.result import MOST_DRAWN, Gathered, _drawn, write_result
from subzero.sweeps.schedule import MOST_DEATHS, Schedule
from subzero.sweeps.sensitivity import effects_of
from subzero.sweeps.workers import WorkerPool

SHORT = {"run.duration_s": 2.0, "run.rtol": 0.0}
LENGTHS = [0.0, 5.0, 10.0]


class Here(Executor):
    """Runs everything in this process, at once."""

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class Dying(Here):
    """Its workers die of some members every time, and of others once."""

    def __init__(self, always=(), once=()):
        self.always, self.once, self.ran = set(always), set(once), []

    def submit(self, fn, job, indices, rows):
        self.ran.append(list(indices))
        if struck := self.once & set(indices):
            self.once -= struck
        elif not self.always & set(indices):
            return super().submit(fn, job, indices, rows)
        future = Future()
        future.set_exception(BrokenExecutor("its process died of signal 9"))
        return future


def fast(members, function=None):
    """Return a plan whose members cost little."""
    return plan_sweep(
        "fig6", {"start.wet_length_m": np.linspace(0.0, 20.0, members).tolist()},
        changes={"run.duration_s": 0.2, "run.rtol": 0.0},
        kept=Kept(scalars=["speed_at_end_m_s"], channels=["heading"], every=0.1, function=function),
    )  # fmt: skip


def swept(parameters, changes=SHORT, **kept):
    """Return the dataset of a sweep of fig6 that runs in this process."""
    return subzero.sweep(plan_sweep("fig6", parameters, changes=changes, kept=Kept(**kept)), workers=Here())


def test_a_member_is_a_run_of_its_own():
    runs = swept(
        {"start.wet_length_m": LENGTHS},
        scalars=["peak_speed_m_s", "cable_tension.max"], channels=["surge_speed", "heading"], every=0.1,
        function=lambda run: {"early": run["surge_speed"].values[3]},
    )  # fmt: skip
    assert runs["failed"].values.tolist() == [0, 0, 0]
    assert runs["start.wet_length_m"].attrs["units"] == "m"
    assert runs["heading"].attrs["units"] == "degree"
    trial = with_parameters(subzero.load_scenario("fig6"), SHORT)
    for member, length in enumerate(LENGTHS):
        alone = subzero.simulate(with_parameters(trial, {"start.wet_length_m": length}))
        mine = runs.isel(member=member)
        assert float(mine["start.wet_length_m"]) == length
        assert float(mine["peak_speed_m_s"]) == summarise(alone)["peak_speed_m_s"]
        assert float(mine["cable_tension.max"]) == alone["cable_tension"].values.max()
        assert float(mine["early"]) == alone["surge_speed"].values[3]
        for channel in ("surge_speed", "heading"):
            np.testing.assert_allclose(mine[channel], alone[channel], rtol=1e-6, atol=1e-7)


def test_one_line_and_a_plan_give_the_same_members_and_neither_takes_what_is_not_its_own():
    lengths = {"start.wet_length_m": LENGTHS}
    plan = plan_sweep("fig6", lengths, changes=SHORT, tethered=False)
    one_line = subzero.sweep("fig6", lengths, changes=SHORT, tethered=False, workers=Here())
    assert one_line.identical(subzero.sweep(plan, workers=Here()))
    for reported, arguments, options in (
        ("Did you mean 'changes'?", ("fig6", lengths), {"change": SHORT}),
        ("no parameters are given", ("fig6",), {}),
        ("a plan has its parameters already", (plan, lengths), {}),
        ("a plan has its parameters already", (plan,), {"changes": SHORT}),
        ("both given", (plan,), {"workers": 2, "client": Here()}),
    ):
        with pytest.raises(subzero.UserError, match=re.escape(reported)):
            subzero.sweep(*arguments, **options)


def test_a_statistic_of_a_channel_is_that_of_its_samples():
    kinds = ("max", "min", "mean", "end", "range", "rms")
    scalars = [f"cable_force_forward.{kind}" for kind in kinds]
    runs = swept({"start.wet_length_m": [15.0]}, channels=[], scalars=scalars)
    trial = with_parameters(subzero.load_scenario("fig6"), {**SHORT, "start.wet_length_m": 15.0})
    force = subzero.simulate(trial)["cable_force_forward"].values
    assert force[-1] < force[0]  # the cable pulls back, and harder as the vehicle gets faster
    expected = (
        force.max(),
        force.min(),
        force.mean(),
        force[-1],
        np.ptp(force),
        np.sqrt(np.mean(force * force)),
    )
    for kind, value in zip(kinds, expected, strict=True):
        assert float(runs[f"cable_force_forward.{kind}"][0]) == pytest.approx(value, rel=1e-12)


def test_longer_cable_is_slower_and_pulls_more():
    runs = swept({"start.wet_length_m": LENGTHS}, channels=[])
    assert np.all(np.diff(runs["peak_speed_m_s"]) < 0.0)
    assert np.all(np.diff(runs["largest_cable_force_N"]) > 0.0)


@pytest.mark.slow
def test_a_cable_as_stiff_as_a_rod_cannot_be_bent_by_what_pulls_it_and_the_other_member_can():
    spread = {"cable.bending_stiffness": [0.0, 10.0]}
    changes = SHORT | {"run.duration_s": 3.0}
    runs = swept(spread, changes, channels=[])
    assert runs["failed"].values.tolist() == [0, 1]
    assert np.isfinite(runs["peak_speed_m_s"].values).tolist() == [True, False]
    assert "could not be solved" in runs["reason"].values[1]


def test_a_grid_gets_a_dimension_for_each_parameter():
    spreads = {"start.wet_length_m": [0.0, 5.0], "water.current_east_m_s": [0.0, 0.02, 0.04]}
    runs = swept(spreads, {"run.duration_s": 0.2, "run.rtol": 0.0})
    table = runs[["path_length_m"]].set_index(member=list(spreads)).unstack()
    assert table["path_length_m"].sizes == {"start.wet_length_m": 2, "water.current_east_m_s": 3}
    assert float(table["path_length_m"][1, 2]) == float(runs["path_length_m"][5])


def test_order_batches_and_accidents_do_not_change_a_byte_of_the_result(tmp_path):
    plan = fast(12)
    for name, executor in (("calm", Here()), ("struck", Dying(once={0, 3, 7}))):
        with finished(plan, tmp_path / name, workers=executor) as store:
            write_result(store, plan.job, plan.points, plan.attributes, tmp_path / name)
    order = list(range(12))
    random.Random(1).shuffle(order)
    with subzero_store(plan, tmp_path / "by hand") as store:
        for member in order:
            store.add(run_members(plan.job, [member], plan.points.values[[member]]))
        write_result(store, plan.job, plan.points, plan.attributes, tmp_path / "by hand")
    written = {name: (tmp_path / name / "sweep.nc").read_bytes() for name in ("calm", "struck", "by hand")}
    assert written["calm"] == written["struck"] == written["by hand"]


def subzero_store(plan, folder):
    from subzero.sweeps.store import opened

    return opened(folder, plan.manifest(), (len(plan.job.outcomes.channels), plan.job.outcomes.times.size))


def test_a_member_that_kills_its_worker_each_time_is_given_up_and_the_others_are_not(tmp_path):
    executor = Dying(always={4})
    with finished(fast(9), tmp_path, workers=executor) as store:
        assert store.finished(9).all()
        ((member, reason),) = store.reasons(10)
    assert member == 4
    assert reason.startswith(f"{MOST_DEATHS} workers died of it")
    assert [4] in executor.ran  # it was looked at alone, before it was given up


def test_a_member_that_fails_is_recorded_with_its_reason_and_the_sweep_goes_on():
    def function(run):
        if run["cable_length"].values[0] > 4.0:
            raise ValueError("too long for me")
        return 1.0

    runs = swept({"start.wet_length_m": LENGTHS}, function=function)
    assert runs["failed"].values.tolist() == [0, 1, 1]
    assert runs["reason"].values.tolist() == ["", *["ValueError: too long for me"] * 2]
    assert np.isnan(runs["peak_speed_m_s"].values).tolist() == [False, True, True]
    assert np.isnan(runs["heading"].values).all(axis=1).tolist() == [False, True, True]


def test_a_value_that_only_the_tail_of_a_distribution_has_fails_alone():
    plan = plan_sweep(
        "fig6", {"start.depth_m": {"normal": [0.31, 0.1]}}, design=Design(kind="monte_carlo", samples=5000),
        changes={"run.duration_s": 0.1, "run.rtol": 0.0}, tethered=False,
    )  # fmt: skip
    depth = plan.points.values[
        :, 0
    ]  # the plan is allowed: three deviations from the mean are below the surface
    above = int(np.argmin(depth))
    assert depth[above] < 0.0
    failed, fine = run_members(
        plan.job, [above, int(np.argmax(depth))], np.array([[depth.min()], [depth.max()]])
    )
    assert "outside its limits" in failed.reason
    assert fine.reason == ""


def test_threads_that_run_at_a_time_give_the_same_members(tmp_path):
    plan = fast(6)
    with ThreadPoolExecutor(2) as threads, finished(plan, tmp_path, workers=threads) as store:
        mine = [one for block in store.blocks() for one in block]
    for one in mine:
        (alone,) = run_members(plan.job, [one.index], plan.points.values[[one.index]])
        assert one.scalars.tobytes() == alone.scalars.tobytes()
        assert one.channels.tobytes() == alone.channels.tobytes()


def test_what_is_finished_is_not_run_again(tmp_path):
    plan = fast(6)
    with subzero_store(plan, tmp_path) as store:
        store.add(run_members(plan.job, [1, 4], plan.points.values[[1, 4]]))
    executor = Dying()
    with finished(plan, tmp_path, workers=executor) as store:
        assert store.finished(6).all()
    assert sorted(member for ran in executor.ran for member in ran) == [0, 2, 3, 5]


def test_a_member_that_comes_twice_is_counted_once(tmp_path):
    plan = fast(3)
    with subzero_store(plan, tmp_path) as store:
        for _ in range(2):
            store.add(run_members(plan.job, [0, 1], plan.points.values[:2]))
        assert [one.index for block in store.blocks() for one in block] == [0, 1]


OTHER = {
    "trial": {"changes": {"run.duration_s": 0.3, "run.rtol": 0.0}},
    "points": {"parameters": {"start.wet_length_m": [0.0, 1.0, 3.0]}},
    "parameters": {"parameters": {"start.depth_m": [0.0, 1.0, 2.0]}},
    "outcomes": {"kept": Kept(function=lambda run: 2.0)},
    "tethered": {"tethered": False},
}


@pytest.mark.parametrize("what", OTHER)
def test_another_sweep_does_not_mix_with_what_is_there(what, tmp_path):
    asked = {
        "parameters": {"start.wet_length_m": [0.0, 1.0, 2.0]},
        "changes": {"run.duration_s": 0.2, "run.rtol": 0.0},
        "kept": Kept(function=lambda run: 1.0),
    }
    with subzero_store(plan_sweep("fig6", **asked), tmp_path):
        pass
    with subzero_store(plan_sweep("fig6", **asked), tmp_path):
        pass  # the same goes on
    with (
        pytest.raises(subzero.UserError, match=rf"another sweep: its .*{what}"),
        subzero_store(plan_sweep("fig6", **(asked | OTHER[what])), tmp_path),
    ):
        pass


def test_another_version_of_the_code_is_refused_by_the_store_and_by_workers(tmp_path, monkeypatch):
    plan = fast(2)
    with subzero_store(plan, tmp_path):
        pass
    monkeypatch.setattr("subzero.sweeps.plan.code_digest", lambda: "another")
    other = fast(2)
    with pytest.raises(subzero.UserError, match="version of subzero"), subzero_store(other, tmp_path):
        pass
    with pytest.raises(OtherVersionError):
        run_members(other.job, [0], other.points.values[:1])


def test_two_commands_do_not_run_the_same_sweep_at_a_time(tmp_path):
    plan = fast(2)
    with (
        subzero_store(plan, tmp_path),
        pytest.raises(subzero.UserError, match="another command is running"),
        subzero_store(plan, tmp_path),
    ):
        pass


def test_a_full_disk_is_told_and_what_was_kept_before_is_still_there(tmp_path):
    plan = fast(4)
    members = run_members(plan.job, range(4), plan.points.values)
    with subzero_store(plan, tmp_path) as store:
        store.add(members[:1])
        pages = store._file.execute("PRAGMA page_count").fetchone()[0]
        store._file.execute(f"PRAGMA max_page_count = {pages}")
        with pytest.raises(subzero.UserError, match=r"full\. What it has is kept: make room"):
            store.add([_longer(one) for one in members[1:]])
        assert store.finished(4)[0]
    with finished(plan, tmp_path, workers=Here()) as store:
        assert store.finished(4).all()
        assert store.failures() == 0


def _longer(member):
    import dataclasses

    return dataclasses.replace(member, reason="x" * 100_000)


def test_effects_of_a_linear_outcome_are_those_of_algebra():
    """An outcome 3 x1 + x2 on x in [0, 2] x [0, 4]: elementary effects 6 and 4, no deviation; variances 36 to 16."""
    trial = subzero.load_scenario("fig6")
    spreads = {"start.wet_length_m": {"from": 0.0, "to": 2.0}, "start.depth_m": {"from": 0.0, "to": 4.0}}
    sizes = {}
    for design, samples in (("morris", 8), ("saltelli", 1024), ("sobol", 1024)):
        points = points_of(trial, spreads, Design(kind=design, samples=samples, seed=2))
        y = points.values @ np.array([3.0, 1.0])
        found = Gathered(
            names=("y",),
            scalars=y[:, None],
            channels=np.zeros((1, 0, 0)),
            failed=np.zeros(y.size, dtype=bool),
        )
        effects = effects_of(points, found)
        assert [one.parameter for one in effects] == list(spreads)  # the greatest first
        sizes[design] = [one.size for one in effects]
        others = [one.other for one in effects]
        if design == "morris":
            assert others == pytest.approx([0.0, 0.0], abs=1e-9)
        elif design == "saltelli":
            assert others == pytest.approx([36.0 / 52.0, 16.0 / 52.0], abs=0.02)
    assert sizes["morris"] == pytest.approx([6.0, 4.0], rel=1e-9)
    assert sizes["saltelli"] == pytest.approx([36.0 / 52.0, 16.0 / 52.0], abs=0.02)
    assert sizes["sobol"][0] > sizes["sobol"][1] > 0.0


@pytest.mark.long
def test_a_pool_goes_on_after_a_process_that_is_killed():
    pool = WorkerPool(2)
    try:
        pids = {future.result() for future in [pool.submit(os.getpid) for _ in range(20)]}
        assert os.getpid() not in pids
        with pytest.raises(BrokenExecutor):
            pool.submit(_end_yourself).result()
        assert [future.result() for future in [pool.submit(abs, -k) for k in range(10)]] == list(range(10))
    finally:
        pool.shutdown(cancel_futures=True)


@pytest.mark.long
def test_processes_that_never_begin_are_an_error(monkeypatch):
    monkeypatch.setattr("subzero.sweeps.workers._begin", _end_yourself)
    pool = WorkerPool(1)
    with pytest.raises(subzero.UserError, match="No worker process could be started"):  # noqa: PT012
        for _ in range(9):
            with suppress(BrokenExecutor):
                pool.submit(abs, -1).result()


SCRIPT = """
import subzero
from subzero.sweeps.workers import WorkerPool
print("begun", flush=True)

def twice(x):
    return 2 * x

pool = WorkerPool(2)
print(pool.submit(twice, 21).result())
pool.shutdown()
"""


@pytest.mark.long
def test_a_script_without_a_guard_is_run_once_and_its_functions_go_to_workers(tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout == "begun\n42\n"


def test_members_under_way_when_a_worker_dies_run_again_alone(tmp_path):
    executor = Dying(always={4})
    with finished(fast(9), tmp_path, workers=executor):
        deaths = [k for k, ran in enumerate(executor.ran) if ran == [4]]
    assert len(deaths) >= MOST_DEATHS - 1


@pytest.mark.long
def test_a_worker_labels_nothing_and_so_starts_a_second_sooner():
    plan, pool = fast(2), WorkerPool(1)
    try:
        members = pool.submit(run_members, plan.job, [0, 1], plan.points.values).result()
        loaded = pool.submit(eval, "set(__import__('sys').modules)").result()
    finally:
        pool.shutdown(cancel_futures=True)
    assert [one.reason for one in members] == ["", ""]
    assert "subzero.results.dataset" in loaded
    assert not loaded & {"xarray", "pandas", "dask", "matplotlib", "netCDF4", "scipy.stats"}


def _end_yourself():
    os.kill(os.getpid(), signal.SIGKILL)


SPEC = """
trial = "fig6"
design = "latin_hypercube"
samples = 6
[parameters]
"start.wet_length_m" = { from = 0.0, to = 20.0 }
cable.diameter = "declared"
[changes]
run.duration_s = 1.0
run.rtol = 0.0
[outcomes]
scalars = ["peak_speed_m_s"]
channels = ["heading"]
"""


@pytest.mark.long
def test_the_command_writes_everything_and_goes_on_where_it_was(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(SPEC, encoding="utf-8")
    assert main(["sweep", "mine.toml", "--workers", "1"]) == 0
    here = tmp_path / "mine"
    made = {
        "sweep.nc",
        "members.csv",
        "members.sqlite",
        "summary.json",
        "report.html",
        "bands.png",
        "histograms.png",
        "against.png",
    }
    assert made <= {path.name for path in here.iterdir()}
    summary = json.loads((here / "summary.json").read_text(encoding="utf-8"))
    assert (summary["members"], summary["failed"]) == (6, 0)
    with xr.open_dataset(here / "sweep.nc") as runs:
        assert summary["scalars"]["peak_speed_m_s"]["max"] == float(runs["peak_speed_m_s"].max())
    page = (here / "report.html").read_text(encoding="utf-8")
    assert f"<td>{summary['scalars']['peak_speed_m_s']['max']:.4g}</td>" in page
    assert "cable.diameter = &#34;declared&#34;" in page, "the file, as it was read"
    assert "subzero sweep mine.toml --workers 1" in page
    before = (here / "sweep.nc").read_bytes()
    with sqlite3.connect(here / "members.sqlite") as file:
        file.execute("DELETE FROM members WHERE member IN (0, 5)")
    file.close()
    assert main(["sweep", "mine.toml", "--workers", "1"]) == 0
    assert (here / "sweep.nc").read_bytes() == before
    assert "peak_speed_m_s" in capsys.readouterr().out


def test_the_page_tells_what_failed_and_what_matters_and_shows_texts_of_users_as_text():
    plan = plan_sweep(
        "fig6", {"start.wet_length_m": [0.0, 20.0], "cable.diameter": "declared"},
        design=Design(kind="monte_carlo", samples=8), description="<script>alert(1)</script> $x$",
    )  # fmt: skip
    row = dict.fromkeys(("min", "p5", "p50", "p95", "max", "mean", "standard_deviation"), 1.25)
    effect = {
        "scalar": "heading.end",
        "parameter": "cable.diameter",
        "size": -0.75,
        "other": None,
        "error": None,
    }
    summary = {
        "scenario": "fig6", "title": plan.description, "subzero_version": "1", "members": 8, "failed": 2,
        "design": {"name": "monte_carlo", "samples": 8, "seed": 3},
        "parameters": {"cable.diameter": {"unit": "m", "from": 0.001, "to": 0.002}},
        "reasons": {"4": "the <b>cable</b> broke at 3 s"}, "warnings": {"tow_force": 2},
        "scalars": {"heading.end": {"unit": "degree", **row}},
        "sensitivity": {"method": "", "effects": [effect]},
    }  # fmt: skip
    page = page_of_sweep(plan, summary, {}, "subzero sweep mine.toml")
    assert "6 of 8 members completed" in page
    assert '<th scope="row">member 4</th><td>the &lt;b&gt;cable&lt;/b&gt; broke at 3 s</td>' in page
    assert "1 more stand in members.csv." in page
    assert "End of heading: cable.diameter (correlation -0.75)." in page
    assert "End of heading: 1.25 degree in the middle" in page
    assert "2 of 8 members&#39; runs warn of tow force." in page
    assert "<script" not in page


@pytest.mark.parametrize(
    ("line", "instead", "said"),
    [
        ('trial = "fig6"', 'trial = "fig7"', "there is no such scenario"),
        ('trial = "fig6"', 'trail = "fig6"', "Did you mean 'trial'?"),
        ('"start.wet_length_m"', '"start.wet_lenght_m"', "Did you mean 'start.wet_length_m'?"),
        ("samples = 6", "", "needs samples"),
        ('["peak_speed_m_s"]', '["peak_speed"]', "Did you mean"),
        ('channels = ["heading"]', 'channels = ["headin"]', "Did you mean 'heading'?"),
        ("run.rtol = 0.0", "run.rtol = 2.0", "outside its limits"),
    ],
)
def test_a_file_with_a_mistake_is_answered_with_what_to_do(line, instead, said, tmp_path, capsys):
    (tmp_path / "mine.toml").write_text(SPEC.replace(line, instead), encoding="utf-8")
    assert main(["sweep", str(tmp_path / "mine.toml"), "--out", str(tmp_path / "out")]) == 2
    reported = capsys.readouterr().err
    assert said in reported
    assert "mine.toml" in reported
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [(["mine.toml", "--workers", "0"], "workers is 0"), (["none.toml"], "The sweep none.toml")],
)
def test_a_mistake_on_the_command_line_leaves_no_folder(words, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(SPEC, encoding="utf-8")
    assert main(["sweep", *words]) == 2
    assert said in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


@pytest.mark.slow
def test_two_dask_workers_give_the_same_bytes_as_processes_here(tmp_path):
    from distributed import Client, LocalCluster

    plan = fast(200)
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None) as cluster,
        Client(cluster) as client,
        finished(plan, tmp_path / "dask", workers=client) as store,
    ):
        write_result(store, plan.job, plan.points, plan.attributes, tmp_path / "dask")
    with finished(plan, tmp_path / "here", workers=2) as store:
        write_result(store, plan.job, plan.points, plan.attributes, tmp_path / "here")
    assert (tmp_path / "dask/sweep.nc").read_bytes() == (tmp_path / "here/sweep.nc").read_bytes()


@pytest.mark.slow
def test_a_sweep_that_is_killed_time_after_time_loses_nothing():
    from benchmarks.sweep_kills import kills

    assert kills(8, 600, seed=5)


@pytest.mark.parametrize("columns", [2, 3, 10])
def test_the_members_of_a_large_grid_that_bands_are_drawn_from_have_all_its_values_alike(columns):
    """Binomial: within five standard deviations. Every second member of a grid of two columns is of one of them."""
    drawn = np.flatnonzero(_drawn(2 * MOST_DRAWN))
    assert drawn.size == MOST_DRAWN
    counts = np.bincount(drawn % columns, minlength=columns)
    share = 1.0 / columns
    assert np.abs(counts - share * MOST_DRAWN).max() < 5.0 * np.sqrt(MOST_DRAWN * share * (1.0 - share))


def test_batches_get_as_long_as_they_should_and_shrink_towards_the_end():
    plan = fast(2)
    taken = []
    schedule = Schedule(plan.job, np.zeros((400, 1)), np.arange(400), 2, taken.append)
    schedule._seconds = 0.05
    sizes = []
    while (batch := schedule._batch()) is not None:
        sizes.append(batch.members.size)
    assert sum(sizes) == 400
    assert max(sizes) == 10  # half a second
    assert sizes[-1] == 1
    assert sizes == sorted(sizes, reverse=True)


PARENT = """
import os, time
from subzero.sweeps.workers import WorkerPool

def work():
    print(os.getpid(), flush=True)  # a worker prints on standard error
    time.sleep(600.0)

pool = WorkerPool(2)
[pool.submit(work) for _ in range(2)][0].result()
"""


def test_a_worker_that_is_at_a_task_ends_with_its_parent():
    """It went on with its task for as long as that took."""
    with subprocess.Popen([sys.executable, "-c", PARENT], stderr=subprocess.PIPE) as parent:
        for _ in range(2):
            parent.stderr.readline()
        parent.kill()
        assert (
            b"Traceback" not in parent.stderr.read()
        )  # ends when the last process that has the pipe has ended


def lingering(run):
    """A number of one's own that takes a second for the longest cable."""
    time.sleep(1.0 if float(run["cable_length"][0]) > 9.0 else 0.0)
    return 0.0


def test_a_member_that_takes_much_longer_than_the_others_is_named_with_its_time():
    seen = []
    subzero.sweep(
        "fig6", {"start.wet_length_m": [5.0]}, changes=SHORT, workers=Here()
    )  # what is imported and compiled for the first member counts for none
    subzero.sweep("fig6", {"start.wet_length_m": LENGTHS}, changes=SHORT, kept=Kept(function=lingering),
                  workers=Here(), progress=seen.append)  # fmt: skip
    member, seconds = seen[-1].slowest
    assert member == LENGTHS.index(10.0)
    assert 1.0 < seconds < 10.0
    assert re.search(r"/s, .* left, member 2 alone took 1 s", _in_words(seen[-1]))
    assert seen[0].slowest == (-1, 0.0)


@pytest.mark.long
def test_each_member_keeps_which_share_of_its_work_finer_runs_took():
    """A cross current on a cable that leaves its drum slack is ill-posed: its refinement ends with the budget."""
    for asked, refined in ((0.0, False), (0.02, True)):
        runs = subzero.sweep("fig6", {"water.current_east_m_s": [0.1]}, workers=Here(),
                             changes={"run.duration_s": 3.0, "run.rtol": asked})  # fmt: skip
        (share,) = runs["refinement_share"].values
        assert (0.3 < share < 1.0) if refined else share == 0.0
