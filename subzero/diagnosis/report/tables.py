"""A verdict in tables that the terminal and the report share; cells are texts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from subzero.diagnosis.report.words import (
    NOTHING,
    channel,
    estimate,
    explanation,
    number,
    probability,
    sentences,
)
from subzero.diagnosis.results import UNDECIDED, Detectability, Misfit, NextTrial, Rival, Verdict

CONFUSED_BELOW, CLEAR_FROM = 9.0, 16.0
"""Discrimination D below which two causes cannot be told apart, and above which they can."""

SEEN_SIGNAL = 4.0
"""Signal, in noise and tolerances, that is seen."""


MOST_RIVALS, WORTH_A_LINE = 5, 0.01
"""So many are shown where space is short, and none that is less probable."""

INVISIBLE = 0.01
"""Signal below which no size that makes sense would be seen."""


class Table(NamedTuple):
    """Rows of texts below a header."""

    header: tuple[str, ...]
    rows: list[tuple[str, ...]]


def detectable(verdict: Verdict | Sequence[Detectability], *, every: bool = False) -> Table:
    """Return what the records could show: causes that would be missed or mixed up, or all of them."""
    rows = verdict.detectable if isinstance(verdict, Verdict) else verdict
    known = sentences(verdict) if isinstance(verdict, Verdict) else {}
    shown = [one for one in rows if every or one.signal < SEEN_SIGNAL or one.discrimination < CLEAR_FROM]
    shown = sorted(shown, key=lambda one: one.discrimination)
    header = ("cause", "signal", "smallest that is seen", "looks most like", "D", "", "id")
    return Table(header, [(explanation(one.id, known), f"{one.signal:.3g}", _smallest(one),
                           explanation(one.rival, known) if one.rival else NOTHING, f"{one.discrimination:.3g}",
                           _told(one), one.id) for one in shown])  # fmt: skip


def _smallest(one: Detectability) -> str:
    """Return the smallest deviations that are seen, with their units; of a share there is none."""
    if one.signal < INVISIBLE:
        return NOTHING
    units = {name: "" if unit == "1" else f" {unit}" for name, unit in one.units.items()}
    sizes = [
        f"{name.replace('_', ' ')} {size:.3g}{units.get(name, '')}" for name, size in one.smallest.items()
    ]
    return "; ".join(sizes) or NOTHING


def _told(one: Detectability) -> str:
    if one.signal < SEEN_SIGNAL:
        return "not seen"
    if one.discrimination < CONFUSED_BELOW:
        return "not told apart"
    return "hardly told apart" if one.discrimination < CLEAR_FROM else "told apart"


def misfit(rows: Mapping[str, Misfit]) -> Table:
    """Return how the nominal model fails in each channel of one record."""
    header = ("channel", "RMSE", "in noise", "fit %", "bias", "white?", "follows", "when")
    return Table(header, [(channel(name), f"{one.rmse:.3g}", f"{one.nrmse:.2f}", f"{one.fit_percent:.1f}",
                           f"{one.bias:.2g}", probability(one.whiteness_p), _follows(one), _when(one))
                          for name, one in rows.items()])  # fmt: skip


def _follows(one: Misfit) -> str:
    """Return the command that the residual follows most, and how late."""
    if not one.command_correlation:
        return NOTHING
    name, (lag, r) = max(one.command_correlation.items(), key=lambda item: abs(item[1][1]))
    return f"{name.removesuffix('_command').replace('_', ' ')} {r:+.2f} at {lag:.2g} s"


def _when(one: Misfit) -> str:
    return ", ".join(f"{start:.3g}–{end:.3g} s" for start, end in one.windows[:3]) or NOTHING


def rivals(verdict: Verdict, *, short: bool = False) -> Table:
    """Return what else explains the records, and how far it is from what is told; `short` without parameters."""
    if short:
        rows = [_short(one) for one in _worth(verdict.rivals)]
        words = (
            "what explains the records" if verdict.verdict == UNDECIDED else "what else explains the records"
        )
        return Table((words, "probability", "D"), rows[:MOST_RIVALS])
    return Table(("explanation", "probability", "D", "parameters", "id"),
                 [(rival_words(one), probability(one.probability), number(one.discrimination), _numbers(one),
                   _id(one)) for one in verdict.rivals])  # fmt: skip


def _short(one: Rival) -> tuple[str, ...]:
    return rival_words(one), probability(one.probability), number(one.discrimination)


def _worth(found: Sequence[Rival]) -> Sequence[Rival]:
    """Return the rivals that are worth a line; the first one if none is."""
    return [one for one in found if one.probability >= WORTH_A_LINE] or found[:1]


def rival_words(one: Rival) -> str:
    """Return a rival in words; a force or a drift as everybody understands it."""
    return explanation(_id(one), {_id(one): one.sentence} if ":" not in _id(one) else {})


def _id(one: Rival) -> str:
    return " + ".join(one.ids) or "none"


def _numbers(one: Rival) -> str:
    return "; ".join(
        estimate(name, parameter) for table in one.parameters.values() for name, parameter in table.items()
    )


def next_trial(one: NextTrial) -> Table | None:
    """Return the commands of a trial that is not in any file; None without them."""
    if not one.commands:
        return None
    header = (
        "time [s]",
        "propeller [rev/s]",
        "rudder [degree]",
        "port plane [degree]",
        "starboard plane [degree]",
    )
    rows = [(f"{time:.4g}", f"{speed:.4g}", *(f"{math.degrees(angle) + 0.0:.3g}" for angle in angles))
            for time, speed, *angles in one.commands]  # fmt: skip
    return Table(header, rows)


def gain(verdict: Verdict) -> dict[str, Table]:
    """Return error before and after, beside the noise: on held-out and on fitted data."""
    if verdict.gain is None:
        return {}
    header = ("channel", "nominal", "within tolerance", "extended", "best rival", "noise floor")
    parts = {f"held out ({verdict.gain.how})": verdict.gain.held_out, "fitted": verdict.gain.fitted}
    return {
        words: Table(header, [(channel(name), *(number(x) for x in (one.before, one.tolerance, one.after, one.rival,
                                                                    one.floor))) for name, one in rows.items()])
        for words, rows in parts.items()
        if rows
    }  # fmt: skip
