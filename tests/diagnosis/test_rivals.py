"""What is undecided is reported as a set: the most probable with its numbers, and how far the others are from it.

Verifies: report, table and figures of an undecided verdict. Configuration: a verdict made by hand, of three seconds.
"""

import dataclasses

import numpy as np

from subzero.diagnosis import CAUSE_NAMED, NOTHING_WRONG, UNDECIDED, Curves, Estimate, Rival, Verdict, report
from subzero.figures import Title
from subzero.figures.diagnosis import draw_diagnosis

TIME = np.linspace(0.1, 3.0, 30)
SHARE = Estimate(value=0.4, low=0.3, high=0.5, unit="1", nominal=0.0, deviation=0.4, deviation_sd=0.05)
DRAG, SLOPE, NONE = (
    Rival(ids=("hull_drag",), sentence="the hull drags more", probability=0.7, discrimination=np.nan,
          parameters={"hull_drag": {"share": SHARE}}),
    Rival(ids=("propeller_thrust_slope",), sentence="thrust falls faster", probability=0.2, discrimination=3.0),
    Rival(ids=(), sentence="nothing is wrong", probability=0.1, discrimination=7.0),
)  # fmt: skip
TITLE = Title(words="a trial", scenario="fig6")


def undecided(verdict=UNDECIDED, drawn=2, rivals=(DRAG, SLOPE, NONE)):
    speeds = {"nominal": 1.0, "tolerance": 0.99}
    speeds |= {f"rival: {one.ids[0]}": 0.95 for one in (DRAG, SLOPE)[:drawn]}
    models = {name: {"surge_speed": speed * TIME} for name, speed in speeds.items()}
    curves = Curves(time=TIME, measured={"surge_speed": 0.95 * TIME}, models=models,
                    used={"surge_speed": np.ones(TIME.size, bool)})  # fmt: skip
    return Verdict(verdict=verdict, sentence="These records cannot tell apart.", rivals=rivals,
                   probabilities={"hull_drag": 0.7, "propeller_thrust_slope": 0.2, "none": 0.1},
                   curves={"record": curves})  # fmt: skip


def test_the_report_says_what_the_records_allow_and_that_nothing_is_new_in_the_model():
    text = report.markdown(undecided(), {"record": "record.csv, fig6"})
    assert "What the records allow (D: how far from what is most probable):" in text
    assert "is the extended model" not in text
    named = dataclasses.replace(undecided(rivals=(SLOPE, NONE)), verdict=CAUSE_NAMED)
    assert "What else the records allow (D: how far from the reported one):" in report.markdown(named, {})
    assert report.tables.rivals(undecided(), short=True).header[0] == "what explains the records"


def test_the_others_are_drawn_beside_the_most_probable():
    figures = draw_diagnosis(undecided(), TITLE)
    legend = [text.get_text() for text in figures["rivals"].axes[0].get_legend().get_texts()]
    assert legend == [
        "measured",
        "if the hull drags more",
        "if thrust falls faster",
        "if nothing is wrong",
    ]
    overlay = [text.get_text() for text in figures["misfit"].axes[0].get_legend().get_texts()]
    assert {"simulated", "if the hull drags more"} < set(overlay)


def test_what_the_words_do_not_name_is_not_drawn_and_what_they_name_is():
    """Two explanations to be told apart, one a drift of a sensor, and a third that is improbable but was fitted."""
    shown = undecided()
    drift = "hull_drag + sensor_drift:surge_speed"
    curves = shown.curves["record"]
    models = {**curves.models, f"rival: {drift}": curves.models["tolerance"]}
    both = dataclasses.replace(
        shown,
        probabilities={"hull_drag": 0.75, drift: 0.25, "propeller_thrust_slope": 1e-5},
        curves={"record": dataclasses.replace(curves, models=models)},
    )
    legend = draw_diagnosis(both, TITLE)["rivals"].axes[0].get_legend().get_texts()
    words = [text.get_text().replace("\n", " ") for text in legend]
    assert words[1:] == [
        "if the hull drags more",
        "if the hull drags more and the sensor of the surge speed drifts",
    ]
    assert (
        "these records cannot tell apart: the hull drags more (0.750); "
        in report.words.sentence(both).lower()
    )


def test_one_alone_has_nothing_beside_it():
    alone = dataclasses.replace(undecided(drawn=1), probabilities={"hull_drag": 1.0})
    assert "rivals" not in draw_diagnosis(alone, TITLE)


def test_a_healthy_record_is_drawn_with_the_calibrated_model_alone():
    healthy = draw_diagnosis(undecided(NOTHING_WRONG, drawn=0), TITLE)
    assert "rivals" not in healthy
    overlay = [text.get_text() for text in healthy["misfit"].axes[0].get_legend().get_texts()]
    assert "calibrated within tolerances" in overlay
