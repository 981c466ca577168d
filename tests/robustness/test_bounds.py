"""No compiled code reads or writes beyond an array: every scenario and every scheme, with each index checked.

pytest -m slow tests/robustness/test_bounds.py         # compiles everything once more
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).with_name("bounded.py")
_spec = importlib.util.spec_from_file_location("bounded", SCRIPT)
assert _spec
assert _spec.loader
bounded = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(bounded)

LONGEST = 900.0
"""The first job compiles the coupled loop, which takes two minutes with all checks in it. [s]"""


@pytest.fixture(scope="module")
def checked(tmp_path_factory):
    """Run a job of `bounded` in a process of its own that checks indices; gives its exit code and what it said."""
    cache = tmp_path_factory.mktemp("checked")

    def run(name):
        environment = os.environ | {"NUMBA_BOUNDSCHECK": "1", "SUBZERO_CACHE_DIR": str(cache)}
        done = subprocess.run([sys.executable, str(SCRIPT), name], env=environment, capture_output=True, text=True,
                              check=False, timeout=LONGEST)  # fmt: skip
        return done.returncode, done.stderr

    return run


@pytest.mark.slow
def test_an_index_beyond_its_array_is_found(checked):
    code, said = checked("unbounded")
    assert code == 1
    assert "IndexError: index is out of bounds" in said


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in bounded.JOBS if name != "unbounded"])
def test_no_index_is_beyond_its_array(checked, name):
    assert checked(name) == (0, "")
