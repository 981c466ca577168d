"""The page of a diagnosis answers in words, replays measured against simulated, and says texts of users as texts.

Configuration: `fig6` for six seconds, its record made of a run with a rudder that is 3 degrees off its centre. The
ghost's place is held to that run, to the way that it has gone sideways and up or down, which no record here says, and a
centimetre for trapezia every 0.1 s.
"""

from __future__ import annotations

import dataclasses
import math
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import subzero
from subzero.cli.write_diagnosis import page_of_diagnosis, replayed
from subzero.diagnosis import (
    CAUSE_NAMED,
    DATA_ERROR,
    OUT_OF_CATALOGUE,
    UNDECIDED,
    Curves,
    Estimate,
    Extended,
    FoundError,
    Logged,
    Misfit,
    Rival,
    Setting,
    Verdict,
    all_effects,
    apply_extended,
)
from subzero.diagnosis import (
    NamedCause as Cause,
)
from subzero.diagnosis import (
    UnknownForce as Unknown,
)
from subzero.figures.diagnosis import draw_diagnosis
from subzero.figures.style import Title
from subzero.model import Model
from subzero.page import browser
from subzero.records.record import Record

OFF = {"rudder_offset": {"angle": 3.0}}
EVIL = "<script>window.acted = 1</script> $x^2$ [bold]ß漢字[/bold] &amp; " * 5
ANGLE = Estimate(value=3.0, low=2.9, high=3.1, unit="degree", nominal=0.0, deviation=3.0, deviation_sd=0.05)


@pytest.fixture(scope="module")
def truth() -> Any:
    """Return the run that was measured."""
    trial = dataclasses.replace(subzero.load_scenario("fig6"), duration=6.0, rtol=0.0)
    setting = Setting(trial=trial, model=Model.of(trial))
    true = apply_extended(Extended(deviations=OFF), setting, all_effects())
    return setting, subzero.simulate(true.trial, model=true.model)


@pytest.fixture(scope="module")
def logged(truth: Any) -> Logged:
    setting, true = truth
    time = np.arange(0.0, 6.01, 0.1)
    names = ("surge_speed", "heading", "pitch", "roll_angle", "depth")
    values = {name: np.interp(time, true["time"], true[name]) for name in names}
    values["heading"][7] = np.nan
    values["depth"][20] += 5.0
    return Logged(record=Record(source=EVIL, time=time, values=values), setting=setting, name="dive <b>3</b>")


@pytest.fixture(scope="module")
def verdict(logged: Logged) -> Verdict:
    used = {name: np.isfinite(one) for name, one in logged.record.values.items()}
    used["depth"][20] = False
    models = {"nominal": logged.record.values, "extended": logged.record.values}
    curves = Curves(time=logged.record.time, measured=logged.record.values, models=models, used=used)
    row = Misfit(rmse=0.1, nrmse=4.0, fit_percent=80.0, bias=0.0, whiteness_p=0.1, command_correlation={}, windows=(),
                 noise_sd=0.02, noise_slow=0.01, noise_time=1.0, resolution=0.05, outliers=1, gaps=1)  # fmt: skip
    return Verdict(
        verdict=CAUSE_NAMED, sentence="", curves={logged.name: curves}, extended=Extended(deviations=OFF),
        causes=(Cause(id="rudder_offset", sentence="the rudder is off its centre", probability=0.97,
                      parameters={"angle": ANGLE}),),
        rivals=(Rival(ids=(), sentence="nothing is wrong", probability=0.03, discrimination=40.0),),
        probabilities={"rudder_offset": 0.97, "none": 0.03},
        misfit={logged.name: dict.fromkeys(logged.record.values, row)},
        notes=("the <i>noise</i> is 2.8 times that of a usual sensor.",),
    )  # fmt: skip


def run(setting: Setting) -> Any:
    return subzero.simulate(setting.trial, model=setting.model, later=setting.later)


def page_of(verdict: Verdict, logged: Logged) -> str:
    figures = draw_diagnosis(verdict, Title(words=EVIL, scenario="fig6"))
    return page_of_diagnosis(verdict, [logged], figures, command="subzero diagnose 'a <b>.csv'", run=run)


