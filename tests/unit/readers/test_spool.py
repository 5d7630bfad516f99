"""Files whose columns are kept on disk: the same recordings, calibrations and findings."""

import numpy as np
import pandas as pd
import pytest

import gmwm
from gmwm._core.memory import limited
from gmwm._core.spool import is_spooled
from gmwm.readers import tuning

N = 20_000
UNITS = {"gyro": "deg/s", "accel": "g"}


@pytest.fixture(scope="module")
def frame():
    """With stamps of a jittery clock that jumps, rows written twice, empty fields and a code."""
    rng = np.random.default_rng(3)
    values = rng.standard_normal((N, 4)) + np.array([0.0, 0.0, 0.0, 100.0])
    found = pd.DataFrame(values, columns=["gyro_x", "gyro_y", "gyro_z", "accel_z"])
    found["accel_z"] *= 0.01
    found["temp_degC"] = 20.0 + 1e-4 * np.arange(N)
    found.insert(0, "time_s", 0.01 * (np.arange(N) + 0.05 * rng.standard_normal(N)))
    found.loc[11_500, "gyro_y"] = np.nan
    found.loc[7000:7003, "gyro_z"] = -9999.0
    return pd.concat([found[:3000], found[2990:12_000], found[12_005:]]).round(9)


def files(frame, folder):
    frame.to_csv(folder / "a.csv", index=False)
    frame.to_csv(folder / "a.csv.gz", index=False)
    frame.to_parquet(folder / "a.parquet")
    np.save(folder / "a.npy", frame.to_records(index=False))
    frame.to_feather(folder / "a.feather")
    return sorted(folder.iterdir())


def test_a_file_on_disk_is_read_as_in_memory(frame, tmp_path, monkeypatch):
    monkeypatch.setattr(tuning, "ROWS_OF_BLOCK", 3000)
    for path in files(frame.reset_index(drop=True), tmp_path):
        once = gmwm.read(path, units=UNITS)
        with limited(1e-4):
            long = gmwm.read(path, units=UNITS)
        assert long.notices == once.notices, path
        assert long.rate == once.rate
        for name in once:
            assert is_spooled(long[name].values), (path, name)
            assert not is_spooled(once[name].values)
            np.testing.assert_array_equal(long[name].values, once[name].values)


def test_records_of_increments_on_disk(tmp_path):
    rng = np.random.default_rng(5)
    record = np.dtype([("time", "f8"), ("values", "i4", (6,))])
    rows = np.zeros(N, record)
    rows["time"] = 0.005 * np.arange(N)
    rows["values"] = rng.integers(-300, 300, (N, 6)) + np.array([0, 0, 0, 0, 0, 32_000])
    rows.tofile(tmp_path / "a.bin")
    options = {"layout": "int32,1e-6,1.53e-6"}
    once = gmwm.read(tmp_path / "a.bin", **options)
    with limited(1e-4):
        long = gmwm.read(tmp_path / "a.bin", **options)
    for name in once:
        np.testing.assert_array_equal(long[name].values, once[name].values)


def test_arrays_that_are_not_mapped_are_read_a_column_at_a_time(tmp_path, monkeypatch):
    pytest.importorskip("h5py")
    import h5py

    values = np.random.default_rng(6).standard_normal((N, 3))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["gyro"] = values
    monkeypatch.setattr("gmwm._core.memory._HELD", 1 << 16)
    found = gmwm.read(tmp_path / "a.h5", rate=100.0, units={"gyro": "rad/s"})
    assert is_spooled(found["gyro_z"].values)
    np.testing.assert_array_equal(found["gyro_z"].values, values[:, 2])


def test_a_recording_on_disk_is_examined_and_calibrated_as_in_memory(frame, tmp_path):
    frame.to_csv(tmp_path / "a.csv", index=False)
    once = gmwm.read(tmp_path / "a.csv", units=UNITS)
    with limited(1e-4):
        long = gmwm.read(tmp_path / "a.csv", units=UNITS)
    assert gmwm.health(long).to_dict() == gmwm.health(once).to_dict()
    model = gmwm.WhiteNoise() + gmwm.RandomWalk()
    found, expected = (gmwm.calibrate(each, model, jobs=1).to_dict() for each in (long, once))
    assert found == expected
