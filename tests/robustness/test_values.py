"""Whatever value a user makes or calls with: it works, or it is refused in one message where it is made.

Verifies: trials and their parts, models, vehicles, cables, drums, currents, winches, pulls, tows, cables that are held,
simulators, sensors, autopilots, trims, manoeuvres (`values.py` draws the cases: good, at the edge, absurd), in a
process whose heap is checked and filled with rubbish. Tolerance: none; no crash, no exception but a `UserError`.

The long form is 10 000 cases, and each odd value in each place:  pytest -m slow tests/robustness/test_values.py -s
"""

from __future__ import annotations

import ctypes
import dataclasses
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import cable
import scenarios
import subzero
from subzero import autopilot
from subzero.external_force import MissingForce

CASES = Path(__file__).with_name("values.py")
SHORT, PIECES, LONG = 100, 5, 2000
HEAP = "libc_malloc_debug.so.0"
"""Where glibc keeps the checks of its heap since 2.34; before, they are in the library itself."""


def checking_heap():
    """Return the environment of a process whose heap is checked at each call, and filled with rubbish."""
    try:
        ctypes.CDLL(HEAP)
        preload = {"LD_PRELOAD": HEAP}
    except OSError:
        preload = {}
    return os.environ | preload | {"MALLOC_CHECK_": "3", "MALLOC_PERTURB_": "85"}


def tried(which, count, folder):
    """Try so many cases of a seed in a child process, or every odd value in every place; return what came out."""
    log = folder / "cases.txt"
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-X", "faulthandler", str(CASES), str(which), str(count), str(log)],
        env=checking_heap(), capture_output=True, text=True, check=False,
    )  # fmt: skip
    last = log.read_text(encoding="utf-8").splitlines()[-1:] if log.exists() else []
    assert done.returncode == 0, f"died of {last}: {done.stderr[-3000:]}"
    found = json.loads(done.stdout.splitlines()[-1])
    assert not found["wrong"], "\n".join(map(str, found["wrong"]))
    return found["counts"]


def drawn(seed, count, folder):
    """Try so many random cases, many of which run and many of which are refused; return how many did what."""
    counts = tried(seed, count, folder)
    assert sum(counts.values()) == count
    assert min(counts["ran"], counts["refused"]) > 0.05 * count
    return counts


