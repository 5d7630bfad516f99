"""Simulators: Gazebo, pyins, gnss-ins-sim and MATLAB's ``imuSensor``.

Each class names the file and function of the program that define what its values mean.
"""

from __future__ import annotations

from math import sqrt

from gmwm.export.imu import Axis, ImuNumbers
from gmwm.export.keys import ARW, DEG_H, MemoryKeys
from gmwm.export.target import ImuFile


class Gazebo(ImuFile):
    """Noise of each axis as SDF.

    The bias is b' = exp(-dt/tau) b + n with var n = s^2 tau/2 (1 - exp(-2 dt/tau)), s being
    ``dynamic_bias_stddev``: its stationary variance is s^2 tau/2.
    """

    name, title, file = "gazebo", "Gazebo", "the imu element of a sensor in SDF"
    convention = (
        "stddev N sqrt(f), dynamic_bias_stddev sigma sqrt(2/tau), "
        "dynamic_bias_correlation_time tau, of each axis, with f the update_rate of the sensor"
    )
    source = "gz-sensors/src/GaussianNoiseModel.cc: GaussianNoiseModel::ApplyImpl"
    form = "N+GM"
    mark = "<!--"
    file_name = "gazebo.sdf"

    def body(self, imu: ImuNumbers) -> list[str]:
        lines = ["<imu>"]
        for tag, triad in (("angular_velocity", imu.gyro), ("linear_acceleration", imu.accel)):
            lines.append(f"  <{tag}>")
            for letter, axis in zip("xyz", triad.xyz(), strict=True):
                start = sqrt(axis.sigma**2 + axis.initial_sd**2)
                values = (
                    ("mean", "0"),
                    ("stddev", f"{axis.N * sqrt(imu.rate):.6e}"),
                    ("bias_mean", "0"),
                    ("bias_stddev", f"{start:.6e}"),
                    ("dynamic_bias_stddev", f"{axis.sigma * sqrt(2.0 / axis.tau):.6e}"),
                    ("dynamic_bias_correlation_time", f"{axis.tau:.6e}"),
                )
                lines.append(f'    <{letter}><noise type="gaussian">')
                lines += [f"      <{key}>{value}</{key}>" for key, value in values]
                lines.append(f"    </noise></{letter}>")
            lines.append(f"  </{tag}>")
        return [*lines, "</imu>"]


class PyIns(ImuFile):
    """Estimation models of the inertial sensors."""

    name, title, file = "pyins", "pyins", "estimation models of the inertial sensors"
    convention = (
        "N and K of each axis, continuous time; a walk counts only where bias_sd is positive"
    )
    source = "pyins/inertial_sensor.py: EstimationModel.__init__, Parameters.apply"
    file_name = "pyins_imu.py"

    def body(self, imu: ImuNumbers) -> list[str]:
        def start(axis: Axis) -> float:
            # As far as it walks within the horizon where the start is unknown.
            return axis.initial_sd or axis.K * sqrt(imu.horizon)

        lines = ["from pyins.inertial_sensor import EstimationModel", ""]
        for name, triad in (("gyro_model", imu.gyro), ("accel_model", imu.accel)):
            lines += [
                f"{name} = EstimationModel(",
                f"    noise={triad.listed(lambda axis: axis.N)},",
                f"    bias_walk={triad.listed(lambda axis: axis.K)},",
                f"    bias_sd={triad.listed(start)},  # add the bias at switch-on",
                ")",
            ]
        return lines


class GnssInsSim(ImuFile):
    """The IMU's error model as a Python dictionary.

    The bias is b' = (1 - dt/tau) b + sd sqrt(1 - exp(-2 dt/tau)) n from zero.
    """

    name, title, file = "gnss-ins-sim", "gnss-ins-sim", "the IMU's error model"
    convention = (
        "N, sigma and tau of each axis; its process starts at zero, and without a correlation "
        "time it is white"
    )
    source = (
        "gnss_ins_sim/pathgen/pathgen.py: bias_drift; gnss_ins_sim/sim/imu_model.py: IMU.__init__"
    )
    form = "N+GM"
    file_name = "gnss_ins_sim.py"
    keys = MemoryKeys(
        "gyro_arw gyro_b_stability gyro_b_corr accel_vrw accel_b_stability accel_b_corr",
        (ARW, DEG_H, 1.0, 1.0 / 60.0, 1.0, 1.0),
    )

    def body(self, imu: ImuNumbers) -> list[str]:
        gyro, accel = imu.triads
        rows = (
            ("gyro_b", "[0.0, 0.0, 0.0]", "deg/h"),
            ("gyro_arw", gyro.listed(lambda axis: axis.N / ARW), "deg/sqrt(h)"),
            ("gyro_b_stability", gyro.listed(lambda axis: axis.sigma / DEG_H), "deg/h"),
            ("gyro_b_corr", gyro.listed(lambda axis: axis.tau), "s"),
            ("accel_b", "[0.0, 0.0, 0.0]", "m/s^2"),
            ("accel_vrw", accel.listed(lambda axis: 60.0 * axis.N), "m/s/sqrt(h)"),
            ("accel_b_stability", accel.listed(lambda axis: axis.sigma), "m/s^2"),
            ("accel_b_corr", accel.listed(lambda axis: axis.tau), "s"),
        )
        lines = [f'    "{key}": np.array({value}),  # {unit}' for key, value, unit in rows]
        return ["import numpy as np", "", "imu_err = {", *lines, "}"]


class Matlab(ImuFile):
    """Parameters of ``imuSensor``.

    "single-sided" has samples of standard deviation NoiseDensity sqrt(f), and a walk by
    RandomWalk/sqrt(f) a sample: N and K as here. The default, "double-sided", halves the white
    variance and doubles that of the walk.
    """

    name, title, file = "matlab", "MATLAB", "gyroparams and accelparams of imuSensor"
    convention = (
        "N and K of each axis with NoiseType single-sided; releases before R2022b have no "
        "NoiseType and the default's scale: multiply NoiseDensity by sqrt(2), divide "
        "RandomWalk by sqrt(2)"
    )
    source = "manual of imuSensor, Algorithms; gyroparams, NoiseType"
    mark = "%"
    file_name, to_copy = "imu_noise.m", "MATLAB"

    def body(self, imu: ImuNumbers) -> list[str]:
        lines = []
        for name, make, triad in (
            ("gyro", "gyroparams", imu.gyro),
            ("accel", "accelparams", imu.accel),
        ):
            noise, walk = (
                " ".join(f"{getattr(axis, letter):.6e}" for axis in triad.xyz()) for letter in "NK"
            )
            lines += [
                f"{name} = {make}( ...",
                f"    'NoiseDensity', [{noise}], ...",
                f"    'RandomWalk', [{walk}], ...",
                "    'NoiseType', 'single-sided');",
            ]
        return [
            *lines,
            f"imu = imuSensor('accel-gyro', 'SampleRate', {imu.rate:.9g}, ...",
            "    'Gyroscope', gyro, 'Accelerometer', accel);",
        ]
