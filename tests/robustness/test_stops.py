"""A run that stops, stands still or does not fit is told in time, in sense, and with advice that helps.

Verifies: memory that a run would need, and that it outgrows; a run that stands still or will take hours; the words of a
stop. Tolerance: four of five stops are cured by what their message advises (slow: `benchmarks/stops.py`).
"""

from __future__ import annotations

import dataclasses
import io
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import cable
import scenarios
import subzero
from cable.moving_end.state import new_line
from cable.moving_end.stops import describe_stop
from subzero.cli.app import MISTAKE, main
from subzero.cli.progress import LONG_S, STANDSTILL_S, ProgressBar, costs_of

SHARE_CURED, STOPS = 0.8, 100


@pytest.fixture(scope="module")
def fig6():
    return subzero.load_scenario("fig6")


@pytest.fixture
def little_memory(monkeypatch):
    """100 MB are free."""
    monkeypatch.setattr("cable.memory.free_memory", lambda: 1e8)


def test_all_results_of_ten_hours_at_default_steps_are_refused_at_once_with_what_to_change(
    fig6, little_memory
):
    steps = []
    with pytest.raises(subzero.UserError) as caught:
        subzero.simulate(dataclasses.replace(fig6, duration=36000.0), every=0.1, progress=steps.append)
    assert not steps, "nothing is simulated before it is refused"
    said = str(caught.value)
    assert re.fullmatch(
        r"'fig6', 36000 s in steps of 0\.1 s, needs [0-9.e+]+ GiB of memory, and [0-9.]+ GiB are free\. "
        r"Keep fewer results \(every_s in the trial, or --every\), or try a longer cable_step_s or segment_length_m, "
        r"a grading, or a shorter duration_s\.",
        said,
    ), said


@pytest.mark.long
def test_what_is_advised_makes_a_long_run_fit(fig6, little_memory):
    long = dataclasses.replace(fig6, duration=1200.0, cable_step=0.2, rtol=0.0)
    with pytest.raises(subzero.UserError, match="GiB of memory"):
        subzero.simulate(long, every=0.2)
    assert subzero.simulate(long, every=60.0).attrs["outcome"] == "completed"
    shorter = dataclasses.replace(fig6, duration=30.0)
    assert subzero.simulate(shorter).attrs["outcome"] == "completed"
    with pytest.raises(subzero.UserError, match="GiB of memory"):
        cable.pull_out(lambda t: (1.0, 0.0, 0.0), 1000.0)


