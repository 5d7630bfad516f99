"""MAT, HDF5, Parquet, Feather and tables in memory."""

from __future__ import annotations

import resource

import h5py
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
from pyarrow import parquet
from scipy.io import savemat

import gmwm
from bags import START, at_rest
from gmwm.readers.formats import hdf5
from gmwm.readers.names import CANONICAL
from marks import slow
from reading import SI, refusal

X = at_rest()
NAMES = [f"gyro_{a} [rad/s]" for a in "xyz"] + [f"accel_{a} [m/s^2]" for a in "xyz"]


def exact(recording, samples=X):
    return all(
        np.array_equal(recording[name].values, column)
        for name, column in zip(CANONICAL, samples.T, strict=True)
    )


@pytest.fixture(scope="module")
def frame():
    data = pd.DataFrame(X, columns=NAMES)
    data.insert(0, "time", pd.to_datetime(START + 10_000_000 * np.arange(len(X))))
    data["temperature [degC]"] = 30.0
    return data


# -- tables in memory -----------------------------------------------------------------------------


def test_frames(frame):
    table = pa.Table.from_pandas(frame)
    for data in (frame, frame.set_index("time"), pl.from_pandas(frame), table):
        found = gmwm.read(data)
        assert exact(found)
        assert found.rate == pytest.approx(100.0, rel=1e-12)
        assert found["temperature"].mean == 30.0


def test_columns_without_names():
    assert exact(gmwm.read(pd.DataFrame(X), rate=100, units=SI))
    assert exact(gmwm.read(pl.DataFrame(X), rate=100, units=SI, channels=dict(
        zip(CANONICAL, range(6), strict=True))))  # fmt: skip


def test_missing_values(frame):
    holes = frame.copy()
    holes.loc[5, NAMES[0]] = np.nan
    assert np.isnan(gmwm.read(holes)["gyro_x"].values[5])
    nulls = pl.from_pandas(frame).with_columns(
        pl.when(pl.arange(0, len(X)) == 7).then(None).otherwise(pl.col(NAMES[5])).alias(NAMES[5])
    )
    assert np.flatnonzero(np.isnan(gmwm.read(nulls)["accel_z"].values)).tolist() == [7]


def test_whole_numbers_keep_the_digits_of_stamps(frame):
    data = frame.rename(columns={"time": "timestamp [ns]"})
    data["timestamp [ns]"] = data["timestamp [ns]"].astype("int64") + np.arange(200) % 2
    assert gmwm.read(data).jitter == pytest.approx(1e-7, rel=0.1)


def test_frames_that_cannot_be_used(frame):
    words = frame.assign(**{NAMES[0]: "word"})
    assert "holds" in refusal(words)
    assert "is not a usable number" in refusal(frame.assign(**{NAMES[0]: np.inf}))
    assert "no column is known" in refusal(frame[["time"]])
    assert "give the unit" in refusal(pd.DataFrame(X, columns=list(CANONICAL)), rate=100)
    assert "holds no columns" in refusal(pd.DataFrame())
    assert "single column" in refusal(frame["time"])
    unsorted = frame.iloc[np.random.default_rng(1).permutation(200)]
    assert "row" in refusal(unsorted)


# -- Parquet and Feather --------------------------------------------------------------------------


@pytest.mark.parametrize("end", ["parquet", "feather"])
def test_files_of_arrow(tmp_path, frame, end):
    path = tmp_path / f"a.{end}"
    getattr(frame, f"to_{end}")(path)
    assert exact(gmwm.read(path))
    whole = path.read_bytes()
    for size in (0, 4, len(whole) // 2):
        path.write_bytes(whole[:size])
        assert "is damaged or cut off" in refusal(path)


def test_fields_of_messages_are_columns(tmp_path):
    columns = {"time": pa.array(START + 10_000_000 * np.arange(len(X)), pa.timestamp("ns"))}
    for name, part in (("angular_velocity", X[:, :3]), ("linear_acceleration", X[:, 3:])):
        columns[name] = pa.array([dict(zip("xyz", row, strict=True)) for row in part.tolist()])
    table = pa.table(columns)
    parquet.write_table(table, tmp_path / "a.parquet")
    for data in (table, tmp_path / "a.parquet"):
        assert exact(gmwm.read(data, units=SI))


# -- MAT and HDF5 ---------------------------------------------------------------------------------


@pytest.fixture
def in_this_process(monkeypatch):
    """Whole files need no process of their own, which takes a third of a second to begin."""
    monkeypatch.setattr(hdf5, "tried", lambda opener, path: opener(path))


def test_mat(tmp_path, in_this_process):
    path = tmp_path / "a.mat"
    savemat(path, {"gyro": X[:, :3], "accel": X[:, 3:].T, "fs": 100.0, "note": "static"})
    assert exact(gmwm.read(path, units=SI))
    savemat(path, {"imu": {"gyro": X[:, :3], "accel": X[:, 3:], "dt": 0.01, "id": "a"}})
    found = gmwm.read(path, units=SI)
    assert exact(found)
    assert found.rate == pytest.approx(100.0)
    savemat(path, {"data": np.column_stack([np.arange(200) / 100, X])}, do_compression=True)
    assert exact(gmwm.read(path, units=SI))
    savemat(path, dict(zip(CANONICAL, X.T, strict=True)), oned_as="column")
    assert exact(gmwm.read(path, units=SI, rate=100))


def test_mat_that_cannot_be_used(tmp_path, in_this_process):
    path = tmp_path / "a.mat"
    savemat(path, {"note": "static"})
    assert "holds no arrays of numbers" in refusal(path)
    savemat(path, {"gyro": X[:, :3], "accel": X[:100, 3:], "fs": 100.0})
    assert "give every column the same length" in refusal(path, units=SI)
    savemat(path, {"gyro": X[:, :3], "a": {"fs": 100.0}, "b": {"fs": 200.0}})
    assert "several rates" in refusal(path, units=SI)
    whole = path.read_bytes()
    for size in (0, 100, 130, len(whole) // 2):
        path.write_bytes(whole[:size])
        assert "a.mat" in refusal(path)


def test_hdf5(tmp_path, in_this_process):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        gyro = file.create_dataset("imu0/gyro", data=X[:, :3], compression="gzip", chunks=(50, 3))
        gyro.attrs["units"] = "rad/s"
        file["imu0/accel"] = X[:, 3:]
        file["imu0/accel"].attrs["units"] = "m/s^2"
        file["imu0/time"] = np.arange(200) / 100
        file["imu0/time"].attrs["units"] = "s"
        file["imu0/temperature"] = np.full(200, 30.0)
        file["camera/images"] = np.zeros((3, 4, 5))
        file["note"] = "static"
    found = gmwm.read(path)
    assert exact(found)
    assert found.rate == pytest.approx(100.0)
    assert any(channel.quantity == "temperature" for channel in found.values())
    whole = path.read_bytes()
    for size in (0, 10, 600, len(whole) - 500):
        path.write_bytes(whole[:size])
        assert "a.h5 is" in refusal(path)


def test_mat_73_is_transposed(tmp_path, in_this_process):
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["imu/gyro"] = X[:, :3].T
        file["imu/accel"] = X[:, 3:].T
        file["fs"] = np.array([[100.0]])
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512))
    assert exact(gmwm.read(path, units=SI))


