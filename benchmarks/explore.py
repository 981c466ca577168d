"""How soon `subzero explore` answers: ``python -m benchmarks.explore [--figure]``.

In Chromium without a graphics card, a click on the slider of the propeller of fig6, time and again elsewhere: how long
from the press of the mouse until the numbers are there, and until the replay and the plots are those of the new run.
With --figure, the picture in ``docs/figures`` is made anew.
"""

from __future__ import annotations

import io
import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from subzero.page import browser

FIGURE = Path(__file__).parent.parent / "docs" / "figures" / "explore.png"
SHARES = (0.8, 0.3, 0.6, 0.85, 0.55, 0.7)
WAIT_S = 20.0
WATCH = """
const frame = document.getElementById('replay').contentWindow, table = document.querySelector('.numbers');
const words = table.innerText, speed = () => frame.subzero.at(15).changed.surge_speed, before = speed();
window.took = null;
let pressed = 0, numbers = 0;
const look = () => {
  if (!numbers && table.innerText !== words) numbers = performance.now() - pressed;
  if (numbers && speed() !== before) window.took = [numbers, performance.now() - pressed];
  else requestAnimationFrame(look);
};
document.addEventListener('pointerdown', () => { pressed = performance.now(); look(); }, { capture: true, once: true });
"""


def clicked(driver, share):
    """Click at a share of the slider of the propeller; return when numbers and picture were there. [ms]"""
    from selenium.webdriver import ActionChains
    from selenium.webdriver.support.ui import WebDriverWait

    slider = driver.find_element("css selector", '[data-name="commands.propeller_rps"] .q-slider')
    driver.execute_script(WATCH)
    at = int((share - 0.5) * slider.size["width"])
    ActionChains(driver).move_to_element_with_offset(slider, at, 0).click().perform()
    return WebDriverWait(driver, WAIT_S, 0.05).until(lambda _: driver.execute_script("return window.took"))


def main():
    words = [sys.executable, "-m", "subzero", "explore", "fig6", "--port", "0", "--no-browser", "--json"]
    with tempfile.TemporaryDirectory() as folder, subprocess.Popen(words, cwd=folder, stdout=-1) as process:
        try:
            url = json.loads(b"".join(process.stdout.readline() for _ in range(3)))["url"]
            with browser.opened(url, width=1600, height=1060) as driver:
                measure(driver)
        finally:
            process.terminate()


def measure(driver):
    """Print how long it took, and make the picture if it is asked for."""
    from selenium.webdriver.support.ui import WebDriverWait

    there = "return Boolean(document.getElementById('replay').contentWindow.subzero)"
    WebDriverWait(driver, WAIT_S, 0.1).until(lambda _: driver.execute_script(there))
    took = [clicked(driver, share) for share in SHARES]
    for what, times in zip(("numbers", "replay and plots"), zip(*took, strict=True), strict=True):
        print(f"{what}: median {statistics.median(times):.0f} ms, {min(times):.0f} to {max(times):.0f} ms")
    if "--figure" in sys.argv:
        from PIL import Image

        image = Image.open(io.BytesIO(driver.get_screenshot_as_png())).convert("RGB").resize((1200, 690))
        image.quantize(256, Image.Quantize.MAXCOVERAGE).save(FIGURE, optimize=True)


if __name__ == "__main__":
    main()
