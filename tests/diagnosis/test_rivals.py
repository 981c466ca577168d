"""What is undecided is told as a set: the most probable with its numbers, and how far the others are from it.

Verifies: `estimates.rivals`, and report, table and figures of an undecided verdict. Configuration: 10 s of fig6 with a
hull that drags 40 % more, where a slope of the thrust looks much alike.
"""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from subzero.diagnosis.assessment.residuals import curves
from subzero.diagnosis.hypothesis.catalogue import catalogue
from subzero.diagnosis.inference.laplace import candidate_of
from subzero.diagnosis.report import sections as report
from subzero.diagnosis.report import tables
from subzero.diagnosis.results import CAUSE_NAMED, NOTHING_WRONG, UNDECIDED, Extended, Unknown, Verdict
from subzero.diagnosis.verdict.conclude import strange_rival
from subzero.diagnosis.verdict.extension import Extension, rivals
from subzero.figures import Title
from subzero.figures.diagnosis import draw_diagnosis

DRAG, SLOPE = ("hull_drag",), ("propeller_thrust_slope",)
INSIDE = {DRAG: 0.7, SLOPE: 0.2, (): 0.1}


@pytest.fixture(scope="module")
def work(plant):
    planted = plant(lambda setting: catalogue(("heading",))["hull_drag"].apply(setting, 0.4), duration=10.0)
    candidates = {ids: candidate_of(planted.problem, ids, planted.fit(*ids)) for ids in INSIDE}
    return SimpleNamespace(problem=planted.problem, search=SimpleNamespace(candidates=candidates))


@pytest.fixture(scope="module")
def everything(work):
    return rivals(work, work.search.candidates[DRAG], INSIDE, list(INSIDE), None)


def undecided(work, everything, verdict=UNDECIDED, drawn=2):
    fits = {"nominal": None, "tolerance": work.search.candidates[()].fit}
    fits |= {f"rival: {ids[0]}": work.search.candidates[ids].fit for ids in (DRAG, SLOPE)[:drawn]}
    return Verdict(verdict=verdict, sentence="These records cannot tell apart.", rivals=everything,
                   probabilities={"hull_drag": 0.7, "propeller_thrust_slope": 0.2, "none": 0.1},
                   curves=curves(work.problem, fits))  # fmt: skip


def test_the_most_probable_is_among_what_the_records_allow_with_its_numbers(everything):
    assert [one.ids for one in everything] == [DRAG, SLOPE, ()]
    share = everything[0].parameters["hull_drag"]["share"]
    assert share.low < 0.4 < share.high
    assert np.isnan(everything[0].discrimination)
    assert all(one.discrimination >= 0.0 for one in everything[1:])


def test_beside_what_is_told_only_the_others_are_listed(work):
    best = work.search.candidates[DRAG]
    assert [one.ids for one in rivals(work, best, INSIDE, list(INSIDE), DRAG)] == [SLOPE, ()]
    assert [one.ids for one in rivals(work, best, INSIDE, [DRAG], DRAG)] == [SLOPE]


def test_forces_and_drifts_are_rivals_in_words():
    force, drift = strange_rival("unknown_force:N", 0.3), strange_rival("sensor_drift:yaw_rate", 0.2)
    assert force.sentence == "a moment that turns it to starboard acts that no cause explains"
    assert (drift.ids, drift.sentence) == (("sensor_drift:yaw_rate",), "the sensor of the yaw rate drifts")
    assert (force.probability, drift.probability) == (0.3, 0.2)


def test_the_report_says_what_the_records_allow_and_that_nothing_is_new_in_the_model(work, everything):
    text = report.markdown(undecided(work, everything), {"record": "record.csv, fig6"})
    assert "What the records allow (D: how far from what is most probable):" in text
    assert "nothing new in it" in text
    named = dataclasses.replace(undecided(work, everything[1:]), verdict=CAUSE_NAMED)
    assert "What else the records allow (D: how far from what is told):" in report.markdown(named, {})
    assert tables.rivals(undecided(work, everything), short=True).header[0] == "what explains the records"


def test_the_others_are_drawn_beside_the_most_probable(work, everything):
    title = Title(words="a trial", scenario="fig6")
    figures = draw_diagnosis(undecided(work, everything), title)
    legend = [text.get_text() for text in figures["rivals"].axes[0].get_legend().get_texts()]
    assert legend == [
        "measured",
        "if the hull has another drag",
        "if the thrust falls differently with speed",
        "if nothing is wrong",
    ]
    overlay = [text.get_text() for text in figures["misfit"].axes[0].get_legend().get_texts()]
    assert {"simulated", "if the hull has another drag"} < set(overlay)


def test_one_alone_has_nothing_beside_it(work, everything):
    title = Title(words="a trial", scenario="fig6")
    alone = dataclasses.replace(undecided(work, everything, drawn=1), probabilities={"hull_drag": 1.0})
    assert "rivals" not in draw_diagnosis(alone, title)
    healthy = draw_diagnosis(undecided(work, everything, NOTHING_WRONG, drawn=0), title)
    overlay = [text.get_text() for text in healthy["misfit"].axes[0].get_legend().get_texts()]
    assert "calibrated within tolerances" in overlay


def test_only_new_physics_has_a_gain(work):
    def extension(deviations, **more):
        new = Extended(deviations=deviations, calibration={"hull_drag": {"share": 0.01}})
        return Extension(fit=work.search.candidates[()].fit, problem=work.problem, extended=new, **more)

    drift = Unknown(axis="heading", time=np.arange(3.0), force=np.ones(3), band=np.ones(3))
    assert extension({"hull_drag": {"share": 0.4}}).is_new
    assert not extension({}).is_new
    assert not extension({"hull_drag": {"share": 0.4}}, unknown=drift).is_new
