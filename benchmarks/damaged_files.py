"""Damage files and read them again: ``python -m benchmarks.damaged_files [--count 20000] [--seed 1]``.

Files of a run (netCDF), a sweep (TOML and its store) and a checkpoint are damaged at random: flipped bits, cuts, runs
of other bytes, exchanged blocks, numbers of their heads that claim the largest there is. Each is read as a command
would, in processes that are watched. What may come out: the same numbers as before, or one `UserError`. A traceback,
a read that takes longer than `PATIENCE_S`, the death of a process, and other numbers are faults; the first of each is
printed. A sweep's TOML is its user's own text: any that can be read is right. "old netCDF" (asked for with --kinds) are
runs without a digest, of other programs and older versions: there, other numbers cannot be told from the right ones.
"""

from __future__ import annotations

import argparse
import multiprocessing as mp
import shutil
import sys
import tempfile
import traceback
from collections import Counter
from pathlib import Path

import numpy as np

PATIENCE_S = 60.0
CLAIMS = (10**11, 2**31 - 1, 2**63 - 1, 2**64 - 1, 0)
TOML = """trial = "fig6"
design = "sobol"
samples = 8
seed = 1
description = "damaged"
[parameters]
"start.wet_length_m" = { from = 0.0, to = 4.0, count = 2 }
"cable.diameter" = [0.0025, 0.003]
"water.current_north_m_s" = { normal = [0.05, 0.001] }
[changes]
"run.duration_s" = 0.5
"run.rtol" = 0.0
[outcomes]
scalars = ["peak_speed_m_s", "cable_tension.max"]
channels = ["surge_speed"]
every_s = 0.1
"""


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """Return bytes that are damaged in one of five ways."""
    made, at = bytearray(data), int(rng.integers(len(data)))
    long = int(2 ** rng.uniform(0.0, min(10.0, np.log2(len(data) / 8))))
    kind = rng.integers(6)
    if kind == 0:
        for where in rng.integers(len(data), size=int(rng.integers(1, 9))):
            made[where] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        del made[at:]
    elif kind == 2:
        made[at : at + long] = rng.bytes(long) if rng.integers(2) else bytes([rng.choice([0, 255])]) * long
    elif kind == 3:
        other = int(rng.integers(len(data)))
        first, second = made[at : at + long], made[other : other + long]
        made[at : at + long], made[other : other + long] = second, first
    elif kind == 4:  # a head that claims what it likes
        head = at % 512
        made[head : head + 8] = CLAIMS[int(rng.integers(len(CLAIMS)))].to_bytes(8, "little")
    else:
        del made[at : at + long]
    return bytes(made)


# Readers: (folder) → numbers that must be those of before.


def read_netcdf(folder: Path):
    import subzero

    run = subzero.open_run(folder / "run.nc")
    repr(run.subzero)
    return {name: run[name].values for name in run.variables} | {"attributes": dict(run.attrs)}


def read_toml(folder: Path):
    from subzero.sweeps.plan import read_plan

    read_plan(folder / "sweep.toml")


def read_store(folder: Path):
    from subzero.sweeps.plan import plan_sweep
    from subzero.sweeps.store import opened

    plan = store_plan(plan_sweep)
    with opened(folder, plan.manifest(), STORE_SHAPE) as store:
        done = store.finished(len(plan.points.values))
        store.failures(), store.reasons(3)
        kept = {member.index: member for block in store.blocks() for member in block}
    assert set(kept) == set(np.flatnonzero(done).tolist())
    rng = np.random.default_rng(5)
    for made in store_members(rng):
        if (found := kept.get(made.index)) is not None:
            assert (found.reason, found.warnings, found.own) == (made.reason, made.warnings, made.own)
            np.testing.assert_array_equal(found.scalars, made.scalars)
            np.testing.assert_array_equal(found.channels, made.channels)


def read_checkpoint(folder: Path):
    run = checkpointed(folder)
    return {name: run[name].values for name in run.variables}


STORE_SHAPE, MEMBERS = (2, 25), 60


def store_plan(plan_sweep):
    values = np.linspace(0.0, 40.0, MEMBERS).tolist()
    return plan_sweep("fig6", {"start.wet_length_m": values}, changes={"run.duration_s": 0.5})


def store_members(rng):
    from subzero.sweeps.member import Member

    for index in range(MEMBERS):
        reason, warned = ("it failed", ()) if index % 7 == 6 else ("", (("check", "message"),) * (index % 2))
        channels = np.full(STORE_SHAPE, np.nan) if reason else rng.normal(size=STORE_SHAPE)
        yield Member(
            index=index, reason=reason, warnings=warned, scalars=rng.normal(size=4),
            channels=channels.astype(np.float32), own={"own": float(index)}, seconds=0.5,
        )  # fmt: skip


