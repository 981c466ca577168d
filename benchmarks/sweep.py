"""Sweeps: what they cost beside a bare loop, how well they share cores, how much memory they take, what kills leave.

    python -m benchmarks.sweep                      # speed: ratios in one run, medians of --repeats
    python -m benchmarks.sweep --dask               # … and on a Dask cluster of two workers on this machine
    python -m benchmarks.sweep --idle               # which share of their time workers are at members (any machine)
    python -m benchmarks.sweep --memory             # peak memory at 1 000 and 20 000 short members
    python -m benchmarks.sweep --kills 50           # a sweep of 5 000 that is killed at random places, and goes on
    python -m benchmarks.sweep --stores             # what a store costs: SQLite, npz, netCDF, Parquet, zarr
    python -m benchmarks.sweep --command            # the command that runs 200 members and draws them, as often
    python -m benchmarks.sweep --member             # bytes and time of a member on its way: sent, run, kept, read

A bare loop gives each member its numbers, simulates it and keeps the same outcomes; two bare loops at a time are what
two cores of this machine can do at most (two threads of one core do not do twice as much). Compiled beforehand.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

SHORT = {"run.duration_s": 0.5, "run.rtol": 0.0}
"""A member of a few milliseconds, for sweeps of many."""
GRID = {
    "start.wet_length_m": {"from": 0.0, "to": 38.0, "count": 20},
    "water.current_east_m_s": {"from": 0.0, "to": 0.09, "count": 10},
}
"""The 200 runs of ``scenarios/sweeps/cable_and_current.toml``."""


def plan(members, changes=None):
    """Return a sweep of fig6 over cable length and current, of so many members."""
    from subzero.sweeps.design import Design
    from subzero.sweeps.plan import plan_sweep

    spreads = {name: {"from": one["from"], "to": one["to"]} for name, one in GRID.items()}
    design = Design(kind="latin_hypercube", samples=members)
    return plan_sweep("fig6", spreads, design=design, changes=changes)


def bare_loop(members, changes=None, share=(0, 1)):
    """Return how long a loop over a share of the members takes, compiled beforehand, and start at a given moment."""
    one = plan(members, changes)
    one.job.run(0, one.points.values[0])
    print("ready", flush=True)
    sys.stdin.readline()
    started = time.perf_counter()
    for index in range(share[0], members, share[1]):
        one.job.run(index, one.points.values[index])
    return time.perf_counter() - started


def bare_loops(members, at_a_time):
    """Return how long so many processes take with all members, from when all of them are ready."""
    code = "from benchmarks.sweep import bare_loop; print(bare_loop({}, share=({}, {})))"
    asked = [[sys.executable, "-c", code.format(members, k, at_a_time)] for k in range(at_a_time)]
    loops = [
        subprocess.Popen(one, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=one_thread())
        for one in asked
    ]
    for loop in loops:
        assert loop.stdout.readline().strip() == "ready"
    for loop in loops:
        loop.stdin.write("\n")
        loop.stdin.flush()
    return max(float(loop.communicate()[0]) for loop in loops)


def one_thread():
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
    return os.environ | dict.fromkeys(names, "1")


def timed(one, workers=None):
    """Return how long a sweep takes from its call to its end, with the start of its workers and their end [s]."""
    from subzero.sweeps.api import finished

    with tempfile.TemporaryDirectory() as folder:
        started = time.perf_counter()
        with finished(one, Path(folder), workers=workers):
            pass
        return time.perf_counter() - started


@contextmanager
def cluster():
    """Give a client of a Dask scheduler with two workers, three processes on the loopback address."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None) as local,
        Client(local) as client,
    ):
        yield client


def idle(members, repeats, dask):
    """Print the share of the workers' time that members do not take: what handing out, keeping and waiting cost.

    From the first batch of each worker to the last, so without their start. Both parts are of the same seconds, so it
    can be measured on a machine that others use. Two workers do not begin together: a member more or less is counted on
    the way, which can make their share a few per cent too small, and even negative.
    """
    one = plan(members)
    with ExitStack() as held:
        client = held.enter_context(cluster()) if dask else None
        asked = {"1 worker": (1, 1), "2 workers": (2, 2)} | ({"Dask, 2 workers": (2, client)} if dask else {})
        for name, (count, workers) in asked.items():
            shares = [_idle_share(one, count, workers) for _ in range(repeats)]
            print(
                f"{name:<18}{100 * statistics.median(shares):6.1f} %   ({', '.join(f'{100 * x:.1f}' for x in shares)})"
            )


