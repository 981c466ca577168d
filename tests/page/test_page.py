"""The page of a run: one file that loads nothing, shows texts as texts, and whose player runs.

Configuration: `fig6` for two seconds, written by the command. Tolerance of the size: fig6 whole takes 1.0 MB of the
1.5 MB that a page of it may take.
"""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess

import pytest
import xarray as xr

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


IN_A_BROWSER = pytest.mark.skipif(shutil.which("chromium") is None, reason="needs Debian's chromium")
FLAGS = (
    "--headless --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --disable-quic "
    "--no-first-run --disable-background-networking --disable-component-update --disable-sync "
    "--virtual-time-budget=10000 --enable-logging=stderr --dump-dom"
)
SLIDE = """<script>setTimeout(() => {
  const slider = document.getElementById("time");
  slider.value = TIME; slider.dispatchEvent(new Event("input"));
  setInterval(() => { document.title = JSON.stringify(window.subzero.shown()); }, 100);
}, 100);</script>"""
"""What a hand at the slider does; the title tells what is on the screen, over and over, as a machine may be busy."""


def opened(path, profile):
    """Open a page in a browser of its own; return what it became and what the console said."""
    done = subprocess.run(
        ["chromium", *FLAGS.split(), f"--user-data-dir={profile}", path.as_uri()],
        capture_output=True, text=True, check=False, timeout=120,
    )  # fmt: skip
    return done.stdout, done.stderr


@IN_A_BROWSER
def test_the_player_runs_in_a_browser_without_an_error(page, tmp_path):
    became, said = opened(page, tmp_path)
    assert "Uncaught" not in said, said[-2000:]
    assert "of 2 s" in became  # the time beside the slider is written by the player


@IN_A_BROWSER
@pytest.mark.parametrize("time", [0.73, 1.6])
def test_the_slider_moves_the_vehicle_to_where_the_dataset_has_it(page, tmp_path, time):
    """To a millimetre: places are stored as whole numbers of a thirty-thousandth of the extent."""
    driven = tmp_path / "driven.html"
    driven.write_text(
        page.read_text(encoding="utf-8").replace("</body>", SLIDE.replace("TIME", str(time)) + "</body>")
    )
    became, said = opened(driven, tmp_path / "profile")
    title = re.search(r"<title>(.*?)</title>", became)
    assert title, said[-2000:]
    shown = json.loads(html.unescape(title[1]))
    assert shown["time"] == pytest.approx(time)
    for name in ("tethered", "untethered"):
        with xr.open_dataset(page.with_name(f"{name}.nc")) as run:
            place = [float(run[axis].interp(time=time)) for axis in ("north", "east", "depth")]
        assert shown["places"][name] == pytest.approx(place, abs=1e-3)
