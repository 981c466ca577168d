"""The page of a run: one file that loads nothing, shows texts as texts, and whose player runs.

Configuration: `fig6` for two seconds, written by the command. Tolerance of the size: fig6 whole takes 1.0 MB of the
1.5 MB that a page of it may take.
"""

from __future__ import annotations

import re
import shutil
import subprocess

import pytest

import scenarios
from subzero.cli import main

UNKIND = 'A <script>alert(1)</script> & "quoted" $x$ [bold] ψ'


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    text = scenarios.path("fig6").read_text(encoding="utf-8")
    text = re.sub(r"(?m)^description = .*$", f"description = '{UNKIND}'", text)
    text = re.sub(r"(?m)^duration_s = [0-9.]+", "duration_s = 2.0", text)
    (folder / "mine.toml").write_text(text, encoding="utf-8")
    assert main(["compare", str(folder / "mine.toml"), "--out", str(folder / "out")]) == 0
    return folder / "out" / "report.html"


def test_a_page_loads_nothing(page):
    text = page.read_text(encoding="utf-8")
    assert len(text) < 1_500_000
    addresses = re.findall(r"""(?:src|href)\s*=\s*["']([^"']*)["']""", text)
    assert addresses
    assert all(one.startswith(("data:", "#")) for one in addresses), [one[:60] for one in addresses]


def test_texts_of_a_user_come_out_as_texts(page):
    text = page.read_text(encoding="utf-8")
    assert "<script>alert(1)" not in text
    assert "&lt;script&gt;alert(1)" in text


def test_the_players_modules_share_no_name(page):
    """They are joined to one script: a constant of two of them would stop it before it began."""
    scripts = re.findall(r"<script[^>]*>(.*?)</script>", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    player = max((one for one in scripts if "uPlot=function" not in one.replace(" ", "")), key=len)
    names = re.findall(r"(?m)^(?:(?:const|let)\s+(?=\w+ = )|function\s+|class\s+)(\w+)", player)
    assert len(names) > 50
    assert sorted(names) == sorted(set(names))


@pytest.mark.skipif(shutil.which("chromium") is None, reason="needs Debian's chromium")
def test_the_player_runs_in_a_browser_without_an_error(page, tmp_path):
    flags = (
        "--headless --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --disable-quic "
        "--no-first-run --disable-background-networking --disable-component-update --disable-sync "
        "--virtual-time-budget=4000 --enable-logging=stderr --dump-dom"
    )
    done = subprocess.run(
        ["chromium", *flags.split(), f"--user-data-dir={tmp_path}", page.as_uri()],
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    assert "Uncaught" not in done.stderr, done.stderr[-2000:]
    assert "of 2 s" in done.stdout  # the time beside the slider is written by the player
