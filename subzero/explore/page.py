"""The page of `subzero.explore.exploration` on this machine: sliders, the replay and the plots of the report's own
player, numbers.

Every tab has its own positions of the sliders and its own thread, which runs the newest of them. The replay stands in
a frame, which is loaded once and then takes other runs: camera and time do not change. The access to the page is
limited by `subzero.explore.local_access`. A browser may send anything: it is checked where it comes in, `_position`
and `_take`.

Needs the extra ``[explore]``; NiceGUI takes a second to import, and is imported where a page is served.
"""

from __future__ import annotations

import asyncio
import errno
import gc
import json
import shlex
import socket
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import cached_property, partial
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from subzero.errors import UserError, missing_extra, printable, real
from subzero.explore.exploration import Answer, Exploration, Newest, Slider, Values
from subzero.explore.local_access import HOST, Access

if TYPE_CHECKING:
    import xarray as xr

HIGHEST_PORT = 65535
NEEDED = ("nicegui", "tomlkit")
DIGITS = 6
"""Significant ones of a slider's position."""
LOOK_S = 0.2
"""So often the bar of a run is moved. [s]"""
MOST_TABS = 16
"""Pages that are open at a time; each takes a megabyte, and one that is never shown goes only after a minute. [-]"""
YOUNG = 700
"""Python's own number: a command that lives for seconds looks for garbage more rarely, and closed pages would pile up.
[objects]"""
TITLES = {
    "commands": "Commands, at their largest",
    "motion": "Prescribed motion, at its largest",
    "winch": "Winch, at its largest",
    "start": "At the start",
    "water": "Water",
    "cable": "Cable",
    "drum": "Drum",
    "run": "Run",
}
"""Section of a trial → the heading above its sliders."""


@contextmanager
def address(port: int) -> Iterator[tuple[Access, socket.socket]]:
    """Yield the access rules of a page, with its address and the socket that listens there, before any simulation.

    Raises:
        UserError: what the page needs is not installed; the port cannot be had.
    """
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise missing_extra("A page to explore", ", ".join(missing), "explore")
    if not 0 <= port <= HIGHEST_PORT:
        raise UserError(f"--port is {port}; it must be 0 to {HIGHEST_PORT}.")
    with socket.socket() as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((HOST, port))
            listening.listen()
        except OSError as error:
            why = "is in use" if error.errno == errno.EADDRINUSE else f"cannot be had: {error.strerror}"
            raise UserError(f"Port {port} of {HOST} {why}. Give another one, or --port 0 for any.") from None
        yield Access(listening.getsockname()[1]), listening


@dataclass(frozen=True, kw_only=True)
class Shown:
    """The contents of a tab for an answer: it, the summary of its run, and its replay as JSON; None where there is
    none.
    """

    answer: Answer
    summary: dict[str, Any] | None
    replay: str | None


