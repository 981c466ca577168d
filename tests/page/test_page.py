"""The page stands alone, says what users wrote as text, and holds all numbers without JavaScript."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from subzero.page.report import MODULES, asset, player

LINKING = ("src", "href", "srcset", "data", "action", "poster")


class Reader(HTMLParser):
    """Collects the tags, what they link to, the handlers that they carry, and the text outside scripts and styles."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.links: list[str] = []
        self.handlers: list[str] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.links += [value or "" for name, value in attrs if name in LINKING]
        self.handlers += [name for name, _ in attrs if name.startswith("on")]

    def handle_data(self, data: str) -> None:
        if self.tags[-1:] not in (["script"], ["style"]):
            self.text.append(data)


@pytest.fixture(scope="module")
def read(page: Path) -> Reader:
    reader = Reader()
    reader.feed(page.read_text(encoding="utf-8"))
    return reader


@pytest.mark.long
def test_it_loads_nothing(read: Reader, page: Path) -> None:
    assert all(link.startswith("data:image/svg+xml;base64,") for link in read.links)
    assert "link" not in read.tags
    assert not re.search(r"url\(|@import", asset("page.css"))
    assert not re.search(r"fetch\(|XMLHttpRequest|WebSocket|sendBeacon|importScripts", player())


def test_texts_of_users_are_text(read: Reader) -> None:
    assert read.handlers == []
    assert read.tags.count("script") == 3  # data, plots, player
    shown = " ".join("".join(read.text).split())
    assert (
        '<script>window.acted = 1</script><img src=x onerror="window.acted = 1"> $x^2$ [bold]ß漢字[/bold] &amp;'
        in shown
    )
    assert "subzero compare 'my <b>trial</b>.toml'" in shown


def test_the_numbers_are_there_without_javascript(read: Reader, runs: dict) -> None:
    shown = " ".join("".join(read.text).split())
    assert f"{float(runs['tethered']['surge_speed'].max()):.3f} at" in shown
    assert "largest cable force [N]" in shown
    assert read.tags.count("img") == 5


def test_fig6_stays_below_a_megabyte_and_a_half(page: Path) -> None:
    assert page.stat().st_size < 1.5e6


def test_the_player_is_all_of_its_modules_once() -> None:
    folder = Path(__file__).parents[2] / "subzero" / "page" / "assets" / "player"
    assert {path.stem for path in folder.glob("*.js")} == set(MODULES)
    assert not re.search(r"^(import|export) ", player(), flags=re.MULTILINE)


def test_the_players_modules_share_no_name() -> None:
    """They are joined to one script: a constant of two of them would stop it before it began."""
    names = re.findall(r"(?m)^(?:(?:const|let)\s+(?=\w+ = )|function\s+|class\s+)(\w+)", player())
    assert len(names) > 50
    assert sorted(names) == sorted(set(names))
