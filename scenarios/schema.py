"""The schema of a trial file: pydantic models made from the table of quantities, with messages in our words.

Only here is pydantic imported, and only when a file is read. Every section is checked by itself, so a mistake
in one does not hide those in another. Checks that compare several values live in `scenarios.reader`.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from scenarios.errors import Problem, nearest_and_all, nearest_or_all
from scenarios.files import Source
from scenarios.quantities import CONTROLS, INTERPOLATIONS, SCHEMES, SECTIONS, Quantity

STRICT = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

LISTS = ("commands", "motion")
"""Sections that may stand in a CSV file: one value a sample."""

CHOICES = {
    "scheme": ("this is not a scheme", SCHEMES),
    "control": ("a winch cannot do this", CONTROLS),
    "interpolation": ("a motion is not interpolated so", INTERPOLATIONS),
}
"""Keys that hold one of some words → why another cannot be, and the words."""


PAGE_FIELDS: dict[str, Any] = dict.fromkeys(("description", "vehicle", "cable"), (str, ...))
PAGE_FIELDS |= dict.fromkeys((*SECTIONS, "changes", "tolerances"), (dict[str, Any], {}))
Page = create_model("Page", __config__=STRICT, **PAGE_FIELDS)
"""A whole trial file; the contents of the sections are checked by `check_section`."""


FILE_REFERENCE = create_model("FileReference", __config__=STRICT, file=(str, ...))
MOTION_FIELDS: dict[str, Any] = {"interpolation": (Literal[INTERPOLATIONS] | None, None)}
MOTION_REFERENCE = create_model("MotionReference", __base__=FILE_REFERENCE, **MOTION_FIELDS)
"""Sections of samples that stand in a CSV file: of commands, and of a motion."""

MODELS_KEPT = 32
"""Every section has one, and the commands of each of the last few vehicles with actuators of their own."""


@lru_cache(maxsize=MODELS_KEPT)
def section_model(name: str, quantities: tuple[Quantity, ...]) -> type[BaseModel]:
    """Return the model of one section, made from the rows of its table of quantities."""
    fields: dict[str, Any] = {}
    for quantity in quantities:
        kind: Any = Annotated[float, Field(ge=quantity.low, le=quantity.high)]
        default: Any = ... if quantity.default is None else quantity.default
        if quantity.many:
            kind = Annotated[list[kind], Field(min_length=1)]
            default = ... if quantity.default is None else None
        fields[quantity.name] = (kind, default)
    if name == "run":
        fields["scheme"] = (Literal[SCHEMES], SCHEMES[0])
    if name == "winch":
        fields["control"] = (Literal[CONTROLS], ...)
    if name == "start":
        fields["at_trim"] = (bool, False)
    if name == "motion":
        fields |= MOTION_FIELDS
    return create_model(name, __config__=STRICT, **fields)


def check_page(source: Source) -> list[Problem]:
    """Check the outermost keys of a trial file."""
    _, problems = _validate(Page, source, "", source.table, {})
    return problems


def check_section(
    source: Source, name: str, raw: object, rows: tuple[Quantity, ...] | None = None
) -> tuple[dict[str, Any], list[Problem]]:
    """Check one section of a trial file.

    Args:
        source: the file, for the lines in messages.
        name: one of `SECTIONS`.
        raw: the contents of the file.
        rows: the numbers that it may hold, if not those of `SECTIONS`.

    Returns:
        its values, in the units of the file, as far as they are good; and the problems.
    """
    if not isinstance(raw, Mapping):
        return {}, []  # `check_page` has said so
    if name in LISTS and "file" in raw:
        reference = MOTION_REFERENCE if name == "motion" else FILE_REFERENCE
        return _validate(reference, source, name, raw, {})
    rows = SECTIONS[name] if rows is None else rows
    quantities = {quantity.name: quantity for quantity in rows}
    return _validate(section_model(name, rows), source, name, raw, quantities)


def _validate(
    model: type[BaseModel],
    source: Source,
    section: str,
    raw: Mapping[str, Any],
    quantities: Mapping[str, Quantity],
) -> tuple[dict[str, Any], list[Problem]]:
    """Return the values of a section, without those that have a problem, and the problems."""
    try:
        return model.model_validate(raw).model_dump(), []
    except ValidationError as error:
        allowed = list(model.model_fields)
        details = error.errors(include_url=False, include_context=False)
        problems = [_problem(source, section, detail, allowed, quantities) for detail in details]
        bad = {detail["loc"][0] for detail in details}
        return {name: raw[name] for name in allowed if name in raw and name not in bad}, problems


def _problem(
    source: Source, section: str, detail: Any, allowed: list[str], quantities: Mapping[str, Quantity]
) -> Problem:
    """Put one complaint of pydantic into our words."""
    name, *inside = detail["loc"]
    key = (f"{section}." if section else "") + str(name) + "".join(f"[{at}]" for at in inside)
    why, remedy = _explain(detail["type"], str(name), section, allowed, quantities)
    found = None if detail["type"] == "missing" else detail["input"]
    return source.problem(key, why, remedy, found=found)


def _explain(
    kind: str, name: str, section: str, allowed: list[str], quantities: Mapping[str, Quantity]
) -> tuple[str, str]:
    """Return why a value is not possible, and the remedy."""
    where = f"[{section}]" if section else "a trial file"
    limits = quantities[name].allowed if name in quantities else ""
    if kind == "extra_forbidden" and section == "commands" and len(allowed) > len(SECTIONS[section]):
        return "the vehicle has no such command", nearest_and_all(name, allowed)
    if kind == "extra_forbidden":
        return f"{where} has no such key", nearest_or_all(name, allowed)
    if name in CHOICES:
        limits = f"Allowed: {', '.join(CHOICES[name][1])}."
    if kind == "literal_error":
        return CHOICES[name][0], limits
    why = {
        "missing": f"this key is missing in {where}",
        "too_short": "the list is empty",
        "list_type": "this is not a list of numbers",
        "string_type": "this is not a text in quotes",
        "dict_type": "this is not a section",
        "bool_type": "this is neither true nor false",
        "finite_number": "this is not a finite number",
        "greater_than_equal": "this is outside its limits",
        "less_than_equal": "this is outside its limits",
    }
    return why.get(kind, "this is not a number"), limits
