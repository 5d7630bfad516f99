"""Logs of PX4, written by pyulog, and of ArduPilot, written as its format says."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pymavlink.DFReader import DFReader_binary

import gmwm
from flight_logs import (
    BATCH,
    IMU,
    TIME,
    X,
    combined,
    fifo,
    fifo_counts,
    imu_messages,
    single,
    write_dataflash,
    write_ulog,
)
from gmwm.readers.logs import ardupilot
from gmwm.readers.names import CANONICAL
from reading import refusal


def exact(recording, samples=X):
    return all(
        np.array_equal(recording[name].values, column.astype(float))
        for name, column in zip(CANONICAL, samples.T, strict=True)
    )


def kept(sensor, samples=X):
    return samples * np.float32([sensor == "gyro"] * 3 + [sensor == "accel"] * 3)


def three(sensor, samples=X):
    return samples[:, :3] if sensor == "gyro" else samples[:, 3:]


def raw(sensor):
    """Messages of raw logging, and their format."""
    name, part = {"gyro": ("GYR", "Gyr"), "accel": ("ACC", "Acc")}[sensor]
    form = (name, "QBQfff", f"TimeUS,I,SampleUS,{','.join(f'{part}{axis}' for axis in 'XYZ')}")
    times = 10**6 + 2500 * np.arange(len(X))
    return form, [
        (name, t, 0, t, *map(float, v)) for t, v in zip(times, three(sensor), strict=True)
    ]


HALVES = {
    "combined": lambda path, sensor: write_ulog(path, combined(kept(sensor))),
    "fifo": lambda path, sensor: write_ulog(
        path, fifo(sensor, three(sensor, fifo_counts()), 0.001 if sensor == "gyro" else 0.0024)
    ),
    "single": lambda path, sensor: write_ulog(path, single(sensor, three(sensor))),
    "IMU": lambda path, sensor: write_dataflash(path, [IMU], imu_messages(kept(sensor))),
    "raw": lambda path, sensor: write_dataflash(path, [raw(sensor)[0]], raw(sensor)[1]),
}


@pytest.mark.parametrize("kind", HALVES)
@pytest.mark.parametrize(("there", "word"), [("accel", "angular rates"), ("gyro", "accelerations")])
def test_a_log_of_one_sensor_is_read_by_the_name_of_it_only(tmp_path, kind, there, word):
    path = HALVES[kind](tmp_path / "a.log", there)
    message = refusal(path)
    assert f"a.log has no {word}, or only zeros, in " in message
    assert f'channels="{there}"' in message
    found = gmwm.read(path, channels=there)
    assert {each.name.partition("_")[0] for each in found.inertial} == {there}
    assert not [each for each in found.notices if each.severity != "note"]


def test_one_sensor_of_a_log_that_has_both_may_be_chosen(tmp_path):
    forms, messages = zip(raw("gyro"), raw("accel"), strict=True)
    path = write_dataflash(tmp_path / "a.bin", forms, [*messages[0], *messages[1]])
    assert exact(gmwm.read(path))
    assert list(gmwm.read(path, topic="GYR[0]")) == ["gyro_x", "gyro_y", "gyro_z"]


# -- PX4 ------------------------------------------------------------------------------------------


def test_sensor_combined(tmp_path):
    path = write_ulog(
        tmp_path / "a.ulg",
        combined(),
        single("gyro", X[:4, :3], TIME[::50]),
        single("accel", X[:4, 3:], TIME[::50]),
        ("vehicle_status", 0, TIME[:5], {}),
    )
    found = gmwm.read(path)
    assert exact(found)
    assert found.rate == pytest.approx(250.0)
    assert np.nanmax(found["sensor_accel_temperature"].values) == 41.0
    assert "units from the definition of sensor_combined: gyro_x" in str(found)
    assert "time stamps (stamps of sensor_combined, microseconds)" in str(found)


def test_accelerometer_with_stamps_of_its_own(tmp_path):
    # Half the rate of the gyros: each sample is there twice, with the offset of its own stamp.
    samples = X.copy()
    samples[1::2, 3:] = samples[::2, 3:]
    relative = np.tile([-500, -4500], 100)
    found = gmwm.read(write_ulog(tmp_path / "a.ulg", combined(samples, relative)))
    assert [1.0 / found[name].dt for name in ("gyro_x", "accel_x")] == pytest.approx([250.0, 125.0])
    # The accelerometer begins half a millisecond before the gyros, which cuts nothing.
    assert np.array_equal(found["accel_z"].values, samples[: 2 * found["accel_z"].n : 2, 5])


def test_fifo(tmp_path):
    counts = fifo_counts()
    path = write_ulog(
        tmp_path / "a.ulg", fifo("gyro", counts[:, :3], 0.001), fifo("accel", counts[:, 3:], 0.0024)
    )
    found = gmwm.read(path)
    scale = np.float32([0.001] * 3 + [0.0024] * 3).astype(float)
    assert exact(found, counts * scale)
    assert found.rate == pytest.approx(8000.0, rel=1e-6)


def test_instances_are_sensors(tmp_path):
    counts = fifo_counts()
    pairs = [
        fifo(sensor, part * (1 + i), 0.001 if sensor == "gyro" else 0.0024 / (1 + i), instance=i)
        for i in range(2)
        for sensor, part in (("gyro", counts[:, :3]), ("accel", counts[:, 3:]))
    ]
    path = write_ulog(tmp_path / "a.ulg", *pairs)
    message = refusal(path)
    assert "sensor_gyro_fifo[0] (100 messages, gyro only)" in message and "topic=" in message
    found = gmwm.read(path, topic=["sensor_gyro_fifo[1]", "sensor_accel_fifo[1]"])
    assert np.array_equal(found["gyro_x"].values, 2 * counts[:, 0] * float(np.float32(0.001)))


def test_samples_that_cover_less_than_a_step_are_thinned(tmp_path):
    message = refusal(write_ulog(tmp_path / "a.ulg", combined(covered=2000)))
    assert "covers 2 ms, and rows are 4 ms apart" in message and "SDLOG_PROFILE" in message
    assert gmwm.read(write_ulog(tmp_path / "b.ulg", combined(covered=3990))).rate == 250.0


def test_thinned_topics_are_refused(tmp_path):
    slow = 5_000_000 + 1_000_000 * np.arange(200)
    path = write_ulog(
        tmp_path / "a.ulg", single("gyro", X[:, :3], slow), single("accel", X[:, 3:], slow)
    )
    message = refusal(path)
    assert "sensor_accel[0] is logged at 1 Hz, thinned" in message and "SDLOG_PROFILE" in message
    slow[:] = 5_000_000
    path = write_ulog(
        tmp_path / "a.ulg", single("gyro", X[:, :3], slow), single("accel", X[:, 3:], slow)
    )
    assert "is logged at 0 Hz, thinned" in refusal(path)
    path = write_ulog(tmp_path / "b.ulg", single("gyro", X[:, :3]), single("accel", X[:, 3:]))
    assert exact(gmwm.read(path))


def test_ulogs_that_cannot_be_used(tmp_path):
    path = write_ulog(tmp_path / "a.ulg", ("vehicle_status", 0, TIME, {}))
    assert "no samples of an IMU" in refusal(path)
    assert "no topic 'imu'" in refusal(write_ulog(path, combined()), topic="imu")
    assert "has one clock" in refusal(path, clock="log")
    whole = path.read_bytes()
    for size in (0, 7, 12, 40, 300):
        path.write_bytes(whole[:size])
        assert "a.ulg" in refusal(path)
    name, instance, _, columns = combined()
    write_ulog(path, (name, instance, np.full(200, 5_000_000), columns))
    assert "time" in refusal(path)


def test_accelerometer_of_ulog_in_g(tmp_path):
    path = write_ulog(tmp_path / "a.ulg", combined(X / np.float32([1, 1, 1, 9.8, 9.8, 9.8])))
    assert 'units={"accel": "g"}' in refusal(path)
    assert gmwm.read(path, units={"accel": "g"})["accel_z"].mean == pytest.approx(9.8, abs=0.02)


# -- ArduPilot ------------------------------------------------------------------------------------


def test_imu_of_ardupilot(tmp_path):
    path = write_dataflash(tmp_path / "a.bin", [IMU], imu_messages(X))
    found = gmwm.read(path)
    assert exact(found)
    assert found.rate == pytest.approx(400.0)
    assert found["temperature"].mean == pytest.approx(35.5)
    assert "units from messages IMU: gyro_x" in str(found)
    assert re.search(r"time stamps \((SampleUS|TimeUS) of IMU(\[0\])?, microseconds\)", str(found))


def test_several_imus_of_ardupilot(tmp_path):
    both = [m for pair in zip(imu_messages(X), imu_messages(2 * X, 1), strict=True) for m in pair]
    path = write_dataflash(tmp_path / "00000001.BIN", [IMU], both)
    assert "IMU[0] (200 messages), IMU[1] (200 messages)" in refusal(path)
    assert exact(gmwm.read(path, topic="IMU[0]"))


def test_batches(tmp_path):
    counts = np.random.default_rng(2).integers(-30, 30, size=(2, 4, 3, 32))
    counts[0, :, 2] += 4000
    messages = []
    for batch in range(4):  # 32 samples at 1 kHz, back to back; the last one was cut off
        for kind, mul in ((0, 400), (1, 1000)):
            number = 2 * batch + kind
            start = 10**6 + 32_000 * batch
            messages.append(("ISBH", start, number, kind, 0, mul, 20 if batch == 3 else 32,
                             start, 1000.0))  # fmt: skip
            x, y, z = counts[kind, batch]
            messages.append(("ISBD", start, number, 0, *x, *y, *z))
    found = gmwm.read(write_dataflash(tmp_path / "a.bin", BATCH, messages))
    assert found.rate == pytest.approx(1000.0)
    assert "units from messages ISBH and ISBD" in str(found)
    assert np.array_equal(found["accel_z"].values, counts[0, :, 2].ravel()[:116] / 400)
    assert np.array_equal(found["gyro_x"].values, counts[1, :, 0].ravel()[:116] / 1000)


def test_dataflash_that_cannot_be_used(tmp_path):
    path = write_dataflash(tmp_path / "a.bin", [IMU], [])
    assert "no messages IMU" in refusal(path)
    path = write_dataflash(tmp_path / "a.bin", [IMU], imu_messages(X))
    whole = path.read_bytes()
    for size in (3, 50, 200):
        path.write_bytes(whole[:size])
        assert "a.bin" in refusal(path)
    path = write_dataflash(tmp_path / "a.bin", [IMU], imu_messages(X / [1, 1, 1, 9.8, 9.8, 9.8]))
    assert 'units={"accel": "g"}' in refusal(path)


def test_a_message_without_fields_is_one(tmp_path):
    """Of three bytes, the header: taken for damage, they would end what is read."""
    many = [each for message in imu_messages(X) for each in (message, ("MARK",))]
    plain, marked = (
        gmwm.read(write_dataflash(tmp_path / f"{name}.bin", [IMU, ("MARK", "", "")], messages))
        for name, messages in (("plain", imu_messages(X)), ("marked", many))
    )
    assert marked.notices == plain.notices
    for one, other in zip(marked.channels, plain.channels, strict=True):
        np.testing.assert_array_equal(one.values, other.values)


def test_messages_are_those_that_pymavlink_finds(tmp_path, monkeypatch):
    both = [m for pair in zip(imu_messages(X), imu_messages(2 * X, 1), strict=True) for m in pair]
    path = write_dataflash(tmp_path / "a.bin", [IMU, *BATCH], both)
    whole = path.read_bytes()
    path.write_bytes(whole[:9000] + bytes(range(256)) * 3 + whole[9000:])  # damaged in its middle
    log = DFReader_binary(str(path))
    found = [
        (m.TimeUS, m.I, m.GyrX, m.AccZ) for m in iter(log.recv_msg, None) if m.fmt.name == "IMU"
    ]
    log.filehandle.close()
    monkeypatch.setattr(ardupilot, "_BLOCK", 1000)
    parts = list(ardupilot.Log(path, ("IMU", "GYR")))
    ours = [tuple(row) for part in parts for row in part.rows[["TimeUS", "I", "GyrX", "AccZ"]]]
    assert len(parts) > 10 and len(ours) > 390 and ours == found
