"""Units of a log are those of its names if its values agree, else they are asked for: none is imported wrongly unsaid.

Verifies: `subzero.logs.evidence`, through `subzero.read_log`. Configuration: the way of a vehicle by kinematics, with
noise, and one to five columns that were renamed and not converted, at random. Tolerance: nine digits.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
from subzero.errors import UserError

STEP = 0.1
MISTAKES = {
    "surge_speed_m_s": {"kn": 1.9438, "km/h": 3.6, "ft/s": 3.2808, "cm/s": 100.0},
    "heading_deg": {"rad": np.pi / 180.0, "centidegree": 100.0},
    "yaw_rate_deg_s": {"rad/s": np.pi / 180.0},
    "pitch_deg": {"rad": np.pi / 180.0, "centidegree": 100.0},
    "roll_deg": {"rad": np.pi / 180.0, "centidegree": 100.0},
    "depth_m": {"ft": 3.2808, "cm": 100.0, "m up": -1.0},
    "north_m": {"ft": 3.2808},
    "propeller_command_rps": {"rpm": 60.0},
}
"""Column → unit that it may be in by mistake → how many of those make one of the column's."""


def way(rng, rows=600):
    """Return the columns of a vehicle that turns, dives and changes its speed, with noise of usual sensors."""
    t = STEP * np.arange(rows)
    a, b, c = rng.uniform(0.05, 0.3, 3)
    speed = 1.5 * (1.0 - np.exp(-t / 4.0)) * (1.0 + 0.2 * np.sin(c * t))
    pitch, rate = rng.uniform(4.0, 20.0) * np.sin(a * t), rng.uniform(2.0, 8.0) * np.sin(b * t)
    heading = rng.uniform(0.0, 360.0) + np.cumsum(rate) * STEP
    down = np.radians(pitch - 2.0)  # an angle of attack
    north, east = (np.cumsum(speed * f(np.radians(heading)) * np.cos(down)) * STEP for f in (np.cos, np.sin))
    exact = {
        "time_s": t, "surge_speed_m_s": speed, "heading_deg": heading % 360.0, "yaw_rate_deg_s": rate,
        "pitch_deg": pitch, "roll_deg": 3.0 * np.sin(0.2 * t), "depth_m": 12.0 - np.cumsum(speed * np.sin(down)) * STEP,
        "north_m": north, "east_m": east, "propeller_command_rps": 15.0 + 10.0 * (t > 20.0),
    }  # fmt: skip
    noise = dict(zip(list(exact)[1:9], (0.02, 0.3, 0.2, 0.2, 0.2, 0.02, 0.3, 0.3), strict=True))
    return {name: values + noise.get(name, 0.0) * rng.standard_normal(rows) for name, values in exact.items()}


def write(path, columns):
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.10g")
    return path


def channel_of(column):
    return {channel.column: channel.name for channel in subzero.CHANNELS}[column]


@pytest.mark.long
def test_of_200_logs_with_wrong_units_none_is_imported_wrongly_without_a_word(tmp_path):
    asked = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        columns = way(rng)
        wrong = {}
        for name in rng.choice(list(MISTAKES), size=rng.integers(1, 6), replace=False):
            wrong[name] = rng.choice(list(MISTAKES[name]))
            for column in (name, *(("east_m",) if name == "north_m" else ())):
                columns[column] = columns[column] * MISTAKES[name][wrong[name]]
        try:
            record = subzero.read_log(write(tmp_path / "log.csv", columns))
        except UserError:
            asked += 1
            continue
        said = " ".join(record.notes)
        assert all(f"'{name}'" in said for name in wrong), (seed, wrong, record.notes)
    assert asked > 150


@pytest.mark.long
def test_of_50_logs_in_right_units_all_are_imported_as_they_are(tmp_path):
    for seed in range(50):
        columns = way(np.random.default_rng(seed))
        record = subzero.read_log(write(tmp_path / "log.csv", columns))
        for name in list(columns)[1:]:
            if name not in ("heading_deg", "propeller_command_rps"):
                assert_allclose(record.values[channel_of(name)], columns[name], rtol=1e-9, atol=1e-9)
        assert not [note for note in record.notes if "contradict" in note], seed
