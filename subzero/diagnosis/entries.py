"""What the numbers of z are: parameters of effects that all records share, and the start of each record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from subzero.diagnosis.effect import Effect, Parameter


class Entry(NamedTuple):
    """A number of z: a parameter of an effect; of one record only, for a start (else −1)."""

    effect: Effect
    place: int
    record: int

    @property
    def parameter(self) -> Parameter:
        """The parameter."""
        return self.effect.parameters[self.place]

    @property
    def name(self) -> str:
        """The parameter's name, unique."""
        where = f"@{self.record}" if self.record >= 0 else ""
        return f"{self.effect.id}.{self.parameter.name}{where}"


def entries_of(effects: Sequence[Effect], start: Sequence[Effect], records: int) -> tuple[Entry, ...]:
    """Return the entries of z: effects that all records share, and the start of each record."""
    shared = [Entry(effect, i, -1) for effect in effects for i in range(len(effect.parameters))]
    own = [
        Entry(effect, i, record)
        for record in range(records)
        for effect in start
        for i in range(len(effect.parameters))
    ]
    return (*shared, *own)


def grouped(entries: tuple[Entry, ...]) -> list[tuple[Effect, list[int], int]]:
    """Return (effect, its places in z, its record), in order."""
    found: dict[tuple[str, int], tuple[Effect, list[int], int]] = {}
    for k, entry in enumerate(entries):
        found.setdefault((entry.effect.id, entry.record), (entry.effect, [], entry.record))[1].append(k)
    return list(found.values())
