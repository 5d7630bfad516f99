"""The simulated IMU of the demonstration, and the files to try commands with."""

from math import pi

import numpy as np
import pytest

import gmwm
from emulated_logs import emulated_log
from gmwm import ins
from gmwm.study.demo import DRIVE, RATE, simulated_imu, write_demo_files
from gmwm.study.navigation import TABLE_5, TABLE_6

DEG_PER_HOUR = pi / 180.0 / 3600.0
MICRO_G = 9.80665e-6


def test_table_six_in_si():
    models = {"gyro": TABLE_6.models["gyro_x"], "accel": TABLE_6.models["accel_x"]}
    assert list(models) == ["gyro", "accel"]
    gyro = {"N": 140.0 * DEG_PER_HOUR}
    # By rising correlation time, 1/beta.
    for i, (sigma, beta) in enumerate([(206.0, 10.0), (65.0, 0.05), (113.0, 0.0005)], start=1):
        gyro |= {f"sigma_{i}": sigma * DEG_PER_HOUR, f"tau_{i}": 1.0 / beta}
    accel = {"N": 140.0 * MICRO_G}
    for i, (sigma, beta) in enumerate([(5.0, 0.04), (13.0, 0.002)], start=1):
        accel |= {f"sigma_{i}": sigma * MICRO_G, f"tau_{i}": 1.0 / beta}
    assert models["gyro"].params == pytest.approx(gyro, rel=1e-12, abs=0.0)
    assert models["accel"].params == pytest.approx(accel, rel=1e-12, abs=0.0)
    tuned = {"N": 1e5 * MICRO_G, "sigma": 4e4 * MICRO_G, "tau": 100.0}
    assert TABLE_5.models["accel_z"].params == pytest.approx(tuned, rel=1e-12)


def test_simulated_recording():
    recording, truth = simulated_imu(100.0, seed=3, sensors=TABLE_6)
    names = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
    assert recording.names == names
    assert tuple(truth) == names
    assert recording.rate == pytest.approx(RATE)
    assert recording.n == 100 * RATE
    assert "seed 3" in recording.source
    models = {"gyro": TABLE_6.models["gyro_x"], "accel": TABLE_6.models["accel_x"]}
    for channel in recording.values():
        model = models[channel.quantity]
        assert channel.name.startswith(channel.quantity)
        assert channel.unit == {"gyro": "rad/s", "accel": "m/s^2"}[channel.quantity]
        assert truth[channel.name] == model
        # At one sample the level is known to 1.7 % (1 sigma).
        wv = gmwm.wavelet_variance(channel)
        expected = model.haar_variance(wv.tau[:1], wv.dt)
        np.testing.assert_allclose(wv.variance[:1], expected, rtol=0.08)


def test_the_seed_decides():
    one, again, other = (simulated_imu(10.0, seed)[0] for seed in (1, 1, 2))
    for name in one.names:
        np.testing.assert_array_equal(one[name].values, again[name].values)
        assert not np.array_equal(one[name].values, other[name].values)
    axes = np.array([one[f"gyro_{axis}"].values for axis in "xyz"])
    assert np.abs(np.corrcoef(axes)[np.triu_indices(3, 1)]).max() < 0.2  # axes are independent


def test_files_to_try_are_read_as_they_were_made(tmp_path):
    arm = write_demo_files(tmp_path, 60.0, seed=2)
    still, moving = (gmwm.read(tmp_path / name) for name in ("static.csv", "imu.csv"))
    assert [each.unit for each in still.values()] == 3 * ["rad/s"] + 3 * ["m/s^2"]
    assert (still.n, still.rate) == (1500, pytest.approx(25.0))
    # Forward, right, down; the bias of switching on has 0.1 m/s^2.
    assert still["accel_z"].mean == pytest.approx(-9.80665, abs=0.5)
    fixes = ins.read_fixes(tmp_path / "fixes.csv", lever_arm=arm)
    assert {each.kind for each in fixes.fixes} == {"position", "velocity"}
    position = fixes.fixes[0]
    assert position.time[-1] <= moving.n * moving.dt
    np.testing.assert_allclose(position.sd, np.tile([1.0, 1.0, 1.5], (position.time.size, 1)))
    log, _ = emulated_log(2, duration=DRIVE, rate=25.0)
    np.testing.assert_allclose(position.value, log.aiding.fixes[0].value, atol=1e-6)
    rate = log.imu.rotation * 25.0
    np.testing.assert_allclose(moving["gyro_z"].values, rate[:, 2], atol=1e-8)
