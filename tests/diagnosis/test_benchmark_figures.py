"""The figures that judge the diagnosis are themselves right: on results made by hand, whose figures are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks.diagnosis import scores
from benchmarks.diagnosis.figures_of import rows


def a_result(truth: dict[str, float], said: dict[str, float], **more: Any) -> dict[str, Any]:
    """Return a result: cause → D of what is hidden, hypothesis → probability of what is said."""
    kind = ("healthy", "single", "pair")[len(truth)]
    return {"kind": kind, "strange": "", "truth": {name: [1.0] for name in truth}, "D": truth, "probabilities": said,
            "verdict": "undecided", "causes": [], "set": list(said), **more}  # fmt: skip


def named(cause: str, p: float) -> dict[str, Any]:
    """Return a cause as results have it, without parameters."""
    return {"causes": [{"id": cause, "p": p, "parameters": {}}], "verdict": "cause_named"}


@pytest.mark.parametrize(
    ("truth", "said", "right", "as_told"),
    [
        ({"a": 20.0}, "a", True, True),
        ({"a": 20.0}, "b", False, False),
        ({}, "none", True, True),
        ({"a": 20.0, "b": 3.0}, "a + b", True, True),
        ({"a": 20.0, "b": 3.0}, "a", False, True),  # b cannot be seen: a is meant with or without it
        ({"a": 20.0, "b": 3.0}, "b", False, False),  # a can be seen
        ({"a": 20.0, "b": 30.0}, "a", False, False),
        ({"a": 20.0, "b": 3.0}, "a + c", False, False),
    ],
)
def test_first_hypothesis_is_right_only_if_it_is_the_truth(truth, said, right, as_told):
    one = a_result(truth, {said: 0.9, "other": 0.1})
    assert (scores.is_right(one), scores.is_right_as_told(one)) == (right, as_told)


def test_strange_force_is_right_if_it_is_flagged_whatever_comes_first():
    said = {"unknown_force:X": 0.9}
    assert scores.is_right(a_result({}, said, strange="snag", verdict="outside_catalogue"))
    assert not scores.is_right(a_result({}, said, strange="snag", verdict="undecided"))


def test_only_a_wrong_name_that_is_certain_counts_as_wrongly_sure():
    truth = {"a": 20.0}
    assert scores.wrongly_sure(a_result(truth, {"b": 0.97}, **named("b", 0.97)))
    assert not scores.wrongly_sure(a_result(truth, {"b": 0.9}, **named("b", 0.9)))
    assert not scores.wrongly_sure(a_result(truth, {"a": 0.97}, **named("a", 0.97)))


@pytest.mark.parametrize(("good", "met", "near"), [(20, True, True), (19, False, True), (10, False, False)])
def test_a_share_is_near_its_target_only_if_its_interval_reaches_it(good, met, near):
    cases = [{"good": i < good} for i in range(20)]  # 19 of 20: 75 … 99.9 %; 10 of 20: 27 … 73 %
    score = scores.share("words", cases, lambda one: one["good"], "≥ 97 %", least=0.97)
    assert (score.met, score.near) == (met, near)


def test_a_share_that_is_too_large_is_judged_from_above():
    cases = [{"good": i < 399} for i in range(400)]
    score = scores.share("words", cases, lambda one: one["good"], "93 … 98 %", least=0.93, most=0.98)
    assert (score.met, score.near) == (False, False)  # 98.6 … 100 %


@pytest.mark.parametrize(("right", "error"), [(9, 0.0), (5, 0.4), (10, 0.1)])
def test_calibration_error_is_the_gap_between_stated_and_right(right, error):
    reported = [a_result({"a": 20.0}, {"a" if i < right else "b": 0.9}) for i in range(10)]
    assert scores.calibration(reported)[1] == pytest.approx(error, abs=1e-12)


def test_chance_makes_of_calibration_what_the_binomial_law_says():
    expected = np.sqrt(2.0 / np.pi * 0.55 * 0.45 / 400)  # mean of |x|, x ~ N(0, p (1 − p)/n)
    found = np.mean(scores.by_chance(np.full(400, 0.55)))
    assert found == pytest.approx(expected, rel=0.1)  # 1000 draws know it to 2.4 %


def test_standard_deviations_let_expect_the_median_of_a_normal_size():
    assert np.median(scores.expected([2.0])) == pytest.approx(2.0 * 0.6745, rel=0.02)


def test_figures_tell_a_missed_single_from_a_false_alarm():
    said_a, said_none = {"a": 0.99}, {"none": 0.9}
    hit, miss = a_result({"a": 20.0}, said_a, **named("a", 0.99)), a_result({"a": 20.0}, said_none)
    alarm, calm = a_result({}, said_a, **named("a", 0.99)), a_result({}, said_none, verdict="nothing_wrong")
    for one in (hit, miss, alarm, calm):
        one |= {"score": ["a", False], "selection": ["a"]}
    found = {score.words: score.value for score in rows([hit, miss, alarm, calm])}
    assert found["singles, D ≥ 16: right name first"] == "50.0 %"
    assert found["healthy: false names"] == "50.0 %"
    assert found["all cases: a wrong name with p ≥ 0.95"] == "25.0 %"
    assert found["… that its stated probabilities let expect"] == "94.5 %"  # (0.99 + 0.9)/2


def sudden(said, **more):
    """Return the result of a cause `a` that begins at 12.3 s, with D 20."""
    return a_result({"a": 20.0}, said, **{"kind": "sudden", "starts": {"a": 12.3}, **more})


def test_what_begins_in_mid_trial_is_right_only_if_that_is_said_whenever_it_began():
    assert scores.is_right(sudden({"a@12.41": 0.9}))
    assert not scores.is_right(sudden({"a": 0.9}))
    assert not scores.is_right(sudden({"b@12.3": 0.9}))
    assert not scores.is_right(a_result({"a": 20.0}, {"a@2": 0.9}))


def test_a_name_is_wrong_if_it_is_wrong_in_being_from_then_on():
    late = {"causes": [{"id": "a", "p": 0.97, "start": 12.4, "parameters": {}}], "verdict": "cause_named"}
    assert not scores.wrongly_sure(sudden({"a@12.4": 0.97}, **late))
    assert scores.wrongly_sure(sudden({"a": 0.97}, **named("a", 0.97)))
    assert scores.wrongly_sure(a_result({"a": 20.0}, {"a@12.4": 0.97}, **late))


def test_figures_of_what_begins_in_mid_trial():
    late = {"causes": [{"id": "a", "p": 0.97, "start": 12.8, "parameters": {"x": [1.1, 0.8, 1.4, 0.15]}}]}
    reported = [sudden({"a@12.8": 0.97}, **late), sudden({"b@3": 0.6, "a@12": 0.4}), sudden({"none": 0.9})]
    found = {
        score.words: score.value
        for score in rows(reported)
        if "mid-trial" in score.words or "when it" in score.words
    }
    assert found["from mid-trial on, D ≥ 16: right name first"] == "33.3 %"
    assert found["from mid-trial on: the 95 % set holds the truth"] == "66.7 %"
    assert found["… error of when it began"] == "0.50 s"
