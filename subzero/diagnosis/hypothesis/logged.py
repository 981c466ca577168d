"""The input of a diagnosis: a record with the configuration that it was measured in; `read_trials` makes it from
files.

In a file apart from the configuration, which compiled code depends on, so that an edit of the reading of records
compiles nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.records.record import Record

NO_RECORD = "No measured record is given. Give the path of a CSV file, or of a folder of them."
"""Message of a diagnosis or a calibration without a record."""


@dataclass(frozen=True, kw_only=True)
class Logged:
    """A record and the trial in which it was measured.

    Attributes:
        record: the channels that are diagnosed.
        setting: the trial with its commands, and the nominal model.
        noise: channel → standard deviation, where it is known. [display unit]
        name: short, for figures and tables.
        notes: channels that were left out, and why.
        trusted: channels that the user has declared to be free of errors.
        steps: channel → step between its values, where it was read off more samples than are left. [display unit]
    """

    record: Record
    setting: Setting
    noise: Mapping[str, float] = field(default_factory=dict)
    name: str
    notes: tuple[str, ...] = ()
    trusted: frozenset[str] = frozenset()
    steps: Mapping[str, float] = field(default_factory=dict)
