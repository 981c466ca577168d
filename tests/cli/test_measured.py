"""Measured records are read as they come, with gaps and jumps, or refused with all that is wrong."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from subzero.cli.app import FINE, MISTAKE, main
from subzero.errors import UserError
from subzero.records.record import Record, fit, modelled, read_record, with_heading_of


@pytest.fixture
def file(tmp_path, monkeypatch):
    """Write a record.csv into the working folder; returns its name."""
    monkeypatch.chdir(tmp_path)

    def write(text):
        (tmp_path / "record.csv").write_bytes(text.encode() if isinstance(text, str) else text)
        return "record.csv"

    return write


def test_a_record_holds_any_subset_of_the_channels_with_gaps(file):
    record = read_record(
        file("time_s,heading_deg,surge_speed_m_s\n# remark\n0,27,\n\n1.5,nan,0.5\n2,28,0.6\n")
    )
    assert_allclose(record.time, [0.0, 1.5, 2.0])
    assert_allclose(record.values["heading"], [27.0, np.nan, 28.0])
    assert_allclose(record.values["surge_speed"], [np.nan, 0.5, 0.6])


def test_what_a_spreadsheet_adds_does_no_harm(file):
    record = read_record(file("\ufefftime_s, depth_m\r\n0, 1.0\r\n1, 2.0\r\n"))
    assert_allclose(record.values["depth"], [1.0, 2.0])


def test_a_heading_that_jumps_from_360_to_0_is_made_continuous(file):
    record = read_record(file("time_s,heading_deg\n0,350\n1,358\n2,\n3,4\n4,12\n"))
    assert_allclose(record.values["heading"], [350.0, 358.0, np.nan, 364.0, 372.0])


RENAME = (
    "rename such a column, in the unit of its new name, or leave it out. Columns are time_s, surge_speed_m_s, "
    "heading_deg, yaw_rate_deg_s, pitch_deg, roll_deg, depth_m, cable_tension_N, and more in docs/diagnosis.md; "
    "`subzero import` reads it"
)
REFUSED = {
    "time_s,surge_sped_m_s,heading,x\n0,1,2,3\n": [
        "unknown column 'surge_sped_m_s'. Did you mean 'surge_speed_m_s'?",
        "unknown column 'heading'. Did you mean 'heading_deg'?",
        "unknown column 'x'.",
        RENAME,
    ],
    "Time [s],Speed (kn),Hdg,Yaw rate,Depth\n0,1,2,3,4\n": [
        "unknown column 'Time [s]'. Did you mean 'time_s'?",
        "unknown column 'Speed (kn)'. Did you mean 'surge_speed_m_s'?",
        "unknown column 'Hdg'. Did you mean 'heading_deg'?",
        "unknown column 'Yaw rate'. Did you mean 'yaw_rate_deg_s'?",
        "unknown column 'Depth'. Did you mean 'depth_m'?",
        RENAME,
        "column 'time_s' is missing; it is needed, in seconds since the first command",
    ],
    "time_s,roll_angle_deg,heading_rad\n0,1,2\n": [
        "unknown column 'roll_angle_deg'. Did you mean 'roll_deg'?",
        "unknown column 'heading_rad'. Did you mean 'heading_deg'?",
        RENAME,
    ],
    "time_s;depth_m\n0;1,5\n": [
        "its columns are separated by semicolons; separate them by commas, and write numbers with a point; "
        "`subzero import` reads it"
    ],
    "time_s,depth_m\n1700000000,1\n1700000001,2\n": [
        "the first time is '1700000000', seconds since 1970, a time of day: subtract the first one, and write seconds "
        "since the first command; `subzero import` reads it"
    ],
    "depth_m,depth_m\n0,1\n": [
        "column 'depth_m' occurs twice; keep one",
        "column 'time_s' is missing; it is needed, in seconds since the first command",
    ],
    "time_s\n0\n": ["there is no column beside the time; add a channel, such as 'surge_speed_m_s'"],
    "time_s,depth_m\n0,1\n1\n": ["line 3: 1 cells, but the header has 2 columns"],
    "time_s,depth_m\n0,deep\n1,inf\n,3\n0.5,4\n0.5,5\n": [
        "line 2, column 'depth_m': 'deep' is not a number; leave a gap empty",
        "line 3, column 'depth_m': 'inf' is not finite; leave a gap empty",
        "line 4: the time is missing; every sample needs one",
        "line 6: the time 0.5 s does not come after 0.5 s; time must increase",
    ],
    "time_s,depth_m\n0,\n1,nan\n": ["column 'depth_m' holds no number at all; remove it"],
}


@pytest.mark.parametrize("text", REFUSED)
def test_a_bad_record_is_refused_with_all_its_problems(text, file, rails, capsys):
    assert main(["compare", "fig6", "--measured", file(text)]) == MISTAKE
    said = capsys.readouterr().err.splitlines()
    assert said == [
        "The measured record record.csv cannot be used:",
        *(f"  {line}" for line in REFUSED[text]),
    ]
    assert rails == []


def test_a_hundred_problems_are_not_all_told(file):
    rows = "".join(f"{k},deep\n" for k in range(100))
    with pytest.raises(UserError, match=r"\.\.\. and 89 more\.$"):  # one of them: no number at all
        read_record(file("time_s,depth_m\n" + rows))


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"", b"time_s,depth_m\n", b"\x00\x01"])
def test_what_is_no_table_is_refused(content, file):
    with pytest.raises(UserError, match=r"^The measured record record\.csv "):
        read_record(file(content))


def test_the_error_of_a_model_is_that_of_the_textbook(make_run):
    run = make_run(samples=5).assign(depth=("time", [0.0, 1.0, 2.0, 3.0, 4.0]))
    measured = np.array(
        [1.0, 1.0, 3.0, np.nan, 9.0]
    )  # the model says 0, 2, 4; then a gap; then its end is over
    record = Record(source="", time=np.array([0.0, 0.2, 0.4, 0.4, 0.5]), values={"depth": measured})
    one = fit(run, record, "depth")
    spread = np.sqrt(np.sum((measured[:3] - 5.0 / 3.0) ** 2))
    assert one.samples == 3
    assert_allclose(
        [one.rmse, one.bias, one.fit_percent], [1.0, 1.0 / 3.0, 100.0 * (1.0 - np.sqrt(3.0) / spread)]
    )


def test_a_perfect_model_fits_by_100_percent_and_a_constant_record_by_nothing(make_run):
    run = make_run()
    time = run["time"].values[::7]
    record = Record(
        source="", time=time, values={"surge_speed": run["surge_speed"].values[::7], "depth": 0.0 * time}
    )
    perfect, constant = fit(run, record, "surge_speed"), fit(run, record, "depth")
    assert (perfect.rmse, perfect.bias, perfect.fit_percent) == (0.0, 0.0, 100.0)
    assert constant.rmse == 0.0
    assert np.isnan(constant.fit_percent)


@pytest.mark.parametrize("offset", [-2.0, 2.0])
def test_a_heading_measured_whole_turns_away_is_the_same_heading(offset, make_run):
    run = make_run()
    record = Record(
        source="", time=run["time"].values, values={"heading": run["heading"].values - 720.0 + offset}
    )
    assert fit(
        run, with_heading_of(record, modelled(run, "heading", record.time)), "heading"
    ).bias == pytest.approx(-offset, abs=1e-9)


@pytest.mark.long
def test_compare_prints_and_stores_the_error_of_each_model(file, rails, capsys, compared):
    path = compared.here / "fig6" / "tethered.csv"
    assert main(["compare", "fig6", "--measured", str(path), "--out", "out"]) == FINE
    said = capsys.readouterr().out
    assert "Model − measured" in said
    assert "surge_speed [m/s]" in said
    with open("out/summary.json", encoding="utf-8") as stored:
        fits = json.load(stored)["measured"]["channels"]["surge_speed"]
    assert fits["unit"] == "m/s"
    assert fits["tethered"]["rmse"] < 1e-9  # ten digits are written
    assert fits["untethered"]["rmse"] > 0.05
    assert set(fits["tethered"]) == {"samples", "rmse", "bias", "fit_percent"}


def test_a_gap_is_a_gap_with_either_sign_but_not_in_time(file):
    assert_allclose(
        read_record(file("time_s,depth_m\n0,-nan\n1,+NaN\n2,3\n")).values["depth"], [np.nan, np.nan, 3.0]
    )
    for time in ("-nan", "+nan", "NAN", ""):
        with pytest.raises(UserError, match=r"line 3: the time is missing; every sample needs one$"):
            read_record(file(f"time_s,depth_m\n0,1\n{time},2\n2,3\n"))


@pytest.mark.parametrize("cell", ["1e300", "-1e10", "1e999", "9" * 400])
def test_a_number_that_no_sensor_shows_is_refused(cell, file):
    with pytest.raises(
        UserError, match=r"line 2, column 'depth_m': '.* is (outside ±1e\+09|not finite); leave"
    ):
        read_record(file(f"time_s,depth_m\n0,{cell}\n1,2\n"))


def record_of(run, **changed):
    """Write a few channels of a run as a record, some changed, at times from `start` on."""
    start = changed.pop("start", 0.0)
    values = {name: run[name].values for name in ("surge_speed", "heading")}
    values |= {name: change(values[name]) for name, change in changed.items()}
    rows = zip(start + run["time"].values, *values.values(), strict=True)
    return "time_s,surge_speed_m_s,heading_deg\n" + "".join(
        f"{t:.1f},{u:.6f},{psi:.6f}\n" for t, u, psi in rows
    )


QUESTIONABLE = {
    "unit": (
        {"surge_speed": lambda u: 1.944 * u},
        "surge_speed_m_s looks like knots (1.94 times the simulation)",
    ),
    "radians": ({"heading": np.radians}, "heading_deg looks like radians"),
    "sign": ({"surge_speed": lambda u: -u}, "surge_speed_m_s has the opposite sign of the simulation"),
    "stuck": ({"surge_speed": lambda u: 0.0 * u + 1.0}, "surge_speed_m_s is 1 in every sample"),
    "clock": (
        {"start": 1.7e9 - 1.0e9},
        "the first time is 7e+08 s, but time_s counts from the start of the trial",
    ),
}


@pytest.mark.parametrize("what", QUESTIONABLE)
def test_a_comparison_asks_what_a_diagnosis_asks(what, file, rails, make_run, capsys):
    changed, said = QUESTIONABLE[what]
    assert main(["compare", "fig6", "--measured", file(record_of(make_run(), **changed))]) == MISTAKE
    message = capsys.readouterr().err
    assert message.startswith("The measured record record.csv cannot be compared:\n  ")
    assert said in message
    assert len(rails) == (0 if what == "clock" else 2)


@pytest.mark.long
def test_what_the_sidecar_says_is_checked_is_not_asked(file, rails, make_run, tmp_path):
    (tmp_path / "record.toml").write_text('units_checked = ["surge_speed_m_s"]\n')
    record = file(record_of(make_run(), surge_speed=lambda u: 1.944 * u))
    assert main(["compare", "fig6", "--measured", record]) == FINE


def test_a_comparison_of_no_sample_is_refused(file, rails, capsys):
    text = "time_s,surge_speed_m_s\n0,\n29,\n31,1\n32,1\n"
    assert main(["compare", "fig6", "--measured", file(text)]) == MISTAKE
    assert "none of its samples can be compared: where the runs are, it has gaps" in capsys.readouterr().err


@pytest.mark.long
def test_the_files_given_to_a_command_are_what_is_simulated(rails, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "log.csv").write_text("time_s,surge_speed_m_s,pitch_deg,heading_deg\n0,0.7,0,0\n30,0.7,0,0\n")
    (tmp_path / "told.csv").write_text(
        "time_s,propeller_rps,rudder_deg,stern_plane_port_deg,stern_plane_starboard_deg\n0,12.5,0,0,0\n30,12.5,0,0,0\n"
    )
    assert main(["simulate", "fig6", "--motion", "log.csv", "--out", "moved"]) == FINE
    assert main(["simulate", "fig6", "--commands", "told.csv", "--untethered", "--out", "told"]) == FINE
    (moved, tethered), (reported, bare) = rails
    assert (tethered, bare) == (True, False)
    assert_allclose(moved.motion.surge_speed, 0.7)
    assert_allclose(reported.commands.at(10.0), [12.5, 0.0, 0.0, 0.0])
