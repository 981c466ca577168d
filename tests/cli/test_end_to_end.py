"""The whole way once, with the real simulation: a command, its files, a record, the Python of README and tour."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose

import scenarios
import subzero
from subzero.channels import CHANNELS
from subzero.cli.app import FINE, MISTAKE, main

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def fig6(tmp_path_factory):
    """The folder that ``subzero compare fig6`` leaves."""
    folder = tmp_path_factory.mktemp("real") / "fig6"
    assert main(["compare", "fig6", "--out", str(folder)]) == FINE
    return folder


@pytest.mark.long
def test_a_real_run_has_every_channel_with_its_unit_and_says_where_it_came_from(fig6):
    for name in ("tethered", "untethered"):
        with xr.open_dataset(fig6 / f"{name}.nc") as run:
            for channel in CHANNELS:
                assert run[channel.name].dims == ("time",)
                assert run[channel.name].attrs["units"] == channel.unit
                assert np.isfinite(run[channel.name].values).all(), channel.name
            assert run.attrs["outcome"] == "completed"
            assert run.attrs["scenario_text"] == scenarios.path("fig6").read_text(encoding="utf-8")
            assert json.loads(run.attrs["parameters"])["cable"]["diameter"] == 0.0025


def test_the_cable_slows_the_vehicle_and_the_energy_balance_closes(fig6):
    summary = json.loads((fig6 / "summary.json").read_text(encoding="utf-8"))
    tethered, untethered = summary["tethered"], summary["untethered"]
    assert tethered["speed_at_end_m_s"] < tethered["peak_speed_m_s"] < untethered["peak_speed_m_s"]
    assert tethered["largest_cable_force_N"] > 0.0 == untethered["largest_cable_force_N"]
    assert tethered["energy"]["unexplained_share"] < 1e-3
    assert untethered["energy"]["unexplained_share"] < 1e-3


@pytest.mark.long
def test_a_run_measured_against_itself_fits_by_100_percent(fig6, tmp_path):
    record = ["compare", "fig6", "--measured", str(fig6 / "tethered.csv"), "--out", str(tmp_path)]
    assert main(record) == FINE
    channels = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))["measured"]["channels"]
    assert set(channels) == {channel.name for channel in CHANNELS}
    assert channels["surge_speed"]["tethered"]["fit_percent"] == pytest.approx(100.0, abs=1e-6)  # ten digits
    assert channels["surge_speed"]["untethered"]["fit_percent"] < 90.0


@pytest.mark.long
def test_fig4_lies_on_the_exact_line_at_every_step(tmp_path):
    from subzero.figures import exact_tension

    assert main(["simulate", "fig4", "--out", str(tmp_path)]) == FINE
    with xr.open_dataset(tmp_path / "tethered.nc") as run:
        assert_allclose(run["cable_tension"].values[1:], exact_tension(run)[1:], rtol=1e-6)


def test_a_vehicle_that_cannot_be_built_is_a_mistake_not_a_bug(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = scenarios.path("fig6").read_text(encoding="utf-8")
    Path("mine.toml").write_text(text.replace("[changes]", '[changes]\n"vehicle.hull.nose_length" = 0.9\n'))
    assert main(["simulate", "mine.toml"]) == MISTAKE
    said = capsys.readouterr().err
    assert said.startswith("The scenario cannot be used (1 problem):\n  subzero2, line ")
    assert "together they are longer than the hull, 1 m. Allowed:" in said
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


def run_python_of(page):
    """Carry out the blocks of Python of a page; return their names."""
    names: dict[str, object] = {}
    for block in re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), re.DOTALL):
        exec(block, names)
    return names


def test_the_python_of_the_readme_runs_in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert isinstance(run_python_of("README.md")["comparison"], subzero.Comparison)
    assert {path.name for path in tmp_path.iterdir()} == {"tension.png", "fig6.png"}


@pytest.mark.long
def test_the_python_of_the_tour_runs(tmp_path, monkeypatch):
    """After the command whose file it opens."""
    monkeypatch.chdir(tmp_path)
    assert main(["compare", "fig6"]) == FINE
    names = run_python_of("docs/python.md")
    assert set(names["numbers"]) >= {"peak_speed_m_s", "path_length_m", "energy"}  # type: ignore[call-overload]
    assert "fig6" in names["figures"]  # type: ignore[operator]
    assert isinstance(names["comparison"], subzero.Comparison)
