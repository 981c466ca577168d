"""A buoyant body on a tether that is led away: by ours and by MoorDyn, both coupled (`benchmarks.coupled_body`).

Verifies: path and tension within 3 % of MoorDyn's (found 0.1 %); where MoorDyn is not installed, our tension alone
against what moves the body along its path. Tolerance of that: 2 %, of differences over 0.1 s.
"""

import numpy as np
import pytest

from benchmarks import coupled_body


@pytest.fixture(scope="module")
def ours():
    return coupled_body.our_run(coupled_body.Body(), 0.5)


def test_the_tension_is_what_moves_the_body_against_its_drag_and_buoyancy(ours):
    """T = (m + A) a + ½ρ C_d A |V| V + B k, with V and a from differences of the path over 0.1 s."""
    body, step = coupled_body.Body(), coupled_body.SECONDS[1] - coupled_body.SECONDS[0]
    velocity = np.gradient(ours.place, step, axis=0)
    mass = body.mass + body.added_mass * coupled_body.DENSITY * body.volume
    drag = (
        0.5
        * coupled_body.DENSITY
        * body.drag_area
        * np.linalg.norm(velocity, axis=1, keepdims=True)
        * velocity
    )
    pull = mass * np.gradient(velocity, step, axis=0) + drag + [0.0, body.buoyancy]
    inside = slice(20, -20)
    np.testing.assert_allclose(np.linalg.norm(pull, axis=1)[inside], ours.tension[inside], rtol=0.02)


def test_the_body_comes_back_above_its_anchor(ours):
    assert ours.place[0] == pytest.approx([0.0, 0.0], abs=0.01)
    assert ours.place[:, 1].max() > 2.0
    assert ours.place[-1, 0] < coupled_body.led(coupled_body.DURATION_S)[0]


@pytest.mark.long
def test_path_and_tension_are_those_of_moordyn(ours):
    pytest.importorskip("moordyn")
    found = coupled_body.differences(ours, coupled_body.moordyn_run(coupled_body.Body()))
    print(found)
    assert max(found.values()) < 0.03
