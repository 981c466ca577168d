"""Folders of machine code that are out of use are removed, and nothing else."""

from __future__ import annotations

import os
import time

import pytest

from subzero.jit.machine_code import CODE, HALF, KEPT, OTHERS, OUT_OF_USE_S


def aged(folder, days):
    os.utime(folder, (time.time() - days * 86400.0,) * 2)


def old_folder(base, name, days, files=(f"x{CODE}",)):
    folder = base / name
    for file in files:
        (folder / file).parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        (folder / file).touch()
    folder.mkdir(parents=True, exist_ok=True)
    aged(folder, days)
    return folder


def names(base):
    return {path.name for path in base.iterdir() if not path.name.startswith(OTHERS)}


def test_folders_out_of_use_are_removed_when_a_new_one_is_made(run, base):
    month = OUT_OF_USE_S / 86400.0
    for name, days in {"cable-0123456789ab": month + 1, "vehicle-0123456789ab": month - 1}.items():
        old_folder(
            base, name, days, (f"x{CODE}", f"tmp1{HALF}", "cable_1234/former.nbi", "cable_1234/former.1.nbc")
        )
    run()
    assert names(base) == {"vehicle-0123456789ab"}


def test_of_many_folders_the_newest_stay(run, base):
    for k in range(20):
        old_folder(base, f"cable-{k:012x}", 2.0 + k)
        old_folder(base, f"subzero-{k:012x}", 0.01 * k)  # all of today
    run()
    assert len([name for name in names(base) if name.startswith("subzero")]) == 20
    assert {name for name in names(base) if name.startswith("cable")} == {
        f"cable-{k:012x}" for k in range(KEPT - 1)
    }


def test_a_folder_that_is_used_counts_as_new(run, kept):
    run()
    aged(kept().parent, 400)
    run()
    assert time.time() - kept().parent.stat().st_mtime < 3600


@pytest.mark.parametrize(
    "name", ["cable", "cable-0123456789abc", "cable-0123456789AB", "my-0123456789ab", "notes"]
)
def test_what_does_not_look_like_ours_stays(run, base, name):
    old_folder(base, name, 400)
    run()
    assert (base / name / f"x{CODE}").exists()


def test_what_lies_in_our_folder_and_is_not_ours_stays(run, base):
    old_folder(base, "cable-0123456789ab", 400, (f"x{CODE}", "thesis.tex", "sub/photo.jpg"))
    run()
    left = {
        str(path.relative_to(base)) for path in (base / "cable-0123456789ab").rglob("*") if path.is_file()
    }
    assert left == {"cable-0123456789ab/thesis.tex", "cable-0123456789ab/sub/photo.jpg"}


def test_links_are_not_followed_when_it_is_swept(run, base, tmp_path):
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / f"x{CODE}").touch()
    aged(mine, 400)
    base.mkdir(parents=True, mode=0o700)
    (base / "cable-0123456789ab").symlink_to(mine)
    folder = old_folder(base, "vehicle-0123456789ab", 400)
    (folder / "link").symlink_to(mine)
    aged(folder, 400)
    run()
    assert (mine / f"x{CODE}").exists()


@pytest.mark.usefixtures("root")
def test_folders_of_somebody_else_stay_even_for_root(run, base):
    folder = old_folder(base, "cable-0123456789ab", 400)
    os.chown(folder, 12345, -1)
    run()
    assert (folder / f"x{CODE}").exists()
