"""`subzero explore`: what sliders say is what `Trial.with_changes` says, and the file that is saved says it too.

Runs are compared to the last bit. Behaviour is that of the public face: the values of `subzero.explore.exploration`,
the command, and the page in a real browser.
"""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.error import HTTPError

import numpy as np
import pytest

import scenarios
import subzero
from subzero.cli.app import MISTAKE, main
from subzero.explore.exploration import Exploration, Newest, sliders_of
from subzero.page import browser as browser_of_page
from subzero.results.summary import summarise

is_installed = find_spec("nicegui") is not None and find_spec("tomlkit") is not None
needs_extra = pytest.mark.skipif(
    not is_installed, reason="needs NiceGUI and tomlkit: pip install '.[explore]'"
)
needs_browser = pytest.mark.skipif(
    browser_of_page.installed() is None,
    reason="needs Debian's chromium and chromium-driver, which are not here",
)


def explored(name: str | Path, duration: float | None = None) -> Exploration:
    trial = subzero.load_scenario(name)
    trial = trial if duration is None else replace(trial, duration=duration)
    return Exploration(trial=trial, nominal=subzero.simulate(trial), simulate=subzero.simulate)


@pytest.fixture(scope="module")
def short() -> Exploration:
    return explored("fig6", 5.0)


def assert_alike(one: Any, other: Any) -> None:
    for name in ("surge_speed", "heading", "depth", "cable_tension", "cable_position"):
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)


# Sliders.


@pytest.mark.parametrize("name", scenarios.names())
def test_every_slider_of_a_shipped_trial_holds_its_value_and_its_ends_are_taken(name: str) -> None:
    trial = subzero.load_scenario(name)
    sliders = sliders_of(trial)
    assert {"cable.diameter", "water.current_north_m_s", "run.duration_s"} <= {one.name for one in sliders}
    for one in sliders:
        assert one.low <= one.nominal <= one.high, one.name
        assert 100 <= (one.high - one.low) / one.step <= 400, one.name
        if one.name != "run.duration_s":  # a prescribed motion ends when it ends
            for end in (one.low, one.high):
                assert trial.with_changes(one.changes(end)), one.name


def test_a_list_of_commands_keeps_its_shape_over_time() -> None:
    trial = subzero.load_scenario("zigzag")
    rudder = next(one for one in sliders_of(trial) if one.name == "commands.rudder_deg")
    before, after = (one.commands.values[:, 1] for one in (trial, trial.with_changes(rudder.changes(-3.0))))
    largest = before[np.argmax(np.abs(before))]
    np.testing.assert_allclose(after, before * np.radians(-3.0) / largest, rtol=1e-14)


def test_a_cable_file_without_ranges_has_sliders_for_what_is_not_zero(tmp_path: Path) -> None:
    assert main(["new", str(tmp_path / "bare.toml"), "--like", "table1"]) == 0
    text = (tmp_path / "bare.toml").read_text(encoding="utf-8")
    (tmp_path / "bare.toml").write_text(re.sub(r", range = \[[^]]*\]", "", text), encoding="utf-8")
    text = subzero.load_scenario("fig6").text.replace('cable = "table1"', 'cable = "bare.toml"')
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    sliders = {one.name: one for one in sliders_of(subzero.load_scenario(tmp_path / "own.toml"))}
    diameter = sliders["cable.diameter"]
    assert (diameter.low, diameter.high, diameter.declared) == (0.00125, 0.005, None)
    assert "drum.inertia" not in sliders


# Runs.


def test_a_change_is_the_run_of_with_changes(short: Exploration) -> None:
    answer = short.answer({"commands.propeller_rps": 31.0, "cable.diameter": 0.004, "start.depth_m": 1.0})
    changes = {"commands.propeller_rps": 31.0, "cable.diameter": 0.004}  # the depth is the trial's own
    assert_alike(answer.run, subzero.simulate(short.trial.with_changes(changes)))
    assert float(answer.run["surge_speed"][-1]) > float(short.nominal["surge_speed"][-1]) + 0.1


def test_sliders_as_in_the_file_give_the_nominal_run_without_another(short: Exploration) -> None:
    assert short.answer({"commands.propeller_rps": 25.0}).run is short.nominal


