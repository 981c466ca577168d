"""The result of a cable, over time or at rest: tensions, forces, lengths and shapes, with units and the
convergence.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from typing import TYPE_CHECKING

import numpy as np

from cable.clamps import Clamps
from cable.current import Current
from cable.doubts import SLACK_SHARE, above_surface, doubts_of
from cable.modes import Modes, find_modes
from cable.range_graph import dataset_of, figure_of
from cable.sea_bed import SeaBed
from cable.sections import AnyCable
from subzero.errors import BadValueError, real, short
from subzero.files.text_repr import Overview, shown

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

LABELS = {
    "time": ("s", "time since the start"),
    "node": ("1", "node of the cable, 0 at the tow point, the last one at the drum"),
    "earth_axis": ("", "axis of the earth-fixed frame"),
    "arc_length": ("m", "distance along the nodes, from the tow point"),
    "tow_tension": ("N", "tension at the tow point"),
    "drum_tension": ("N", "tension at the drum"),
    "length": ("m", "length of cable that has left the drum"),
    "tow_force": ("N", "force of the cable on the vehicle"),
    "tow_point": ("m", "place of the tow point relative to the drum"),
    "tow_impulse": ("N s", "impulse of the cable on the vehicle just after this time"),
    "position": ("m", "place of the nodes relative to the drum"),
    "tension": ("N", "tension at the nodes"),
}
"""Name in the dataset of a `History` → unit and words."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a run ended, in words.

    Attributes:
        completed: the run reached its end.
        message: the outcome, when and where, and the advice; one sentence when all went well.
        iterations: Newton iterations in all.
        worst_residual: residual left in the last step, as a multiple of its tolerance.
        steps: how many steps were taken, with those that were made smaller than the time between two results.
        largest_courant_number: √(T/m1) Δt/Δs, how many segments a transverse wave crosses in a step, at most.
        energy_residual: residual of the balance of `moving_end.energy`, as a share of the total of the work and the
            loss.
    """

    completed: bool
    message: str
    iterations: int
    worst_residual: float
    steps: int = 0
    largest_courant_number: float = nan
    energy_residual: float = nan


@shown
@dataclass(frozen=True, kw_only=True)
class History:
    """The record of a cable run.

    Attributes:
        time: (n,). [s]
        tow_force: force of the cable on the vehicle, earth axes north, east, down (n, 3). [N]
        tow_tension: tension at the tow point T(0) (n,). [N]
        drum_tension: tension at the drum T(S) (n,). [N]
        length: length of the cable off the drum S (n,): in the water, and loose before a drum that runs ahead. [m]
        tow_point: position of the tow point relative to the drum (n, 3). [m]
        shapes: node positions relative to the drum, tow point first, one array (nodes, 3) per time. [m]
        tensions: tensions at the nodes, one array (nodes,) per time. [N]
        outcome: how the run ended; a stopped run keeps its results up to then.
        scheme: the scheme that was used.
        tow_impulse: impulse of the cable on the vehicle just after each time, where the tow point changes its
            velocity at once (n, 3), zero elsewhere; the tow forces do not show it (`moving_end.jolt`). Empty for other
            schemes. [N s]
        has_surface: whether the water had a free surface.
    """

    time: np.ndarray
    tow_force: np.ndarray
    tow_tension: np.ndarray
    drum_tension: np.ndarray
    length: np.ndarray
    tow_point: np.ndarray
    shapes: tuple[np.ndarray, ...]
    tensions: tuple[np.ndarray, ...]
    outcome: Outcome
    scheme: str
    tow_impulse: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    has_surface: bool = False

    def shape(self, t: float) -> np.ndarray:
        """Return the node positions (nodes, 3) relative to the drum at the recorded time nearest to t. [m].

        Raises:
            subzero.UserError: t lies outside the run.
        """
        return self.shapes[self._row(t)]

    def tension(self, t: float) -> np.ndarray:
        """Return the tensions at the nodes (nodes,) at the recorded time nearest to t. [N].

        Raises:
            subzero.UserError: t lies outside the run.
        """
        return self.tensions[self._row(t)]

    @property
    def closure_error(self) -> np.ndarray:
        """Distance between the tow point and the end of the cable summed up from the drum (n,). [m]."""
        return np.array(
            [np.linalg.norm(shape[0] - x) for shape, x in zip(self.shapes, self.tow_point, strict=True)]
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """Why the numbers of the run may be wrong, in sentences; none if nothing is known against them."""
        how, shapes = self.outcome.energy_residual, self.shapes
        found = doubts_of(self.time, self.tow_force, self.length, shapes, self.tensions, how)
        high = above_surface(shapes, [shape[:1] for shape in shapes]) if self.has_surface else ()
        return tuple(words for words in found if words not in high)

    def diagnostics(self) -> Mapping[str, float]:
        """Return the numbers that show how far to trust the run, by name."""
        return {
            "closure_error_m": float(self.closure_error.max()),
            "smallest_tension_N": float(min(tension.min() for tension in self.tensions)),
            "newton_iterations": float(self.outcome.iterations),
            "worst_residual": self.outcome.worst_residual,
            "steps": float(self.outcome.steps),
            "largest_courant_number": self.outcome.largest_courant_number,
            "energy_residual": self.outcome.energy_residual,
        }

    def to_dataset(self) -> xr.Dataset:
        """Return the run as an xarray dataset: time, node and axis named, units and words on everything.

        Variables are the fields of this class; the shapes are ``position``, the tensions ``tension`` (time, node), with
        the coordinate ``arc_length``, the distance along the nodes from the tow point. Rows are as long as the
        largest number of nodes requires, and are padded with NaN after the last one.

        >>> import cable
        >>> run = cable.pull_out(lambda t: (1.0, 0.0, 0.0), 2.0).to_dataset()
        >>> run["tension"].dims, run["tension"].attrs["units"]
        (('time', 'node'), 'N')
        """
        import xarray as xr  # heavy, and nothing else of a cable needs it

        position, tension = _filled(self.shapes), _filled(self.tensions)
        sides = np.linalg.norm(np.diff(position, axis=1), axis=2)
        arc = np.hstack([np.zeros((self.time.size, 1)), np.cumsum(sides, axis=1)])
        vectors = {"tow_force": self.tow_force, "tow_point": self.tow_point}
        vectors |= {"tow_impulse": self.tow_impulse} if self.tow_impulse.size else {}
        values = {
            **{name: (("time",), getattr(self, name)) for name in ("tow_tension", "drum_tension", "length")},
            **{name: (("time", "earth_axis"), vector) for name, vector in vectors.items()},
            "position": (("time", "node", "earth_axis"), position),
            "tension": (("time", "node"), tension),
        }
        coordinates = {
            "time": ("time", self.time),
            "node": ("node", np.arange(tension.shape[1])),
            "earth_axis": ("earth_axis", ["north", "east", "down"]),
            "arc_length": (("time", "node"), arc),
        }
        how = {
            "scheme": self.scheme,
            "completed": int(self.outcome.completed),
            "message": self.outcome.message,
        }
        run = xr.Dataset(values, coords=coordinates, attrs=how | dict(self.diagnostics()))
        for name, (unit, words) in LABELS.items():
            if name in run.variables:
                run[name].attrs.update({"units": unit, "long_name": words} if unit else {"long_name": words})
        return run

    def _overview(self) -> Overview:
        """Return how far it came, how much cable there is, and how it pulls."""
        largest = int(np.argmax(self.tow_tension))
        rows = [
            ("time", f"{self.time[0]:g} to {self.time[-1]:g} s, {self.time.size} rows"),
            ("length", f"{self.length[0]:.4g} m at the start, {self.length[-1]:.4g} m at the end"),
            (
                "tow tension",
                f"{self.tow_tension[-1]:.4g} N at the end, at most {self.tow_tension[largest]:.4g} N "
                f"at {self.time[largest]:.4g} s",
            ),
            ("drum tension", f"{self.drum_tension[-1]:.4g} N at the end"),
            ("outcome", self.outcome.message),
            *(("warning", words) for words in self.warnings),
            ("more", "shape(t), tension(t), diagnostics(), to_dataset()"),
        ]
        return Overview(f"Cable run, scheme {self.scheme}", rows)

    def _row(self, t: float) -> int:
        """Return the row whose time is nearest to t."""
        first, last = self.time[0], self.time[-1]
        time = real(t)
        if time is None or not first - 1e-9 <= time <= last + 1e-9:
            raise BadValueError(
                f"There is no shape at t = {short(t)} s: the run covers {first:g} to {last:g} s."
            )
        return int(np.abs(self.time - t).argmin())


def _filled(rows: Sequence[np.ndarray]) -> np.ndarray:
    """Return arrays of nodes (nodes, …) in rows of equal length (n, most nodes, …), NaN after the last node."""
    filled = np.full((len(rows), max(map(len, rows)), *rows[0].shape[1:]), np.nan)
    for row, values in zip(filled, rows, strict=True):
        row[: len(values)] = values
    return filled


@shown
@dataclass(frozen=True, kw_only=True)
class Equilibrium:
    """A cable at rest between two ends.

    Attributes:
        cable: the cable's properties.
        current: how the water moves.
        length: unstretched. [m]
        shape: node positions from the first end to the second, in the axes of `ends` (nodes, 3). [m]
        tensions: at the nodes (nodes,). [N]
        tow_force: force of the cable on the first end, north, east, down (3,). [N]
        drum_force: force of the cable on the second end (3,). [N]
        segment_lengths: unstretched (nodes − 1,). [m]
        segment_tensions: in the segments (nodes − 1,). [N]
        steps: how many steps the search took; 2 or 3 where Newton's method came through at once.
        bed: the sea bed; None without.
        bed_friction: of the bed on the nodes, as a share of its pressure, north, east, down (nodes, 3); empty without.
        clamps: directions in which it leaves its ends; None for hinges.
        surface: depth of the free surface; None for water everywhere. [m]
    """

    cable: AnyCable
    current: Current
    length: float
    shape: np.ndarray
    tensions: np.ndarray
    tow_force: np.ndarray
    drum_force: np.ndarray
    segment_lengths: np.ndarray
    segment_tensions: np.ndarray
    steps: int
    bed: SeaBed | None = None
    bed_friction: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    clamps: Clamps | None = None
    surface: float | None = None

    @property
    def slack_length(self) -> float:
        """How much of the cable is folded up without tension: its shape there means nothing. [m]."""
        chords = np.linalg.norm(np.diff(self.shape, axis=0), axis=1)
        stretched = self.segment_lengths * (1.0 + self.cable.compliance * self.segment_tensions)
        return float(self.segment_lengths[chords < (1.0 - 1e-6) * stretched].sum())

    @property
    def warnings(self) -> tuple[str, ...]:
        """Why the numbers may be wrong, in sentences; none if nothing is known against them."""
        share, high = self.slack_length / self.length, above_surface([self.shape], [self.shape[[0, -1]]])
        high = high if self.surface is None else ()
        if share <= SLACK_SHARE:
            return high
        return (f"{100.0 * share:.3g} % of the cable is slack: there its shape means nothing.", *high)

    def to_dataset(self) -> xr.Dataset:
        """Return places, tension, declination, curvature and bend radius at the nodes, as `cable.range_graph` says.

        >>> import cable
        >>> heavy = cable.CableProperties(mass_per_length=0.02)
        >>> rest = cable.hold([(9.0, 0.0, 0.0), (0.0, 0.0, 0.0)], 10.0, cable=heavy)
        >>> round(float(rest.to_dataset()["bend_radius"].min()), 1)
        5.6
        """
        return dataset_of(self)

    def plot(self) -> Figure:
        """Return a matplotlib figure: the cable from the side, and its tension, declination and curvature."""
        return figure_of(self)

    def modes(self, count: int = 6) -> Modes:
        """Return the natural modes of lowest frequency about this equilibrium, its ends held: `cable.modes`.

        >>> import cable
        >>> string = cable.CableProperties(compliance=1e-6)
        >>> taut = cable.hold([(0.0, 0.0, 0.0), (10.0, 0.0, 0.0)], 9.9, cable=string)
        >>> formula = 0.5 * (taut.tensions[0] / string.virtual_mass_per_length / 9.9 / 10.0) ** 0.5      # stretched
        >>> round(float(taut.modes().frequencies[0] / formula), 3)
        1.0

        Args:
            count: how many; fewer where the cable has fewer.

        Raises:
            subzero.UserError: a slack cable, one that nothing brings back to its shape, or more than 1000 segments.
        """
        return find_modes(self, count)

    def _overview(self) -> Overview:
        """Return its length, its span, and how it pulls at both ends."""
        span = float(np.linalg.norm(self.shape[-1] - self.shape[0]))
        rows = [
            ("length", f"{self.length:.4g} m between ends {span:.4g} m apart"),
            ("first end", _in_words(self.tow_force)),
            ("second end", _in_words(self.drum_force)),
            ("tension", f"{self.tensions.min():.4g} to {self.tensions.max():.4g} N"),
            *(("warning", words) for words in self.warnings),
        ]
        return Overview("Cable at rest", rows)


def _in_words(force: np.ndarray) -> str:
    """Return the size of a force (3,) [N], and its components."""
    parts = ", ".join(f"{part:.4g}" for part in force)
    return f"{np.linalg.norm(force):.4g} N: {parts} N north, east, down"
