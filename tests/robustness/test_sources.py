"""Machine code is never stale: its key changes with every file that it is made of, with versions and with settings."""

from __future__ import annotations

import ast
import gc
import os
import shutil
import subprocess
import sys
from pathlib import Path

import llvmlite
import numba
import numpy as np
import pytest
from numba.core.registry import CPUDispatcher

import subzero
from subzero.jit.machine_code import compiler
from subzero.jit.sources import PACKAGES, Tree

ROOT = Path(subzero.__file__).resolve().parents[1]
COMPILED = ("cable", "vehicle", "subzero")


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of all sources."""
    top = tmp_path_factory.mktemp("copy")
    for package in PACKAGES:
        shutil.copytree(ROOT / package, top / package, ignore=shutil.ignore_patterns("__pycache__"))
    return top


@pytest.mark.parametrize("package", COMPILED)
def test_the_key_changes_with_any_file_that_the_code_is_made_of(copy, package):
    files = Tree(copy).made_of(package)
    before = Tree(copy).digest(files)
    assert before == Tree(ROOT).digest(Tree(ROOT).made_of(package))  # wherever it is installed
    for path in files:
        text = path.read_bytes()
        path.write_bytes(text + b"\nCONSTANT = 1\n")
        assert Tree(copy).digest(files) != before, path
        path.write_bytes(text)
    assert Tree(copy).digest(files) == before


@pytest.mark.parametrize("package", ["cable", "vehicle"])
def test_physics_is_made_of_its_whole_package(package):
    assert set((ROOT / package).rglob("*.py")) <= Tree(ROOT).made_of(package)


def test_neither_what_shows_results_nor_an_autopilot_is_in_any_key():
    """So an edit of them costs nobody a minute."""
    names = {str(path.relative_to(ROOT)) for package in COMPILED for path in Tree(ROOT).made_of(package)}
    assert {
        "cable/moving_end/state.py",
        "vehicle/state.py",
        "subzero/engine/coupling.py",
        "subzero/engine/run_state.py",
    } <= names
    assert (
        not {
            "subzero/results/tables.py",
            "subzero/cli/app.py",
            "subzero/cli/write_results.py",
            "subzero/records/record.py",
        }
        & names
    )
    assert not [name for name in names if name.startswith(("subzero/figures", "subzero/autopilot"))]


def parsed(path):
    """Return the files that a file imports, by Python's own parser: everywhere in it, in our packages."""
    found = set()
    package = path.relative_to(ROOT).parent.parts
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else ()
            origin = ".".join([*above, *([node.module] if node.module else [])])
            found |= {origin, *(f"{origin}.{alias.name}" for alias in node.names)}
    for name in found:
        if name.split(".")[0] in PACKAGES:
            path = ROOT.joinpath(*name.split("."))
            yield from (one for one in (path.with_suffix(".py"), path / "__init__.py") if one.is_file())


@pytest.mark.parametrize("package", COMPILED)
def test_every_import_leads_to_a_file_in_the_key(package):
    files = Tree(ROOT).made_of(package)
    for path in files:
        assert set(parsed(path)) <= files, path


def test_every_compiled_function_and_what_it_names_is_in_the_key_of_its_package():
    """Looked up in the running program: modules, functions and classes among the globals of compiled functions."""
    import subzero.diagnosis.inference
    import subzero.simulation.feng_allen  # noqa: F401 - these two lead to all of them

    files = {package: Tree(ROOT).made_of(package) for package in COMPILED}
    seen = 0
    for one in gc.get_objects():
        if type(one) is CPUDispatcher and (one.py_func.__module__ or "").partition(".")[0] in COMPILED:
            function = one.py_func
            named = [function, *(function.__globals__.get(name) for name in function.__code__.co_names)]
            homes = {
                getattr(value, "__module__", None) or getattr(value, "__name__", None) for value in named
            }
            for home in homes:
                module = sys.modules.get(home) if isinstance(home, str) else None
                if module and home.partition(".")[0] in PACKAGES:
                    assert Path(module.__file__) in files[function.__module__.partition(".")[0]], (
                        function,
                        home,
                    )
            seen += 1
    assert seen > 100


