"""The page of `subzero explore` answers its owner's browser alone, takes whatever that sends, and does not grow.

One command is started and asked over HTTP and websockets, as any program of this machine could.
"""

from __future__ import annotations

import html
import http.client
import json
import re
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import pytest

import subzero
from subzero.explore.exploration import Exploration
from tests.page.test_explore import needs_browser, needs_extra, served, short, soon

if find_spec("nicegui") is None:
    pytest.skip("needs NiceGUI: pip install '.[explore]'", allow_module_level=True)
import socketio

assert short  # a fixture
pytestmark = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # refused sockets

ODD = (
    "null", "[]", "{}", '"x"', '"1e999"', "true", "[1, 2]", '{"a": 1}', "1e400", "-1e308", "NaN", "Infinity", '"nan"',
    '"' + "9" * 500 + '"', "9" * 400, '""', "[[[]]]", "1e-400", "not json", '"\\u0000"', None, 7,
)  # fmt: skip


class Got(NamedTuple):
    """An answer."""

    status: int
    headers: Any
    text: str


class Server:
    """A running command: its address, token, folder and process."""

    def __init__(self, folder: Path, process: Any, url: str) -> None:
        self.folder, self.process, self.url = folder, process, url
        self.host, self.token = re.fullmatch(r"http://([^/]+)/\?token=([\w-]{43})", url).groups()  # type: ignore[union-attr]

    def get(self, path: str = "/", **headers: str) -> Got:
        with closing(http.client.HTTPConnection(self.host, timeout=20.0)) as connection:
            connection.request("GET", path, headers={"Host": self.host} | headers)
            answer = connection.getresponse()
            return Got(answer.status, answer.headers, answer.read().decode())

    @cached_property
    def cookie(self) -> str:
        """What the first visit leaves."""
        return str(self.get(f"/?token={self.token}").headers["Set-Cookie"].split(";")[0])

    def memory(self, what: str = "VmRSS") -> int:
        """Memory in use [kB], or the number of `Threads`."""
        status = Path(f"/proc/{self.process.pid}/status").read_text(encoding="ascii")
        return int(re.search(rf"{what}:\s+(\d+)", status)[1])  # type: ignore[index]


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    folder = tmp_path_factory.mktemp("explored")
    with served(folder) as (process, url):
        yield Server(folder, process, url)


class Page:
    """A page in a browser that does as it is asked to."""

    def __init__(self, server: Server, **headers: str) -> None:
        text = server.get(f"/?token={server.token}").text
        query = re.search(r"query: (\{.*?\}),", text)[1].replace("'", '"').replace("True", "true")  # type: ignore[index]
        self.name = json.loads(query)["client_id"]
        elements = re.search(r"parseElements\(String\.raw`(.*?)`", text, re.DOTALL)[1]  # type: ignore[index]
        self.elements = {int(key): value for key, value in json.loads(html.unescape(elements)).items()}
        more = {"implicit_handshake": "true", "tab_id": self.name, "document_id": self.name}
        words = "&".join(f"{key}={value}" for key, value in (json.loads(query) | more).items())
        self.socket, self.updates = socketio.Client(), [""]
        self.socket.on("update", lambda update: self.updates.append(json.dumps(update)))
        self.socket.connect(
            f"http://{server.host}?{words}", headers={"Cookie": server.cookie} | headers,
            socketio_path="/_nicegui_ws/socket.io", transports=["websocket"],
        )  # fmt: skip

    def find(self, **props: str) -> int:
        """Return the first element with a tag or a property."""
        return next(
            key for key, one in self.elements.items()
            if all(value in (one.get(name), one.get("props", {}).get(name)) for name, value in props.items())
        )  # fmt: skip

    def send(self, element: int, *args: Any, listener: int = 0) -> None:
        event = self.elements[element]["events"][listener]["listener_id"]
        self.socket.emit("event", {"client_id": self.name, "id": element, "listener_id": event, "args": args})

    def wait_for(self, words: str) -> str:
        """Return the first update with some words."""
        until = time.monotonic() + 20.0
        while time.monotonic() < until:
            for update in self.updates:
                if words in update:
                    return update
            time.sleep(0.02)
        raise AssertionError(f"no update with {words!r}")


