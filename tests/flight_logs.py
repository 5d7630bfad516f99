"""Logs of PX4, written by pyulog, and of ArduPilot, written as its format says."""

from __future__ import annotations

import struct
from types import SimpleNamespace

import numpy as np
from pyulog import ULog

from bags import at_rest

X = at_rest().astype(np.float32)
TIME = 5_000_000 + 4000 * np.arange(200)

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
    "vehicle_imu": (
        "uint64_t timestamp_sample;float[3] delta_angle;float[3] delta_velocity;"
        "uint32_t delta_angle_dt;uint32_t delta_velocity_dt;"
    ),
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


def combined(samples=X, relative=-500, covered=4000):
    columns = {"accelerometer_timestamp_relative": relative, "gyro_integral_dt": covered}
    for i in range(3):
        columns[f"gyro_rad[{i}]"] = samples[:, i]
        columns[f"accelerometer_m_s2[{i}]"] = samples[:, 3 + i]
    return "sensor_combined", 0, TIME, columns


def single(sensor, samples, stamps=TIME, instance=0):
    columns = dict(zip("xyz", samples.T, strict=True)) | {"temperature": 41.0}
    return f"sensor_{sensor}", instance, stamps, columns


def integrated(samples, instance=0, step=4000, covered=None):
    """Increments of an IMU over ``covered`` us, by default over the whole step."""
    stamps = 5_000_000 + step * np.arange(len(samples))
    dt = step if covered is None else covered
    columns = {"timestamp_sample": stamps, "delta_angle_dt": dt, "delta_velocity_dt": dt}
    for i in range(3):
        columns[f"delta_angle[{i}]"] = samples[:, i] * (dt * 1e-6)
        columns[f"delta_velocity[{i}]"] = samples[:, 3 + i] * (dt * 1e-6)
    return "vehicle_imu", instance, stamps + 300, columns


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


# -- ArduPilot ------------------------------------------------------------------------------------

PACKED = {"Q": "Q", "B": "B", "H": "H", "I": "I", "f": "f", "a": "32h", "n": "4s", "Z": "64s",
          "N": "16s", "c": "h"}  # fmt: skip
IMU = ("IMU", "QBffffffIIfBBHH",
       "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz")  # fmt: skip
BATCH = (("ISBH", "QHBBHHQf", "TimeUS,N,type,instance,mul,smp_cnt,SampleUS,smp_rate"),
         ("ISBD", "QHHaaa", "TimeUS,N,seqno,x,y,z"))  # fmt: skip


def write_dataflash(path, forms, messages):
    """Formats and (name, values) messages."""
    numbers = {"FMT": 0x80} | {name: 0xFF - i for i, (name, _, _) in enumerate(forms)}
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
