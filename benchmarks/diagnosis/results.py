"""Where results are kept: one JSON object a line, beside the code, so that every figure of the page can be checked."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from .trial_of import Result

DIGITS = 6
"""Significant ones that are kept."""


def place(seed: int, which: str = "") -> Path:
    """Return where the results of a seed are kept, or some of them that the page does not rest on."""
    return Path(__file__).parent / "kept" / f"{which}seed_{seed}.jsonl"


def line(one: Result) -> str:
    """Return a result as a line of the file."""
    return json.dumps(_short(one)) + "\n"


def read(path: Path) -> list[Result]:
    """Return the results that are there."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text().splitlines() if line.endswith("}")]


def _short(value: Any) -> Any:
    """Return plain values with DIGITS digits."""
    if isinstance(value, dict):
        return {key: _short(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_short(one) for one in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value
