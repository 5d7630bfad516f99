"""Programs that estimate motion with files of their own: ROS, GTSAM, KF-GINS, Basalt and GLIM.

Each class names the file and function of the program that define what its values mean.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt
from typing import Any

from gmwm.errors import InputError
from gmwm.export.imu import NO_RATE, Axis, ImuNumbers, Triad
from gmwm.export.keys import ARW, DEG_H, MemoryKeys, WalkKeys
from gmwm.export.target import ImuFile, JsonFile

_MGAL = 1e-5  # m/s^2
_HOUR = 3600.0
_COVARIANCES = (
    ("AccelerometerCovariance", "accel", "N", "(m/s^2)^2/Hz"),
    ("GyroscopeCovariance", "gyro", "N", "(rad/s)^2/Hz"),
    ("BiasAccCovariance", "accel", "K", "(m/s^3)^2/Hz"),
    ("BiasOmegaCovariance", "gyro", "K", "(rad/s^2)^2/Hz"),
)

_GRAVITY = "Z up; MakeSharedD for Z down"


class Ros(ImuFile):
    """The three covariance fields of the message, row-major, as YAML; -1 says: not measured."""

    name, title, file = "ros-covariance", "ROS", "covariances of sensor_msgs/Imu"
    convention = (
        "N^2 f of each axis, the variance of the white noise of one sample at the rate f, on the "
        "diagonal of a row-major 3 x 3 matrix; slow errors have no place in it"
    )
    source = "common_interfaces/sensor_msgs/msg/Imu.msg"

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


class Gtsam(ImuFile):
    """A Python module that makes the parameters.

    A step adds the noise covariances over dt to the increments, times dt^2, and dt times those of
    the biases: all four are densities. Up to release 4.2 ``biasAccOmegaInt``, the identity by
    default, adds dt as well: a gyro noise of 1 rad/s/sqrt(Hz).
    """

    name, title, file = "gtsam", "GTSAM (Python)", "parameters of combined preintegration"
    convention = "N^2 and K^2 of each axis, continuous time"
    source = (
        "gtsam/navigation/CombinedImuFactor.cpp: PreintegratedCombinedMeasurements::"
        "integrateMeasurement; PreintegrationCombinedParams.h"
    )
    file_name, to_copy = "gtsam_imu.py", "Python, GTSAM"
    keys = WalkKeys(
        "gyroscopeCovariance biasOmegaCovariance accelerometerCovariance biasAccCovariance", power=2
    )

    @staticmethod
    def squares(imu: ImuNumbers) -> Iterator[tuple[str, str, str]]:
        """Name of each covariance, its diagonal (N^2 or K^2 of x, y and z), and its unit."""
        for name, quantity, letter, unit in _COVARIANCES:
            axes = (imu.gyro if quantity == "gyro" else imu.accel).xyz()
            yield name, ", ".join(f"{getattr(axis, letter) ** 2:.6e}" for axis in axes), unit

    def body(self, imu: ImuNumbers) -> list[str]:
        return [
            "import gtsam",
            "import numpy as np",
            "",
            f"params = gtsam.PreintegrationCombinedParams.MakeSharedU(9.81)  # {_GRAVITY}",
            *(
                f"params.set{name}(np.diag([{values}]))  # {unit}"
                for name, values, unit in self.squares(imu)
            ),
            'if hasattr(params, "setBiasAccOmegaInit"):'
            "  # up to GTSAM 4.2, by default a huge noise",
            "    params.setBiasAccOmegaInit(np.zeros((6, 6)))",
        ]


class GtsamCpp(Gtsam):
    """A header for C++."""

    name, title = "gtsam-cpp", "GTSAM (C++)"
    mark = "//"
    file_name, to_copy = "gtsam_imu.h", "C++, GTSAM"

    def body(self, imu: ImuNumbers) -> list[str]:
        make = "gtsam::PreintegrationCombinedParams::MakeSharedU(9.81)"
        return [
            "#pragma once",
            "",
            "#include <gtsam/navigation/CombinedImuFactor.h>",
            "",
            "inline auto imuParams() {",
            f"  auto params = {make};  // {_GRAVITY}",
            *(
                f"  params->{name[0].lower()}{name[1:]} = "
                f"gtsam::Vector3({values}).asDiagonal();  // {unit}"
                for name, values, unit in self.squares(imu)
            ),
            "  // params->biasAccOmegaInt.setZero();  // huge up to GTSAM 4.2",
            "  return params;",
            "}",
        ]


class KfGins(ImuFile):
    """N, sigma and tau in the units of data sheets, and the biases at the start."""

    name, title, file = "kfgins", "KF-GINS", "imunoise of kf-gins.yaml"
    convention = (
        "N and sigma of each axis for the one tau of all six, which is the one that costs least"
    )
    source = (
        "src/kf-gins/gi_engine.cpp: GIEngine::GIEngine, insPropagation; src/kf_gins.cpp: loadConfig"
    )
    form = "N+GM"
    one_tau = True
    caution = "keep your gsstd and asstd: no static recording shows scale factors"
    file_name = "kf-gins.yaml"
    keys = MemoryKeys(
        "arw gbstd corrtime vrw abstd corrtime",
        (ARW, DEG_H, _HOUR, 1.0 / 60.0, _MGAL, _HOUR),
    )

    def body(self, imu: ImuNumbers) -> list[str]:
        gyro, accel = imu.triads

        def start(axis: Axis) -> float:
            return sqrt(axis.sigma**2 + axis.initial_sd**2)

        return [
            "imunoise:",
            f"  arw: {gyro.listed(lambda axis: axis.N / ARW)}  # deg/sqrt(h)",
            f"  vrw: {accel.listed(lambda axis: axis.N * sqrt(_HOUR))}  # m/s/sqrt(h)",
            f"  gbstd: {gyro.listed(lambda axis: axis.sigma / DEG_H)}  # deg/h",
            f"  abstd: {accel.listed(lambda axis: axis.sigma / _MGAL)}  # mGal",
            f"  corrtime: {gyro.xyz()[0].tau / _HOUR:.6e}  # h",
            f"initbgstd: {gyro.listed(lambda axis: start(axis) / DEG_H)}  # deg/h",
            f"initbastd: {accel.listed(lambda axis: start(axis) / _MGAL)}  # mGal",
        ]


class Basalt(JsonFile):
    """Noise of Basalt's calibration file."""

    name, title, file = "basalt", "Basalt", "noise of its calibration, to be copied into value0"
    convention = (
        "N and K of each axis, continuous time; Basalt multiplies by sqrt(imu_update_rate) itself"
    )
    source = (
        "basalt-headers/include/basalt/calibration/calibration.hpp: Calibration; "
        "include/basalt/linearization/imu_block.hpp: ImuBlock::linearizeImu"
    )
    file_name = "basalt.json"
    keys = WalkKeys("gyro_noise_std gyro_bias_std accel_noise_std accel_bias_std")

    def body(self, imu: ImuNumbers) -> dict[str, Any]:
        values = {
            f"{name}_{what}_std": [_number(getattr(axis, letter)) for axis in triad.xyz()]
            for what, letter in (("noise", "N"), ("bias", "K"))
            for name, triad in (("accel", imu.accel), ("gyro", imu.gyro))
        }
        return {"value0": {"imu_update_rate": imu.rate, **values}}


class Glim(JsonFile):
    """White noise for GLIM, which has no place for a random walk."""

    name, title, file = "glim", "GLIM", "sensors of config_sensors.json"
    convention = "N for all axes, continuous time"
    source = "src/glim/common/imu_integration.cpp: IMUIntegration"
    shared = True
    file_name = "glim.json"
    caution = "imu_bias_noise: K of the accelerometers times sqrt(time between scans)"
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
