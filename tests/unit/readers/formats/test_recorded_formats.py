"""Files of every format with something odd in each, and what they are read as, or the message."""

import numpy as np
import pytest

import bags
import fuzz_formats as formats
from recorded import assert_as_recorded, reading

SI = formats.SI
LOGS, FRAMES = (0, 1, 2, 3, 4, 5, 7, 9, 10), (0, 1, 3, 4, 7, 10)


def cut(files):
    """The first half of a file."""
    return {name: data[: len(data) // 2] for name, data in files.items()}


@pytest.mark.parametrize("kind", ["ulog", "ardupilot", "mat", "hdf5", "mat73", "parquet"])
def test_files(tmp_path, kind):
    make = {
        "ulog": formats.ulog, "ardupilot": formats.ardupilot, "mat": formats.mat,
        "hdf5": formats.hdf5, "mat73": lambda k: formats.hdf5(k, is_mat=True),
        "parquet": lambda k: formats.arrow("parquet", k),
    }[kind]  # fmt: skip
    found = {}
    for k in LOGS if kind in ("ulog", "ardupilot") else FRAMES:
        path = formats.place(make(k), tmp_path)
        found[f"{k}"] = reading(path, units=SI)
        if k == 0:
            found[f"{k} without units"] = reading(path)
            found[f"{k} at a rate"] = reading(path, units=SI, rate=100.0)
            found[f"{k} of gyros"] = reading(path, units=SI, channels=["gyro"])
            found[f"{k} of a topic"] = reading(path, units=SI, topic="IMU[0]")
    if kind in ("ulog", "ardupilot"):
        path = formats.place(cut(make(0)), tmp_path)
        found["cut off"] = [reading(path, units=SI, damaged=d) for d in (False, True)]
    assert_as_recorded(f"readers/{kind}", found)


@pytest.mark.parametrize("kind", ["1", "MCAP"])
def test_bags(tmp_path, kind):
    found = {}
    for k in (0, 1, 3, 5, 9):
        path = formats.place(formats.bag(kind, k), tmp_path)
        found[f"{k}"] = reading(path)
        found[f"{k} by the log"] = reading(path, clock="log", topic="/imu")
    found["no topic"] = reading(path, topic="/none")
    assert_as_recorded(f"readers/bag_{kind.lower()}", found)


def test_bags_without_an_imu(tmp_path):
    found = {}
    for count in (1, 8, 9):
        warm = [(bags.START + i, bags.temperature(bags.ROS1, i, 30.0)) for i in range(3)]
        topics = {f"/warm{k}": (bags.TEMPERATURE_TYPE, warm) for k in range(count)}
        path = tmp_path / f"{count}.bag"
        bags.write1(path, topics, None)
        found[f"{count}"] = reading(path)
    assert_as_recorded("readers/bags_without_an_imu", found)


def test_records(tmp_path):
    found = {}
    path = tmp_path / "a.dat"
    rows = formats._samples(0)[1]
    for name, layout in formats.LAYOUTS.items():
        for k in (0, 5):
            made = np.zeros(formats.ROWS, layout.record)
            made["time"] = formats._samples(k)[0]
            made["values"] = rows / np.repeat([layout.gyro, layout.accel], 3) / 100.0
            path.write_bytes(made.tobytes()[: len(made.tobytes()) - k])
            found[f"{name} {k}"] = reading(path, layout=name)
    few = made[:63].tobytes()
    path.write_bytes(few)
    found["few"] = reading(path, layout="KF-GINS")
    path.write_bytes(bytes(5000))
    found["zeros"] = reading(path, layout="IMAR")
    assert_as_recorded("readers/records", found)
