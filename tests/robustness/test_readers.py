"""Whatever stands in a user's file, or in its place: it is read, with finite numbers only, or refused in one message.

The long form is 100 000 spoiled files over all readers:  pytest -m slow tests/robustness/test_readers.py -s
"""

from __future__ import annotations

import importlib.util
import os
import random
import socket
import sys
from collections import Counter
from pathlib import Path

import pytest

import scenarios
from subzero.autopilot.registry import from_file
from subzero.diagnosis import load_effects
from subzero.errors import UserError

# pytest imports test files one by one, without their folder; this is a module beside this one.
_spec = importlib.util.spec_from_file_location("readers", Path(__file__).with_name("readers.py"))
assert _spec
assert _spec.loader
readers = sys.modules["readers"] = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(readers)

READERS, SEALED = readers.READERS, readers.SEALED
SHORT, PIECES, LONG = 60, 8, 900
"""Spoiled files a reader, by default; pieces of the long form, and files in each: 14 x 8 x 900 = 100 800."""


def spoil(name, seed, count, folder):
    """Read so many spoiled files; return how often what came out."""
    counts = Counter()
    for k in range(count):
        rng = random.Random(f"{name} {seed} {k}")
        counts[readers.outcome(READERS[name], readers.spoiled(READERS[name].good, rng), folder)] += 1
    return counts


@pytest.mark.long
@pytest.mark.parametrize("name", READERS)
def test_a_spoiled_file_is_read_or_refused(name, tmp_path):
    assert readers.outcome(READERS[name], READERS[name].good, tmp_path) == "read"
    counts = spoil(name, "short", SHORT, tmp_path)
    assert counts.total() == SHORT
    assert min(counts["read"], counts["refused"]) > 0


@pytest.mark.slow
@pytest.mark.parametrize("piece", range(PIECES))
@pytest.mark.parametrize("name", READERS)
def test_a_hundred_thousand_spoiled_files_are_read_or_refused(name, piece, tmp_path):
    counts = spoil(name, piece, LONG, tmp_path)
    assert counts.total() == LONG
    print(f"\n{name} {piece}: {dict(counts)}")


def zero(path):
    path.symlink_to("/dev/zero")


def random_device(path):
    path.symlink_to("/dev/urandom")


def pipe(path):
    os.mkfifo(path)


def connection(path):
    with socket.socket(socket.AF_UNIX) as one:
        here = Path.cwd()
        os.chdir(path.parent)
        one.bind(path.name)
        os.chdir(here)


def folder(path):
    path.mkdir()


def loop(path):
    path.symlink_to(path)


def nowhere(path):
    path.symlink_to(path.with_name("gone"))


def huge(path):
    path.touch()
    os.truncate(path, 1 << 40)


def binary(path):
    path.write_bytes(bytes(range(256)) * 10)


STRANGE = [zero, random_device, pipe, connection, folder, loop, nowhere, huge, binary]


@pytest.mark.parametrize("make", STRANGE)
@pytest.mark.parametrize("name", [name for name in READERS if name not in ("resealed", "marker")])
def test_what_is_no_plain_file_is_refused_at_once(name, make, tmp_path):
    reader = READERS[name]
    for other, text in reader.beside.items():
        (tmp_path / other).write_text(text, encoding="utf-8")
    make(tmp_path / reader.file)
    with readers.limited(), pytest.raises((UserError, scenarios.ScenarioError)) as caught:
        reader.read(tmp_path)
    readers.check_message(str(caught.value))


@pytest.mark.parametrize("make", [zero, pipe, connection, folder, loop, nowhere, huge, binary])
@pytest.mark.parametrize("read", [from_file, load_effects])
def test_a_file_that_would_be_run_is_refused_if_it_is_none(read, make, tmp_path):
    make(tmp_path / "mine.py")
    with readers.limited(), pytest.raises(UserError) as caught:
        read(tmp_path / "mine.py")
    readers.check_message(str(caught.value))


@pytest.mark.parametrize("name", [name for name in READERS if name not in ("marker",)])
def test_a_folder_whose_name_is_not_utf_8_is_one_like_others(name, tmp_path):
    odd = tmp_path / os.fsdecode(b"odd \xff\x1b[31m")
    odd.mkdir()
    assert readers.outcome(READERS[name], READERS[name].good, odd) == "read"
    readers.outcome(READERS[name], "=" + READERS[name].good, odd)  # its message can be printed


def many_keys(text):
    return text + "\n" + "".join(f"k{i} = 1\n" for i in range(200_000))


def many_names(text):
    return text + "\n" + "a." * 500_000 + "a = 1\n"


def many_quoted_names(text):
    return text + "\n" + '"a".' * 500_000 + "a = 1\n"


def blanks(text):
    return text + '\nlong = """\n[' + " " * 3_000_000 + '\n"""\n'


def many_values(text):
    return text + "\nlong = [" + '"",' * 900_000 + "]\n"


def many_tables(text):
    return text + "\n" + "[[missing_force]]\naxis = 1\n" * 100_000


def many_commas(text):
    head, _, rest = text.partition("\n")
    return head + "," * 2_000_000 + "\n" + rest


def many_rows(text):
    return text + "x\n" * 200_000


LARGE = [many_keys, many_names, many_quoted_names, blanks, many_values, many_tables, many_commas, many_rows]


@pytest.mark.slow
@pytest.mark.parametrize("enlarge", LARGE)
@pytest.mark.parametrize("name", READERS)
def test_a_large_file_is_read_or_refused_in_time(name, enlarge, tmp_path):
    assert readers.outcome(READERS[name], enlarge(READERS[name].good), tmp_path) in ("read", "refused")
