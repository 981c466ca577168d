"""A value in a few lines: what a prompt shows (`repr`) and a notebook (`_repr_html_`).

A class gives its title and rows of cells as an `Overview`, is marked as `shown`, and inherits nothing.

>>> print(Overview("A cable", [("length", "25.6 m"), ("tension", "0.72 N", "at 30 s")]).text())
A cable
  length   25.6 m
  tension  0.72 N  at 30 s
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from itertools import zip_longest
from typing import NamedTuple, Protocol, TypeVar

from subzero.errors import printable

MOST_LINES = 12
"""An overview has no more lines than this, its title among them."""
MOST_LETTERS = 100
"""A title or a cell is cut after so many letters."""


class Overview(NamedTuple):
    """A title, and rows of cells, the first of which says what the others are."""

    title: str
    rows: Sequence[tuple[str, ...]]

    def text(self) -> str:
        """Return it in columns, at most `MOST_LINES` lines."""
        rows = [[cut(cell) for cell in row] for row in self._shown()]
        widths = [max(map(len, column)) for column in zip_longest(*rows, fillvalue="")]
        lines = [
            "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=False)) for row in rows
        ]
        return "\n".join([cut(self.title), *(f"  {line.rstrip()}" for line in lines)])

    def html(self) -> str:
        """Return it as a table in which titles and cells are plain text."""
        rows = "".join(
            f"<tr><th style='text-align:left'>{escape(cut(name))}</th>"
            + "".join(f"<td style='text-align:left'>{escape(cut(cell))}</td>" for cell in cells)
            + "</tr>"
            for name, *cells in self._shown()
        )
        return f"<div><strong>{escape(cut(self.title))}</strong><table>{rows}</table></div>"

    def _shown(self) -> Sequence[tuple[str, ...]]:
        """Return the rows that fit, and how many more there are."""
        if len(self.rows) < MOST_LINES:
            return self.rows
        kept = self.rows[: MOST_LINES - 2]
        return [*kept, ("…", f"{len(self.rows) - len(kept)} more")]


class HasOverview(Protocol):
    """A value that has an overview."""

    def _overview(self) -> Overview: ...


Class = TypeVar("Class", bound=type[HasOverview])


def shown(kind: Class) -> Class:
    """Let a prompt and a notebook show the overview of a class."""

    def text(self: HasOverview) -> str:
        """Return what one reads first, in a few lines."""
        return self._overview().text()

    def html(self: HasOverview) -> str:
        """Return the same for a notebook."""
        return self._overview().html()

    for name, method in (("__repr__", text), ("_repr_html_", html)):
        setattr(kind, name, method)
    return kind


def cut(text: str) -> str:
    """Return a text on one line, without control characters of a terminal, at most `MOST_LETTERS` letters."""
    line = printable(" ".join(text.split()))
    return line if len(line) <= MOST_LETTERS else f"{line[: MOST_LETTERS - 1]}…"
