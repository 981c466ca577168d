"""docs/own_vehicle.md, line by line, with the log that it speaks of; what it says of results is held to the files.

The log is measured, of a vehicle that no shipped model describes: the right verdict is that nothing is near.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from subzero.records.record import read_record

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "own_vehicle.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
LOG = ROOT / "tests" / "data" / "bolt_auv" / "turn.csv"
SUBZERO = f'subzero() {{ "{sys.executable}" -m subzero "$@"; }}'


def test_every_command_of_the_page_is_understood():
    from subzero.cli.app import app

    commands = [
        shlex.split(line) for block in BLOCKS for line in block.splitlines() if line.startswith("subzero ")
    ]
    assert [words[1] for words in commands] == [
        "import",
        "validate",
        "compare",
        "calibrate",
        "diagnose",
    ]
    for words in commands:
        words = words[1 : words.index("||") if "||" in words else None]
        command, _, _ = app.parse_args(words, exit_on_error=False, print_error=False)
        assert callable(command)


@pytest.mark.slow
def test_the_page_goes_through_and_nothing_is_near(tmp_path):
    shutil.copy(LOG, tmp_path)
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
        "COLUMNS": "80",
    }
    said = ""
    for block in BLOCKS:
        words = ["bash", "-e", "-c", f"{SUBZERO}\n{block}"]
        done = subprocess.run(
            words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{block}\n{done.stderr[-2000:]}"
        said += done.stdout
    record = read_record(tmp_path / "flown.csv")
    written = np.loadtxt(LOG, delimiter=",", skiprows=1)
    np.testing.assert_allclose(record.values["heading"] % 360.0, np.degrees(written[:, 5]) % 360.0, atol=1e-6)
    np.testing.assert_allclose(record.values["depth"], written[:, 2], atol=1e-6)
    assert "T8                                     not used: the pulse of a motor" in said
    assert re.search(r"heading \[degree\] +tethered +60 +2[56]\.", said)
    assert not (tmp_path / "my_vehicle.toml").exists()
    assert json.loads((tmp_path / "my_vehicle.json").read_text())["verdict"] == "nothing_near"
    assert json.loads((tmp_path / "found" / "diagnosis.json").read_text())["verdict"] == "nothing_near"


@pytest.mark.slow
def test_a_log_of_whose_channels_some_would_be_left_without_samples_is_diagnosed(tmp_path):
    """The clock that is tried for its time of start would put all samples of a channel before the trial."""
    shutil.copy(LOG.with_name("dive.csv"), tmp_path)
    for words in (
        ["import", "dive.csv", "--out", "flown.csv", "--trial", "trial.toml"],
        ["diagnose", "trial.toml", "flown.csv", "--out", "found"],
    ):
        done = subprocess.run(
            [sys.executable, "-m", "subzero", *words],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr[-2000:]
    assert json.loads((tmp_path / "found" / "diagnosis.json").read_text())["verdict"] == "nothing_near"
