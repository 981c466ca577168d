"""Files that were damaged, or that claim what cannot be, are one `UserError`; their numbers are never used.

Verifies: `subzero.files.integrity` at `open_run`, `subzero plot`, `simulate(checkpoint=...)` and `sweep(out=...)`.
Configuration: 2 s of fig6. What is read is compared to the last bit. Long form: ``python -m benchmarks.damaged_files``.
"""

from __future__ import annotations

import contextlib
import dataclasses
import shutil
import sqlite3
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr

import subzero
from subzero.cli.app import MISTAKE, main
from subzero.files.integrity import MARK, TAIL, append_digest
from subzero.results.netcdf_csv import write_netcdf
from subzero.simulation.checkpoint import STATE, Checkpoint

FIG6 = dataclasses.replace(subzero.load_scenario("fig6"), duration=2.0, rtol=0.0)


ONE_FLIP = Path(__file__).parents[3] / "shared" / "data" / "field_cases" / "robustness" / "oneflip.nc"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("written") / "tethered.nc"
    write_netcdf(subzero.simulate(FIG6), path)
    return path


def with_bytes(tmp_path, data):
    path = tmp_path / "damaged.nc"
    path.write_bytes(data)
    return path


# Runs.


def test_a_copy_is_read_and_so_is_a_file_of_another_program(written, tmp_path):
    run = subzero.open_run(written)
    data = written.read_bytes()
    assert data[-TAIL:].startswith(MARK)
    xr.testing.assert_identical(subzero.open_run(with_bytes(tmp_path, data)), run)
    xr.testing.assert_identical(
        subzero.open_run(with_bytes(tmp_path, data[:-TAIL])), run
    )  # an earlier version
    run.to_netcdf(tmp_path / "again.nc")
    xr.testing.assert_identical(subzero.open_run(tmp_path / "again.nc"), run)
    with netCDF4.Dataset(tmp_path / "again.nc", "a") as file:
        file.setncattr("title", "changed in place by another program")
    assert subzero.open_run(tmp_path / "again.nc").attrs["title"].startswith("changed")
    (tmp_path / "changed.nc").write_bytes(data)
    with netCDF4.Dataset(tmp_path / "changed.nc", "a") as file:
        file.setncattr("title", "changed in place by another program, and longer than before" * 9)
    assert subzero.open_run(tmp_path / "changed.nc").attrs["title"].startswith("changed")


@pytest.mark.parametrize("seed", range(20))
def test_one_flipped_bit_anywhere_is_found(written, tmp_path, seed):
    data, rng = bytearray(written.read_bytes()), np.random.default_rng(seed)
    at = int(rng.integers(len(data))) if seed > 3 else len(data) - (1, TAIL, TAIL - 20, TAIL + 1)[seed]
    data[at] ^= 1 << int(rng.integers(8))
    with pytest.raises(subzero.UserError, match=r"is damaged: .*\. Take a copy of it, or run"):
        subzero.open_run(with_bytes(tmp_path, bytes(data)))


def test_cut_and_lengthened_files_are_found(written, tmp_path):
    data = written.read_bytes()
    for other in (
        data[: len(data) // 2],
        data[: -TAIL // 2],
        data[: -TAIL - 1],
        data + b"x",
        data[100:],
        data + data[-TAIL:],
    ):
        with pytest.raises(subzero.UserError):
            subzero.open_run(with_bytes(tmp_path, other))


@pytest.mark.parametrize("seed", range(15))
def test_a_run_without_digest_with_a_flipped_bit_is_read_or_refused(written, tmp_path, capsys, seed):
    data, rng = bytearray(written.read_bytes()[:-TAIL]), np.random.default_rng(seed)
    at = int(rng.integers(len(data)))
    data[at] ^= 1 << int(rng.integers(8))
    try:
        assert "Tethered run of fig6" in repr(subzero.open_run(with_bytes(tmp_path, bytes(data))).subzero)
    except subzero.UserError as refused:
        assert str(refused).count("\n") == 0  # noqa: PT017  # either is right


@pytest.mark.skipif(not ONE_FLIP.exists(), reason="the field case is not here")
def test_subzero_plot_says_that_a_run_of_an_earlier_version_is_damaged(capsys, tmp_path):
    """One bit is flipped where an attribute stands, in a run of fig6 of version 0.2, which has no digest."""
    assert main(["plot", str(ONE_FLIP), "--out", str(tmp_path / "figures")]) == MISTAKE
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "is damaged" in said


def claim(file, name, kind, axes):
    file.createVariable(name, kind, axes, chunksizes=[min(64, file.dimensions[axis].size) for axis in axes])


@pytest.mark.parametrize(
    ("name", "axes", "words"),
    [
        ("surge_speed", ("huge",), "surge_speed has another shape"),
        ("surge_speed", ("time", "node"), "surge_speed has another shape"),
        ("cable_tension", (), "cable_tension has another shape"),
        ("cable_position", ("time",), "cable_position has another shape"),
        ("note", ("huge",), "claims 8e\\+11 bytes"),
    ],
)
def test_a_file_that_claims_other_shapes_is_refused_before_it_is_read(written, tmp_path, name, axes, words):
    run = subzero.open_run(written).drop_vars(name, errors="ignore")
    path = tmp_path / "claims.nc"
    run.to_netcdf(path)
    with netCDF4.Dataset(path, "a") as file:
        file.createDimension("huge", 10**11)
        claim(file, name, "f8", axes)
    with pytest.raises(subzero.UserError, match=words):
        subzero.open_run(path)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda run: run.assign_coords(time=run["time"][::-1].values), "times do not rise"),
        (lambda run: run.assign_coords(time=np.full(run.sizes["time"], np.nan)), "times do not rise"),
        (lambda run: run.isel(time=slice(0)), "times do not rise"),
        (lambda run: run.assign_attrs(warnings="[{"), "JSONDecodeError"),
        (lambda run: run.assign_attrs(tethered="yes"), "tethered is of another kind"),
        (lambda run: run.assign_attrs(outcome=3), "outcome is of another kind"),
        (
            lambda run: run.assign(surge_speed=run["surge_speed"].astype(str)),
            "surge_speed is of another kind",
        ),
    ],
)
def test_values_that_no_run_has_are_refused(written, tmp_path, change, words):
    change(subzero.open_run(written)).drop_encoding().to_netcdf(tmp_path / "odd.nc")
    with pytest.raises(subzero.UserError, match=words):
        subzero.open_run(tmp_path / "odd.nc")


