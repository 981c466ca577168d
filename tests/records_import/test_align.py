"""Two logs of one trial become one record; their clocks differ by what is found, or it is said that nothing says.

Verifies: `subzero.logs.align`.
Configuration: depth and heading of a vehicle that wanders (sines without a common period),
logged at two rates with clocks that differ. Tolerance: of the offset, four of its standard deviations.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from subzero.errors import UserError
from subzero.logs.align import merged, offset
from subzero.records.record import Record


def motion(t):
    depth = 5.0 + np.sin(0.11 * t) + 0.7 * np.sin(0.257 * t + 1.0) + 0.4 * np.sin(0.591 * t)
    return {"depth": depth, "heading": 40.0 + 90.0 * np.sin(0.07 * t) + 20.0 * np.sin(0.31 * t)}


def log(name, step, start, *, channels, noise=0.0, seed=0, duration=120.0):
    """Return a log whose clock is 0 at `start` of the trial."""
    rng, time = np.random.default_rng(seed), np.arange(0.0, duration, step)
    values = {
        name: v + noise * rng.standard_normal(v.size)
        for name, v in motion(time + start).items()
        if name in channels
    }
    return Record(source=name, time=time, values=values)


@pytest.mark.parametrize("late", [-7.3, 0.0, 0.04, 11.57])
def test_the_offset_of_two_clocks_is_found_within_what_is_said_of_it(late):
    first = log("a", 0.1, 0.0, channels=["depth", "heading"], noise=0.05, seed=1)
    second = log("b", 0.25, late, channels=["depth"], noise=0.05, seed=2)
    found, error, shared = offset(first, second)
    assert shared == ["depth"]
    assert abs(found - late) < 4.0 * error
    assert error < 0.1


def test_their_record_is_on_the_clock_of_the_first():
    first = log("a", 0.1, 0.0, channels=["depth"])
    second = log("b", 0.25, 3.0, channels=["depth", "heading"])
    record = merged([first, second])
    assert_allclose(record.values["depth"][np.isfinite(record.values["depth"])], first.values["depth"])
    known = np.isfinite(record.values["heading"])
    assert_allclose(record.values["heading"][known], motion(record.time[known])["heading"], atol=0.5)
    assert record.notes[0].startswith("b: its clock is +3 ± ")


BOTH = ["depth", "heading"]


def ramp(name):
    time = np.arange(0.0, 60.0, 0.1)
    return Record(source=name, time=time, values={"depth": 0.1 * time})


@pytest.mark.parametrize(
    "first, second, why",
    [
        (ramp("a"), ramp("b"), "depth match equally well or badly"),
        (log("a", 0.1, 0.0, channels=["depth"]), log("b", 0.1, 0.0, channels=["heading"]), "share no channel"),
        (log("a", 0.1, 0.0, channels=BOTH), log("b", 0.1, 700.0, channels=BOTH), "match equally well or badly"),
    ],
)  # fmt: skip
def test_logs_that_do_not_say_how_their_clocks_differ_are_refused(first, second, why):
    with pytest.raises(UserError, match=why):
        merged([first, second])


def test_zigzags_match_at_every_period_and_are_refused():
    time = np.arange(0.0, 60.0, 0.1)
    records = [
        Record(source=name, time=time, values={"heading": 20.0 * np.sin(time + k)})
        for k, name in enumerate("ab")
    ]
    with pytest.raises(UserError, match="match equally well or badly"):
        merged(records)