class Page:
    """The page of a trial.

    Args:
        exploration: the trial, its run, and the function that runs others.
    """

    def __init__(self, exploration: Exploration) -> None:
        self.exploration = exploration
        self.tabs: dict[str, Tab] = {}

    def serve(self, listening: socket.socket, access: Access, *, browser: bool) -> None:
        """Serve the page in a thread until the process is interrupted; open a browser on it if asked for."""
        import uvicorn

        gc.set_threshold(YOUNG)
        application: Any = access.guarded(self._application())
        server = uvicorn.Server(uvicorn.Config(application, log_level="error"))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
        thread.start()
        with _opened(access.url) if browser else nullcontext():
            while thread.is_alive():
                thread.join(LOOK_S)

    def _application(self) -> Any:
        from fastapi import FastAPI
        from fastapi.responses import HTMLResponse
        from nicegui import core, ui

        application = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
        application.get("/replay")(lambda: HTMLResponse(self.frame))
        application.get("/runs/{tab}")(self.run_of)
        ui.page("/")(self.open_tab)
        ui.run_with(
            application,
            title=f"subzero explore {self.exploration.trial.name}",
            dark=None,
            show_welcome_message=False,
        )
        core.sio.on("event", partial(_take, core.sio.handlers["/"]["event"]))
        return application

    def run_of(self, tab: str) -> Any:
        """Answer with the replay that a tab shows."""
        from fastapi.responses import Response

        known = self.tabs.get(tab)
        return Response(known.replay if known else None, 200 if known else 404, media_type="application/json")

    @cached_property
    def frame(self) -> str:
        """The replay of the nominal run, to stand in a frame."""
        from subzero.page import Report, render

        trial, nominal = self.exploration.trial, self.exploration.nominal
        return render(
            Report(
                command_name="explore",
                scenario=trial.name,
                title=trial.description,
                outcome=[],
                command="",
                version=nominal.attrs["subzero_version"],
                replay=self.replay(nominal),
                is_bare=True,
            )
        )

    def replay(self, run: xr.Dataset) -> dict[str, Any] | None:
        """Return the replay of a run next to the nominal one; None where there is nothing to see."""
        from subzero.page import Actor, encode

        if run.sizes["time"] < 2 or self.exploration.nominal.sizes["time"] < 2:
            return None
        data = encode((Actor(name="changed", run=run),))
        return {**data, "actors": [*data["actors"], *self.ghost["actors"]]}

    @cached_property
    def ghost(self) -> dict[str, Any]:
        """The replay of the nominal run alone, as a ghost."""
        from subzero.page import Actor, encode

        return encode((Actor(name="nominal", run=self.exploration.nominal, ghost=True),))

    @cached_property
    def as_in_file(self) -> Shown:
        """The initial contents of a tab."""
        return self.shown(self.exploration.answer({}))

    def shown(self, answer: Answer) -> Shown:
        """Return the contents of a tab for an answer."""
        from subzero.results.summary import summarise

        if answer.run is None:
            return Shown(answer=answer, summary=None, replay=None)
        replay = self.replay(answer.run)
        text = None if replay is None else json.dumps(replay, allow_nan=False, separators=(",", ":"))
        summary = (
            None if answer.is_part else summarise(answer.run)
        )  # its last numbers are not those of the end
        return Shown(answer=answer, summary=summary, replay=text)

    async def open_tab(self) -> None:
        """Fill a tab of the browser."""
        from nicegui import ui

        while len(self.tabs) >= MOST_TABS:  # close the oldest, of those that are not in view if there are any
            tabs = self.tabs.values()
            min(tabs, key=lambda tab: tab.client.has_socket_connection).client.delete()
        name = uuid4().hex
        self.tabs[name] = tab = Tab(self, name)
        ui.context.client.on_delete(partial(self.close_tab, tab))

    def close_tab(self, tab: Tab) -> None:
        """Forget a tab that was closed."""
        del self.tabs[tab.name]
        tab.newest.end()


