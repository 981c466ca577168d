"""Every form in which a logger writes a record is read, or named in one line.

Verifies: `subzero.read_log`, with the table, times and names below it. Configuration: one small record, written in the
forms of `../shared/data/field_cases/make_logs.py` and others. Tolerance: the digits that are written.
"""

from __future__ import annotations

import datetime
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
from subzero.errors import UserError

STEP, ROWS = 0.1, 301
COLUMNS = ["time_s", "surge_speed_m_s", "heading_deg", "yaw_rate_deg_s", "pitch_deg", "roll_deg", "depth_m"]
CHANNELS = ["surge_speed", "heading", "yaw_rate", "pitch", "roll_angle", "depth"]
EPOCH = 1_636_500_000
SHARED = Path(__file__).parents[3] / "shared" / "data"


def truth():
    t = STEP * np.arange(ROWS)
    rate = 6.0 * np.sin(0.4 * t)
    speed, pitch = 1.2 * (1.0 - np.exp(-t / 4.0)), 5.0 * np.sin(0.25 * t)
    depth = 3.0 - STEP * np.cumsum(speed * np.sin(np.radians(pitch)))
    return [t, speed, 40.0 + STEP * np.cumsum(rate), rate, pitch, 3.0 * np.sin(0.3 * t), depth]


def cells():
    """The record as rows of texts with six digits."""
    return [[f"{value:.6g}" for value in row] for row in zip(*truth(), strict=True)]


def text(rows, head=COLUMNS, sep=",", dec=".", newline="\n"):
    lines = [sep.join(head), *(sep.join(cell.replace(".", dec) for cell in row) for row in rows)]
    return newline.join(lines) + newline


def with_time(make, head=COLUMNS):
    return text([[make(k), *row[1:]] for k, row in enumerate(cells())], head)


def iso(k, *, zone=True):
    start = datetime.datetime(2026, 10, 25, 0, 59, 50, tzinfo=datetime.UTC)
    now = start + datetime.timedelta(seconds=STEP * k)
    local = now.astimezone(datetime.timezone(datetime.timedelta(hours=2 if now.hour < 1 else 1)))
    return local.isoformat() if zone else now.replace(tzinfo=None).isoformat(" ")


def with_gaps(word):
    rows = cells()
    for k in (5, 6, 50, 51, 52):
        rows[k][6] = word
    return text(rows)


def restarted():
    return with_time(lambda k: f"{STEP * k - (15.0 if k >= 150 else 0.0):.6g}")


def swapped():
    rows = cells()
    for k in (40, 97, 200):
        rows[k], rows[k + 1] = rows[k + 1], rows[k]
    return text(rows)


def converted(factors, names):
    """The record with columns in other units, under other names."""
    table = np.column_stack([values * factor for values, factor in zip(truth(), factors, strict=True)])
    return text([[f"{value:.9g}" for value in row] for row in table], names)


def clock(k, form="%Y-%m-%d %H:%M:%S.%f", start=(2026, 10, 25, 10, 0, 50)):
    return (datetime.datetime(*start) + datetime.timedelta(seconds=STEP * k)).strftime(form)


def spiked(rows, ahead):
    return with_time(lambda k: f"{STEP * k + (ahead if k in rows else 0.0):.6g}")


def held(columns):
    """The record with some columns logged once a second, and straight lines in between."""
    values = np.array(truth())
    known = np.arange(0, ROWS, 10)
    for at in columns:
        values[at] = np.interp(np.arange(ROWS), known, values[at][known])
    return text([[f"{value:.6g}" for value in row] for row in values.T])


def in_two(first, second, make):
    """The record with its time in two columns."""
    return text([[*make(k), *row[1:]] for k, row in enumerate(cells())], [first, second, *COLUMNS[1:]])


