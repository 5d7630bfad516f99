"""The covariances of ROS' ``sensor_msgs/Imu``.

``common_interfaces/sensor_msgs/msg/Imu.msg``: variances of one measurement, row-major; all zeros
mean that it is not known, -1 in the first place that there is no such measurement.
"""

from __future__ import annotations

from gmwm.errors import InputError
from gmwm.export import tuning
from gmwm.export.imu import Imu, Triad
from gmwm.export.target import ImuFile


def _covariance(key: str, triad: Triad, unit: str) -> list[str]:
    if not triad.rate > 0.0:
        raise InputError(
            "the numbers hold no sampling rate, which this file needs: export the calibration"
        )
    x, y, z = (f"{axis.N**2 * triad.rate:.6e}" for axis in triad.xyz())
    return [
        f"{key}:  # {unit}, a sample at {triad.rate:.6g} Hz",
        f"  [{x}, 0.0, 0.0,",
        f"   0.0, {y}, 0.0,",
        f"   0.0, 0.0, {z}]",
    ]


def _body(imu: Imu) -> list[str]:
    return [
        *_covariance("angular_velocity_covariance", imu.gyro, "(rad/s)^2"),
        *_covariance("linear_acceleration_covariance", imu.accel, "(m/s^2)^2"),
        "orientation_covariance: [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]  # not measured",
    ]


ROS = ImuFile(
    "ros-covariance", "ROS", "covariances of sensor_msgs/Imu",
    "N^2 f of each axis, the variance of the white noise of one sample at the rate f, on the "
    "diagonal of a row-major 3 x 3 matrix; slow errors have no place in it",
    "common_interfaces/sensor_msgs/msg/Imu.msg", _body, horizon=tuning.KEYFRAME,
)  # fmt: skip
