"""Problems with a file, described so that it can be repaired: all problems at once, each with its place.

A problem has three parts: *what* was found and where, *why* it cannot be, and *what to do*.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from subzero import errors
from subzero.errors import UserError, printable

SHOWN_PROBLEMS = 10
"""So many problems are spelt out in a message: enough to go on with; more would only repeat themselves."""


@dataclass(frozen=True, kw_only=True)
class Problem:
    """One thing in one file that cannot be used.

    Attributes:
        file: the file as the user named it, or the name of a scenario.
        line: line in the file, from 1; None where the whole file is meant.
        key: key or column, such as ``run.hull_step_s``; empty where none is meant.
        found: the value found, as text; empty where something is missing.
        why: the reason.
        remedy: the allowed values, or the nearest valid name.
    """

    file: str
    line: int | None = None
    key: str = ""
    found: str = ""
    why: str
    remedy: str = ""

    def __str__(self) -> str:
        """Return ``file, line 3, key: found x, but ... Allowed: ...``."""
        line = f"line {self.line}" if self.line else ""
        place = ", ".join(part for part in (self.file, line, self.key) if part)
        said = f"found {self.found}, but {self.why}" if self.found else self.why
        return printable(f"{place}: {said}. {self.remedy}".rstrip())


class ScenarioError(UserError, ValueError):
    """A scenario, a file it needs, or a value of a trial cannot be used; carries every problem, and its text says them.

    Attributes:
        problems: all that is wrong, in the order of the files.
    """

    def __init__(self, problems: Iterable[Problem]) -> None:
        """Keep the problems; there must be at least one."""
        self.problems = tuple(problems)
        super().__init__(self.problems)

    def __str__(self) -> str:
        """Return a headline and the problems, one a line."""
        count = len(self.problems)
        rest = count - SHOWN_PROBLEMS
        headline = f"The scenario cannot be used ({count} problem{'s' if count > 1 else ''}):"
        lines = [headline, *(f"  {problem}" for problem in self.problems[:SHOWN_PROBLEMS])]
        return "\n".join([*lines, f"  ... and {rest} more."] if rest > 0 else lines)


def nearest(word: str, allowed: Iterable[str]) -> str | None:
    """Return the allowed word most like `word`, whatever its case; None if none is near."""
    return next(iter(errors.nearest(word, allowed, likeness=0.6)), None)


def nearest_and_all(word: str, allowed: Iterable[str]) -> str:
    """Return the nearest allowed word, if one is near, and all of them."""
    words = list(allowed)
    close = nearest(word, words)
    return (f"Did you mean '{close}'? " if close else "") + f"Allowed: {', '.join(words)}."


def nearest_or_all(word: str, allowed: Iterable[str]) -> str:
    """Return ``Did you mean 'x'?`` with the nearest allowed word; all allowed words if none is near."""
    words = list(allowed)
    close = nearest(word, words)
    return f"Did you mean '{close}'?" if close else f"Allowed: {', '.join(words)}."