def test_a_refused_value_is_told_beside_its_slider_in_the_words_of_the_file_reader(
    short: Exploration, tmp_path: Path
) -> None:
    answer = short.answer({"start.depth_m": -1.0, "cable.diameter": -1.0, "run.duration_s": 4.0})
    assert answer.run is None
    assert set(answer.refusals) == {"start.depth_m", "cable.diameter"}
    text = short.trial.text.replace("depth_m = 1.0", "depth_m = -1.0") + '"cable.diameter" = -1.0\n'
    (tmp_path / "wrong.toml").write_text(text, encoding="utf-8")
    with pytest.raises(scenarios.ScenarioError) as refused:
        subzero.load_scenario(tmp_path / "wrong.toml")
    reported = "\n".join(answer.refusals.values())
    for problem in refused.value.problems:
        assert f"found {problem.found}, but {problem.why}. {problem.remedy}" in reported


def test_numbers_are_set_beside_the_nominal_ones(short: Exploration) -> None:
    faster = summarise(short.answer({"commands.propeller_rps": 31.0}).run)
    rows = {row[0]: row[1:] for row in short.numbers(faster)}
    before, after, change = rows["peak speed [m/s]"]
    assert (before, after) == tuple(
        f"{float(run['surge_speed'].max()):.3f}"
        for run in (short.nominal, short.answer({"commands.propeller_rps": 31.0}).run)
    )
    assert float(change.split()[0]) == pytest.approx(float(after) - float(before), abs=1.001e-3)
    assert all(change == "–" for _, _, _, change in short.numbers(short.nominal_summary))


# The file.


def saved(one: Exploration, values: dict[str, float], path: Path) -> Any:
    path.unlink(missing_ok=True)
    one.save(values, path)
    return subzero.load_scenario(path)


@pytest.mark.long
@needs_extra
@pytest.mark.parametrize("name", ["fig6", "zigzag", "rov_umbilical", "current"])
def test_a_saved_file_is_the_same_trial_to_the_last_bit_whatever_was_moved(name: str, tmp_path: Path) -> None:
    from subzero.simulation.provenance import trial_digest

    trial = subzero.load_scenario(name)
    one = Exploration(trial=trial, nominal=None, simulate=None)  # type: ignore[arg-type]  # nothing is run
    for slider in sliders_of(trial):
        if slider.section == "motion":
            continue  # the start of a prescribed motion is read from it
        values = {slider.name: slider.low + 0.317 * (slider.high - slider.low)}
        again = saved(one, values, tmp_path / "again.toml")
        assert trial_digest(again) == trial_digest(trial.with_changes(one.changes(values))), slider.name
        assert trial_digest(again) != trial_digest(trial), slider.name


@needs_extra
@pytest.mark.parametrize(
    "name, values",
    [
        ("fig6", {"commands.rudder_deg": -7.3, "cable.diameter": 0.0037, "run.duration_s": 7.0}),
        ("fig5", {"motion.surge_speed_m_s": 0.77, "start.wet_length_m": 3.1, "run.duration_s": 6.0}),
    ],
)
def test_a_saved_file_simulates_to_the_same_run(name: str, values: dict[str, float], tmp_path: Path) -> None:
    one = explored(name)
    again = saved(one, values, tmp_path / "again.toml")
    assert_alike(subzero.simulate(again), one.answer(values).run)
    assert "# The water trial" in again.text or name != "fig6", "remarks stay"


