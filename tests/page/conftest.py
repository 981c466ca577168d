"""Two short runs of fig6 with names that try to act, and their page."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

import subzero
from subzero.page import page_of_runs

EVIL = (
    '<script>window.acted = 1</script><img src=x onerror="window.acted = 1"> $x^2$ [bold]ß漢字[/bold] &amp; '
    * 4
)
COMMAND = "subzero compare 'my <b>trial</b>.toml'"


@pytest.fixture(scope="session")
def runs() -> dict[str, object]:
    trial = dataclasses.replace(subzero.load_scenario("fig6"), description=EVIL, duration=12.0)
    return subzero.compare(trial).runs


@pytest.fixture(scope="session")
def page(runs: dict, tmp_path_factory: pytest.TempPathFactory) -> Path:
    from subzero.figures import draw
    from subzero.results.summary import summary_of

    path = tmp_path_factory.mktemp("page") / "report.html"
    text = page_of_runs(runs, summary_of(runs, None), draw(runs), command=COMMAND)
    path.write_text(text, encoding="utf-8")
    return path
