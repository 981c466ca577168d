"""Whatever is in a file: it is a Trial, or a ScenarioError that can be read. Nothing else ever comes out."""

import random

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import scenarios

FIG6 = scenarios.path("fig6").read_text(encoding="utf-8")
UMBILICAL = scenarios.path("rov_umbilical").read_text(encoding="utf-8")
CABLE = (scenarios.path("fig6").parent.parent / "cables" / "table1.toml").read_text(encoding="utf-8")
HEADER = "time_s,propeller_rps,rudder_deg,stern_plane_port_deg,stern_plane_starboard_deg\n"
LOG = HEADER + "".join(f"{time},27,0,0.5,-0.5\n" for time in range(31))
RECORD = (
    "time_s,surge_speed_m_s,pitch_deg,heading_deg,roll_deg,roll_rate_deg_s,depth_m,cable_tension_N\n"
    + "".join(f"{time},1,-2,{(355 + time) % 360},0.5,0.1,3,0.2\n" for time in range(31))
)

SPICES = (
    *(
        "nan",
        "inf",
        "-inf",
        "-1",
        "0",
        "1e999",
        "1" + "0" * 400,
        "1" * 5000,
        "e",
        ".",
        "true",
        '"text"',
        "''",
    ),
    *(
        "[]",
        "{}",
        "[[]]",
        "{value = {}}",
        "{value = [1], unit = 1}",
        "[1, 'a']",
        "1979-05-27",
        "12:30:00",
        "=",
    ),
    *(
        "\n",
        "\r",
        ",",
        ",,",
        ";",
        '"',
        '"""',
        "#",
        "[",
        "]",
        "[[run]]",
        "\x00",
        "\ufeff",
        "é",
        "\u2028",
        " " * 9,
    ),
    *('control = "brake"', "depth_m = [1.0]", "pay_out_rate_m_s", "[winch]", "[vessel]"),
    *("a.b.c = 1", "time_s", "file = '.'", "file = '/'", 'file = "x\\u0000y"', ".".join("a" * 900) + " = 1"),
    *(
        "[" * 3000,
        "vehicle = 1",
        "[changes]\n",
        "[changes.vehicle]\nhull = 3",
        "[changes.vehicle.hull]\na = {}",
    ),
    *("[start]\nheading_deg = 1", "[motion]\n", "[commands]\n", "\n[run]\n", "[changes]\ncable = 3\n"),
)

QUIET = settings(
    max_examples=150,
    deadline=None,  # two cores are shared; the first example imports pydantic
    suppress_health_check=[HealthCheck.function_scoped_fixture],  # every example overwrites the same file
    derandomize=True,
)


@st.composite
def spoiled(draw, text):
    """Cut pieces out of a text, put spices in, or double pieces, a few times."""
    generator = random.Random(draw(st.integers(0, 10**9)))
    for _ in range(generator.randint(1, 4)):
        at = generator.randrange(len(text) + 1)
        to = min(len(text), at + generator.choice((0, 1, 3, 10, 100)))
        text = text[:at] + generator.choice((*SPICES, "", text[at:to] * 2)) + text[to:]
    return text


def outcome(path, **more):
    """Load; return the Trial, or None for a ScenarioError whose text can be read."""
    try:
        trial = scenarios.load(path, **more)
    except scenarios.ScenarioError as error:
        check_readable(error)
        return None
    assert isinstance(trial, scenarios.Trial)
    return trial


def check_readable(error):
    """Every problem names a file and a reason, and the whole is not endless."""
    assert error.problems
    assert all(problem.file and problem.why for problem in error.problems)
    assert len(str(error)) < 30_000


def is_usable(trial):
    """Check what a run relies on: finite numbers, increasing times, whole numbers of steps."""
    assert trial.duration >= trial.cable_step >= trial.hull_step > 0.0
    assert trial.cable_step / trial.hull_step == pytest.approx(
        round(trial.cable_step / trial.hull_step), rel=1e-8
    )
    assert set(trial.cable) == set(scenarios.load("fig6").cable)
    for name in ("profile", "winch", "vessel"):
        for values in vars(getattr(trial, name)).values() if getattr(trial, name) else ():
            assert isinstance(values, str) or np.isfinite(np.array(values)).all()
    for samples in (trial.commands, trial.motion):
        for values in vars(samples).values() if samples else ():
            if values is None or isinstance(values, str | tuple):  # names of columns
                continue
            assert values.dtype == float
            assert np.isfinite(values).all()
    times = (trial.commands or trial.motion).time
    assert times[0] == 0.0
    assert (np.diff(times) > 0.0).all()


@pytest.mark.long
@QUIET
@given(text=spoiled(FIG6))
@example(text="a." * 2000 + "a = 1")
@example(text=FIG6.replace("25.0", "1" + "0" * 400))
@example(text=FIG6.replace("[changes]", '[changes]\n"cable.diameter" = 1' + "0" * 400))
@example(text="[changes." + "a." * 900 + "a]\nb = 1")
def test_a_spoiled_trial_is_a_trial_or_a_scenario_error(tmp_path, text):
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8", newline="")
    trial = outcome(tmp_path / "mine.toml")
    if trial:
        is_usable(trial)


@QUIET
@given(text=spoiled(UMBILICAL))
def test_a_spoiled_trial_with_winch_and_vessel_is_a_trial_or_a_scenario_error(tmp_path, text):
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8", newline="")
    trial = outcome(tmp_path / "mine.toml")
    if trial:
        is_usable(trial)


@pytest.mark.long
@QUIET
@given(text=spoiled(LOG))
@example(text='"')
@example(text="time_s\n" + "9" * 400)
@example(text=HEADER + "0," + '"' + "x" * 200_000 + "\n")
def test_a_spoiled_log_is_a_trial_or_a_scenario_error(tmp_path, text):
    (tmp_path / "log.csv").write_text(text, encoding="utf-8", newline="")
    trial = outcome("fig6", commands_csv=tmp_path / "log.csv")
    if trial:
        is_usable(trial)


@pytest.mark.long
@QUIET
@given(text=spoiled(RECORD))
def test_a_spoiled_record_is_a_motion_or_a_scenario_error(tmp_path, text):
    (tmp_path / "record.csv").write_text(text, encoding="utf-8", newline="")
    trial = outcome("fig6", motion_csv=tmp_path / "record.csv")
    if trial:
        is_usable(trial)


@pytest.mark.long
@QUIET
@given(text=spoiled(CABLE))
def test_a_spoiled_cable_is_a_trial_or_a_scenario_error(tmp_path, text):
    (tmp_path / "own.toml").write_text(text, encoding="utf-8", newline="")
    (tmp_path / "mine.toml").write_text(FIG6.replace('"table1"', '"own.toml"'), encoding="utf-8")
    trial = outcome(tmp_path / "mine.toml")
    if trial:
        is_usable(trial)


@pytest.mark.long
@QUIET
@given(data=st.binary(max_size=200))
def test_any_bytes_are_a_scenario_error_or_a_trial(tmp_path, data):
    (tmp_path / "mine.toml").write_bytes(data)
    (tmp_path / "log.csv").write_bytes(data)
    assert outcome(tmp_path / "mine.toml") is None
    assert outcome("fig6", commands_csv=tmp_path / "log.csv") is None


@QUIET
@given(name=st.text(max_size=300).filter(lambda name: name not in scenarios.names()))
@example(name="")
@example(name="x" * 5000)
@example(name="a\x00.toml")
@example(name="../" * 50)
@example(name="\udcff")
def test_any_name_that_is_not_shipped_is_a_scenario_error(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    assert outcome(name) is None
