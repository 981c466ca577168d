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
from subzero.cli import FINE, MISTAKE, main


def held_against(plain, kept):
    """Hold what was kept against the same rows of a run that kept all."""
    rows = np.searchsorted(plain["time"].values, kept["time"].values)
    nodes = int(kept["node_count"].max()) if "node" in kept.dims else 0
    same = plain.isel(time=rows, node=slice(0, max(nodes, 1)))
    xr.testing.assert_equal(same, kept)
    for what in ("outcome", "outcome_message", "accuracy", "parameters"):
        assert same.attrs[what] == kept.attrs[what]


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


def test_a_run_that_stops_keeps_the_last_that_it_had():
    fig6 = subzero.load_scenario("fig6")
    taut = scenarios.Winch(control="pay_out_rate", time=(0.0,), setpoint=(0.1,))
    for change in ({"scheme": "paper_drum"}, {"winch": taut, "rtol": 0.0}):
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
