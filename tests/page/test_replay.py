"""What the page carries of a run is the run: to half a step of 16 bits, at its own times, however long it is.

The tolerance of a packed series is half of (high − low)/65534, as `subzero.page.replay` says; the drum's place and the
tow point come from the dataset and from rotation by scipy, not from the page.
"""

from __future__ import annotations

import base64
import json

import numpy as np
import pytest

from subzero.page.replay import MOST_SAMPLES, actors_of, encode, pack


def unpacked(series: dict) -> np.ndarray:
    if "doubles" in series:
        return np.frombuffer(base64.b64decode(series["doubles"]), "<f8")
    if "data" not in series:
        return np.full(series["n"], np.nan if series["low"] is None else series["low"])
    codes = np.frombuffer(base64.b64decode(series["data"]), "<i2").astype(float)
    return np.where(codes == -32768, np.nan, series["low"] + series["step"] * (codes + 32767))


@pytest.mark.parametrize(
    "values", [[0.0, 1.0, 0.3], [np.nan, -5.0, 1e6], [2.0, 2.0], [np.nan, np.nan], [np.nan, 3.0], [7.0]]
)
def test_a_packed_series_is_known_to_half_a_step(values: list[float]) -> None:
    low, high = (np.nanmin(values), np.nanmax(values)) if np.isfinite(values).any() else (0.0, 0.0)
    np.testing.assert_allclose(
        unpacked(pack(np.array(values))), values, atol=0.5 * (high - low) / 65534 * 1.001
    )


def test_every_channel_and_the_cable_are_those_of_the_run(runs: dict) -> None:
    data = encode(actors_of(runs))
    tethered, run = data["actors"][0], runs["tethered"]
    np.testing.assert_array_equal(unpacked(tethered["time"]), run["time"].values)
    for name, series in tethered["channels"].items():
        span = np.ptp(run[name].values)
        np.testing.assert_allclose(unpacked(series), run[name].values, atol=span / 65534, err_msg=name)
    tension = unpacked(tethered["cable"]["tension"]).reshape(-1, tethered["cable"]["points"])
    np.testing.assert_allclose(tension[-1, 0], run["cable_tension"].values[-1], atol=1e-4)


def test_the_cable_begins_at_the_tow_point_at_all_times(runs: dict) -> None:
    run, cable = runs["tethered"], encode(actors_of(runs))["actors"][0]["cable"]
    ends = [unpacked(cable[axis]).reshape(-1, cable["points"])[:, 0] for axis in ("north", "east", "down")]
    heading, pitch = (np.radians(run[name].values) for name in ("heading", "pitch"))
    stern = 0.5 * np.array([np.cos(heading) * np.cos(pitch), np.sin(heading) * np.cos(pitch), -np.sin(pitch)])
    hull = np.array([run[name].values for name in ("north", "east", "depth")])
    np.testing.assert_allclose(ends, hull - stern, atol=1e-3)


def test_a_run_of_ten_thousand_samples_and_three_hundred_nodes_stays_small(runs: dict) -> None:
    run = runs["tethered"]
    many = run.isel(time=np.arange(10_000) % run.sizes["time"], node=np.arange(300) % run.sizes["node"])
    many = many.assign_coords(time=0.1 * np.arange(10_000))
    many["node_count"] = ("time", np.full(10_000, 300))
    many["cable_position"] = many["cable_position"].fillna(0.0)
    data = encode(actors_of({"tethered": many, "untethered": many}))
    assert len(json.dumps(data)) < 4.4e6  # leaves 0.6 MB of 5 MB for the figures and the player
    times = unpacked(data["actors"][0]["time"])
    assert times.size <= MOST_SAMPLES + 1
    assert times[-1] == many["time"].values[-1]
