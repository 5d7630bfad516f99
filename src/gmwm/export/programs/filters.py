"""Filters and simulators with files of their own, such as GTSAM, KF-GINS, Gazebo and MATLAB.

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
