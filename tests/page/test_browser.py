"""The page in a real browser: it opens without an error, and the slider moves the vehicle to where the dataset says.

Places are compared to 2 mm: half a step of 16 bits on a track of ten metres, and the 32 bits of a graphics card.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from subzero.page import browser as browser_of_page

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        browser_of_page.installed() is None,
        reason="needs Debian's chromium and chromium-driver, which are not here",
    ),
]


@pytest.fixture(scope="module")
def browser(page: Path) -> Iterator[Any]:
    with browser_of_page.opened(page) as driver:
        yield driver


def place_of(run: Any, time: float) -> np.ndarray:
    return np.array([np.interp(time, run["time"], run[name]) for name in ("north", "east", "depth")])


def moved_to(browser: Any, time: float) -> dict[str, Any]:
    slide = "const s = document.getElementById('time'); s.value = arguments[0]; s.dispatchEvent(new Event('input'));"
    browser.execute_script(slide, time)
    return browser.execute_script("return subzero.shown()")


def test_it_opens_without_an_error_and_nothing_acts(browser: Any) -> None:
    assert browser.get_log("browser") == []
    assert browser.execute_script("return window.acted === undefined")
    assert browser.find_element("id", "no-webgl").is_displayed() is False


@pytest.mark.parametrize("time", [0.0, 3.0, 7.43, 12.0])
def test_the_slider_moves_the_vehicles_to_where_the_dataset_says(
    browser: Any, runs: dict, time: float
) -> None:
    shown = moved_to(browser, time)
    assert shown["time"] == pytest.approx(time)
    for name, run in runs.items():
        np.testing.assert_allclose(shown["places"][name], place_of(run, time), atol=2e-3, err_msg=name)


def test_a_click_in_a_plot_moves_the_replay(browser: Any) -> None:
    from selenium.webdriver import ActionChains

    moved_to(browser, 0.0)
    plot = browser.find_element("css selector", "#plots .u-over")
    ActionChains(browser).move_to_element(plot).click().perform()
    assert browser.execute_script("return subzero.shown().time") == pytest.approx(6.0, abs=0.2)  # its middle


def test_keys_and_the_button_play_and_step(browser: Any) -> None:
    from selenium.webdriver.common.keys import Keys

    moved_to(browser, 6.0)
    canvas = browser.find_element("id", "scene")
    canvas.send_keys(Keys.ARROW_RIGHT)
    assert browser.execute_script("return subzero.shown().time") == pytest.approx(6.06)
    canvas.send_keys("v")
    assert browser.execute_script("return subzero.shown().camera") == "stay"
    browser.find_element("id", "play").click()
    assert browser.execute_script("return subzero.shown().isPlaying")
    browser.find_element("id", "play").click()
    assert browser.get_log("browser") == []


def test_without_webgl_there_are_flat_views(page: Path, runs: dict) -> None:
    with browser_of_page.opened(page, "--disable-3d-apis") as driver:
        assert driver.find_element("id", "no-webgl").is_displayed()
        shown = moved_to(driver, 9.0)
        np.testing.assert_allclose(shown["places"]["tethered"], place_of(runs["tethered"], 9.0), atol=2e-3)
        assert not [line for line in driver.get_log("browser") if "Uncaught" in line["message"]]


def test_a_picture_of_the_replay_shows_the_yellow_vehicle_in_its_middle(browser: Any) -> None:
    browser.execute_script("subzero.look('follow')")  # whatever a test before has done
    image = np.asarray(browser_of_page.picture(browser, 6.0, 640, 360), dtype=float)
    assert image.shape == (360, 640, 3)
    red, green, blue = image[150:210, 270:370].reshape(-1, 3).T
    assert np.mean((red > 1.5 * blue) & (green > 1.2 * blue)) > 0.1  # yellow: nothing else here is


def test_thrusters_of_a_vehicle_push_as_in_the_dataset(tmp_path: Path) -> None:
    """An arrow for each thruster of the vehicle, as long as its share of full thrust says."""
    from dataclasses import replace

    import subzero
    from subzero.page import page_of_runs
    from subzero.results.summary import summary_of

    run = subzero.simulate(replace(subzero.load_scenario("rov_turn"), duration=6.0), tethered=False)
    path = tmp_path / "rov.html"
    path.write_text(page_of_runs({"untethered": run}, summary_of({"untethered": run}, None), {}, command="x"))
    with browser_of_page.opened(path) as driver:
        pushes = moved_to(driver, 4.0)["pushes"]["untethered"]
        assert driver.get_log("browser") == []
    at = run.sel(time=4.0, method="nearest")
    wanted = {
        name: float(share)
        for name, share in zip(at["thruster"].values, at["thruster_command"].values, strict=True)
    }
    assert len(pushes) == 8
    assert pushes == pytest.approx(wanted, abs=1e-3)
