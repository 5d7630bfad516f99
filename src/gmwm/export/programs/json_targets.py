"""JSON files, whose comments are an entry of their own: Basalt and GLIM.

Basalt, ``basalt-headers/include/basalt/calibration/calibration.hpp``, ``Calibration``: samples have
N sqrt(rate) (``dicrete_time_gyro_noise_std``); ``include/basalt/linearization/imu_block.hpp``,
``ImuBlock::linearizeImu``, divides the weight of a bias step, 1/K, by sqrt(dt).

GLIM, ``src/glim/common/imu_integration.cpp``, ``IMUIntegration``: N, squared to GTSAM's densities.
``src/glim/odometry/odometry_estimation_imu.cpp``: ``imu_bias_noise`` is the standard deviation of
the step of all six biases from scan to scan, rad/s and m/s^2 alike, which no K can be.
"""

from __future__ import annotations

import json
from typing import Any

from gmwm.export import tuning
from gmwm.export.imu import Imu
from gmwm.export.target import ImuFile


class JsonFile(ImuFile):
    """A file in JSON: `ImuFile.body` gives the object but for the comments, which end it."""

    def text(self, imu: Imu) -> str:
        return json_text({**self.body(imu), "comment": [*self.above(imu), *self.below(imu)]}) + "\n"


def json_text(value: Any, indent: str = "") -> str:
    """JSON with an entry, or a line of text, on each line; matrices on one."""
    inner = indent + "  "
    if isinstance(value, dict):
        lines = [
            f"{inner}{json.dumps(key)}: {json_text(each, inner)}" for key, each in value.items()
        ]
        return "{\n" + ",\n".join(lines) + f"\n{indent}}}"
    if isinstance(value, list) and value and all(isinstance(each, str) for each in value):
        return "[\n" + ",\n".join(inner + json.dumps(each) for each in value) + f"\n{indent}]"
    return json.dumps(value, allow_nan=False)


def _number(value: float) -> float:
    return float(f"{value:.6e}")


def _basalt(imu: Imu) -> dict[str, Any]:
    names = (("accel", imu.accel), ("gyro", imu.gyro))
    values = {
        f"{name}_{what}_std": [_number(getattr(axis, letter)) for axis in triad.xyz()]
        for what, letter in (("noise", "N"), ("bias", "K"))
        for name, triad in names
    }
    return {"value0": {"imu_update_rate": imu.rate, **values}}


def _glim(imu: Imu) -> dict[str, Any]:
    noise = {"imu_acc_noise": _number(imu.accel.N), "imu_gyro_noise": _number(imu.gyro.N)}
    return {"sensors": noise}


JSON_TARGETS = (
    JsonFile(
        "basalt", "Basalt", "noise of its calibration, to be copied into value0",
        "N and K of each axis, continuous time; Basalt multiplies by sqrt(imu_update_rate) itself",
        "basalt-headers/include/basalt/calibration/calibration.hpp: Calibration; "
        "include/basalt/linearization/imu_block.hpp: ImuBlock::linearizeImu",
        _basalt, horizon=tuning.KEYFRAME,
    ),
    JsonFile(
        "glim", "GLIM", "sensors of config_sensors.json",
        "N for all axes, continuous time",
        "src/glim/common/imu_integration.cpp: IMUIntegration",
        _glim, horizon=tuning.KEYFRAME, shared=True,
        warnings=(
            "imu_bias_noise is one step for gyros (rad/s) and accelerometers (m/s^2) alike, which "
            "no K can be: with K sqrt(time between scans) of the accelerometers those are right "
            "and the gyros' biases looser than need be.",
        ),
    ),
)  # fmt: skip