def test_compound_of_hdf5(tmp_path, in_this_process):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        rows = np.zeros(200, dtype=[(name, "f8") for name in NAMES])
        for name, column in zip(NAMES, X.T, strict=True):
            rows[name] = column
        file["imu"] = rows
    assert exact(gmwm.read(tmp_path / "a.h5", rate=100))


def test_without_the_library(tmp_path, monkeypatch):
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["gyro"] = X[:, :3]
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    assert refusal(path) == "a.h5 needs h5py, which is not installed: pip install 'gmwm[hdf5]'"


def test_missing_half_floats_of_any_pattern_are_missing():
    """A NaN that signals was a warning wherever it was reckoned with."""
    codes = np.random.default_rng(4).normal(size=2000).astype(np.float16).view(np.uint16)
    codes[7] = 0x7D00
    table = pa.table({"gyro_x": pa.array(codes.view(np.float16))})
    rec = gmwm.read(table, rate=100.0, units={"gyro": "rad/s"})
    assert np.flatnonzero(np.isnan(rec["gyro_x"].values)).tolist() == [7]


@pytest.mark.parametrize(("place", "size"), [slow("collection", 1 << 40), ("free space", 0)])
def test_a_damaged_heap_of_hdf5_is_refused(place, size, tmp_path, monkeypatch):
    """It goes on without end where free space has no size, or where it ends before the heap does
    and zeros follow.
    """
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["gyro_x"] = np.random.default_rng(3).normal(size=300)
        file["gyro_x"].attrs["units"] = "rad/s"
    data = bytearray(path.read_bytes())
    start = data.find(b"GCOL")
    assert gmwm.read(path, rate=100.0)["gyro_x"].n == 300
    where, index = start + 16, 1
    while index:
        index = int.from_bytes(data[where : where + 2], "little")
        length = int.from_bytes(data[where + 8 : where + 16], "little")
        where += 16 + -(-length // 8) * 8 if index else 0
    at = where + 8 if place == "free space" else start + 8
    data[at : at + 8] = size.to_bytes(8, "little")
    begin = "from gmwm.readers.formats import hdf5; hdf5._SECONDS = 1; hdf5.answer()"
    monkeypatch.setattr(hdf5, "_PROGRAM", begin)
    path.write_bytes(data)
    with pytest.raises(gmwm.InputError, match="damaged"):
        gmwm.read(path, rate=100.0)


@pytest.mark.parametrize("version", [slow("earliest"), "latest"])
def test_a_unit_longer_than_its_file_is_refused_before_the_library_makes_room(version, tmp_path):
    """For a damaged length of 3.9 GB it takes as much memory."""
    path = tmp_path / "a.h5"
    with h5py.File(path, "w", libver=version) as file:
        file["gyro_x"] = np.random.default_rng(3).normal(size=300)
        file["gyro_x"].attrs["units"] = "rad/s"
    assert gmwm.read(path, rate=100.0)["gyro_x"].n == 300
    data = path.read_bytes()
    place = data.find(b"GCOL").to_bytes(8, "little")  # its address follows the length
    assert data.count(b"\5\0\0\0" + place) == 1
    path.write_bytes(data.replace(b"\5\0\0\0" + place, b"\0\0\0\xe0" + place))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(gmwm.InputError, match=r"a\.h5 is damaged or cut off"):
        gmwm.read(path, rate=100.0)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < before + 100_000


@pytest.mark.parametrize("shape", [(200, 1), (1, 200)])
def test_a_column_of_two_dimensions_is_a_series(tmp_path, in_this_process, shape):
    values = np.random.default_rng(2).normal(size=(2, 200))
    path = tmp_path / "columns.h5"
    with h5py.File(path, "w") as file:
        for name, each in zip(("gyro_x", "gyro_y"), values, strict=True):
            file[name] = each.reshape(shape)
        file["image"] = np.zeros((200, 1, 200))  # of three dimensions, which is no series
    found = gmwm.read(path, rate=100.0, units={"gyro": "rad/s"})
    assert found.names == ("gyro_x", "gyro_y")
    for channel, each in zip(found.channels, values, strict=True):
        np.testing.assert_array_equal(channel.values, each)
