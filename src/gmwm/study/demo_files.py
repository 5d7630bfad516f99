"""Files to try every command with: a sensor at rest, and a drive with GNSS."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import csv

from gmwm._core.typing import FloatArray
from gmwm._core.units import SI_UNIT
from gmwm.study.emulated_logs import LEVER_ARM, emulated_log, sensors

RATE, DRIVE = 25.0, 600.0
"""Hz; s. Small files, and a drive long enough to compare sensor models on."""

_GRAVITY = 9.80665
_AXES = tuple(f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz")


def write_demo_files(folder: Path, seconds: float, seed: int) -> tuple[float, float, float]:
    """Write ``static.csv``, ``imu.csv`` and ``fixes.csv``.

    seconds: Length of the recording at rest.
    Returns: from the IMU to the antenna: forward, right, down; m.
    """
    still = sensors().simulate(round(seconds * RATE), 1.0 / RATE, np.random.default_rng(seed)).total
    _write(folder / "static.csv", _inertial(still + np.array([0, 0, 0, 0, 0, -_GRAVITY])))
    log, _ = emulated_log(seed, duration=DRIVE, rate=RATE)
    moving = np.hstack([log.imu.rotation, log.imu.velocity]) * RATE
    _write(folder / "imu.csv", _inertial(moving))
    position, velocity = log.aiding.fixes
    columns = {"time_s": position.time}
    columns |= {"latitude_deg": np.degrees(position.value[:, 0])}
    columns |= {"longitude_deg": np.degrees(position.value[:, 1]), "height_m": position.value[:, 2]}
    for i, name in enumerate(("north", "east", "down")):
        columns |= {f"velocity_{name}": velocity.value[:, i], f"sd_{name}": position.sd[:, i]}
        columns |= {f"sd_velocity_{name}": velocity.sd[:, i]}
    _write(folder / "fixes.csv", columns)
    return LEVER_ARM


def _inertial(values: FloatArray) -> dict[str, FloatArray]:
    values = np.round(values, 8)  # far below the noise
    columns = {f"{a} [{SI_UNIT[a.split('_')[0]]}]": values[:, i] for i, a in enumerate(_AXES)}
    # A sample is the mean over the interval that ends at its stamp.
    return {"time [s]": np.round((np.arange(len(values)) + 1) / RATE, 6)} | columns


def _write(path: Path, columns: dict[str, FloatArray]) -> None:
    csv.write_csv(pa.table(columns), path)
