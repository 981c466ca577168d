"""How large pages are and how fast their replay is drawn: ``python -m benchmarks.page [--figure]``.

Sizes: of fig6, and of two runs of 10 000 samples with 300 nodes each, made by repeating samples of fig6. Frames: on
this machine, by Chromium without a graphics card (SwiftShader), each frame drawn to its end, 1280 × 720 points: at
full resolution, and at the coarsest to which the player goes by itself on a slow machine. What a frame takes of all
processors hardly depends on what else this machine does. With --figure, the pictures in ``docs/figures`` are made anew.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil

import subzero
from subzero.figures import draw
from subzero.page import browser, page_of_runs
from subzero.results.summary import summary_of

FIGURES = Path(__file__).parent.parent / "docs" / "figures"
FRAMES = 60


def page_of(runs, path):
    """Write the page of some runs, and return how many megabytes it has."""
    path.write_text(
        page_of_runs(runs, summary_of(runs, None), draw(runs), command="subzero compare fig6"),
        encoding="utf-8",
    )
    return path.stat().st_size / 1e6


def long_run(run):
    """Return a run of 10 000 samples with 300 nodes, all of them from another run."""
    many = run.isel(time=np.arange(10_000) % run.sizes["time"], node=np.arange(300) % run.sizes["node"])
    many = many.assign_coords(time=0.1 * np.arange(10_000))
    many["node_count"] = ("time", np.full(10_000, 300))
    for name in ("cable_position", "cable_node_tension"):
        many[name] = many[name].fillna(0.0)
    return many


def frames(driver, fineness):
    """Return frames a second at so many pixels a point, and what a frame takes of all processors. [1/s, ms]."""
    driver.execute_script("subzero.filmAt(0, 1280, 720); subzero.setFineness(arguments[0])", fineness)
    driver.execute_script("return subzero.framesPerSecond(5)")  # the first ones compile shaders
    before = processor_seconds()
    rate = driver.execute_script(f"return subzero.framesPerSecond({FRAMES})")
    return rate, 1000.0 * (processor_seconds() - before) / FRAMES


def processor_seconds():
    """Return what the browser has taken of all processors so far. [s]."""
    children = psutil.Process().children(recursive=True)
    return sum(sum(one.cpu_times()[:2]) for one in children if one.status() != psutil.STATUS_ZOMBIE)


def pictures(driver):
    """Make the pictures of the documentation anew: beside the vehicle, and from above."""
    from PIL import Image

    for name, at, look in (("page_follows", 12.0, "follow"), ("page_sees_all", 30.0, "whole")):
        driver.execute_script("subzero.look(arguments[0])", look)
        image = browser.picture(driver, at, 800, 450)
        image.quantize(256, Image.Quantize.MAXCOVERAGE).save(FIGURES / f"{name}.png", optimize=True)


def main():
    runs = subzero.compare("fig6").runs
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "report.html"
        began = time.perf_counter()
        size = page_of(runs, page)
        print(f"fig6: {size:.2f} MB, made in {time.perf_counter() - began:.1f} s")
        if browser.installed():
            with browser.opened(page) as driver:
                print(f"load of this machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
                for words, fineness in (
                    ("1280 × 720 pixels", 1.0),
                    ("640 × 360 pixels, for 1280 × 720 points", 0.5),
                ):
                    rate, cost = frames(driver, fineness)
                    print(f"{words}: {rate:.0f} frames a second, {cost:.0f} ms of processor time each")
                if "--figure" in sys.argv:
                    driver.execute_script("subzero.setFineness(1)")
                    pictures(driver)
        many = {name: long_run(run if name == "tethered" else runs["tethered"]) for name, run in runs.items()}
        print(f"two runs of 10 000 samples and 300 nodes: {page_of(many, page):.2f} MB")


if __name__ == "__main__":
    main()
