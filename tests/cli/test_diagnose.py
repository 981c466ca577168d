"""What ``subzero diagnose`` and ``--with`` do around the engine, which is on rails: files, words, mistakes, Ctrl-C."""

from __future__ import annotations

import json
import re
import resource
import sys
import types
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

import scenarios
from subzero.cli.app import FINE, INTERRUPTED, MISTAKE, main
from subzero.diagnosis import (
    CAUSE_NAMED,
    NOTHING_WRONG,
    OUT_OF_CATALOGUE,
    Curves,
    Detectability,
    Estimate,
    Extended,
    Verdict,
)
from subzero.diagnosis import (
    NamedCause as Cause,
)
from subzero.diagnosis import (
    UnknownForce as Unknown,
)

TIME = np.arange(0.0, 10.01, 0.1)
SPEED = 1.1 * (1.0 - np.exp(-TIME / 2.0))
LAG = Estimate(value=0.31, low=0.23, high=0.39, unit="s", nominal=0.1, deviation=0.21, deviation_sd=0.04)
ROWS = (
    Detectability(id="current", signal=2.0, smallest={"north": 0.3}, rival="cable_tangential_drag",
                  discrimination=0.2, cosine=0.998),
)  # fmt: skip
NAMED = Verdict(
    verdict=CAUSE_NAMED,
    sentence="The rudder servo lags.",
    causes=(Cause(id="rudder_lag", sentence="the rudder servo lags", probability=0.97,
                  parameters={"time_constant": LAG}),),
    probabilities={"rudder_lag": 0.97, "none": 0.03},
    detectable=ROWS,
    extended=Extended(deviations={"rudder_lag": {"time_constant": 0.21}}),
    curves={"record": Curves(time=TIME, measured={"surge_speed": SPEED}, used={},
                             models={"nominal": {"surge_speed": SPEED}})},
)  # fmt: skip


@pytest.fixture
def engine(monkeypatch, tmp_path):
    """An engine that knows its answer, and a simulation on rails; gives what it was asked with."""
    asked = {}

    def diagnose(records, *, progress, seen=lambda rows: None, **more):
        asked.update(more, records=records)
        seen(ROWS)
        progress(0.5, "trying rudder_lag")
        answer = asked.get("answer", NAMED)
        if isinstance(answer, BaseException):
            raise answer
        return answer

    def respond(setting, times, channels):
        return dict.fromkeys(channels, np.interp(times, TIME, SPEED))

    monkeypatch.setattr("subzero.diagnosis.api.diagnose_trials", diagnose)
    monkeypatch.setattr("subzero.diagnosis.inference.simulator.respond", respond)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    rows = "\n".join(f"{t:.1f},{v:.5f}" for t, v in zip(TIME, SPEED, strict=True))
    (tmp_path / "record.csv").write_text(f"time_s,surge_speed_m_s\n{rows}\n")
    return asked


@pytest.mark.long
def test_a_diagnosis_tells_the_verdict_then_what_cannot_be_told_apart_and_leaves_all_its_files(
    engine, tmp_path, capsys
):
    assert main(["diagnose", "record.csv", "--scenario", "fig6", "--out", "found", "--seed", "3"]) == FINE
    said = capsys.readouterr().out
    assert said.index("1 of 1 causes") < said.index("The cause is named") < said.index("time constant 0.31 s")
    assert said.index("time constant 0.31 s") < said.index("current")
    assert "not seen" in said
    left = {path.name for path in (tmp_path / "found").iterdir()}
    assert left == {"diagnosis.json", "extended.toml", "report.md", "report.html", "misfit.png", "evidence.png",
                    "detectable.png"}  # fmt: skip
    found = json.loads((tmp_path / "found/diagnosis.json").read_text())
    assert found["causes"][0]["id"] == "rudder_lag"
    assert found["records"]["record"]["channels"] == ["surge_speed"]
    assert "time_constant_s = 0.21" in (tmp_path / "found/extended.toml").read_text()
    assert (engine["seed"], engine["budget"]) == (3, "full")
    assert engine["records"][0].setting.trial.duration == pytest.approx(10.0)


