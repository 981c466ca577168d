"""A delivery of files is all or nothing, wherever it is broken off: at every single line of its code.

One process delivers three files, `a`, `b` and `c`, to a folder that has an old `a` and `b` and the user's own `notes`.
It is broken off at its first line, at its second, and so on to the last, by an interrupt, by a full disk, and by
being killed. Whatever is found then has to be all old or all new, or has to be refused by every reader; and it is all
new after the same command once more. Nothing that the process did not make is ever removed or moved.
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

from subzero.errors import UserError
from subzero.files.atomic_output import open_output_folder
from subzero.files.read_file import INCOMPLETE, read_bytes

BREAKER = '''
import errno, json, os, shutil, signal, sys
from pathlib import Path
from subzero.files import atomic_output as module
from subzero.files.read_file import interrupted_files, read_bytes
from subzero.errors import UserError

how, is_new, twice, top = sys.argv[1], sys.argv[2] == "new", sys.argv[3] == "twice", Path(sys.argv[4])
OLD, NEW = {"a": "old", "b": "old"}, {"a": "new", "b": "new", "c": "new"}
raised = {"interrupt": KeyboardInterrupt, "full": lambda: OSError(errno.ENOSPC, "No space left on device")}
# Cleaning up at the end is suppressed when it fails: fail only what can fail.
UNTOUCHED = ("friendly_errors", "_is_of_disk", "state_of_output")
FALLIBLE = ("_replace_each", "_deliver", "_rename_whole")

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
        with module.open_output_folder(folder) as output:
            for name, text in files.items():
                (output.path / name).write_text(text)
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
            said = module.state_of_output() + "|" + type(error).__name__
        os.write(write, said.encode())
        os._exit(0)
    os.close(write)
    said = os.read(read, 9999).decode()
    os.close(read)
    os.waitpid(child, 0)
    marked = bool(interrupted_files(folder)) and refused(folder)
    first = state(folder)
    deliver(folder, NEW)
    second = state(folder)
    left = sorted(p.name for p in folder.iterdir() if p.name not in NEW)
    above = [p.name for p in folder.parent.iterdir() if p != folder]
    if how != "full":  # a temporary folder remains of a killed process, and of an interrupt while it is removed
        left, above = ([name for name in names if not name.startswith(module.TEMPORARY)] for names in (left, above))
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


@pytest.mark.long
@pytest.mark.parametrize("how", ["interrupt", "full", "kill"])
@pytest.mark.parametrize("kind", ["new", "old"])
def test_broken_off_at_any_line_a_folder_is_all_old_or_all_new_or_says_so(broken, how, kind):
    lines, found = broken(how, kind)
    assert lines > 10
    for spot, first, marked, second, kept, above, _ in found:
        assert first in ("old", "new") or marked, spot
        assert second == "new", spot
        assert kept, spot
        assert above == [], spot
    assert {one[1] for one in found} >= {"old"}


@pytest.mark.slow
@pytest.mark.parametrize("how", ["interrupt", "kill"])
def test_broken_off_again_while_it_is_put_back_it_still_says_so(broken, how):
    _, found = broken(how, "old", "twice")
    for spot, first, marked, second, *_ in found:
        assert first in ("old", "new") or marked, spot
        assert second == "new", spot


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


def tree(folder):
    return {
        str(path.relative_to(folder)): path.read_text()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def deliver(folder, **files):
    with open_output_folder(folder) as output:
        for name, text in files.items():
            (output.path / name).write_text(text)


def test_no_folder_of_the_user_is_ever_removed_whatever_its_name(tmp_path):
    """Folders called .subzero-… beside the output and up to two levels above were taken for leftovers, and removed."""
    mine = {
        ".subzero-notes/thesis": "a", "project/.subzero-venv/lib": "b", "project/x/.subzero-1-abc/new/file": "c",
        "project/x/out/.subzero-2-abc/old/file": "d", "project/x/out/.subzero-gone/lock": "",
    }  # fmt: skip
    for name, text in mine.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    deliver(tmp_path / "project" / "x" / "out", a="new")
    deliver(tmp_path / "project" / "x" / "other", a="new")
    assert tree(tmp_path) == mine | {"project/x/out/a": "new", "project/x/other/a": "new"}


@pytest.mark.long
@pytest.mark.parametrize("target", ["elsewhere/.subzero-evil", "victim/.subzero-evil", "victim"])
def test_a_list_of_incomplete_files_moves_and_removes_nothing(tmp_path, target):
    """A marker in a folder received from elsewhere named a folder, whose files were moved and which was removed."""
    evil = tmp_path / target
    (evil / "new").mkdir(parents=True)
    (evil / "new" / "file").write_text("mine")
    victim = tmp_path / "victim"
    victim.mkdir(exist_ok=True)
    marker = {"from": str(evil), "files": ["a", "../elsewhere", str(evil)], "doubtful": []}
    (victim / INCOMPLETE).write_text(json.dumps(marker))
    deliver(victim, a="new")
    assert (evil / "new" / "file").read_text() == "mine"
    assert (victim / "a").read_text() == "new"
    assert not (victim / "file").exists()


def test_files_that_a_killed_command_left_in_doubt_are_refused_until_they_are_written_again(tmp_path):
    deliver(tmp_path / "out", a="old", b="old")
    (tmp_path / "out" / INCOMPLETE).write_text(json.dumps({"files": ["a", "b"]}))
    deliver(tmp_path / "out", b="new")
    assert read_bytes(tmp_path / "out" / "b", 99) == b"new"
    with pytest.raises(UserError, match="killed"):
        read_bytes(tmp_path / "out" / "a", 99)
    deliver(tmp_path / "out", a="new")
    assert tree(tmp_path / "out") == {"a": "new", "b": "new"}


def test_a_file_that_cannot_be_replaced_leaves_all_as_they_were(tmp_path, monkeypatch):
    """As where another program holds one of them open, which some systems forbid to replace."""
    deliver(tmp_path / "out", a="old", b="old", c="old")
    replace = os.replace

    def refusing(source, to):
        if Path(to) == tmp_path / "out" / "b" and Path(source).read_text() == "new":
            raise PermissionError(13, "it is in use", str(to))
        replace(source, to)

    monkeypatch.setattr(os, "replace", refusing)
    with pytest.raises(UserError, match="in use"):
        deliver(tmp_path / "out", a="new", b="new", c="new")
    assert tree(tmp_path) == {"out/a": "old", "out/b": "old", "out/c": "old"}


def test_parents_made_for_nothing_are_removed_and_no_others(tmp_path):
    (tmp_path / "there").mkdir()
    with pytest.raises(RuntimeError), open_output_folder(tmp_path / "there" / "new" / "out"):
        raise RuntimeError
    assert [path.name for path in tmp_path.rglob("*")] == ["there"]
