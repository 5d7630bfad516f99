"""Gazebo: the noise of an IMU sensor in SDF.

``gz-sensors/src/GaussianNoiseModel.cc``, ``GaussianNoiseModel::ApplyImpl``: a sample has white
noise of ``stddev``, and a bias b' = exp(-dt/tau) b + n with var n = s^2 tau/2 (1 - exp(-2 dt/tau))
where s is ``dynamic_bias_stddev``: stationary variance s^2 tau/2. The bias starts at
``bias_stddev`` (``Load``).
"""

from __future__ import annotations

from math import sqrt

from gmwm.export.imu import Axis, Imu, Triad
from gmwm.export.target import ImuFile


def _axis(letter: str, axis: Axis, rate: float) -> list[str]:
    start = sqrt(axis.sigma**2 + axis.initial_sd**2)
    values = (
        ("mean", "0"),
        ("stddev", f"{axis.N * sqrt(rate):.6e}"),
        ("bias_mean", "0"),
        ("bias_stddev", f"{start:.6e}"),
        ("dynamic_bias_stddev", f"{axis.sigma * sqrt(2.0 / axis.tau):.6e}"),
        ("dynamic_bias_correlation_time", f"{axis.tau:.6e}"),
    )
    lines = [f"      <{key}>{value}</{key}>" for key, value in values]
    return [f'    <{letter}><noise type="gaussian">', *lines, f"    </noise></{letter}>"]


def _sensor(tag: str, triad: Triad, rate: float) -> list[str]:
    axes = zip("xyz", triad.xyz(), strict=True)
    inner = [line for letter, axis in axes for line in _axis(letter, axis, rate)]
    return [f"  <{tag}>", *inner, f"  </{tag}>"]


def _body(imu: Imu) -> list[str]:
    return [
        "<imu>",
        *_sensor("angular_velocity", imu.gyro, imu.rate),
        *_sensor("linear_acceleration", imu.accel, imu.rate),
        "</imu>",
    ]


GAZEBO = ImuFile(
    "gazebo", "Gazebo", "the imu element of a sensor in SDF",
    "stddev N sqrt(f), dynamic_bias_stddev sigma sqrt(2/tau), dynamic_bias_correlation_time tau, "
    "of each axis, with f the update_rate of the sensor",
    "gz-sensors/src/GaussianNoiseModel.cc: GaussianNoiseModel::ApplyImpl",
    _body, form="N+GM", mark="<!--",
)  # fmt: skip
