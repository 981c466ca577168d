"""An extended model as a TOML file that anyone can run: written, and read with all its problems reported.

    scenario = "fig6"

    [effects.rudder_lag]            # the rudder servo lags
    time_constant_s = 0.21          # deviation; as a whole 0.31 s, the model has 0.1 s
    starts_at_s = 12.0              # only if it began in mid-trial

    [calibration.hull_drag]         # within tolerance, found by the refit
    share = 0.012

    [[missing_force]]               # what no effect explains: a history
    axis = "X"
    time_s = [0.0, 2.0, 4.0]
    force_N = [0.0, -0.3, -0.2]     # K, M, N: moment_N_m

    [[missing_term]]                # … or a formula
    axis = "X"
    feature = "u|u|"
    coefficient = -1.2              # N s2/m2

Numbers are deviations from the nominal model, with their unit in the key: ``subzero simulate fig6 --with FILE``. It
may name the Python file that its effects came from. That file is never run from here, as reading data must not run
code: a user who trusts it says so on the command line (``--effects FILE``).
"""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenarios import ScenarioError
from scenarios.files import Source, read_toml
from subzero.arguments import checked_arguments
from subzero.channels import RENAMED_CHANNELS
from subzero.diagnosis.hypothesis.catalogue import all_effects, with_own
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect, Parameter, plain_id
from subzero.diagnosis.hypothesis.hypotheses import starts_of
from subzero.diagnosis.results import Extended
from subzero.errors import UserError, listed, printable, suggestion
from subzero.errors import short as shown
from subzero.external_force import AXES, FEATURES, MissingForce, Term

STARTS = "starts_at_s"
"""Key of the onset of a cause that began in mid-trial."""
DIGITS = 8
"""Significant digits in the file."""


@dataclass(frozen=True, kw_only=True)
class ExtendedFile:
    """The contents of an extended.toml.

    Attributes:
        extended: the deviations.
        effects: every effect that it names, by id.
        scenario: the one it was found with.
    """

    extended: Extended
    effects: Mapping[str, Effect]
    scenario: str = ""


def key_of(parameter: Parameter) -> str:
    """Return the key of a parameter, with its unit: ``time_constant_s``, ``force_N_per_min``; a share has none."""
    unit = parameter.unit.removeprefix("1").replace("degree", "deg").replace("/min", " per_min")
    return "_".join([parameter.name, *unit.replace("/", " ").split()])


def force_key(axis: str) -> str:
    """Return the key of a history on an axis, with its unit."""
    return "force_N" if axis in "XYZ" else "moment_N_m"


