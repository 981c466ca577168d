"""``subzero import``: a record, its map and a table of what was done; or one message, and nothing written."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
from subzero.cli.app import FINE, MISTAKE, main
from subzero.records.record import read_record

LOG = "Time [ms];Speed (kn);hdg;yaw_rate_rad_s;mode\n" + "".join(
    f"{1000 + 100 * k};{1 + 0.1 * k:.1f};{(350 + 2 * k) % 360};0,349;auto\n".replace(".", ",")
    for k in range(40)
)
OPEN = "time,speed,heading_deg\n" + "".join(f"{0.1 * k:.1f},{0.1 * k:.1f},{k}\n" for k in range(40))


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_text(LOG)
    (tmp_path / "open.csv").write_text(OPEN)
    return tmp_path


def names(here):
    return sorted(path.name for path in here.iterdir())


def test_a_log_becomes_a_record_with_a_table_and_a_map(here, capsys):
    assert main(["import", "log.csv"]) == FINE
    assert capsys.readouterr().out.splitlines() == [
        "log.csv:",
        "  column          channel      unit    factor   why",
        "  Time [ms]       time         ms               unit in the name",
        "  Speed (kn)      surge_speed  kn      0.51444  unit in the name",
        "  hdg             heading      degree  1        by its values; agrees with the slope of heading",
        "  yaw_rate_rad_s  yaw_rate     rad/s   57.296   unit in the name; agrees with the slope of heading",
        "  mode                                          not used: no numbers",
        "Times: 1 s, the first time of the log, is taken from all of them.",
        "Units of 'Speed (kn)': taken from names; the values of the log alone would allow others too.",
        "Wrote record.csv, record.map.toml",
    ]
    record = read_record("record.csv")
    assert_allclose(record.values["surge_speed"][:2], [1852.0 / 3600.0, 1.1 * 1852.0 / 3600.0])
    assert_allclose(record.time[-1], 3.9)
    assert tomllib.loads((here / "record.map.toml").read_text())["columns"]["hdg"]["unit"] == "degree"


def test_its_map_gives_the_same_record_again(here):
    assert main(["import", "log.csv", "--out", "a/x.csv"]) == FINE
    assert main(["import", "log.csv", "--map", "a/x.map.toml", "--out", "b/x.csv"]) == FINE
    first, second = (
        [line for line in (here / folder / "x.csv").read_text().splitlines() if line[0] != "#"]
        for folder in "ab"
    )
    assert first == second


def test_what_is_not_decided_is_asked_and_nothing_is_written(here, capsys):
    assert main(["import", "open.csv"]) == MISTAKE
    assert capsys.readouterr().err.splitlines() == [
        "The log open.csv cannot be imported before this is decided:",
        "  'speed' (surge_speed): in m/s, kn, km/h, ft/s or cm/s, which nothing in the log decides",
        "  write the map with subzero import open.csv --map-out map.toml, edit it, and give it with --map",
    ]
    assert names(here) == ["log.csv", "open.csv"]


def test_the_map_is_written_edited_and_given_again(here, capsys):
    assert main(["import", "open.csv", "--map-out", "map.toml"]) == FINE
    assert names(here) == ["log.csv", "map.toml", "open.csv"]
    assert main(["import", "open.csv", "--map", "map.toml"]) == MISTAKE
    assert "surge_speed is in one of m/s, kn" in capsys.readouterr().err
    path = here / "map.toml"
    path.write_text(path.read_text().replace('"?"', '"kn"'))
    assert main(["import", "open.csv", "--map", "map.toml"]) == FINE
    assert_allclose(read_record("record.csv").values["surge_speed"][10], 1852.0 / 3600.0)


MAP = '[time]\ncolumns = ["time"]\nunit = "s"\n[columns]\n'
WRONG = {
    "": "it names no columns",
    "x = [": "cannot be used",
    MAP + 'heading = {channel = "heading", unit = "deg"}': "no column 'heading'. Did you mean 'heading_deg'?",
    MAP + 'speed = {channel = "speed", unit = "kn"}': "there is no channel 'speed'. Did you mean",
    MAP + 'speed = {channel = "surge_speed", unit = "deg"}': "surge_speed is in one of m/s, kn, km/h",
    MAP + 'speed = {channel = "surge_speed"}': "'speed' needs channel and unit",
    MAP + 'speed = {channel = "surge_speed", unit = "kn", facto = 2}': "has no 'facto'. Did you mean 'factor'?",
    MAP + 'speed = {channel = "surge_speed", unit = "kn", factor = true}': "factor is True, which is no value for it",
    MAP + 'speed = {channel = "surge_speed", unit = "kn", factor = 0}': "times a factor other than 0",
    MAP + 'speed = {channel = "surge_speed", unit = "kn", factor = nan}': "factor is nan, which is no value for it",
    MAP + "speed = 3": "'speed' must be a table with channel, unit, factor",
    MAP + 'speed = {channel = "depth", unit = "m"}\nheading_deg = {channel = "depth", unit = "m"}':
        "depth is more than one",
    MAP.replace('"s"', '"fortnight"'): "unit is 'fortnight'; it must be one of s, ms",
    MAP.replace('"time"', '"tim"'): "the log has no column 'tim'. Did you mean 'time'?",
    MAP.replace('"time"', "3"): "columns is [3], which is no value for it",
    MAP.replace("unit", "units"): "[time] has no 'units'. Did you mean 'unit'?",
    "[time]\nevery_s = -1.0\n": "every_s, a number of seconds above 0",
    MAP.replace("[columns]", 'start = "noon"\n[columns]'): "start is 'noon'; it must be a time as the log writes it",
    MAP.replace("[columns]", 'part = 7\n[columns]') + 'speed = {channel = "surge_speed", unit = "kn"}':
        "the map asks for part 7, and its clock has 1",
    MAP.replace("[columns]", 'start = 99.0\n[columns]') + 'speed = {channel = "surge_speed", unit = "kn"}':
        "leaves fewer than two rows",
}  # fmt: skip


@pytest.mark.parametrize("content", WRONG)
def test_a_map_that_does_not_suit_is_one_message_and_nothing_is_written(content, here, capsys):
    (here / "map.toml").write_text(content)
    assert main(["import", "open.csv", "--map", "map.toml"]) == MISTAKE
    said = capsys.readouterr()
    assert WRONG[content] in said.err
    assert said.out == ""
    assert names(here) == ["log.csv", "map.toml", "open.csv"]


@pytest.mark.parametrize(
    "words, said",
    [
        (["none.csv"], "there is no such file"),
        (["."], "this is a folder"),
        (["log.csv", "--out", "record"], "must end in .csv"),
        (["log.csv", "--out", "log.csv"], "would replace a log"),
        (["log.csv", "--map-out", "map.txt"], "must end in .toml"),
        (["log.csv", "open.csv", "--map-out", "map.toml"], "writes the map of one log"),
        (["log.csv", "--map", "none.toml"], "there is no such file"),
    ],
)
def test_what_cannot_be_done_is_one_message(words, said, here, capsys):
    assert main(["import", *words]) == MISTAKE
    assert said in capsys.readouterr().err
    assert names(here) == ["log.csv", "open.csv"]


def test_several_logs_become_records_in_a_folder(here):
    (here / "log2.csv").write_text(LOG)
    assert main(["import", "log.csv", "log2.csv", "--out", "records"]) == FINE
    assert names(here / "records") == ["log.csv", "log.map.toml", "log2.csv", "log2.map.toml"]


def test_as_json_it_says_the_same(here, capsys):
    assert main(["import", "log.csv", "--json"]) == FINE
    said = json.loads(capsys.readouterr().out)
    assert said["files"] == ["record.csv", "record.map.toml"]
    assert said["logs"][0]["columns"][1] == {
        "column": "Speed (kn)", "channel": "surge_speed", "unit": "kn", "factor": "0.51444", "why": "unit in the name",
    }  # fmt: skip


def test_a_record_that_is_refused_says_that_import_reads_it(here, capsys):
    assert main(["compare", "fig6", "--measured", "log.csv"]) == MISTAKE
    assert "`subzero import` reads it" in capsys.readouterr().err


def wandering(start, step, names):
    rows = []
    for k in range(round(60.0 / step)):
        t = start + k * step
        values = {
            "depth_m": 5.0 + math.sin(0.3 * t) + 0.6 * math.sin(0.757 * t),
            "pitch_deg": math.sin(0.2 * t),
        }
        rows.append(",".join([f"{k * step:.2f}", *(f"{values[name]:.5f}" for name in names)]))
    return "\n".join([",".join(["time_s", *names]), *rows]) + "\n"


def test_two_logs_of_one_trial_are_merged_on_one_clock_or_nothing_is_written(here, capsys):
    (here / "a.csv").write_text(wandering(0.0, 0.1, ["depth_m"]))
    (here / "b.csv").write_text(wandering(4.0, 0.2, ["depth_m", "pitch_deg"]))
    assert main(["import", "a.csv", "b.csv", "--merge", "--out", "both.csv"]) == FINE
    assert "b.csv: its clock is +4 ± " in capsys.readouterr().out
    record = read_record("both.csv")
    known = record.values["pitch"] == record.values["pitch"]
    assert_allclose(record.values["pitch"][known], [math.sin(0.2 * t) for t in record.time[known]], atol=2e-3)
    assert names(here) == ["a.csv", "b.csv", "b.map.toml", "both.csv", "both.map.toml", "log.csv", "open.csv"]
    assert main(["import", "a.csv", "log.csv", "--merge", "--out", "c.csv"]) == MISTAKE
    assert "cannot be aligned: they share no channel" in capsys.readouterr().err
    assert not (here / "c.csv").exists()


def test_a_trial_begins_where_the_record_begins_and_lasts_as_long(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rows = "\n".join(f"{0.5 * k},{340.0 + k},{2.0 + 0.01 * k},{0.4}" for k in range(41))
    Path("log.csv").write_text(f"time_s,heading_deg,depth_m,surge_speed_m_s\n{rows}\n")
    assert main(["import", "log.csv", "--out", "flown.csv", "--trial", "flown.toml"]) == 0
    trial = subzero.load_scenario("flown.toml")
    assert trial.duration == 20.0
    start = trial.start
    assert (np.degrees(start.heading), start.depth) == pytest.approx((340.0, 2.0))
    assert not trial.commands.values.any()
    assert "flown.toml" in capsys.readouterr().out
    assert main(["import", "log.csv", "--out", "flown.csv", "--trial", "flown.toml"]) == 2


def test_a_trial_begins_within_a_turn_where_a_compass_counts_its_turns(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = "\n".join(f"{0.5 * k},{376.0 + k}" for k in range(41))
    Path("log.csv").write_text(f"time_s,heading_deg\n{rows}\n")
    assert main(["import", "log.csv", "--out", "flown.csv", "--trial", "flown.toml"]) == 0
    assert np.degrees(subzero.load_scenario("flown.toml").start.heading) == pytest.approx(16.0)


def test_a_trial_takes_the_commands_of_a_record(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = [
        "propeller_command_rps",
        "rudder_command_deg",
        "stern_plane_port_command_deg",
        "stern_plane_starboard_command_deg",
    ]
    rows = "\n".join(f"{0.5 * k},{10.0 + 0.1 * k},20,{0.1 * k},0,0" for k in range(21))
    Path("log.csv").write_text(",".join(["time_s", "heading_deg", *names]) + f"\n{rows}\n")
    assert main(["import", "log.csv", "--out", "flown.csv", "--trial", "flown.toml"]) == 0
    trial = subzero.load_scenario("flown.toml")
    assert trial.commands.values[0][0] == 20.0
    assert np.degrees(trial.commands.values[-1][1]) == pytest.approx(2.0)


@pytest.fixture
def log(tmp_path, monkeypatch):
    """A log in milliseconds and knots, with its map and its record."""
    monkeypatch.chdir(tmp_path)
    time = np.arange(0.0, 30.0, 0.5)
    run = subzero.simulate("fig6")
    shown = [np.interp(time, run["time"], run[name]) for name in ("heading", "surge_speed", "depth")]
    rows = "\n".join(
        f"{1e3 * t:.0f};{h:.3f};{u / 0.514444:.4f};{z:.4f}" for t, h, u, z in zip(time, *shown, strict=True)
    )
    Path("log.csv").write_text(f"Time [ms];hdg (deg);Speed (kn);depth (m)\n{rows}\n")
    assert main(["import", "log.csv"]) == FINE


@pytest.mark.long
def test_a_log_with_its_map_is_compared_as_its_record(log, capsys):
    for name, words in (("direct", ["log.csv", "--map", "record.map.toml"]), ("record", ["record.csv"])):
        assert main(["compare", "fig6", "--quiet", "--out", name, "--measured", *words]) == FINE
    direct, record = (
        json.loads(Path(name, "summary.json").read_text())["measured"]["channels"]
        for name in ("direct", "record")
    )
    assert direct.keys() == record.keys() == {"heading", "surge_speed", "depth"}
    for channel, numbers in direct.items():
        for label in ("tethered", "untethered"):
            assert numbers[label] == pytest.approx(
                record[channel][label], rel=1e-6, abs=1e-8
            )  # a record has ten digits
    assert main(["compare", "fig6", "--map", "record.map.toml"]) == MISTAKE
    assert "Add --measured" in capsys.readouterr().err


@pytest.mark.long
def test_a_log_with_its_map_is_diagnosed(log):
    assert main(["diagnose", "fig6", "log.csv", "--map", "record.map.toml", "--screen", "--quiet"]) == FINE
    assert main(["diagnose", "fig6", "log.csv", "--map", "missing.toml", "--quiet"]) == MISTAKE
