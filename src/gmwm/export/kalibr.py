"""Kalibr's ``imu.yaml``: one noise density and one random walk per sensor.

Kalibr's model is white noise plus random walk, the same for all axes, in continuous time
(https://github.com/ethz-asl/kalibr/wiki/IMU-Noise-Model). It refuses zeros.
"""

from __future__ import annotations

import os
from pathlib import Path

from gmwm._core.files import written
from gmwm.calibration import Calibration, Level, noise_density, random_walk
from gmwm.errors import InputError

_SENSORS = (
    ("accel", "accelerometer", "m/s^2/sqrt(Hz)", "m/s^3/sqrt(Hz)"),
    ("gyro", "gyroscope", "rad/s/sqrt(Hz)", "rad/s^2/sqrt(Hz)"),
)


def kalibr_text(calibration: Calibration) -> str:
    """The content of ``imu.yaml``.

    Each value is that of the noisiest axis. The noise density counts every term that averages out
    at 1 s; a random walk that no axis shows is given by the largest of the axes' 95 % upper bounds.

    Raises
    ------
    InputError
        If the calibration has no gyro or no accelerometer, which Kalibr needs both, or the record
        bounds a value in no way.
    """
    source = " ".join(calibration.source.split()) or "recording"
    lines = [f"# {source}, {calibration.duration:.0f} s static"]
    for quantity, name, density_unit, walk_unit in _SENSORS:
        fits = {k: f for k, f in calibration.fits.items() if f.wv.quantity == quantity}
        if not fits:
            raise InputError(
                f"imu.yaml needs gyro and accelerometer, there is no {name}: calibrate both"
            )
        densities = {key: noise_density(fitted) for key, fitted in fits.items()}
        lines += _entry(f"{name}_noise_density", density_unit, "white noise", densities)
        walks = {key: random_walk(fitted) for key, fitted in fits.items()}
        lines += _entry(f"{name}_random_walk", walk_unit, "random walk", walks)
    not_valid = [name for name, fitted in calibration.fits.items() if not fitted.valid]
    if not_valid:
        lines.append(f"# not valid, see the report before use: {', '.join(not_valid)}")
    lines.append("rostopic: /imu0  # set to the topic of your bag")
    lines.append(f"update_rate: {calibration.rate:.6g}  # Hz")
    return "\n".join(lines) + "\n"


def _entry(key: str, unit: str, what: str, levels: dict[str, Level]) -> list[str]:
    """A value with its comments; the largest that was found, or else the largest bound."""
    found = {name: level.value for name, level in levels.items() if level.found}
    chosen = found or {name: level.value for name, level in levels.items()}
    lines = [f"{key}: {max(chosen.values()):.6e}  # {unit}"]
    if not found:
        lines.append(f"#   no {what} was found: this is the largest 95 % upper bound")
    by_axis = [
        f"{name} {'' if level.found else '< '}{level.value:.3e}" for name, level in levels.items()
    ]
    return [*lines, f"#   by axis: {', '.join(by_axis)}"]


def write_kalibr(calibration: Calibration, path: str | os.PathLike[str]) -> Path:
    """Write ``imu.yaml``; see `kalibr_text`.

    Raises
    ------
    InputError
        If a sensor is missing or the file cannot be written.
    """
    text = kalibr_text(calibration)
    with written(path) as stream:
        stream.write(text)
    return Path(path)