@checked_arguments
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
        effects: by id, all that are named; those of the catalogue if None.
        effects_file: Python file of the user's own effects, if there are any.
        source: records that it was found from.
    """
    known = effects or all_effects(with_own((), setting.model.vehicle))
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
    """Return a number that TOML reads as a float, in more digits than are significant."""
    return repr(float(f"{value:.{DIGITS}g}"))


def _key(name: str) -> str:
    """Return an id as TOML takes it: in quotes if it has a colon or an @."""
    return name if name.replace("_", "").isalnum() else _text(name)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


KEYS = ("scenario", "source", "effects_file", "effects", "calibration", "missing_force", "missing_term")


LARGEST = 1e9
"""No deviation, time [s], force [N] or coefficient is larger; sums and squares of such numbers remain finite."""

MOST_PARTS = 100
"""Most forces of one kind that are read: a dozen for each axis and more; each costs time in every step of a
simulation.
"""


@checked_arguments
def read_extended(path: str | Path, effects: Iterable[Effect] = ()) -> ExtendedFile:
    """Read an extended model.

    Args:
        path: the file.
        effects: those that it may name besides the catalogue.

    Raises:
        UserError: it cannot be used; names every problem with its line.
    """
    source = _toml(Path(path))
    table = source.table
    known = all_effects(effects)
    problems = [
        f"{_at(source, key)}: there is no such key.{suggestion(key, KEYS)} Allowed: {', '.join(KEYS)}."
        for key in table
        if key not in KEYS
    ]
    problems += [
        f"{_at(source, key)}: found {shown(table[key])}, but this is not a text in quotes"
        for key in ("scenario", "source", "effects_file")
        if not isinstance(table.get(key, ""), str)
    ]
    starts: dict[str, float] = {}
    deviations = _effects(source, "effects", known, starts, problems)
    calibration = _effects(source, "calibration", known, None, problems)
    missing = _missing(source, problems)
    if problems:
        raise UserError(listed(f"The extended model {printable(str(path))} cannot be used:", problems))
    extended = Extended(deviations=deviations, start_times=starts, calibration=calibration, missing=missing)
    named = table.get("scenario", "")
    return ExtendedFile(extended=extended, effects=known, scenario=named)


def _toml(path: Path) -> Source:
    try:
        return read_toml(path, str(path))
    except ScenarioError as error:
        problems = [str(problem) for problem in error.problems]
        raise UserError(
            listed(f"The extended model {printable(str(path))} cannot be used:", problems)
        ) from None


def _at(source: Source, key: str) -> str:
    line = source.line(key)
    return f"line {line}, {key}" if line else key


def _effects(
    source: Source,
    section: str,
    known: Mapping[str, Effect],
    starts: dict[str, float] | None,
    problems: list[str],
) -> dict[str, dict[str, float]]:
    """Return id → parameter → deviation of a section; errors are added to `problems`."""
    table = source.table.get(section, {})
    if not isinstance(table, Mapping):
        problems.append(f"{_at(source, section)}: this is not a section; write [{section}.rudder_lag]")
        return {}
    found: dict[str, dict[str, float]] = {}
    for said, numbers in table.items():
        at, name = _at(source, f"{section}.{said}"), _todays_id(said)
        if plain_id(name) not in known:
            problems.append(f"{at}: there is no effect '{name}'.{suggestion(name, known)}{_of_whom(source)}")
        elif "@" in name and not _is_time(name.partition("@")[2]):
            problems.append(f"{at}: behind the @ stands when it begins, in seconds: {plain_id(name)}@12")
        elif not isinstance(numbers, Mapping):
            problems.append(f"{at}: this is not a section; write [{section}.{name}]")
        else:
            began = {} if starts is None else starts
            found[name] = _numbers(at, name, known[plain_id(name)], numbers, began, problems)
    return found


def _todays_id(name: str) -> str:
    """Return the id of an effect with the present name of its channel: ``sensor_bias:roll`` is now
    ``…:roll_angle``.
    """
    effect, at, time = name.partition("@")
    kind, colon, channel = effect.partition(":")
    return f"{kind}{colon}{RENAMED_CHANNELS.get(channel, channel)}{at}{time}"


def _of_whom(source: Source) -> str:
    """Return the origin of an effect that is in no catalogue, as far as the file states it."""
    own = source.table.get("effects_file")
    if not own:
        return ""
    return (
        f" If it is in {shown(own)}, give that file with --effects; no file is run because another names it."
    )


def _numbers(
    at: str,
    name: str,
    effect: Effect,
    numbers: Mapping[str, Any],
    starts: dict[str, float],
    problems: list[str],
) -> dict[str, float]:
    """Return parameter → deviation of one effect, and note its onset."""
    parameters = {key_of(parameter): parameter for parameter in effect.parameters}
    found: dict[str, float] = {}
    for key, value in numbers.items():
        if not _is_number(value):
            problems.append(f"{at}: {key} is {shown(value)}, which is not a finite number")
        elif key == STARTS:
            problems += _start_problems(at, effect, value)
            starts[name] = float(value)
        elif key not in parameters:
            allowed = (*parameters, *([STARTS] if effect.sudden else []))
            problems.append(
                f"{at}: there is no '{key}'.{suggestion(key, allowed)} Allowed: {', '.join(allowed)}."
            )
        else:
            problems += _range_problems(at, key, parameters[key], value)
            found[parameters[key].name] = float(value)
    return found


def _start_problems(at: str, effect: Effect, value: float) -> list[str]:
    if not effect.sudden:
        return [f"{at}: {effect.id} does not begin in mid-trial; remove {STARTS}"]
    return [] if value > 0.0 else [f"{at}: {STARTS} is {value:g}; it must be above 0, or be left out"]


def _range_problems(at: str, key: str, parameter: Parameter, value: float) -> list[str]:
    slack = 1e-9 * (1.0 + abs(value))
    if parameter.low - slack <= value <= parameter.high + slack:
        return []
    return [f"{at}: {key} is {value:g}. Allowed: {parameter.low:g} to {parameter.high:g} (a deviation)."]


def _is_time(text: str) -> bool:
    return re.fullmatch(r"[0-9]{1,6}(\.[0-9]{0,12})?", text) is not None


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= LARGEST


def _missing(source: Source, problems: list[str]) -> MissingForce | None:
    """Return the missing force of a file, None if it has none."""
    histories = _parts(source, "missing_force", _history, problems)
    terms = _parts(source, "missing_term", _term, problems)
    total: MissingForce | None = None
    for part in (*_together(histories), *terms):
        total = part if total is None else total + part
    return total


def _together(histories: list[MissingForce]) -> list[MissingForce]:
    """Return histories with those at the same times added, which leaves their sum unchanged."""
    sums: dict[tuple[float, ...], np.ndarray] = {}
    for history in histories:
        sums[history.time] = sums.get(history.time, 0.0) + np.array(history.wrench)
    return [
        MissingForce(time=time, wrench=tuple(map(tuple, wrench.tolist()))) for time, wrench in sums.items()
    ]


def _parts(
    source: Source, key: str, read: Callable[[Mapping[str, Any]], MissingForce], problems: list[str]
) -> list[MissingForce]:
    entries = source.table.get(key, [])
    if not isinstance(entries, list) or not all(isinstance(entry, Mapping) for entry in entries):
        problems.append(f"{_at(source, key)}: write [[{key}]] and its keys below")
        return []
    if len(entries) > MOST_PARTS:
        problems.append(
            f"{_at(source, key)}: there are {len(entries)} of them; at most {MOST_PARTS} are read"
        )
        return []
    found = []
    for at, entry in enumerate(entries, start=1):
        try:
            found.append(read(entry))
        except (KeyError, TypeError, ValueError) as error:
            what = f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)
            problems.append(f"[[{key}]] number {at}: {what}")
    return found


def _history(entry: Mapping[str, Any]) -> MissingForce:
    axis = entry["axis"]
    if axis not in AXES:
        raise ValueError(f"axis is {shown(axis)}. Allowed: {', '.join(AXES)}.")
    time, force = entry["time_s"], entry[force_key(axis)]
    for name, values in (("time_s", time), (force_key(axis), force)):
        if not isinstance(values, list) or not all(map(_is_number, values)):
            raise ValueError(f"{name} is not a list of numbers")
    if len(time) != len(force):
        raise ValueError(
            f"time_s has {len(time)} numbers and {force_key(axis)} has {len(force)}; give as many"
        )
    at = AXES.index(axis)
    wrench = tuple(tuple(float(value) if i == at else 0.0 for i in range(len(AXES))) for value in force)
    return MissingForce(time=tuple(map(float, time)), wrench=wrench)


def _term(entry: Mapping[str, Any]) -> MissingForce:
    if not _is_number(entry["coefficient"]):
        raise ValueError(f"coefficient is {shown(entry['coefficient'])}, which is not a finite number")
    for key in ("axis", "feature"):
        if not isinstance(entry[key], str):
            raise TypeError(f"{key} is {shown(entry[key])}, which is not a text in quotes")
    return MissingForce(terms=(Term(entry["axis"], entry["feature"], float(entry["coefficient"])),))
