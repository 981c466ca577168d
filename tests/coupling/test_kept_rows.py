"""Results that are kept every so often are those of a run that keeps all, to the last bit.

Verifies: `every` of a trial, of `simulate`, `compare` and the command line. Configuration: fig6; stop_and_drift, which
is repeated in finer steps; a last step that is no whole one; a run that stops; the paper's scheme. Tolerance: identity.
"""

import dataclasses

import numpy as np
import pytest
import xarray as xr

import scenarios
import subzero
from subzero.cli.app import FINE, MISTAKE, main
from subzero.simulation.memory_estimate import MOST_KEPT, bytes_of_results, with_fewer_results


def held_against(plain, kept):
    """Hold what was kept against the same rows of a run that kept all."""
    rows = np.searchsorted(plain["time"].values, kept["time"].values)
    nodes = int(kept["node_count"].max()) if "node" in kept.dims else 0
    same = plain.isel(time=rows, node=slice(0, max(nodes, 1)))
    xr.testing.assert_equal(same, kept)
    for what in ("outcome", "outcome_message", "accuracy", "parameters"):
        assert same.attrs[what] == kept.attrs[what]


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "fields", "every", "times"),
    [
        ("fig6", {}, 1.0, np.arange(31.0)),
        ("fig6", {"duration": 10.25}, 0.7, [*(0.7 * np.arange(15)), 10.25]),
        ("stop_and_drift", {"duration": 22.0}, 5.0, [0.0, 5.0, 10.0, 15.0, 20.0, 22.0]),
        ("fig6", {"duration": 5.0}, 100.0, [0.0, 5.0]),
        ("fig6", {"scheme": "paper_tangent", "cable_step": 0.5}, 4.0, [*range(0, 30, 4), 30.0]),
    ],
)
def test_what_is_kept_is_the_same_to_the_last_bit(name, fields, every, times):
    trial = dataclasses.replace(subzero.load_scenario(name), **fields)
    kept = subzero.simulate(trial, every=every)
    np.testing.assert_allclose(kept["time"], times, rtol=0.0, atol=1e-9)
    held_against(subzero.simulate(trial), kept)


def test_without_a_cable_too():
    held_against(
        subzero.simulate("fig6", tethered=False), subzero.simulate("fig6", tethered=False, every=2.0)
    )


@pytest.mark.long
def test_a_run_that_stops_keeps_the_last_that_it_had():
    fig6 = subzero.load_scenario("fig6")
    stiff = dict(fig6.cable) | {"bending_stiffness": 1.0, "mass_per_length": 0.2}
    for change in ({"scheme": "paper_drum"}, {"cable": stiff, "rtol": 0.0}):
        one = dataclasses.replace(fig6, **change)
        plain = subzero.simulate(one)
        assert plain.attrs["outcome"] == "stopped"
        kept = subzero.simulate(one, every=1.0)
        assert kept["time"].values[-1] == plain["time"].values[-1]
        held_against(plain, kept)


def test_both_runs_of_a_comparison_are_kept_so():
    both = subzero.compare("fig6", every=10.0)
    assert [run.sizes["time"] for run in both.runs.values()] == [4, 4]


def test_a_record_is_set_beside_all_results(tmp_path):
    run = subzero.simulate("fig6", every=1.0)
    rows = [f"{t},{u}" for t, u in run["surge_speed"].to_series().items()]
    (tmp_path / "record.csv").write_text("\n".join(["time_s,surge_speed_m_s", *rows]), encoding="utf-8")
    with pytest.raises(subzero.UserError, match=r"Every 1 s is too seldom .* Leave out every_s"):
        subzero.compare("fig6", measured=tmp_path / "record.csv", every=1.0)


@pytest.mark.parametrize("every", [0.25, -1.0, np.nan, 1e9])
def test_what_is_no_whole_number_of_cable_steps_is_refused(every):
    with pytest.raises(subzero.UserError, match="every"):
        subzero.simulate("fig6", every=every)


@pytest.mark.long
def test_the_file_and_the_command_say_it(tmp_path, monkeypatch, capsys):
    text = scenarios.path("fig6").read_text(encoding="utf-8").replace("duration_s = 30.0", "duration_s = 3.0")
    (tmp_path / "mine.toml").write_text(text.replace("every_s = 0.0", "every_s = 0.5"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "mine.toml"]) == FINE
    assert len((tmp_path / "mine" / "tethered.csv").read_text(encoding="utf-8").splitlines()) == 1 + 7
    assert main(["compare", "mine.toml", "--every", "1.0", "--out", "other"]) == FINE
    assert len((tmp_path / "other" / "untethered.csv").read_text(encoding="utf-8").splitlines()) == 1 + 4
    capsys.readouterr()
    assert main(["simulate", "mine.toml", "--every", "0.55"]) == MISTAKE
    assert "0.5 or 0.6" in capsys.readouterr().err


@pytest.fixture
def little_kept(monkeypatch):
    """Of fig6, 0.4 MB are kept unasked, and all of it takes 1 MB about."""
    monkeypatch.setattr("subzero.simulation.memory_estimate.MOST_KEPT", 4e5)


def test_a_long_run_keeps_fewer_results_unasked_says_so_and_keeps_all_when_told_to(little_kept):
    kept, plain = subzero.simulate("fig6"), subzero.simulate("fig6", every=0.1)
    assert kept["time"].values[1] in (0.2, 0.5, 1.0)
    held_against(plain, kept)
    assert kept.attrs["thinned"].startswith(
        f"Results are kept every {kept['time'].values[1]:g} s of this long run"
    )
    assert "every_s = 0.1 in the trial, or --every 0.1, keeps all" in kept.attrs["thinned"]
    assert plain.sizes["time"] == 301
    assert "thinned" not in plain.attrs


@pytest.mark.long
def test_both_runs_of_a_comparison_keep_as_many_and_a_record_is_set_beside_all(
    little_kept, tmp_path, monkeypatch, capsys
):
    both = subzero.compare("fig6")
    assert both.tethered["time"].equals(both.untethered["time"])
    assert both.tethered.attrs["thinned"] == both.untethered.attrs["thinned"]
    rows = [f"{t},{u}" for t, u in both.tethered["surge_speed"].to_series().items()]
    (tmp_path / "record.csv").write_text("\n".join(["time_s,surge_speed_m_s", *rows]), encoding="utf-8")
    assert subzero.compare("fig6", measured=tmp_path / "record.csv").tethered.sizes["time"] == 301
    monkeypatch.chdir(tmp_path)
    assert main(["simulate", "fig6"]) == FINE
    assert capsys.readouterr().out.count("Results are kept every") == 1


def test_thirty_minutes_with_two_kilometres_of_cable_keep_what_fits_and_five_minutes_of_fig6_all():
    fig6 = subzero.load_scenario("fig6")
    start = dataclasses.replace(fig6.start, wet_length=1800.0)
    long = dataclasses.replace(fig6, duration=1800.0, start=start)
    for trial, wanted in ((long, False), (dataclasses.replace(fig6, duration=300.0), True)):
        model = subzero.Model.of(trial)
        kept = with_fewer_results(trial, model, True)
        assert (kept is trial) == wanted
        rows = trial.times().size // kept.stride
        assert bytes_of_results(kept, model, True, rows) <= MOST_KEPT
