"""Logs of PX4, written by pyulog, and of ArduPilot, written as its format says."""

from __future__ import annotations

import struct
from types import SimpleNamespace

import numpy as np
import pytest
from pyulog import ULog

import gmwm
from bags import at_rest
from gmwm.readers.names import CANONICAL

X = at_rest().astype(np.float32)
TIME = 5_000_000 + 4000 * np.arange(200)


def exact(recording, samples=X):
    return all(
        np.array_equal(recording[name].values, column.astype(float))
        for name, column in zip(CANONICAL, samples.T, strict=True)
    )


def refusal(path, **arguments):
    with pytest.raises(gmwm.InputError) as caught:
        gmwm.read(path, **arguments)
    assert "\n" not in str(caught.value)
    return str(caught.value)


# -- PX4 ------------------------------------------------------------------------------------------

SINGLE = "float x;float y;float z;float temperature;"
FIFO = "uint64_t timestamp_sample;float dt;float scale;uint8_t samples;" + "".join(
    f"int16_t[32] {axis};" for axis in "xyz"
)
COMBINED = (
    "float[3] gyro_rad;uint32_t gyro_integral_dt;int32_t accelerometer_timestamp_relative;"
    "float[3] accelerometer_m_s2;"
)
FORMATS = {
    "sensor_combined": COMBINED,
    "sensor_gyro": SINGLE,
    "sensor_accel": SINGLE,
    "sensor_gyro_fifo": FIFO,
    "sensor_accel_fifo": FIFO,
    "vehicle_status": "uint8_t nav_state;",
}
CODES = {"float": np.float32, "uint8_t": np.uint8, "int32_t": np.int32, "uint32_t": np.uint32,
         "uint64_t": np.uint64, "int16_t": np.int16}  # fmt: skip


def fields(name):
    """Type and name of each field of a topic, arrays element by element."""
    for field in f"uint64_t timestamp;{FORMATS[name]}".split(";")[:-1]:
        kind, _, key = field.partition(" ")
        kind, _, size = kind.partition("[")
        for i in range(int(size[:-1])) if size else [None]:
            yield kind, key if i is None else f"{key}[{i}]"


def write_ulog(path, *topics):
    """Topics as (name, instance, stamps, columns by name)."""
    log = ULog(None)
    for number, (name, instance, stamps, columns) in enumerate(topics):
        form = ULog.MessageFormat(f"{name}:uint64_t timestamp;{FORMATS[name]}".encode(), None)
        log._message_formats[name] = form
        data = {
            key: np.broadcast_to(columns.get(key, 0), len(stamps)).astype(CODES[kind])
            for kind, key in fields(name)
        }
        data["timestamp"] = np.asarray(stamps, np.uint64)
        types = [SimpleNamespace(field_name=key, type_str=kind) for kind, key in fields(name)]
        log._data_list.append(
            SimpleNamespace(name=name, multi_id=instance, msg_id=number, field_data=types,
                            timestamp_idx=0, data=data)
        )  # fmt: skip
    log.write_ulog(str(path))
    return path


def combined(samples=X, relative=-500):
    columns = {"accelerometer_timestamp_relative": relative}
    for i in range(3):
        columns[f"gyro_rad[{i}]"] = samples[:, i]
        columns[f"accelerometer_m_s2[{i}]"] = samples[:, 3 + i]
    return "sensor_combined", 0, TIME, columns


def single(sensor, samples, stamps=TIME, instance=0):
    columns = dict(zip("xyz", samples.T, strict=True)) | {"temperature": 41.0}
    return f"sensor_{sensor}", instance, stamps, columns


def fifo(sensor, counts, scale, dt=125.0, instance=0):
    """Messages of 8 samples each, of whole numbers."""
    rows = counts.reshape(-1, 8, 3)
    last = 5_000_000 + dt * (8 * np.arange(len(rows)) + 7)
    columns = {"timestamp_sample": last, "dt": dt, "scale": scale, "samples": 8}
    for axis, letter in enumerate("xyz"):
        columns |= {f"{letter}[{i}]": rows[:, i, axis] for i in range(8)}
    return f"sensor_{sensor}_fifo", instance, last + 300, columns


def fifo_counts():
    """Whole numbers of a sensor at rest, (800, 6)."""
    counts = np.random.default_rng(2).integers(-30, 30, size=(800, 6))
    counts[:, 5] += 4096
    return counts


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


def test_thinned_topics_are_refused(tmp_path):
    slow = 5_000_000 + 1_000_000 * np.arange(200)
    path = write_ulog(
        tmp_path / "a.ulg", single("gyro", X[:, :3], slow), single("accel", X[:, 3:], slow)
    )
    message = refusal(path)
    assert "sensor_accel[0] is logged at 1 Hz, thinned" in message and "SDLOG_PROFILE" in message
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

