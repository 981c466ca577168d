"""Real records with a documented answer: cascaded tanks, and a Seaglider with two pressure gauges.

Configuration: the folders in examples/, with source and licence. Tolerance: as documented (factor 1.094 to 1.104 in
dives 2 to 6), and a gain on records that no fit has seen.
"""

import importlib.util
from pathlib import Path

import pytest

import subzero.diagnosis as sd

EXAMPLES = Path(__file__).parents[2] / "examples"


def example(folder, name):
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / folder / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_the_overflow_of_the_tanks_is_named_with_its_gain_on_the_validation_record():
    tanks = example("cascaded_tanks", "tanks")
    verdict = sd.diagnose(tanks.read("Est"), tanks.model(), held_out=tanks.read("Val"))
    assert "overflow" in [each.id for each in verdict.causes]
    (overflow,) = [each for each in verdict.causes if each.id == "overflow"]
    assert overflow.gain.strict
    assert overflow.gain.low > 0.0


@pytest.mark.slow
def test_without_the_overflow_on_offer_nothing_is_named():
    tanks = example("cascaded_tanks", "tanks")
    verdict = sd.diagnose(tanks.read("Est"), tanks.model((tanks.valve,)), held_out=tanks.read("Val"))
    assert verdict.named == ()


@pytest.mark.slow
def test_two_gauges_differ_and_nothing_decides_which_is_wrong():
    glider = example("seaglider", "glider")
    verdict = sd.diagnose(glider.legs(), glider.model())
    assert not [each for each in verdict.named if each.id.startswith(("scale", "affine"))]
    (relation,) = verdict.relations
    assert "by a factor 1.10" in relation
    assert "clocks" in relation


@pytest.mark.slow
def test_with_a_trusted_gauge_the_other_one_is_named():
    glider = example("seaglider", "glider")
    verdict = sd.diagnose(glider.legs(), glider.model(trusted=True))
    factors = [e.value for each in verdict.data_errors for e in each.estimates if e.name == "factor"]
    assert factors == [pytest.approx(1.0 / 1.10, abs=0.01)]


@pytest.mark.slow
def test_with_one_gauge_nothing_is_named_and_its_scale_would_not_be_seen():
    glider = example("seaglider", "glider")
    verdict = sd.diagnose(glider.legs(), glider.model(second=False))
    assert verdict.named == ()
    assert next(iter(verdict.explanations)) == "nothing is wrong"
    assert float(verdict.visible_from["scale:gauge"].rstrip(" %")) > 8.0


@pytest.mark.long
def test_the_legs_and_the_tanks_are_read_whole():
    assert len(example("seaglider", "glider").legs()) == 10
    assert example("cascaded_tanks", "tanks").read("Est").time.size == 1024
