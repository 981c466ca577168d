"""No variable hides a method of xarray, and what was written under an old name is read as before."""

from __future__ import annotations

import xarray as xr
from numpy.testing import assert_allclose

import subzero
from subzero.channels import CHANNELS, RENAMED_CHANNELS
from subzero.diagnosis import read_extended


def run():
    return subzero.simulate("fig6")


def test_every_variable_can_be_written_with_a_dot():
    """``run.roll`` was the method that rolls a dataset around."""
    result = run()
    assert not [name for name in result.variables if hasattr(xr.Dataset, name) or hasattr(xr.DataArray, name)]
    for name in result.variables:
        assert getattr(result, name).name == name


def test_columns_are_what_they_were():
    assert {channel.column for channel in CHANNELS} >= {
        "roll_deg",
        "pitch_deg",
        "heading_deg",
        "roll_rate_deg_s",
    }


def test_a_record_with_roll_deg_is_the_channel_roll_angle(tmp_path):
    (tmp_path / "record.csv").write_text("time_s,roll_deg\n0,1.5\n1,2.5\n")
    assert_allclose(subzero.read_record(tmp_path / "record.csv").values["roll_angle"], [1.5, 2.5])


def test_a_file_with_the_old_name_is_opened_by_the_new_one(tmp_path):
    result = run()
    back = {now: old for old, now in RENAMED_CHANNELS.items()}
    result.rename_vars(back).to_netcdf(tmp_path / "tethered.nc")
    assert_allclose(subzero.open_run(tmp_path / "tethered.nc").roll_angle, result.roll_angle)


def test_an_extended_model_with_the_old_id_is_read(tmp_path):
    path = tmp_path / "extended.toml"
    path.write_text('scenario = "fig6"\n[effects."sensor_bias:roll"]\nshift_deg = 0.2\n')
    assert read_extended(path).extended.deviations == {"sensor_bias:roll_angle": {"shift": 0.2}}