# Checkpoints.


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    checkpoint = Checkpoint(folder=tmp_path_factory.mktemp("kept"), minutes=0.0)
    subzero.simulate(FIG6, checkpoint=checkpoint)
    return checkpoint


@pytest.fixture
def kept(checkpoint):
    path = next(Path(checkpoint.folder).glob(f"*/*/{STATE}"))
    good = path.read_bytes()
    yield checkpoint, path
    path.write_bytes(good)


def rewritten(path, arrays):
    """Write arrays in the place of others, with a digest that holds."""
    with open(path, "wb") as file:
        np.savez(file, **arrays)
    append_digest(path)


CHANGES = {
    "shorter": lambda array: array[:-1],
    "longer": lambda array: np.concatenate([array, array[-1:]]),
    "flat": lambda array: array.reshape(-1)[:, None],
    "single": lambda array: array.astype(np.float32),
    "texts": lambda array: array.astype(str),
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize(
    "name", ["live.state", "live.line.position", "live.line.length", "setup.orders.time", "live.now"]
)
def test_arrays_of_another_shape_or_kind_never_reach_compiled_code(kept, change, name):
    checkpoint, path = kept
    arrays = dict(np.load(path))
    arrays[name] = CHANGES[change](arrays[name])
    rewritten(path, arrays)
    with pytest.raises(subzero.UserError, match=r"^The checkpoint .* is damaged"):
        subzero.simulate(FIG6, checkpoint=checkpoint)


@pytest.mark.parametrize("name", ["behind", "room", "used"])
@pytest.mark.parametrize("value", [10**12, -1, 2.5, [1, 2], "x"])
def test_counts_that_cannot_be_are_refused(kept, name, value):
    checkpoint, path = kept
    rewritten(path, dict(np.load(path)) | {name: np.array(value)})
    with pytest.raises(subzero.UserError, match=r"^The checkpoint .* is damaged"):
        subzero.simulate(FIG6, checkpoint=checkpoint)


def test_a_flipped_bit_in_a_number_of_a_checkpoint_is_found(kept):
    checkpoint, path = kept
    good = path.read_bytes()
    for at in (60, len(good) // 2, len(good) - 5):
        path.write_bytes(good[:at] + bytes([good[at] ^ 4]) + good[at + 1 :])
        with pytest.raises(subzero.UserError, match=r"^The checkpoint .* is damaged"):
            subzero.simulate(FIG6, checkpoint=checkpoint)
    path.write_bytes(good)


# Stores of sweeps.

SWEEP = {"scenario": FIG6, "parameters": {"start.wet_length_m": [0.0, 1.0, 2.0]}, "workers": 1}


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    folder = tmp_path_factory.mktemp("swept")
    good = subzero.sweep(**SWEEP, out=folder).load()
    return folder, good


def copied(swept, tmp_path):
    shutil.copytree(swept[0], tmp_path, dirs_exist_ok=True)
    return tmp_path / "members.sqlite"


@pytest.mark.long
def test_damaged_members_of_a_sweep_are_run_again(swept, tmp_path):
    """One member each has other numbers, other kinds, and a number that it cannot have."""
    with contextlib.closing(sqlite3.connect(copied(swept, tmp_path))) as store, store:
        store.execute(
            "UPDATE members SET scalars = zeroblob(length(scalars)), channels = 'text' WHERE member = 0"
        )
        store.execute(
            "UPDATE members SET own = cast(x'ff7b' AS TEXT), warnings = '[', reason = 3.5 WHERE member = 1"
        )
        store.execute("UPDATE members SET member = 700000 WHERE member = 2")
    xr.testing.assert_identical(subzero.sweep(**SWEEP, out=tmp_path).load(), swept[1])


@pytest.mark.parametrize("at", [30, 110, 4100, 8200, 12200])
def test_a_store_with_spoilt_pages_is_refused_or_repaired(swept, tmp_path, at):
    path = copied(swept, tmp_path)
    data = path.read_bytes()
    path.write_bytes(data[:at] + b"\xff" * 64 + data[at + 64 :])
    try:
        again = subzero.sweep(**SWEEP, out=tmp_path).load()
    except subzero.UserError as refused:
        assert "members.sqlite" in str(refused) or "another sweep" in str(refused)  # noqa: PT017  # either is right
    else:
        xr.testing.assert_identical(again, swept[1])
