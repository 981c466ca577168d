"""The figures of a diagnosis show what its text and its file say: the same explanations, in the same order, as large.

Verdicts are those that the benchmarks keep (`benchmarks/diagnosis/kept`), with their probabilities as
they were found; every one is told in words, written as JSON and drawn, and what is drawn is read back.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.text import Text

import subzero
from subzero.diagnosis import (
    CAUSE_NAMED,
    NOTHING_WRONG,
    OUT_OF_CATALOGUE,
    UNDECIDED,
    Curves,
    Misfit,
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
from subzero.figures.diagnosis import draw_diagnosis, evidence
from subzero.figures.style import BLUE, Title
from subzero.synthetic.challenge import challenge

KEPT = Path(__file__).parents[2] / "benchmarks" / "diagnosis" / "kept"
KINDS = (CAUSE_NAMED, NOTHING_WRONG, OUT_OF_CATALOGUE, UNDECIDED)
TITLE = Title(words="a trial", scenario="fig6")
TIME = np.linspace(0.0, 9.9, 100)


def kept(count):
    """Return so many challenges of all kinds, evenly out of those that are kept."""
    rows = [
        json.loads(line)
        for name in ("world_12001", "onsets_3", "outside_91")
        for line in (KEPT / f"{name}.jsonl").read_text(encoding="utf-8").splitlines()
    ]
    rows = [row for row in map(as_said, rows) if row]
    return rows[:: max(1, len(rows) // (count - 1))][-count:]


def as_said(row):
    """Return the verdict, the probabilities and the causes of a kept record; None where data are accused."""
    said = row.get("probabilities") or row.get("listed")
    if not said or row["verdict"] not in KINDS:
        return None
    first = max(said, key=lambda name: said[name])
    name, _, start = first.partition("@")
    named = row["verdict"] == CAUSE_NAMED
    causes = [{"id": one, "start": float(start) if start else None} for one in name.split(" + ") if named]
    return {"index": row["index"], "verdict": row["verdict"], "probabilities": said, "causes": causes}


def verdict_of(row):
    """Return what a diagnosis said, as a value."""
    probabilities = row["probabilities"]
    first = max(probabilities, key=lambda name: probabilities[name])
    unknown = None
    if row["verdict"] == OUT_OF_CATALOGUE:
        axis = first.partition(":")[2]
        unknown = Unknown(axis=axis, time=TIME, force=np.sin(TIME), band=np.ones(TIME.size))
    causes = [
        Cause(id=one["id"], sentence=report.words.explanation(one["id"]), probability=probabilities[first],
              parameters={}, start_time=one.get("start"))
        for one in row["causes"]
    ]  # fmt: skip
    rivals = [
        Rival(ids=tuple(name.split(" + ")) if name != "none" else (), sentence=report.words.explanation(name),
              probability=p, discrimination=5.0)
        for name, p in probabilities.items() if name != first or row["verdict"] == UNDECIDED
    ]  # fmt: skip
    return Verdict(
        verdict=row["verdict"],
        sentence=" and ".join(one.sentence for one in causes),
        causes=tuple(causes),
        rivals=tuple(rivals),
        probabilities=probabilities,
        unknown=unknown,
    )


def drawn(verdict):
    """Return what the figure shows: (words, probability, colour) from the top."""
    plain = evidence(verdict, TITLE).axes[0]
    names = [" ".join(label.get_text().split()) for label in plain.get_yticklabels()]
    bars = [(bar.get_width(), bar.get_facecolor()) for bar in plain.patches]
    assert plain.yaxis_inverted()
    return [(name, *bar) for name, bar in zip(names, bars, strict=True)]


def check(row):
    verdict = verdict_of(row)
    shown, reported = drawn(verdict), report.json_file.mapping(verdict)
    ranked = sorted(row["probabilities"].items(), key=lambda item: -item[1])
    for (name, width, _), (hypothesis, p) in zip(shown, ranked, strict=False):
        assert width == p == reported["probabilities"][hypothesis]
        assert name.lower() == reported["explanations"][hypothesis].lower()
    said = {one.question: " ".join(one.words).lower() for one in report.summary(verdict)}
    assert said == {one["question"]: " ".join(one["words"]).lower() for one in reported["summary"]}
    names = [name.lower() for name, *_ in shown]
    blue = [name for name, (_, _, colour) in zip(names, shown, strict=True) if colour[:3] == rgb(BLUE)]
    if verdict.verdict == UNDECIDED:
        assert not blue
        assert f"these records cannot tell apart: {names[0]} (" in said["What is wrong"]
    if verdict.verdict in (CAUSE_NAMED, OUT_OF_CATALOGUE):
        assert blue == names[:1]
        wrong = since(said["What is wrong"].replace(" as no cause explains", ""))
        for one in ranked[0][0].split(" + "):
            assert since(report.words.explanation(one, report.words.sentences(verdict)).lower()) in wrong
        if len(names) > 1:
            assert f"what comes next: {names[1]} (" in said["How sure is that"]


def since(text):
    """Return a text that says once and alike when a cause began."""
    text = re.sub(r"^from ([\d.]+) s on (.*)$", r"\2, since t = \1", text)
    return re.sub(r"since t = ([\d.]+)", lambda found: f"since {float(found[1]):.3g}", text)


def rgb(colour):
    return tuple(int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5))


@pytest.mark.parametrize("row", kept(20), ids=lambda row: f"{row['verdict']}_{row['index']}")
def test_text_file_and_figure_agree(row):
    check(row)


@pytest.mark.slow
def test_text_file_and_figure_agree_over_two_hundred_challenges():
    rows = kept(200)
    assert len(rows) == 200
    assert len({row["verdict"] for row in rows}) == 4
    for row in rows:
        check(row)


@pytest.mark.slow
def test_what_began_in_mid_trial_is_drawn_where_it_is_the_most_probable():
    """A drum that rubs from 17 s on looks much like a cable that drags from there on: both are told, and both drawn."""
    hidden = challenge("fig6", 27)
    verdict = subzero.diagnose(hidden.record, "fig6")
    first, *_ = sorted(verdict.probabilities, key=lambda name: -verdict.probabilities[name])
    assert "@" in first, "or this test says nothing"
    figures = draw_diagnosis(verdict, TITLE)
    assert labels(figures["misfit"])[-1].replace("\n", " ") == f"if {report.words.explanation(first)}"
    (shown,) = verdict.curves.values()
    left = shown.measured["heading"] - shown.models[f"rival: {first}"]["heading"]
    assert np.std(left[shown.used["heading"]]) < 1.2 * verdict.misfit["record"]["heading"].noise_sd


def curves(**models):
    heading = np.sin(TIME)
    sizes = {name.replace("__", ": "): size for name, size in {"nominal": 1.5, **models}.items()}
    return Curves(time=TIME, measured={"heading": heading}, used={"heading": np.ones(TIME.size, bool)},
                  models={name: {"heading": size * heading} for name, size in sizes.items()})  # fmt: skip


def undecided(probabilities, shown, **misfit):
    rivals = [
        Rival(ids=(name,) if name != "none" else (), sentence=report.words.explanation(name), probability=p,
              discrimination=1.0)
        for name, p in probabilities.items()
    ]  # fmt: skip
    return Verdict(verdict=UNDECIDED, sentence="", rivals=tuple(rivals), probabilities=probabilities,
                   curves={"record": shown}, misfit={"record": misfit})  # fmt: skip


def labels(figure, panel=0):
    return [text.get_text() for text in figure.axes[panel].get_legend().get_texts()]


def test_nothing_is_wrong_comes_first_where_it_is_the_most_probable():
    shown = curves(tolerance=1.01, rival__hull_drag=1.1)
    figures = draw_diagnosis(undecided({"none": 0.5, "hull_drag": 0.4}, shown), TITLE)
    assert labels(figures["misfit"])[-1] == "if nothing is wrong"
    assert labels(figures["rivals"])[1:] == ["if nothing is wrong", "if the hull has another drag"]
    other = draw_diagnosis(undecided({"hull_drag": 0.5, "none": 0.4}, shown), TITLE)
    assert labels(other["misfit"])[-1] == "if the hull has another drag"


def test_residuals_are_those_of_the_curves_beside_noise_and_the_step_of_the_sensor():
    row = Misfit(rmse=0.4, nrmse=20.0, fit_percent=0.0, bias=0.0, whiteness_p=0.0, command_correlation={},
                 windows=(), noise_sd=0.02, noise_slow=0.0, noise_time=1.0, resolution=0.03, outliers=0,
                 gaps=0)  # fmt: skip
    verdict = undecided({"hull_drag": 0.9, "yaw_inertia": 0.1}, curves(rival__hull_drag=0.99), heading=row)
    figure = draw_diagnosis(verdict, TITLE)["misfit"]
    right = figure.axes[1]
    titles = [title for one in figure.axes for title in one.get_children() if isinstance(title, Text)]
    assert all(title.get_window_extent().x1 <= figure.bbox.x1 for title in titles), "none is cut off"
    dots = [one.get_ydata() for one in right.get_lines() if one.get_marker() == "o"]
    np.testing.assert_allclose(dots, [-0.5 * np.sin(TIME), 0.01 * np.sin(TIME)], atol=1e-12)
    low, high = right.transData.inverted().transform(right.patches[0].get_window_extent().get_points())[:, 1]
    np.testing.assert_allclose((low, high), (-1.96 * 0.02, 1.96 * 0.02), rtol=1e-6)
    steps = sorted(one.get_ydata()[0] for one in right.get_lines() if len(set(one.get_ydata())) == 1)
    np.testing.assert_allclose(steps, [-0.015, 0.0, 0.015])
    assert right.get_ylim()[1] < 0.1, "what is left of the best model and the noise are seen"
    assert "simulated: off by as much as 0.5 degree" in [text.get_text() for text in right.texts]
