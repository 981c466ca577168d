"""The verdict: how near the model is, which terms are named and why, which are not; as text, JSON, and a picture."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from subzero.identification.locks import Gain
from subzero.identification.nearness import Nearness
from subzero.identification.record import Record

NOTHING_WRONG, CALIBRATED, CAUSE_NAMED, UNKNOWN_NAMED, DATA_ERROR, UNDECIDED, NOTHING_NEAR = (
    "nothing_wrong",
    "calibrated",
    "cause_named",
    "unknown_input",
    "data_error",
    "undecided",
    "nothing_near",
)
"""Kinds of verdicts."""

UNSEEN = "one thing more that these records do not show"
"""All explanations with one term more than the best one that were not worth a fit."""
HEADLINES = {
    NOTHING_WRONG: "Nothing is wrong.",
    CALIBRATED: "No single cause: the parameters are farther off than their tolerances say.",
    CAUSE_NAMED: "A cause is named.",
    UNKNOWN_NAMED: "Something acts that no cause of the list explains.",
    DATA_ERROR: "The data have an error.",
    UNDECIDED: "Undecided.",
    NOTHING_NEAR: "The model is not near these records. Nothing is named.",
}

SHOWN, SIZES_SHOWN, KNOTS_SHOWN = 5, 12, 16
"""So many explanations are shown; so many sizes that would be seen; and at most so many knots of a history."""


@dataclass(frozen=True)
class Estimate:
    """A number of a term: its value and standard deviation, and the nominal value."""

    name: str
    value: float
    sd: float
    nominal: float


@dataclass(frozen=True)
class History:
    """An unknown input in a record, linear between its knots.

    Attributes:
        record: its name.
        unit: as it is shown.
        time: of the knots (n,). [s]
        value, sd: at the knots, with their standard deviations (n,). [unit]
    """

    record: str
    unit: str
    time: tuple[float, ...]
    value: tuple[float, ...]
    sd: tuple[float, ...]


@dataclass(frozen=True)
class Named:
    """A term of the best explanation.

    Attributes:
        id, sentence: of the term.
        is_data_error: whether it is about the data.
        probability: that it holds, over all explanations; of an unknown input, that any acts: records that show one
            may not tell where, which the explanations say.
        estimates: its numbers.
        gain: on what was not fitted; None if that was not tried.
        against: why it is not named, though it is probable; ().
        history: of an unknown input, in each record; () of another term.
    """

    id: str
    sentence: str
    is_data_error: bool
    probability: float
    estimates: tuple[Estimate, ...]
    gain: Gain | None = None
    against: tuple[str, ...] = ()
    history: tuple[History, ...] = ()


@dataclass(frozen=True)
class Share:
    """A part of a budget: what a free simulation leaves without and with one more term. [levels of the sensors]"""

    term: str
    before: float
    after: float


@dataclass(frozen=True, eq=False)
class Curves:
    """A channel of a record: what was measured, and free simulations of the nominal and the best model (m,)."""

    record: str
    channel: str
    unit: str
    time: np.ndarray
    measured: np.ndarray
    nominal: np.ndarray
    best: np.ndarray


@dataclass(frozen=True, eq=False)
class Verdict:
    """What a model gets wrong in some records.

    Attributes:
        verdict: one of the kinds.
        nearness: of the best explanation.
        named: causes, unknown inputs and errors in the data that are named.
        suspected: terms of the best explanation that are not named, with the reasons.
        explanations: ids of the terms → probability, the most probable first.
        relations: what all probable explanations have in common, in sentences.
        budget: what each term of the best explanation takes.
        remainder: where the rest acts, in words.
        visible_from: error or cause → the size from which on it would be seen.
        notes: what was done to the records.
        curves: to be drawn.
        complete: whether the search came to its end.
    """

    verdict: str
    nearness: Nearness
    named: tuple[Named, ...]
    suspected: tuple[Named, ...]
    explanations: Mapping[str, float]
    relations: tuple[str, ...]
    budget: tuple[Share, ...]
    remainder: str
    visible_from: Mapping[str, str]
    notes: tuple[str, ...] = ()
    curves: tuple[Curves, ...] = field(default=(), repr=False)
    complete: bool = True

    @property
    def causes(self) -> tuple[Named, ...]:
        """Causes that are named."""
        return tuple(each for each in self.named if not each.is_data_error and not each.history)

    @property
    def unknown_inputs(self) -> tuple[Named, ...]:
        """Unknown inputs that are named, with their histories."""
        return tuple(each for each in self.named if each.history)

    @property
    def data_errors(self) -> tuple[Named, ...]:
        """Errors in the data that are named."""
        return tuple(each for each in self.named if each.is_data_error)

    def __str__(self) -> str:
        lines = [HEADLINES[self.verdict], *_nearness_lines(self.nearness)]
        for each in self.named:
            lines += ["", *_named_lines(each)]
        for sentence in self.relations:
            lines += ["", sentence]
        for each in self.suspected:
            why = "; ".join(each.against) or f"its probability is {shown_probability(each.probability)}"
            lines += ["", f"Not named: {each.sentence}{_sizes_shown(each)}: {why}."]
        lines += ["", "Explanations, the most probable first:"]
        lines += [
            f"  {shown_probability(p):>7}  {name}" for name, p in list(self.explanations.items())[:SHOWN]
        ]
        lines += _budget_lines(self.budget, self.remainder)
        if self.visible_from and self.verdict in (NOTHING_WRONG, CALIBRATED, UNDECIDED):
            lines += ["", "What would be seen, if it were there, from this size on:"]
            lines += [f"  {name}: {size}" for name, size in list(self.visible_from.items())[:SIZES_SHOWN]]
            if len(self.visible_from) > SIZES_SHOWN:
                lines.append(f"  … {len(self.visible_from) - SIZES_SHOWN} more in verdict.visible_from")
        lines += [f"Note: {note}" for note in self.notes]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        from html import escape

        return f"<pre>{escape(str(self))}</pre>"

    def to_json(self) -> str:
        """Return the verdict as JSON, without the curves; infinite numbers as null."""
        found = {
            f.name: _plain(getattr(self, f.name)) for f in dataclasses.fields(self) if f.name != "curves"
        }
        return json.dumps(found, indent=2, allow_nan=False)

    def plot(self) -> Any:
        """Return a figure: each channel of each record, measured and in free simulation, and the residual; below them
        what unknown inputs were, with two standard deviations.
        """
        import matplotlib.pyplot as plt

        histories = [(term, each) for term in (*self.named, *self.suspected) for each in term.history]
        rows = len(self.curves) + len(histories)
        figure, axes = plt.subplots(rows, 2, figsize=(11.0, 2.6 * rows), squeeze=False, layout="constrained")
        for (left, right), (term, history) in zip(axes[len(self.curves) :], histories, strict=True):
            _plot_history(left, term, history)
            right.set_axis_off()
        for (left, right), each in zip(axes, self.curves, strict=False):
            left.plot(each.time, each.measured, ".", color="0.6", markersize=2.5, label="measured, corrected")
            left.plot(each.time, each.nominal, "--", color="tab:blue", linewidth=1.0, label="nominal model")
            left.plot(each.time, each.best, color="tab:red", linewidth=1.2, label="best explanation, free")
            right.plot(each.time, each.measured - each.nominal, "--", color="tab:blue", linewidth=0.8)
            right.plot(each.time, each.measured - each.best, color="tab:red", linewidth=0.8)
            right.axhline(0.0, color="0.5", linewidth=0.6)
            left.set_ylabel(f"{each.channel} [{each.unit or '-'}]")
            left.set_title(each.record, fontsize="small", loc="left")
            right.set_title("measured − simulated", fontsize="small", loc="left")
            for ax in (left, right):
                ax.set_xlabel("time [s]")
        axes[0][0].legend(fontsize="small")
        figure.suptitle(HEADLINES[self.verdict])
        return figure


def _plot_history(axes: Any, term: Named, history: History) -> None:
    value, wide = np.array(history.value), 2.0 * np.array(history.sd)
    axes.fill_between(history.time, value - wide, value + wide, color="tab:red", alpha=0.25, linewidth=0.0)
    axes.plot(history.time, value, color="tab:red", linewidth=1.2)
    axes.axhline(0.0, color="0.5", linewidth=0.6)
    axes.set_ylabel(f"{term.id.partition(':')[2]} [{history.unit or '-'}]")
    axes.set_title(f"{history.record}: {term.sentence}", fontsize="small", loc="left")
    axes.set_xlabel("time [s]")


def curves_of(
    record: Record, channel: str, unit: str, time: np.ndarray, rows: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> Curves:
    """Return curves of a channel of a record, from measured values and two residuals (m,)."""
    measured, nominal, best = rows
    return Curves(record.name, channel, unit, time, measured, measured - nominal, measured - best)


def shown_probability(p: float) -> str:
    """Return a probability in words."""
    if p > 0.999:
        return "> 0.999"
    return f"{p:.3f}" if p >= 0.001 else "< 0.001"


def _nearness_lines(near: Nearness) -> list[str]:
    lines = ["Is the model near? " + ("Yes." if near.near else f"No: {'; '.join(near.reasons)}.")]
    lines.append(
        f"  {'channel':<16}{'sensor':>10}{'left, free':>12}{'R':>8}{'left, with unknown inputs':>28}"
    )
    lines += [
        f"  {each.channel:<16}{each.level:>10.3g}{each.free:>12.3g}{each.ratio:>8.1f}{each.followed:>28.3g} {each.unit}"
        for each in near.left
    ]
    lines += [
        f"  unknown input {name}: {size:.3g} rms ({size / declared:.1f} times the declared size)"
        for name, (size, declared) in near.sizes.items()
    ]
    if near.bends:
        name, bend = next(iter(near.bends.items()))
        lines.append(f"  farthest parameter that is not named: {name}, {bend:.1f} tolerances")
    return lines


def _named_lines(each: Named) -> list[str]:
    about = " that this or another unknown input acts" if each.history else ""
    lines = [
        f"{each.sentence[:1].upper()}{each.sentence[1:]}: probability {shown_probability(each.probability)}{about}"
    ]
    lines += [f"  {e.name} = {e.value:.4g} ± {e.sd:.2g} (nominal {e.nominal:.4g})" for e in each.estimates]
    lines += [f"  {_history_shown(history)}" for history in each.history]
    if each.gain is not None:
        g = each.gain
        lines.append(
            f"  in {g.what}, free simulation leaves {g.after:.2f} levels of the sensors, {g.before:.2f} without it"
        )
    return lines


def _history_shown(history: History) -> str:
    """Return where a history is largest, and its values at some of its knots."""
    most = max(range(len(history.value)), key=lambda i: abs(history.value[i]))
    step = max(-(-len(history.value) // KNOTS_SHOWN), 1)
    some = ", ".join(f"{history.value[i]:.2g}" for i in range(0, len(history.value), step))
    return (
        f"{history.record}: largest at {history.time[most]:.4g} s, {history.value[most]:.3g} ± "
        f"{history.sd[most]:.2g} {history.unit}".rstrip()
        + f"; from {history.time[0]:.4g} s on every {step * (history.time[1] - history.time[0]):.3g} s: {some}"
    )


def _sizes_shown(each: Named) -> str:
    sizes = ", ".join(
        [
            *(f"{e.name} = {e.value:.4g} ± {e.sd:.2g}" for e in each.estimates),
            *(_history_shown(history) for history in each.history),
        ]
    )
    return f" ({sizes})" if sizes else ""


def _budget_lines(budget: tuple[Share, ...], remainder: str) -> list[str]:
    if not budget:
        return [remainder] if remainder else []
    parts = [f"{share.term} takes {share.before - share.after:.2f}" for share in budget]
    lines = (
        f"Of {budget[0].before:.2f} levels of the sensors, {', '.join(parts)}; {budget[-1].after:.2f} remain."
    )
    return ["", lines + (f" {remainder}" if remainder else "")]


def _plain(value: Any) -> Any:
    """Return a value as JSON has it."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(name): _plain(each) for name, each in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(each) for each in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value
