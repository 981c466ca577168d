"""A verdict in tables that the terminal and the report share; cells are texts."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from subzero.diagnosis.report.words import (
    DRIFT,
    FORCE,
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
"""Discrimination D below which two causes cannot be distinguished, and above which they can."""

SEEN_SIGNAL = 4.0
"""Least detectable signal, in noise and tolerances."""


MOST_RIVALS, WORTH_A_LINE = 5, 0.01
"""Most rivals where space is short, and least probability of one."""

INVISIBLE = 0.01
"""Signal below which no possible size would be detectable."""


class Table(NamedTuple):
    """Rows of texts below a header."""

    header: tuple[str, ...]
    rows: list[tuple[str, ...]]


def detectable(verdict: Verdict | Sequence[Detectability], *, every: bool = False) -> Table:
    """Return the detectability of causes: of those that would be missed or mixed up, or of all."""
    rows = verdict.detectable if isinstance(verdict, Verdict) else verdict
    known = sentences(verdict) if isinstance(verdict, Verdict) else {}
    shown = [row for row in rows if every or row.signal < SEEN_SIGNAL or row.discrimination < CLEAR_FROM]
    shown = sorted(shown, key=lambda each: each.discrimination)
    header = ("cause", "signal", "smallest that is seen", "looks most like", "D", "", "id")
    return Table(
        header,
        [
            (
                explanation(each.id, known),
                f"{each.signal:.3g}",
                _smallest(each),
                explanation(each.rival, known) if each.rival else NOTHING,
                f"{each.discrimination:.3g}",
                _reported(each),
                each.id,
            )
            for each in shown
        ],
    )


def _smallest(detectability: Detectability) -> str:
    """Return the smallest detectable deviations, with their units; a share has none."""
    if detectability.signal < INVISIBLE:
        return NOTHING
    units = {name: "" if unit == "1" else f" {unit}" for name, unit in detectability.units.items()}
    sizes = [
        f"{name.replace('_', ' ')} {size:.3g}{units.get(name, '')}"
        for name, size in detectability.smallest.items()
    ]
    return "; ".join(sizes) or NOTHING


def _reported(detectability: Detectability) -> str:
    if detectability.signal < SEEN_SIGNAL:
        return "not seen"
    if detectability.discrimination < CONFUSED_BELOW:
        return "not told apart"
    return "hardly told apart" if detectability.discrimination < CLEAR_FROM else "told apart"


def misfit(rows: Mapping[str, Misfit]) -> Table:
    """Return how the nominal model fails in each channel of one record."""
    header = ("channel", "RMSE", "in noise", "fit %", "bias", "white?", "follows", "when")
    return Table(
        header,
        [
            (
                channel(name),
                f"{row.rmse:.3g}",
                f"{row.nrmse:.2f}",
                f"{row.fit_percent:.1f}",
                f"{row.bias:.2g}",
                probability(row.whiteness_p),
                _follows(row),
                _when(row),
            )
            for name, row in rows.items()
        ],
    )


def _follows(misfit: Misfit) -> str:
    """Return the command that the residual follows most, and the lag."""
    if not misfit.command_correlation:
        return NOTHING
    name, (lag, r) = max(misfit.command_correlation.items(), key=lambda item: abs(item[1][1]))
    return f"{name.removesuffix('_command').replace('_', ' ')} {r:+.2f} at {lag:.2g} s"


def _when(misfit: Misfit) -> str:
    return ", ".join(f"{start:.3g}–{end:.3g} s" for start, end in misfit.windows[:3]) or NOTHING


def rivals(verdict: Verdict, *, short: bool = False) -> Table:
    """Return the other explanations of the records, and their distance from the reported one; `short` without
    parameters.
    """
    if short:
        rows = [_short(each) for each in _worth(verdict.rivals)]
        words = (
            "what explains the records" if verdict.on_model == UNDECIDED else "what else explains the records"
        )
        return Table((words, "probability", "D"), rows[:MOST_RIVALS])
    return Table(
        ("explanation", "probability", "D", "parameters", "id"),
        [
            (
                rival_in_words(rival),
                probability(rival.probability),
                number(rival.discrimination),
                _numbers(rival),
                _id(rival),
            )
            for rival in verdict.rivals
        ],
    )


def _short(rival: Rival) -> tuple[str, ...]:
    return rival_in_words(rival), probability(rival.probability), number(rival.discrimination)


def _worth(found: Sequence[Rival]) -> Sequence[Rival]:
    """Return the rivals that are worth a line; the first one if none is."""
    return [each for each in found if each.probability >= WORTH_A_LINE] or found[:1]


def rival_in_words(rival: Rival) -> str:
    """Return a rival in words; a force or a drift in everyday words."""
    is_unknown = any(id.startswith((FORCE, DRIFT)) for id in rival.ids)
    return explanation(_id(rival)) if is_unknown else rival.sentence


def _id(rival: Rival) -> str:
    return " + ".join(rival.ids) or "none"


def _numbers(rival: Rival) -> str:
    return "; ".join(
        estimate(name, parameter) for table in rival.parameters.values() for name, parameter in table.items()
    )


def next_trial(trial: NextTrial) -> Table | None:
    """Return the commands of a trial that is in no file; None without them."""
    if not trial.commands:
        return None
    header = (
        "time [s]",
        "propeller [rev/s]",
        "rudder [degree]",
        "port plane [degree]",
        "starboard plane [degree]",
    )
    rows = [
        (f"{time:.4g}", f"{speed:.4g}", *(f"{math.degrees(angle) + 0.0:.3g}" for angle in angles))
        for time, speed, *angles in trial.commands
    ]
    return Table(header, rows)


GAINS = {
    "before": "nominal",
    "tolerance": "calibrated",
    "after": "extended",
    "rival": "best rival",
    "floor": "noise floor",
}
"""Errors of a channel → their names in a table; "calibrated" has no new physics."""


def gain(verdict: Verdict, *, short: bool = False) -> dict[str, Table]:
    """Return the errors before and after, with the noise: on held-out and on fitted data; `short` for a terminal:
    only on held-out data, if there are such, without the calibrated model.
    """
    if verdict.gain is None:
        return {}
    shown = {key: words for key, words in GAINS.items() if not (short and key == "tolerance")}
    parts = {f"held out ({verdict.gain.how})": verdict.gain.held_out, "fitted": verdict.gain.fitted}
    found = {
        words: Table(
            ("channel", *shown.values()),
            [(channel(name), *(number(getattr(row, key)) for key in shown)) for name, row in rows.items()],
        )
        for words, rows in parts.items()
        if rows
    }
    return dict(list(found.items())[:1]) if short else found
