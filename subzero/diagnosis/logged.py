"""What a diagnosis takes: a measured record with the trial that it belongs to. `records` reads it from files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from subzero.diagnosis.setting import Setting
from subzero.records.record import Record


@dataclass(frozen=True, kw_only=True)
class Logged:
    """A record and the trial in which it was measured.

    Attributes:
        record: the channels that are diagnosed.
        setting: the trial with its commands, and the nominal model.
        noise: channel → standard deviation, where it is known. [display unit]
        name: short, for figures and tables.
        notes: what was left out, and why.
    """

    record: Record
    setting: Setting
    noise: Mapping[str, float] = field(default_factory=dict)
    name: str
    notes: tuple[str, ...] = ()
