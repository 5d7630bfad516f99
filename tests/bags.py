"""Bags written by rosbags, of an IMU at rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer as Writer2
from rosbags.typesys import Stores, get_typestore

ROS1 = get_typestore(Stores.ROS1_NOETIC)
ROS2 = get_typestore(Stores.ROS2_HUMBLE)

START = 1_700_000_000_123_456_789
"""ns."""


def at_rest(n=200, seed=3):
    """Rates and specific forces of an IMU, (n, 6), rad/s and m/s^2."""
    noise = np.random.default_rng(seed).normal(size=(n, 6)) * 1e-3
    return noise + np.array([0.0, 0.0, 0.0, 0.1, -0.2, 9.8])


def imu(store, stamp, six, frame="imu_link", covariance=0.0):
    """A message; of `six` angular rate and specific force."""
    names = store.types
    seconds, nanoseconds = divmod(int(stamp), 10**9)
    time = names["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)
    header = {"stamp": time, "frame_id": frame}
    if store is ROS1:
        header["seq"] = 7
    vector = names["geometry_msgs/msg/Vector3"]
    nine = np.full(9, float(covariance))
    return names["sensor_msgs/msg/Imu"](
        header=names["std_msgs/msg/Header"](**header),
        orientation=names["geometry_msgs/msg/Quaternion"](x=0.1, y=0.2, z=0.3, w=0.4),
        orientation_covariance=nine,
        angular_velocity=vector(*six[:3]),
        angular_velocity_covariance=nine,
        linear_acceleration=vector(*six[3:]),
        linear_acceleration_covariance=nine,
    )


def temperature(store, stamp, value, frame="imu_link"):
    """A message of sensor_msgs/Temperature."""
    header = imu(store, stamp, np.zeros(6), frame).header
    return store.types["sensor_msgs/msg/Temperature"](
        header=header, temperature=float(value), variance=0.0
    )


def text(store, value):
    """A message of std_msgs/String."""
    return store.types["std_msgs/msg/String"](data=value)


def stamps(n, rate=100.0, start=START):
    """Of the headers, ns."""
    return start + np.round(np.arange(n) * 1e9 / rate).astype(np.int64)


def write1(path: Path, topics, compression=None) -> Path:
    """A bag of ROS 1: topic -> list of (log time, message)."""
    with Writer1(path) if compression is None else _packed1(path, compression) as writer:
        _write(writer, ROS1, topics, ROS1.serialize_ros1)
    return path


def _packed1(path, compression):
    writer = Writer1(path)
    writer.set_compression(Writer1.CompressionFormat[compression])
    return writer


def write2(path: Path, topics, storage="SQLITE3", compression=None, big=False) -> Path:
    """A bag of ROS 2, a folder: topic -> list of (log time, message)."""
    writer = Writer2(path, version=9, storage_plugin=StoragePlugin[storage])
    if compression is not None:
        writer.set_compression(CompressionMode[compression], CompressionFormat.ZSTD)
    with writer:
        _write(
            writer, ROS2, topics,
            lambda message, kind: ROS2.serialize_cdr(message, kind, little_endian=not big),
        )  # fmt: skip
    return path


def _write(writer, store, topics, serialize):
    records = []
    for topic, (kind, messages) in topics.items():
        connection = writer.add_connection(topic, kind, typestore=store)
        records += [(time, connection, message, kind) for time, message in messages]
    for time, connection, message, kind in sorted(records, key=lambda each: each[0]):
        writer.write(connection, int(time), serialize(message, kind))


IMU_TYPE = "sensor_msgs/msg/Imu"
TEMPERATURE_TYPE = "sensor_msgs/msg/Temperature"
TEXT_TYPE = "std_msgs/msg/String"


def imu_topic(store, samples, rate=100.0, frame="imu_link", late=5_000_000, start=START):
    """Messages of samples, recorded some time after their stamps."""
    times = stamps(len(samples), rate, start)
    return IMU_TYPE, [
        (time + late, imu(store, time, six, frame))
        for time, six in zip(times, samples, strict=True)
    ]