@needs_extra
def test_a_trial_with_files_of_its_own_is_saved_elsewhere(tmp_path: Path) -> None:
    home, other = tmp_path / "home", tmp_path / "other"
    home.mkdir()
    other.mkdir()
    assert main(["new", str(home / "thin.toml"), "--like", "table1"]) == 0
    (home / "go.csv").write_text(
        "time_s,propeller_rps,rudder_deg,stern_plane_port_deg,stern_plane_starboard_deg\n0,25,0,0,0\n1,25,3,0,0\n3,25,0,0,0\n"
    )
    (home / "own.toml").write_text(
        'description = "own"\nvehicle = "subzero2"\ncable = "thin.toml"\n[run]\nduration_s = 3.0\n'
        '[commands]\nfile = "go.csv"\n[changes]\ncable.diameter = 0.003\n'
    )
    one = explored(home / "own.toml")
    assert not [name for name in one.sliders if name.startswith("commands.")], "the lists stand in a CSV file"
    values = {"cable.diameter": 0.0041, "drum.inertia": 5e-4, "water.current_east_m_s": 0.2}
    again = saved(one, values, other / "again.toml")
    assert (again.cable["diameter"], again.drum["inertia"]) == (0.0041, 5e-4)
    assert again.text.count("diameter") == 2, "in the head, and where it was"
    assert_alike(subzero.simulate(again), one.answer(values).run)
    with pytest.raises(scenarios.ScenarioError, match="the file ends early"):
        one.save({"run.duration_s": 9.0}, other / "longer.toml")
    with pytest.raises(subzero.UserError, match="exists and is left alone"):
        one.save(values, other / "again.toml")
    assert [path.name for path in other.iterdir()] == ["again.toml"]


# The newest wins.


class Worker:
    """Works on a request until it may end; looks for news now and then as soon as it may."""

    def __init__(self) -> None:
        self.found: list[int] = []
        self.taken_up: list[int] = []
        self.errors: list[Exception] = []
        self.started, self.may_look, self.may_end, self.has_ended = (threading.Event() for _ in range(4))

    def work(self, request: int, progress: Callable[[float], None]) -> int:
        if request < 0:
            raise ZeroDivisionError
        self.taken_up.append(request)
        self.started.set()
        assert self.may_look.wait(5.0)
        while not self.may_end.wait(0.005):
            progress(0.5)
        return request

    def done(self, found: int) -> None:
        self.found.append(found)
        self.has_ended.set()

    def failed(self, error: Exception) -> None:
        self.errors.append(error)
        self.has_ended.set()


def test_the_newest_request_wins_and_old_ones_are_given_up() -> None:
    worker = Worker()
    newest = Newest(worker.work, worker.done)
    newest.ask(1)
    assert worker.started.wait(5.0)
    for request in (2, 3, 4):
        newest.ask(request)
    worker.may_look.set()
    threading.Timer(0.1, worker.may_end.set).start()
    assert worker.has_ended.wait(5.0)
    newest.end()
    assert worker.found == [4]
    assert worker.taken_up == [1, 4], "2 and 3 were forgotten while 1 was in work"


def test_a_bug_in_one_request_is_told_and_the_next_one_is_worked_on(
    capsys: pytest.CaptureFixture[str],
) -> None:
    worker = Worker()
    worker.may_look.set()
    worker.may_end.set()
    newest = Newest(worker.work, worker.done, worker.failed)
    for request in (-1, 5):
        worker.has_ended.clear()
        newest.ask(request)
        assert worker.has_ended.wait(5.0)
    newest.end()
    assert [type(one) for one in worker.errors] == [ZeroDivisionError]
    assert worker.found == [5]
    assert "ZeroDivisionError" in capsys.readouterr().err


# The command.


