"""GTSAM: parameters of combined preintegration, for Python and C++.

``CombinedImuFactor.cpp``, ``PreintegratedCombinedMeasurements::integrateMeasurement``: a step adds
the noise covariances over dt to the increments, times dt^2, and dt times those of the biases: all
four are densities, N^2 and K^2 (``PreintegrationCombinedParams.h``). The noise is that of the
sensor's axes, before ``body_P_sensor``.

The C++ file is a header with one function, since statements cannot stand outside of one.

Up to release 4.2 the parameters also have ``biasAccOmegaInt``, the identity by default, of which a
step adds dt: a gyro noise of 1 rad/s/sqrt(Hz). Release 4.3 has dropped it.
"""

from __future__ import annotations

from collections.abc import Iterator

from gmwm.export.imu import ImuNumbers
from gmwm.export.keys import WalkKeys
from gmwm.export.target import KEYFRAME, ImuFile

_COVARIANCES = (
    ("AccelerometerCovariance", "accel", "N", "(m/s^2)^2/Hz"),
    ("GyroscopeCovariance", "gyro", "N", "(rad/s)^2/Hz"),
    ("BiasAccCovariance", "accel", "K", "(m/s^3)^2/Hz"),
    ("BiasOmegaCovariance", "gyro", "K", "(rad/s^2)^2/Hz"),
)

_GRAVITY = "Z up; MakeSharedD for Z down"


class Gtsam(ImuFile):
    """A Python module that makes the parameters."""

    name = "gtsam"
    title = "GTSAM (Python)"
    file = "parameters of combined preintegration"
    convention = "N^2 and K^2 of each axis, continuous time"
    source = (
        "gtsam/navigation/CombinedImuFactor.cpp: PreintegratedCombinedMeasurements::"
        "integrateMeasurement; PreintegrationCombinedParams.h"
    )
    horizon = KEYFRAME
    file_name = "gtsam_imu.py"
    keys = WalkKeys(
        (
            "gyroscopeCovariance",
            "biasOmegaCovariance",
            "accelerometerCovariance",
            "biasAccCovariance",
        ),
        power=2,
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

    name = "gtsam-cpp"
    title = "GTSAM (C++)"
    mark = "//"
    file_name = "gtsam_imu.h"

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
            "  // Up to GTSAM 4.2, or its default, a gyro noise of 1 rad/s/sqrt(Hz),",
            "  // swamps the rest:",
            "  // params->biasAccOmegaInt.setZero();",
            "  return params;",
            "}",
        ]
