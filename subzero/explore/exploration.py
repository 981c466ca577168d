"""What would a trial do if …? Sliders for its main numbers, the run of what they say, and the file of it.

The module is independent of the page: `subzero.explore.page` shows it. A slider is a value: which numbers of the
trial it moves (`scenarios.parameters` has their names), its unit, and from where to where it goes. A run of a change
is that of `Trial.with_changes`, and so is the file: read again, it is the same trial, to the last bit.
"""

from __future__ import annotations

import math
import os
import threading
import tomllib
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from scenarios import ScenarioError, Trial, load
from scenarios.command_columns import actuator_of, listed_columns
from scenarios.parameters import (
    ELEMENT,
    PARTS,
    declared_ranges,
    parameter_names,
    parameter_unit,
    parameter_values,
    quantity_of,
)
from scenarios.quantities import Quantity
from scenarios.samples import LEFT_OPEN
from subzero.errors import UserError, printable
from subzero.files.read_file import make_toml

if TYPE_CHECKING:
    import xarray as xr

    from subzero.simulation.refinement import Progress

Values = Mapping[str, float]
"""Name of a slider → where it stands, in its unit; those that are left out stand where the trial has them."""

ATTEMPT_S = 0.2
"""An answer is there within a second: so long for an attempt, as long to repeat it as far as it came, and the rest.
[s]"""

Request = TypeVar("Request")
Found = TypeVar("Found")

ROWS = """
commands.propeller_rps        | propeller speed             | 0    | 40
commands.rudder_deg           | rudder                      | -20  | 20
commands.stern_plane_port_deg commands.stern_plane_starboard_deg | stern-planes | -15 | 15
motion.surge_speed_m_s        | forward speed               | 0    | 2
winch.pay_out_rate_m_s        | cable paid out by the winch | -1   | 3
winch.tension_N               | tension kept by the winch   | 0.01 | 50
start.surge_speed_m_s         | forward speed               | 0    | 2
start.heading_deg             | heading                     | -180 | 180
start.depth_m                 | depth                       | 0    | 20
start.wet_length_m            | cable in the water          | 0    | 60
water.current_north_m_s       | current to the north        | -0.5 | 0.5
water.current_east_m_s        | current to the east         | -0.5 | 0.5
cable.diameter                | diameter                    |      |
cable.mass_per_length         | mass per length             |      |
cable.normal_drag_coefficient | drag coefficient, across    |      |
cable.tangential_drag_coefficient | drag coefficient, along |      |
drum.friction_torque          | friction torque             |      |
drum.inertia                  | inertia                     |      |
run.duration_s                | duration                    | 5    | 60
"""
"""What may be explored: numbers of a trial that move together, words, and from where to where. Without these, the range
that its file declares counts, from half the value of the trial to twice that at least."""

WIDER = 2.0
"""A slider goes at least so many times as far as the trial's own value. [-]"""
POSITIONS = 200
"""A slider has about so many. [-]"""

NUMBERS = (
    ("peak_speed_m_s", "peak speed [m/s]", 3),
    ("speed_at_end_m_s", "speed at the end [m/s]", 3),
    ("heading_at_end_deg", "heading at the end [degree]", 2),
    ("depth_at_end_m", "depth at the end [m]", 3),
    ("path_length_m", "path length [m]", 2),
    ("cable_length_at_end_m", "cable off the drum at the end [m]", 2),
    ("largest_cable_force_N", "largest cable force [N]", 4),
    ("largest_cable_moment_N_m", "largest cable moment [N m]", 4),
)
"""Numbers of a summary that are compared with the nominal ones: key, words, decimals."""


@dataclass(frozen=True, kw_only=True)
class Slider:
    """The numbers that one slider moves.

    Args:
        name: of the first number that it moves.
        words: their name in words.
        unit: of it in files.
        low: where the slider ends at its left.
        high: at its right.
        nominal: where the trial has it; of a list, the value of largest size.
        shares: numbers of the trial → what they are of the slider's value: a list keeps its shape over time.
        declared: the range that its file declares as plausible; None if it declares none.
    """

    name: str
    words: str
    unit: str
    low: float
    high: float
    nominal: float
    shares: Values
    declared: tuple[float, float] | None = None

    @property
    def section(self) -> str:
        """Section of the trial, such as commands."""
        return self.name.partition(".")[0]

    @property
    def step(self) -> float:
        """Distance of its positions, 1, 2 or 5 times a power of ten."""
        wanted = (self.high - self.low) / POSITIONS
        power = 10.0 ** math.floor(math.log10(wanted))
        size = next(size for size in (1.0, 2.0, 5.0, 10.0) if size * power >= 0.999 * wanted)
        return float(f"{size * power:.1g}")

    def changes(self, value: float) -> dict[str, float]:
        """Return the numbers of the trial with the slider at a value."""
        return {name: value * share for name, share in self.shares.items()}