def test_what_is_not_installed_is_one_message(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("subzero.explore.page.find_spec", lambda name: None)
    assert main(["explore", "fig6"]) == MISTAKE
    said = capsys.readouterr().err
    assert said == "A page to explore needs nicegui, tomlkit: pip install 'subzero-auv[explore]'.\n"


@needs_extra
def test_a_port_that_cannot_be_had_is_one_message(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        assert main(["explore", "fig6", "--port", str(port)]) == MISTAKE
    said = capsys.readouterr().err
    assert said == f"Port {port} of 127.0.0.1 is in use. Give another one, or --port 0 for any.\n"
    assert main(["explore", "fig6", "--port", "70000"]) == MISTAKE
    assert "0 to 65535" in capsys.readouterr().err


def heed_again() -> None:
    """Let interrupts through again: what is started in the background by a shell ignores them."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def served(folder: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Give the running command and the address that it has told."""
    words = [sys.executable, "-m", "subzero", "explore", "fig6", "--port", "0", "--no-browser", "--json"]
    with subprocess.Popen(
        words, cwd=folder, text=True, stdout=-1, stderr=-1, preexec_fn=heed_again
    ) as process:
        try:
            assert process.stdout is not None
            reported = "".join(process.stdout.readline() for _ in range(3))
            yield process, reported.split('"')[3]
        finally:
            process.kill()


@pytest.mark.long
@needs_extra
def test_only_this_machine_is_served_and_ctrl_c_ends_it(tmp_path: Path) -> None:
    with served(tmp_path) as (process, url):
        assert url.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(url, timeout=20) as page:
            assert b"subzero explore fig6" in page.read()
        with pytest.raises(HTTPError, match="400"):  # a name that another site has let lead to this machine
            urllib.request.urlopen(urllib.request.Request(url, headers={"Host": "example.org"}), timeout=20)
        process.send_signal(signal.SIGINT)
        assert process.wait(60.0) == 130
        assert process.stderr is not None
        said = process.stderr.read()
    assert said.endswith("Interrupted; the page is closed, and files that were saved stay.\n")
    assert "Traceback" not in said


# The page in a browser.


def soon(driver: Any, found: Callable[[Any], Any]) -> Any:
    from selenium.webdriver.support.ui import WebDriverWait

    return WebDriverWait(driver, 20.0, 0.05).until(found)


def shown(driver: Any, words: str) -> list[str]:
    """Return the cells of a row of the table of numbers."""
    rows = driver.execute_script(
        "const rows = [...document.querySelectorAll('.numbers tr')];"
        "return rows.map((row) => [...row.children].map((one) => one.innerText))"
    )
    return next(cells for name, *cells in rows if name == words)


@pytest.mark.long
@needs_extra
@needs_browser
def test_a_slider_moves_the_numbers_and_the_replay_to_those_of_simulate(tmp_path: Path) -> None:
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.keys import Keys

    trial = subzero.load_scenario("fig6")

    def peak(one: Any) -> str:
        return f"{float(subzero.simulate(one)['surge_speed'].max()):.3f}"

    def of_knob(part: str, name: str = "commands.propeller_rps") -> Any:
        return driver.find_element("css selector", f'[data-name="{name}"] {part}')

    with served(tmp_path) as (_, url), browser_of_page.opened(url) as driver:
        soon(driver, lambda _: driver.execute_script("return Boolean(replay.contentWindow.subzero)"))
        nominal = peak(trial)
        assert shown(driver, "peak speed [m/s]") == [nominal, nominal, "–"]
        handle = of_knob(".q-slider")
        ActionChains(driver).move_to_element_with_offset(
            handle, handle.size["width"] // 4, 0
        ).click().perform()
        soon(driver, lambda _: shown(driver, "peak speed [m/s]")[1] != nominal)
        value = float(of_knob("input").get_attribute("value"))
        changed = trial.with_changes({"commands.propeller_rps": value})
        assert value > 30.0
        assert shown(driver, "peak speed [m/s]")[:2] == [nominal, peak(changed)]
        end = subzero.simulate(changed).isel(time=-1)
        at_end = "return replay.contentWindow.subzero.at(30).changed.surge_speed"
        soon(
            driver,
            lambda _: driver.execute_script(at_end) == pytest.approx(float(end["surge_speed"]), abs=1e-4),
        )
        seen = "const one = replay.contentWindow.subzero; one.seek(30); return one.shown().places.changed"
        expected = [float(end[name]) for name in ("north", "east", "depth")]
        assert driver.execute_script(seen) == pytest.approx(expected, abs=2e-3), "as in test_browser"

        driver.find_element("id", "save").click()
        soon(driver, lambda _: "subzero simulate" in driver.find_element("css selector", ".saved").text)
        assert peak(subzero.load_scenario(tmp_path / "fig6_changed.toml")) == peak(changed)

        field = of_knob("input", "cable.diameter")
        field.send_keys(Keys.CONTROL, "a")
        field.send_keys("-1")
        soon(driver, lambda _: "Allowed: 1e-06 to 1 m" in of_knob(".refused", "cable.diameter").text)
        driver.find_element("id", "reset").click()
        soon(driver, lambda _: shown(driver, "peak speed [m/s]")[1] == nominal)
        soon(driver, lambda _: of_knob("input").get_attribute("value") == "25")
        assert of_knob(".refused", "cable.diameter").text == ""
        assert driver.get_log("browser") == []
