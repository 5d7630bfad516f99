"""Consumers that read JSON: Basalt and GLIM.

Basalt, ``basalt-headers/include/basalt/calibration/calibration.hpp``, ``Calibration``: samples have
N sqrt(rate) (``dicrete_time_gyro_noise_std``); ``include/basalt/linearization/imu_block.hpp``,
``ImuBlock::linearizeImu``, divides the weight of a bias step, 1/K, by sqrt(dt).

GLIM, ``src/glim/common/imu_integration.cpp``, ``IMUIntegration``: N, squared to GTSAM's densities.
``src/glim/odometry/odometry_estimation_imu.cpp``: ``imu_bias_noise`` is the standard deviation of
the step of all six biases from scan to scan, rad/s and m/s^2 alike, which no K can be.
"""

from __future__ import annotations

from typing import Any

from gmwm.export.imu import ImuNumbers
from gmwm.export.keys import WalkKeys
from gmwm.export.target import KEYFRAME, JsonFile


class Basalt(JsonFile):
    """Noise of Basalt's calibration file."""

    name = "basalt"
    title = "Basalt"
    file = "noise of its calibration, to be copied into value0"
    convention = (
        "N and K of each axis, continuous time; Basalt multiplies by sqrt(imu_update_rate) itself"
    )
    source = (
        "basalt-headers/include/basalt/calibration/calibration.hpp: Calibration; "
        "include/basalt/linearization/imu_block.hpp: ImuBlock::linearizeImu"
    )
    horizon = KEYFRAME
    file_name = "basalt.json"
    keys = WalkKeys(("gyro_noise_std", "gyro_bias_std", "accel_noise_std", "accel_bias_std"))

    def body(self, imu: ImuNumbers) -> dict[str, Any]:
        values = {
            f"{name}_{what}_std": [_number(getattr(axis, letter)) for axis in triad.xyz()]
            for what, letter in (("noise", "N"), ("bias", "K"))
            for name, triad in (("accel", imu.accel), ("gyro", imu.gyro))
        }
        return {"value0": {"imu_update_rate": imu.rate, **values}}


class Glim(JsonFile):
    """White noise for GLIM, which has no place for a random walk."""

    name = "glim"
    title = "GLIM"
    file = "sensors of config_sensors.json"
    convention = "N for all axes, continuous time"
    source = "src/glim/common/imu_integration.cpp: IMUIntegration"
    horizon = KEYFRAME
    shared = True
    file_name = "glim.json"
    warnings = (
        "imu_bias_noise is one step for gyros (rad/s) and accelerometers (m/s^2) alike, which "
        "no K can be: with K sqrt(time between scans) of the accelerometers those are right "
        "and the gyros' biases looser than need be.",
    )

    def body(self, imu: ImuNumbers) -> dict[str, Any]:
        noise = {"imu_acc_noise": _number(imu.accel.N), "imu_gyro_noise": _number(imu.gyro.N)}
        return {"sensors": noise}


def _number(value: float) -> float:
    return float(f"{value:.6e}")