@pytest.mark.long
@pytest.mark.parametrize(
    ("axis", "unit"), [("X", "N"), ("N", "N m"), ("heading", "degree"), ("surge_speed", "m/s")]
)
def test_what_is_outside_the_catalogue_is_written_and_drawn_force_or_drift(engine, tmp_path, axis, unit):
    unknown = Unknown(axis=axis, time=TIME, force=0.1 * TIME, band=0.05 + 0.0 * TIME)
    engine["answer"] = replace(
        NAMED, verdict=OUT_OF_CATALOGUE, causes=(), unknown=unknown, extended=Extended()
    )
    assert main(["diagnose", "record.csv", "--scenario", "fig6", "--out", "found"]) == FINE
    assert json.loads((tmp_path / "found/diagnosis.json").read_text())["unknown"]["unit"] == unit
    assert (tmp_path / "found/missing_force.png").stat().st_size > 1000


def test_a_screen_is_the_first_look(engine):
    assert main(["diagnose", "record.csv", "--scenario", "fig6", "--screen"]) == FINE
    assert engine["budget"] == "screen"


@pytest.mark.long
def test_effects_of_the_users_own_are_given_to_the_engine_and_copied_beside_the_model(engine, tmp_path):
    (tmp_path / "mine.py").write_text(
        "from subzero.diagnosis.hypothesis.effect import Effect\n"
        "EFFECTS = [Effect(id='mine', sentence='mine', slot='hull', parameters=(), apply=lambda s: s)]\n"
    )
    assert (
        main(["diagnose", "record.csv", "--scenario", "fig6", "--effects", "mine.py", "--out", "found"])
        == FINE
    )
    assert [one.id for one in engine["effects"]] == ["mine"]
    assert (tmp_path / "found/mine.py").exists()
    assert 'effects_file = "mine.py"' in (tmp_path / "found/extended.toml").read_text()


@pytest.mark.long
def test_ctrl_c_keeps_what_there_is(engine, tmp_path, capsys):
    engine["answer"] = replace(NAMED, complete=False)
    assert main(["diagnose", "record.csv", "--scenario", "fig6", "--out", "found"]) == INTERRUPTED
    said = capsys.readouterr()
    assert "what it has is written" in said.err
    assert "interrupted: this is as far as it came" in said.out
    assert json.loads((tmp_path / "found/diagnosis.json").read_text())["complete"] is False


def test_ctrl_c_before_there_is_anything_writes_nothing(engine, tmp_path, capsys):
    engine["answer"] = KeyboardInterrupt()
    assert main(["diagnose", "record.csv", "--scenario", "fig6", "--out", "found"]) == INTERRUPTED
    assert "nothing was written" in capsys.readouterr().err
    assert not (tmp_path / "found").exists()


def test_a_healthy_record_is_told_as_one(engine, capsys):
    engine["answer"] = Verdict(verdict=NOTHING_WRONG, sentence="All is within tolerance.", detectable=ROWS)
    assert main(["diagnose", "record.csv", "--scenario", "fig6"]) == FINE
    assert "Nothing is wrong beyond tolerance" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["diagnose", "nowhere.csv", "--scenario", "fig6"], "There is no measured record nowhere.csv"),
        (["diagnose", "record.csv"], "Which trial is record.csv?"),
        (["diagnose", "record.csv", "--scenario", "fig7"], "there is no such scenario"),
        (["diagnose", "record.csv", "--scenario", "fig6", "--effects", "no.py"], "There is no effects file 'no.py'"),
        (["diagnose", "record.csv", "--scenario", "fig6", "--commands", "mine"], "--commands"),
        (["diagnose", "--scenario", "fig6"], "subzero diagnose needs FILES, as in: "),
        (["diagnose", ".", "--scenario", "fig4"], "prescribes the motion"),
        (["simulate", "fig6", "--with", "no.toml"], "there is no such file"),
        (["compare", "fig6", "--with", "record.csv"], "this is not valid TOML"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_in_one_message_and_leaves_nothing(engine, tmp_path, capsys, words, says):
    assert main([*words, "--out", "found"]) == MISTAKE
    assert says in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "found").exists()


def test_the_same_in_python_takes_files_records_and_models(engine):
    import subzero

    verdict = subzero.diagnose("record.csv", "fig6", progress=lambda fraction, words: None)
    assert verdict.causes[0].id == "rudder_lag"
    (logged,) = subzero.read_trials("record.csv", scenario="fig6")
    model = replace(logged.setting.model, current=(0.1, 0.0, 0.0))
    subzero.diagnose(logged, model, progress=lambda fraction, words: None)
    assert engine["records"][0].setting.model.current == (0.1, 0.0, 0.0)


