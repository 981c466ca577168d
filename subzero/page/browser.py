"""The page in a browser without a window, to film its replay and to measure and test it.

Needs a Chromium with its driver on the machine, and the extra ``[animate]``: Selenium, and imageio-ffmpeg for films.
"""

from __future__ import annotations

import io
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.errors import UserError, missing_extra

if TYPE_CHECKING:
    from PIL import Image

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
)
"""No window, no graphics card, no network."""


@dataclass(frozen=True, kw_only=True)
class Film:
    """The size of a film [pixels], its frames a second, and how long it may be [s]: a longer run is shown faster."""

    width: int
    height: int
    rate: int
    longest: float


FILMS = {
    ".mp4": Film(width=960, height=540, rate=15, longest=20.0),
    ".gif": Film(width=640, height=360, rate=8, longest=12.0),  # every frame is stored whole
}
"""How a film of a kind is made."""

GIF_COLOURS = 96


def installed() -> tuple[str, str] | None:
    """Return the paths of a Chromium and of its driver, None if one of them is missing."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    driver = shutil.which("chromedriver")
    return (browser, driver) if browser and driver else None


def check_film() -> None:
    """Raise an error if a package that is needed to film is not installed, before anything is simulated.

    Raises:
        UserError: with the packages to install.
    """
    _needed()
    missing = [name for name in ("imageio_ffmpeg", "PIL") if find_spec(name) is None]
    if missing:
        raise missing_extra("A film of the replay", ", ".join(missing), "animate")


def _needed() -> tuple[str, str]:
    """Return the paths of a Chromium and of its driver, or refuse."""
    found = installed()
    if found is None:
        raise UserError(
            "A film of the replay is made with Chromium, which is not here. Install chromium and chromium-driver "
            "(Debian: apt install chromium chromium-driver), or leave --animate away: report.html has the replay."
        )
    if find_spec("selenium") is None:
        raise missing_extra("A film of the replay", "selenium", "animate")
    return found


@contextmanager
def opened(page: Path | str, *flags: str, width: int = 1400, height: int = 1000) -> Iterator[Any]:
    """Give a Selenium driver that has opened a page, with a profile of its own that is gone afterwards.

    Args:
        page: the file, or an address.
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
            driver.get(page if isinstance(page, str) else page.absolute().as_uri())
            yield driver
        finally:
            driver.quit()


def film(page: Path, out: Path, progress: Callable[[float], None] | None = None) -> None:
    """Film the replay of a page.

    Args:
        page: a ``report.html`` with a replay.
        out: the film, which ends in .gif or .mp4.
        progress: called with the fraction that is done, from 0 to 1.

    Raises:
        UserError: if what it takes is not installed, or the page has no replay.
    """
    check_film()
    style = FILMS[out.suffix]
    with opened(page) as driver:
        if not driver.execute_script("return Boolean(window.subzero)"):
            raise UserError(f"{page.name} has no replay to film.")
        end = float(driver.execute_script("subzero.look('turn'); return subzero.end"))
        times = np.linspace(0.0, end, max(2, round(min(end, style.longest) * style.rate)))

        def frames() -> Iterator[Image.Image]:
            for at, time in enumerate(times):
                yield picture(driver, float(time), style.width, style.height)
                if progress is not None:
                    progress((at + 1) / times.size)

        _write_gif(frames(), out, style) if out.suffix == ".gif" else _write_mp4(frames(), out, style)


def _write_gif(frames: Iterator[Image.Image], out: Path, style: Film) -> None:
    from PIL import Image

    few = [
        frame.quantize(GIF_COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE) for frame in frames
    ]
    few[0].save(out, save_all=True, append_images=few[1:], duration=round(1000 / style.rate), loop=0)


def _write_mp4(frames: Iterator[Image.Image], out: Path, style: Film) -> None:
    from imageio_ffmpeg import write_frames

    writer = write_frames(str(out), (style.width, style.height), fps=style.rate, quality=7)
    writer.send(None)
    for frame in frames:
        writer.send(frame.tobytes())
    writer.close()


def picture(driver: Any, time: float, width: int, height: int) -> Image.Image:
    """Return the replay at a time as an image of this size, with its labels, from an opened page."""
    from PIL import Image

    driver.execute_script("subzero.filmAt(...arguments)", time, width, height)
    png = driver.find_element("css selector", ".picture").screenshot_as_png
    return Image.open(io.BytesIO(png)).convert("RGB").resize((width, height))
