"""Files of keys and values: the programs differ in names, units and a power of the rate only.

Each class names the file and function of the program that define what its value means; the tests
put the values through that equation. To add one like these: a class here, its name in `KEYED`, a
line in docs/export.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from gmwm.export.imu import ImuNumbers
from gmwm.export.keys import WalkKeys
from gmwm.export.target import ImuFile

_UNITS = {
    ("gyro", "N"): "rad/s/sqrt(Hz)",
    ("gyro", "K"): "rad/s^2/sqrt(Hz)",
    ("accel", "N"): "m/s^2/sqrt(Hz)",
    ("accel", "K"): "m/s^3/sqrt(Hz)",
}
_PER_SAMPLE = {key: unit.removesuffix("/sqrt(Hz)") for key, unit in _UNITS.items()}
_SQUARED = {key: f"({unit})^2" for key, unit in _PER_SAMPLE.items()}

_CONTINUOUS = "N and K for all axes, continuous time"


class KeyedFile(ImuFile):
    """N and K of gyros and accelerometers, a key each.

    keys: How they are called and converted.
    units: (quantity, letter) -> unit of the value.
    template: The file, with places for {values}, a line each, {rate} and {topic}.
    line: Of a value, with places for {key}, {value} and {unit}.
    """

    shared = True
    keys: ClassVar[WalkKeys]
    units: ClassVar[Mapping[tuple[str, str], str]] = _UNITS
    template: ClassVar[str] = "{values}"
    line: ClassVar[str] = "{key}: {value:.6e}  # {unit}"

    def body(self, imu: ImuNumbers) -> list[str]:
        needs_rate = self.keys.needs_rate or "{rate}" in self.template
        rate = imu.rate if needs_rate else float("nan")
        shown = f"{rate:.9g}"
        # With a point, since OpenCV distinguishes whole numbers from others.
        shown = shown if "." in shown or "e" in shown else f"{shown}.0"
        gyro_noise, gyro_walk, accel_noise, accel_walk = self.keys.names
        lines = []
        for key, triad, letter in (
            (accel_noise, imu.accel, "N"),
            (accel_walk, imu.accel, "K"),
            (gyro_noise, imu.gyro, "N"),
            (gyro_walk, imu.gyro, "K"),
        ):
            value = self.keys.written(letter, getattr(triad, letter), rate)
            unit = self.units[triad.quantity, letter]
            if any(axis.name in imu.invalid for axis in triad.axes):
                unit += ", do not use: not valid"
            lines.append(self.line.format(key=key, value=value, unit=unit))
        indent = self.template.partition("{values}")[0].rpartition("\n")[2]
        values = f"\n{indent}".join(lines)
        topic = imu.topic or "/imu0  # set to the topic of your bag"
        return self.template.format(values=values, rate=shown, topic=topic).splitlines()


class Kalibr(KeyedFile):
    name, title, file = "kalibr", "Kalibr", "imu.yaml"
    convention = f"{_CONTINUOUS}; zeros are rejected"
    source = (
        "kalibr_common/ConfigReader.py: ImuParameters.getAccelerometerStatistics, "
        "getGyroStatistics; IccSensors.py: addBiasMotionTerms"
    )
    keys = WalkKeys(
        "gyroscope_noise_density gyroscope_random_walk "
        "accelerometer_noise_density accelerometer_random_walk"
    )
    template = "{values}\nrostopic: {topic}\nupdate_rate: {rate}  # Hz"
    file_name, to_copy = "imu.yaml", "YAML, Kalibr"


class OpenVins(KeyedFile):
    name, title, file = "openvins", "OpenVINS", "kalibr_imu_chain.yaml"
    convention = f"{_CONTINUOUS}; scale, misalignment and g-sensitivity are those of an ideal IMU"
    source = "ov_msckf/src/state/Propagator.cpp: predict_and_compute; core/VioManagerOptions.h"
    keys = Kalibr.keys
    head = ("%YAML:1.0",)
    template = (
        """\
imu0:
  T_i_b:
    - [1.0, 0.0, 0.0, 0.0]
    - [0.0, 1.0, 0.0, 0.0]
    - [0.0, 0.0, 1.0, 0.0]
    - [0.0, 0.0, 0.0, 1.0]
  {values}
  rostopic: {topic}
  time_offset: 0.0
  update_rate: {rate}  # Hz
  model: "kalibr"
