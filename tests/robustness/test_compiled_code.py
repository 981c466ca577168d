"""Compiled code is loaded by the next run, and never of other sources, damaged, or writable by anybody else.

A small function is compiled several times in this process, each time as a new process would: with nothing but the
files to go by. Whether its code is kept or not, it gives the same number. Configuration: `subzero.jit`. Tolerance:
identity.
"""

from __future__ import annotations

import gc
import importlib
import importlib.util
import os
import random
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numba
import psutil
import pytest
from numba.core.registry import CPUDispatcher

import subzero
from subzero.jit import compile_in_parallel, deferred_signals, machine_code, parallel
from subzero.jit.signals import deliver_pending

ROOT = Path(subzero.__file__).resolve().parents[1]
TINY = """
from subzero.jit import compiled

@compiled
def scaled(x):
    return 3.0 * x + 0.5
"""


def forget():
    for known in (machine_code.folder_of, machine_code.digest_of, machine_code.sources_of):
        known.cache_clear()
    machine_code._warned.clear()


@pytest.fixture
def tiny(tmp_path):
    """The file of a small function, outside our packages."""
    path = tmp_path / "tiny.py"
    path.write_text(TINY)
    return path


@pytest.fixture
def base(tmp_path, monkeypatch):
    """The folder of all compiled code, which is not there yet."""
    monkeypatch.setenv("SUBZERO_CACHE_DIR", str(tmp_path / "cache"))
    # A command that another test ran in this process may wait to announce the first compilation.
    monkeypatch.setattr(machine_code, "_announcements", [])
    forget()
    yield tmp_path / "cache"
    forget()


@pytest.fixture
def run(tiny, base, capsys):
    """Run the function as a new process would; returns whether its code was loaded, and what was said."""

    def begin():
        forget()
        spec = importlib.util.spec_from_file_location("tiny", tiny)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        capsys.readouterr()
        assert module.scaled(2.0) == 6.5
        return bool(module.scaled.stats.cache_hits), capsys.readouterr().err

    return begin


@pytest.fixture
def kept(base):
    """Return what gives the one file that is kept."""

    def find():
        (path,) = base.rglob("*.code")
        return path

    return find


def test_what_was_compiled_once_is_loaded_next_time(run, base, kept):
    assert run() == (False, "")
    assert run() == (True, "")
    assert [path for path in base.rglob("*") if path.is_file()] == [kept()]
    assert os.name != "posix" or kept().parent.stat().st_mode & 0o077 == 0


def test_an_edit_of_its_file_compiles_it_anew(run, tiny):
    run()
    tiny.write_text(tiny.read_text().replace("3.0 * x", "2.0 * x + x"))
    assert run() == (False, "")


def test_an_edit_between_import_and_use_is_not_taken_for_what_was_compiled(run, tiny):
    spec = importlib.util.spec_from_file_location("tiny", tiny)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    tiny.write_text(tiny.read_text().replace("0.5", "0.75"))
    assert module.scaled(2.0) == 6.5
    tiny.write_text(tiny.read_text().replace("0.75", "0.5").replace("3.0", "3.0 * 1.0"))
    assert run() == (False, "")


def spoilt(data, rng):
    """Give a file cut, zeroed from somewhere on, with a changed bit, longer, and empty."""
    at = rng.randrange(len(data))
    changed = data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]
    return [data[:at], data[:at] + bytes(len(data) - at), changed, data + b"x", b""]


def test_damaged_code_is_never_loaded_and_replaced(run, kept):
    run()
    good, rng = kept().read_bytes(), random.Random(1)
    for _ in range(50):
        for data in spoilt(good, rng):
            kept().write_bytes(data)
            assert data == good or machine_code._read(kept()) is None
    assert run() == (False, "")
    assert run() == (True, "")


def test_code_of_another_function_is_damaged_code(run, kept):
    run()
    moved = kept().rename(kept().with_name("another.code"))
    assert machine_code._read(moved) is None


def test_code_that_was_not_used_for_a_month_is_removed_and_nothing_else(run, base):
    month_ago = time.time() - 31 * 86400.0
    old = [base / name for name in ("code-0123456789ab", "code-0123456789ac", "code-mine", "thesis")]
    for folder in old:
        folder.mkdir(parents=True, mode=0o700)
        (folder / "f-0.code").write_bytes(b"")
    (old[1] / "notes.txt").write_text("mine")
    (base / "code-0123456789ad").symlink_to(old[3])
    for folder in old:
        os.utime(folder, (month_ago, month_ago))
    run()
    assert not old[0].exists()
    assert (old[1] / "notes.txt").exists()
    assert all((folder / "f-0.code").exists() for folder in old[2:])


@pytest.mark.parametrize("place", ["a file", "in a file", "nowhere", "no home"])
def test_without_a_folder_it_runs_and_says_so_in_one_line(run, base, place, monkeypatch):
    if place == "a file":
        base.write_text("mine")
    elif place == "in a file":
        base.write_text("mine")
        monkeypatch.setenv("SUBZERO_CACHE_DIR", str(base / "inside"))
    elif place == "nowhere":
        base.symlink_to("/proc/none/such")
    else:
        monkeypatch.setattr(machine_code, "base_folder", lambda: None)
    for _ in range(2):
        loaded, said = run()
        assert not loaded
        assert said.startswith("Compiled code is not kept: ")
        assert "SUBZERO_CACHE_DIR" in said
        assert said.count("\n") == 1