class Tab:
    """One tab of a browser: the positions of its sliders, and the run that is shown.

    Args:
        page: whose tab it is.
        name: of it, for the address of its runs.
    """

    def __init__(self, page: Page, name: str) -> None:
        from nicegui import ui

        self.page, self.name, self.replay = page, name, ""
        self.values: dict[str, float] = {}
        self.fraction = 0.0
        self.knobs: dict[str, Knob] = {}
        self.client, self.loop = ui.context.client, asyncio.get_running_loop()
        self.newest: Newest[Values, Shown] = Newest(
            self._work,
            lambda shown: self._later(self.show, shown),
            lambda error: self._later(
                self._report_progress, f"This is a bug of subzero: {error!r}. The terminal has more."
            ),
        )
        ui.add_head_html(
            "<script>history.replaceState(null, '', '/')</script>"
        )  # the token is in the cookie now
        ui.add_css(files("subzero.page").joinpath("assets", "explore.css").read_text(encoding="utf-8"))
        with ui.row().classes("whole"):
            with ui.column().classes("sliders"):
                self._sliders()
            with ui.column().classes("seen"):
                self._seen()
        ui.timer(LOOK_S, self._move_bar)
        self.show(page.as_in_file)

    def _later(self, act: Callable[[Any], None], what: Any) -> None:
        """Do something in the thread of the page."""
        self.loop.call_soon_threadsafe(act, what)

    def _work(self, values: Values, progress: Callable[[float], None]) -> Shown:
        """Show rough answers as they come, and return the last one."""

        def reported(fraction: float) -> None:
            self.fraction = fraction
            progress(fraction)

        for answer in self.page.exploration.answers(values, reported):
            shown = self.page.shown(answer)
            if answer.rough:
                self._later(self.show, shown)
        return shown

    def _sliders(self) -> None:
        from nicegui import ui

        trial, above = self.page.exploration.trial, ""
        ui.label(f"subzero explore · {trial.name}").classes("kind")
        ui.label(trial.description).classes("title").props("role=heading aria-level=1")
        for name, slider in self.page.exploration.sliders.items():
            if slider.section != above:
                above = slider.section
                ui.label(TITLES[above]).classes("section").props("role=heading aria-level=2")
            self.knobs[name] = Knob(slider, self.move)

    def _seen(self) -> None:
        from nicegui import ui

        with ui.row().classes("bar-of-all"):
            self.status = ui.label().classes("status").props("role=status")
            self.bar = ui.linear_progress(value=0.0, show_value=False, size="4px").props(
                "aria-label='The run'"
            )
            ui.button("Reset all", on_click=self.reset).props("flat dense no-caps id=reset")
            self.file = ui.input("File", value=f"{self.page.exploration.trial.name}_changed.toml").props(
                "dense id=file"
            )
            ui.button("Save as TOML", on_click=self.save).props("unelevated dense no-caps id=save")
        self.refused, self.saved = ui.label().classes("refused"), ui.label().classes("saved")
        ui.element("iframe").props("src=/replay id=replay title='Replay and plots'").classes("replay")
        with ui.row().classes("below"):
            self.cells = self._table()
            self.warnings = ui.column().classes("warnings")

    def _table(self) -> list[list[Any]]:
        """Make the table of numbers, and return its cells, row by row."""
        from nicegui import ui

        rows = self.page.exploration.numbers(self.page.exploration.nominal_summary)
        cells = []
        with ui.element("table").classes("numbers"):
            with ui.element("tr"):
                for words in ("", "nominal", "changed", "change"):
                    with ui.element("th").props("scope=col"):
                        ui.label(words)
            for row in rows:
                with ui.element("tr"):
                    cells.append([_cell("th" if at == 0 else "td", text) for at, text in enumerate(row)])
        return cells

    def move(self, name: str, value: float) -> None:
        """Take another position of a slider, and run it."""
        self.values[name] = value
        self._ask()

    def reset(self) -> None:
        """Put all sliders back to the trial's own values."""
        self.values = {}
        for knob in self.knobs.values():
            knob.put(knob.slider.nominal)
        self._ask()

    def _ask(self) -> None:
        self.fraction = 0.0
        self.status.set_text("Computing …")
        self.newest.ask(dict(self.values))

    def save(self) -> None:
        """Write a scenario file of the sliders into the working folder, and show how to use it."""
        name = str(self.file.value or "")
        try:
            _check_name(name)
            self.page.exploration.save(self.values, Path(name))
        except UserError as error:
            self.saved.set_text(str(error))
        else:
            self.saved.set_text(f"Wrote {name}. Run it: subzero simulate {shlex.quote(name)}")

    def show(self, shown: Shown) -> None:
        """Show an answer: the run, its numbers and warnings; or the refusals, next to their sliders."""
        answer = shown.answer
        for name, knob in self.knobs.items():
            knob.say(answer.refusals.get(name, ""))
        self._report_progress(answer.refusals.get("", ""))
        self.fraction = 0.0
        if answer.run is None:
            self.status.set_text("Refused; what is shown is the run before.")
            return
        changed = self.page.exploration.changes(answer.values)
        words = answer.rough or f"Changed; the run took {answer.seconds:.2f} s."
        self.status.set_text(words if changed else "As in the file.")
        if shown.summary is not None:
            self._show_numbers(shown.summary)
        if shown.replay is not None:
            self.replay = shown.replay
            self.client.run_javascript(
                f"fetch('/runs/{self.name}').then((one) => one.json())"
                ".then((data) => document.getElementById('replay').contentWindow.subzero?.show(data))"
            )

    def _report_progress(self, words: str) -> None:
        self.refused.set_text(words)

    def _show_numbers(self, summary: dict[str, Any]) -> None:
        from nicegui import ui

        for cells, row in zip(self.cells, self.page.exploration.numbers(summary), strict=True):
            for cell, text in zip(cells, row, strict=True):
                cell.set_text(text)
        reported = [each["message"] for each in summary["warnings"]]
        stopped = [] if summary["outcome"] == "completed" else [summary["outcome_message"]]
        self.warnings.clear()
        with self.warnings:
            ui.label("Warnings of the run" if reported or stopped else "The run has no warnings.").classes(
                "section"
            )
            for words in (*stopped, *reported):
                ui.label(words).classes("warning")
            for note in summary["notes"]:
                ui.label(note["message"])

    def _move_bar(self) -> None:
        self.bar.set_value(self.fraction)


