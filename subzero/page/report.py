"""The one page of all commands: the outcome in words; the replay; warnings, numbers, figures; how to repeat it.

The page is one file that loads nothing. It is made of a template (`assets/template.html`), whose engine escapes every
text that comes from a user; of figures as SVG, inside as images, so that nothing in them can act; and of the player's
modules (`assets/player`), joined to one script. Without JavaScript all but the replay is there.
"""

from __future__ import annotations

import base64
import io
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any, Literal

from subzero.results.netcdf_csv import lacking_letters_as_boxes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MODULES = ("vectors", "data", "meshes", "shaders", "scene", "camera", "plan", "plots", "player")
"""The modules of the player, each after those that it imports."""

FIGURES = {
    "fig4": "Tension of a straight pull, computed and exact",
    "fig5": "Tension, force and tow-point velocities of a turn",
    "fig6": "Propeller command, forward speed, rudder and heading over time",
    "attitude": "Actuators and attitude over time",
    "station": "Place, heading and attitude over time, and thrusters",
    "actuators": "Fins, moving masses and buoyancy engines of the vehicle's lists, commanded and moved",
    "cable": "Shape of the cable, and tension along it",
    "tension": "Tension along the cable over time, and between which values it has been",
    "forces": "Forces on the vehicle, and where the energy went",
    "deployment": "What the drum does",
    "measured": "Other channels that were measured, beside the runs",
    "manoeuvre": "The manoeuvre",
    "bands": "Channels over time: the median of all members, and where 50 and 90 % of them lie",
    "histograms": "How often each number has which value",
    "against": "Numbers against parameters, those that matter most first",
    "tornado": "How much each parameter moves each number",
    "misfit": "Measured and simulated, and what is left between them beside the noise and the step of the sensor",
    "evidence": "How probable each explanation is",
    "rivals": "What it would have looked like if another explanation were true",
    "detectable": "What these records could show of each cause",
    "gain": "Error of the simulation before and after, in noise of the sensors",
    "missing_force": "What no cause of the catalogue explains, over time",
}
"""The content of a figure, by its name or the beginning of it."""

SVG_STYLE: dict[Any, Any] = {
    "svg.hashsalt": "subzero",
    "svg.fonttype": "path",
    "path.simplify_threshold": 0.3,
}
"""Two pages of one run are alike to the last letter."""


@dataclass(frozen=True, kw_only=True)
class Table:
    """Rows in groups; the first cell of a row says what the others are: numbers, or words that begin at the left."""

    title: str
    header: Sequence[str]
    groups: Sequence[Sequence[Sequence[str]]]
    is_of_words: bool = False


@dataclass(frozen=True, kw_only=True)
class Line:
    """The headline of a page: a few words, and whether they are good news."""

    text: str
    kind: Literal["good", "bad"] = "good"


@dataclass(frozen=True, kw_only=True)
class Answer:
    """A question that every reader has, answered in words; perhaps with a line of the shell that acts on it."""

    question: str
    words: Sequence[str]
    command: str = ""


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """A figure that is drawn already: the address of an image that is inside a page, and its width. [inch]"""

    address: str
    width: float

    def get_figwidth(self) -> float:
        """Return its width, as a figure does. [inch]"""
        return self.width


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of a page: paragraphs, then tables, then figures.

    Args:
        title: above it.
        text: paragraphs.
        tables: the numbers; a title of the section's own stands above each.
        figures: by name, see `FIGURES`.
        is_folded: shown when it is asked for, and on paper.
    """

    title: str
    text: Sequence[str] = ()
    tables: Sequence[Table] = ()
    figures: Mapping[str, Figure | Drawn] = field(default_factory=dict)
    is_folded: bool = False


@dataclass(frozen=True, kw_only=True)
class Report:
    """The contents of a page.

    Args:
        command_name: of the command that made it, such as compare.
        scenario: name of the trial.
        title: the trial in words.
        version: of subzero.
        outcome: the headlines.
        command: the line that does it again.
        answers: answers to the first questions of a reader who was not there.
        warnings: the warnings, by run.
        notes: sentences that are worth knowing, and no fault.
        sections: numbers and figures, in the order in which one reads them.
        replay: of `subzero.page.replay.encode`; None without one.
        replay_words: remarks on the replay that its controls do not give.
        sources: texts to unfold at the end, by name.
        is_bare: show the replay alone, to stand in another page.
    """

    command_name: str
    scenario: str
    title: str
    version: str
    outcome: Sequence[Line]
    command: str
    answers: Sequence[Answer] = ()
    warnings: Mapping[str, Sequence[str]] = field(default_factory=dict)
    notes: Sequence[str] = ()
    sections: Sequence[Section] = ()
    replay: Mapping[str, Any] | None = None
    replay_words: str = ""
    sources: Mapping[str, str] = field(default_factory=dict)
    is_bare: bool = False


def render(report: Report) -> str:
    """Return the page as HTML; the same report gives the same page."""
    from markupsafe import Markup

    html: str = _template().render(
        report=report,
        image=_image,
        caption=caption,
        styles=Markup(asset("page.css") + "\n" + _vendored("uPlot.min.css")),
        replay_data=Markup(_in_script(report.replay)),
        uplot=Markup(_vendored("uPlot.iife.min.js")),
        player=Markup(player()),
    )
    return html


def caption(name: str) -> str:
    """Return the content of a figure; of one of several of a kind, the record after its kind's name."""
    known = next((kind for kind in FIGURES if name == kind or name.startswith(f"{kind}_")), None)
    if known is None:
        return name.replace("_", " ")
    which = name.removeprefix(known).strip("_")
    return FIGURES[known] + (f": {which}" if which else "")


def player() -> str:
    """Return the player as one script: its modules in order, without the lines that import one from another."""
    texts = [asset(f"player/{name}.js") for name in MODULES]
    return "\n".join(re.sub(r"^(import [^;]*;\n|export )", "", text, flags=re.MULTILINE) for text in texts)


@cache
def asset(name: str) -> str:
    """Return the text of a file of the page."""
    return (resources.files("subzero.page") / "assets" / name).read_text(encoding="utf-8")


def _vendored(name: str) -> str:
    return (resources.files("subzero.page") / "vendor" / name).read_text(encoding="utf-8")


@cache
def _template() -> Any:
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return environment.from_string(asset("template.html"))


def _in_script(data: Mapping[str, Any] | None) -> str:
    """Return data as JSON that cannot end the script it stands in."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("&", "\\u0026")


def _image(figure: Figure | Drawn) -> str:
    """Return a figure as the address of an image that is inside the page."""
    return figure.address if isinstance(figure, Drawn) else drawn(figure).address


def drawn(figure: Figure) -> Drawn:
    """Return a figure as a page has it."""
    import matplotlib as mpl

    held = io.BytesIO()
    with mpl.rc_context(SVG_STYLE), lacking_letters_as_boxes():
        figure.savefig(held, format="svg", metadata={"Date": None})
    text = base64.b64encode(held.getvalue()).decode("ascii")
    return Drawn(address=f"data:image/svg+xml;base64,{text}", width=float(figure.get_figwidth()))