@pytest.mark.skipif(os.name != "posix", reason="other systems have access rights of their own")
@pytest.mark.parametrize("which", ["base", "folder"])
@pytest.mark.parametrize("what", ["mode", "owner"])
def test_a_folder_that_others_may_write_or_own_is_not_used(run, base, kept, which, what):
    run()
    folder = base if which == "base" else kept().parent
    if what == "mode":
        folder.chmod(0o777)
    elif os.geteuid() == 0:
        os.chown(folder, 12345, -1)
    else:
        pytest.skip("only root may give files away")
    loaded, said = run()
    assert not loaded
    assert "others may write" in said
    assert said.count("\n") == 1


@pytest.mark.long
def test_two_processes_that_write_the_same_file_leave_it_whole(base, tmp_path):
    base.mkdir()
    write = f"""
from pathlib import Path
from subzero.jit import machine_code
file = Path({str(base / "same.code")!r})
for k in range(100):
    machine_code._write(file, bytes([k]) * 300_000)
    assert len(set(machine_code._read(file))) == 1
"""
    both = [subprocess.Popen([sys.executable, "-c", write]) for _ in range(2)]
    assert [one.wait(120) for one in both] == [0, 0]
    assert [path.name for path in base.iterdir()] == ["same.code"]


TWO_KINDS = """
import sys
from subzero.jit import compiled, inner
from subzero.jit.record import Record

class Low(Record):
    first: float
    second: float

class High(Record):
    second: float
    first: float

@inner
def _long_sum(n, r):  # too long to become a part of its caller
    total = 0.0
    for i in range(n):
        for j in range(i):
            if j % 3 == 1:
                total += r.first * (i - j)
            elif total > 1e300:
                total -= _long_sum(n - 1, r)
            else:
                total -= r.first * (i - j)
    return total + r.first

@compiled
def tenfold(r):
    return 10.0 * _long_sum(1, r) + _long_sum(0, r) + _long_sum(1, r)

for kind in sys.argv[1:]:
    print(tenfold({"Low": Low, "High": High}[kind](first=1.0, second=2.0)))
"""


@pytest.mark.long
def test_code_that_two_processes_have_kept_for_two_kinds_of_records_is_not_confused(base, tmp_path):
    """A linker takes the first of two functions of one name; numba numbers kinds of records in each process anew."""
    path = tmp_path / "two_kinds.py"
    path.write_text(TWO_KINDS)

    def run(*kinds):
        called = [sys.executable, str(path), *kinds]
        return subprocess.run(
            called,
            capture_output=True,
            text=True,
            check=True,
            timeout=120,
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
        ).stdout.split()

    assert run("Low") == run("High") == ["12.0"]
    assert run("Low", "High") == run("High", "Low") == ["12.0", "12.0"]


def test_every_compiled_function_and_what_it_names_is_in_its_key():
    """Looked up in the running program: modules, functions and classes among the globals of compiled functions."""
    import subzero.diagnosis.inference
    import subzero.simulation.feng_allen
    import subzero.synthetic.reference_coupling  # noqa: F401 - these lead to all of them

    seen = 0
    for made in [each for each in gc.get_objects() if issubclass(type(each), CPUDispatcher)]:
        function = made.py_func
        parts = (
            Path(function.__code__.co_filename).relative_to(ROOT).parts
            if (function.__module__ or "").partition(".")[0] in machine_code.PACKAGES
            else ("",)
        )
        if parts[0] not in machine_code.PACKAGES:
            continue
        files = machine_code.sources_of("/".join(parts[:-1][: 1 + (parts[0] == "subzero")]))
        for value in [function, *(function.__globals__.get(name) for name in function.__code__.co_names)]:
            home = getattr(value, "__module__", None) or getattr(value, "__name__", None)
            module = sys.modules.get(home) if isinstance(home, str) else None
            if module and home.partition(".")[0] in machine_code.PACKAGES:
                assert Path(module.__file__) in files, (function, home)
        seen += 1
    assert seen > 100


SETTLE = """
import numpy as np
from vehicle.actuators import ServoNumbers, settle
state = np.arange(21.0)
settle(state, np.zeros(4), (ServoNumbers(*[0.1] * len(ServoNumbers.names)),) * 3)
print(state.tolist())
"""