def _idle_share(one, count, workers):
    from subzero.sweeps import api

    stamps, kept = [], []

    class Tally(api._Tally):
        def keep(self, members):
            stamps.append(time.perf_counter())
            kept.append(sum(member.seconds for member in members))
            super().keep(members)

    before, api._Tally = api._Tally, Tally
    try:
        with tempfile.TemporaryDirectory() as folder, api.finished(one, Path(folder), workers=workers):
            pass
    finally:
        api._Tally = before
    # the first batch of each worker is in before the clock starts
    return 1.0 - sum(kept[count:]) / (count * (stamps[-1] - stamps[count - 1]))


def speed(members, repeats, dask):
    """Print what a sweep costs, as ratios in one run."""
    one = plan(members)
    rows = []
    with ExitStack() as held:
        client = held.enter_context(cluster()) if dask else None
        for _ in range(repeats):
            row = {
                "bare loop": bare_loops(members, 1),
                "two bare loops": bare_loops(members, 2),
                "sweep, 1 worker": timed(one, workers=1),
                "sweep, 2 workers": timed(one, workers=2),
            }
            if client is not None:
                row["sweep, Dask"] = timed(one, workers=client)
            rows.append(row)
    middle = {name: statistics.median(row[name] for row in rows) for name in rows[0]}
    for name, seconds in middle.items():
        print(f"{name:<20}{seconds:8.2f} s{1e3 * seconds / members:8.2f} ms a member")

    def ratio(words, top, bottom, factor=1.0):
        found = [factor * row[top] / row[bottom] for row in rows]
        print(f"{words:<52}{statistics.median(found):7.3f}   ({min(found):.3f} to {max(found):.3f})")

    ratio("overhead: sweep, 1 worker / bare loop", "sweep, 1 worker", "bare loop")
    ratio("efficiency of the machine: bare / 2 (two bare)", "bare loop", "two bare loops", 0.5)
    ratio("efficiency of the sweep: 1 worker / 2 (2 workers)", "sweep, 1 worker", "sweep, 2 workers", 0.5)
    ratio("sweep, 2 workers / two bare loops", "sweep, 2 workers", "two bare loops")
    if dask:
        ratio("Dask / sweep, 2 workers", "sweep, Dask", "sweep, 2 workers")


def command_of_200():
    """Print how long the command takes that runs 200 members and draws them: by the clock, and of the processors."""
    import resource

    spec = Path(__file__).parents[1] / "scenarios/sweeps/cable_and_current.toml"
    with tempfile.TemporaryDirectory() as folder:
        started, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(
            [sys.executable, "-m", "subzero", "sweep", str(spec), "--out", f"{folder}/out"],
            check=True,
            capture_output=True,
        )
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        took = time.perf_counter() - started
    print(
        f"subzero sweep of 200 runs, all files: {took:.2f} s, {spent:.2f} s of processor; load {os.getloadavg()[0]:.1f}"
    )


def peak_memory(members):
    """Return the peak memory of a sweep of short members in a process of its own, and of its workers [MB]."""
    code = (
        "import resource, sys, subzero; from benchmarks.sweep import plan, SHORT, GRID;"
        "import tempfile; from pathlib import Path; from subzero.sweeps.api import finished;"
        "from subzero.files.atomic_output import open_output_folder;"
        "from subzero.cli.write_sweep import write_sweep;"
        "d = tempfile.mkdtemp(); one = plan({}, SHORT);\n"
        "with finished(one, Path(d), workers=2) as done, open_output_folder(Path(d)) as out:\n"
        "    write_sweep(one, done, out)\n"
        "peak = [resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)];"
        "print(*peak);"
        "import shutil; shutil.rmtree(d)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code.format(members)], capture_output=True, text=True, check=True
    )
    return [float(kb) / 1024.0 for kb in done.stdout.split()]


