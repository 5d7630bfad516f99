"""Simulators: Gazebo, pyins and gnss-ins-sim.

``gz-sensors/src/GaussianNoiseModel.cc``, ``GaussianNoiseModel::ApplyImpl``: a sample has white
noise of ``stddev``, and a bias b' = exp(-dt/tau) b + n with var n = s^2 tau/2 (1 - exp(-2 dt/tau))
where s is ``dynamic_bias_stddev``: stationary variance s^2 tau/2. The bias starts at
``bias_stddev`` (``Load``).

``pyins/inertial_sensor.py``, ``EstimationModel.__init__`` and ``Parameters.apply``: ``noise`` and
``bias_walk`` are root densities; a walk needs a positive ``bias_sd``.

``gnss_ins_sim/pathgen/pathgen.py``, ``bias_drift``: b' = (1 - dt/tau) b + sd sqrt(1 - exp(-2
dt/tau)) n from zero; white samples without a finite correlation time. Units in
``gnss_ins_sim/sim/imu_model.py``, ``IMU.__init__``.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

from gmwm._core.units import factor
from gmwm.export.imu import Axis, Imu, Triad
from gmwm.export.target import ImuFile


def _three(triad: Triad, value: Callable[[Axis], float]) -> str:
    return f"[{', '.join(f'{value(axis):.6e}' for axis in triad.xyz())}]"


def _pyins(imu: Imu) -> list[str]:
    def start(axis: Axis) -> float:
        # As far as it walks within the horizon where nothing is known of the start.
        return axis.initial_sd or axis.K * sqrt(imu.horizon)

    lines = ["from pyins.inertial_sensor import EstimationModel", ""]
    for name, triad in (("gyro_model", imu.gyro), ("accel_model", imu.accel)):
        lines += [
            f"{name} = EstimationModel(",
            f"    noise={_three(triad, lambda axis: axis.N)},",
            f"    bias_walk={_three(triad, lambda axis: axis.K)},",
            f"    bias_sd={_three(triad, start)},  # add the bias at switch-on",
            ")",
        ]
    return lines


def _gnss_ins_sim(imu: Imu) -> list[str]:
    per_root_hour, per_hour = factor("deg/sqrt(h)", "rad/sqrt(s)"), factor("deg/h", "rad/s")
    gyro, accel = imu.triads
    rows = (
        ("gyro_b", "[0.0, 0.0, 0.0]", "deg/h"),
        ("gyro_arw", _three(gyro, lambda axis: axis.N / per_root_hour), "deg/sqrt(h)"),
        ("gyro_b_stability", _three(gyro, lambda axis: axis.sigma / per_hour), "deg/h"),
        ("gyro_b_corr", _three(gyro, lambda axis: axis.tau), "s"),
        ("accel_b", "[0.0, 0.0, 0.0]", "m/s^2"),
        ("accel_vrw", _three(accel, lambda axis: 60.0 * axis.N), "m/s/sqrt(h)"),
        ("accel_b_stability", _three(accel, lambda axis: axis.sigma), "m/s^2"),
        ("accel_b_corr", _three(accel, lambda axis: axis.tau), "s"),
    )
    lines = [f'    "{key}": np.array({value}),  # {unit}' for key, value, unit in rows]
    return ["import numpy as np", "", "imu_err = {", *lines, "}"]


def _gazebo_axis(letter: str, axis: Axis, rate: float) -> list[str]:
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


def _gazebo_sensor(tag: str, triad: Triad, rate: float) -> list[str]:
    axes = zip("xyz", triad.xyz(), strict=True)
    inner = [line for letter, axis in axes for line in _gazebo_axis(letter, axis, rate)]
    return [f"  <{tag}>", *inner, f"  </{tag}>"]


def _gazebo(imu: Imu) -> list[str]:
    return [
        "<imu>",
        *_gazebo_sensor("angular_velocity", imu.gyro, imu.rate),
        *_gazebo_sensor("linear_acceleration", imu.accel, imu.rate),
        "</imu>",
    ]


SIMULATORS = (
    ImuFile(
        "gazebo", "Gazebo", "the imu element of a sensor in SDF",
        "stddev N sqrt(f), dynamic_bias_stddev sigma sqrt(2/tau), "
        "dynamic_bias_correlation_time tau, of each axis, with f the update_rate of the sensor",
        "gz-sensors/src/GaussianNoiseModel.cc: GaussianNoiseModel::ApplyImpl",
        _gazebo, form="N+GM", mark="<!--",
    ),
    ImuFile(
        "pyins", "pyins", "estimation models of the inertial sensors",
        "N and K of each axis, continuous time; a walk counts only where bias_sd is positive",
        "pyins/inertial_sensor.py: EstimationModel.__init__, Parameters.apply", _pyins,
    ),
    ImuFile(
        "gnss-ins-sim", "gnss-ins-sim", "the IMU's error model",
        "N, sigma and tau of each axis; its process starts at zero, and without a correlation "
        "time it is white",
        "gnss_ins_sim/pathgen/pathgen.py: bias_drift; gnss_ins_sim/sim/imu_model.py: IMU.__init__",
        _gnss_ins_sim, form="N+GM",
    ),
)  # fmt: skip