@pytest.mark.long
def test_an_index_that_has_moved_in_another_file_is_seen(tmp_path):
    """`vehicle/state.py` compiles nothing itself; the code that it is part of stands in `vehicle/actuators.py`."""
    for package in machine_code.PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))

    def settled(**environment):
        environment = (
            os.environ
            | {"SUBZERO_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(tmp_path)}
            | environment
        )
        done = subprocess.run(
            [sys.executable, "-c", SETTLE],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
            env=environment,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    before = settled()
    path = tmp_path / "vehicle/state.py"
    text = path.read_text()
    path.write_text(text + "\nSERVO += 1\n")
    assert settled() == settled(NUMBA_DISABLE_JIT="1") != before


@pytest.mark.long
def test_import_changes_nothing_in_the_process():
    code = """
import gc, os, signal, sys, threading
import numpy, scipy.linalg, numba, numba.core.registry, numba.core.codegen, numba.experimental, xarray, netCDF4
from numba.core.targetconfig import TargetConfig

def state():
    settings = {name: str(value) for name, value in vars(numba.config).items() if name.isupper()}
    handlers = {number: signal.getsignal(number) for number in signal.valid_signals()}
    return settings, handlers, dict(os.environ), os.getcwd(), gc.get_threshold(), sys.getrecursionlimit(), \\
        numpy.geterr(), TargetConfig.__eq__, threading.active_count(), sys.excepthook

before = state()
import cable, vehicle, scenarios, subzero
import cable.moving_end.time_loop, vehicle.dynamics
subzero.simulate
vehicle.initial_state()
assert state() == before
"""
    subprocess.run([sys.executable, "-c", code], check=True)


MODULE = "compiled_in_parallel"
PARALLEL = """
import os, time
from pathlib import Path
from subzero.jit import compiled

if (Path(__file__).parent / "slow").exists():
    time.sleep(100.0)

@compiled
def scaled(x):
    return 3.0 * x + 0.5
"""


@pytest.fixture
def scaled(base, tmp_path, monkeypatch):
    """A function that a second process can import, in a process with two cores that has not started one."""
    (tmp_path / f"{MODULE}.py").write_text(PARALLEL)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(parallel, "_process", [])
    monkeypatch.setattr(parallel, "_awaited", set())
    monkeypatch.setattr(parallel, "_cores", lambda: 2)
    monkeypatch.setattr(
        parallel, "parent_process", lambda: None
    )  # tests themselves may run in several processes
    yield importlib.import_module(MODULE).scaled
    sys.modules.pop(MODULE)
    for process in parallel._process:
        process.kill()
        process.communicate()


def start(function):
    compile_in_parallel(lambda: [(function, (numba.float64,))])


def test_what_a_second_process_has_compiled_is_loaded(scaled):
    start(scaled)
    assert scaled(2.0) == 6.5
    assert sum(scaled.stats.cache_hits.values()) == 1


def test_a_second_process_that_dies_is_done_without(scaled, tmp_path):
    (tmp_path / "slow").touch()
    start(scaled)
    threading.Timer(0.5, parallel._process[0].kill).start()
    assert scaled(2.0) == 6.5
    assert not scaled.stats.cache_hits


def test_there_is_none_where_the_code_is_kept_or_there_is_no_core(scaled, monkeypatch):
    monkeypatch.setattr(parallel, "_cores", lambda: 1)
    start(scaled)
    assert scaled(2.0) == 6.5
    monkeypatch.setattr(parallel, "_cores", lambda: 2)
    start(scaled)
    assert parallel._process == []


@pytest.mark.long
def test_a_second_process_ends_with_a_first_that_is_killed(scaled, tmp_path):
    (tmp_path / "slow").touch()
    code = """
import time, numba
from subzero.jit import compile_in_parallel, parallel
parallel._cores = lambda: 2
(lambda f: compile_in_parallel(lambda: [(f, (numba.float64,))]))(__import__("tiny_one").scaled)
print(parallel._process[0].pid, flush=True)
time.sleep(100.0)
"""
    (tmp_path / "tiny_one.py").write_text(PARALLEL.replace("exists()", "is_socket()"))
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    first = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=environment)
    second = psutil.Process(int(first.stdout.readline()))
    first.kill()
    first.communicate()
    psutil.wait_procs([second], timeout=20.0)
    assert not second.is_running() or second.status() == psutil.STATUS_ZOMBIE


@pytest.fixture
def handler():
    """Ctrl-C as in a session of Python."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield signal.default_int_handler
    signal.signal(signal.SIGINT, before)


def test_a_signal_waits_until_the_work_is_done(handler):
    done = []
    with pytest.raises(KeyboardInterrupt), deferred_signals():  # noqa: PT012 - all of it belongs to the block
        signal.raise_signal(signal.SIGINT)
        with deferred_signals():
            done.append("inner")
        done.append("all")
    assert done == ["inner", "all"]
    assert signal.getsignal(signal.SIGINT) is handler


def test_work_that_can_be_broken_off_is(handler):
    with pytest.raises(KeyboardInterrupt), deferred_signals():  # noqa: PT012
        signal.raise_signal(signal.SIGINT)
        deliver_pending()
        raise AssertionError("it went on")
    assert signal.getsignal(signal.SIGINT) is handler


def test_an_error_is_raised_as_it_is_and_ignored_signals_stay_ignored(handler):
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with pytest.raises(ZeroDivisionError), deferred_signals():  # noqa: PT012
            assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
            1 / 0  # noqa: B018
    finally:
        signal.signal(signal.SIGTERM, before)
    assert signal.getsignal(signal.SIGINT) is handler