def test_a_challenge_is_written_with_what_to_do_next_and_its_answer_is_told_when_asked(
    engine, monkeypatch, capsys
):
    def challenge(scenario, seed, folder):
        (folder / "record.csv").write_text(f"{scenario} {seed}")

    parts = {
        "challenge": {"challenge": challenge},
        "sealed_answer": {"reveal": lambda folder: f"in {folder}: the rudder lags"},
    }
    for name, contents in parts.items():
        module = types.ModuleType(f"subzero.synthetic.{name}")
        vars(module).update(contents)
        monkeypatch.setitem(sys.modules, module.__name__, module)
    assert main(["challenge", "--scenario", "fig6", "--seed", "7", "--out", "hidden"]) == FINE
    said = capsys.readouterr().out
    assert "subzero diagnose fig6 hidden/record.csv" in said
    assert "subzero challenge --reveal hidden" in said
    assert main(["challenge", "--reveal", "hidden"]) == FINE
    assert "in hidden: the rudder lags" in capsys.readouterr().out


def test_nothing_to_reveal_is_a_mistake(engine, capsys):
    assert main(["challenge", "--reveal", "nowhere"]) == MISTAKE
    assert "There is no sealed answer" in capsys.readouterr().err


@contextmanager
def full_disk(most):
    """Let no file grow beyond so many bytes, as on a full disk; nor one that the tests themselves are told into."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


NOT_KEPT = "(Compil.*\\n|[ 0-9.]+(functions\\.)?\\n)*"
"""What a full disk also means, where something has to be compiled."""


@pytest.mark.parametrize("most", [10, 1_000, 20_000])
def test_a_full_disk_stops_a_diagnosis_with_one_message_and_no_files(most, engine, tmp_path, capsys):
    with full_disk(most):
        assert main(["diagnose", "record.csv", "--scenario", "fig6", "--out", "found"]) == MISTAKE
    said = capsys.readouterr().err
    assert re.fullmatch(f"{NOT_KEPT}The output folder found cannot be written: .*\\n", said), said
    assert not (tmp_path / "found").exists()


@pytest.mark.long
@pytest.mark.parametrize("most", [10, 1_000])
def test_a_full_disk_stops_a_challenge_with_one_message_and_no_files(most, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with full_disk(most):
        assert main(["challenge", "--seed", "7", "--out", "hidden"]) == MISTAKE
    said = capsys.readouterr().err
    assert re.fullmatch(f"{NOT_KEPT}The output folder hidden cannot be written: .*\\n", said), said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("width", [60, 80, 120])
def test_no_id_and_no_word_of_a_table_is_broken_however_narrow_the_terminal(width):
    import io

    from rich.console import Console

    from subzero.cli.write_diagnosis import _rich
    from subzero.diagnosis import report

    ids = ["sensor_scale:propeller_speed@12.5", "cable_tangential_drag"]
    cells = (
        "the speed log shows too much or too little",
        "0.31",
        "time constant 0.311 s; share 0.2",
        "not told apart",
    )
    table = report.tables.Table(
        ("cause", "signal", "smallest that is seen", "", "id"), [(*cells, one) for one in ids]
    )
    text = io.StringIO()
    Console(file=text, width=width).print(_rich(table, width))
    words = text.getvalue().split()
    assert set(ids) <= set(words)
    assert {"signal", "too", "little"} - set(words) <= {"signal"}
    assert max(map(len, text.getvalue().splitlines())) <= width


def test_the_next_command_names_the_scenario_as_it_was_given(engine, tmp_path, capsys):
    """It named the trial, which is no file of the user's: it failed for everybody's own trial."""
    mine = tmp_path / "my trials" / "mine.toml"
    mine.parent.mkdir()
    mine.write_text(scenarios.path("fig6").read_text(encoding="utf-8"), encoding="utf-8")
    assert main(["diagnose", "record.csv", "--scenario", str(mine), "--out", "found"]) == FINE
    command = f"subzero simulate '{mine}' --with found/extended.toml"
    assert command in capsys.readouterr().out.replace("\n", "")
    report = (tmp_path / "found" / "report.md").read_text(encoding="utf-8")
    assert f"subzero simulate '{mine}'" in report
    assert f"subzero simulate '{mine}'" in json.dumps(
        json.loads((tmp_path / "found" / "diagnosis.json").read_text())
    )