def test_the_command_line_refuses_what_does_not_fit(tmp_path, monkeypatch, capsys, little_memory):
    text = scenarios.path("fig6").read_text(encoding="utf-8")
    text, count = re.subn(r"duration_s = \d+", "duration_s = 36000", text)
    assert count == 1
    (tmp_path / "long.toml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "long.toml"]) == MISTAKE
    assert "GiB of memory" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["long.toml"]


def test_a_run_that_outgrows_the_memory_keeps_what_it_has(fig6, monkeypatch):
    whole = subzero.simulate(fig6)
    monkeypatch.setattr("subzero.simulation.run.fits_in_memory", lambda _: False)
    monkeypatch.setattr("subzero.simulation.run.new_recording", with_little_room)
    run = subzero.simulate(fig6)
    assert run.attrs["outcome"] == "stopped"
    assert re.match(r"The cable's shapes until t = [0-9.]+ s fill the memory", run.attrs["outcome_message"])
    rows = run.sizes["time"]
    assert 10 < rows < whole.sizes["time"]
    np.testing.assert_array_equal(run["surge_speed"], whole["surge_speed"][:rows])


def with_little_room(rows, nodes, times, entries):
    from subzero.engine.recording import new_recording

    return new_recording(rows, min(nodes, 2000), times, entries)


@pytest.fixture
def clock(monkeypatch):
    """A clock that is set by hand."""
    now = [0.0]
    monkeypatch.setattr("subzero.cli.progress.monotonic", lambda: now[0])
    return now


@pytest.fixture
def bar(clock):
    """A progress bar into a text."""
    text = io.StringIO()
    made = ProgressBar("Simulating mine", Console(file=text, width=60), lambda: "What costs is the cable.")
    made.text = text
    return made


def test_work_that_stands_still_is_told_once_in_one_line(bar, clock):
    bar(0.25)
    for clock[0] in (1.0, STANDSTILL_S - 0.1):
        bar.check()
    assert bar.text.getvalue() == ""
    for clock[0] in (STANDSTILL_S, STANDSTILL_S + 1.0, 10.0 * STANDSTILL_S):
        bar.check()
    assert bar.text.getvalue() == (
        "Simulating mine stands at 25 % and has not moved on for 20 s. What costs is the cable.\n"
    )


def test_work_that_moves_is_not_told_to_stand_still(bar, clock):
    for k in range(100):
        clock[0] = k * 0.9 * STANDSTILL_S
        bar(k / 100.0)
        bar.check()
    assert "has not moved" not in bar.text.getvalue()


def test_work_that_will_take_hours_is_told(bar, clock):
    clock[0] = STANDSTILL_S
    bar(STANDSTILL_S / (2.1 * LONG_S))
    bar.check()
    assert "will take about 2.1 hours more at this rate. What costs" in bar.text.getvalue()


def test_compiling_is_no_standing_still(bar, clock, monkeypatch):
    monkeypatch.setattr("subzero.cli.progress._compiling", lambda: True)
    for clock[0] in range(100):
        bar.check()
    monkeypatch.undo()
    assert "has not moved" not in bar.text.getvalue()


def test_while_functions_are_compiled_their_number_grows_on_a_line_every_second(bar, clock, monkeypatch):
    monkeypatch.setattr("subzero.cli.progress._compiling", lambda: True)
    for count in (1, 1, 12):
        monkeypatch.setattr("subzero.jit.machine_code._compiled", [count])
        bar.check()
    monkeypatch.setattr("subzero.cli.progress._compiling", lambda: False)
    bar.check()
    assert bar.text.getvalue() == " 1. 12 functions.\n"


@pytest.mark.parametrize(("flags", "costs"), [([], "cable"), (["--untethered"], "vehicle")])
def test_a_command_whose_run_stands_still_says_so_while_it_computes(
    flags, costs, tmp_path, monkeypatch, capsys
):
    """The thread looks while the calculation does not come back; without a cable that is not what costs."""
    from threading import Event

    reported = Event()

    def stuck(*_args, progress, **_more):
        progress(0.5)
        assert reported.wait(60.0), "nobody told it"
        raise subzero.UserError("Enough.")

    tell = ProgressBar._notify
    monkeypatch.setattr(ProgressBar, "_notify", lambda self, *words: (tell(self, *words), reported.set()))
    monkeypatch.setattr("subzero.cli.progress.STANDSTILL_S", 0.05)
    monkeypatch.setattr("subzero.cli.progress.CHECK_S", 0.01)
    monkeypatch.setattr("subzero.simulation.run.simulate", stuck)
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "fig6", *flags]) == MISTAKE
    line = next(line for line in capsys.readouterr().err.splitlines() if "stands at" in line)
    words = (
        f"Simulating fig6 stands at 50 % and has not moved on for 0 s\\. What costs is the {costs}, .* Try .*"
    )
    assert re.fullmatch(words, line)


def test_what_costs_is_what_would_take_longest(fig6):
    assert "What costs is the cable, up to" in costs_of(dataclasses.replace(fig6, segment_length=0.01))
    assert "What costs is the vehicle" in costs_of(dataclasses.replace(fig6, hull_step=0.0001))
    assert "What costs is the vehicle" in costs_of(fig6, tethered=False)


@pytest.mark.parametrize("residual", [0.0, 0.04, 0.99])
@pytest.mark.parametrize("stiff", [False, True])
def test_a_stop_never_says_that_something_is_off_by_less_than_its_tolerance(residual, stiff):
    """A free drum that would take cable up stops a run whose equations all hold."""
    line = new_line(4)
    line.ends.count, line.ends.solved.converged, line.ends.solved.residual = 4, False, residual
    made = cable.CableProperties(bending_stiffness=1.0 if stiff else 0.0)
    for drum in (cable.DrumProperties(), cable.ConstantTension(tension=1.0)):
        said = describe_stop(3.0, line, drum.numbers(), made.numbers())
        assert not re.search(r"off by 0|off by \d\.\de-", said), said
        assert " Try " in said


@pytest.mark.slow
def test_four_of_five_stops_are_cured_by_what_they_advise():
    sys.path.insert(0, str(Path(__file__).parents[2]))
    from benchmarks.stops import followed

    found = followed(STOPS)
    cured = sum(one.cured_by is not None for one in found)
    print(f"\n{cured} of {STOPS} cured")
    assert cured >= SHARE_CURED * STOPS
    assert not [one.message for one in found if re.search(r"off by (0|\d\.\de-)", one.message)]
