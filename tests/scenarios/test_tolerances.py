"""How far a healthy vehicle may be off stands in its file or in the trial, and a diagnosis goes by it.

Verifies: `tolerance` beside a number, [tolerances] of a trial, and what causes make of them. Configuration: `fig6` with
files of its own. Tolerance: rounding.
"""

import re

import pytest

import scenarios
import subzero
from subzero.diagnosis import Setting, catalogue
from subzero.diagnosis.inference import moves_nothing, with_tolerances
from subzero.model import Model

FIG6 = scenarios.path("fig6").read_text(encoding="utf-8")
HULL = (scenarios.path("fig6").parents[1] / "vehicles" / "subzero2.toml").read_text(encoding="utf-8")
DRAG = '{ value = 0.28, unit = "1", range = [0.18, 0.43],'


@pytest.fixture
def trial(tmp_path):
    """Return a reader of fig6 with a vehicle of its own: (tolerance of the drag, lines of the trial) → trial."""

    def read(tolerance=None, more=""):
        said = DRAG if tolerance is None else f"{DRAG} tolerance = {tolerance},"
        (tmp_path / "hull.toml").write_text(HULL.replace(DRAG, said), encoding="utf-8")
        text = FIG6.replace('vehicle = "subzero2"', 'vehicle = "hull.toml"').replace(
            "[changes]", f"{more}\n[changes]"
        )
        (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
        return subzero.load_scenario(tmp_path / "mine.toml")

    return read


def effect_of(trial, name):
    """Return a cause with the tolerances of a trial."""
    return with_tolerances(catalogue(("heading",))[name], Setting(trial=trial, model=Model.of(trial)))


def test_without_a_tolerance_the_one_of_the_catalogue_holds(trial):
    assert trial().tolerances == {}
    assert effect_of(trial(), "hull_drag") == catalogue(("heading",))["hull_drag"]


def test_a_tolerance_of_the_file_is_that_of_the_cause(trial):
    (share,) = effect_of(trial(0.056), "hull_drag").parameters
    assert share.tolerance == pytest.approx(0.056 / 0.28)


def test_the_trial_goes_before_the_file(trial):
    mine = trial(
        0.056, '[tolerances]\n"vehicle.axial_drag.drag_coefficient" = 0.014\ncable.diameter = 1e-4\n'
    )
    assert mine.tolerances == {"vehicle.axial_drag.drag_coefficient": 0.014, "cable.diameter": 1e-4}
    (share,) = effect_of(mine, "hull_drag").parameters
    assert share.tolerance == pytest.approx(0.05)


def test_of_two_numbers_that_a_cause_moves_the_stricter_one_counts(trial):
    both = ('[tolerances]\n"vehicle.stern_plane_port_servo.offset" = 0.01\n'
            '"vehicle.stern_plane_starboard_servo.offset" = 0.002\n')  # fmt: skip
    common, differential = effect_of(trial(None, both), "stern_plane_offset").parameters
    assert common.tolerance == pytest.approx(0.002 * 57.29577951)
    assert differential.tolerance == pytest.approx(common.tolerance)


def test_a_share_of_nothing_is_no_cause(trial):
    setting, drag = Setting(trial=trial(), model=Model.of(trial())), catalogue(("heading",))["hull_drag"]
    assert not moves_nothing(drag, setting)
    assert moves_nothing(drag, setting.with_vehicle(axial_drag__drag_coefficient=0.0))


@pytest.mark.parametrize("bad", ["0.0", "-0.1", "nan", "true", '"3 %"'])
def test_a_tolerance_that_is_none_is_refused_with_its_line(trial, bad):
    with pytest.raises(scenarios.ScenarioError) as caught:
        trial(bad)
    line = next(i for i, text in enumerate(HULL.split("\n"), start=1) if text.startswith("drag_coefficient"))
    assert f"line {line}" in str(caught.value)
    assert "tolerance" in str(caught.value)


def test_tolerances_of_what_does_not_exist_are_refused_with_the_nearest(trial):
    with pytest.raises(scenarios.ScenarioError, match=re.escape("Did you mean 'vehicle.rigid_body.mass'?")):
        trial(None, '[tolerances]\n"vehicle.rigid_body.mas" = 0.1')
