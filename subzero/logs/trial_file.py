"""A trial that begins where a record begins and lasts as long: what ``subzero import --trial`` writes.

It is a copy of a shipped trial, every key explained, with the duration, the start and the commands of the record. What
the record does not say keeps the value of a vehicle at rest; a record without commands gives commands of zero.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

import scenarios
from scenarios.heading import TURN
from subzero.channels import BY_NAME, HEADING
from subzero.records.record import Record

LIKE = "fig6"
"""The trial that is copied."""
START = {
    "heading_deg": "heading",
    "pitch_deg": "pitch",
    "roll_deg": "roll_angle",
    "depth_m": "depth",
    "surge_speed_m_s": "surge_speed",
    "sway_speed_m_s": "sway_speed",
    "heave_speed_m_s": "heave_speed",
    "roll_rate_deg_s": "roll_rate",
    "pitch_rate_deg_s": "pitch_rate",
    "yaw_rate_deg_s": "yaw_rate",
    "propeller_speed_rps": "propeller_speed",
    "rudder_angle_deg": "rudder_angle",
}
"""Key of ``[start]`` → channel whose first value it takes."""
COMMANDS = (
    "propeller_command",
    "rudder_command",
    "stern_plane_port_command",
    "stern_plane_starboard_command",
)
DIGITS = 6


def trial_of(record: Record, file: str) -> str:
    """Return the text of a trial for a record.

    Args:
        record: with times from 0 on.
        file: of the record, from the folder of the trial; it is the file of the commands if it has them.
    """
    text = Path(scenarios.path(LIKE)).read_text(encoding="utf-8")
    text = text[text.index("description = ") :]
    step = scenarios.load(LIKE).cable_step
    duration = step * np.floor(float(record.time[-1]) / step + 1e-6)
    text = _with_value(text, "description", f'"As {file} begins: the start and the commands of a record"')
    text = _with_value(text, "duration_s", repr(round(float(duration), DIGITS)))
    for key, channel in START.items():
        measured = record.values.get(channel, np.zeros(0))
        first = measured[np.isfinite(measured)][:1]
        value = float(first[0]) if first.size else 0.0
        value = math.fmod(value, TURN) if channel == HEADING else value  # a compass may count its turns
        text = _with_value(text, key, repr(round(value, DIGITS)))
    if all(name in record.values for name in COMMANDS):
        commands = f'[commands]\nfile = "{file}"\n'
    else:
        keys = [BY_NAME[name].column.replace("_command", "") for name in COMMANDS]
        commands = "[commands]                      # the record has none\ntime_s = [0.0]\n"
        commands += "".join(f"{key} = [0.0]\n" for key in keys)
    return re.sub(r"\[commands\].*?(?=\n\[changes\])", lambda _: commands, text, count=1, flags=re.DOTALL)


def _with_value(text: str, key: str, value: str) -> str:
    """Return the text of a trial with another value of a key; the comment behind it remains."""
    return re.sub(rf"(?m)^({key} = )(?:\"[^\"]*\"|\S+)", lambda found: found[1] + value, text, count=1)
