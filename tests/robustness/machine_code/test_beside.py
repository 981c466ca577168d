"""A second process compiles along: same numbers whether it delivers, dies or is not there, and it outlives nobody."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import threading
import time

import numba
import psutil
import pytest

from subzero.jit import beside, compile_beside, machine_code
from subzero.jit.machine_code import home_of
from subzero.jit.sources import Tree

MODULE = "compiled_beside"
SOURCE = """
import os, time
from pathlib import Path
from subzero.jit import compiled

HERE = Path(__file__).parent
(HERE / "imported_by").write_text(str(os.getpid()))
if (HERE / "slow").exists():
    time.sleep(100.0)

@compiled
def scaled(x):
    return 3.0 * x + 0.5

@compiled
def shifted(x):
    return x - 2.0
"""
COMMAND = f"""
import time, numba, {MODULE}
from subzero.jit import beside, compile_beside
({MODULE}.HERE / "slow").touch()
beside.os.sched_getaffinity = lambda pid: {{0, 1}}
compile_beside(lambda: [({MODULE}.scaled, (numba.float64,))], list)
print(beside._second[0].pid, flush=True)
time.sleep(100.0)
"""


@pytest.fixture
def scaled(base, tmp_path, monkeypatch):
    """A function that a second process can import, in a process with two cores that has not asked for one."""
    (tmp_path / f"{MODULE}.py").write_text(SOURCE)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(machine_code, "_tree", Tree())
    monkeypatch.setattr(beside, "_asked", [False])
    monkeypatch.setattr(beside, "_second", [])
    monkeypatch.setattr(beside, "_promised", set())
    monkeypatch.setattr(beside, "_meanwhile", [])
    monkeypatch.setattr(beside.os, "sched_getaffinity", lambda pid: {0, 1}, raising=False)
    monkeypatch.setattr(beside, "parent_process", lambda: None)  # tests themselves may run side by side
    home_of.cache_clear()
    yield importlib.import_module(MODULE).scaled
    sys.modules.pop(MODULE)
    home_of.cache_clear()


def ask(function, *meanwhile):
    compile_beside(
        lambda: [(function, (numba.float64,))], lambda: [(each, (numba.float64,)) for each in meanwhile]
    )


def test_what_a_second_process_has_compiled_is_loaded(scaled, capfd):
    ask(scaled)
    (second,) = beside._second
    assert scaled(2.0) == 6.5
    assert scaled.stats.cache_hits[(numba.float64,)] == 1
    assert second.wait(timeout=60) == 0
    assert capfd.readouterr().out == ""


def test_what_a_second_process_compiles_is_counted(scaled):
    before = machine_code.made()
    ask(scaled)
    assert scaled(2.0) == 6.5
    beside._second[0].wait(timeout=60)
    until = time.monotonic() + 30.0
    while machine_code.made() == before and time.monotonic() < until:
        time.sleep(0.01)
    assert machine_code.made() == before + 1


def test_a_wait_for_the_second_process_is_spent_on_what_is_needed_then(scaled, tmp_path):
    (tmp_path / "slow").touch()  # it never delivers: what it makes is compiled here, too
    shifted = sys.modules[MODULE].shifted
    ask(scaled, shifted)
    (second,) = beside._second
    waiting = threading.Thread(target=scaled, args=(2.0,))
    waiting.start()
    until = time.monotonic() + 30.0
    while not shifted.signatures and time.monotonic() < until:
        time.sleep(0.01)
    assert shifted.signatures
    assert waiting.is_alive()
    second.kill()
    waiting.join()
    assert not scaled.stats.cache_hits


def test_a_second_process_that_dies_is_done_without(scaled):
    ask(scaled)
    (second,) = beside._second
    second.kill()
    assert scaled(2.0) == 6.5
    assert not scaled.stats.cache_hits


def test_a_second_process_ends_with_a_first_that_is_killed(scaled, base, tmp_path):
    first = subprocess.Popen([sys.executable, "-c", COMMAND], stdout=subprocess.PIPE, text=True,
                             env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)})  # fmt: skip
    second = psutil.Process(int(first.stdout.readline()))
    while (tmp_path / "imported_by").read_text() != str(second.pid):
        time.sleep(0.02)
    first.kill()
    first.communicate()
    until = time.monotonic() + 30.0
    while second.is_running() and second.status() != psutil.STATUS_ZOMBIE:
        assert time.monotonic() < until
        time.sleep(0.02)


@pytest.fixture
def started(monkeypatch):
    """What second processes have been started for, without starting any."""
    started = []
    monkeypatch.setattr(beside, "_start", lambda calls, files, lock: started.append(calls))
    return started


def test_there_is_one_at_most(scaled, started):
    ask(scaled)
    ask(scaled)
    assert len(started) == 1


def test_there_is_none_where_the_code_is_kept(scaled, started):
    scaled(2.0)
    ask(scaled)
    assert not started


def test_there_is_none_on_one_core(scaled, started, monkeypatch):
    monkeypatch.setattr(beside.os, "sched_getaffinity", lambda pid: {0}, raising=False)
    ask(scaled)
    assert not started


def test_there_is_none_in_one_of_many_processes(scaled, started, monkeypatch):
    monkeypatch.setattr(beside, "parent_process", lambda: True)
    ask(scaled)
    assert not started


def test_there_is_none_where_nothing_can_be_kept(scaled, started, base):
    base.parent.mkdir()
    base.touch()
    ask(scaled)
    assert not started


def test_there_is_none_where_another_process_has_one(scaled, started):
    lock = beside._locked(scaled._cache.file_for((numba.float64,)).parent)
    ask(scaled)
    assert not started
    lock.release()
    beside._asked[0] = False
    ask(scaled)
    assert len(started) == 1


ASK = """
import subzero
from subzero.jit import beside

beside.os.sched_getaffinity = lambda pid: {0, 1}
start, asked = beside._start, []
beside._start = lambda calls, files, lock: (asked.extend(files), start(calls, files, lock))
subzero.simulate(subzero.load_scenario("fig6").with_changes({"run.duration_s": 1.0}))
print(*(file.name.partition("-")[0] for file in asked))
"""


@pytest.mark.slow
def test_a_run_calls_what_it_has_had_compiled_for_those_arguments(tmp_path):
    """Asked for other types, the second process would compile what nobody calls: two files of a function, not one."""
    cache = tmp_path / "cache"
    env = os.environ | {"SUBZERO_CACHE_DIR": str(cache), "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", ASK], env=env, capture_output=True, text=True, check=True)
    names = done.stdout.split()
    assert len(names) == 4
    for name in names:
        assert len(list(cache.rglob(f"{name}-*.code"))) == 1, name
