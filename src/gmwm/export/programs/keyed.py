"""Files of keys and values: the programs differ in names, units and a power of the rate only.

Each target names the file and function of the program that define what its value means; the tests
put the values through that equation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt

from gmwm.export import tuning
from gmwm.export.imu import Axis, Imu, Triad
from gmwm.export.target import ImuFile
from gmwm.filter_numbers import EKF2_INTERVAL

_UNITS = {
    ("gyro", "N"): "rad/s/sqrt(Hz)",
    ("gyro", "K"): "rad/s^2/sqrt(Hz)",
    ("accel", "N"): "m/s^2/sqrt(Hz)",
    ("accel", "K"): "m/s^3/sqrt(Hz)",
}

_SQUARED = {
    ("gyro", "N"): "(rad/s)^2",
    ("gyro", "K"): "(rad/s^2)^2",
    ("accel", "N"): "(m/s^2)^2",
    ("accel", "K"): "(m/s^3)^2",
}

_PER_SAMPLE = {
    ("gyro", "N"): "rad/s",
    ("gyro", "K"): "rad/s^2",
    ("accel", "N"): "m/s^2",
    ("accel", "K"): "m/s^3",
}


def _same(value: float, letter: str, rate: float) -> float:
    return value


@dataclass(frozen=True)
class Keys:
    """How N and K are called and converted.

    names: Key, quantity, and "N" or "K".
    convert: Of a value, its letter and the rate in Hz.
    units: (quantity, letter) -> unit of the value.
    before, after: Lines around the values; ``{rate}`` and ``{topic}`` stand for the rate and the
        topic.
    indent, prefix: Before the key.
    separator: Between key and value.
    ending: After the value, before the unit.
    """

    names: Sequence[tuple[str, str, str]]
    convert: Callable[[float, str, float], float] = _same
    units: dict[tuple[str, str], str] | None = None
    before: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    indent: str = ""
    prefix: str = ""
    separator: str = ": "
    ending: str = "  # {unit}"

    @property
    def needs_rate(self) -> bool:
        """Whether the file depends on the rate of the IMU."""
        return self.convert in (_two_ends, _variance) or any(
            "{rate}" in line for line in (*self.before, *self.after)
        )

    def __call__(self, imu: Imu) -> list[str]:
        units = self.units or _UNITS
        rate = imu.rate if self.needs_rate else float("nan")
        topic = imu.topic or "/imu0  # set to the topic of your bag"
        lines = [line.format(rate=_decimal(rate), topic=topic) for line in self.before]
        for key, quantity, letter in self.names:
            triad = imu.gyro if quantity == "gyro" else imu.accel

            def value(of: Axis | Triad, letter: str = letter) -> float:
                return self.convert(getattr(of, letter), letter, rate)

            ending = self.ending.format(unit=units[quantity, letter])
            lines.append(
                f"{self.indent}{self.prefix}{key}{self.separator}{value(triad):.6e}{ending}"
            )
            if triad.is_upper(letter):
                what = "white noise" if letter == "N" else "random walk"
                lines.append(f"{self.indent}#   no {what} was found: this is the largest 95 % "
                             "upper bound")  # fmt: skip
        return [*lines, *(line.format(rate=_decimal(rate), topic=topic) for line in self.after)]


def _decimal(rate: float) -> str:
    """With a point, since OpenCV distinguishes whole numbers from others."""
    text = f"{rate:.9g}"
    return text if "." in text or "e" in text else f"{text}.0"


def _named(gyro_noise: str, accel_noise: str, gyro_walk: str, accel_walk: str
           ) -> tuple[tuple[str, str, str], ...]:  # fmt: skip
    return (
        (accel_noise, "accel", "N"),
        (accel_walk, "accel", "K"),
        (gyro_noise, "gyro", "N"),
        (gyro_walk, "gyro", "K"),
    )


_KALIBR = _named(
    "gyroscope_noise_density", "accelerometer_noise_density",
    "gyroscope_random_walk", "accelerometer_random_walk",
)  # fmt: skip

_CONTINUOUS = "N and K for all axes, continuous time"

_IDENTITY = ("    - [1.0, 0.0, 0.0]", "    - [0.0, 1.0, 0.0]", "    - [0.0, 0.0, 1.0]")
_ZERO = ("    - [0.0, 0.0, 0.0]",) * 3
_POSE = (
    "    - [1.0, 0.0, 0.0, 0.0]",
    "    - [0.0, 1.0, 0.0, 0.0]",
    "    - [0.0, 0.0, 1.0, 0.0]",
    "    - [0.0, 0.0, 0.0, 1.0]",
)


def _two_ends(value: float, letter: str, rate: float) -> float:
    """A step takes the mean of two samples as independent, and walks by the value times dt."""
    return value * sqrt(2.0 * rate) if letter == "N" else value * sqrt(rate)


def _variance(value: float, letter: str, rate: float) -> float:
    """A step adds variance times dt^2."""
    return value**2 * rate


def _ekf2(value: float, letter: str, rate: float) -> float:
    """A step of the filter, not of the IMU, adds (value times dt)^2."""
    return value / sqrt(EKF2_INTERVAL)


KALIBR = ImuFile(
    "kalibr", "Kalibr", "imu.yaml",
    f"{_CONTINUOUS}; zeros are refused",
    "kalibr_common/ConfigReader.py: ImuParameters.getAccelerometerStatistics, getGyroStatistics; "
    "IccSensors.py: addBiasMotionTerms",
    Keys(_KALIBR, after=("rostopic: {topic}",
                         "update_rate: {rate}  # Hz")),
    horizon=tuning.KEYFRAME, shared=True,
)  # fmt: skip

OPENVINS = ImuFile(
    "openvins", "OpenVINS", "kalibr_imu_chain.yaml",
    f"{_CONTINUOUS}; scale, misalignment and g-sensitivity are those of an ideal IMU",
    "ov_msckf/src/state/Propagator.cpp: predict_and_compute; core/VioManagerOptions.h",
    Keys(
        _KALIBR, indent="  ", before=("imu0:", "  T_i_b:", *_POSE),
        after=(
            "  rostopic: {topic}",
            "  time_offset: 0.0",
            "  update_rate: {rate}  # Hz",
            '  model: "kalibr"',
            "  Tw:", *_IDENTITY,
            "  R_IMUtoGYRO:", *_IDENTITY,
            "  Ta:", *_IDENTITY,
            "  R_IMUtoACC:", *_IDENTITY,
            "  Tg:", *_ZERO,
        ),
    ),
    horizon=tuning.KEYFRAME, shared=True, head=("%YAML:1.0",),
)  # fmt: skip

VINS = ImuFile(
    "vins", "VINS-Mono and VINS-Fusion", "the IMU block of the configuration",
    "N sqrt(2 f), since the mid-point step takes the two samples at its ends as independent, and "
    "K sqrt(f), f the rate of the IMU; for all axes",
    "vins_estimator/src/factor/integration_base.h: IntegrationBase, midPointIntegration",
    Keys(_named("gyr_n", "acc_n", "gyr_w", "acc_w"), _two_ends, _PER_SAMPLE),
    horizon=tuning.KEYFRAME, shared=True,
)  # fmt: skip

ORBSLAM3 = ImuFile(
    "orbslam3", "ORB-SLAM3", "the IMU block of the settings",
    f"{_CONTINUOUS}; ORB-SLAM3 multiplies and divides by sqrt(IMU.Frequency) itself",
    "src/Tracking.cc: newParameterLoader (IMU::Calib); src/ImuTypes.cc: IntegrateNewMeasurement",
    Keys(_named("IMU.NoiseGyro", "IMU.NoiseAcc", "IMU.GyroWalk", "IMU.AccWalk"),
         after=("IMU.Frequency: {rate}  # Hz",)),
    horizon=tuning.KEYFRAME, shared=True,
)  # fmt: skip

FASTLIO = ImuFile(
    "fastlio", "FAST-LIO2", "the mapping block of the configuration",
    "N^2 f and K^2 f, variances of one sample at the rate f of the IMU; for all axes",
    "include/IKFoM_toolkit/esekfom/esekfom.hpp: predict; src/IMU_Processing.hpp: UndistortPcl",
    Keys(_named("gyr_cov", "acc_cov", "b_gyr_cov", "b_acc_cov"), _variance, _SQUARED,
         before=("mapping:",), indent="  "),
    horizon=tuning.KEYFRAME, shared=True,
)  # fmt: skip

LIOSAM = ImuFile(
    "liosam", "LIO-SAM", "the IMU settings of params.yaml", _CONTINUOUS,
    "src/imuPreintegration.cpp: IMUPreintegration",
    Keys(_named("imuGyrNoise", "imuAccNoise", "imuGyrBiasN", "imuAccBiasN"),
         before=("lio_sam:",), indent="  "),
    horizon=tuning.KEYFRAME, shared=True,
)  # fmt: skip

KIMERA = ImuFile(
    "kimera", "Kimera-VIO", "noise of ImuParams.yaml", f"{_CONTINUOUS}; zeros are refused",
    "src/imu-frontend/ImuFrontend.cpp: convertVioImuParamsToGtsam; src/backend/VioBackend.cpp: "
    "addImuFactor",
    Keys(_KALIBR, before=("rate_hz: {rate}",)),
    horizon=tuning.KEYFRAME, shared=True, head=("%YAML:1.0",),
)  # fmt: skip

OKVIS2 = ImuFile(
    "okvis2", "OKVIS2", "imu_parameters of the configuration",
    f"{_CONTINUOUS}; sigma_bg and sigma_ba, the biases at switch-on, are not in a static recording",
    "okvis_ceres/src/ImuError.cpp: ImuError::propagation; okvis_common/src/ViParametersReader.cpp",
    Keys(_named("sigma_g_c", "sigma_a_c", "sigma_gw_c", "sigma_aw_c"),
         before=("imu_parameters:",), indent="    "),
    horizon=tuning.KEYFRAME, shared=True,
)  # fmt: skip

MAPLAB = ImuFile(
    "maplab", "maplab", "the IMU in the sensors file", _CONTINUOUS,
    "map-structure/sensors/src/imu.cc; algorithms/imu-integrator-rk4/include/imu-integrator/"
    "imu-integrator-inl.h: getCovarianceTransitionDerivativesRungeKutta",
    Keys(_named("gyro_noise_density", "acc_noise_density",
                "gyro_bias_random_walk_noise_density", "acc_bias_random_walk_noise_density"),
         before=("sigmas:",), indent="  "),
    horizon=tuning.KEYFRAME, shared=True,
)  # fmt: skip

PX4 = ImuFile(
    "px4", "PX4 EKF2", "a parameter file for QGroundControl",
    "N/sqrt(dt) and K/sqrt(dt) for all axes, dt = "
    f"{EKF2_INTERVAL:g} s the interval of the filter (EKF2_PREDICT_US), not of the IMU",
    "src/modules/ekf2/EKF/covariance.cpp: predictCovariance; src/modules/ekf2/module.yaml",
    Keys(
        _named("EKF2_GYR_NOISE", "EKF2_ACC_NOISE", "EKF2_GYR_B_NOISE", "EKF2_ACC_B_NOISE"),
        _ekf2, prefix="1\t1\t", separator="\t", ending="\t9",
    ),
    shared=True,
    warnings=(
        "LEAST VALUES, NOT FOR FLIGHT AS THEY ARE: vibration, which a recording on the bench "
        "does not hold, dominates in the air; PX4's defaults (gyro 0.015 rad/s, accelerometer "
        "0.35 m/s^2) stand for it. Record in flight, or keep the larger of the two. PX4 takes "
        "gyro noise of 0.0001 to 0.1 rad/s, accelerometer noise of 0.01 to 1 m/s^2, and bias "
        "noise up to 0.01.",
    ),
)  # fmt: skip

KEYED = (KALIBR, OPENVINS, VINS, ORBSLAM3, FASTLIO, LIOSAM, KIMERA, OKVIS2, MAPLAB, PX4)
