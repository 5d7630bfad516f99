"""The covariances of ROS' ``sensor_msgs/Imu``.

``common_interfaces/sensor_msgs/msg/Imu.msg``: variances of one measurement, row-major; all zeros
mean that it is not known, -1 in the first place that there is no such measurement.
"""

from __future__ import annotations

from gmwm.errors import InputError
from gmwm.export.imu import NO_RATE, ImuNumbers, Triad
from gmwm.export.target import KEYFRAME, ImuFile


class Ros(ImuFile):
    """The three covariance fields of the message, as YAML."""

    name = "ros-covariance"
    title = "ROS"
    file = "covariances of sensor_msgs/Imu"
    convention = (
        "N^2 f of each axis, the variance of the white noise of one sample at the rate f, on the "
        "diagonal of a row-major 3 x 3 matrix; slow errors have no place in it"
    )
    source = "common_interfaces/sensor_msgs/msg/Imu.msg"
    horizon = KEYFRAME

    def body(self, imu: ImuNumbers) -> list[str]:
        return [
            *_covariance("angular_velocity_covariance", imu.gyro, "(rad/s)^2"),
            *_covariance("linear_acceleration_covariance", imu.accel, "(m/s^2)^2"),
            "orientation_covariance: [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]"
            "  # not measured",
        ]


def _covariance(key: str, triad: Triad, unit: str) -> list[str]:
    if not triad.rate > 0.0:
        raise InputError(NO_RATE)
    x, y, z = (f"{axis.N**2 * triad.rate:.6e}" for axis in triad.xyz())
    return [
        f"{key}:  # {unit}, a sample at {triad.rate:.6g} Hz",
        f"  [{x}, 0.0, 0.0,",
        f"   0.0, {y}, 0.0,",
        f"   0.0, 0.0, {z}]",
    ]