def sliders_of(trial: Trial) -> tuple[Slider, ...]:
    """Return the sliders that a trial has: listed actuators that it commands, then in the order of `ROWS`.

    Lists that stand in a CSV file have none, and so has a value of 0 for which no file says how far it may go.
    """
    known, ranges = parameter_names(trial), declared_ranges(trial)
    rows = [[cell.strip() for cell in line.split("|")] for line in ROWS.strip().splitlines()]
    rows[:0] = [
        [f"commands.{row.name}", actuator_of(row).replace("_", " "), str(row.low), str(row.high)]
        for row in listed_columns(trial.vehicle)
    ]
    found = (
        _slider(trial, names.split(), words, (low, high), ranges)
        for names, words, low, high in rows
        if all(name in known and _is_in_file(trial, name) for name in names.split())
    )
    return tuple(slider for slider in found if slider.low < slider.high)


def _is_in_file(trial: Trial, name: str) -> bool:
    """Return whether a number may stand in the file of a trial: not what a CSV file or a prescribed motion says."""
    section, _, key = name.partition(".")
    if section == "start" and trial.motion is not None:
        return key in LEFT_OPEN and not (key == "depth_m" and trial.motion.depth is not None)
    return "file" not in tomllib.loads(trial.text).get(section, {})


def _slider(
    trial: Trial, names: list[str], words: str, ends: tuple[str, str], ranges: Mapping[str, Any]
) -> Slider:
    values = {
        key: value
        for name in names
        for key, value in zip(_keys(trial, name), parameter_values(trial, name), strict=True)
    }
    nominal, declared = max(values.values(), key=abs), ranges.get(names[0])
    far = sorted((nominal / WIDER, WIDER * nominal))
    low, high = map(float, ends) if ends[0] else declared or far
    low, high = _allowed(trial, names[0], min(low, far[0]), max(high, far[1]))
    shares = {key: value / nominal if nominal else 1.0 for key, value in values.items()}
    unit = parameter_unit(trial, names[0])
    return Slider(
        name=names[0],
        words=words,
        unit=unit,
        low=low,
        high=high,
        nominal=nominal,
        shares=shares,
        declared=declared,
    )


def _keys(trial: Trial, name: str) -> list[str]:
    """Return the names of the values of a list one by one; of a number its own."""
    row = quantity_of(trial, name)
    if not (isinstance(row, Quantity) and row.many):
        return [name]
    return [f"{name}[{at}]" for at in range(len(parameter_values(trial, name)))]


def _allowed(trial: Trial, name: str, low: float, high: float) -> tuple[float, float]:
    """Return a range without the values that the file would refuse."""
    row = quantity_of(trial, name)
    least, most = (row.low, row.high) if isinstance(row, Quantity) else row.get("limits", (low, high))
    return max(low, least), min(high, most)


# Runs.


@dataclass(frozen=True, kw_only=True)
class Answer:
    """The result of some positions of the sliders.

    Args:
        values: the positions.
        run: the run; None where they were refused.
        refusals: name of a slider → its problem, in the words of the reader of files; "" where it has no
            slider of its own.
        seconds: how long it took. [s]
        rough: how the run is rough, in words; empty for the run that `subzero.simulate` gives.
        is_part: the run ends before its trial does.
    """

    values: Values
    run: xr.Dataset | None
    refusals: Mapping[str, str] = field(default_factory=dict)
    seconds: float
    rough: str = ""
    is_part: bool = False


class _TakesLongError(Exception):
    """A run takes longer than an answer may."""


