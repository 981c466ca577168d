"""A run in hand: open its file again, and look at it.

    run = subzero.simulate("fig6")                # or subzero.open_run("fig6/tethered.nc")
    run.subzero.plot.tension()                    # a matplotlib figure; so do .shape3d(), .motion(), .forces()
    run.subzero.to_dataframe()                    # its channels as a table, one row for each time
    run.subzero.warnings                          # what may be wrong with it
    run.subzero                                   # the run in a few lines

`subzero.simulate` and its like bring the accessor with them; a file that is opened by xarray alone gets it with
``import subzero.figures.accessor``. A file of an earlier version is read by today's names (`RENAMED`).
"""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from cable.memory import fits
from subzero.arguments import check_is_run, checked_arguments
from subzero.channels import BY_NAME, RENAMED_CHANNELS, TIME, channels_of
from subzero.errors import UserError, chosen, printable, short, suggestion
from subzero.files.integrity import COPIES, DamagedError, check_arrays, check_digest, claimed_bytes
from subzero.files.read_file import UnreadableFileError, check_readable
from subzero.validity import RunWarning, notes_of, warnings_of

if TYPE_CHECKING:
    import pandas as pd  # type: ignore[import-untyped]
    from matplotlib.figure import Figure

    from subzero.figures.style import Title

RENAMED_TERMS = {"external": "cable"}
"""Term of the force breakdown in files of version 0.2 → its name today."""

NEEDED = ("time", "surge_speed", "cable_tension", "cable_position", "force_breakdown")
"""Variables that every run has, and hardly another netCDF file."""
LAYOUT = {
    "force_breakdown": ("f", ("time", "term", "component")),
    "cable_position": ("f", ("time", "node", "earth_axis")),
    "cable_node_tension": ("f", ("time", "node")),
    "arc_length": ("f", ("time", "node")),
}
"""Variable of more than time → kind and dimensions; channels have the dimension time alone."""
TEXTS = ("scenario", "title", "outcome", "outcome_message")
TABLES = ("parameters", "versions", "warnings", "accuracy")
NUMBERS = ("tethered", "prescribed")
"""Attributes of a run: words, words in JSON, numbers."""


@checked_arguments
def open_run(path: str | Path) -> xr.Dataset:
    """Return a run from the netCDF file that `simulate`, `compare`, `manoeuvre` or `autopilot` has written.

    Names of earlier versions become today's, and the arc length is added where it is missing: the distance along the
    nodes.

    Args:
        path: the file, such as ``fig6/tethered.nc``.

    Raises:
        UserError: it cannot be read, or holds no run.
    """
    name = printable(str(path))
    try:
        check_readable(path)
        check_digest(Path(path))
        run = _loaded(Path(path))
    except UnreadableFileError as error:
        raise UserError(f"The run {name} cannot be read: {error.why}. {error.remedy}".rstrip()) from None
    except DamagedError as error:
        raise UserError(
            f"The run {name} is damaged: {error}. Take a copy of it, or run the command that wrote it again."
        ) from None
    return up_to_date(run)


def _loaded(path: Path) -> xr.Dataset:
    """Return the dataset in a file, once its arrays are known to be those of a run."""
    import netCDF4

    name = printable(str(path))
    try:
        file = netCDF4.Dataset(path)
    except Exception:  # the libraries raise whatever they meet
        raise UserError(f"The run {name} cannot be read: it is no netCDF file.") from None
    try:
        with file:
            _check_layout(file, name)
        with xr.open_dataset(path) as lazy:
            run = lazy.load()
        _check_values(run)
    except (UserError, DamagedError):
        raise
    except Exception as error:
        raise DamagedError(f"what it says cannot be read ({type(error).__name__})") from error
    return run


