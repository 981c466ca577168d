"""What a diagnosis found, as values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import TypeVar

import numpy as np

from subzero.channels import BY_NAME
from subzero.external_force import MissingForce
from subzero.files.text_repr import Overview

Name = TypeVar("Name")

NOTHING_WRONG, CALIBRATED, CAUSE_NAMED, UNDECIDED, OUT_OF_CATALOGUE, NOTHING_NEAR, DATA_ERROR = (
    "nothing_wrong",
    "calibrated",
    "cause_named",
    "undecided",
    "outside_catalogue",
    "nothing_near",
    "data_error",
)
"""The seven verdicts."""
NAMED_FROM, MAX_NAMED = 0.01, 5
"""Least probability of an explanation that is named as explaining the records as well; most explanations that are
named.
"""


def worth_naming(probabilities: Mapping[Name, float]) -> list[Name]:
    """Return the explanations that words and figures name in an undecided verdict, at least two of them."""
    ranked = sorted(probabilities, key=lambda name: -probabilities[name])[:MAX_NAMED]
    return ranked[: max(sum(probabilities[name] >= NAMED_FROM for name in ranked), 2)]


@dataclass(frozen=True, kw_only=True)
class FoundError:
    """An error in the data of a record, made by its logger, its file or a person.

    Attributes:
        id: such as "sign:heading", "unit:depth=feet", "late_clock".
        record: its name.
        columns: affected columns; "time_s" for a clock.
        sentence: description of the error, in words.
        remedy: what to change, in words.
        probability: of it.
        amount: size of an error with a number: a delay [s], a rate [1], a step [unit of the column]; else 0.
        amount_sd: its standard deviation; 0 where it is not known.
        since: time from which on it holds, if it begins in mid-trial. [s]
        alike: other errors that the record cannot distinguish from it, in words.
    """

    id: str
    record: str
    columns: tuple[str, ...]
    sentence: str
    remedy: str
    probability: float
    amount: float = 0.0
    amount_sd: float = 0.0
    since: float = 0.0
    alike: tuple[str, ...] = ()


SHOWN_PROBABILITIES = 3
"""Number of hypotheses in the overview of a verdict."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A parameter as estimated from the records.

    Attributes:
        value: as a whole, with the nominal model's part. [unit]
        low, high: 95 % interval. [unit]
        unit: of all of them.
        nominal: of the model. [unit]
        deviation: value − nominal. [unit]
        deviation_sd: its standard deviation. [unit]
    """

    value: float
    low: float
    high: float
    unit: str
    nominal: float
    deviation: float
    deviation_sd: float


@dataclass(frozen=True, kw_only=True)
class Cause:
    """A cause with its probability, parameters, and when it began (None: before the trial), give or take a standard
    deviation. [s]
    """

    id: str
    sentence: str
    probability: float
    parameters: Mapping[str, Estimate]
    start_time: float | None = None
    start_sd: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Rival:
    """Another explanation.

    Attributes:
        ids: its causes; empty for "nothing is wrong".
        sentence: in words.
        probability: of it.
        discrimination: D between it and the reported explanation, or the most probable one: below 9 the records
            cannot tell them apart; NaN of that one itself, and where it is not known. [-]
        parameters: cause id → name → estimate.
        extended: the whole model with it, as fitted; None where it was not fitted, and of a force or a drift.
    """

    ids: tuple[str, ...]
    sentence: str
    probability: float
    discrimination: float
    parameters: Mapping[str, Mapping[str, Estimate]] = field(default_factory=dict)
    extended: Extended | None = None


@dataclass(frozen=True, kw_only=True)
class Detectability:
    """The detectability of a cause in these records, known before they are searched.

    Attributes:
        id: the cause.
        signal: size of the response to one effect scale, in noise and tolerances. [-]
        smallest: the smallest detectable deviation (signal 4), by parameter. [unit]
        rival: the cause with the most similar response.
        discrimination: D against it at one effect scale. [-]
        cosine: similarity of the two responses, 0 to 1.
        units: of `smallest`, by parameter; "1" for a share.
    """

    id: str
    signal: float
    smallest: Mapping[str, float]
    rival: str
    discrimination: float
    cosine: float
    units: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Misfit:
    """How a channel of a record differs from the nominal simulation; residual = measured − simulated, display units.

    Attributes:
        rmse: root mean square.
        nrmse: the same over the noise. [-]
        fit_percent: 100 (1 − |residual| / |measured − its mean|).
        bias: mean.
        whiteness_p: probability that white noise would be as coloured (Ljung-Box, 25 lags, after whitening).
        command_correlation: command → (lag [s], correlation), the strongest.
        windows: times with a significant misfit: (from, to). [s]
        noise_sd: of the channel, estimated.
        noise_slow, noise_time: standard deviation of its slow part, and correlation time of that [s].
        resolution: the step that values are rounded to; 0 for none.
        outliers: samples that are left out.
        gaps: samples that are missing.
    """

    rmse: float
    nrmse: float
    fit_percent: float
    bias: float
    whiteness_p: float
    command_correlation: Mapping[str, tuple[float, float]]
    windows: tuple[tuple[float, float], ...]
    noise_sd: float
    noise_slow: float
    noise_time: float
    resolution: float
    outliers: int
    gaps: int


@dataclass(frozen=True, kw_only=True)
class ChannelGain:
    """Error of a channel in its unit: nominal, refit within tolerances, extended, best rival, and the noise floor."""

    before: float
    tolerance: float
    after: float
    rival: float
    floor: float


@dataclass(frozen=True, kw_only=True)
class Gain:
    """The gain of the extended model (`gain`).

    Attributes:
        fitted: channel → errors on the data that were fitted.
        held_out: channel → errors on blocks or trials that were not.
        total: G0 = (E_nominal − E_extended)/(E_nominal − floor), held out. [-]
        owed: G1 = (E_tolerance − E_extended)/(E_tolerance − floor), held out: owed to the new physics. [-]
        owed_low: its 95 % lower bound by block bootstrap. [-]
        how: "blocks of the same trial" or "other trials".
    """

    fitted: Mapping[str, ChannelGain]
    held_out: Mapping[str, ChannelGain]
    total: float
    owed: float
    owed_low: float
    how: str


@dataclass(frozen=True, kw_only=True)
class NextTrial:
    """The trial that would best separate the remaining explanations.

    Attributes:
        name: of the library, or "optimised".
        sentence: instructions, in words.
        decides: expected probability that it decides. [-]
        discrimination: D between the two causes hardest to tell apart, there. [-]
        channel: a channel worth adding, "" if none is needed.
        commands: rows (time [s], propeller [rev/s], rudder, port, starboard plane [rad]).
    """

    name: str
    sentence: str
    decides: float
    discrimination: float
    channel: str
    commands: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, kw_only=True)
class Extended:
    """The extended model: deviations from the nominal one (effect id → parameter → deviation), and other additions.

    Attributes:
        deviations: of the named causes.
        start_times: effect id → onset. [s]
        calibration: deviations within tolerance that the refit found, of all other effects.
        missing: the force that no effect explains.
    """

    deviations: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    start_times: Mapping[str, float] = field(default_factory=dict)
    calibration: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    missing: MissingForce | None = None


WAVE = "wave"
"""Feature of a formula for an oscillation of its own; the other features are those of `subzero.external_force`."""


@dataclass(frozen=True, kw_only=True)
class Unknown:
    """A latent force or moment, or the drift of a sensor.

    Attributes:
        axis: X, Y, Z, K, M or N; the channel of a sensor that drifts.
        time: [s]
        force: in body axes; or the error of the sensor. [`unit`]
        band: its standard deviation. [`unit`]
        formula: terms in words with coefficient and interval: (words, feature, coefficient, low, high).
        features: feature → probability that it belongs to the formula, most probable first.
    """

    axis: str
    time: np.ndarray
    force: np.ndarray
    band: np.ndarray
    formula: tuple[tuple[str, str, float, float, float], ...] = ()
    features: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_drift(self) -> bool:
        """It is the drift of a sensor."""
        return self.axis not in "XYZKMN"

    @property
    def unit(self) -> str:
        """N, N m, or that of the channel."""
        return BY_NAME[self.axis].unit if self.is_drift else "N" if self.axis in "XYZ" else "N m"


@dataclass(frozen=True, kw_only=True)
class Curves:
    """A record and the predictions of models, for the figures: name → channel → values at the record's times.

    Attributes:
        time: of the record. [s]
        measured: channel → values, NaN in gaps.
        models: "nominal", "tolerance", "extended", "rival: <ids>" → channel → values.
        used: channel → which samples were used.
        recorded: channel → times and values as they were before errors in its data were corrected.
    """

    time: np.ndarray
    measured: Mapping[str, np.ndarray]
    models: Mapping[str, Mapping[str, np.ndarray]]
    used: Mapping[str, np.ndarray]
    recorded: Mapping[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The outcome of `subzero.diagnose`.

    Attributes:
        verdict: one of the seven.
        sentence: the verdict in words.
        causes: those that are named.
        rivals: other explanations that the records allow, most probable first; all of them in an undecided verdict.
        probabilities: hypothesis ("none", "rudder_lag", "a + b", "unknown_force:X") → probability.
        tolerance_scale: κ → probability that the tolerances are κ times as declared.
        detectable: smallest detectable sizes of causes.
        misfit: record → channel → how the nominal model fails.
        gain: of the extended model, on held-out data.
        unknown: the latent force or drift.
        extended: the extended model.
        next_trial: recommended next trial.
        deviations: parameter → (mean, standard deviation) of the best fit, in tolerances.
        curves: record → curves.
        notes: further remarks for a reader.
        seconds: duration of each part.
        seed: of all random numbers.
        complete: False if it was interrupted.
        data_errors: errors in the data; all other fields are about the records without them.
        then: the verdict on the records without these errors; "" if nothing is wrong with the data.
        unstable: records whose motion is unstable, so that no simulation follows them for long.
    """

    verdict: str
    sentence: str
    causes: tuple[Cause, ...] = ()
    rivals: tuple[Rival, ...] = ()
    probabilities: Mapping[str, float] = field(default_factory=dict)
    tolerance_scale: Mapping[float, float] = field(default_factory=dict)
    detectable: tuple[Detectability, ...] = ()
    misfit: Mapping[str, Mapping[str, Misfit]] = field(default_factory=dict)
    gain: Gain | None = None
    unknown: Unknown | None = None
    extended: Extended = field(default_factory=Extended)
    next_trial: NextTrial | None = None
    deviations: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    curves: Mapping[str, Curves] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0
    complete: bool = True
    data_errors: tuple[FoundError, ...] = ()
    then: str = ""
    unstable: tuple[str, ...] = ()

    @property
    def on_model(self) -> str:
        """The verdict on the model: on the records without the errors in their data."""
        return self.then or self.verdict

    def __repr__(self) -> str:
        """Return the verdict in a few lines."""
        return self._overview().text()

    def _repr_html_(self) -> str:
        """Return the same for a notebook."""
        return self._overview().html()

    def _overview(self) -> Overview:
        """Return the verdict, named causes, other probable explanations, the gain and the next trial."""
        rows = [
            ("cause", f"{cause.id}: {cause.sentence} (probability {cause.probability:.3f})")
            for cause in self.causes
        ]
        if self.unknown is not None:
            rows.append(
                ("unknown", f"{'drift of' if self.unknown.is_drift else 'force along'} {self.unknown.axis}")
            )
        ranked = sorted(self.probabilities.items(), key=lambda item: -item[1])[:SHOWN_PROBABILITIES]
        rows.append(("probable", ", ".join(f"{name} {share:.3f}" for name, share in ranked)))
        if self.gain is not None and isfinite(self.gain.total):
            rows.append(
                ("gain", f"{100.0 * self.gain.total:.1f} % of what can be explained of data not fitted")
            )
        if self.next_trial is not None:
            rows.append(("next trial", f"{self.next_trial.name}: {self.next_trial.sentence}"))
        rows.append(("records", ", ".join(self.misfit)))
        incomplete = "" if self.complete else " (interrupted)"
        return Overview(
            f"Verdict {self.verdict}{incomplete}: {self.sentence}", [row for row in rows if row[1]]
        )
