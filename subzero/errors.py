"""Errors that a user can cause, each reported in one clean message (exit code 2 on the command line).

A message has three parts: *what* was found (file, line or name, value), *why* it cannot be, and *what to do*.
Only the command line catches `UserError`; anything else that is raised is a bug of ours and keeps its
traceback. Every refusal of every package is one: `scenarios.ScenarioError` for files and trials,
`vehicle.VehicleError`, and `BadValueError` for values that are refused where they are made.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from math import inf, isfinite
from numbers import Integral, Real
from pathlib import Path
from typing import TypeVar

Line = TypeVar("Line")

DISTRIBUTION = "subzero-auv"
"""Name in the package index, where "subzero" is another project."""

OUR_PACKAGES = {"cable": '"""The cable:', "vehicle": '"""The vehicle:', "scenarios": '"""Trials as data:'}
"""Packages that are imported by names that others may have, too → how their first file begins."""

SHOWN_PROBLEMS = 12
"""So many problems of one file are spelt out: enough to repair it, few enough to read on one screen."""

LONGEST_PROBLEM = 1000
"""A problem is cut after so many characters: a file may hold a key of any length."""


class UserError(Exception):
    """Something in the request or in a file of the user cannot be used; the message gives the remedy."""


class BadValueError(UserError, ValueError):
    """A value that cannot be used, refused where it is made; a `ValueError` too, as Python has it."""


def foreign_package() -> str:
    """Return a message if Python finds another package by the name of one of ours; empty if it does not."""
    for name, beginning in OUR_PACKAGES.items():
        spec = find_spec(name)
        origin = spec.origin if spec else None
        if origin is None or not Path(origin).read_text(encoding="utf-8", errors="replace").startswith(
            beginning
        ):
            where = printable(origin) if origin else "a folder without code" if spec else "nowhere"
            return (
                f"subzero needs its own package '{name}', and Python finds that name {'in ' if origin else ''}{where}. "
                f"Rename or move what is there, or install {DISTRIBUTION} in an environment of its own."
            )
    return ""


def real(value: object) -> float | None:
    """Return a value as a float if it is a finite real number (not a truth value, not a text); else None."""
    if type(value) is float:  # most are: to ask what else it could be takes longer
        return value if isfinite(value) else None
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    try:
        number = float(value)
    except (OverflowError, ValueError, TypeError):
        return None
    return number if isfinite(number) else None


def checked(
    owner: str,
    name: str,
    value: object,
    *,
    least: float = -inf,
    most: float = inf,
    above: float | None = None,
    unit: str = "",
) -> float:
    """Return a value as a float, or refuse it in one sentence.

    Args:
        owner: whose value, such as ``CableProperties``; empty for an argument of a function.
        name: its name.
        value: the value that was given.
        least: lower limit, allowed itself.
        most: upper limit, allowed itself.
        above: a lower limit that is not allowed itself.
        unit: for the message.

    Raises:
        BadValueError: not a finite real number within its limits.
    """
    number = real(value)
    low = least if above is None else above
    if number is not None and low <= number <= most and number != above:
        return number
    bounds = [f"{'at least' if above is None else 'more than'} {low:g}"] if low > -inf else []
    bounds += [f"at most {most:g}"] if most < inf else []
    allowed = (
        ", ".join(["a finite number", *([" and ".join(bounds)] if bounds else [])]) + f" {unit}".rstrip()
    )
    place = f"{owner}: {name}" if owner else name
    raise BadValueError(f"{place} is {short(value)}; it must be {allowed}.")


def truth(name: str, value: object) -> bool:
    """Return a truth value, Python's or numpy's; raise an error for anything else, since 0.5 would be ambiguous.

    Raises:
        BadValueError: neither True nor False.
    """
    if isinstance(value, bool) or type(value).__name__ in ("bool_", "bool"):  # numpy's, without importing it
        return bool(value)
    raise BadValueError(f"{name} is {short(value)}; it must be True or False.")


def whole(name: str, value: object, *, least: int = 0) -> int:
    """Return a whole number, such as a seed; raise an error for anything else.

    Raises:
        BadValueError: no whole number, or one below `least`.
    """
    if isinstance(value, Integral) and not isinstance(value, bool) and int(value) >= least:
        return int(value)
    raise BadValueError(f"{name} is {short(value)}; it must be a whole number of at least {least}.")


def chosen(table: Mapping[str, Line], name: object, what: str) -> Line:
    """Return a line of a table by its name; raise an error that lists the names if there is none.

    Raises:
        UserError: the table has no such line.
    """
    if isinstance(name, str) and name in table:
        return table[name]
    raise UserError(
        f"There is no {what} {short(name)}.{suggestion(name, table)} Allowed: {', '.join(table)}."
    )


def missing_extra(what: str, libraries: str, extra: str) -> UserError:
    """Return the error of a feature whose libraries are not installed: the feature, and how to install them."""
    return UserError(f"{what} needs {libraries}: pip install '{DISTRIBUTION}[{extra}]'.")


SHOWN_CHARACTERS = 60
"""Longer values are cut, so that a message remains readable for any value."""


def short(value: object) -> str:
    """Return a value as it is shown in a message: `repr`, on one line, cut when long."""
    try:
        text = repr(value)
    except Exception:  # a user's __repr__ may do anything
        is_number = isinstance(value, Integral)  # one of thousands of digits has no text
        return "a number far too long" if is_number else f"a value of type {type(value).__name__}"
    text = " ".join(text.split())
    return text if len(text) <= SHOWN_CHARACTERS else text[:SHOWN_CHARACTERS] + "..."


NEAR_LIKENESS = 0.5
"""A word that is less like another one was not meant for it, on `difflib`'s scale from 0 to 1."""


def nearest(word: str, allowed: Iterable[str], likeness: float = NEAR_LIKENESS) -> list[str]:
    """Return the allowed word most like `word` (case does not matter) in a list, an empty one if none is near."""
    by_lower = {candidate.lower(): candidate for candidate in allowed}
    close = difflib.get_close_matches(word.lower()[:80], by_lower, n=1, cutoff=likeness)
    return [by_lower[match] for match in close]


def suggestion(word: object, allowed: Iterable[str]) -> str:
    """Return `` Did you mean 'x'?`` with the nearest allowed word, or nothing if none is near, or if it is no word."""
    close = nearest(word, allowed) if isinstance(word, str) else []
    return f" Did you mean '{close[0]}'?" if close else ""


def listed(title: str, problems: list[str]) -> str:
    """Return one message that lists all problems of a file, each on its own line."""
    shown = problems[:SHOWN_PROBLEMS]
    rest = len(problems) - len(shown)
    lines = [title, *(f"  {printable(problem[:LONGEST_PROBLEM])}" for problem in shown)]
    return "\n".join([*lines, f"  ... and {rest} more."] if rest else lines)


def printable(text: str) -> str:
    """Return a text that any terminal, file and figure can take: unprintable characters become escapes.

    Control characters could move the cursor or recolour a terminal; bytes of a file name that are not UTF-8 cannot be
    written into a file.
    """
    if text.isprintable():
        return text
    return "".join(each if each.isprintable() else _escape(each) for each in text)


def _escape(name: str) -> str:
    r"""Return ``\x1b`` for a control character; the bytes of a file name that is not UTF-8 as they are, ``\xff``."""
    code = ord(name)
    if 0xDC80 <= code <= 0xDCFF:  # where Python keeps such bytes
        return f"\\x{code - 0xDC00:02x}"
    return name.encode("unicode_escape").decode("ascii")
