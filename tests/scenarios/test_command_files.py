"""Command files that cannot be used: every wrong cell, column and time, with its line."""

from dataclasses import replace

import numpy as np
import pytest

import scenarios
from scenarios.steps import sample_times

HEADER = "time_s,propeller_rps,rudder_deg,stern_plane_port_deg,stern_plane_starboard_deg\n"
RUDDER = "Allowed: -90 to 90 degree (rudder, positive turns to starboard)."
PROPELLER = "Allowed: -200 to 200 rev/s (propeller speed, positive drives forward)."

LOGS = {
    "unknown and missing column": (
        HEADER.replace("rudder", "ruder") + "0,27,0,0,0\n30,27,0,0,0\n",
        "log.csv, line 1, header: found 'ruder_deg', but there is no such column. Did you mean 'rudder_deg'?",
        "log.csv, line 1, rudder_deg: this column is missing. "
        "Needed: time_s, propeller_rps, rudder_deg, stern_plane_port_deg, stern_plane_starboard_deg.",
    ),
    "column twice": (
        HEADER.strip() + ",time_s\n0,27,0,0,0,0\n30,27,0,0,0,0\n",
        "log.csv, line 1, header: found 'time_s', but this column stands twice. Keep one of the two.",
    ),
    "bad cells": (
        HEADER + "0,27,0,0,0\n1,nan,0,0,0\n2,fast,,0,0\n30,27,200,0,0\n",
        f"log.csv, line 3, propeller_rps: found 'nan', but this is not a finite number. {PROPELLER}",
        f"log.csv, line 4, propeller_rps: found 'fast', but this is not a number. {PROPELLER}",
        f"log.csv, line 4, rudder_deg: this cell is empty. {RUDDER}",
        f"log.csv, line 5, rudder_deg: found '200', but this is outside its limits. {RUDDER}",
    ),
    "short row": (
        HEADER + "0,27,0,0,0\n1,27\n30,27,0,0,0\n",
        "log.csv, line 3: found 2 cells, but the header has 5 columns. Give every column one cell.",
    ),
    "time not increasing": (
        HEADER + "0,27,0,0,0\n2,27,0,0,0\n1,27,0,0,0\n30,27,0,0,0\n",
        "log.csv, line 4, time_s: found 1.0, but the time before it is 2. "
        "Times must increase from sample to sample.",
    ),
    "ends early": (
        HEADER + "0,27,0,0,0\n4,27,0,0,0\n8,27,0,0,0\n",
        "log.csv, line 4, time_s: found 8.0, but the file ends early: the run lasts 30 s. "
        "Add rows up to 30 s, or set duration_s to 8.",
    ),
    "two rows far apart": (
        HEADER + "0,27,0,0,0\n28,27,0,0,0\n",
        "log.csv, line 3, time_s: found 28.0, but the file ends early: the run lasts 30 s. "
        "Add rows up to 30 s, or set duration_s to 28.",
    ),
    "one row": (
        HEADER + "0,27,0,0,0\n",
        "log.csv, line 2, time_s: found 0.0, but the file ends early: the run lasts 30 s. "
        "Add rows up to 30 s.",
    ),
    "no rows": (HEADER, "log.csv: there are no rows below the header. Add one a sample."),
    "empty": ("\n\n", "log.csv: the file is empty. Write a header line and one row for each sample."),
}  # fmt: skip


@pytest.mark.parametrize("case", LOGS)
def test_a_command_file_that_cannot_be_used_gives_these_lines(case, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    log, *expected = LOGS[case]
    (tmp_path / "log.csv").write_text(log, encoding="utf-8")
    with pytest.raises(scenarios.ScenarioError) as caught:
        scenarios.load("fig6", commands_csv="log.csv")
    assert [str(problem) for problem in caught.value.problems] == expected


def test_a_message_stays_readable_however_much_is_wrong(tmp_path):
    log = tmp_path / "log.csv"
    log.write_text(HEADER + "".join(f"{time},nan,0,0,0\n" for time in range(1000)))
    with pytest.raises(scenarios.ScenarioError) as caught:
        scenarios.load("fig6", commands_csv=log)
    assert len(caught.value.problems) == 1000
    lines = str(caught.value).splitlines()
    assert len(lines) == 12
    assert lines[0] == "The scenario cannot be used (1000 problems):"
    assert lines[-1] == "  ... and 990 more."


def test_what_is_commanded_at_a_time_is_the_sample_that_holds():
    """From its own time on, to rounding; before the first sample the first, after the last one the last."""
    commands = scenarios.Commands(time=np.array([0.0, 0.3, 2.0]), values=np.arange(12.0).reshape(3, 4) / 10.0)
    held = commands.at(np.array([[-1.0, 0.0, 0.299], [0.1 * 3, 0.1 + 0.2, 1e9]]))
    assert held[..., 0].tolist() == [[0.0, 0.0, 0.0], [0.4, 0.4, 0.8]]
    assert commands.at(0.1 * 20).tolist() == [0.8, 0.9, 1.0, 1.1]
    assert commands.at(0.3 - 1e-12).tolist() == [0.4, 0.5, 0.6, 0.7]


def test_every_time_grid_starts_at_zero_and_ends_as_it_says():
    """Of a run: it ends with the run, in a last step that is not tiny. Even: it covers the run. Samples: none later."""
    trial = replace(scenarios.load("fig6"), duration=1.0, cable_step=0.3, hull_step=0.1, commands=None)
    assert np.allclose(trial.times(), [0.0, 0.3, 0.6, 0.9, 1.0])
    assert trial.times()[-1] == 1.0
    assert np.allclose(replace(trial, duration=0.91).times(), [0.0, 0.3, 0.6, 0.91])
    assert np.allclose(trial.even_times(), [0.0, 0.3, 0.6, 0.9, 1.2])
    assert replace(trial, duration=0.9).even_times().tolist() == replace(trial, duration=0.9).times().tolist()
    assert np.allclose(sample_times(0.3, 0.1), [0.0, 0.1, 0.2, 0.3])
    assert np.allclose(sample_times(0.29, 0.1), [0.0, 0.1, 0.2])
