"""The calibrated vehicle (or cable) as a file that every command takes: the file it was, with the numbers estimated.

Of each number `value`, `range` (the interval of 95 %), `tolerance` and `source` are new; all else is kept as it was
written, and a section [provenance] says which records made it, when, and with which version. A tolerance is what a
diagnosis allows a healthy vehicle to be off: the uncertainty of the estimate on top of what was allowed before,

    τ = √(τ₀² + sd²)

so that a number that records hardly determine is no cause, and one that they determine to 0.3 % may still change by as
much as any from one day to the next.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from scenarios.files import HEADER, KEY
from scenarios.parts import leaves
from subzero.calibration.results import Estimate, Source
from subzero.errors import UserError

DIGITS = 6
"""Significant ones of a number in the file."""
PROVENANCE = "provenance"
"""The section that says where a file comes from."""


def text_of(before: str, estimates: Mapping[str, Estimate], provenance: Mapping[str, Any]) -> str:
    """Return the text of a calibrated file.

    Args:
        before: the text of the file that it was.
        estimates: dotted key of the file → its estimate.
        provenance: key → text, or list of texts.

    Raises:
        UserError: a number stands in no line of its own in the file.
    """
    lines, section, left, inside = [], "", dict(estimates), False
    for line in before.rstrip().split("\n"):
        if header := HEADER.match(line):
            section = header[1]
        inside = section == PROVENANCE
        key = f"{section}.{found[1]}" if (found := KEY.match(line)) else ""
        if key in left:
            line = _number_line(line, left.pop(key))
        if not inside:
            lines.append(line)
    text = "\n".join([*lines, "", *_provenance_lines(provenance)]) + "\n"
    _check(text, estimates)
    return text


def _number_line(line: str, estimate: Estimate) -> str:
    """Return the line of a number with its estimate."""
    leaf = next(iter(tomllib.loads(line).values()))
    key = line.partition("=")[0].rstrip()
    said = leaf if isinstance(leaf, Mapping) else {"unit": estimate.unit}
    kept = {
        name: value for name, value in said.items() if name not in ("value", "range", "tolerance", "source")
    }
    was = f"calibrated from records, see [{PROVENANCE}]; was {estimate.before:g}"
    was += "" if estimate.is_determined else "; they hardly determine it"
    new = {
        "value": _rounded(estimate.value),
        **kept,
        "range": [_rounded(estimate.low), _rounded(estimate.high)],
        "tolerance": _rounded(estimate.tolerance),
        "source": f"{was} ({said.get('source', 'no source')})",
    }
    return f"{key} = {{ {', '.join(f'{name} = {_toml(value)}' for name, value in new.items())} }}"


def _provenance_lines(provenance: Mapping[str, Any]) -> Iterator[str]:
    yield f"[{PROVENANCE}]"
    for key, value in provenance.items():
        yield f"{key} = {_toml(value)}"


def _toml(value: Any) -> str:
    """Return a text, a number, or a list of them as TOML."""
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Sequence):
        return f"[{', '.join(map(_toml, value))}]"
    return repr(value)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _check(text: str, estimates: Mapping[str, Estimate]) -> None:
    """Raise an error for a text that does not hold the expected numbers: the file was not written one number a
    line.
    """
    held = dict(leaves(tomllib.loads(text)))
    wrong = [
        key
        for key, estimate in estimates.items()
        if held.get(key, {}).get("value") != _rounded(estimate.value)
    ]
    if wrong:
        raise UserError(
            f"The file of the vehicle has no line of its own for {', '.join(wrong)}, so the calibrated one "
            'cannot be written. Write each as key = { value = ..., unit = "..." } on a line.'
        )


def provenance(records: Sequence[Source], base: str, when: str, version: str, held: str) -> dict[str, Any]:
    """Return the provenance section of a calibrated file.

    Args:
        records: that it was made of.
        base: name of the file that it was.
        when: date and time, ISO 8601.
        version: of this package.
        held: the error in records that were not fitted, in words.
    """
    return {
        "made_by": f"subzero calibrate, version {version}",
        "when": when,
        "from_file": base,
        "records": [
            f"{record.file} (trial {record.trial}, {record.duration:g} s, sha256 {record.sha256})"
            for record in records
        ],
        "held_out": held,
    }


def section_of(name: str) -> tuple[str, str]:
    """Return which file a dotted name stands in, "vehicle" or "cable", and its key there."""
    part, _, key = name.partition(".")
    return ("vehicle", key) if part == "vehicle" else ("cable", re.sub(r"^\.", "", name))
