"""`Trial.with_changes`: what a trial file could say, in the same units, limits and words."""

from __future__ import annotations

import numpy as np
import pytest

import scenarios

FILE = scenarios.path("fig6").read_text(encoding="utf-8")


def of_file(folder, *edits):
    """Return fig6 with other text; `edits` are pairs of what stands there and what shall."""
    text = FILE
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    path = folder / "fig6.toml"
    path.write_text(text, encoding="utf-8")
    return scenarios.load(path)


def problems(make):
    with pytest.raises(scenarios.ScenarioError) as caught:
        make()
    return caught.value.problems


def test_a_changed_trial_is_what_the_edited_file_says(tmp_path):
    edited = of_file(
        tmp_path,
        ("roll_deg = 0.0 ", "roll_deg = 5.0 "),
        ("[changes]", '[changes]\n"cable.diameter" = 0.003\n'),
    )
    changed = scenarios.load("fig6").with_changes({"start.roll_deg": 5.0, "cable.diameter": 0.003})
    assert changed.start == edited.start
    assert changed.cable == edited.cable
    assert changed.start.roll == pytest.approx(np.radians(5.0))


@pytest.mark.parametrize("value", [-1.0, 2.0, float("nan"), "thick", True, None])
def test_a_value_is_refused_in_the_words_of_the_file(value, tmp_path):
    (alone,) = problems(lambda: scenarios.load("fig6").with_changes({"cable.diameter": value}))
    assert alone.key == "cable.diameter"
    if isinstance(value, float) and value == value:
        written = problems(
            lambda: of_file(tmp_path, ("[changes]", f'[changes]\n"cable.diameter" = {value}\n'))
        )
        assert [(one.why, one.remedy) for one in written] == [(alone.why, alone.remedy)]


def test_all_that_is_wrong_is_said_at_once_with_the_nearest_name():
    wrong = problems(
        lambda: scenarios.load("fig6").with_changes({"cable.diametre": 1.0, "run.duration_s": -1.0})
    )
    assert len(wrong) == 2
    assert "cable.diameter" in wrong[0].remedy


@pytest.mark.parametrize("changes", [["cable.diameter"], None, {1: 2.0}, "cable.diameter"])
def test_what_is_no_mapping_of_names_is_refused(changes):
    (one,) = problems(lambda: scenarios.load("fig6").with_changes(changes))
    assert "no mapping of names to values" in one.why


def test_the_trial_stays_and_the_text_of_the_new_one_says_what_was_changed():
    trial = scenarios.load("fig6")
    changed = trial.with_changes({"cable.diameter": 0.003})
    assert trial.cable["diameter"] == 0.0025
    assert changed.text.endswith("# changed: cable.diameter = 0.003\n")
    assert trial.with_changes({}) == trial