"""
        + "".join(
            f"  {name}:\n" + "".join(f"    - {row}\n" for row in np.eye(3).tolist())
            for name in ("Tw", "R_IMUtoGYRO", "Ta", "R_IMUtoACC")
        )
        + "  Tg:\n"
        + 3 * "    - [0.0, 0.0, 0.0]\n"
    )
    file_name, to_copy = "kalibr_imu_chain.yaml", "YAML, OpenVINS"


class Vins(KeyedFile):
    name, title = "vins", "VINS-Mono and VINS-Fusion"
    file = "the IMU block of the configuration"
    convention = (
        "N sqrt(2 f), since the mid-point step takes the two samples at its ends as independent, "
        "and K sqrt(f), f the rate of the IMU; for all axes"
    )
    source = "vins_estimator/src/factor/integration_base.h: IntegrationBase, midPointIntegration"
    keys = WalkKeys("gyr_n gyr_w acc_n acc_w", white=2.0, walk=1.0)
    units = _PER_SAMPLE


class OrbSlam3(KeyedFile):
    name, title, file = "orbslam3", "ORB-SLAM3", "the IMU block of the settings"
    convention = f"{_CONTINUOUS}; ORB-SLAM3 multiplies and divides by sqrt(IMU.Frequency) itself"
    source = (
        "src/Tracking.cc: newParameterLoader (IMU::Calib); src/ImuTypes.cc: IntegrateNewMeasurement"
    )
    keys = WalkKeys("IMU.NoiseGyro IMU.GyroWalk IMU.NoiseAcc IMU.AccWalk")
    template = "{values}\nIMU.Frequency: {rate}  # Hz"


class FastLio(KeyedFile):
    name, title, file = "fastlio", "FAST-LIO2", "the mapping block of the configuration"
    convention = "N^2 f and K^2 f, variances of one sample at the rate f of the IMU; for all axes"
    source = (
        "include/IKFoM_toolkit/esekfom/esekfom.hpp: predict; src/IMU_Processing.hpp: UndistortPcl"
    )
    keys = WalkKeys("gyr_cov b_gyr_cov acc_cov b_acc_cov", white=1.0, walk=1.0, power=2)
    units = _SQUARED
    template = "mapping:\n  {values}"


class LioSam(KeyedFile):
    name, title, file = "liosam", "LIO-SAM", "the IMU settings of params.yaml"
    convention = _CONTINUOUS
    source = "src/imuPreintegration.cpp: IMUPreintegration"
    keys = WalkKeys("imuGyrNoise imuGyrBiasN imuAccNoise imuAccBiasN")
    template = "lio_sam:\n  {values}"


class Kimera(KeyedFile):
    name, title, file = "kimera", "Kimera-VIO", "noise of ImuParams.yaml"
    convention = f"{_CONTINUOUS}; zeros are rejected"
    source = (
        "src/imu-frontend/ImuFrontend.cpp: convertVioImuParamsToGtsam; "
        "src/backend/VioBackend.cpp: addImuFactor"
    )
    keys = Kalibr.keys
    head = ("%YAML:1.0",)
    template = "rate_hz: {rate}\n{values}"


class Okvis2(KeyedFile):
    name, title, file = "okvis2", "OKVIS2", "imu_parameters of the configuration"
    convention = (
        f"{_CONTINUOUS}; sigma_bg and sigma_ba, the biases at switch-on, are not in a static "
        "recording"
    )
    source = (
        "okvis_ceres/src/ImuError.cpp: ImuError::propagation; "
        "okvis_common/src/ViParametersReader.cpp"
    )
    keys = WalkKeys("sigma_g_c sigma_gw_c sigma_a_c sigma_aw_c")
    template = "imu_parameters:\n    {values}"


class Maplab(KeyedFile):
    name, title, file = "maplab", "maplab", "the IMU in the sensors file"
    convention = _CONTINUOUS
    source = (
        "map-structure/sensors/src/imu.cc; algorithms/imu-integrator-rk4/include/imu-integrator/"
        "imu-integrator-inl.h: getCovarianceTransitionDerivativesRungeKutta"
    )
    keys = WalkKeys(
        "gyro_noise_density gyro_bias_random_walk_noise_density "
        "acc_noise_density acc_bias_random_walk_noise_density"
    )
    template = "sigmas:\n  {values}"


class Px4(KeyedFile):
    name, title, file = "px4", "PX4 EKF2", "a parameter file for QGroundControl"
    interval: ClassVar[float] = 0.01  # s, of a step of EKF2: EKF2_PREDICT_US is 10000 by default
    convention = (
        "N/sqrt(dt) and K/sqrt(dt) for all axes, dt = "
        f"{interval:g} s the interval of the filter (EKF2_PREDICT_US), not of the IMU"
    )
    source = "src/modules/ekf2/EKF/covariance.cpp: predictCovariance; src/modules/ekf2/module.yaml"
    keys = WalkKeys(
        "EKF2_GYR_NOISE EKF2_GYR_B_NOISE EKF2_ACC_NOISE EKF2_ACC_B_NOISE",
        white=1.0,
        walk=1.0,
        rate=1.0 / interval,
    )
    line = "1\t1\t{key}\t{value:.6e}\t9"
    file_name = "px4.params"
    caution = "LEAST VALUES, NOT FOR FLIGHT AS THEY ARE: vibration dominates in the air"
    warnings = (
        "A recording on the bench does not hold the vibration of flight; PX4's defaults (gyro "
        "0.015 rad/s, accelerometer 0.35 m/s^2) stand for it. Record in flight, or keep the larger "
        "of the two. PX4 takes gyro noise of 0.0001 to 0.1 rad/s, accelerometer noise of 0.01 to 1 "
        "m/s^2, and bias noise up to 0.01.",
    )


KEYED = (Kalibr, OpenVins, Vins, OrbSlam3, FastLio, LioSam, Kimera, Okvis2, Maplab, Px4)
"""All of them, in the order in which they are listed."""
