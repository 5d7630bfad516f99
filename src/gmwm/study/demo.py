"""Simulated recordings and a log with a known truth."""

from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import csv

from gmwm._core.typing import FloatArray
from gmwm._core.units import SI_UNIT
from gmwm.ins import SensorModels, car_drive, emulate, gnss
from gmwm.ins.fields import sensor_models
from gmwm.ins.sensors import AXES
from gmwm.process import GaussMarkov, Model, WhiteNoise
from gmwm.readers import Recording

LEVER_ARM = (1.0, 0.3, -1.0)
_DEGREE_HOUR, _MICRO_G = np.radians(1.0 / 3600.0), 9.80665e-6
_BIAS = {"gyro": 1.7e-3, "accel": 0.1}


def sensors(
    *, gyro: float = 1.0, accel: float = 1.0, slow: float = 1.0, tau: float = 100.0
) -> SensorModels:
    """Sensors of a small tactical IMU, with factors on white noise and on slow errors.

    gyro, accel, slow: Factors on N of the gyros, N of the accelerometers, and sigma of all.
    """
    return SensorModels.of(
        {
            "gyro": WhiteNoise(gyro * 20.0 * _DEGREE_HOUR)
            + GaussMarkov(slow * 20.0 * _DEGREE_HOUR, tau),
            "accel": WhiteNoise(accel * 100.0 * _MICRO_G)
            + GaussMarkov(slow * 100.0 * _MICRO_G, tau),
        },
        _BIAS,
    )


RATE = 100.0
"""Hz."""


DEMO = sensor_models(
    {
        "gyro": {"N": "12 deg/h/sqrt(Hz)", "GM": [["25 deg/h", 20.0]]},
        "accel": {"N": "80 ug/sqrt(Hz)", "K": "120 ug/sqrt(h)"},
    },
    "demo",
)
"""A good MEMS IMU: an hour determines every parameter."""


def simulated_imu(
    seconds: float, seed: int, sensors: SensorModels = DEMO
) -> tuple[Recording, dict[str, Model]]:
    """A six-axis static recording and the model of each of its channels.

    Returns: dict, channel name -> Model that made it.
    """
    rng, n, truth = np.random.default_rng(seed), int(seconds * RATE), sensors.models
    columns = {name: model.simulate(n, 1.0 / RATE, rng) for name, model in truth.items()}
    source = f"simulated IMU, seed {seed}"
    return Recording.from_arrays(columns, RATE, SI_UNIT, source=source), truth


FILES_RATE, DRIVE = 25.0, 600.0
"""Hz; s. Small files, and a drive long enough to compare sensor models on."""

_GRAVITY = 9.80665


def write_demo_files(folder: Path, seconds: float, seed: int) -> tuple[float, float, float]:
    """Write ``static.csv``, ``imu.csv`` and ``fixes.csv``.

    Returns: from the IMU to the antenna: forward, right, down; m.
    """
    rng = np.random.default_rng(seed)
    still = sensors().simulate(round(seconds * FILES_RATE), 1.0 / FILES_RATE, rng).total
    _write(folder / "static.csv", still + np.array([0, 0, 0, 0, 0, -_GRAVITY]))
    rng = np.random.default_rng(seed)
    drive = car_drive(duration=DRIVE, dt=1.0 / FILES_RATE)
    ideal = emulate(drive)
    errors = sensors().simulate(ideal.n, ideal.dt, rng).total
    imu = ideal.with_errors(errors[:, :3], errors[:, 3:])
    _write(folder / "imu.csv", np.hstack([imu.rotation, imu.velocity]) * FILES_RATE)
    fixes = gnss(drive, velocity_sd=(0.1, 0.1, 0.15), lever_arm=LEVER_ARM, imu=ideal)
    position, velocity = fixes.noisy(rng).fixes
    latitude, longitude, height = position.value.T
    columns = {"time_s": position.time, "latitude_deg": np.degrees(latitude)}
    columns |= {"longitude_deg": np.degrees(longitude), "height_m": height}
    for i, name in enumerate(("north", "east", "down")):
        columns |= {f"velocity_{name}": velocity.value[:, i], f"sd_{name}": position.sd[:, i]}
        columns |= {f"sd_velocity_{name}": velocity.sd[:, i]}
    csv.write_csv(pa.table(columns), folder / "fixes.csv")
    return LEVER_ARM


def _write(path: Path, values: FloatArray) -> None:
    values = np.round(values, 8)  # far below the noise
    # A sample is the mean over the interval that ends at its stamp.
    columns = {"time [s]": np.round((np.arange(len(values)) + 1) / FILES_RATE, 6)}
    columns |= {f"{a} [{SI_UNIT[a.split('_')[0]]}]": values[:, i] for i, a in enumerate(AXES)}
    csv.write_csv(pa.table(columns), path)
