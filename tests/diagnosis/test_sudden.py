"""An effect that begins in mid-trial: it changes nothing before, stands beside other changes, and its time is found."""

import numpy as np
import pytest

from subzero.diagnosis.hypothesis.catalogue import catalogue
from subzero.diagnosis.hypothesis.effect import with_onset
from subzero.diagnosis.inference.change_point_scan import (
    BaseRun,
    ChangePoint,
    LinearisationPoint,
    _strongest,
    scan,
    times_of,
    with_change_point,
)

EFFECTS = catalogue(("heading",))


@pytest.fixture(scope="module")
def struck(plant):
    return plant(lambda setting: with_onset(EFFECTS["hull_drag"], 12.4).apply(setting, 0.9))


def place_of(problem, fit):
    return LinearisationPoint(fit=fit, along=BaseRun(problem, fit.z))


def test_the_scan_finds_what_began_and_when(struck):
    fit = struck.fit()
    effects = [EFFECTS[name] for name in ("hull_drag", "rudder_offset", "net_buoyancy", "hull_drag")]
    found = scan(place_of(struck.problem, fit), fit.D, effects, best=1)
    assert found[0].effect.id == "hull_drag"
    assert abs(found[0].time - 12.4) <= 1.0
    assert found[0].mean[0] == pytest.approx(0.9, abs=0.35)
    assert found[0].log_gain > 20.0
    more = with_change_point(struck.problem, found[0])
    assert more.entries[-1].effect.id.startswith("hull_drag@")


def test_times_stay_clear_of_the_ends(struck):
    times = times_of(struck.problem, 0)
    assert times[0] == 2.0
    assert times[-1] == 28.0


def test_what_would_have_to_be_negative_and_cannot_explains_nothing(plant):
    """From 14 s on the hull drags less; a drum that rubs less than not at all would look like it."""
    planted = plant(lambda setting: with_onset(EFFECTS["hull_drag"], 14.0).apply(setting, -0.4))
    fit = planted.fit()
    found = scan(place_of(planted.problem, fit), fit.D, [EFFECTS["hull_drag"], EFFECTS["drum_friction"]])
    gains = {one.effect.id: one.log_gain for one in found}
    assert gains["hull_drag"] > gains["drum_friction"] + 20.0


def test_between_the_times_that_were_tried_a_parabola_says_what_more_there_is():
    def tried(time):
        return ChangePoint(effect=EFFECTS["hull_drag"], time=time, record=0, mean=np.zeros(1),
                     log_gain=50.0 - 8.0 * (time - 12.3) ** 2)  # fmt: skip

    (best,) = _strongest([tried(time) for time in (10.0, 12.0, 14.0)])
    assert best.time == 12.0
    assert best.log_gain + best.between == pytest.approx(50.0)
    (edge,) = _strongest([tried(time) for time in (12.0, 14.0)])
    assert edge.between == 0.0
