"""docs/own_controller.md, as a reader with an empty folder would go through it, and what it says of the results."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "own_controller.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```(sh|python)\n(.*?)```", PAGE, re.DOTALL)
LAW, GUIDE = BLOCKS[0][1], BLOCKS[1:]


def test_the_law_of_the_page_steers_back_from_every_error():
    """To starboard where the heading is too small, nose up where it is too deep, faster where it is too slow."""
    from subzero import autopilot
    from subzero.channels import Observation

    space: dict[str, object] = {}
    exec(LAW, space)
    law = space["make"](None, 0.1, None)
    level = Observation(*(0.0 for _ in Observation._fields))
    propeller, rudder, port, starboard = law.update(level, autopilot.Wanted(1.0, 0.1, -1.0))
    assert propeller > space["CRUISE"]
    assert rudder > 0.0
    assert port == starboard > 0.0


@pytest.mark.slow
def test_the_page_goes_through_from_an_empty_folder(tmp_path):
    (tmp_path / "mine.py").write_text(LAW, encoding="utf-8")
    environment = os.environ | {"PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}", "COLUMNS": "80"}
    said = ""
    for kind, block in GUIDE:
        function = f'subzero() {{ "{sys.executable}" -m subzero "$@"; }}\n'
        words = ["bash", "-e", "-c", function + block] if kind == "sh" else [sys.executable, "-c", block]
        done = subprocess.run(
            words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{block}\n{done.stderr[-2000:]}"
        said += done.stdout
    found = json.loads((tmp_path / "heading_step" / "summary.json").read_text(encoding="utf-8"))
    assert found["untethered"]["indices"]["settling_time_s"] < 3.0
    assert found["tethered"]["indices"]["settling_time_s"] is None, "on the cable it never arrives"
    off = [abs(float(one)) for one in re.findall(r"tethered: ([+-][\d.]+) degrees", said)]
    assert off[1] > 10.0 * off[3], "the integral takes what the cable asks for"
    assert (tmp_path / "motion.png").stat().st_size > 0
