"""A tether that a host steps is the cable of `cable.pull_out`, of `cable.tow` and of the coupled run, to the last bit.

Verifies: `cable.Tether` against those three. Configuration: 34 m of heavy, elastic cable in a sheared current between
an end that swings and a drum on a boat, with every winch; 20 m with a free tail; 1 s of fig6 on 10 m of cable. The
host gives the places that the other run has, and takes its steps (rtol = 0). Tolerance: none, but for the adaptive
steps: there velocities enter, which `cable.pull_out` samples a billionth of a step before and after each time. Winches
start from rest: with one that turns already, a tether starts with cable that moves along itself, and `cable.pull_out`
does not.
"""

import dataclasses
import json
import os
import subprocess
import sys

import numpy as np
import pytest

import cable
from cable.tow_path import sample_path

HEAVY = cable.CableProperties(mass_per_length=0.02, compliance=1e-4)
CURRENT = cable.Current.profile([0.0, 20.0], [[0.0, 0.3, 0.0], [0.0, 0.1, 0.0]])
FIRST, SECOND = np.array([30.0, 0.0, 10.0]), np.zeros(3)
SECONDS = 4.0
WINCHES = {
    "brake": cable.Brake(),
    "rate": cable.PayOutRate(rate=lambda time: 0.2 * min(time, 1.0)),
    "changing rate": cable.PayOutRate(rate=lambda time: 0.2 * np.sin(time)),
    "tension": cable.ConstantTension(tension=2.0),
    "free drum": cable.DrumProperties(friction_torque=0.05),
}


def swing(time):
    return 0.3 * np.sin(time), 0.2 * np.cos(0.5 * time), 0.0


def boat(time):
    return 0.0, 0.1 * np.sin(2.0 * time), 0.3 * np.cos(time)


def both(winch, rtol):
    """Return a run, and times and states of the ends of a tether that does the same, with the tether."""
    first, second = sample_path(swing, SECONDS, 0.1), sample_path(boat, SECONDS, 0.1)
    mean = np.mean([first.leaving[0], second.leaving[0]], axis=0)
    passing = dataclasses.replace(CURRENT, velocity=CURRENT.velocity - mean)
    rest = cable.hold([FIRST, SECOND], 34.0, passing, cable=HEAVY, segment_length=0.5)
    drum, scheme = cable.MovingDrum(velocity=boat, drum=winch), cable.MovingEnd(rtol=rtol)
    run = cable.pull_out(swing, SECONDS, drum=drum, start=rest, current=CURRENT, scheme=scheme)
    ends = np.stack(
        [
            np.stack([FIRST + first.place, first.leaving], axis=1),
            np.stack([second.place, second.leaving], axis=1),
        ],
        axis=1,
    )
    tether = cable.Tether(
        HEAVY,
        length=34.0,
        ends=ends[0],
        winch=winch,
        current=CURRENT,
        segment_length=0.5,
        rtol=rtol,
        atol=0.0,
    )
    return run, first.times, ends, tether


@pytest.mark.parametrize("winch", WINCHES.values(), ids=WINCHES)
def test_a_tether_is_the_cable_of_pull_out(winch):
    run, times, ends, tether = both(winch, 0.0)
    assert run.outcome.completed
    for k in range(1, times.size):
        forces = tether.step(times[k] - times[k - 1], ends[k])
        assert np.array_equal(forces[0], run.tow_force[k])
        assert np.array_equal(tether.shape, run.shapes[k])
        assert np.array_equal(tether.tension, run.tensions[k])
        assert tether.length == run.length[k]
    assert tether.inner_steps == run.outcome.steps


def test_so_are_its_adaptive_steps():
    run, times, ends, tether = both(WINCHES["brake"], 1e-3)
    for k in range(1, times.size):
        forces = tether.step(times[k] - times[k - 1], ends[k])
    assert tether.inner_steps == run.outcome.steps > times.size
    np.testing.assert_allclose(forces[0], run.tow_force[-1], rtol=1e-6)


def test_a_tether_with_one_end_is_the_cable_of_tow():
    run = cable.tow(swing, 20.0, SECONDS, cable=HEAVY, current=CURRENT, drogue_drag_area=0.01)
    way = sample_path(swing, SECONDS, 0.1)
    tether = cable.Tether(
        HEAVY,
        length=20.0,
        ends=[(way.place[0], way.leaving[0])],
        current=CURRENT,
        segment_length=0.5,
        drogue_drag_area=0.01,
        rtol=0.0,
    )
    for k in range(1, way.times.size):
        (force,) = tether.step(way.times[k] - way.times[k - 1], [(way.place[k], way.leaving[k])])
        assert np.array_equal(force, run.tow_force[k])
    np.testing.assert_allclose(
        tether.shape - tether.shape[0], run.shapes[k] - run.shapes[k][0], rtol=0.0, atol=1e-13
    )


def test_attempts_that_are_accepted_are_a_step():
    """One attempt at the place to which a step would go gives the same numbers."""
    _, times, ends, tether = both(WINCHES["rate"], 0.0)
    _, _, _, other = both(WINCHES["rate"], 0.0)
    for k in range(1, 5):
        dt = times[k] - times[k - 1]
        forces = tether.attempt(dt, ends[k])
        tether.accept()
        assert np.array_equal(forces, other.step(dt, ends[k]))
        assert (tether.time, tether.length) == (other.time, other.length)


SCRIPT = """
import json, sys
import numpy as np
import cable, subzero
from subzero.engine import coupling

calls, tried, accepted = [], coupling.try_step, coupling.accept

def noted_try(line, step, tow, *others):
    converged = tried(line, step, tow, *others)
    calls.append((step, tow.copy(), line.ends.tow.force.copy()))
    return converged

def noted_accept(*arguments):
    accepted(*arguments)
    calls.append(None)

trial = subzero.load_scenario("fig6").with_changes({"start.wet_length_m": 10.0, "run.segment_length_m": 1.0})
simulator = subzero.Simulator(trial)
line = simulator._held.live.line
start = line.position[1, 0].copy()
coupling.try_step, coupling.accept = noted_try, noted_accept
for _ in range(10):
    simulator.step((25.0, 0.1, 0.0, 0.0))
model, at_drum = simulator.model, (0.0, 0.0, 0.0)
tether = cable.Tether(model.cable, ends=[start, at_drum], winch=model.drum, segment_length=1.0, rtol=0.0)
same, several = [], 0
for call, following in zip(calls, calls[1:]):
    if call is None:
        tether.accept()
        continue
    step, tow, force = call
    same.append(bool(np.array_equal(tether.attempt(step, [tow, at_drum])[0], force)))
    several += following is not None
tether.accept()
count = line.ends.count + 1
same.append(bool(np.array_equal(tether._line.position[1, :count], line.position[1, :count])))
json.dump({"same": all(same), "tries": len(same), "iterated": several, "exchanges": calls.count(None)}, sys.stdout)
"""


@pytest.mark.long
def test_a_tether_is_the_cable_of_the_coupled_run():
    """The places that the coupled run tries while hull and cable agree are noted, and tried again on a tether.

    The loop is interpreted (NUMBA_DISABLE_JIT=1), so that a call in it can be noted: `test_jit` holds the two together.
    """
    answer = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
    )
    found = json.loads(answer.stdout)
    assert found["same"]
    assert found["exchanges"] >= 10
    assert found["iterated"] >= 10
