"""The page in a browser without a window, to film its replay and to measure and test it.

Needs a Chromium with its driver on the machine, and the extra ``[animate]``: Selenium, and imageio to write films.
"""

from __future__ import annotations

import io
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.errors import UserError, listed

if TYPE_CHECKING:
    from numpy.typing import NDArray

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = ("--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
         "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update",
         "--disable-sync", "--hide-scrollbars")  # fmt: skip
"""No window, no graphics card, no network."""

WIDTH, HEIGHT = 960, 540
"""Size of a film. [pixels]"""

FRAMES_PER_SECOND, LONGEST_S = 15, 20.0
"""Of a film; a longer run is shown faster, so that its film is not longer than this."""


def installed() -> tuple[str, str] | None:
    """Return the paths of a Chromium and of its driver, None if one of them is missing."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    driver = shutil.which("chromedriver")
    return (browser, driver) if browser and driver else None


def check_film() -> None:
    """Refuse to film where something that it takes is not installed, before anything is simulated.

    Raises:
        UserError: says what to install.
    """
    _needed()
    missing = [name for name in ("imageio", "imageio_ffmpeg", "PIL") if find_spec(name) is None]
    if missing:
        raise UserError(f"A film of the replay needs {listed(missing)}. pip install 'subzero[animate]'.")


def _needed() -> tuple[str, str]:
    """Return the paths of a Chromium and of its driver, or refuse."""
    found = installed()
    if found is None:
        raise UserError(
            "A film of the replay is made with Chromium, which is not here. Install chromium and chromium-driver "
            "(Debian: apt install chromium chromium-driver), or leave --animate away: report.html has the replay."
        )
    if find_spec("selenium") is None:
        raise UserError("A film of the replay needs selenium. pip install 'subzero[animate]'.")
    return found


@contextmanager
def opened(page: Path, *flags: str, width: int = 1400, height: int = 1000) -> Iterator[Any]:
    """Give a Selenium driver that has opened a page, with a profile of its own that is gone afterwards.

    Args:
        page: the file.
        flags: more flags of Chromium.
        width: of the window. [pixels]
        height: of the window. [pixels]

    Raises:
        UserError: if Chromium, its driver or Selenium are not installed.
    """
    browser, driver_path = _needed()
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    with tempfile.TemporaryDirectory(prefix="subzero-browser-", ignore_cleanup_errors=True) as profile:
        options = webdriver.ChromeOptions()
        options.binary_location = browser
        for flag in (*FLAGS, f"--window-size={width},{height}", f"--user-data-dir={profile}", *flags):
            options.add_argument(flag)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        driver = webdriver.Chrome(options=options, service=Service(driver_path))
        try:
            driver.get(page.absolute().as_uri())
            yield driver
        finally:
            driver.quit()


def film(page: Path, out: Path, progress: Callable[[float], None] | None = None) -> None:
    """Film the replay of a page.

    Args:
        page: a ``report.html`` with a replay.
        out: the film, which ends in .gif or .mp4.
        progress: told the fraction that is done, from 0 to 1.

    Raises:
        UserError: if what it takes is not installed, or the page has no replay.
    """
    check_film()
    import imageio.v2 as imageio

    with opened(page) as driver:
        if not driver.execute_script("return Boolean(window.subzero)"):
            raise UserError(f"{page.name} has no replay to film.")
        end = float(driver.execute_script("subzero.look('turn'); return subzero.end"))
        count = max(2, round(min(end, LONGEST_S) * FRAMES_PER_SECOND))
        style = (
            {"duration": 1000.0 / FRAMES_PER_SECOND, "loop": 0}
            if out.suffix == ".gif"
            else {"fps": FRAMES_PER_SECOND}
        )
        with imageio.get_writer(out, **style) as writer:
            for at, time in enumerate(np.linspace(0.0, end, count)):
                writer.append_data(picture(driver, float(time)))
                if progress is not None:
                    progress((at + 1) / count)


def picture(driver: Any, time: float, width: int = WIDTH, height: int = HEIGHT) -> NDArray[np.uint8]:
    """Return the replay at a time as an image (height, width, 3), with its labels, from an opened page."""
    from PIL import Image

    driver.execute_script("subzero.filmAt(...arguments)", time, width, height)
    png = driver.find_element("css selector", ".picture").screenshot_as_png
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
