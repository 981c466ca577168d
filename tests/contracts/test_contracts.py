"""Who may import whom, as `pyproject.toml` says under [tool.importlinter]."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_cable_vehicle_and_scenarios_do_not_know_one_another_and_data_flows_one_way():
    linter = shutil.which("lint-imports", path=str(Path(sys.executable).parent))
    assert linter, "import-linter comes with the extra [test]"
    done = subprocess.run([linter, "--no-cache"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert " kept, 0 broken." in done.stdout


@pytest.mark.long
def test_the_cable_runs_without_vehicle_scenarios_or_files():
    code = (
        "import sys, cable; cable.pull_out(lambda t: (1.0, 0.0, 0.0), 0.2);"
        "others = {'vehicle', 'scenarios', 'xarray', 'matplotlib', 'pydantic', 'cable.feng_allen'};"
        "print(sorted(others & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
