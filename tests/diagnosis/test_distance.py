"""D of causes that begin in mid-trial: how far they are from all that looks like them.

Verifies: more drag and less thrust on a straight course look alike from then on; a rudder off its centre looks like
nothing else. Configuration: a healthy record of fig6, of the world benchmark.
"""

import pytest

from benchmarks.diagnosis.distance import sensitivities, sudden_distance
from benchmarks.diagnosis.world import Drawn, record_of
from subzero.diagnosis.inference import pose


@pytest.mark.long
def test_thrust_and_drag_from_then_on_look_alike_and_a_rudder_like_nothing_else():
    logged, _ = record_of(Drawn(seed=7, index=0, flown="fig6", family="mild", cause=""))
    problem = pose([logged])
    J = sensitivities(problem)
    D, rival = sudden_distance(problem, J, "hull_drag", (0.3,), 14.0)
    assert rival.startswith("propeller_thrust_gain@")
    assert D < 9.0
    assert sudden_distance(problem, J, "rudder_offset", (2.0,), 14.0)[0] > 100.0