ARABIC = str.maketrans("0123456789", "٠١٢٣٤٥٦٧٨٩")
RAD = np.pi / 180.0
GERMAN = ["Zeit [s]", "Fahrt [m/s]", "Kurs [°]", "Drehrate [°/s]", "Pitch [°]", "Roll [°]", "Tiefe [m]"]
READ = {
    "plain": text(cells()),
    "decimal comma": text(cells(), sep=";", dec=","),
    "semicolons": text(cells(), sep=";"),
    "tabs": text(cells(), sep="\t"),
    "tabs and decimal comma": text(cells(), sep="\t", dec=","),
    "bars": text(cells(), sep=" | "),
    "spaces": text(cells(), sep="   "),
    "utf-16": text(cells()).encode("utf-16"),
    "latin-1": text(cells(), GERMAN, ";", ",").encode("cp1252"),
    "mark and crlf": text(cells(), newline="\r\n").encode("utf-8-sig"),
    "cr only": text(cells(), newline="\r"),
    "row of units": text([["s", "m/s", "deg", "deg/s", "deg", "deg", "m"], *cells()]),
    "preamble": "# vehicle: X\n# date 2026-11-01\n" + text(cells()),
    "preamble without signs": "vehicle: X\nlog of today\n\n" + text(cells()),
    "names in a remark": "# " + text(cells()),
    "index column": text([[str(k), *row] for k, row in enumerate(cells())], ["", *COLUMNS]),
    "trailing comma": text([[*row, ""] for row in cells()], [*COLUMNS, ""]),
    "quoted": text(cells(), [f'"{name}"' for name in COLUMNS]),
    "words": text([[*row, "manual"] for row in cells()], [*COLUMNS, "mode"]),
    "nanoseconds": with_time(lambda k: str(EPOCH * 10**9 + k * 10**8)),
    "milliseconds": with_time(lambda k: str(EPOCH * 1000 + k * 100), ["timestamp", *COLUMNS[1:]]),
    "nanoseconds since a start": with_time(lambda k: str(5 * 10**12 + k * 10**8), ["timestamp_ns", *COLUMNS[1:]]),
    "microseconds since a start": with_time(lambda k: str(5 * 10**9 + k * 10**5), ["time", *COLUMNS[1:]]),
    "seconds since 1970": with_time(lambda k: f"{EPOCH + STEP * k:.3f}", ["time", *COLUMNS[1:]]),
    "TimeUS": with_time(lambda k: str(12_345_678 + k * 100_000), ["TimeUS", *COLUMNS[1:]]),
    "six digits of an uptime": with_time(lambda k: f"{90274.5 + STEP * k:.6G}"),
    "milliseconds by their steps": with_time(lambda k: str(5000 + 100 * k), ["time", *COLUMNS[1:]]),
    "iso with summer time": with_time(iso),
    "iso without zone": with_time(lambda k: iso(k, zone=False)),
    "h:m:s": with_time(lambda k: f"00:00:{STEP * k:05.2f}"),
    "timedelta": with_time(lambda k: f"0 days 00:00:{STEP * k:09.6f}"),
    "midnight": with_time(lambda k: iso(k - 35_990 + 72_000, zone=False)[11:], ["clock", *COLUMNS[1:]]),
    "date and time": text([[*iso(k, zone=False).split(" "), *row[1:]] for k, row in enumerate(cells())],
                          ["Date", "Time", *COLUMNS[1:]]),
    "radians, knots, feet": converted(
        [1.0, 3600.0 / 1852.0, RAD, RAD, RAD, RAD, 1.0 / 0.3048],
        ["t", "Speed (kn)", "yaw_rad", "YawRate [rad/s]", "pitch_rad", "Roll(rad)", "depth[ft]"]),
    "MOOS": converted([1.0] * 7, ["TIME", "NAV_SPEED", "NAV_HEADING", *COLUMNS[3:6], "NAV_DEPTH"]),
    "digits of Arabic": text([[cell.translate(ARABIC) for cell in row] for row in cells()]),
    "delimiters behind rows": ",".join(COLUMNS) + "\n" + "".join(",".join(row) + ",\n" for row in cells()),
    "two rows of names": "a,a,a,b,b,b,b\n" + text([["s", "m/s", "deg", "deg/s", "deg", "deg", "m"], *cells()]),
    "day first": with_time(lambda k: clock(k, "%d/%m/%Y %H:%M:%S.%f")),
    "month first": with_time(lambda k: clock(k, "%m/%d/%Y %I:%M:%S.%f %p")),
    "month first, over the tenth": with_time(lambda k: clock(k, "%m/%d/%Y %H:%M:%S.%f", (2026, 10, 12, 23, 59, 50))),
    "a day that can be a month": with_time(lambda k: clock(k, "%d/%m/%Y %H:%M:%S.%f", (2026, 4, 3, 10, 0, 50))),
    "month in letters": with_time(lambda k: clock(k, "%d-%b-%Y %H:%M:%S.%f")),
    "iso without signs": with_time(lambda k: clock(k, "%Y%m%dT%H%M%S.%fZ")),
    "hhmmss": with_time(lambda k: clock(k, "%H%M%S.%f"), ["utc", *COLUMNS[1:]]),
    "days of Excel": with_time(lambda k: f"{46320.4 + STEP * k / 86400.0:.12f}", ["time", *COLUMNS[1:]]),
    "seconds and nanoseconds": in_two("sec", "nanosec", lambda k: (str(EPOCH + k // 10), str(k % 10 * 10**8))),
    "seconds and microseconds": in_two("tv_sec", "tv_usec", lambda k: (str(k // 10), str(k % 10 * 10**5))),
    "angles decided by values": converted(
        [1.0, 1.0, RAD, RAD, RAD, RAD, 100.0],
        ["time", "speed_m_s", "yaw", "yawrate_rad_s", "pitch", "roll", "depth_cm"]),
}  # fmt: skip
NAMED = {
    "fractions lost": (with_time(lambda k: f"{k // 10}.{k // 10:09d}"), "fractions of a second were not written"),
    "whole seconds": (with_time(lambda k: str(k // 10)), "[time] every_s = 0.1"),
    "epoch of six digits": (with_time(lambda k: f"{1.7e9 + STEP * k:.6G}"), "fractions of a second were not written"),
    "restart": (restarted(), "its clock begins anew at row 151: the logger was restarted. Say in the map which part"),
    "out of order": (swapped(), "3 rows are not later than the row before, the first is row 42. If rows are only out"),
    "microseconds called seconds": (
        with_time(lambda k: str(12_345_678 + k * 100_000)), "'time_s' (time): by its name in s, by its steps in us",
    ),
    "centidegrees": (converted([1, 1, 100, 1, 1, 1, 1], COLUMNS), "centidegree would do"),
    "stamps ahead": (spiked((40, 97, 200), 0.15), "3 rows are not later than the row before, the first is row 42"),
    "spikes of the clock": (spiked(range(20, 301, 60), 4.0), "5 rows are not later than the row before"),
    "backwards": (with_time(lambda k: f"{30.0 - STEP * k:.6g}"), "its clock runs backwards. Say so in the map"),
    "days or months first": (with_time(lambda k: clock(k, "%d/%m/%Y %H:%M:%S.%f", (2026, 4, 3, 23, 59, 50))),
                             "'time_s' has dates of which nothing says whether the day or the month is first"),
    "both orders": (with_time(lambda k: clock(k, ("%d/%m/%Y", "%m/%d/%Y")[k % 2] + " %H:%M:%S.%f")),
                    "has dates with the day first and with the month first"),
    "fractions that repeat the seconds": (in_two("sec", "nanosec", lambda k: (str(k // 10), str(k // 10))),
                                          "rows have the time of the row before"),
    "a list": (text([[f"{0.1 * (k // 3):.1f}", "depth_m", "2"] for k in range(90)], ["time", "name", "value"]),
               "rows have the time of the row before"),
    "mixed zones": (with_time(lambda k: iso(k, zone=k % 2 == 0)), "some of its times have a zone and some have none"),
    "no unit": (converted([1.0] * 7, ["time", "speed", *COLUMNS[2:]]), "'speed' (surge_speed): in "),
    "no time": (text([row[1:] for row in cells()], COLUMNS[1:]), "none of its columns is a time"),
    "no names": (text(cells()[1:], cells()[0]), "its first row has numbers, not names of columns"),
    "no channels": (converted([1.0] * 7, ["time", *"abcdef"]), "none of its columns is a channel"),
    "nothing": ("", "it holds no samples"),
    "a header": (",".join(COLUMNS) + "\n", "it holds no samples"),
    "zeros": (b"\0" * 100_000, "it is no text"),
    "zeros as text": ("time_s,depth_m\n" + "0,0\n" * 100_000, "99999 rows have the time of the row before"),
    "other rows in between": (text([*cells()[:9], ["1", "2"], *cells()[9:]]), "line 11 has another number of cells"),
    "a line without end": ("x" * 3_000_000, "a line has more than"),
}  # fmt: skip
"""Form → what is written, and what is said."""


def make(path, content):
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def hold(record, digits=2e-5, rows=slice(None)):
    """Hold a record against the truth."""
    assert_allclose(record.time, truth()[0][rows], atol=1e-6)
    for name, values in zip(CHANNELS, truth()[1:], strict=True):
        assert_allclose(record.values[name], values[rows], atol=digits * 20.0, err_msg=name)


@pytest.mark.parametrize("form", READ)
def test_a_form_is_read(form, tmp_path):
    hold(subzero.read_log(make(tmp_path / "log.csv", READ[form])))


@pytest.mark.parametrize("form", NAMED)
def test_a_form_that_cannot_be_read_is_named_in_one_message(form, tmp_path):
    content, words = NAMED[form]
    with pytest.raises(UserError) as error:
        subzero.read_log(make(tmp_path / "log.csv", content))
    assert words in str(error.value)


@pytest.mark.parametrize(
    "word", ["NaN", "nan", "NULL", "#N/A", "-", "inf", '""', "-9999", "9999", "-999", "-32768", "65535", ""]
)
def test_words_and_numbers_for_nothing_are_gaps(word, tmp_path):
    record = subzero.read_log(make(tmp_path / "log.csv", with_gaps(word)))
    assert list(np.flatnonzero(np.isnan(record.values["depth"]))) == [5, 6, 50, 51, 52]
    assert word.lstrip("-").isdigit() == any("taken as gaps" in note for note in record.notes)


def test_a_counter_that_passes_9999_has_no_gap_there(tmp_path):
    lines = "".join(f"{k},{9990 + k}\n" for k in range(30))
    record = subzero.read_log(make(tmp_path / "log.csv", "time_s,cable_length_m\n" + lines))
    assert np.isfinite(record.values["cable_length"]).all()


def test_two_numbers_for_nothing_in_one_column_are_both_gaps(tmp_path):
    rows = cells()
    rows[5][6], rows[9][6] = "-999", "99999"
    record = subzero.read_log(make(tmp_path / "log.csv", text(rows)))
    assert list(np.flatnonzero(np.isnan(record.values["depth"]))) == [5, 9]


def test_a_last_row_that_was_cut_off_is_left_out_and_said(tmp_path):
    record = subzero.read_log(make(tmp_path / "log.csv", text(cells()[:200]) + "20,0.9"))
    hold(record, rows=slice(200))
    assert "The last row, line 202, was cut off and is left out." in record.notes


def test_latitude_and_longitude_become_metres(tmp_path):
    north, east = 3.0 * np.arange(40), -2.0 * np.arange(40)
    degree_n, degree_e = 111_248.7, 70_338.4  # WGS 84 at 50.9 degrees north
    lat, lon = 50.9 + north / degree_n, -1.4 + east / degree_e
    minutes = [np.trunc(x) * 100 + 60 * (x - np.trunc(x)) for x in (lat, lon)]
    for a, b in ((lat, lon), (np.round(lat * 1e7), np.round(lon * 1e7)), minutes):
        rows = "".join(f"{k},{x:.10g},{y:.10g}\n" for k, (x, y) in enumerate(zip(a, b, strict=True)))
        record = subzero.read_log(make(tmp_path / "log.csv", "time_s,lat,lon\n" + rows))
        assert_allclose(record.values["north"], north, rtol=1e-4, atol=0.02)
        assert_allclose(record.values["east"], east, rtol=1e-4, atol=0.02)


@pytest.mark.parametrize("lines", ["{t},{lat},S,{lon},W\n", "{t},{lat}S,{lon}W\n"])
def test_letters_are_the_signs_of_latitude_and_longitude(lines, tmp_path):
    names = "time_s,lat,ns,lon,ew\n" if ",S" in lines else "time_s,lat,lon\n"
    rows = [lines.format(t=k, lat=33.5 + 1e-5 * k, lon=70.25 + 1e-5 * k) for k in range(40)]
    record = subzero.read_log(make(tmp_path / "log.csv", names + "".join(rows)))
    assert record.values["north"][-1] < -40.0  # farther south
    assert record.values["east"][-1] < -30.0  # farther west


def test_what_was_interpolated_or_has_no_speed_is_read_all_the_same(tmp_path):
    record = subzero.read_log(make(tmp_path / "log.csv", held([2])))
    known = np.isfinite(record.values["heading"])
    assert_allclose(record.values["heading"][known], truth()[2][known], atol=1e-3)
    rows = "".join(f"{t:.1f},{3 * t:.3f},{-2 * t:.3f}\n" for t in truth()[0])
    record = subzero.read_log(make(tmp_path / "log.csv", "time_s,north_m,east_m\n" + rows))
    assert_allclose(record.values["north"], 3.0 * truth()[0], atol=1e-3)


def test_a_heading_that_counts_on_over_three_turns_is_in_the_unit_of_its_name(tmp_path):
    heading = np.linspace(2.0, 22.0, 60)
    rows = "".join(f"{0.5 * k},{value:.6f}\n" for k, value in enumerate(heading))
    record = subzero.read_log(make(tmp_path / "log.csv", "Time (s),Yaw (rad)\n" + rows))
    assert_allclose(record.values["heading"], np.degrees(heading), atol=1e-3)


def test_a_log_with_more_rows_than_a_record_can_have_keeps_every_nth(tmp_path, monkeypatch):
    from subzero.logs import text as module

    monkeypatch.setattr(module, "MOST_ROWS", 50)
    monkeypatch.setattr(module, "CHUNK", 7)
    content = text([[*row, "word"] for row in cells()], [*COLUMNS, "mode"])
    record = subzero.read_log(make(tmp_path / "log.csv", content))
    stride = round(ROWS / record.time.size)
    assert 6 <= stride <= 8
    hold(record, rows=slice(None, None, stride))
    assert f"Of {stride} rows one is kept, {record.time.size} in all." in record.notes
    turns = [[f"{0.1 * k:.1f}", "1" if k % 2 else "", "" if k % 2 else "2"] for k in range(300)]
    with pytest.raises(UserError, match="which hold sensors in turn"):
        subzero.read_log(make(tmp_path / "log.csv", text(turns, ["time_s", "depth_m", "surge_speed_m_s"])))


def test_of_two_pressure_sensors_the_one_that_dives_is_taken_and_it_is_said(tmp_path):
    """As in ArduSub's logs, number 0 is inside the hull and shows its own warming up."""
    rng, (t, speed, _, _, pitch, _, depth) = np.random.default_rng(1), truth()
    inside = 99_790.0 + 40.0 * t / 30.0 + rng.normal(0.0, 8.0, t.size)
    outside = 101_325.0 + 1025.0 * 9.81 * depth + rng.normal(0.0, 30.0, t.size)
    rows = [",".join(f"{x:.9g}" for x in row) for row in zip(t, speed, pitch, inside, outside, strict=True)]
    head = "time_s,surge_speed_m_s,pitch_deg,press[0],press[1]"
    path = make(tmp_path / "log.csv", "\n".join([head, *rows]) + "\n")
    assert_allclose(subzero.read_log(path).values["depth"], depth, atol=0.02)
    from subzero.logs.api import import_log

    reasons = {row[0]: row[4] for row in import_log(path).table()}
    assert "which 'press[0]' does not" in reasons["press[1]"]
    assert reasons["press[0]"] == "not used: 'press[1]' is the depth"


def test_rows_before_the_clock_was_set_are_left_out_and_said(tmp_path):
    """Slocum writes a row of sizes in byte below its units; a clock without a fix begins at 0."""
    lines = [f"{EPOCH + STEP * k:.1f} {0.02 * k:.3f} {2.0 + 0.01 * k:.3f}" for k in range(60)]
    head = ["m_present_time m_heading m_depth", "timestamp rad m", "8 4 4", "9.5 0 0"]
    record = subzero.read_log(make(tmp_path / "log.csv", "\n".join([*head, *lines]) + "\n"))
    assert_allclose(record.time, STEP * np.arange(60), atol=1e-5)
    assert_allclose(record.values["depth"], 2.0 + 0.01 * np.arange(60))
    assert "2 rows before the clock was set are left out." in record.notes


def test_a_velocity_of_one_letter_alone_may_be_the_speed_and_is_not_used(tmp_path):
    from subzero.logs.api import import_log

    lines = "".join(f"{k},{1 + 0.1 * k},{3 - 0.05 * k:g}\n" for k in range(30))
    table = {
        row[0]: row for row in import_log(make(tmp_path / "log.csv", "t,depth_m,v[m/s]\n" + lines)).table()
    }
    assert table["v[m/s]"][1] == ""
    assert "without a speed ahead; say in the map what it is" in table["v[m/s]"][4]
    table = {
        row[0]: row for row in import_log(make(tmp_path / "log.csv", "t,u_m_s,v[m/s]\n" + lines)).table()
    }
    assert table["v[m/s]"][1] == "sway_speed"


def test_a_pressure_that_may_be_absolute_is_said(tmp_path):
    for air, is_said in ((1.013, True), (0.0, False)):
        rows = "".join(f"{k},{air + 0.01 * k:.4f}\n" for k in range(40))
        record = subzero.read_log(make(tmp_path / "log.csv", "time_s,Pressure (bar)\n" + rows))
        assert any("bar absolute" in note for note in record.notes) == is_said
    rows = "".join(f"{k},{1.01325 + 0.1 * k:.5f}\n" for k in range(40))
    record = subzero.read_log(make(tmp_path / "log.csv", "time_s,Pressure (bara)\n" + rows))
    assert_allclose(record.values["depth"], 9.945049 * 0.1 * np.arange(40), atol=1e-3)


def test_two_sensors_that_differ_are_asked_about(tmp_path):
    rows = "".join(f"{k},{1 + 0.1 * k},{3 - 0.2 * k:g}\n" for k in range(30))
    with pytest.raises(
        UserError, match=r"'depth\[0\] \(m\)' or 'depth\[1\] \(m\)' is the depth; they differ, so"
    ):
        subzero.read_log(make(tmp_path / "log.csv", "time_s,depth[0] (m),depth[1] (m)\n" + rows))


def test_matlab_netcdf_and_moos_are_read(tmp_path):
    import scipy.io
    import xarray as xr

    named = dict(zip(COLUMNS, truth(), strict=True))
    scipy.io.savemat(tmp_path / "log.mat", {"nav": named, "version": 3.0, "title": "x"})
    start = np.datetime64("2026-10-25T00:59:50", "ns")
    time = start + np.round(named["time_s"] * 1e9).astype("timedelta64[ns]")
    data = {
        name: ("time", values, {"units": name.rpartition("_")[2]})
        for name, values in named.items()
        if name != "time_s"
    }
    xr.Dataset(data, coords={"time": time}).to_netcdf(tmp_path / "log.nc")
    moos = dict(
        zip(
            ("NAV_SPEED", "NAV_HEADING", "YAW_RATE_DEG_S", "PITCH_DEG", "ROLL_DEG", "NAV_DEPTH"),
            truth()[1:],
            strict=True,
        )
    )
    lines = [
        f"{t:.3f}  {name}  pNav  {values[k]:.7g}\n"
        for k, t in enumerate(truth()[0])
        for name, values in moos.items()
    ]
    make(tmp_path / "log.alog", "%% LOG FILE: x\n" + "".join(lines) + "30.000 MODE pHelm MANUAL\n")
    for name in ("log.mat", "log.nc", "log.alog"):
        hold(subzero.read_log(tmp_path / name))


@pytest.mark.parametrize("ending", ["mat", "nc", "alog"])
def test_a_file_that_is_not_what_its_ending_says_is_one_message(ending, tmp_path):
    with pytest.raises(UserError) as error:
        subzero.read_log(make(tmp_path / f"log.{ending}", text(cells())))
    assert str(error.value).count("\n") == 0
    with pytest.raises(UserError, match="cannot be imported"):
        subzero.read_log(make(tmp_path / f"cut.{ending}", b"MATLAB 5.0 MAT-file" + b"\1" * 700))


def test_a_map_says_part_start_order_and_steps(tmp_path):
    columns = {name: {"channel": channel, "unit": unit} for name, channel, unit in
               zip(COLUMNS[1:], CHANNELS, ["m/s", "deg", "deg/s", "deg", "deg", "m"], strict=True)}  # fmt: skip

    def read(content, **time):
        lines = ["[time]", *(f"{key} = {json.dumps(value)}" for key, value in time.items()), "[columns]"]
        lines += [
            f'{name} = {{channel = "{row["channel"]}", unit = "{row["unit"]}"}}'
            for name, row in columns.items()
        ]
        return subzero.read_log(
            make(tmp_path / "log.csv", content), make(tmp_path / "map.toml", "\n".join(lines))
        )

    clock = {"columns": ["time_s"], "unit": "s"}
    later = read(restarted(), **clock, part=2)
    assert later.time.size == ROWS - 150
    assert_allclose(later.values["depth"], truth()[6][150:], atol=1e-4)
    hold(read(swapped(), **clock, sort=True))
    hold(read(NAMED["whole seconds"][0], every_s=0.1))
    started = read(READ["iso with summer time"], columns=["time_s"], start="2026-10-25T01:00:00Z")
    assert_allclose(started.values["depth"], truth()[6][100:], atol=1e-4)
    assert started.time[0] == 0.0
    assert_allclose(read(text(cells()[20:]), **clock, start=0).time[0], 2.0)


@pytest.mark.skipif(not SHARED.exists(), reason="the shared logs are not here")
def test_the_shared_logs_are_read_or_named():
    said = {}
    for path in sorted((SHARED / "field_cases").rglob("*.csv")):
        try:
            said[path.name[:4]] = subzero.read_log(path).time.size
        except UserError as error:
            said[path.name[:4]] = str(error)
    assert all(
        isinstance(said[name], int)
        for name in ("L5_n", "L6_i", "L6c_", "L6e_", "L11_", "L13_", "L15b", "log5")
    )
    assert "fractions of a second" in said["L1_n"]
    assert "restarted" in said["L4_r"]
    assert "centidegree" in said["L18_"]
    assert "rad/s for 'yaw_rate_deg_s'" in said["log4"]


@pytest.mark.skipif(not SHARED.exists(), reason="the shared logs are not here")
def test_a_log_of_ardupilot_is_read_without_the_barometer_in_the_hull():
    pytest.importorskip("pymavlink")
    from subzero.logs.api import import_log

    found = import_log(SHARED / "ardusub_logs" / "small.BIN")
    lines = {line.name: line for line in found.mapping.lines}
    assert lines["CTUN.BAlt"].channel == "depth"
    assert "BARO[0].Alt" not in lines
    assert any("BARO[0].Alt" in note and "inside the hull" in note for note in found.record.notes)
    assert any("to RCOU.C14 (" in note and "the pulse of a motor" in note for note in found.record.notes)
    assert lines["ATT.Yaw"].unit == "degree"


def test_what_is_no_log_of_ardupilot_is_named(tmp_path):
    pytest.importorskip("pymavlink")
    with pytest.raises(UserError, match="it is no log of ArduPilot"):
        subzero.read_log(make(tmp_path / "log.bin", b"\0" * 1000))


def test_without_pymavlink_a_log_of_ardupilot_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pymavlink.DFReader", None)
    with pytest.raises(UserError, match=r"needs pymavlink: pip install 'subzero-auv\[logs\]'"):
        subzero.read_log(make(tmp_path / "log.bin", b"x"))
