"""Where results are kept: one JSON object a line, beside the code, so that every figure of the page can be checked."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

Result = dict[str, Any]
DIGITS = 6
"""Significant ones that are kept."""


class Numbered(Protocol):
    """What has a number."""

    @property
    def index(self) -> int:
        """Its number."""


def line(one: Result) -> str:
    """Return a result as a line of the file."""
    return json.dumps(_short(one)) + "\n"


def read(path: Path) -> list[Result]:
    """Return the results that are there."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text().splitlines() if line.endswith("}")]


def results_of(
    wanted: Sequence[Numbered],
    result_of: Callable[[Any], Result],
    *,
    tell: Callable[[Result], str],
    workers: int,
    path: Path | None = None,
    resume: bool = True,
) -> list[Result]:
    """Return a result of each, those that are kept first; the others are made now, told and kept as they come.

    Args:
        wanted: what is drawn; each has a number, its `index`.
        result_of: makes the result, which has that `index` too; it can be pickled.
        tell: result → its line on the terminal.
        workers: processes.
        path: where they are kept; nowhere if None.
        resume: go on behind what is kept there; else begin anew.
    """
    if path and not resume:
        path.unlink(missing_ok=True)
    known = read(path) if path else []
    done = {one["index"] for one in known}
    left = [one for one in wanted if one.index not in done]
    with multiprocessing.get_context("fork").Pool(workers) as pool:
        for one in pool.imap_unordered(result_of, left):
            known.append(one)
            print(tell(one), flush=True)
            if path:
                with path.open("a") as file:
                    file.write(line(one))
    return known


def _short(value: Any) -> Any:
    """Return plain values with DIGITS digits."""
    if isinstance(value, dict):
        return {key: _short(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_short(one) for one in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value
