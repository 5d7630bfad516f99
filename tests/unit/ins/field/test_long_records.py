"""Records that are longer than memory should hold: the same numbers, from disk."""

from dataclasses import replace

import numpy as np
import pytest

from gmwm._core import spool
from gmwm._core.spool import Spool, is_spooled
from gmwm.ins import Imu, Navigated, read_imu
from gmwm.ins.field.start.standing import standstills
from gmwm.study.emulated_logs import emulated_log


def on_disk(values):
    found = Spool(3)
    for part in np.array_split(values, 3):
        found.append(part)
    return found.array()


@pytest.fixture(scope="module")
def drive():
    return emulated_log(7, duration=160.0, rate=10.0, faults=("off-grid",))[0]


@pytest.fixture
def short_windows(monkeypatch):
    monkeypatch.setattr(spool, "ROWS", 97)


def test_a_filter_that_pauses_goes_on_as_if_it_had_not(drive, short_windows, monkeypatch):
    long = replace(drive.imu, rotation=on_disk(drive.imu.rotation),
                   velocity=on_disk(drive.imu.velocity))  # fmt: skip
    found = Navigated.of(replace(drive, imu=long))
    monkeypatch.undo()
    once = Navigated.of(drive)
    assert is_spooled(long.rotation)
    for name in ("lla", "covariance", "matrix", "states", "sensor_covariance"):
        assert np.array_equal(getattr(found.solution, name), getattr(once.solution, name)), name
    innovations = once.solution.innovations
    assert np.array_equal(found.solution.innovations.value, innovations.value, equal_nan=True)


def test_standstills_are_the_same(drive, short_windows):
    long = Imu(drive.imu.dt, on_disk(drive.imu.rotation), on_disk(drive.imu.velocity))
    found, once = (standstills(each, drive.aiding, 0.02) for each in (long, drive.imu))
    assert once.time.size
    assert np.array_equal(found.time, once.time)


def test_a_long_file_is_read_as_a_short_one(tmp_path, monkeypatch):
    """With stamps that jitter by a tenth of a step, a row left out, and a field left empty."""
    rng, n, dt = np.random.default_rng(3), 20_000, 0.01
    samples = np.array([0, 0, 0, 0, 0, -9.8]) + 0.01 * rng.standard_normal((n, 6))
    stamps = 5e4 + dt * np.arange(n) + 0.001 * rng.standard_normal(n)
    samples[11_500, 4] = np.nan
    keep = np.arange(n) != 12_000
    names = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    np.savetxt(tmp_path / "imu.csv", np.column_stack([stamps, samples])[keep], "%.9f", ",",
               header=",".join(["time_s", *names]), comments="")  # fmt: skip
    once = read_imu(tmp_path / "imu.csv", units=units, channels={"gyro_x": "-gyro_x"} | {
        each: each for each in names[1:]
    })  # fmt: skip
    monkeypatch.setenv("GMWM_MEMORY", "1e-4")
    monkeypatch.setattr("gmwm.ins.field.imu_file.ROWS", 5000)
    long = read_imu(tmp_path / "imu.csv", units=units, channels={"gyro_x": "-gyro_x"} | {
        each: each for each in names[1:]
    })  # fmt: skip
    assert is_spooled(long.rotation)
    assert not is_spooled(once.rotation)
    assert long.n == once.n == n
    assert long.dt == pytest.approx(once.dt, rel=1e-6)
    assert np.allclose(long.rotation / long.dt, once.rotation / once.dt, rtol=0.0, atol=1e-12)
    assert np.allclose(long.velocity / long.dt, once.velocity / once.dt, rtol=0.0, atol=1e-12)