def checkpointed(folder: Path):
    import subzero

    changes = {"run.duration_s": 1.0, "run.rtol": 0.0}
    trial = subzero.load_scenario("fig6").with_changes(changes)
    return subzero.simulate(trial, checkpoint=subzero.Checkpoint(folder=folder / "kept", minutes=0.0))


def make_good(folder: Path) -> None:
    """Write one good file of each kind."""
    import subzero
    from subzero.files.integrity import TAIL
    from subzero.results.netcdf_csv import write_netcdf
    from subzero.sweeps.plan import plan_sweep
    from subzero.sweeps.store import opened

    for name in KINDS:
        (folder / name).mkdir()
    run = subzero.simulate(subzero.load_scenario("fig6").with_changes({"run.duration_s": 3.0}))
    write_netcdf(run, folder / "netCDF" / "run.nc")
    data = (folder / "netCDF" / "run.nc").read_bytes()
    (folder / "old netCDF" / "run.nc").write_bytes(data[:-TAIL])
    (folder / "sweep TOML" / "sweep.toml").write_text(TOML, encoding="utf-8")
    with opened(folder / "sweep store", store_plan(plan_sweep).manifest(), STORE_SHAPE) as store:
        store.add(store_members(np.random.default_rng(5)))
    checkpointed(folder / "checkpoint")


KINDS = {
    "netCDF": (read_netcdf, "run.nc"),
    "old netCDF": (read_netcdf, "run.nc"),
    "sweep TOML": (read_toml, "sweep.toml"),
    "sweep store": (read_store, "*.sqlite"),
    "checkpoint": (read_checkpoint, "kept/tethered/*/*.npz"),
}
"""Kind → what reads it, and which of its files are damaged."""


def same(one, other) -> bool:
    """Say whether what was read is what was written."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[name], other[name]) for name in one)
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    return bool(one == other)


def answer(connection) -> None:
    """Read what is damaged, again and again, in a process of its own."""
    from subzero.errors import UserError

    good: dict[str, object] = {}
    while True:
        kind, clean, folder = connection.recv()
        read = KINDS[kind][0]
        if kind not in good:
            good[kind] = read(clean)
        try:
            found = read(folder)
            outcome = "read" if same(good[kind], found) else "OTHER NUMBERS"
        except UserError:
            outcome = "refused"
        except BaseException:
            outcome = "TRACEBACK\n" + traceback.format_exc()
        connection.send(outcome)


class Reader:
    """A process that reads, and is replaced when it dies or takes too long."""

    def __init__(self) -> None:
        self._begin()

    def _begin(self) -> None:
        self._ours, theirs = mp.get_context("spawn").Pipe()
        self._process = mp.get_context("spawn").Process(target=answer, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()

    def ask(self, *what) -> str:
        self._ours.send(what)
        try:
            if self._ours.poll(PATIENCE_S):
                return self._ours.recv()
            outcome = "HANG"
        except EOFError:
            outcome = "DEATH"
        self._process.kill()
        self._process.join()
        self._begin()
        return outcome


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--kinds", nargs="+", default=[kind for kind in KINDS if kind != "old netCDF"], choices=list(KINDS)
    )
    reported = parser.parse_args()
    counts = {kind: Counter() for kind in reported.kinds}
    shown: set[str] = set()
    with tempfile.TemporaryDirectory() as home:
        clean, spoilt = Path(home) / "clean", Path(home) / "spoilt"
        clean.mkdir()
        make_good(clean)
        reader = Reader()
        for number in range(reported.count):
            kind = reported.kinds[number % len(reported.kinds)]
            rng = np.random.default_rng([reported.seed, number])
            shutil.rmtree(spoilt, ignore_errors=True)
            shutil.copytree(clean / kind, spoilt)
            files = sorted(spoilt.glob(KINDS[kind][1]))
            path = files[int(rng.integers(len(files)))]
            path.write_bytes(damaged(path.read_bytes(), rng))
            outcome = reader.ask(kind, clean / kind, spoilt)
            head, _, rest = outcome.partition("\n")
            counts[kind][head] += 1
            last = rest.strip().rpartition("\n")[2]
            if head.isupper() and (kind, head, last) not in shown:
                shown.add((kind, head, last))
                print(f"{kind}, number {number}: {outcome}", flush=True)
    for kind, found in counts.items():
        words = ", ".join(f"{count} {outcome}" for outcome, count in sorted(found.items()))
        print(f"{kind}: {sum(found.values())} damaged; {words}")
    return any(outcome.isupper() for found in counts.values() for outcome in found)


if __name__ == "__main__":
    sys.exit(main())
