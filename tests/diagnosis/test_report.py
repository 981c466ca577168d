"""What was found is told: the same numbers in words, tables, figures, a page and a JSON file."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from subzero.cli.write_diagnosis import print_diagnosis
from subzero.diagnosis import (
    CALIBRATED,
    CAUSE_NAMED,
    DATA_ERROR,
    NOTHING_NEAR,
    NOTHING_WRONG,
    OUT_OF_CATALOGUE,
    UNDECIDED,
    ChannelGain,
    Curves,
    Detectability,
    Estimate,
    Extended,
    FoundError,
    Gain,
    Misfit,
    NextTrial,
    Rival,
    Verdict,
    report,
)
from subzero.diagnosis import (
    NamedCause as Cause,
)
from subzero.diagnosis import (
    UnknownForce as Unknown,
)
from subzero.diagnosis.assessment import detectability
from subzero.figures.diagnosis import draw_diagnosis
from subzero.figures.style import Title
from subzero.files.atomic_output import OutputFolder

TIME = np.linspace(0.0, 30.0, 301)
LAG = Estimate(value=0.31, low=0.23, high=0.39, unit="s", nominal=0.1, deviation=0.21, deviation_sd=0.04)
INERTIA = Estimate(value=0.35, low=0.2, high=0.5, unit="1", nominal=0.0, deviation=0.35, deviation_sd=0.08)


def make_curves(seed=0):
    rng = np.random.default_rng(seed)
    truth = {"surge_speed": 1.1 * (1 - np.exp(-TIME / 2)), "heading": 27 + 8 / (1 + np.exp(-(TIME - 3)))}
    noise = {"surge_speed": 0.015, "heading": 0.4}
    measured = {name: one + noise[name] * rng.normal(size=TIME.size) for name, one in truth.items()}
    measured["heading"][100] += 8.0
    measured["surge_speed"][150:160] = np.nan
    used = {name: np.isfinite(one) for name, one in measured.items()}
    used["heading"][100] = False
    late = 27 + 8 / (1 + np.exp(-(TIME - 2.6)))
    models = {
        "nominal": {"surge_speed": truth["surge_speed"] * 1.02, "heading": late},
        "extended": truth,
        "rival: yaw_inertia": {
            "surge_speed": truth["surge_speed"],
            "heading": 0.5 * (late + truth["heading"]),
        },
        "rival: rudder_rate_limit": {"surge_speed": truth["surge_speed"], "heading": truth["heading"] + 0.2},
    }
    return Curves(time=TIME, measured=measured, models=models, used=used)


def make_misfit(sd):
    return Misfit(rmse=2.3 * sd, nrmse=2.3, fit_percent=91.2, bias=0.1 * sd, whiteness_p=1e-7,
                  command_correlation={"rudder_command": (0.4, 0.61), "propeller_command": (0.0, 0.1)},
                  windows=((1.2, 3.9),), noise_sd=sd, noise_slow=0.5 * sd, noise_time=2.0,
                  resolution=0.0, outliers=1, gaps=10)  # fmt: skip


GAIN = {
    "surge_speed": ChannelGain(before=0.05, tolerance=0.016, after=0.0151, rival=0.0155, floor=0.015),
    "heading": ChannelGain(before=3.0, tolerance=0.9, after=0.41, rival=0.8, floor=0.4),
}

NAMED = Verdict(
    verdict=CAUSE_NAMED,
    sentence="The rudder servo lags (p = 0.97); the runner-up is another yaw inertia (p = 0.02, D 37).",
    causes=(Cause(id="rudder_lag", sentence="the rudder servo lags", probability=0.97,
                  parameters={"time_constant": LAG}),),
    rivals=(
        Rival(ids=("yaw_inertia",), sentence="the yaw inertia differs", probability=0.02, discrimination=37.0,
              parameters={"yaw_inertia": {"share": INERTIA}}),
        Rival(ids=(), sentence="nothing is wrong", probability=0.001, discrimination=math.nan),
    ),
    probabilities={"rudder_lag": 0.97, "yaw_inertia": 0.02, "rudder_rate_limit": 0.006, "none": 0.001,
                   "hull_drag + rudder_lag": 0.003},
    tolerance_scale={1.0: 0.9, 2.0: 0.08, 4.0: 0.02},
    detectable=(
        Detectability(id="rudder_lag", signal=20.0, smallest={"time_constant": 0.05}, rival="yaw_inertia",
                      discrimination=37.0, cosine=0.9),
        Detectability(id="current", signal=2.0, smallest={"north": 0.3, "east": 0.5}, rival="cable_tangential_drag",
                      discrimination=0.2, cosine=0.998),
        Detectability(id="surge_added_mass", signal=14.0, smallest={"share": 0.05}, rival="drum_inertia",
                      discrimination=1.5, cosine=0.993),
    ),
    misfit={"record": {"surge_speed": make_misfit(0.015), "heading": make_misfit(0.4)}},
    gain=Gain(fitted=GAIN, held_out=GAIN, total=0.991, owed=0.8, owed_low=0.6, how="blocks of the same trial"),
    extended=Extended(deviations={"rudder_lag": {"time_constant": 0.21}}),
    next_trial=NextTrial(name="rudder_doublets", sentence="fly rudder doublets of 10 degrees", decides=0.93,
                         discrimination=40.0, channel="rudder_angle",
                         commands=((0.0, 25.0, 0.0, 0.0, 0.0), (2.0, 25.0, math.radians(10.0), 0.0, 0.0))),
    deviations={"hull_drag.share": (2.4, 0.5), "yaw_damping.share": (0.1, 0.9)},
    curves={"record": make_curves()},
    notes=("Left out, for it never changes: depth_m.",),
    seconds={"screen": 2.1, "search": 9.0},
    seed=7,
)  # fmt: skip

FORCE = Verdict(
    verdict=OUT_OF_CATALOGUE,
    sentence="A force along X that no catalogued effect explains.",
    unknown=Unknown(axis="X", time=TIME[::20], force=-0.5 / (1 + np.exp(-(TIME[::20] - 12) / 0.8)),
                    band=np.full(16, 0.05),
                    formula=(("the square of the speed through the water", "u|u|", -1.2, -1.5, -0.9),),
                    features={"u|u|": 0.7, "wave": 0.2, "time*u2": 0.15, "u": 0.05}),
    probabilities={"unknown_force:X": 0.99},
)  # fmt: skip


DRIFT = dataclasses.replace(
    FORCE,
    sentence="The sensor of the heading drifts as no cause of the catalogue explains.",
    unknown=Unknown(axis="heading", time=TIME[::20], force=0.2 * TIME[::20], band=np.full(16, 0.5)),
    probabilities={"sensor_drift:heading": 0.99},
)


def test_a_cause_is_named_in_words_with_value_interval_unit_and_model():
    said = report.words.cause(NAMED.causes[0])
    assert (
        said
        == "The rudder servo lags: time constant 0.31 s (95 %: 0.23 s to 0.39 s; model: 0.1 s). Probability 0.970."
    )
    assert "+35 % (95 %: +20 % to +50 %; model: +0 %)" in report.words.estimate("share", INERTIA)


def test_a_force_is_told_with_what_else_it_may_be_made_of():
    said = report.words.unknown(FORCE.unknown)
    assert "It looks like -1.2 (-1.5 to -0.9) × u|u|, the square of the speed through the water." in said
    assert (
        "not ruled out: wave (an oscillation of its own; probability 0.20), time*u2 (the time since" in said
    )
    assert "0.05" not in said, "too improbable"


def test_what_comes_next_beside_an_error_in_the_data_is_told_without_that():
    """As in the figure: the error is in all explanations, and is no alternative to itself."""
    error = FoundError(id="clock_rate", record="record", columns=("time_s",), probability=0.9995, remedy="divide it",
                       sentence="the clock runs too fast")  # fmt: skip
    listed = {f"clock_rate + {name}": p for name, p in NAMED.probabilities.items() if name != "none"}
    both = dataclasses.replace(NAMED, verdict=DATA_ERROR, then=NAMED.verdict, data_errors=(error,))
    said = answers(dataclasses.replace(both, probabilities=listed))["How sure is that"]
    assert "What comes next: the yaw inertia differs (probability 0.020); these records can tell" in said
    alone = {next(iter(listed)): 0.97, "clock_rate": 0.02}
    said = answers(dataclasses.replace(both, probabilities=alone))["How sure is that"]
    assert "What comes next: nothing else is wrong (probability 0.020)" in said


def test_a_wave_is_told_by_its_size_and_period():
    swell = dataclasses.replace(
        FORCE.unknown, formula=(("a wave with a period of 6.3 s", "wave", 0.36, 0.29, 0.42),)
    )
    said = report.words.unknown(swell)
    assert "It looks like a wave of 0.36 (0.29 to 0.42) with a period of 6.3 s." in said
    assert "ruled out" not in report.words.unknown(dataclasses.replace(FORCE.unknown, features={"u|u|": 1.0}))


def answers(verdict):
    return {one.question: " ".join(one.words) for one in report.summary(verdict, "fig6")}


def test_the_summary_says_what_is_wrong_how_sure_what_it_costs_what_to_do_and_what_would_settle_it():
    said = answers(NAMED)
    assert said["What is wrong"] == "The rudder servo lags: time constant 0.31 s, where the model has 0.1 s."
    assert said["How sure is that"].startswith("Very sure (probability 0.970).")
    assert (
        "What comes next: the yaw inertia differs (probability 0.020); these records can tell"
        in said["How sure is that"]
    )
    assert "misses the heading by 3 degree, 7.5 times the noise of its sensor" in said["What it costs"]
    assert "explains 99.1 % of what can be explained" in said["What it costs"]
    assert "Look at the fins, their servos and linkages." in said["What to do next"]
    assert [one.command for one in report.summary(NAMED, "fig6")][
        3
    ] == "subzero simulate fig6 --with extended.toml"
    assert (
        "Next trial: fly rudder doublets of 10 degrees (rudder_doublets); it decides with probability 0.93. "
        "Log rudder_angle_deg too." in said["What would settle it"]
    )


def test_a_force_is_said_as_what_it_does_and_a_push_of_both_signs_as_both():
    assert answers(FORCE)["What is wrong"].startswith(
        "Something holds the hull back that no cause explains, with a force"
    )
    wave = dataclasses.replace(FORCE.unknown, axis="K", force=np.sin(TIME[::20]))
    assert report.words.unknown(wave).startswith(
        "Something rolls the hull that no cause explains, with a moment of"
    )
    assert report.words.something("K", np.array([0.0, -0.3, 0.02])) == "something rolls the hull to port"
    assert report.words.something("K", np.array([0.0, 0.3])) == "something rolls the hull to starboard"


@pytest.mark.parametrize("verdict", [NAMED, FORCE, DRIFT], ids=["named", "force", "drift"])
def test_the_answers_have_no_ids(verdict):
    said = " ".join(line for one in report.summary(verdict) for line in one.words).replace(
        "(rudder_doublets)", ""
    )
    assert "rudder_lag" not in said
    assert "unknown_force" not in said
    assert "sensor_drift" not in said


def test_a_hypothesis_of_any_kind_has_words():
    assert report.words.explanation("none") == "nothing is wrong"
    assert (
        report.words.explanation("rudder_lag + hull_drag")
        == "the rudder servo lags and the hull has another drag"
    )
    assert report.words.explanation("hull_drag@12.5") == "from 12.5 s on the hull has another drag"
    assert report.words.explanation("unknown_force:N") == "something turns the hull from side to side"
    assert report.words.explanation("sensor_drift:yaw_rate") == "the sensor of the yaw rate drifts"
    assert report.words.explanation("mine", {"mine": "weed hangs on it"}) == "weed hangs on it"
    assert report.words.explanation("an_effect_of_tomorrow") == "an effect of tomorrow"


def test_a_gain_that_is_none_is_called_none():
    worse = dataclasses.replace(NAMED, gain=dataclasses.replace(NAMED.gain, total=-0.2))
    assert "no better than the nominal one" in answers(worse)["What it costs"]
    vain = dataclasses.replace(NAMED, gain=dataclasses.replace(NAMED.gain, owed_low=-0.1))
    assert "not significant" in answers(vain)["What it costs"]
    assert "not significant" not in answers(NAMED)["What it costs"]


def test_a_healthy_record_says_what_it_could_not_have_shown():
    healthy = Verdict(verdict=NOTHING_WRONG, sentence="", detectable=NAMED.detectable, misfit=NAMED.misfit)
    said = answers(healthy)
    assert said["What is wrong"] == "Nothing is wrong beyond the tolerances of the model."
    assert "would have shown 2 of the 3 causes" in said["How sure is that"]
    assert "could not have shown: the water moves." in said["How sure is that"]
    assert "2.3 times the noise" in said["What it costs"]


def other_sign(**probabilities):
    """Return a verdict on a record whose heading has the other sign, and that is healthy once that is put right."""
    error = FoundError(id="sign:heading", record="record", columns=("heading_deg",), probability=0.9995,
                       sentence="heading_deg has the other sign", remedy="change its sign")  # fmt: skip
    row = dataclasses.replace(make_misfit(0.4), rmse=3.5, nrmse=8.7)
    curves = make_curves()
    models = curves.models | {"tolerance": curves.models["extended"]}
    return Verdict(
        verdict=DATA_ERROR, then=NOTHING_WRONG, sentence="", data_errors=(error,), misfit={"record": {"heading": row}},
        probabilities={name.replace("__", " + "): p for name, p in probabilities.items()},
        curves={"record": dataclasses.replace(curves, models=models)},
    )  # fmt: skip


def test_beside_an_error_in_the_data_it_is_said_how_sure_both_are_and_what_calibration_leaves():
    verdict = other_sign(**{"sign:heading": 0.7, "sign:heading__hull_drag": 0.3})
    said = answers(verdict)
    assert said["What is wrong"].endswith("Nothing is wrong beyond the tolerances of the model.")
    assert said["How sure is that"].startswith(
        "That heading_deg has the other sign: as sure as records can make one. That nothing else is wrong: more likely "
        "than not (probability 0.700)."
    )
    assert "misses the heading by 3.5 degree, 8.7 times the noise" in said["What it costs"]
    residual = (
        0.4 * np.random.default_rng(0).normal(size=(2, TIME.size))[1]
    )  # the noise that make_curves draws
    left = report.words.number(float(np.sqrt(np.mean(np.delete(residual, 100) ** 2))), "degree")
    assert f"With numbers bent within their tolerances that is {left}." in said["What it costs"]


def test_what_stands_beside_an_error_in_the_data_is_drawn_without_it():
    verdict = other_sign(**{"sign:heading": 0.7, "sign:heading__hull_drag": 0.3})
    axes = draw_diagnosis(verdict, Title(words="a trial", scenario="fig6"))["evidence"].axes[0]
    names = [" ".join(one.get_text().split()) for one in axes.get_yticklabels()]
    assert names == ["Nothing else is wrong", "The hull has another drag"]


def test_what_is_told_of_nothing_is_the_probability_of_nothing():
    healthy = Verdict(verdict=NOTHING_WRONG, sentence="", probabilities={"none": 0.6, "hull_drag": 0.4})
    assert (
        "That nothing is wrong: more likely than not (probability 0.600)."
        in answers(healthy)["How sure is that"]
    )
    assert report.words.is_reported("none", healthy)
    assert not report.words.is_reported("none", dataclasses.replace(healthy, verdict=UNDECIDED))


def test_a_share_is_told_as_more_or_less_than_in_the_model():
    cause = dataclasses.replace(NAMED.causes[0], parameters={"share": INERTIA})
    assert report.words.cause_in_short(cause) == "The rudder servo lags: 35 % more than in the model."
    less = dataclasses.replace(cause, parameters={"share": dataclasses.replace(INERTIA, value=-0.2)})
    assert report.words.cause_in_short(less).endswith("20 % less than in the model.")


def test_the_terminal_names_the_file_that_is_simulated_with_and_shows_every_error(tmp_path, capsys):
    output_folder = OutputFolder(tmp_path, Path("some where"))
    print_diagnosis(NAMED, output_folder, Console(width=80), scenario="fig6")
    said = capsys.readouterr().out
    assert "subzero simulate fig6 --with 'some where/extended.toml'" in said
    assert " ".join(said.split()).count("nominal extended best rival noise floor") == 1


@pytest.mark.parametrize(("verdict", "wrong", "sure"), [(CALIBRATED, "wants calibration", "could not have shown"),
                                                        (NOTHING_NEAR, "more than noise", "do not fit")])  # fmt: skip
def test_numbers_that_are_far_off_lead_to_a_calibration(verdict, wrong, sure):
    found = Verdict(verdict=verdict, sentence="", detectable=NAMED.detectable, misfit=NAMED.misfit)
    said = answers(found)
    assert wrong in said["What is wrong"]
    assert sure in said["How sure is that"]
    assert "Nothing has to be done" not in said["What to do next"]
    (command,) = [one.command for one in report.summary(found, "zigzag") if one.command]
    assert command.startswith("subzero calibrate RECORDS --scenario zigzag")


def test_an_interrupted_verdict_says_so():
    from dataclasses import replace

    assert "interrupted" in report.words.headline(replace(NAMED, complete=False))


def test_the_table_of_what_can_be_seen_shows_what_would_be_missed_or_mixed_up_worst_first():
    shown = report.tables.detectable(NAMED)
    assert [row[0] for row in shown.rows] == [
        "the water moves",
        "the hull carries another mass of water forward",
    ]
    assert [row[-2:] for row in shown.rows] == [
        ("not seen", "current"),
        ("not told apart", "surge_added_mass"),
    ]
    assert len(report.tables.detectable(NAMED, every=True).rows) == 3


@pytest.mark.long
def test_what_can_be_seen_has_its_unit(plant):
    planted = plant(duration=12.0)
    found = detectability(planted.problem, planted.J)
    rows = {row[-1]: row[2] for row in report.tables.detectable(found, every=True).rows}
    assert rows["rudder_offset"].endswith(" degree")
    assert rows["rudder_lag"].startswith("time constant ")
    assert rows["rudder_lag"].endswith(" s")
    assert not rows["hull_drag"].endswith(" 1"), "a share has no unit"


def test_the_misfit_names_the_command_it_follows():
    row = report.tables.misfit(NAMED.misfit["record"]).rows[1]
    assert row[0] == "heading [degree]"
    assert row[-2:] == ("rudder +0.61 at 0.4 s", "1.2–3.9 s")


def test_json_has_the_promised_keys_and_no_nan():
    found = json.loads(report.json_file.text(NAMED))
    assert found["verdict"] == "cause_named"
    (cause,) = found["causes"]
    assert (cause["id"], cause["probability"]) == ("rudder_lag", 0.97)
    assert cause["parameters"]["time_constant"]["value"] == 0.31
    assert set(cause["parameters"]["time_constant"]) == set(report.json_file.NUMBERS)
    assert found["rivals"][0]["parameters"]["share"]["unit"] == "1"
    assert found["rivals"][1]["id"] == "none"
    assert found["rivals"][1]["discrimination"] is None
    speed = found["gain"]["surge_speed"]
    assert (speed["before"], speed["after"], speed["floor"]) == (0.05, 0.0151, 0.015)
    assert speed["held_out"]["before"] == speed["fitted"]["before"] == 0.05
    assert found["next_trial"]["commands"]["rudder_deg"] == pytest.approx([0.0, 10.0])
    assert found["extended"]["deviations"] == {"rudder_lag": {"time_constant": 0.21}}


def test_json_holds_a_force_and_an_empty_verdict():
    found = json.loads(report.json_file.text(FORCE))
    assert found["unknown"]["axis"] == "X"
    assert found["unknown"]["formula"][0]["feature"] == "u|u|"
    assert list(found["unknown"]["features"]) == ["u|u|", "wave", "time*u2", "u"], "the most probable first"
    empty = json.loads(report.json_file.text(Verdict(verdict=NOTHING_WRONG, sentence="")))
    assert empty["gain"] == {}
    assert empty["next_trial"] is None


def test_the_report_tells_all_of_it():
    figures = draw_diagnosis(NAMED, Title(words="a trial", scenario="fig6"))
    text = report.markdown(NAMED, {"record": "record.csv, fig6"}, tuple(figures))
    for part in (
        "# The cause is named",
        "## What is wrong",
        "rudder\\_lag",
        "![misfit](misfit.png)",
        "## The gain",
        "Seed 7",
    ):
        assert part in text
    assert all(text.count(f"![{name}]({name}.png)") == 1 for name in figures)


def test_the_report_tells_what_is_wrong_before_the_long_table_of_what_could_be_seen():
    text = report.markdown(NAMED, {"record": "record.csv, fig6"})
    at = [line[3:] for line in text.splitlines() if line.startswith("## ")].index
    assert at("What is wrong") < at("The gain") < at("What these records could show")


def test_what_a_file_is_called_cannot_put_markup_into_the_report():
    from markdown_it import MarkdownIt

    text = report.markdown(NAMED, {"record": "<script>alert(1)</script>|*x*&amp;"})
    page = str(MarkdownIt("commonmark").enable("table").render(text))
    assert "&lt;script&gt;alert(1)&lt;/script&gt;|*x*&amp;amp;" in page
    assert "<script" not in page


def test_every_verdict_has_the_figures_that_belong_to_it():
    title = Title(words="a trial", scenario="fig6")
    assert set(draw_diagnosis(NAMED, title)) == {"misfit", "rivals", "evidence", "detectable", "gain"}
    assert set(draw_diagnosis(FORCE, title)) == {"evidence", "missing_force"}
    assert draw_diagnosis(Verdict(verdict=NOTHING_WRONG, sentence=""), title) == {}


def test_the_names_of_a_long_pair_are_within_their_figure():
    pair = "propeller_thrust_slope + sensor_scale:surge_speed"
    verdict = dataclasses.replace(NAMED, probabilities={"rudder_lag": 0.9, pair: 0.1})
    box = draw_diagnosis(verdict, Title(words="a trial", scenario="fig6"))["evidence"].get_tightbbox()
    assert box.x0 >= 0.0


def test_a_drift_has_the_unit_of_its_channel_in_words_figure_and_file():
    assert report.words.unknown(DRIFT.unknown) == (
        "The sensor of the heading drifts as no cause explains: 6 ± 0.98 degree at t = 30 s, where it is largest."
    )
    axes = draw_diagnosis(DRIFT, Title(words="a trial", scenario="fig6"))["missing_force"].axes[0]
    assert "Drift of the heading's sensor" in axes.get_title(loc="left") + "".join(
        t.get_text() for t in axes.texts
    )
    assert axes.get_ylabel() == "[degree]"
    assert json.loads(report.json_file.text(DRIFT))["unknown"]["unit"] == "degree"
    assert "is the extended model" not in report.markdown(DRIFT, {})
    assert "is the extended model" in report.markdown(FORCE, {})
    beside = dataclasses.replace(DRIFT, extended=Extended(deviations={"hull_drag": {"share": 0.4}}))
    assert "is the extended model" in report.markdown(beside, {}), "a cause stands beside the drift"


def test_forces_and_moments_have_their_units():
    units = [dataclasses.replace(FORCE.unknown, axis=axis).unit for axis in "XYZKMN"]
    assert units == ["N"] * 3 + ["N m"] * 3


def test_an_undecided_diagnosis_says_first_what_every_explanation_has():
    """A roll stiffness with p = 0.999 stood in every explanation, and only "undecided" was said."""
    undecided = dataclasses.replace(
        NAMED, verdict=UNDECIDED, causes=(),
        probabilities={"hull_drag + yaw_inertia": 0.55, "rudder_lag + yaw_inertia": 0.44, "none": 0.01},
        rivals=(dataclasses.replace(NAMED.rivals[0], ids=("hull_drag", "yaw_inertia"),
                                    parameters={"yaw_inertia": {"share": INERTIA}}),),
    )  # fmt: skip
    first, *rest = report.summary(undecided)[0].words
    assert first.startswith("In every explanation (probability 0.99")
    assert "inertia" in first
    assert f"{100.0 * abs(INERTIA.value):.3g} %" in first
    assert ("more than in the model" in first) == (INERTIA.value > 0.0)
    assert not any("In every" in line for line in rest)
    apart = dataclasses.replace(undecided, probabilities={"hull_drag": 0.55, "rudder_lag": 0.45})
    assert not any("In every" in line for line in report.summary(apart)[0].words)


def test_a_model_that_names_nothing_says_how_far_its_numbers_are_bent():
    """It said "calibrated within its tolerances, with nothing new in it" with a number at 26 of them."""
    bent = dataclasses.replace(
        NAMED,
        verdict=UNDECIDED,
        deviations={"yaw_damping.share": (0.1, 0.9), "roll_stiffness.share": (-26.0, 1.0)},
    )
    assert r"roll\_stiffness.share is bent farthest, by 26 tolerances" in report.markdown(bent, {})