def _check_name(name: str) -> None:
    """Raise an error for a file name that leads out of the working folder, or that a terminal or a command would
    obey.
    """
    if set(name) & {"/", "\\"}:
        raise UserError(f"Give a name without folders: the file goes to {printable(str(Path.cwd()))}.")
    if not name.isprintable() or name.startswith("-"):
        raise UserError(
            f"{printable(name)} is no name for a file. Give printable characters, and no - at the front."
        )


@contextmanager
def _opened(url: str) -> Iterator[None]:
    """Open a browser on an address by a file that only its owner can read: anybody may read what a command is given."""
    import webbrowser

    with tempfile.NamedTemporaryFile("w", prefix="subzero-", suffix=".html") as page:
        page.write(f'<meta http-equiv="refresh" content="0; url={url}"><a href="{url}">subzero explore</a>')
        page.flush()
        webbrowser.open(Path(page.name).as_uri())
        yield


def _take(take: Callable[..., None], sender: str, *message: Any) -> None:
    """Take what a browser sends, unless it is no event at all."""
    with suppress(
        ValueError, TypeError, LookupError, AttributeError
    ):  # errors in its effects are caught inside
        take(sender, *message)


def _position(event: Any) -> float | None:
    """Return the number that a browser has sent; None if it is not a number."""
    sent = event.args
    try:
        return real(float(sent)) if isinstance(sent, str) else real(sent)
    except ValueError:
        return None


def _cell(kind: str, text: str) -> Any:
    """Return the label in a new cell of a table."""
    from nicegui import ui

    with ui.element(kind):
        return ui.label(text)


class Knob:
    """One slider on the page: the slider, a number field next to it that takes any value, and the problem with the
    value.

    Args:
        slider: the parameter that it moves.
        moved: called with its name and its position when a user moves it.
    """

    def __init__(self, slider: Slider, moved: Callable[[str, float], None]) -> None:
        from nicegui import ui

        self.slider, self._moved, self._value = slider, moved, slider.nominal
        self._is_put = False
        unit = "" if slider.unit == "1" else f" [{slider.unit}]"
        with ui.column().classes("knob").props(f'data-name="{slider.name}"'):
            with ui.row().classes("head"):
                ui.label(slider.words + unit).classes("words").tooltip(slider.name)
                self.back = ui.button(icon="undo", on_click=partial(self.turn, slider.nominal))
                self.back.props(f'flat dense round size=sm aria-label="Reset {slider.words}"')
                self.number = ui.number(
                    value=slider.nominal,
                    format=f"%.{DIGITS}g",
                    on_change=lambda event: self.turn(event.value),
                )
                # An empty field gets the last value again.
                self.number.on("blur", lambda: self.put(self._value))
                self.number.props(
                    f'dense debounce=300 input-class=text-right aria-label="{slider.words}{unit}"'
                )
            self.handle = ui.slider(
                min=slider.low,
                max=slider.high,
                step=slider.step,
                value=slider.nominal,
                on_change=lambda event: self.turn(event.value),
            ).props(f'aria-label="{slider.words}{unit}"')
            for element in (self.number, self.handle):
                element._event_args_to_value = _position  # type: ignore[assignment, method-assign]  # NiceGUI's fails on non-numbers
            ui.label(_range_words(slider)).classes("range")
            self.refused = ui.label().classes("refused")
        self.put(slider.nominal)

    def turn(self, value: float | None) -> None:
        """Take another value, from the slider or from the number, unless it is the one that it has."""
        if self._is_put or value is None or (value := float(f"{value:.{DIGITS}g}")) == self._value:
            return
        self.put(value)
        self._moved(self.slider.name, value)

    def put(self, value: float) -> None:
        """Set the position; the handle of a value beyond the slider's ends is at its end."""
        self._value, self._is_put = value, True  # set by the program, not moved by the user
        self.number.set_value(value)
        self.handle.set_value(min(max(value, self.slider.low), self.slider.high))
        self._is_put = False
        self.back.set_visibility(value != self.slider.nominal)

    def say(self, words: str) -> None:
        """Show the problem with the value; nothing if there is none."""
        self.refused.set_text(words)


def _range_words(slider: Slider) -> str:
    """Return the value of the trial, and the plausible range, in a few words."""
    plausible = "" if slider.declared is None else "; plausible {:g} … {:g}".format(*slider.declared)
    return f"{slider.low:g} … {slider.high:g}, in the file {slider.nominal:g}{plausible}"
