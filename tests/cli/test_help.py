"""Help, version and list answer at once, because nothing heavy is imported before it is needed."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

import scenarios
import subzero
from subzero.cli.app import FINE, main

FORMATS = ("pydantic", "pydantic_core")
"""What reads a scenario: light enough for a mistake in one, not needed for help."""

HEAVY = ("numba", "xarray", "pandas", "matplotlib", "scipy", "netCDF4", "control", "vehicle", "cable")


@pytest.mark.parametrize(
    "words, refused",
    [
        (["--help"], (*HEAVY, *FORMATS, "numpy")),
        (["compare", "--help"], (*HEAVY, *FORMATS, "numpy")),
        (["--nonsense"], (*HEAVY, *FORMATS, "numpy")),
        (["list"], HEAVY + FORMATS),
        (["compare", "fig66"], HEAVY),
        (["compare", "fig6", "--measured", "none.csv"], HEAVY),
        (["simulate", "fig6", "--out", "/dev/null"], HEAVY),
    ],
)
def test_help_and_mistakes_import_nothing_heavy(words, refused):
    code = f"""if True:
        import sys
        from subzero.cli.app import main
        main({words!r})
        print("LOADED", *(name for name in {refused!r} if name in sys.modules))
    """
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.rstrip().endswith("LOADED"), done.stdout[-200:]


def test_workers_of_a_sweep_can_begin_before_numpy_is_there():
    """What starts them is imported with the command line; they import the rest while the command reads its file."""
    code = "import sys, subzero.cli.app, subzero.sweeps.workers; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_importing_subzero_imports_next_to_nothing():
    code = (
        "import sys, importlib, typing; before = set(sys.modules)\n"
        "import subzero; print(sorted(set(sys.modules) - before))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "['subzero']"


def test_every_public_name_is_there_and_an_unknown_one_is_told():
    for name in subzero.__all__:
        if name not in (
            "simulate",
            "compare",
            "Comparison",
            "check",
            "Refinement",
        ):  # these import the physics: see test_end_to_end
            assert getattr(subzero, name) is not None
    with pytest.raises(
        AttributeError, match="module 'subzero' has no attribute 'simulat'; it has CHANNELS, "
    ):
        subzero.simulat  # noqa: B018


def test_help_names_every_command_and_option(capsys):
    for words, expected in {
        ("--help",): ("compare", "list", "simulate", "--version"),
        ("simulate", "--help"): ("SCENARIO", "--untethered", "--commands", "--out"),
        ("compare", "--help"): ("SCENARIO", "--measured", "--commands", "--out"),
    }.items():
        assert main(words) == FINE
        said = capsys.readouterr().out
        assert all(word in said for word in expected), said


def test_list_shows_every_scenario_with_its_description(capsys):
    assert main(["list"]) == FINE
    said = " ".join(capsys.readouterr().out.split())
    for name in scenarios.names():
        assert f"{name} {scenarios.describe(name).split()[0]}" in said


def test_version_is_that_of_the_package(capsys):
    assert main(["--version"]) == FINE
    assert capsys.readouterr().out.strip() == subzero.__version__


def test_a_terminal_without_our_letters_is_no_reason_to_fail():
    plain = {**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"}
    code = """if True:
        import sys
        from subzero.cli.app import main
        main(["nonsense\u2212"])
        print("still here \u2212")
    """
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=plain)
    assert 'Unknown command "nonsense?".' in done.stderr
    assert done.stdout == "still here ?\n"
