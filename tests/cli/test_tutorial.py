"""docs/tutorial.md, line by line, as a reader with an empty folder would go through it.

All lines of the shell and all Python of the page run in one folder, one after the other; what the page says of results
is held to the files that they leave.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```(sh|python)\n(.*?)```", PAGE, re.DOTALL)
SUBZERO = f'subzero() {{ "{sys.executable}" -m subzero "$@"; }}'


def test_every_command_of_the_page_is_understood():
    import shlex

    from subzero.cli.app import app

    lines = [line for kind, block in BLOCKS if kind == "sh" for line in block.splitlines()]
    commands = [shlex.split(line) for line in lines if line.startswith("subzero ")]
    assert {words[1] for words in commands} >= {"warm", "compare", "new", "validate", "plot", "diagnose"}
    for words in commands:
        command, _, _ = app.parse_args(words[1:], exit_on_error=False, print_error=False)
        assert callable(command)


@pytest.mark.slow
def test_the_tutorial_goes_through_from_an_empty_folder(tmp_path):
    environment = os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "80"}
    said = ""
    for kind, block in BLOCKS:
        words = ["bash", "-e", "-c", f"{SUBZERO}\n{block}"] if kind == "sh" else [sys.executable, "-c", block]
        done = subprocess.run(
            words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{block}\n{done.stderr[-2000:]}"
        said += done.stdout
    peaks = [float(one) for one in re.findall(r" m: ([\d.]+) m/s at most", said)]
    assert len(peaks) == 3
    assert peaks == sorted(peaks, reverse=True)  # more cable, less speed
    tethered = json.loads((tmp_path / "fig6" / "summary.json").read_text(encoding="utf-8"))["tethered"]
    assert tethered["speed_at_end_m_s"] < tethered["peak_speed_m_s"]  # "and loses it again"
    for name in ("fig6/report.html", "my_trial/tethered_tension.png", "my_trial/tethered_shape3d.png", "forces.png",
                 "found/report.html", "found/extended.toml", "mended/tethered.nc"):  # fmt: skip
        assert (tmp_path / name).stat().st_size > 0, name
