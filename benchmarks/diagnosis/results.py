"""Where results are kept: one JSON object a line."""

from __future__ import annotations

import json
from pathlib import Path

from .trial_of import Result


def read(path: Path) -> list[Result]:
    """Return the results that are there."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text().splitlines() if line.endswith("}")]