def memory():
    """Print the peak memory of sweeps of different sizes."""
    for members in (1000, 20000):
        started = time.perf_counter()
        own, workers = peak_memory(members)
        print(
            f"{members:>6} members: {own:6.0f} MB, a worker {workers:6.0f} MB   ({time.perf_counter() - started:.0f} s)"
        )


def stores(members=20000, batch=20):
    """Print what keeping members costs: a batch, all of them, in bytes, and to read them in their order."""
    from subzero.sweeps.member import Member

    rng = np.random.default_rng(0)

    def batches():
        for first in range(0, members, batch):
            yield [
                Member(
                    index=first + k, reason="", warnings=(), scalars=rng.standard_normal(4),
                    channels=rng.standard_normal((4, 61)).astype(np.float32), own={}, seconds=0.02,
                )
                for k in range(batch)
            ]  # fmt: skip

    print(f"{members} members, batches of {batch}, 4 scalars, 4 channels of 61 times")
    print(f"{'store':<10}{'ms a batch':>12}{'MB':>8}{'files':>8}{'s to read':>11}")
    for name, (write, read) in _stores().items():
        home = Path(tempfile.mkdtemp())
        started = time.perf_counter()
        write(home, batches())
        wrote = time.perf_counter() - started
        started = time.perf_counter()
        read(home)
        took = time.perf_counter() - started
        files = [path for path in home.rglob("*") if path.is_file()]
        size = sum(path.stat().st_size for path in files) / 1e6
        print(f"{name:<10}{1e3 * wrote * batch / members:>12.2f}{size:>8.1f}{len(files):>8}{took:>11.2f}")
        shutil.rmtree(home)


def member(count=200):
    """Print what a member costs on its way, in time of the processor and in bytes."""
    import pickle
    import resource
    from time import process_time

    import cloudpickle

    from subzero.sweeps.member import run_members
    from subzero.sweeps.store import FILE, opened

    one = plan(count)
    job, rows, indices = one.job, one.points.values, np.arange(count)
    made = run_members(job, indices[:1], rows[:1])  # loads what is compiled
    shape = len(job.outcomes.channels), job.outcomes.times.size
    print(
        f"{count} members of fig6, {len(job.outcomes.scalars)} scalars, {shape[0]} channels of {shape[1]} times"
    )

    def reported(what, call, number=None, per=count):
        started = process_time()
        result = call()
        size = "" if number is None else f"{number(result) / per:10.0f} bytes"
        print(f"{what:<34}{1e3 * (process_time() - started) / per:9.3f} ms{size}")
        return result

    reported(
        "a batch of one, sent",
        lambda: cloudpickle.dumps((run_members, (job, indices[:1], rows[:1]), {})),
        len,
        1,
    )
    sent = reported(
        "a batch of all, sent", lambda: cloudpickle.dumps((run_members, (job, indices, rows), {})), len
    )
    made = reported("run", lambda: run_members(job, indices, rows))
    back = reported("sent back", lambda: pickle.dumps(made, protocol=pickle.HIGHEST_PROTOCOL), len)
    reported("read by the parent", lambda: (pickle.loads(back), pickle.loads(sent)))
    with tempfile.TemporaryDirectory() as folder:
        with opened(Path(folder), one.manifest(), shape) as store:
            reported("kept, a member a transaction", lambda: [store.add([each]) for each in made])
        (Path(folder) / FILE).unlink()
        with opened(Path(folder), one.manifest(), shape) as store:
            reported("kept, all in one transaction", lambda: store.add(made))
            reported("read from the store", lambda: list(store.blocks()))
        print(f"{'in the store':<43}{(Path(folder) / FILE).stat().st_size / count:15.0f} bytes")
    print(f"{'a worker, at most':<43}{1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss:15.3g} bytes")


def _stores():
    """Return name → how to write batches to a folder, and how to read them."""
    import importlib.util

    table = {
        "SQLite": (_write_sqlite, _read_sqlite),
        "npz": (_write_npz, _read_npz),
        "netCDF": (_write_netcdf, _read_netcdf),
    }
    if importlib.util.find_spec("pyarrow"):
        table["Parquet"] = (_write_parquet, _read_parquet)
    if importlib.util.find_spec("zarr"):
        table["zarr"] = (_write_zarr, _read_zarr)
    return table