@pytest.mark.parametrize(
    "text",
    [
        "from cable.moving_end.state import a, b",
        "from cable import (  # one (of) two\n    arc as x,\n    line,\n)",
        "def f():\n    import cable.moving_end.chord_correction, cable.moving_end.state as y",
        "import os, \\\n    cable.moving_end.state",
        "from \\\n  cable.moving_end.state import *",
        "if True:\n\tfrom cable import line",
    ],
)
def test_imports_are_found_however_they_are_written(text, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(text)
    assert ROOT / "cable/moving_end/state.py" in Tree(ROOT).made_of("mine", path)


@pytest.mark.parametrize(
    ("text", "found"), [("from . import line", "line"), ("from ..a.line import x", "a/line")]
)
def test_relative_imports_are_found(text, found, tmp_path):
    inside = tmp_path / "cable" / "b" / "mine.py"
    for path in (inside, tmp_path / "cable/b/line.py", tmp_path / "cable/a/line.py"):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")
    inside.write_text(text)
    wanted = tmp_path / ("cable/a/line.py" if "/" in found else "cable/b/line.py")
    assert wanted in Tree(tmp_path)._led_to([inside])


def test_a_name_that_subzero_fetches_from_anywhere_leads_everywhere(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text("from subzero import CHANNELS")
    assert ROOT / "subzero/channels.py" in Tree(ROOT).made_of("mine", path)


@pytest.mark.parametrize(
    ("owner", "name", "value"),
    [
        (numba.config, "BOUNDSCHECK", 1),
        (numba.config, "OPT", 3),
        (numba.config, "LOOP_VECTORIZE", 0),
        (numba.config, "CPU_NAME", "generic"),
        (numba, "__version__", "0.0.1"),
        (llvmlite, "__version__", "0.0.1"),
        (np, "__version__", "0.0.1"),
        (sys, "version", "3.99"),
    ],
)
def test_versions_and_settings_of_the_compiler_are_in_the_key(monkeypatch, owner, name, value):
    before = compiler()
    monkeypatch.setattr(owner, name, value)
    assert compiler() != before


@pytest.mark.parametrize("name", ["CACHE_DIR", "NUMBA_NUM_THREADS", "COLOR_SCHEME", "_HAVE_YAML"])
def test_what_changes_no_code_is_not_in_the_key(monkeypatch, name):
    before = compiler()
    monkeypatch.setattr(numba.config, name, "another")
    assert compiler() == before


SETTLE = """
import numpy as np
from vehicle.actuators import ServoNumbers, settle
state = np.arange(21.0)
settle(state, np.zeros(4), (ServoNumbers(*[0.1] * len(ServoNumbers.names)),) * 3)
print(state.tolist())
"""


def test_compiled_code_is_what_interpreted_code_is_after_an_index_has_moved_in_another_file(copy, tmp_path):
    """`vehicle/state.py` compiles nothing itself; the code that it is part of stands in `vehicle/actuators.py`."""

    def settled(**environment):
        environment = {**os.environ, "SUBZERO_CACHE_DIR": str(tmp_path), **environment}
        done = subprocess.run([sys.executable, "-c", SETTLE], cwd=copy, capture_output=True, text=True, check=False,
                              env=environment)  # fmt: skip
        assert done.returncode == 0, done.stderr
        return done.stdout

    before = settled()
    path = copy / "vehicle/state.py"
    text = path.read_text(encoding="utf-8")
    assert "SERVO, CHARGE, LINKAGE = 13, 14, 17, 18" in text
    path.write_text(text.replace("= 13, 14, 17, 18", "= 13, 14, 20, 17"), encoding="utf-8")
    assert settled() == settled(NUMBA_DISABLE_JIT="1") != before