class Reader(HTMLParser):
    """Collects tags and the text outside scripts."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.words: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        assert not any(name.startswith("on") for name, _ in attrs)

    def handle_data(self, data: str) -> None:
        if self.tags[-1:] not in (["script"], ["style"]):
            self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


@pytest.mark.long
def test_it_answers_what_somebody_asks_who_was_not_there(verdict: Verdict, logged: Logged) -> None:
    read = Reader(page_of(verdict, logged))
    for said in (
        "The rudder is off its centre: angle 3 degree, where the model has 0 degree.",
        "Very sure (probability 0.970).",
        "What comes next: nothing is wrong (probability 0.030); these records can tell the two apart (D 40).",
        "Look at the fins, their servos and linkages.",
        "subzero simulate fig6 --with extended.toml",
        "A trial with other commands: the extended model has to explain it without another fit.",
    ):
        assert said in read.text
    assert "rudder_offset" not in read.text, (
        "the named cause has no id in any text, and no table here lists it"
    )


@pytest.mark.long
def test_texts_of_users_are_text(verdict: Verdict, logged: Logged) -> None:
    read = Reader(page_of(verdict, logged))
    assert read.tags.count("script") == 3  # data, plots, player
    assert not {"b", "i"} & set(read.tags)
    assert "<script>window.acted = 1</script> $x^2$ [bold]ß漢字[/bold] &amp;" in read.text
    assert "dive <b>3</b>: 61 samples, 5 channels" in read.text
    assert "the <i>noise</i> is 2.8 times" in read.text


def test_the_replay_has_the_extended_model_solid_and_simulated_and_measured_as_ghosts(
    verdict: Verdict, logged: Logged, truth: Any
) -> None:
    actors, said = replayed(verdict, logged, run)
    assert [(one.name, one.ghost) for one in actors] == [
        ("extended model", False), ("simulated", True), ("measured", True),
    ]  # fmt: skip
    assert "that is reckoned from its speed and attitude" in said
    _, true = truth
    extended, simulated, measured = (one.run for one in actors)
    np.testing.assert_allclose(extended["heading"], true["heading"], atol=1e-9)
    assert abs(float(simulated["heading"][-1]) - float(true["heading"][-1])) > 2.0
    unseen = float(np.trapezoid(np.hypot(true["sway_speed"], true["heave_speed"]), true["time"]))
    assert unseen < 0.3, "or this test says little of a way of 4 m"
    for name in ("north", "east"):
        there = np.interp(measured["time"], true["time"], true[name])
        np.testing.assert_allclose(measured[name], there, atol=unseen + 0.01)
    depth = np.interp(measured["time"], true["time"], true["depth"])
    np.testing.assert_allclose(measured["depth"], depth, atol=0.02, err_msg="with its outlier left out")
    assert float(measured["north"][0]) == float(true["north"][0])


def test_of_what_is_undecided_the_most_probable_model_is_replayed_as_it_was_fitted(
    verdict: Verdict, logged: Logged
) -> None:
    """Not with the numbers of a vehicle with nothing wrong, which had to bend without the cause."""
    first = Rival(ids=("rudder_offset",), sentence="the rudder is off its centre", probability=0.7,
                  discrimination=math.nan, extended=Extended(deviations=OFF))  # fmt: skip
    bent = Extended(calibration={"rudder_lift_slope": {"share": 0.5}})
    reported = dataclasses.replace(verdict, verdict=UNDECIDED, causes=(), rivals=(first,), extended=bent)
    (found, *_), said = replayed(reported, logged, run)
    (fitted, *_), _ = replayed(verdict, logged, run)
    assert found.name == "most probable model"
    assert "Solid: the most probable model." in said
    np.testing.assert_array_equal(found.run["heading"], fitted.run["heading"])


def test_a_record_with_errors_in_its_data_is_replayed_as_it_is_once_they_are_put_right(
    verdict: Verdict, logged: Logged
) -> None:
    record = logged.record
    wrong = dataclasses.replace(record, values=record.values | {"heading": -record.values["heading"]})
    right = Curves(time=record.time, measured=record.values, models={}, used={})
    error = FoundError(id="sign:heading", record=logged.name, columns=("heading_deg",), sentence="heading_deg has the "
                       "other sign", remedy="change its sign", probability=1.0)  # fmt: skip
    reported = dataclasses.replace(verdict, verdict=DATA_ERROR, then=verdict.verdict, data_errors=(error,),
                               curves={logged.name: right})  # fmt: skip
    actors, said = replayed(reported, dataclasses.replace(logged, record=wrong), run)
    as_it_is, _ = replayed(verdict, logged, run)
    assert actors[2].name == as_it_is[2].name == "measured"
    assert "its errors put right" in said
    np.testing.assert_allclose(actors[2].run["heading"][:3], as_it_is[2].run["heading"][:3], atol=1e-9)


def test_a_record_that_does_not_say_where_it_went_has_no_ghost(verdict: Verdict, logged: Logged) -> None:
    values = {name: one for name, one in logged.record.values.items() if name != "heading"}
    blind = dataclasses.replace(logged, record=dataclasses.replace(logged.record, values=values))
    actors, said = replayed(verdict, blind, run)
    assert [one.name for one in actors] == ["extended model", "simulated"]
    assert "White" not in said


@pytest.mark.long
def test_an_interrupted_diagnosis_has_its_page_without_a_replay(verdict: Verdict, logged: Logged) -> None:
    read = Reader(page_of(dataclasses.replace(verdict, complete=False), logged))
    assert "canvas" not in read.tags
    assert "this is as far as it came" in read.text


@pytest.mark.long
def test_what_acts_is_said_as_what_it_does(verdict: Verdict, logged: Logged) -> None:
    time = np.linspace(0.0, 6.0, 13)
    rolls = Unknown(axis="K", time=time, force=-0.3 * (time > 3.0), band=np.full(13, 0.02))
    outside = dataclasses.replace(
        verdict, verdict=OUT_OF_CATALOGUE, causes=(), unknown=rolls, extended=Extended(),
        sentence="Something acts on K.", probabilities={"unknown_force:K": 0.98, "none": 0.02},
    )  # fmt: skip
    read = Reader(page_of(outside, logged))
    assert "Something rolls the hull to port, and no cause of the catalogue explains it" in read.text
    assert "with a moment of -0.3 ± 0.039 N m at t = 3.5 s" in read.text
    assert "acts on K" not in read.text


@pytest.mark.long
@pytest.mark.skipif(browser.installed() is None, reason="needs Debian's chromium and chromium-driver")
def test_in_a_browser_the_ghosts_are_where_their_runs_and_the_record_say(
    verdict: Verdict, logged: Logged, tmp_path: Path
) -> None:
    """One box to tick for what was measured, one value of it beside a plot, no error, and nothing of a user acts."""
    page = tmp_path / "report.html"
    page.write_text(page_of(verdict, logged), encoding="utf-8")
    actors, _ = replayed(verdict, logged, run)
    with browser.opened(page) as driver:
        shown = driver.execute_script("subzero.seek(4.0); return subzero.shown().places")
        assert {"extended model", "simulated", "measured"} <= set(shown)
        for one in actors:
            place = [float(one.run[name].interp(time=4.0)) for name in ("north", "east", "depth")]
            np.testing.assert_allclose(shown[one.name], place, atol=2e-3, err_msg=one.name)
        boxes = [label.text.strip() for label in driver.find_elements("css selector", "#actors label")]
        assert boxes == ["extended model", "simulated", "measured"]
        titles = [one.text for one in driver.find_elements("css selector", ".plot figcaption")]
        heading = next(at for at, words in enumerate(titles) if words.startswith("heading"))
        values = driver.find_elements("css selector", ".plot")[heading].find_elements(
            "css selector", "output"
        )
        assert [one.get_attribute("title") for one in values] == ["extended model", "simulated", "measured"]
        assert driver.get_log("browser") == []
        assert driver.execute_script("return window.acted === undefined")
