"""Two runs of the same thing are identical to the last bit: in one process, after other runs, in another process."""

import hashlib
import subprocess
import sys

import numpy as np
import pytest

import cable
import subzero


def motion(t):
    return np.cos(0.3 * t), np.sin(0.3 * t), 0.1


def fingerprint(run):
    """Return a digest of every number of a dataset, in the order of its variables' names."""
    digest = hashlib.sha256()
    for name in sorted(run.variables):
        digest.update(name.encode() + np.ascontiguousarray(run[name].values).tobytes())
    return digest.hexdigest()


def test_a_cable_run_repeats_to_the_last_bit():
    first = cable.pull_out(motion, 10.0)
    cable.pull_out(
        lambda _: (0.3, 0.0, 0.4), 5.0, scheme=cable.MovingEnd(time_step=0.07, segment_length=0.2)
    )  # must leave nothing behind
    again = cable.pull_out(motion, 10.0)
    for name in ("time", "tow_force", "tow_tension", "drum_tension", "length"):
        assert getattr(first, name).tobytes() == getattr(again, name).tobytes()
    assert first.shape(10.0).tobytes() == again.shape(10.0).tobytes()


@pytest.mark.parametrize("scenario", ["fig6", "spiral", "stop_and_drift"])
def test_a_coupled_run_repeats_to_the_last_bit(scenario):
    first = subzero.simulate(scenario)
    subzero.simulate("fig5")
    again = subzero.simulate(scenario)
    assert fingerprint(first) == fingerprint(again)
    assert first.attrs == again.attrs


def test_both_halves_of_a_comparison_repeat_and_are_the_single_runs():
    first, again = subzero.compare("fig6"), subzero.compare("fig6")
    assert fingerprint(first.tethered) == fingerprint(again.tethered)
    assert fingerprint(first.untethered) == fingerprint(again.untethered)
    assert fingerprint(first.tethered) == fingerprint(subzero.simulate("fig6"))
    assert fingerprint(first.untethered) == fingerprint(subzero.simulate("fig6", tethered=False))


@pytest.mark.long
def test_another_process_gives_the_same_bits():
    script = (
        "import subzero, hashlib; run = subzero.simulate('fig6'); "
        "print(hashlib.sha256(run['cable_tension'].values.tobytes() + run['heading'].values.tobytes()).hexdigest())"
    )
    reported = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    ).stdout.strip()
    here = subzero.simulate("fig6")
    mine = hashlib.sha256(here["cable_tension"].values.tobytes() + here["heading"].values.tobytes())
    assert reported == mine.hexdigest()


def test_progress_is_told_and_changes_nothing():
    reported = []
    watched = subzero.simulate("fig6", progress=reported.append)
    assert fingerprint(watched) == fingerprint(subzero.simulate("fig6"))
    assert reported == sorted(reported)
    assert reported[-1] == 1.0
