"""The documentation is a site: every page is reached, no link leads nowhere, every function of the reference exists."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_every_page_is_in_the_navigation():
    said = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("nav:")[2]
    assert [page.name for page in (ROOT / "docs").glob("*.md") if f": {page.name}" not in said] == []


def test_every_picture_is_on_a_page():
    text = "".join(
        page.read_text(encoding="utf-8") for page in [*(ROOT / "docs").glob("*.md"), ROOT / "README.md"]
    )
    assert [
        path.name for path in (ROOT / "docs" / "figures").iterdir() if f"figures/{path.name}" not in text
    ] == []


@pytest.mark.slow
def test_the_site_is_built_without_a_warning(tmp_path):
    """``strict`` stands in mkdocs.yml: a warning is an error."""
    words = [sys.executable, "-m", "mkdocs", "build", "--site-dir", str(tmp_path / "site")]
    quiet = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(words, cwd=ROOT, env=quiet, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    reference = (tmp_path / "site" / "api" / "index.html").read_text(encoding="utf-8")
    assert all(
        f'id="{name}"' in reference for name in ("subzero.simulation.run.simulate", "cable.history.History")
    )
