"""Machine code is run as it is: what others own or may write is not used."""

from __future__ import annotations

import os
import stat

import pytest

NOT_KEPT = "cannot be kept"
NOT_TRUSTED = "is not used"


def test_folders_are_made_for_this_user_alone(run, base, kept):
    before = os.umask(0)
    try:
        run()
    finally:
        os.umask(before)
    for path in (base.parent, base, kept().parent):
        assert stat.S_IMODE(path.stat().st_mode) == 0o700
    assert stat.S_IMODE(kept().stat().st_mode) == 0o600


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o702])
@pytest.mark.parametrize("which", ["base", "folder"])
def test_a_folder_that_others_may_write_is_not_used_and_one_line_says_what_to_do(
    run, base, mode, which, kept
):
    run()
    path = kept()
    (base if which == "base" else path.parent).chmod(mode)
    before = path.stat().st_mtime_ns
    loaded, said = run()
    assert not loaded
    assert NOT_TRUSTED in said
    assert "others may write" in said
    assert "SUBZERO_CACHE_DIR" in said
    assert said.count("\n") == 1
    assert path.stat().st_mtime_ns == before
    path.parent.chmod(0o700)
    base.chmod(0o700)
    assert run() == (True, "")


@pytest.mark.usefixtures("root")
@pytest.mark.parametrize("which", ["base", "folder"])
def test_a_folder_of_somebody_else_is_not_used_even_by_root(run, base, which, kept):
    run()
    os.chown(base if which == "base" else kept().parent, 12345, -1)
    loaded, said = run()
    assert not loaded
    assert "belongs to another user (number 12345)" in said
    assert said.count("\n") == 1


@pytest.mark.usefixtures("root")
def test_a_file_of_somebody_else_is_not_loaded(run, kept):
    run()
    os.chown(kept(), 12345, -1)
    loaded, said = run()
    assert not loaded
    assert said.count("\n") == 1
    assert kept().stat().st_uid == 0  # it is one of ours now
    assert run() == (True, "")


def test_a_file_that_others_may_write_is_not_loaded(run, kept):
    run()
    kept().chmod(0o666)
    assert run()[0] is False
    assert run() == (True, "")


def test_a_folder_that_is_a_link_is_not_used_but_the_one_above_may_be(run, base, tmp_path, kept):
    run()
    folder = kept().parent
    elsewhere = tmp_path / "elsewhere"
    folder.rename(elsewhere)
    folder.symlink_to(elsewhere)
    loaded, said = run()
    assert not loaded
    assert NOT_TRUSTED in said
    folder.unlink()
    elsewhere.rename(folder)
    base.rename(elsewhere)
    base.symlink_to(elsewhere)
    assert run() == (True, "")


NOBODY = 65534


def as_nobody(what):
    """Return what a function gives in a child process of a user without rights."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            os.setgroups([])
            os.setgid(NOBODY)
            os.setuid(NOBODY)
            os.write(write, repr(what()).encode())
            code = 0
        finally:
            os._exit(code)
    os.close(write)
    said = os.read(read, 9999).decode()
    os.close(read)
    assert os.waitpid(child, 0)[1] == 0
    return said


@pytest.mark.usefixtures("root")
def test_a_cache_of_root_is_read_by_others_and_a_closed_one_is_done_without(run, base, tiny, kept):
    run()
    for folder in (base, *base.parents):  # pytest's own are closed, too
        if folder in (base, base.parent) or folder.name.startswith(("test_", "pytest-", "popen-")):
            folder.chmod(0o755)
    kept().parent.chmod(0o755)
    kept().chmod(0o644)
    assert as_nobody(run) == repr((True, ""))
    base.chmod(0o700)
    said = as_nobody(run)
    assert said.startswith("(False")
    assert NOT_KEPT in said
    assert said.count("\\n") == 1
