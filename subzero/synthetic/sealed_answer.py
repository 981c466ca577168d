"""The hidden effects of a challenge, in words, and sealed, so that they are not read by accident."""

from __future__ import annotations

import base64
import hashlib
import json
import math
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from subzero.arguments import checked_arguments
from subzero.diagnosis.hypothesis.effect import plain_id
from subzero.diagnosis.report import words
from subzero.errors import UserError, printable
from subzero.external_force import FEATURES
from subzero.files.read_file import MOST_OF_AN_ANSWER, UnreadableFileError, read_bytes

SEALED = "answer.sealed"


@dataclass(frozen=True, kw_only=True)
class Answer:
    """The hidden effects.

    Attributes:
        kind: one of `challenge.ODDS`.
        names: as `Hidden.names`; empty for nothing.
        sentences: the same in words.
        deviations: effect id → parameter → deviation.
        starts: effect id → when it begins. [s]
        axis, feature: of a force that is not in the catalogue.
        tolerances: effect id → deviations that were drawn within the tolerances.
        scenario, seed: the arguments of the challenge.
    """

    kind: str
    names: tuple[str, ...] = ()
    sentences: tuple[str, ...] = ()
    deviations: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    starts: Mapping[str, float] = field(default_factory=dict)
    axis: str = ""
    feature: str = ""
    tolerances: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    scenario: str = ""
    seed: int = 0

    def __str__(self) -> str:
        """Return the answer in words."""
        if not self.names:
            return "Nothing is wrong: every number is within its tolerance."
        lines = [f"{name}: {words}" for name, words in zip(self.names, self.sentences, strict=True)]
        for key, values in self.deviations.items():
            at = f", from {self.starts[key]:g} s on" if key in self.starts else ""
            sizes = ", ".join(_size(key, name, value) for name, value in values.items())
            lines.append(f"  against the model: {sizes}{at}")
        if self.axis in words.PUSHES:
            goes = f", with {FEATURES[self.feature].words}" if self.feature in FEATURES else ""
            lines.append(f"  {words.something(self.axis)}{goes}; it is in no catalogue")
        return "\n".join(map(printable, lines))


def _size(cause: str, parameter: str, deviation: float) -> str:
    """Return how far a number of a cause is from the model's, with its unit."""
    effect = words.effects().get(plain_id(cause))
    units = {each.name: each.unit for each in effect.parameters} if effect is not None else {}
    unit = units.get(parameter, "")
    sign = "+" if deviation >= 0.0 and unit != "1" else ""
    return f"{parameter.replace('_', ' ')} {sign}{words.number(deviation, unit)}"


def seal(answer: Answer) -> str:
    """Return an encoded answer that cannot be read by accident, with its hash."""
    text = json.dumps(asdict(answer)).encode()
    packed = base64.b64encode(zlib.compress(text)).decode()
    return json.dumps({"sha256": hashlib.sha256(text).hexdigest(), "sealed": packed}, indent=1) + "\n"


@checked_arguments
def reveal(folder: str | Path) -> Answer:
    """Return the hidden effects in the record of a folder.

    Raises:
        UserError: there is no sealed answer, or it has been changed.
    """
    path = Path(folder) / SEALED
    shown = printable(str(path))
    try:
        data = read_bytes(path, MOST_OF_AN_ANSWER)
    except UnreadableFileError as error:
        if not error.is_missing:
            raise
        raise UserError(
            f"There is no sealed answer '{shown}'. Allowed: a folder made by subzero challenge --out FOLDER."
        ) from None
    try:
        return _unsealed(data)
    except (ValueError, LookupError, TypeError, AttributeError, OverflowError, RecursionError, zlib.error):
        raise UserError(
            f"The sealed answer '{shown}' has been changed. Make the challenge again from its seed."
        ) from None


def _unsealed(data: bytes) -> Answer:
    """Return the answer in a sealed file; any error says that it is not as it was sealed."""
    sealed: dict[str, Any] = json.loads(data)
    unpacking = zlib.decompressobj()
    text = unpacking.decompress(base64.b64decode(sealed["sealed"]), MOST_OF_AN_ANSWER)
    if unpacking.unconsumed_tail or hashlib.sha256(text).hexdigest() != sealed["sha256"]:
        raise ValueError("not what was sealed")
    said: dict[str, Any] = json.loads(text, parse_constant=_refused, parse_float=_finite, parse_int=_whole)
    said |= {key: tuple(map(str, said[key])) for key in ("names", "sentences")}
    answer = Answer(**said)
    str(answer)  # raises an error for an answer that cannot be put into words
    return answer


def _finite(text: str) -> float:
    """Return a number; JSON may hold some that no float can."""
    value = float(text)
    return value if math.isfinite(value) else _refused(text)


def _whole(text: str) -> int:
    """Return a whole number; Python reads some that no float can be."""
    return int(text) if math.isfinite(float(text)) else int(_refused(text))


def _refused(text: str) -> float:
    raise ValueError(f"{text} is no number")
