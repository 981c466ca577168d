"""What cannot be used is refused in one message, which says what, where and why."""

import itertools

import numpy as np
import pytest

import subzero.diagnosis as sd
from subzero.errors import UserError
from tests.identification.oscillator import model, record

CHANNELS = {"y": sd.Sensor(noise=0.1)}
TIME = np.arange(20.0)
RECORD = sd.Record(TIME, {"y": np.sin(TIME)})
calls = itertools.count()

FUNCTIONS = {
    "nan": (lambda p, u, t: {"y": np.where(t == 5.0, np.nan, 0.0)}, "nan for y at 5 s, with a = 1"),
    "length": (lambda p, u, t: {"y": np.zeros(3)}, r"returns \(3,\) readings of 'y' for \(20,\)"),
    "raises": (lambda p, u, t: 1 / 0, "raises ZeroDivisionError: division by zero, with a = 1"),
    "hidden": (lambda p, u, t: {"y": np.full(t.size, float(next(calls)))}, "called twice .* two answers"),
    "no channel": (lambda p, u, t: {"x": t}, "returns no 'y'; it returns x"),
    "no mapping": (lambda p, u, t: t, "returns ndarray; it must return"),
    "text": (lambda p, u, t: {"y": "a"}, "returns no numbers for 'y'"),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_that_cannot_be_used_is_refused_with_its_parameters(name):
    simulate, message = FUNCTIONS[name]
    wrong = sd.Model(simulate, CHANNELS, parameters=[sd.Number("a", 1.0, tolerance=0.1)])
    with pytest.raises(sd.ModelError, match=message):
        sd.diagnose(RECORD, wrong)


def test_a_function_that_fails_within_the_tolerances_is_refused_with_the_set_that_did_it():
    wrong = sd.Model(
        lambda p, u, t: {"y": np.zeros(t.size) / (p["a"] == 1.0)},
        CHANNELS,
        parameters=[sd.Number("a", 1.0, tolerance=0.1)],
    )
    with pytest.raises(sd.ModelError, match=r"nan for y at 0 s, with a = 1\.001"):
        sd.diagnose(RECORD, wrong)


@pytest.mark.parametrize(
    "made, message",
    [
        (lambda: sd.Number("a", 1.0), "neither tolerance nor scale"),
        (lambda: sd.Number("a", float("nan"), tolerance=1.0), "nominal value of the number 'a' is nan"),
        (lambda: sd.Number("a", 1.0, tolerance=0.0), "must be greater than 0"),
        (lambda: sd.Number("a", 1.0, tolerance=1.0, low=2.0), "its bounds are 2 and inf"),
        (lambda: sd.Sensor(noise=-1.0), "the noise of a sensor is -1.0"),
        (lambda: sd.Sensor(low=1.0, high=0.0), "the first must be less"),
        (lambda: sd.Cause("c", "changes nothing"), "changes nothing: give changes"),
        (lambda: sd.Cause("c", "has no off", a=sd.Number(1.0, scale=1.0)), "for which it does nothing"),
        (lambda: sd.Unknown("w", size=0.0, time=1.0), "size of the unknown input 'w'"),
        (lambda: sd.Model(1, CHANNELS), "must be a function"),
        (lambda: sd.Model(np.sin, {}), "the model has no channel"),
        (lambda: model(causes=("stiffness",), parameters=[]), "changes 'k', which is not there"),
        (lambda: model(tuned_on={"k": ["z"]}), "names the channel 'z'"),
        (
            lambda: model(unknown=False, parameters=2 * [sd.Number("a", 1.0, tolerance=1.0)]),
            "'a' is there 2 times",
        ),
        (lambda: sd.Record(TIME, {"y": TIME[:5]}), "y has 5 values and 20 times"),
        (lambda: sd.Record(TIME[:1], {"y": TIME[:1]}), "two or more are needed"),
        (lambda: sd.Record(TIME[::-1], {"y": TIME}), "does not rise from row 0 to 1"),
        (lambda: sd.Record(TIME, {"y": [["a"]]}), "no numbers"),
    ],
)
def test_a_declaration_that_cannot_be_used_is_refused(made, message):
    with pytest.raises(UserError, match=message):
        made()


@pytest.mark.parametrize(
    "columns, message",
    [
        ({"y": np.full(20, np.nan)}, "no channel of the model has 8 readings"),
        ({"z": TIME}, "the model has y; the record has z"),
    ],
)
def test_a_record_without_readings_is_refused(columns, message):
    plain = sd.Model(lambda p, u, t: {"y": 0.0 * t}, CHANNELS)
    with pytest.raises(UserError, match=f"(?i){message}"):
        sd.diagnose(sd.Record(TIME, columns), plain)


def test_a_record_without_an_input_is_refused():
    seen = record(0)
    with pytest.raises(UserError, match="there is no input 'force'; it has x"):
        sd.diagnose(sd.Record(seen.time, {"x": seen.columns["x"]}), model())


def test_no_record_is_refused():
    with pytest.raises(UserError, match="there is no record"):
        sd.diagnose([], model())


def test_a_table_is_read_with_its_interval_or_its_column_of_times(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,level\n0,1\n4,2\n8,\n", encoding="utf-8")
    for time in ("4 s", "t"):
        found = sd.read(path, time=time, y="level")
        np.testing.assert_array_equal(found.time, [0.0, 4.0, 8.0])
        np.testing.assert_array_equal(found.columns["y"], [1.0, 2.0, np.nan])


@pytest.mark.parametrize(
    "text, columns, message",
    [
        ("t,level\n0,1\n", {"y": "levle"}, "no column 'levle'. Did you mean 'level'"),
        ("t,level\n0,one\n1,2\n", {"y": "level"}, "could not convert string to float: 'one'"),
        ("t,level\n", {"y": "level"}, "a table needs a header and values"),
    ],
)
def test_a_table_that_cannot_be_read_is_refused(tmp_path, text, columns, message):
    path = tmp_path / "log.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UserError, match=message):
        sd.read(path, time="t", **columns)


def test_a_table_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(UserError, match="No such file"):
        sd.read(tmp_path / "none.csv", time="1 s", y="y")