@contextmanager
def opened(server: Server, **headers: str) -> Iterator[Page]:
    page = Page(server, **headers)
    yield page
    page.socket.disconnect()


# Who is let in.


@pytest.mark.long
@needs_extra
@pytest.mark.parametrize(
    "path", ["/", "/?token=", "/?token=wrong", "/replay", "/runs/x", "/docs", "/openapi.json"]
)
def test_without_the_token_nothing_is_answered(server: Server, path: str) -> None:
    answer = server.get(path)
    assert answer.status == 403
    assert answer.text == "Open the address that subzero explore has printed, with its token.\n"
    assert server.get(path, Cookie=server.cookie.replace("=", "=x")).status == 403


@needs_extra
def test_the_token_leaves_a_cookie_that_no_script_and_no_other_site_can_use(server: Server) -> None:
    first = server.get(f"/?token={server.token}")
    assert first.status == 200
    assert {"HttpOnly", "SameSite=Strict"} <= set(first.headers["Set-Cookie"].split("; "))
    again = server.get("/", Cookie=server.cookie)
    assert (again.status, again.headers["Set-Cookie"]) == (200, None)


@needs_extra
def test_no_other_site_may_frame_the_page_and_there_are_no_pages_of_its_programs(server: Server) -> None:
    for path in ("/", "/replay", "/docs", "/redoc", "/openapi.json", "/nowhere"):
        answer = server.get(path, Cookie=server.cookie)
        assert answer.status == (200 if path in ("/", "/replay") else 404), path
        assert answer.headers["Content-Security-Policy"] == "frame-ancestors 'self'"
        assert answer.headers["X-Frame-Options"] == "SAMEORIGIN"


@needs_extra
@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "example.org"}, 400),
        ({"Host": "127.0.0.1"}, 400),
        ({"Origin": "http://example.org"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "http://127.0.0.1:1"}, 403),
    ],
)
def test_another_host_or_origin_is_refused_with_the_token_too(
    server: Server, headers: dict[str, str], status: int
) -> None:
    assert server.get(f"/?token={server.token}", **headers).status == status
    with pytest.raises(socketio.exceptions.ConnectionError), opened(server, **headers):
        pass


@needs_extra
@pytest.mark.parametrize("cookie", ["", "subzero_explore=x", "\x7f=;;"])
def test_a_websocket_without_the_cookie_is_refused(server: Server, cookie: str) -> None:
    with pytest.raises(socketio.exceptions.ConnectionError), opened(server, Cookie=cookie):
        pass


@needs_extra
def test_what_a_browser_is_started_with_does_not_hold_the_token(monkeypatch: pytest.MonkeyPatch) -> None:
    from subzero.explore.page import _opened

    seen: list[tuple[str, int, str]] = []

    def look(address: str) -> None:
        path = Path(address.removeprefix("file://"))
        seen.append((address, path.stat().st_mode & 0o077, path.read_text(encoding="utf-8")))

    monkeypatch.setattr("webbrowser.open", look)
    with _opened("http://127.0.0.1:1/?token=secret"):
        ((address, others, text),) = seen
    assert "secret" not in address
    assert others == 0
    assert "url=http://127.0.0.1:1/?token=secret" in text
    assert not Path(address.removeprefix("file://")).exists()


# What is sent.


@pytest.mark.long
@needs_extra
def test_odd_positions_of_sliders_are_ignored_and_the_next_good_one_counts(tmp_path: Path) -> None:
    with served(tmp_path) as (process, url):
        with opened(Server(tmp_path, process, url)) as page:
            slider, field = page.find(tag="q-slider"), page.find(type="number")
            for odd in ODD:
                page.send(slider, odd)
                for listener in range(len(page.elements[field]["events"])):
                    page.send(field, odd, listener=listener)
                page.socket.emit("event", odd)
            page.send(slider)
            page.send(slider, "1", "2")
            page.send(slider, "31.5")
            page.wait_for("Changed; the run took")
            assert any('"model-value": "31.5"' in update for update in page.updates)
        process.terminate()
        said = process.communicate()[1]
    assert "Traceback" not in said


