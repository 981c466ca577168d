"""Two formulations that share no line of physics: Cartesian, and equation (7) in angles.

Verifies: tow force and length of a smooth dive and a helix, ``scheme="moving_end"`` beside the angle
formulation, free drum and drum with friction. Configuration: Table 1, 0.5 m, 0.1 s. Tolerance: 3e-3 of the
largest tension, the sum of both discretisation errors; and it shrinks fourfold when step and segment are
halved, so it is discretisation and nothing else.
"""

import numpy as np
import pytest

import cable


def helix(time):
    return np.cos(0.2 * time), np.sin(0.2 * time), -0.2


def smooth_dive(time):
    x = np.clip(time / 12.0, 0.0, 1.0)
    pitch = -np.radians(60.0) * x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    return np.cos(pitch), 0.0, -np.sin(pitch)


@pytest.mark.parametrize("motion", [helix, smooth_dive], ids=["helix", "dive"])
@pytest.mark.parametrize("friction", [0.0, 0.005], ids=["free drum", "dragging drum"])
def test_both_formulations_give_the_same_tow_force_and_length(motion, friction):
    drum = cable.DrumProperties(friction_torque=friction)
    ours = cable.pull_out(motion, 20.0, drum=drum, scheme=cable.MovingEnd(time_step=0.1))
    angles = cable.pull_out(motion, 20.0, drum=drum, scheme=cable.Equation7(time_step=0.1))
    assert ours.outcome.completed
    assert angles.outcome.completed
    assert np.abs(ours.tow_force - angles.tow_force)[30:].max() < 3e-3 * ours.tow_tension.max()
    assert ours.length[-1] == pytest.approx(angles.length[-1], rel=5e-4)


def test_the_difference_between_the_formulations_shrinks_fourfold_with_step_and_segment():
    drum, differences = cable.DrumProperties(friction_torque=0.005), []
    for step, segment_length in ((0.2, 1.0), (0.1, 0.5)):
        steps = {"time_step": step, "segment_length": segment_length}
        ours = cable.pull_out(helix, 20.0, drum=drum, scheme=cable.MovingEnd(**steps))
        angles = cable.pull_out(helix, 20.0, drum=drum, scheme=cable.Equation7(**steps))
        difference = np.abs(ours.tow_force - angles.tow_force)
        differences.append(difference[ours.time > 3.0].max())
    assert differences[0] / differences[1] > 3.5


def test_the_second_formulation_takes_its_segments_as_asked_and_says_which_it_is():
    for length in (0.5, 1.0):
        run = cable.pull_out(helix, 8.0, scheme=cable.Equation7(time_step=0.1, segment_length=length))
        first, second = run.shapes[-1][:2]
        assert np.linalg.norm(first - second) == pytest.approx(length, rel=1e-9)  # inextensible
        assert run.scheme == "equation7"