def _check_layout(file: Any, name: str) -> None:
    """Raise an error for a file without a run, and for arrays that are not those of a run."""
    missing = [variable for variable in NEEDED if variable not in file.variables]
    if missing or "scenario" not in file.ncattrs():
        raise UserError(
            f"{name} holds no run of subzero: it has no {', '.join(missing) or 'attribute scenario'}. "
            "Give a tethered.nc or untethered.nc."
        )
    today = {variable: RENAMED_CHANNELS.get(variable, variable) for variable in file.variables}
    channels = {old: ("fiu", (TIME.name,)) for old, channel in today.items() if channel in BY_NAME}
    check_arrays(
        file.variables, channels | {key: row for key, row in LAYOUT.items() if key in file.variables}
    )
    size = claimed_bytes(file.variables)
    if not fits(COPIES * size):
        raise DamagedError(f"it claims {size:.3g} bytes of numbers, more than fit into memory")


def _check_values(run: xr.Dataset) -> None:
    """Raise an error for invalid times and attributes of another kind; errors of reading them are passed on."""
    times = run["time"].values
    if not (times.size and np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
        raise DamagedError("its times do not rise")
    for kind, names in ((str, (*TEXTS, *TABLES)), ((int, float, np.number), NUMBERS)):
        for attribute in names:
            if attribute in run.attrs and not isinstance(run.attrs[attribute], kind):
                raise DamagedError(f"its attribute {attribute} is of another kind")
    for attribute in TABLES:
        json.loads(run.attrs.get(attribute, "{}"))


def up_to_date(run: xr.Dataset) -> xr.Dataset:
    """Return a run of an earlier version by today's names."""
    old = {name: now for name, now in RENAMED_CHANNELS.items() if name in run.variables}
    run = run.rename_vars(old)
    terms = [RENAMED_TERMS.get(str(term), str(term)) for term in run["term"].values]
    run = run.assign_coords(term=("term", terms, run["term"].attrs))
    if "arc_length" in run.coords:
        return run
    sides = np.linalg.norm(np.diff(run["cable_position"].values, axis=1), axis=2)
    arc = np.cumsum(sides, axis=1)
    first = np.where(np.isnan(run["cable_position"].values[:, :1, 0]), np.nan, 0.0)
    words = {"long_name": "distance along the nodes, from the tow point", "units": "m"}
    return run.assign_coords(arc_length=(("time", "node"), np.hstack([first, arc]), words))


@xr.register_dataset_accessor("subzero")  # type: ignore[no-untyped-call]  # xarray's has no types
class RunAccessor:
    """The methods of subzero for a run: ``run.subzero``.

    Args:
        run: a dataset of `subzero.simulate`.
    """

    def __init__(self, run: xr.Dataset) -> None:
        self._run = run

    @property
    def plot(self) -> RunPlots:
        """The figures of the run."""
        return RunPlots(self._run)

    @property
    def warnings(self) -> tuple[RunWarning, ...]:
        """The warnings about the run; none is best."""
        return tuple(warnings_of(self._run))

    @property
    def notes(self) -> tuple[RunWarning, ...]:
        """What else to know of the run, which is no fault."""
        return tuple(notes_of(self._run))

    def to_dataframe(self) -> pd.DataFrame:
        """Return the channels as a table, one row for each time; xarray's own has one for each node, term and axis."""
        channels = [name for name, values in self._run.data_vars.items() if values.dims == (TIME.name,)]
        return self._run[channels].to_dataframe()

    def __repr__(self) -> str:
        """Return the run in a few lines."""
        run, attributes = self._run, self._run.attrs
        speed, kind = run["surge_speed"], "Tethered" if attributes["tethered"] else "Untethered"
        lines = [
            f"{kind} run of {attributes['scenario']}: {textwrap.shorten(attributes['title'], 90)}",
            f"  {float(run['time'][-1]):g} s, {attributes['outcome']}, {len(self.warnings)} warnings",
            f"  peak speed {float(speed.max()):.3g} m/s, at the end {float(speed[-1]):.3g} m/s",
        ]
        if attributes["tethered"]:
            length, tension = float(run["cable_length"][-1]), float(run["cable_tension"].max())
            lines.append(f"  cable {length:.4g} m at the end, largest tension {tension:.3g} N")
        return "\n".join([*lines, f"  plot.{', plot.'.join(PLOTS)}"])


class RunPlots:
    """Figures of a run, made with matplotlib's objects: ``.savefig("tension.png")``, or shown by a notebook.

    Args:
        run: a dataset of `subzero.simulate`.
    """

    def __init__(self, run: xr.Dataset) -> None:
        check_is_run("plot", run)
        self._run = run

    def tension(self) -> Figure:
        """Return the tension along the cable over time as an image, and the largest and smallest that was anywhere.

        Raises:
            UserError: there is hardly any cable in the water.
        """
        from subzero.figures import tension

        figure = tension(self._run, self._title())
        if figure is None:
            raise UserError(
                "This run has no cable in the water, so there is no tension to draw. Draw the motion."
            )
        return figure

    def shape3d(self) -> Figure:
        """Return the cable at five times in three dimensions, with the way of the tow point."""
        from subzero.figures.cable import shape_3d

        return shape_3d(self._run, self._title())

    def motion(self) -> Figure:
        """Return how the vehicle moves: speed, heading, commands (Fig. 6), or a prescribed motion (Fig. 5)."""
        from subzero.figures import figure_5, figure_6

        if self._run.attrs["prescribed"]:
            return figure_5(self._run, self._title())
        return figure_6(self._by_label(), None, self._title())

    def forces(self) -> Figure:
        """Return the figure of all forces on the vehicle, term by term, and of the propeller's work."""
        from subzero.figures import forces

        return forces(self._run, self._title())

    def attitude(self) -> Figure:
        """Return the figure of attitude, depth and actuators."""
        from subzero.figures import attitude

        return attitude(self._by_label(), None, self._title())

    def cable(self) -> Figure:
        """Return the cable from above and from the side, and the tension along it, at five times."""
        from subzero.figures import shape

        return shape(self._run, self._title())

    @checked_arguments
    def channel(self, name: str) -> Figure:
        """Return one channel over time.

        Raises:
            UserError: the run has no such channel.
        """
        from subzero.figures.style import channel_panel, headline, sheet, time_label

        channel = chosen({row.name: row for row in channels_of(self._run)}, name, "channel")
        figure, panels = sheet(1, 1, self._title())
        channel_panel(panels[0], self._by_label(), name)
        headline(panels[0], channel.long_name)
        time_label(panels, 1)
        return figure

    def _by_label(self) -> dict[str, xr.Dataset]:
        return {"tethered" if self._run.attrs["tethered"] else "untethered": self._run}

    def _title(self) -> Title:
        from subzero.figures.style import Title, warnings_in_short

        run = self._run
        warns: Any = warnings_in_short({"": run})
        return Title(words=run.attrs["title"], scenario=run.attrs["scenario"], warnings=warns)


@checked_arguments
def figures_of(run: xr.Dataset, what: Sequence[str] | None = None) -> dict[str, Figure]:
    """Return figures of a run by name.

    Args:
        run: a dataset of `subzero.simulate`.
        what: names of `PLOTS`, or channels, which are drawn over time; all that the run has if None.

    Raises:
        UserError: neither a figure nor a channel of this name.
    """
    plots, channels = RunPlots(run), [channel.name for channel in channels_of(run)]
    for name in what or ():
        if name not in PLOTS and name not in channels:
            hint = suggestion(name, (*PLOTS, *channels))
            raise UserError(
                f"There is no figure and no channel {short(name)}.{hint} Figures: {', '.join(PLOTS)}; or a channel of "
                "the run, such as heading, depth, cable_tension."
            )
    usual = PLOTS if run.attrs["tethered"] else UNTETHERED_PLOTS
    return {name: getattr(plots, name)() if name in PLOTS else plots.channel(name) for name in what or usual}


PLOTS = ("tension", "shape3d", "motion", "forces", "attitude", "cable")
"""Methods of `RunPlots`, and the names that ``subzero plot --what`` takes."""

UNTETHERED_PLOTS = tuple(name for name in PLOTS if name not in ("tension", "cable"))
"""Those that a run without a cable has."""