@dataclass(frozen=True, kw_only=True)
class Exploration:
    """A trial, its run, and what else it may do.

    Args:
        trial: as its file has it.
        nominal: its run.
        simulate: runs a trial, as `subzero.simulate` does.
    """

    trial: Trial
    nominal: xr.Dataset
    simulate: Callable[..., xr.Dataset]

    @cached_property
    def sliders(self) -> dict[str, Slider]:
        """The sliders by name."""
        return {slider.name: slider for slider in sliders_of(self.trial)}

    def changes(self, values: Values) -> dict[str, float]:
        """Return the numbers that sliders away from the trial's own values change."""
        moved = {name: value for name, value in values.items() if value != self.sliders[name].nominal}
        return {
            key: change
            for name, value in moved.items()
            for key, change in self.sliders[name].changes(value).items()
        }

    def answer(self, values: Values, progress: Progress = lambda fraction: None) -> Answer:
        """Return the run of some positions of the sliders, or the reasons why there is none.

        Args:
            values: the positions.
            progress: called with the fraction that is done; an exception that it raises ends the run.
        """
        *_, last = self.answers(values, progress)
        return last

    def answers(self, values: Values, progress: Progress = lambda fraction: None) -> Iterator[Answer]:
        """Yield a rough answer at once, and then that of `answer`, after any refinement it takes.

        The rough one is the run without refinement; where that takes longer than `ATTEMPT_S`, of the trial's first
        seconds.
        """
        began, changes = perf_counter(), self.changes(values)

        def found(run: xr.Dataset | None, **how: Any) -> Answer:
            return Answer(values=dict(values), run=run, seconds=perf_counter() - began, **how)

        if not changes:
            yield found(self.nominal)
            return
        try:
            trial = self.trial.with_changes(changes)
            run = self._at_once(trial, progress)
            reached = float(run["time"][-1])
            is_part = reached + 0.5 * trial.cable_step < trial.duration
            if trial.rtol > 0.0 or is_part:
                words = f"the first {reached:g} s" if is_part else "not refined yet"
                yield found(run, rough=f"Rough: {words}.", is_part=is_part)
                run = self.simulate(trial, progress=progress)
            yield found(run)
        except UserError as error:
            yield found(None, refusals=self._refusals(error))

    def _at_once(self, trial: Trial, progress: Progress) -> xr.Dataset:
        """Return a trial's run without refinement, as far as it gets in `ATTEMPT_S`."""
        began, reached, plain = perf_counter(), 0.0, replace(trial, rtol=0.0)

        def reported(fraction: float) -> None:
            nonlocal reached
            progress(fraction)
            if fraction < 1.0 and perf_counter() - began > ATTEMPT_S:
                raise _TakesLongError
            reached = fraction

        try:
            return self.simulate(plain, progress=reported)
        except _TakesLongError:  # the same steps up to there take the same time again
            steps = max(1, math.floor(reached * trial.duration / trial.cable_step))
            return self.simulate(replace(plain, duration=steps * trial.cable_step), progress=progress)

    def _refusals(self, error: UserError) -> dict[str, str]:
        """Return the problems, slider by slider."""
        if not isinstance(error, ScenarioError):
            return {"": str(error)}
        owner = {key: slider.name for slider in self.sliders.values() for key in slider.shares}
        reported: dict[str, str] = {}
        for problem in error.problems:
            reported.setdefault(owner.get(problem.key, ""), str(problem))
        return reported

    @cached_property
    def nominal_summary(self) -> dict[str, Any]:
        """The nominal run in a few numbers."""
        from subzero.results.summary import summarise

        return summarise(self.nominal)

    def numbers(self, summary: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
        """Return rows of the table: words, nominal number, number, and the change.

        Args:
            summary: of the run, by `subzero.results.summary.summarise`.
        """
        return [
            (words, *_cells(self.nominal_summary[key], summary[key], digits))
            for key, words, digits in NUMBERS
        ]

    def save(self, values: Values, path: Path) -> None:
        """Make a scenario file of some positions of the sliders, which is not there yet.

        Raises:
            UserError: values that are refused, or a file that cannot be made; there is none then.
        """
        changes = self.changes(values)
        self.trial.with_changes(changes)
        make_toml(path, text_with(self.trial, changes, path.parent))
        try:
            load(path)  # a file of commands may end before a longer run
        except ScenarioError:
            path.unlink()
            raise


def _cells(nominal: float | None, changed: float | None, digits: int) -> tuple[str, str, str]:
    """Return two numbers and their difference as text; a dash for none, and for no difference."""
    before, after = (
        "–" if slider is None else f"{round(slider, digits) + 0.0:.{digits}f}"
        for slider in (nominal, changed)
    )
    if nominal is None or changed is None or before == after:
        return before, after, "–"
    share = (
        f" ({100.0 * (changed - nominal) / abs(nominal):+.1f} %)"
        if abs(nominal) > 0.5 * 10.0**-digits
        else ""
    )
    return before, after, f"{changed - nominal:+.{digits}f}{share}".replace("-", "−")


# The file.


def text_with(trial: Trial, changes: Values, folder: Path) -> str:
    """Return the text of the file of a trial with other numbers; its remarks are kept.

    Args:
        trial: as its file has it.
        changes: dotted name → value, as of `Trial.with_changes`.
        folder: where the file is to stand: paths in it are made to lead from there.
    """
    import tomlkit

    document = tomlkit.parse(trial.text)
    for name, value in changes.items():
        _set(document, name, float(value))
    _lead_from(document, Path(trial.source).parent, folder)
    reported = "".join(f"#   {name} = {float(value)!r}\n" for name, value in changes.items())
    head = f"# {printable(trial.source)}, changed by subzero explore" + (
        f":\n{reported}" if reported else "; nothing yet.\n"
    )
    return f"{head}\n{tomlkit.dumps(document)}"


def _set(document: Any, name: str, value: float) -> None:
    """Give a number another value, where it stands or where it belongs."""
    section, _, key = name.partition(".")
    if section in PARTS:
        _set_change(document, name, value)
        return
    table = document.setdefault(section, {})
    found = ELEMENT.fullmatch(key)
    if found:
        table[found["list"]][int(found["at"])] = value
    else:
        table[key] = value


def _set_change(document: Any, name: str, value: float) -> None:
    """Give a number of vehicle, cable or drum another value in [changes], with its name in quotes or as it is there."""
    table, keys = document.setdefault("changes", {}), name.split(".")
    for at in range(len(keys)):
        rest = ".".join(keys[at:])
        if rest in table:
            table[rest] = value
            return
        if not isinstance(table.get(keys[at]), Mapping):
            break
        table = table[keys[at]]
    document["changes"][name] = value


def _lead_from(document: Any, old: Path, new: Path) -> None:
    """Make the paths in a scenario file lead from another folder to the same files."""
    places = [(document, "vehicle"), (document, "cable")]
    places += [(document[section], "file") for section in ("commands", "motion") if section in document]
    for table, key in places:
        named = str(table.get(key, ""))
        if named.endswith((".toml", ".csv")) and not os.path.isabs(named):
            table[key] = os.path.relpath(old / named, new)


# One at a time.


class NewerError(Exception):
    """Something newer is wanted."""


class Newest(Generic[Request, Found]):
    """A thread that works on the newest request: a waiting request is dropped for it, a running one is abandoned.

    Args:
        work: takes a request, and a function to call with the fraction that is done now and then; returns the result.
        done: takes the result, in that thread.
        failed: takes an exception caused by a bug, which is printed too.
    """

    def __init__(
        self,
        work: Callable[[Request, Progress], Found],
        done: Callable[[Found], None],
        failed: Callable[[Exception], None] = lambda error: None,
    ) -> None:
        self._work, self._done, self._failed = work, done, failed
        self._waiting: list[Request] = []
        self._started = self._ended = False
        self._news = threading.Condition()

    def ask(self, request: Request) -> None:
        """Want this, and nothing else any more."""
        with self._news:
            self._waiting = [request]
            self._news.notify()
            if not self._started:  # a page that is only looked at needs no thread
                self._started = True
                threading.Thread(target=self._go_on, daemon=True).start()

    def end(self) -> None:
        """Want nothing any more."""
        with self._news:
            self._waiting, self._ended = [], True
            self._news.notify()

    def _go_on(self) -> None:
        while (request := self._next()) is not None:
            try:
                found = self._work(request, self._look)
                self._look(1.0)
            except NewerError:
                continue
            except Exception as error:
                traceback.print_exc()
                self._failed(error)
                continue
            self._done(found)

    def _next(self) -> Request | None:
        with self._news:
            self._news.wait_for(lambda: self._waiting or self._ended)
            return self._waiting.pop() if self._waiting else None

    def _look(self, fraction: float) -> None:
        """Give up where something newer waits."""
        if self._waiting or self._ended:
            raise NewerError
