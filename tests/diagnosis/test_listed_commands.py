"""Commands of listed actuators in a measured record: those of another vehicle are refused in words."""

from __future__ import annotations

import numpy as np
import pytest

import subzero


def test_commands_of_thrusters_that_a_vehicle_lacks_are_refused(tmp_path):
    time = np.arange(0.0, 20.0, 0.1)
    rows = np.column_stack([time, 0.0 * time, 0.5 + 0.01 * time, 0.1 + 0.0 * time])
    header = "time_s,heading_deg,surge_speed_m_s,bow_command"
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header=header, comments="")
    with pytest.raises(subzero.UserError, match=r"not those of fig6(.|\n)*commands\.bow"):
        subzero.diagnose(tmp_path / "log.csv", "fig6", commands="record")
