"""Write an extended model, as `subzero.diagnosis.extended` explains it."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from subzero.diagnosis.effect import Effect
from subzero.diagnosis.extended import STARTS, all_effects, force_key, key_of, plain_id, starts_of
from subzero.diagnosis.setting import Setting
from subzero.diagnosis.verdict import Extended
from subzero.errors import printable
from subzero.external_force import AXES, FEATURES, MissingForce

DIGITS = 8
"""Significant ones in the file."""


def text_of(
    extended: Extended,
    setting: Setting,
    *,
    effects: Mapping[str, Effect] | None = None,
    effects_file: str | Path | None = None,
    source: str = "",
) -> str:
    """Return the text of an extended.toml.

    Args:
        extended: the deviations.
        setting: the nominal one, for the comments.
        effects: by id, all that are named; ours if None.
        effects_file: Python file of the user's own effects, if there are any.
        source: what it was found from.
    """
    known = effects or all_effects()
    own = f" --effects {shlex.quote(printable(str(effects_file)))}" if effects_file else ""
    lines = [
        "# The model extended by what a diagnosis found. Numbers are deviations from the nominal model.",
        f"# Run it:  subzero simulate {setting.trial.source} --with extended.toml{own}",
        f"scenario = {_text(setting.trial.source)}",
    ]
    lines += [f"source = {_text(source)}"] if source else []
    lines += [f"effects_file = {_text(str(effects_file))}"] if effects_file else []
    for section, table in (("effects", extended.deviations), ("calibration", extended.calibration)):
        for name, numbers in table.items():
            start = starts_of(extended).get(name) if section == "effects" else None
            lines += [
                "",
                *_effect_lines(f"{section}.{_key(name)}", known[plain_id(name)], numbers, start, setting),
            ]
    return "\n".join([*lines, *_missing_lines(extended.missing)]) + "\n"


def _effect_lines(
    header: str, effect: Effect, numbers: Mapping[str, float], start: float | None, setting: Setting
) -> Iterator[str]:
    yield f"[{header}]{'':8}# {effect.sentence}"
    for parameter in effect.parameters:
        value, nominal = numbers.get(parameter.name, 0.0), parameter.nominal(setting)
        unit = "" if parameter.unit == "1" else f" {parameter.unit}"
        meaning = f"as a whole {nominal + value:.6g}{unit}, the model has {nominal:.6g}{unit}"
        yield f"{key_of(parameter)} = {_number(value)}{'':8}# {meaning}"
    if start is not None:
        yield f"{STARTS} = {_number(start)}{'':8}# it began in mid-trial"


def _missing_lines(missing: MissingForce | None) -> Iterator[str]:
    """Yield a section for every axis that has a history, and one for every term."""
    for at, axis in enumerate(AXES if missing and missing.time else ()):
        history = [row[at] for row in missing.wrench] if missing else []
        if missing and any(history):
            yield from ("", "[[missing_force]]", f'axis = "{axis}"')
            yield f"time_s = {_list(missing.time)}"
            yield f"{force_key(axis)} = {_list(history)}"
    for term in missing.terms if missing else ():
        yield from ("", "[[missing_term]]", f'axis = "{term.axis}"', f"feature = {_text(term.feature)}")
        yield f"coefficient = {_number(term.coefficient)}{'':8}# {term.unit}: {FEATURES[term.feature].words}"


def _list(values: Iterable[float]) -> str:
    return f"[{', '.join(_number(value) for value in values)}]"


def _number(value: float) -> str:
    """Return a number that TOML reads as a float, in more digits than any of them is good for."""
    return repr(float(f"{value:.{DIGITS}g}"))


def _key(name: str) -> str:
    """Return an id as TOML takes it: in quotes if it has a colon or an @."""
    return name if name.replace("_", "").isalnum() else _text(name)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