def _stacked(members):
    return (
        np.array([one.index for one in members]),
        np.array([one.scalars for one in members]),
        np.array([one.channels for one in members]),
    )


def _write_sqlite(home, batches):
    from subzero.sweeps.store import opened

    with opened(home, {"a": "b"}, (4, 61)) as store:
        for members in batches:
            store.add(members)


def _read_sqlite(home):
    from subzero.sweeps.store import opened

    with opened(home, {"a": "b"}, (4, 61)) as store:
        return sum(len(block) for block in store.blocks())


def _write_npz(home, batches):
    for i, members in enumerate(batches):
        index, scalars, channels = _stacked(members)
        np.savez(home / "half.npz", index=index, scalars=scalars, channels=channels)
        os.replace(home / "half.npz", home / f"{i}.npz")


def _read_npz(home):
    for path in home.glob("*.npz"):
        with np.load(path) as file:
            _ = file["index"], file["scalars"], file["channels"]


def _write_netcdf(home, batches):
    import netCDF4

    for i, members in enumerate(batches):
        index, scalars, channels = _stacked(members)
        with netCDF4.Dataset(home / "half.nc", "w") as file:
            for name, size in (("m", index.size), ("s", 4), ("c", 4), ("t", 61)):
                file.createDimension(name, size)
            file.createVariable("index", "i4", ("m",))[:] = index
            file.createVariable("scalars", "f8", ("m", "s"))[:] = scalars
            file.createVariable("channels", "f4", ("m", "c", "t"))[:] = channels
        os.replace(home / "half.nc", home / f"{i}.nc")


def _read_netcdf(home):
    import netCDF4

    for path in home.glob("*.nc"):
        with netCDF4.Dataset(path) as file:
            _ = file["index"][:], file["scalars"][:], file["channels"][:]


def _write_parquet(home, batches):
    import pyarrow as pa
    import pyarrow.parquet as pq

    for i, members in enumerate(batches):
        index, scalars, channels = _stacked(members)
        columns = {f"s{k}": scalars[:, k] for k in range(4)}
        columns["channels"] = pa.FixedSizeListArray.from_arrays(channels.ravel(), 4 * 61)
        pq.write_table(pa.table({"index": index, **columns}), home / "half.parquet")
        os.replace(home / "half.parquet", home / f"{i}.parquet")


def _read_parquet(home):
    import pyarrow.parquet as pq

    for path in home.glob("*.parquet"):
        pq.read_table(path)


def _write_zarr(home, batches):
    import zarr

    root = zarr.open_group(str(home / "z"), mode="w")
    scalars = root.create_array("scalars", shape=(20000, 4), chunks=(20, 4), dtype="f8")
    channels = root.create_array("channels", shape=(20000, 4, 61), chunks=(20, 4, 61), dtype="f4")
    for members in batches:
        index, some, shown = _stacked(members)
        scalars[index[0] : index[-1] + 1], channels[index[0] : index[-1] + 1] = some, shown


def _read_zarr(home):
    import zarr

    root = zarr.open_group(str(home / "z"), mode="r")
    return root["scalars"][:], root["channels"][:]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--members", type=int, default=200)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--dask", action="store_true")
    parser.add_argument("--idle", action="store_true")
    parser.add_argument("--memory", action="store_true")
    parser.add_argument("--stores", action="store_true")
    parser.add_argument("--member", action="store_true")
    parser.add_argument("--command", action="store_true")
    parser.add_argument("--kills", type=int, default=0)
    asked = parser.parse_args()
    if asked.memory:
        memory()
    elif asked.idle:
        idle(asked.members, asked.repeats, asked.dask)
    elif asked.stores:
        stores()
    elif asked.member:
        member()
    elif asked.command:
        for _ in range(asked.repeats):
            command_of_200()
    elif asked.kills:
        from benchmarks.sweep_kills import kills

        return 0 if kills(asked.kills, 5000) else 1
    else:
        command_of_200()
        speed(asked.members, asked.repeats, asked.dask)
    return 0


if __name__ == "__main__":
    sys.exit(main())
