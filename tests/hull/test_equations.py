"""The compiled equations against a second, independent writing of them, and against themselves
interpreted.
"""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose

import vehicle

INTERPRETED = """
import json, sys
import numpy as np
import vehicle
mapping, state, command = json.load(sys.stdin)
hull = vehicle.from_mapping(mapping)
run = vehicle.free_run(hull, np.array(state), command, 0.2, current_n=(0.2, -0.1, 0.05))
assert not hasattr(vehicle.derivative, "py_func"), "still compiled"
print(json.dumps([run.states[-1].tolist(), run.work[-1].tolist()]))
"""


@pytest.mark.long
@settings(max_examples=150, deadline=None)
@given(
    nu=arrays(float, 6, elements=st.floats(0.05, 3.0)),
    signs=arrays(int, 6, elements=st.sampled_from([-1, 1])),
    fins=arrays(float, 3, elements=st.floats(-0.6, 0.6)),
    n=st.floats(5.0, 50.0),
    roll=st.floats(-3.0, 3.0),
    pitch=st.floats(-1.5, 1.5),
)
def test_two_writings_of_the_equations_agree(subzero2, rate, textbook, nu, signs, fins, n, roll, pitch):
    """J-form propeller, Fossen's Coriolis matrices, fins as vectors: nothing shared but the numbers."""
    nu = nu * signs
    nu[0] = abs(nu[0])
    state = vehicle.initial_state(roll=roll, pitch=pitch, heading=1.0, velocity=tuple(nu), propeller_speed=n)
    state[14:17] = state[18:21] = fins
    down = (-np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll))
    total, M = textbook(nu, down, n, fins)
    acceleration = np.linalg.solve(M, total)
    scale = np.abs(np.linalg.inv(M)) @ (1.0 + np.abs(total))
    assert_allclose(rate(subzero2, state)[7:13], acceleration, rtol=0, atol=1e-11 * scale.max())


def test_interpreted_and_compiled_runs_agree(subzero2, mapping):
    """NUMBA_DISABLE_JIT=1 runs the same source in plain Python; ten steps of a manoeuvre in a current."""
    state = vehicle.initial_state(roll=0.1, pitch=-0.2, heading=2.0, velocity=(1, 0.1, -0.1, 0.2, 0.1, -0.1))
    command = [24.0, 0.1, 0.05, -0.05]
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    given_to = json.dumps([mapping, state.tolist(), command])
    done = subprocess.run(
        [sys.executable, "-c", INTERPRETED], input=given_to, env=environment, text=True, capture_output=True
    )
    assert done.returncode == 0, done.stderr
    last, work = json.loads(done.stdout)
    run = vehicle.free_run(subzero2, state, command, 0.2, current_n=(0.2, -0.1, 0.05))
    # The same IEEE operations; only library functions (sin, sqrt) may round differently.
    assert_allclose(run.states[-1], last, rtol=1e-12, atol=1e-14)
    assert_allclose(run.work[-1], work, rtol=1e-12, atol=1e-14)


def test_two_runs_are_identical_to_the_last_bit(subzero2):
    runs = [vehicle.free_run(subzero2, vehicle.initial_state(), (24, 0.1, 0.05, 0.0), 5.0) for _ in range(2)]
    assert np.array_equal(runs[0].states, runs[1].states)
