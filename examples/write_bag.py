"""Write a bag of a simulated IMU at rest, by rosbags: half an hour at 100 Hz, seed 1.

Run: python examples/write_bag.py FILE.bag [--minutes 30] [--rates 400,250]

With --rates, gyros and accelerometers have topics and rates of their own, as those of a RealSense
D435i.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

from gmwm import GaussMarkov, WhiteNoise

START = 1_700_000_000_000_000_000  # ns
MODELS = {
    "gyro": WhiteNoise(1e-4) + GaussMarkov(2e-5, 100.0),  # rad/s
    "accel": WhiteNoise(1e-3) + GaussMarkov(3e-4, 300.0),  # m/s^2
}
LEVEL = {"gyro": (1e-3, -2e-3, 5e-4), "accel": (0.1, -0.2, 9.8)}

STORE = get_typestore(Stores.ROS1_NOETIC)
IMU = "sensor_msgs/msg/Imu"


def message(stamp: int, six: np.ndarray) -> bytes:
    """A message as it is stored."""
    types = STORE.types
    time = types["builtin_interfaces/msg/Time"](*divmod(stamp, 10**9))
    vector, zeros = types["geometry_msgs/msg/Vector3"], np.zeros(9)
    imu = types[IMU](
        header=types["std_msgs/msg/Header"](seq=0, stamp=time, frame_id="imu_link"),
        orientation=types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
        orientation_covariance=np.full(9, -1.0),
        angular_velocity=vector(*six[:3]),
        angular_velocity_covariance=zeros,
        linear_acceleration=vector(*six[3:]),
        linear_acceleration_covariance=zeros,
    )
    return STORE.serialize_ros1(imu, IMU)


def main() -> None:
    """Simulate and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--rates", help="Hz of the gyros and of the accelerometers")
    given = parser.parse_args()
    rng = np.random.default_rng(1)
    rates = [float(each) for each in (given.rates or "100,100").split(",")]
    records = []
    for k, (sensor, model) in enumerate(MODELS.items()):
        n = int(60.0 * given.minutes * rates[k])
        samples = np.column_stack(
            [model.simulate(n, 1.0 / rates[k], rng) + level for level in LEVEL[sensor]]
        )
        zeros = np.zeros((n, 3))
        parts = [samples, zeros] if sensor == "gyro" else [zeros, samples]
        stamps = START + np.round(np.arange(n) * 1e9 / rates[k]).astype(np.int64)
        records.append((f"/camera/{sensor}/sample", stamps, np.hstack(parts)))
    if given.rates is None:
        records = [("/imu/data", records[0][1], records[0][2] + records[1][2])]
    with Writer(given.file) as bag:
        merged = []
        for topic, stamps, rows in records:
            connection = bag.add_connection(topic, IMU, typestore=STORE)
            merged += [(int(t), connection, six) for t, six in zip(stamps, rows, strict=True)]
        for stamp, connection, six in sorted(merged, key=lambda each: each[0]):
            bag.write(connection, stamp + 2_000_000, message(stamp, six))


if __name__ == "__main__":
    main()
