"""The figures that judge a diagnosis are themselves right: on results made by hand, whose figures are known."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.diagnosis import outside, scores


@pytest.mark.parametrize(("good", "met", "near"), [(20, True, True), (19, False, True), (10, False, False)])
def test_a_share_is_near_its_target_only_if_its_interval_reaches_it(good, met, near):
    cases = [{"good": i < good} for i in range(20)]  # 19 of 20: 75 … 99.9 %; 10 of 20: 27 … 73 %
    score = scores.share("words", cases, lambda case: case["good"], "≥ 97 %", least=0.97)
    assert (score.met, score.near) == (met, near)


def test_a_share_that_is_too_large_is_judged_from_above():
    cases = [{"good": i < 399} for i in range(400)]
    score = scores.share("words", cases, lambda case: case["good"], "93 … 98 %", least=0.93, most=0.98)
    assert (score.met, score.near) == (False, False)  # 98.6 … 100 %


@pytest.mark.parametrize(("right", "error"), [(9, 0.0), (5, 0.4), (10, 0.1)])
def test_calibration_error_is_the_gap_between_stated_and_right(right, error):
    stated, is_right = np.full(10, 0.9), 1.0 * (np.arange(10) < right)
    assert scores.calibration_error(stated, is_right) == pytest.approx(error, abs=1e-12)


def test_chance_makes_of_calibration_what_the_binomial_law_says():
    expected = np.sqrt(2.0 / np.pi * 0.55 * 0.45 / 400)  # mean of |x|, x ~ N(0, p (1 − p)/n)
    found = np.mean(scores.by_chance(np.full(400, 0.55)))
    assert found == pytest.approx(expected, rel=0.1)  # 1000 draws know it to 2.4 %


@pytest.mark.parametrize(
    ("strange", "first", "verdict", "right"),
    [
        ("snag", "unknown_force:X", "outside_catalogue", True),
        ("snag", "unknown_force:X", "undecided", False),
        ("snag", "none", "nothing_wrong", False),
        ("weed", "fouling@3.1", "cause_named", True),  # the cause of the catalogue that comes close to weed
        ("snag", "fouling@3.1", "cause_named", False),
    ],
)
def test_a_force_outside_the_catalogue_is_right_if_it_is_called_so_or_its_close_cause(
    strange, first, verdict, right
):
    result = {"strange": strange, "probabilities": {first: 0.9, "other": 0.1}, "verdict": verdict}
    assert outside.is_right(result) is right


def test_the_kept_numbers_of_records_are_drawn_again():
    numbers = {case.number: case.index for case in outside.drawn(91, 44)}
    assert (len(numbers), numbers[0], numbers[10]) == (44, 6, 149)
