"""The scripts in examples/, each run in an empty folder: it ends well and leaves its picture."""

from __future__ import annotations

import ast
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

import cable
import subzero
import vehicle
from benchmarks.gallery import EXAMPLES

FOLDER = Path(__file__).resolve().parents[2] / "examples"
NAMES = sorted(path.stem for path in FOLDER.glob("*.py"))
SLOW = ("calibrate", "diagnose")
PUBLIC = {"subzero": subzero.__all__, "cable": cable.__all__, "vehicle": vehicle.__all__}
PUBLIC |= {"subzero.fmu": ["export_fmu"], "subzero.ardupilot": ["TetheredRov"]}
OTHERS = {"matplotlib.pyplot", "numpy", "gymnasium", "math", "pathlib", "json", "fmpy", "mujoco"}
PNG = b"\x89PNG\r\n"


def text(name):
    return (FOLDER / f"{name}.py").read_text(encoding="utf-8")


@pytest.fixture
def picture(tmp_path, monkeypatch):
    """Run a script as ``python examples/name.py`` in an empty folder would; return the path of its picture."""
    import matplotlib.pyplot as plt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["example"])
    plt.switch_backend("agg")

    def run(name):
        runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
        return tmp_path / f"{name}.png"

    yield run
    plt.close("all")


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in NAMES if name not in SLOW])
def test_an_example_leaves_its_picture(name, picture):
    if name == "tether_fmu":
        pytest.importorskip("pythonfmu", reason="the extra [fmu] is not installed")
        pytest.importorskip("fmpy", reason="FMPy, which steps the unit, is not installed")
    if name == "tether_mujoco":
        pytest.importorskip("mujoco", reason="MuJoCo, the host, is not installed")
    assert picture(name).read_bytes().startswith(PNG)


@pytest.mark.long
@pytest.mark.usefixtures("picture")
def test_a_drone_of_mujoco_carries_its_tether():
    """At rest at the end: its thrust carries both, to 1 %; the winch pulls as it was asked to, with 1 N."""
    pytest.importorskip("mujoco", reason="MuJoCo, the host, is not installed")
    end = runpy.run_path(str(FOLDER / "tether_mujoco.py"))
    pull, held = end["tether"].forces
    assert end["thrust"][2] - end["MASS"] * end["GRAVITY"] == pytest.approx(pull[2], rel=1e-2)
    assert pull[2] + held[2] == pytest.approx(end["line"].weight_in_water * end["tether"].length, rel=2e-2)
    assert np.linalg.norm(held) == pytest.approx(1.0, rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_a_slow_example_leaves_its_picture(name, picture):
    assert picture(name).read_bytes().startswith(PNG)


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_short_and_begins_with_one_sentence(name):
    tree = ast.parse(text(name))
    sentence = ast.get_docstring(tree)
    assert sentence
    assert "\n" not in sentence
    assert sentence.endswith(".")
    assert 10 <= len(text(name).splitlines()) <= 42


@pytest.mark.parametrize("name", NAMES)
def test_an_example_uses_public_names_only(name):
    for node in ast.walk(ast.parse(text(name))):
        if isinstance(node, ast.Import):
            assert {module.name for module in node.names} <= OTHERS | set(PUBLIC)
        elif isinstance(node, ast.ImportFrom):
            assert node.module in OTHERS | set(PUBLIC)
            assert {module.name for module in node.names} <= {
                *PUBLIC.get(node.module, ()),
                "Path",
                "simulate_fmu",
            }
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in PUBLIC:
            assert node.attr in PUBLIC[node.value.id]


def test_every_example_has_its_place_in_the_gallery():
    assert sorted(EXAMPLES) == NAMES
