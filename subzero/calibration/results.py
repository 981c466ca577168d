"""The result of a calibration, as values: estimates, undetermined directions, held-out errors, advice on trials to
fly.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from subzero.diagnosis.results import CALIBRATED, NOTHING_NEAR, Curves
from subzero.errors import UserError

REMEDY = (
    "Hold records and trials together first: units, signs, commands, clock, cable. Then free what may be far off "
    "(--free), begin with a vehicle that is nearer (--vehicle), or leave the worst record out."
)
"""The advice if no numbers come near the records."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A number of the vehicle (or the cable), estimated.

    Attributes:
        name: dotted, such as "vehicle.axial_drag.drag_coefficient".
        unit: of all values, as in the file.
        before: the number in the file.
        value: the most probable.
        sd: its standard deviation; the interval of 95 % is 1.96 times as far to either side, within bounds.
        low, high: the interval of 95 %.
        prior_sd: standard deviation beforehand, from the range of the file.
        tolerance: how far a healthy vehicle may be from the estimate: its uncertainty, and what was allowed before.
        is_determined: the records, and not the prior alone, determine the value.
        is_at_bound: the estimate is at a bound of the possible values.
    """

    name: str
    unit: str
    before: float
    value: float
    sd: float
    low: float
    high: float
    prior_sd: float
    tolerance: float
    is_determined: bool
    is_at_bound: bool = False

    @property
    def change(self) -> float:
        """Change as a share of the number in the file; NaN where that is 0."""
        return (self.value - self.before) / abs(self.before) if self.before else float("nan")


@dataclass(frozen=True, kw_only=True)
class Direction:
    """A common change of some numbers that the records hardly show.

    Attributes:
        parts: name → change of one remaining standard deviation, in the number's unit; the largest ones.
        left: remaining share of the prior standard deviation.
        sentence: in words.
    """

    parts: Mapping[str, float]
    left: float
    sentence: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Profile:
    """How much worse the best fit gets with a number held at other values.

    Attributes:
        values: of the number (n,), increasing; the estimate among them.
        rise: of −2 log of likelihood and prior above the best (n,); 3.84 is the bound of the interval of 95 %.
        low, high: where it is 3.84; infinite where it does not get so far.
    """

    values: np.ndarray
    rise: np.ndarray
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class Held:
    """Errors in a channel of a record that was not fitted, in standard deviations of the noise (root mean square).

    Attributes:
        before: of the vehicle as its file has it.
        after: of the vehicle calibrated with all other records.
        fitted: of the vehicle calibrated with all records.
        noise: the level of the noise. [unit of the channel]
        samples: how many are compared.
    """

    before: float
    after: float
    fitted: float
    noise: float
    samples: int


@dataclass(frozen=True, kw_only=True)
class Advice:
    """A trial to fly next.

    Attributes:
        name, sentence: as in the library of trials.
        information: the information it would add on the free numbers. [nat]
        sharper: name → factor by which its standard deviation would shrink, the largest first.
        commands: rows of time [s], propeller [rev/s], rudder, port and starboard stern-plane [rad].
    """

    name: str
    sentence: str
    information: float
    sharper: Mapping[str, float]
    commands: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Source:
    """A record that was used: its name, its file, SHA-256 of that, its trial, samples and length [s]."""

    name: str
    file: str
    sha256: str
    trial: str
    samples: int
    duration: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration:
    """A calibrated vehicle.

    Attributes:
        estimates: of the numbers that were free.
        correlation: of the estimates (n, n).
        directions: the directions that these records do not determine, the least determined first.
        profiles: name → profile; empty if they were not made.
        held_out: record → channel → errors; of one record alone, of blocks of it.
        how: the samples that were held out: "other trials" or "blocks of the same trial".
        advice: the trials to fly next, the best first.
        nuisances: parameter → (mean, standard deviation) in tolerances, of sensors, clock, current, cable and start.
        strange: sentences on what the calibrated vehicle leaves that is no noise; empty if all is.
        refused: sentences on why the fit is no calibration, the verdict "nothing_near"; empty if it is one.
        curves: record → the measurements, and the simulation before and after.
        records: the records it was made of.
        files: name → text of the calibrated vehicle (and cable); empty where nothing came near.
        notes: further remarks.
        converged: the fit found a minimum.
        seconds: task → how long it took. [s]
    """

    estimates: tuple[Estimate, ...]
    correlation: np.ndarray
    directions: tuple[Direction, ...]
    profiles: Mapping[str, Profile]
    held_out: Mapping[str, Mapping[str, Held]]
    how: str
    advice: tuple[Advice, ...]
    nuisances: Mapping[str, tuple[float, float]]
    strange: tuple[str, ...]
    curves: Mapping[str, Curves]
    records: tuple[Source, ...]
    files: Mapping[str, str]
    refused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    converged: bool = True
    seconds: Mapping[str, float] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Estimate:
        """Return the estimate of a number; "vehicle." may be left out.

        Raises:
            KeyError: it was not free.
        """
        return {
            key: estimate
            for estimate in self.estimates
            for key in (estimate.name, estimate.name.removeprefix("vehicle."))
        }[name]

    def error(self, when: str = "after") -> float:
        """Return the root mean square over all records and channels of errors `before`, `after` or `fitted`. [noise]"""
        rows = [channel for channels in self.held_out.values() for channel in channels.values()]
        squares = [row.samples * getattr(row, when) ** 2 for row in rows]
        return float(np.sqrt(sum(squares) / max(sum(row.samples for row in rows), 1)))

    @property
    def verdict(self) -> str:
        """The verdict: "calibrated", or "nothing_near" where no numbers leave noise."""
        return NOTHING_NEAR if self.refused else CALIBRATED

    @property
    def vehicle(self) -> str:
        """The text of the calibrated vehicle's file.

        Raises:
            UserError: nothing came near, so that there is no such vehicle.
        """
        if self.refused:
            raise UserError(f"There is no calibrated vehicle: {' '.join(self.refused)} {REMEDY}")
        return self.files["vehicle"]
