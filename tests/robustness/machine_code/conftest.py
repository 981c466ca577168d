"""A small function, compiled several times in this process: each time as a new process would, with nothing but the
files to go by. Whether its code is kept or not, it gives the same numbers.
"""

from __future__ import annotations

import importlib.util
import os

import pytest

from subzero.jit import machine_code
from subzero.jit.machine_code import CODE, OTHERS, home_of
from subzero.jit.sources import Tree

TINY = """
from subzero.jit import compiled

@compiled
def scaled(x):
    return 3.0 * x + 0.5
"""


@pytest.fixture
def tiny(tmp_path):
    """The file of a small function, outside our packages."""
    path = tmp_path / "tiny.py"
    path.write_text(TINY)
    return path


@pytest.fixture
def base(tmp_path, monkeypatch):
    """The folder of all machine code, which is not there yet."""
    base = tmp_path / "cache" / "inner"
    monkeypatch.setenv("SUBZERO_CACHE_DIR", str(base))
    return base


@pytest.fixture
def run(tiny, capsys):
    """Run the function as a new process would; gives whether it was loaded, and what was said."""

    def begin():
        machine_code._tree = Tree()
        home_of.cache_clear()
        machine_code._told.clear()
        machine_code._announcements.clear()
        spec = importlib.util.spec_from_file_location("tiny", tiny)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        capsys.readouterr()
        assert module.scaled(2.0) == 6.5
        return bool(module.scaled.stats.cache_hits), capsys.readouterr().err

    yield begin
    home_of.cache_clear()
    machine_code._told.clear()
    machine_code._announcements.clear()


@pytest.fixture
def kept(base):
    """Return what gives the one file that is kept."""

    def find():
        (path,) = base.glob(f"{OTHERS}-*/*{CODE}")
        return path

    return find


@pytest.fixture
def root():
    """Only root may give files away."""
    if os.geteuid() != 0:
        pytest.skip("only root may give files away")


def shorter(data, rng):
    return data[: rng.randrange(len(data))]


def zeroed(data, rng):
    start = rng.randrange(len(data))
    return data[:start] + bytes(len(data) - start)


def flipped(data, rng):
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]


def longer(data, rng):
    return data + bytes([rng.randrange(256)])


def emptied(data, rng):
    return b""


@pytest.fixture
def harms():
    """Return name → what spoils the bytes of a file."""
    return {harm.__name__: harm for harm in (shorter, zeroed, flipped, longer, emptied)}
