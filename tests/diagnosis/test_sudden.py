"""An effect that begins in mid-trial: it changes nothing before, stands beside other changes, and its time is found."""

import pytest

from subzero.diagnosis.begun import begun_at
from subzero.diagnosis.effects import catalogue
from subzero.diagnosis.sudden import scan, times_of, with_begun

EFFECTS = catalogue(("heading",))


@pytest.fixture(scope="module")
def struck(plant):
    return plant(lambda setting: begun_at(EFFECTS["hull_drag"], 12.4).apply(setting, 0.9))


def test_the_scan_finds_what_began_and_when(struck):
    fit = struck.fit()
    effects = [EFFECTS[name] for name in ("hull_drag", "rudder_offset", "net_buoyancy", "hull_drag")]
    found = scan(struck.problem, fit, fit.D, effects, best=1)
    assert found[0].effect.id == "hull_drag"
    assert abs(found[0].time - 12.4) <= 1.0
    assert found[0].mean[0] == pytest.approx(0.9, abs=0.35)
    assert found[0].log_gain > 20.0
    more = with_begun(struck.problem, found[0])
    assert more.entries[-1].effect.id.startswith("hull_drag@")


def test_times_stay_clear_of_the_ends(struck):
    times = times_of(struck.problem, 0)
    assert times[0] == 2.0
    assert times[-1] == 28.0
