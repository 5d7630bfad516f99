"""GTSAM: parameters of combined preintegration, for Python and C++.

``CombinedImuFactor.cpp``, ``PreintegratedCombinedMeasurements::integrateMeasurement``: a step adds
the noise covariances over dt to the increments, times dt^2, and dt times those of the biases: all
four are densities, N^2 and K^2 (``PreintegrationCombinedParams.h``). The noise is that of the
sensor's axes, before ``body_P_sensor``.

The C++ file is a header: a function, since statements stand in none outside of one.

Up to release 4.2 the parameters also have ``biasAccOmegaInt``, the identity by default, of which a
step adds dt: a gyro noise of 1 rad/s/sqrt(Hz). Release 4.3 has it no more.
"""

from __future__ import annotations

from collections.abc import Sequence

from gmwm.export import tuning
from gmwm.export.imu import Imu
from gmwm.export.target import ImuFile

_COVARIANCES = (
    ("AccelerometerCovariance", "accel", "N", "(m/s^2)^2/Hz"),
    ("GyroscopeCovariance", "gyro", "N", "(rad/s)^2/Hz"),
    ("BiasAccCovariance", "accel", "K", "(m/s^3)^2/Hz"),
    ("BiasOmegaCovariance", "gyro", "K", "(rad/s^2)^2/Hz"),
)

_GRAVITY = "Z up; MakeSharedD for Z down"


def _squares(imu: Imu, quantity: str, letter: str) -> list[str]:
    triad = imu.gyro if quantity == "gyro" else imu.accel
    return [f"{getattr(axis, letter) ** 2:.6e}" for axis in triad.xyz()]


def _python(imu: Imu) -> Sequence[str]:
    lines = [
        "import gtsam",
        "import numpy as np",
        "",
        f"params = gtsam.PreintegrationCombinedParams.MakeSharedU(9.81)  # {_GRAVITY}",
    ]
    for name, quantity, letter, unit in _COVARIANCES:
        values = ", ".join(_squares(imu, quantity, letter))
        lines.append(f"params.set{name}(np.diag([{values}]))  # {unit}")
    return [
        *lines,
        'if hasattr(params, "setBiasAccOmegaInit"):  # up to GTSAM 4.2, by default a huge noise',
        "    params.setBiasAccOmegaInit(np.zeros((6, 6)))",
    ]


def _cpp(imu: Imu) -> Sequence[str]:
    lines = [
        "#pragma once",
        "",
        "#include <gtsam/navigation/CombinedImuFactor.h>",
        "",
        "inline auto imuParams() {",
        f"  auto params = gtsam::PreintegrationCombinedParams::MakeSharedU(9.81);  // {_GRAVITY}",
    ]
    for name, quantity, letter, unit in _COVARIANCES:
        values = ", ".join(_squares(imu, quantity, letter))
        member = name[0].lower() + name[1:]
        lines.append(f"  params->{member} = gtsam::Vector3({values}).asDiagonal();  // {unit}")
    return [
        *lines,
        "  // Up to GTSAM 4.2, or its default, a gyro noise of 1 rad/s/sqrt(Hz),",
        "  // swamps the rest:",
        "  // params->biasAccOmegaInt.setZero();",
        "  return params;",
        "}",
    ]


_CONVENTION = "N^2 and K^2 of each axis, continuous time"
_SOURCE = (
    "gtsam/navigation/CombinedImuFactor.cpp: PreintegratedCombinedMeasurements::"
    "integrateMeasurement; PreintegrationCombinedParams.h"
)

GTSAM = (
    ImuFile("gtsam", "GTSAM (Python)", "parameters of combined preintegration", _CONVENTION,
           _SOURCE, _python, horizon=tuning.KEYFRAME),
    ImuFile("gtsam-cpp", "GTSAM (C++)", "parameters of combined preintegration", _CONVENTION,
           _SOURCE, _cpp, horizon=tuning.KEYFRAME, mark="//"),
)  # fmt: skip
