"""docs/hull.md is enough to write the hull anew: its Python, run as it stands there, gives the compiled equations.

The page imports numpy only. It is held to `vehicle.breakdown_table` and `vehicle.derivative` at random states of the
vehicles that are shipped, with every actuator stage switched on and off, in a current and under a pull. Both are
sums of a few dozen products in double precision: they agree to 1e-9 of the largest force.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import vehicle
from scenarios.parts import nested

ROOT = Path(__file__).parents[2]
AGREE = 1e-9


@cache
def page():
    """Return what the Python of the page defines."""
    text = (ROOT / "docs" / "hull.md").read_text(encoding="utf-8")
    found: dict = {}
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        exec(compile(block, "docs/hull.md", "exec"), found)
    return found


def numbers_of(name):
    """Return the numbers of a shipped vehicle, as its file has them."""
    from scenarios.contents import contents

    return nested({one.name.removeprefix("vehicle."): one.values[0] for one in contents(name).numbers})


CHANGED = {
    "as shipped": {},
    "a bad day": {
        "added_mass": {"munk_factor": 0.8, "sway_yaw": -0.3, "heave_pitch": 0.2},
        "rigid_body": {"centre_of_gravity_y": 0.002},
        "buoyancy": {"net_buoyancy": 0.3},
        "linear_damping": {"surge": -0.3, "roll": -0.01},
        "quadratic_damping": {"sway_per_sway": -4.0, "yaw_per_sway": 0.3, "pitch_per_pitch": -1.0},
        "rudder_servo": {"dead_band": 0.01, "offset": 0.02, "half_backlash": 0.01, "position_feedback": 0.4,
                         "lost_command": 0.2, "rate_limit": 0.5, "deflection_limit": 0.3},
        "stern_plane_port_servo": {"lag": 0.0, "rate_limit": np.inf, "half_backlash": 0.02, "position_feedback": 0.5},
        "motor": {"lag": 0.0, "voltage_sensitivity": 0.7, "speed_per_volt": 1.1},
        "battery": {"internal_resistance": 0.3, "voltage_drop_per_charge": 1e-3, "speed_loss_per_charge": 1e-4},
    },
}  # fmt: skip


def inputs(seed):
    """Return a random state, command, current and pull: all speeds up to 1.5 m/s, any attitude."""
    rng = np.random.default_rng(seed)
    attitude = rng.normal(size=4)
    state = np.concatenate([
        rng.uniform(-5, 5, 3), attitude / np.linalg.norm(attitude), rng.uniform(-1.5, 1.5, 3), rng.uniform(-1, 1, 3),
        rng.uniform(-20, 30, 1), rng.uniform(-0.4, 0.4, 3), rng.uniform(0, 500, 1), rng.uniform(-0.4, 0.4, 3),
    ])  # fmt: skip
    command = np.array([rng.uniform(-20, 30), *rng.uniform(-0.5, 0.5, 3)])
    return state, command, rng.uniform(-0.5, 0.5, 3), rng.uniform(-2, 2, 6)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("changes", CHANGED)
@pytest.mark.parametrize(
    "name", ["subzero2", "remus100", "bluerov2_heavy", "xfin_auv", "seawing", "nps_auv2"]
)
def test_the_page_is_the_hull(name, changes, seed):
    numbers = numbers_of(name)
    in_tables = name in (
        "bluerov2_heavy",
        "seawing",
        "nps_auv2",
    )  # their added mass is in a table, their fins are none
    own = {} if in_tables else CHANGED[changes]
    for section, values in own.items():
        numbers[section] |= values
    hull = vehicle.from_mapping(numbers)
    state, command, current, wrench = inputs(seed)
    rng, most = np.random.default_rng(seed), [channel.high for channel in hull.channels]
    state, command = (
        np.append(values, rng.uniform(-1.1, 1.1, len(most)) * most) for values in (state, command)
    )
    terms, rates = page()["forces"](vehicle.to_mapping(hull), state, command, current, wrench)
    compiled = vehicle.breakdown_table(hull, state, command, current_n=current, wrench_b=wrench)
    assert list(terms) == list(compiled) == [term.name for term in vehicle.TERMS]
    largest = max(np.abs(force).max() for force in compiled.values())
    for term, force in compiled.items():
        np.testing.assert_allclose(terms[term], force, rtol=AGREE, atol=AGREE * largest, err_msg=term)
    out = np.empty(hull.state_size)
    vehicle.derivative(state, command, current, wrench, hull.numbers(), out)
    np.testing.assert_allclose(rates, out, rtol=1e-8, atol=1e-8 * np.abs(out[7:13]).max())


def test_the_page_uses_every_number_of_a_vehicle_but_the_tow_point():
    """A parameter that the page does not name would be missing in what is written from it."""
    text = (ROOT / "docs" / "hull.md").read_text(encoding="utf-8")
    generated = {
        f"{what}_{part}" for what in ("thrust", "torque") for part in ("constant", "slope", "curvature")
    }
    generated |= {f"centre_of_{what}_{axis}" for what in ("gravity", "buoyancy") for axis in "xyz"}
    for section, values in numbers_of("subzero2").items():
        for key in values if section != "tow_point" else ():
            assert key in generated or f'"{key}"' in text, f"{section}.{key}"


def test_the_page_imports_numpy_and_nothing_of_ours():
    text = (ROOT / "docs" / "hull.md").read_text(encoding="utf-8")
    assert re.findall(r"^(?:import|from) .*", text, re.MULTILINE) == ["import numpy as np"]
