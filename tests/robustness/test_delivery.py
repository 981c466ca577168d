"""A delivery of files is all or nothing, wherever it is broken off: at every single line of its code.

One process delivers three files, `a`, `b` and `c`, to a folder that has an old `a` and `b` and the user's own `notes`.
It is broken off at its first line, at its second, and so on to the last, by an interrupt, by a full disk, and by
being killed. Whatever is found then has to be all old or all new, or has to be refused by every reader; and it has to
be all old or all new after the next command with that folder.
"""

from __future__ import annotations

import functools
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

BREAKER = '''
import errno, json, os, shutil, signal, sys
from pathlib import Path
from subzero import stage as module
from subzero.user_file import interrupted_files, read_bytes
from subzero.errors import UserError

how, is_new, twice, top = sys.argv[1], sys.argv[2] == "new", sys.argv[3] == "twice", Path(sys.argv[4])
OLD, NEW = {"a": "old", "b": "old"}, {"a": "new", "b": "new", "c": "new"}
raised = {"interrupt": KeyboardInterrupt, "full": lambda: OSError(errno.ENOSPC, "No space left on device")}
# Sweeping up at the end is suppressed when it fails, and a refused lock is not a failure: fail only what can fail.
UNTOUCHED = ("told", "_is_of_disk", "interruption")
FALLIBLE = ("_force", "_keep", "_move_all", "_settle", "_deliver", "_renamed", "write")

def deliver(folder, files, at=(), seen=None):
    """Deliver, and break off at the lines `at`, counted in the code of the module."""
    count = 0
    def trace(frame, event, _):
        nonlocal count
        if frame.f_code.co_filename != module.__file__ or frame.f_code.co_name in UNTOUCHED:
            return None
        if how == "full" and frame.f_code.co_name not in FALLIBLE:
            return None
        if event == "line":
            if count in at:
                count += 1
                if how == "kill":
                    os.kill(os.getpid(), signal.SIGKILL)
                raise raised[how]()
            count += 1
        return trace
    sys.settrace(trace)
    try:
        with module.staged(folder) as stage:
            for name, text in files.items():
                (stage.path / name).write_text(text)
    finally:
        sys.settrace(None)
        if seen is not None:
            seen.append(count)

def state(folder):
    found = {p.name: p.read_text() for p in folder.iterdir() if p.name in NEW} if folder.is_dir() else {}
    return "old" if found == ({} if is_new else OLD) else "new" if found == NEW else "mixed"

def refused(folder):
    """Whether readers refuse every file that is there and was meant to be delivered."""
    for name in NEW:
        if (folder / name).exists():
            try:
                read_bytes(folder / name, 99)
            except UserError:
                continue
            return False
    return True

def prepared(k):
    folder = top / str(k) / "out"
    (folder.parent if is_new else folder).mkdir(parents=True)
    if not is_new:
        (folder / "notes").write_text("mine")
        for name, text in OLD.items():
            (folder / name).write_text(text)
    return folder

def broken(k, at):
    """Break off once, in a child; return the states found: at once, and after the next command."""
    folder = prepared(k)
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        said = ""
        module._delivered.clear()
        try:
            deliver(folder, NEW, at)
        except (KeyboardInterrupt, UserError, OSError) as error:
            said = module.interruption() + "|" + type(error).__name__
        os.write(write, said.encode())
        os._exit(0)
    os.close(write)
    said = os.read(read, 9999).decode()
    os.close(read)
    os.waitpid(child, 0)
    marked = bool(interrupted_files(folder)) and refused(folder)
    first = state(folder)
    deliver(folder, {"d": "other"})
    (folder / "d").unlink()
    second = state(folder)
    left = sorted(p.name for p in folder.iterdir() if p.name not in NEW)
    above = [p.name for p in folder.parent.iterdir() if p != folder]
    shutil.rmtree(folder.parent)
    return [first, marked, second, left == ([] if is_new else ["notes"]), above, said]

lines = []
deliver(prepared("whole"), NEW, seen=lines)
last = lines[0]
if twice:
    import random
    rng = random.Random(1)
    spots = [tuple(sorted(rng.sample(range(last + 40), 2))) for _ in range(300)]
else:
    spots = [(k,) for k in range(last)]
print(json.dumps([last, [[spot, *broken(k, spot)] for k, spot in enumerate(spots)]]))
'''


MEMORY = Path("/dev/shm")
"""What is forced to the disk is there at once, if it lies in memory: hundreds of deliveries are made here."""


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder for deliveries."""
    if not os.access(MEMORY, os.W_OK):
        yield tmp_path_factory.mktemp("broken")
        return
    with tempfile.TemporaryDirectory(dir=MEMORY) as folder:
        yield Path(folder)


@pytest.fixture(scope="module")
def broken(place):
    @functools.cache
    def run(how, kind, twice="once"):
        top = place / f"{how}-{kind}-{twice}"
        top.mkdir()
        done = subprocess.run([sys.executable, "-c", BREAKER, how, kind, twice, str(top)],
                              capture_output=True, text=True, check=False, timeout=300)  # fmt: skip
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


@pytest.mark.parametrize("how", ["interrupt", "full", "kill"])
@pytest.mark.parametrize("kind", ["new", "old"])
def test_broken_off_at_any_line_a_folder_is_all_old_or_all_new_or_says_so(broken, how, kind):
    lines, found = broken(how, kind)
    assert lines > 30
    for spot, first, marked, second, kept, above, _ in found:
        assert first in ("old", "new") or marked, spot
        assert second in ("old", "new"), spot
        assert kept, spot
        if how == "kill":
            assert above == [], spot
    assert {one[1] for one in found} >= {"old"}


@pytest.mark.slow
@pytest.mark.parametrize("how", ["interrupt", "kill"])
def test_broken_off_again_while_it_is_put_back_it_still_says_so(broken, how):
    _, found = broken(how, "old", "twice")
    for spot, first, marked, second, kept, _above, _ in found:
        assert first in ("old", "new") or marked, spot
        assert second in ("old", "new"), spot
        assert kept, spot


def test_what_is_said_after_an_interrupt_is_true(broken):
    _, found = broken("interrupt", "old")
    for spot, first, marked, _, _, _, said in found:
        if said.endswith("KeyboardInterrupt"):
            words = {"old": "nothing was written", "new": "all files were written"}
            assert said.startswith(words.get(first, "?")) or (marked and "incomplete" in said), (
                spot,
                first,
                said,
            )
