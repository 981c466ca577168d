"""The same code, compiled and interpreted (NUMBA_DISABLE_JIT=1), in a process of its own.

Verifies: `cable.pull_out` and a coupled run. Configuration: small: 2 s of a bent pull with a split, 0.8 s of fig6, as
it is: a run that checks itself is three of them.
Tolerance: 1e-11 of the largest value; compilers may contract and reorder nothing here (strict IEEE arithmetic), but sin
and cos come from other libraries.
"""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

SCRIPT = """
import dataclasses, json, sys
import numpy as np
import cable, subzero

history = cable.pull_out(
    lambda t: (np.cos(0.4 * t), np.sin(0.4 * t), 0.1), 2.0, drum=cable.DrumProperties(friction_torque=0.01),
    scheme=cable.MovingEnd(time_step=0.2),
)
trial = dataclasses.replace(
    subzero.load_scenario("fig6"), duration=0.8, cable_step=0.2, hull_step=0.1, segment_length=0.1,
    rtol=0.0,
)
run = subzero.simulate(trial)
names = ("surge_speed", "heading", "cable_tension", "cable_length", "cable_moment_yaw", "energy_cable_loss")
json.dump(
    {
        "tow_force": history.tow_force.tolist(),
        "shape": history.shape(2.0).tolist(),
        **{name: run[name].values.tolist() for name in names},
    },
    sys.stdout,
)
"""


def reported(**environment):
    """Return what a process of its own tells."""
    answer = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, **environment},
    )
    return {name: np.array(values) for name, values in json.loads(answer.stdout).items()}


@pytest.mark.long
def test_compiled_and_interpreted_code_give_the_same_numbers():
    compiled, interpreted = reported(NUMBA_DISABLE_JIT="0"), reported(NUMBA_DISABLE_JIT="1")
    assert len(compiled["shape"]) > 3  # nodes have come in
    for name, values in compiled.items():
        assert_allclose(interpreted[name], values, rtol=0, atol=1e-11 * np.abs(values).max(), err_msg=name)