@pytest.mark.long
def test_whatever_value_is_made_works_or_is_refused(tmp_path):
    drawn(0, SHORT, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("piece", range(1, 1 + PIECES))
def test_ten_thousand_values_work_or_are_refused(piece, tmp_path):
    print(f"\n{piece}: {drawn(piece, LONG, tmp_path)}")


@pytest.mark.slow
def test_each_odd_value_in_each_place_works_or_is_refused(tmp_path):
    counts = tried("every", 0, tmp_path)
    print(f"\n{counts}")
    assert counts["refused"] > 10_000


@pytest.fixture(scope="module")
def fig6():
    return subzero.load_scenario("fig6")


@pytest.mark.parametrize("duration", [0.45, 1.05, 0.02, 1.0])
@pytest.mark.parametrize("tethered", [True, False])
def test_a_run_ends_when_it_is_asked_to_though_that_is_no_whole_step(fig6, duration, tethered):
    run = subzero.simulate(dataclasses.replace(fig6, duration=duration), tethered=tethered)
    assert run.attrs["outcome"] == "completed"
    assert float(run["time"][-1]) == duration
    assert (np.diff(run["time"].values) > 0.0).all()


@pytest.mark.long
def test_a_prescribed_motion_and_the_printed_scheme_end_when_they_are_asked_to():
    for name in ("fig5", "spiral"):
        trial = dataclasses.replace(subzero.load_scenario(name), duration=0.95)
        assert float(subzero.simulate(trial)["time"][-1]) == 0.95
    printed = dataclasses.replace(subzero.load_scenario("fig6"), duration=0.95, scheme="paper")
    assert float(subzero.simulate(printed)["time"][-1]) == 0.95


TRIAL = {
    "segments of a negative length": ({"segment_length": -1.0}, "segment_length"),
    "steps of nothing": ({"cable_step": 0.0}, "cable_step"),
    "hull steps of nothing": ({"hull_step": 0.0}, "hull_step"),
    "no number": ({"duration": math.nan}, "duration"),
    "an endless run": ({"duration": math.inf}, "duration"),
    "400 digits": ({"duration": 10**400}, "duration"),
    "a text": ({"duration": "60"}, "duration"),
    "a truth value": ({"duration": True}, "duration"),
    "a scheme that there is not": ({"scheme": "leapfrog"}, "scheme"),
    "a scheme of numbers": ({"scheme": np.zeros(3)}, "scheme"),
    "a current of two numbers": ({"current": (0.1, 0.2)}, "current"),
    "no start": ({"start": None}, "start"),
    "a cable of nothing": ({"cable": None}, "cable"),
}


@pytest.mark.parametrize("what", TRIAL)
def test_a_trial_is_refused_when_it_is_made(what, fig6):
    changes, name = TRIAL[what]
    with pytest.raises(scenarios.ScenarioError, match=f"Trial, {name}"):
        dataclasses.replace(fig6, **changes)


START = {"heading": 27.0, "wet_length": -5.0, "depth": -3.0, "pitch": math.nan, "drum_north": 1e300}


@pytest.mark.parametrize("name", START)
def test_a_start_is_refused_when_it_is_made(name):
    with pytest.raises(scenarios.ScenarioError, match=f"Start, {name}: found"):
        scenarios.Start(**{name: START[name]})


def test_all_that_is_wrong_with_a_value_is_told_at_once():
    with pytest.raises(scenarios.ScenarioError) as caught:
        scenarios.Start(heading=27.0, wet_length=-5.0, depth=-3.0)
    assert len(caught.value.problems) == 3


def test_values_cannot_be_changed_behind_the_checks(fig6):
    times, values = np.array([0.0, 1.0]), np.zeros((2, 4))
    commands = scenarios.Commands(time=times, values=values)
    times[1] = -1.0
    assert commands.time[1] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        commands.values[0, 0] = 1.0


def ahead(_):
    return (1.0, 0.0, 0.0)


def test_numbers_of_numpy_in_a_missing_force_are_numbers(fig6):
    """JSON does not take them, and a run keeps its parameters as JSON."""
    row = (np.uint8(3), 0.1, 0.0, 0.0, 0.0, np.float32(0.0))
    force = MissingForce(time=np.array([0, 1]), wrench=(row, row))
    model = dataclasses.replace(subzero.Model.of(fig6), missing=force)
    run = subzero.simulate(dataclasses.replace(fig6, duration=0.2), tethered=False, model=model)
    assert json.loads(run.attrs["parameters"])["missing"]["wrench"][0] == [3.0, 0.1, 0.0, 0.0, 0.0, 0.0]


HEAVY = cable.CableProperties(mass_per_length=0.02)
CALLS = {
    "a run too short to be halved": lambda: cable.pull_out(ahead, 5e-324),
    "a speed beyond all speeds": lambda: autopilot.step("heading_step", speed=1e260),
    "a step of nothing": lambda: cable.pull_out(ahead, 1.0, scheme=cable.MovingEnd(time_step=0.0)),
    "segments of a negative length": lambda: cable.pull_out(ahead, 1.0, scheme=cable.MovingEnd(segment_length=-1.0)),
    "a velocity of texts": lambda: cable.pull_out(lambda t: ("1", "0", "0"), 1.0),
    "a scheme that there is not": lambda: cable.pull_out(ahead, 1.0, scheme="leapfrog"),
    "a tow of no length": lambda: cable.tow(ahead, 0.0, 1.0),
    "a held cable that is none": lambda: cable.hold(((0, 0, 0), (5, 0, 1)), 8.0, cable=0.02),
    "a length of nothing": lambda: cable.hold(((0, 0, 0), (5, 0, 1)), math.nan),
    "a winch of nan": lambda: cable.PayOutRate(rate=math.nan),
    "a winch that pushes": lambda: cable.ConstantTension(tension=-1.0),
    "a drum as large as the earth's orbit": lambda: cable.DrumProperties(radius=1e300, inertia=math.nan),
    "a current on no grid": lambda: cable.Current.sampled(lambda n, e, d, t: (0, 0, 0), down=0.1j),
    "a command of strings": lambda: subzero.Simulator("fig6").step("1234"),
    "a command of 400 digits": lambda: subzero.Simulator("fig6").step((10**400, 0, 0, 0)),
    "a sample time of text": lambda: subzero.Simulator("fig6", sample_time="0.1"),
    "tethered by half": lambda: subzero.Simulator("fig6", tethered=0.5),
    "a model that is none": lambda: subzero.simulate("fig6", model=3.0),
    "a change to no model": lambda: subzero.simulate("fig6", later=[(1.0, None)]),
    "a sensor that shakes by nan": lambda: autopilot.Sensor(channel="depth", noise=math.nan),
    "a sensor of texts": lambda: autopilot.Sensor(channel="depth", bias="1"),
    "a seed that is none": lambda: autopilot.Sensors(seed=0.5),
    "a trim at a list of speeds": lambda: autopilot.trim(subzero.Model.of(subzero.load_scenario("fig6")), speed=[1.0]),
    "a step of no name": lambda: autopilot.step(["heading_step"]),
}  # fmt: skip


@pytest.mark.parametrize("what", CALLS)
def test_what_cannot_be_is_refused_in_one_message(what):
    with pytest.raises(subzero.UserError) as caught:
        CALLS[what]()
    assert 20 < len(str(caught.value)) < 500
    assert "\n" not in str(caught.value)