@pytest.mark.long
@needs_extra
@pytest.mark.parametrize(
    "name", ["-x.toml", "a\nb.toml", "\x1b[31m.toml", "../x.toml", "a\\b.toml", "/x.toml", "‮x.toml"]
)
def test_a_file_is_named_by_printable_characters_without_a_path(server: Server, name: str) -> None:
    with opened(server) as page:
        page.send(page.find(id="file"), json.dumps(name))
        page.send(page.find(id="save"), "{}")
        page.wait_for("Give ")
    assert list(server.folder.iterdir()) == []


# How much there is of it.


@pytest.mark.long
@needs_extra
def test_pages_that_nobody_looks_at_are_forgotten(server: Server) -> None:
    from subzero.explore.page import MOST_TABS

    with opened(server) as page:
        sizes = []
        for _ in range(2):  # the heap fills over the first fifty pages, and then stands still
            for _ in range(4 * MOST_TABS):
                assert server.get("/", Cookie=server.cookie).status == 200
            sizes.append(server.memory())
        assert server.memory("Threads") < MOST_TABS
        assert sizes[1] - sizes[0] < 0.1 * 1600 * 4 * MOST_TABS, "a page took 1600 kB"
        page.send(page.find(tag="q-slider"), "32.5")
        page.wait_for("Changed; the run took")


@pytest.mark.long
@needs_extra
def test_memory_does_not_grow_with_moves(server: Server) -> None:
    with opened(server) as page:
        slider, sizes = page.find(tag="q-slider"), []
        for block in range(3):
            for move in range(10):
                page.updates.clear()
                page.send(slider, str(30.0 + 0.1 * move + 0.01 * block))
                page.wait_for("Changed; the run took")
            sizes.append(server.memory())
    assert sizes[2] - sizes[1] < 10 * 650, "the replay of a run is 650 kB"


# A rough answer first.


def test_a_rough_answer_comes_first_and_the_run_of_simulate_behind_it(short: Exploration) -> None:
    rough, last = short.answers({"commands.propeller_rps": 31.0})
    assert rough.rough == "Rough: not refined yet."
    trial = short.trial.with_changes({"commands.propeller_rps": 31.0})
    for answer, rtol in ((rough, 0.0), (last, trial.rtol)):
        run = subzero.simulate(trial.with_changes({"run.rtol": rtol}))
        assert (answer.run["surge_speed"].values == run["surge_speed"].values).all()


def test_a_long_run_is_answered_by_its_first_seconds(short: Exploration) -> None:
    """Each report of progress takes as long as an attempt may: the clock of the test, not that of the machine."""
    from dataclasses import replace

    from subzero.explore import exploration as explore

    def slow(trial: Any, progress: Any) -> Any:
        def reported(fraction: float) -> None:
            if trial.duration == 5.0 and not trial.rtol:
                time.sleep(0.4 * explore.ATTEMPT_S)
            progress(fraction)

        return subzero.simulate(trial, progress=reported)

    one = replace(short, simulate=slow)
    rough, last = one.answers({"commands.propeller_rps": 31.0})
    ends = float(rough.run["time"][-1])
    assert 0.0 < ends < 5.0
    assert rough.is_part
    assert rough.rough == f"Rough: the first {ends:g} s."
    assert float(last.run["time"][-1]) == 5.0
    assert not last.rough


@pytest.mark.long
@needs_extra
@needs_browser
def test_the_page_opens_with_the_token_alone_and_hides_it(server: Server) -> None:
    from subzero.page import browser

    with browser.opened(f"http://{server.host}/") as driver:
        assert "Open the address that subzero explore has printed" in driver.page_source
    with browser.opened(server.url) as driver:
        soon(driver, lambda _: driver.execute_script("return Boolean(replay.contentWindow.subzero)"))
        assert driver.current_url == f"http://{server.host}/"
        driver.refresh()
        soon(driver, lambda _: driver.execute_script("return Boolean(replay.contentWindow.subzero)"))
        # On a slow machine NiceGUI gives a page up before its browser connects, and loads it again: the run of the
        # first one is gone by then.
        assert [line for line in driver.get_log("browser") if "/runs/" not in line["message"]] == []
