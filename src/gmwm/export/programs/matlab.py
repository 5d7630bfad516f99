"""MATLAB's ``imuSensor`` (Navigation Toolbox, Sensor Fusion and Tracking Toolbox).

``NoiseType`` "single-sided" has samples of standard deviation NoiseDensity sqrt(f), and a walk by
RandomWalk/sqrt(f) a sample: N and K as here. The default, "double-sided", halves the white
variance and doubles that of the walk (manual of imuSensor, Algorithms; the example "Inertial
Sensor Noise Analysis Using Allan Variance" sets "single-sided" for the same reason).
"""

from __future__ import annotations

from gmwm.export.imu import Imu, Triad
from gmwm.export.target import ImuFile


def _parameters(name: str, make: str, triad: Triad) -> list[str]:
    noise, walk = (
        " ".join(f"{getattr(axis, letter):.6e}" for axis in triad.xyz()) for letter in "NK"
    )
    return [
        f"{name} = {make}( ...",
        f"    'NoiseDensity', [{noise}], ...",
        f"    'RandomWalk', [{walk}], ...",
        "    'NoiseType', 'single-sided');",
    ]


def _body(imu: Imu) -> list[str]:
    return [
        *_parameters("gyro", "gyroparams", imu.gyro),
        *_parameters("accel", "accelparams", imu.accel),
        f"imu = imuSensor('accel-gyro', 'SampleRate', {imu.rate:.9g}, ...",
        "    'Gyroscope', gyro, 'Accelerometer', accel);",
    ]


MATLAB = ImuFile(
    "matlab", "MATLAB", "gyroparams and accelparams of imuSensor",
    "N and K of each axis with NoiseType single-sided; releases before R2022b have no NoiseType "
    "and the default's scale: multiply NoiseDensity by sqrt(2), divide RandomWalk by sqrt(2)",
    "manual of imuSensor, Algorithms; gyroparams, NoiseType",
    _body, mark="%",
)  # fmt: skip
