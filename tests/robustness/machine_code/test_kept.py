"""What was compiled is loaded by the next run, unless its sources changed or the file was damaged; a file is whole."""

from __future__ import annotations

import gc
import importlib.util
import os
import random
import signal
import subprocess
import sys

import pytest

from subzero.jit.machine_code import CODE, OTHERS, home_of

DAMAGED = "damaged"


def test_what_was_compiled_once_is_loaded_next_time(run, base):
    assert run() == (False, "")
    assert run() == (True, "")
    assert [path.suffix for path in base.rglob("*") if path.is_file()] == [CODE]


def test_what_only_a_compiler_needs_is_not_imported_to_load(base, tiny):
    """It takes a quarter of a second of each start."""
    code = f"import sys; sys.path.insert(0, {str(tiny.parent)!r}); import tiny; print(tiny.scaled(2.0)); "
    code += "print(len(tiny.scaled.stats.cache_hits), 'numba.np.linalg' in sys.modules)"
    asked = [sys.executable, "-c", code]
    said = [subprocess.run(asked, capture_output=True, text=True, check=True).stdout for _ in range(2)]
    assert [words.split() for words in said] == [["6.5", "0", "True"], ["6.5", "1", "False"]]


def test_an_edit_of_its_file_compiles_it_anew(run, base, tiny):
    run()
    tiny.write_text(tiny.read_text().replace("3.0 * x", "2.0 * x + x"))
    assert run() == (False, "")


def test_an_edit_between_import_and_use_keeps_nothing(tiny, base):
    """What is in memory is then of other sources than those that stand in the file."""
    spec = importlib.util.spec_from_file_location("tiny", tiny)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    tiny.write_text(tiny.read_text().replace("0.5", "0.75"))
    assert module.scaled(2.0) == 6.5
    assert not base.exists()


@pytest.mark.parametrize("harm", ["shorter", "zeroed", "flipped", "longer", "emptied"])
def test_damaged_code_is_never_loaded_but_made_anew_with_one_line(run, base, kept, harms, harm):
    run()
    path = kept()
    good, rng = path.read_bytes(), random.Random(harm)
    path.write_bytes(harms[harm](good, rng))
    loaded, said = run()
    assert not loaded
    assert DAMAGED in said
    assert said.count("\n") == 1
    assert run() == (True, "")
    home = home_of(OTHERS, base.parents[1] / "tiny.py")
    for _ in range(100):
        spoiled = harms[harm](good, rng)
        path.write_bytes(spoiled)
        assert spoiled == good or home.read(path.name) is None


def test_code_of_another_function_is_damaged_code(run, kept, tiny):
    """Files that were exchanged, by a repair of the disk for one."""
    run()
    path = kept()
    home = home_of(OTHERS, tiny)
    assert home.read(path.name)
    path.rename(path.with_name(f"another{CODE}"))
    assert home.read(f"another{CODE}") is None


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir, lambda path: os.symlink("/dev/zero", path)])
def test_what_is_no_plain_file_is_not_waited_for(run, kept, make):
    run()
    path = kept()
    path.unlink()
    make(path)
    loaded, _ = run()
    assert not loaded


def test_two_processes_that_compile_the_same_leave_whole_files(tiny, base):
    """Each writes the file while the other does, many times; whatever a reader finds is whole."""
    write = f"""
from pathlib import Path
from subzero.jit.machine_code import OTHERS, home_of
home = home_of(OTHERS, Path({str(tiny)!r}))
for k in range(100):
    home.keep("same.code", bytes([k % 256]) * 300_000)
    found = home.read("same.code")
    assert found and len(set(found)) == 1 and len(found) == 300_000
"""
    both = [
        subprocess.Popen([sys.executable, "-c", write], stderr=subprocess.PIPE, text=True) for _ in range(2)
    ]
    for one in both:
        assert one.communicate(timeout=120) == (None, "")
        assert one.returncode == 0
    assert [path.name for path in base.rglob("*") if path.is_file()] == ["same.code"]


@pytest.mark.filterwarnings(
    "ignore::pytest.PytestUnraisableExceptionWarning"
)  # a file closed by nobody but Python
def test_an_interrupt_while_it_is_written_leaves_the_old_file_or_the_new_one(tiny, base):
    home = home_of(OTHERS, tiny)
    old, new = b"old" * 2_000_000, b"new" * 2_000_000

    def stop(*_):
        raise KeyboardInterrupt

    home.keep("one.code", old)
    before, found, rng = signal.signal(signal.SIGALRM, stop), [], random.Random(1)
    try:
        for _ in range(30):
            home.keep("one.code", old)
            try:
                signal.setitimer(signal.ITIMER_REAL, rng.uniform(1e-5, 0.02))
                home.keep("one.code", new)
                signal.setitimer(signal.ITIMER_REAL, 0.0)
            except KeyboardInterrupt:
                found.append(home.read("one.code"))
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    gc.collect()  # an interrupt between the opening of a file and its name leaves it to this
    assert len(found) > 10
    assert set(found) <= {old, new}
    home_of.cache_clear()


CALLED = """
from subzero.jit import compiled

FACTOR = 3.0

@compiled
def scaled(x):
    return FACTOR * x

VALUE = scaled(2.0)
"""


def test_a_module_may_call_what_it_compiles_while_it_is_imported(tmp_path):
    """Compiled or loaded in another thread, it waited for ever for the import to end."""
    (tmp_path / "called.py").write_text(CALLED)
    environment = os.environ | {"SUBZERO_CACHE_DIR": str(tmp_path / "cache")}
    script = f"import sys; sys.path.append({str(tmp_path)!r}); import called; print(called.VALUE)"
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True,
                              check=False, timeout=300)  # fmt: skip
        assert (done.stdout, done.stderr) == ("6.0\n", "")
