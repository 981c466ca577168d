"""What a diagnosis takes: a record with the configuration that it was measured in; `read_trials` makes it from files.

Apart from the configuration, which compiled code is made of, so that an edit of how records are read compiles nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.records.record import Record

NO_RECORD = "No measured record is given. Give the path of a CSV file, or of a folder of them."
"""What is wrong where a diagnosis or a calibration is given nothing."""


@dataclass(frozen=True, kw_only=True)
class Logged:
    """A record and the trial in which it was measured.

    Attributes:
        record: the channels that are diagnosed.
        setting: the trial with its commands, and the nominal model.
        noise: channel → standard deviation, where it is known. [display unit]
        name: short, for figures and tables.
        notes: what was left out, and why.
        trusted: channels that the user has said are right as they are.
        steps: channel → step between its values, where more of them show it than are left. [display unit]
    """

    record: Record
    setting: Setting
    noise: Mapping[str, float] = field(default_factory=dict)
    name: str
    notes: tuple[str, ...] = ()
    trusted: frozenset[str] = frozenset()
    steps: Mapping[str, float] = field(default_factory=dict)
