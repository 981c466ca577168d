"""A sweep that is killed at random moments and goes on: is anything lost, run twice, or different in the end?

    python -m benchmarks.sweep --kills 50           # a sweep of 5 000 short members, beside one that is left alone

What is struck is the command itself or one of its workers. Each member notes itself in a file when it begins, so that
what ran in all can be counted; each kill notes how many members the store has, once the command is dead. A kill counts
as one among running members if the command had kept some since it began, and had not kept all.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import closing, suppress
from pathlib import Path

import numpy as np

SPEC = """
trial = "fig6"
design = "monte_carlo"
samples = {members}
seed = 4
[parameters]
"start.wet_length_m" = {{ from = 0.0, to = 38.0 }}
"water.current_east_m_s" = {{ from = 0.0, to = 0.09 }}
[changes]
"run.duration_s" = 0.5
"run.rtol" = 0.0
[outcomes]
every_s = 0.1
"""
ANY_TIME, LONGEST_WAIT_S = 0.1, 0.5
"""Share of the kills that strike whenever they like, before there is a worker, too; the others wait until the command
has kept a member, and this long at most after that."""
SHARE_OF_PARENT = 0.7
"""Of the kills; the others strike a worker. [-]"""


def noted(log):
    """Let every worker of the sweeps of this process note each member that it begins; see `command`."""
    from subzero.sweeps import workers

    submit = workers.WorkerPool.submit

    def noting(fn):
        def run(job, indices, rows):
            handle = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
            members = []
            for k, index in enumerate(indices):
                os.write(handle, int(index).to_bytes(4, "little"))
                members += fn(job, [index], rows[k : k + 1])
            os.close(handle)
            return members

        return run

    def submitted(pool, fn, *args):
        return submit(pool, noting(fn) if fn.__name__ == "run_members" else fn, *args)

    workers.WorkerPool.submit = submitted


def command(spec, out, log):
    """Start the command, with members that note themselves."""
    code = f"from benchmarks.sweep_kills import noted; noted({str(log)!r}); from subzero.cli.app import main; main()"
    words = ["sweep", str(spec), "--out", str(out), "--workers", "2"]
    return subprocess.Popen(
        [sys.executable, "-c", code, *words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


class Tally:
    """What the kills have done so far."""

    def __init__(self, members: int) -> None:
        self.members = members
        self.parent = self.worker = self.running = 0
        self.again = 0
        self._done: set[int] = set()
        self._read = 0

    @property
    def kills(self) -> int:
        """How many there were."""
        return self.parent + self.worker

    def after(self, folder: Path, log: Path) -> int:
        """Look at what is kept and what has run, while nothing runs; return how many members the command has kept."""
        started = np.fromfile(log, dtype="<u4")[self._read :] if log.exists() else np.zeros(0)
        self.again += len(self._done.intersection(started.tolist()))
        self._read += started.size
        now = _kept(folder)
        assert now >= self._done, "a member is lost"
        gained, self._done = len(now - self._done), now
        return gained

    def anew(self) -> None:
        """Begin with another folder."""
        self._done = set()


def kills(count, members, seed=0):
    """Kill a sweep at random moments until there were kills enough; print and return whether all is as it must be."""
    rng, home, tally = random.Random(seed), Path(tempfile.mkdtemp()), Tally(members)
    spec, killed, log = home / "short.toml", home / "killed", home / "log"
    spec.write_text(SPEC.format(members=members))
    assert command(spec, home / "whole", home / "log of the whole").wait() == 0
    sweeps = 1
    while True:
        run = command(spec, killed, log)
        _strike(run, rng, killed, count, tally)
        if (code := run.wait()) > 0:
            raise RuntimeError(f"the sweep refuses to go on: exit code {code}. Were its sources changed?")
        gained = tally.after(killed, log)
        tally.running += code < 0 and gained > 0 and len(_kept(killed)) < members
        if code == 0 and tally.kills >= count:
            break
        if code == 0:  # it got through: begin anew, for the kills that are left
            shutil.rmtree(killed)
            tally.anew()
            sweeps += 1
    same = (home / "whole/sweep.nc").read_bytes() == (killed / "sweep.nc").read_bytes()
    ran = log.stat().st_size // 4
    _tell(tally, sweeps, ran, same)
    shutil.rmtree(home)
    return same and tally.again == 0


def _tell(tally, sweeps, ran, same):
    """Print what came of it."""
    more = ran - sweeps * tally.members
    print(
        f"{sweeps} sweeps of {tally.members} members: {tally.parent} kills of the command, {tally.worker} of a worker"
    )
    print(f"{tally.running} of the {tally.kills} struck while members ran")
    print(f"{tally.again} members ran again after they were kept")
    print(
        f"{ran} runs in all: {more} were under way when a kill struck ({more / max(tally.kills, 1):.1f} a kill)"
    )
    print(f"the same result to the last byte: {same}")


def _strike(run, rng, folder, count, tally):
    """Kill workers of a command, or it, at random moments, until it has ended or there were kills enough."""
    before = _size(folder)
    while tally.kills < count:
        if rng.random() > ANY_TIME:
            while run.poll() is None and _size(folder) <= before:
                time.sleep(0.005)
        time.sleep(rng.uniform(0.0, LONGEST_WAIT_S))
        if run.poll() is not None:
            return
        workers = _workers(run.pid)
        if rng.random() < SHARE_OF_PARENT or not workers:
            _kill(run.pid)
            tally.parent += 1
            return
        _kill(rng.choice(workers))
        tally.worker += 1
        tally.running += before < _size(folder)
        before = _size(folder)


def _size(folder):
    """Return how long the files of a store are, which is locked while its sweep runs. [bytes]"""
    found = 0
    for name in ("members.sqlite", "members.sqlite-wal"):
        with suppress(OSError):
            found += (folder / name).stat().st_size
    return found


def _workers(pid):
    """Return the processes that run members; another child tracks what they share."""
    import psutil

    with suppress(psutil.NoSuchProcess):
        children = psutil.Process(pid).children()
        return [child.pid for child in children if any("spawn_main" in word for word in child.cmdline())]
    return []


def _kill(pid):
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


def _kept(folder):
    """Return the numbers of the members that a store has."""
    import sqlite3

    if not (folder / "members.sqlite").exists():
        return set()
    with closing(sqlite3.connect(folder / "members.sqlite")) as file:
        try:
            return {number for (number,) in file.execute("SELECT member FROM members")}
        except sqlite3.OperationalError:  # killed before there was a table
            return set()
