"""The notebook of the documentation, `docs/first_look.py`: every cell runs, and says what its text promises.

It is carried out by marimo, as ``marimo run`` does. The log in it is of a propeller with 0.47/0.366 of the thrust.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).resolve().parents[2] / "docs" / "first_look.py"


def app():
    spec = importlib.util.spec_from_file_location("first_look", NOTEBOOK)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.app


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of marimo's own
def test_every_cell_of_the_notebook_runs_and_the_verdict_is_that_of_the_propeller(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outputs, said = app().run()
    without, with_cable = said["peaks"].values()
    assert with_cable < without - 0.05, "20 m of cable in the water: slower from the beginning"
    assert "arc_length" in said["changed"]["cable_node_tension"].coords
    assert sum(type(one).__name__ == "Figure" for one in outputs) == 2
    (cause,) = said["verdict"].causes
    assert cause.id == "propeller_thrust_gain"
    assert cause.parameters["share"].low < 0.47 / 0.366 - 1.0 < cause.parameters["share"].high
    assert list(tmp_path.iterdir()) == [], "a notebook leaves no files"