PACKED = {"Q": "Q", "B": "B", "H": "H", "I": "I", "f": "f", "a": "32h", "n": "4s", "Z": "64s",
          "N": "16s", "c": "h"}  # fmt: skip
IMU = ("IMU", "QBffffffIIfBBHH",
       "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz")  # fmt: skip
BATCH = (("ISBH", "QHBBHHQf", "TimeUS,N,type,instance,mul,smp_cnt,SampleUS,smp_rate"),
         ("ISBD", "QHHaaa", "TimeUS,N,seqno,x,y,z"))  # fmt: skip


def write_dataflash(path, forms, messages):
    """Formats and (name, values) messages."""
    numbers = {"FMT": 0x80} | {name: 0x81 + i for i, (name, _, _) in enumerate(forms)}
    layouts = {"FMT": "BBnNZ"} | {name: letters for name, letters, _ in forms}

    def packed(name, *values):
        layout = "<" + "".join(PACKED[c] for c in layouts[name])
        return struct.pack("<BBB", 0xA3, 0x95, numbers[name]) + struct.pack(layout, *values)

    def size(letters):
        return 3 + struct.calcsize("<" + "".join(PACKED[c] for c in letters))

    texts = [("FMT", "BBnNZ", "Type,Length,Name,Format,Columns"), *forms]
    data = b"".join(
        packed("FMT", numbers[name], size(letters), name.encode(), letters.encode(), names.encode())
        for name, letters, names in texts
    )
    path.write_bytes(data + b"".join(packed(*message) for message in messages))
    return path


def imu_messages(samples, instance=0, step=2500):
    return [
        ("IMU", 10**6 + step * i, instance, *map(float, six), 0, 0, 35.5, 1, 1, 1000, 1000)
        for i, six in enumerate(samples)
    ]


def test_imu_of_ardupilot(tmp_path):
    path = write_dataflash(tmp_path / "a.bin", [IMU], imu_messages(X))
    found = gmwm.read(path)
    assert exact(found)
    assert found.rate == pytest.approx(400.0)
    assert found["temperature"].mean == pytest.approx(35.5)


def test_several_imus_of_ardupilot(tmp_path):
    both = [m for pair in zip(imu_messages(X), imu_messages(2 * X, 1), strict=True) for m in pair]
    path = write_dataflash(tmp_path / "00000001.BIN", [IMU], both)
    assert "IMU[0] (200 messages), IMU[1] (200 messages)" in refusal(path)
    assert exact(gmwm.read(path, topic="IMU[0]"))


def test_batches(tmp_path):
    counts = np.random.default_rng(2).integers(-30, 30, size=(2, 4, 3, 32))
    counts[0, :, 2] += 4000
    messages = []
    for batch in range(4):  # 32 samples at 1 kHz, back to back
        for kind, mul in ((0, 400), (1, 1000)):
            number = 2 * batch + kind
            start = 10**6 + 32_000 * batch
            messages.append(("ISBH", start, number, kind, 0, mul, 32, start, 1000.0))
            x, y, z = counts[kind, batch]
            messages.append(("ISBD", start, number, 0, *x, *y, *z))
    found = gmwm.read(write_dataflash(tmp_path / "a.bin", BATCH, messages))
    assert found.rate == pytest.approx(1000.0)
    assert np.array_equal(found["accel_z"].values, counts[0, :, 2].ravel() / 400)
    assert np.array_equal(found["gyro_x"].values, counts[1, :, 0].ravel() / 1000)


def test_dataflash_that_cannot_be_used(tmp_path):
    path = write_dataflash(tmp_path / "a.bin", [IMU], [])
    assert "no messages IMU" in refusal(path)
    path = write_dataflash(tmp_path / "a.bin", [IMU], imu_messages(X))
    whole = path.read_bytes()
    for size in (3, 50, 200):
        path.write_bytes(whole[:size])
        assert "a.bin" in refusal(path)
    # What is there of a log that was cut off, as by a battery, can be used.
    path.write_bytes(whole[: len(whole) // 2 + 7])
    assert 90 < gmwm.read(path).n < 110
    path = write_dataflash(tmp_path / "a.bin", [IMU], imu_messages(X / [1, 1, 1, 9.8, 9.8, 9.8]))
    assert 'units={"accel": "g"}' in refusal(path)


def test_fields_of_hundredths(tmp_path):
    form = ("IMU", "QBccccccIIfBBHH", IMU[2])
    messages = [
        (name, t, i, *(int(100 * v) for v in six), *rest)
        for name, t, i, *six_rest in imu_messages(X)
        for six, rest in [(six_rest[:6], six_rest[6:])]
    ]
    found = gmwm.read(write_dataflash(tmp_path / "a.bin", [form], messages))
    assert found["accel_z"].values == pytest.approx(np.trunc(100.0 * X[:, 5].astype(float)) / 100.0)
