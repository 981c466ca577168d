"""Whatever record is diagnosed gets a verdict with all its files, or one message; never a traceback, never a hang.

Configuration: `odd_records`, through the command as a user calls it. Default: the first look at some; slow: a thousand
records, one in four with the whole search. `-k thousand -s` prints what came out.
"""

from __future__ import annotations

import json
import math
import signal
from collections import Counter
from contextlib import contextmanager

import pytest

from subzero.cli.app import FINE, MISTAKE, main
from tests.marks import LONG
from tests.robustness import odd_records

HANGS_S = 300.0
"""A diagnosis that takes longer hangs: CPU time of all its threads, ten times that of a whole search."""


@contextmanager
def patience(seconds):
    """Raise after so many seconds of CPU."""

    def stop(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def finite(value):
    """Say whether all numbers of a JSON value are finite."""
    if isinstance(value, dict):
        return all(finite(one) for one in value.values())
    if isinstance(value, list):
        return all(finite(one) for one in value)
    return not isinstance(value, float) or math.isfinite(value)


def reported(number, folder, capsys, *options):
    """Diagnose an odd record; return its verdict, or "refused"."""
    record, out = odd_records.written(number, folder), folder / f"found{number}"
    with patience(HANGS_S):
        code = main(["diagnose", str(record), "--out", str(out), "--quiet", *options])
    said = capsys.readouterr()
    if code == MISTAKE:
        assert said.err.count("\n") >= 1, number
        assert "Traceback" not in said.err, number
        assert not out.exists(), number
        return "refused"
    assert code == FINE, (number, said.err)
    found = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
    probabilities = found["probabilities"].values()
    assert all(0.0 <= p <= 1.0 for p in probabilities), (number, found["probabilities"])
    assert sum(probabilities) < 1.0 + 1e-6, number
    return found["verdict"]


@pytest.mark.parametrize(
    "number", [100, LONG(102), 103, pytest.param(104, marks=pytest.mark.slow), 106, LONG(131), LONG(154)]
)
def test_an_odd_record_gets_a_verdict_or_a_message(number, tmp_path, capsys):
    reported(number, tmp_path, capsys, "--screen")


@pytest.mark.slow
def test_a_thousand_odd_records_get_a_verdict_or_a_message(tmp_path, capsys):
    found = Counter(
        reported(number, tmp_path, capsys, *([] if number % 4 == 0 else ["--screen"]))
        for number in range(1000, 2000)
    )
    print(f"\nodd records: {dict(found)}")
