"""Simulated recordings and logs with a known truth, right or with a fault, as users have them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import csv

from gmwm._core.typing import FloatArray
from gmwm._core.units import SI_UNIT, customary_unit
from gmwm.errors import InputError
from gmwm.estimate.result import Fit
from gmwm.ins import (
    Fixes,
    Imu,
    Measured,
    SensorModels,
    Trajectory,
    car_drive,
    emulate,
    fixed_wing_loiter,
    gnss,
    helicopter_mapping,
)
from gmwm.ins.imu import AXES
from gmwm.ins.spec import sensor_models
from gmwm.process import GaussMarkov, Model, WhiteNoise
from gmwm.readers import Recording

VEHICLES: dict[str, Callable[..., Trajectory]] = {
    "car": car_drive,
    "helicopter": helicopter_mapping,
    "loiter": fixed_wing_loiter,
}

FAULTS = {
    "coloured": "coloured GNSS",
    "stamps": "stamps of fixes 0.2 s late",
    "leap seconds": "stamps of fixes in GPS time, 18 s late",
    "clock step": "stamps of fixes a second late from the middle on",
    "lever arm": "lever arm left out",
    "off-grid": "fixes between samples",
    "one far": "one fix 500 m off",
    "outliers": "3 % outliers of 50 m",
    "mounting": "IMU turned by 90 deg about its vertical axis",
    "clock drift": "the fixes' clock 500 ppm fast",
    "gyro scale": "3 % too much of all gyros",
    "accel scale": "3 % too much of all accelerometers",
}

LEVER_ARM = (1.0, 0.3, -1.0)
_DEGREE_HOUR, _MICRO_G = np.radians(1.0 / 3600.0), 9.80665e-6
_BIAS = {"gyro": 1.7e-3, "accel": 0.1}
_OFF_GRID = 4  # parts of a sampling interval


def sensors(
    *, gyro: float = 1.0, accel: float = 1.0, slow: float = 1.0, tau: float = 100.0
) -> SensorModels:
    """Sensors of a small tactical IMU, with factors on white noise and on slow errors.

    gyro, accel, slow: Factors on N of the gyros, N of the accelerometers, and sigma of all.
    tau: Correlation time of the slow errors, s.
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


def emulated_log(
    seed: int,
    vehicle: str = "car",
    *,
    duration: float = 600.0,
    rate: float = 25.0,
    velocity: bool = True,
    faults: tuple[str, ...] = (),
    truth: SensorModels | None = None,
    believed: SensorModels | None = None,
) -> tuple[Measured, Trajectory]:
    """A log, and the trajectory that was driven or flown.

    vehicle: {"car", "helicopter", "loiter"}.
    duration, rate: s; Hz, of the IMU. Fixes come once a second, with 1, 1 and 1.5 m.
    velocity: Whether the fixes have velocities too.
    faults: Of `FAULTS`.
    truth, believed: Of the errors, and of the filter; by default `sensors`, both.
    Raises InputError for an unknown fault.
    """
    for fault in faults:
        if fault not in FAULTS:
            raise InputError(f"fault {fault!r}: write one of {', '.join(FAULTS)}")
    rng = np.random.default_rng(seed)
    finer = _OFF_GRID if "off-grid" in faults else 1
    fine, ideal = _world(vehicle, duration, rate * finer)
    imu = Imu(
        1.0 / rate,
        *(each.reshape(-1, finer, 3).sum(axis=1) for each in (ideal.rotation, ideal.velocity)),
    )
    errors = (truth or sensors()).simulate(imu.n, imu.dt, rng).total
    imu = imu.with_errors(errors[:, :3], errors[:, 3:])
    late = fine.dt if finer > 1 else 0.0
    aiding = gnss(
        fine.segment(late, duration),
        velocity_sd=(0.1, 0.1, 0.15) if velocity else None,
        lever_arm=LEVER_ARM,
        coloured_sd=(2.0, 2.0, 3.0) if "coloured" in faults else (0, 0, 0),
        coloured_tau=60.0,
        imu=Imu(fine.dt, ideal.rotation[finer > 1 :], ideal.velocity[finer > 1 :]),
    ).noisy(rng)
    aiding = replace(aiding, coloured_sd=(0.0, 0.0, 0.0))
    by = late + (0.2 if "stamps" in faults else 0.0) + (18.0 if "leap seconds" in faults else 0.0)
    step = 1.0 if "clock step" in faults else 0.0
    drift = 5e-4 if "clock drift" in faults else 0.0

    def stamped(fixes: Fixes) -> Fixes:
        time = fixes.time
        later = by + (1.0 + drift) * time + step * (time > 0.5 * duration)
        return replace(fixes, time=later).part(later <= duration)

    position, *others = map(stamped, aiding.fixes)
    aiding = replace(aiding, fixes=(_with_outliers(position, faults, rng), *others))
    if "lever arm" in faults:
        aiding = replace(aiding, lever_arm=(0.0, 0.0, 0.0))
    if "mounting" in faults:
        turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        imu = Imu(imu.dt, imu.rotation @ turn.T, imu.velocity @ turn.T)
    gyro, accel = (1.03 if f"{kind} scale" in faults else 1.0 for kind in ("gyro", "accel"))
    imu = Imu(imu.dt, imu.rotation * gyro, imu.velocity * accel)
    models = believed or truth or sensors()
    return Measured(imu, aiding, models, title=f"{vehicle}, seed {seed}"), fine


@lru_cache(maxsize=4)
def _world(vehicle: str, duration: float, rate: float) -> tuple[Trajectory, Imu]:
    truth = VEHICLES[vehicle](duration=duration, dt=1.0 / rate)
    return truth, emulate(truth)


def _with_outliers(fixes: Fixes, faults: tuple[str, ...], rng: np.random.Generator) -> Fixes:
    by = np.zeros((fixes.time.size, 3))
    if "one far" in faults:
        by[fixes.time.size // 2, 0] = 500.0
    if "outliers" in faults:
        far = rng.random(fixes.time.size) < 0.03
        angle = rng.uniform(0.0, 2.0 * np.pi, fixes.time.size)
        by[far, 0], by[far, 1] = 50.0 * np.cos(angle[far]), 50.0 * np.sin(angle[far])
    return replace(fixes, value=fixes.moved(by))


RATE = 100.0
"""Hz."""


DEMO = sensor_models(
    {
        "gyro": {"N": "12 deg/h/sqrt(Hz)", "GM": [["25 deg/h", 20.0]]},
        "accel": {"N": "80 ug/sqrt(Hz)", "K": "120 ug/sqrt(h)"},
    },
    "demo",
)
"""Of the order of a good MEMS IMU: an hour determines every parameter."""


def simulated_imu(
    seconds: float, seed: int, sensors: SensorModels = DEMO
) -> tuple[Recording, dict[str, Model]]:
    """A six-axis static recording and the model of each of its channels.

    seconds: Length.
    Returns: dict, channel name -> Model that made it.
    """
    rng, n, truth = np.random.default_rng(seed), int(seconds * RATE), sensors.models
    columns = {name: model.simulate(n, 1.0 / RATE, rng) for name, model in truth.items()}
    source = f"simulated IMU, seed {seed}"
    return Recording.from_arrays(columns, RATE, SI_UNIT, source=source), truth


@dataclass(frozen=True)
class Comparison:
    """A true value beside its estimate, in the units of the field.

    lower, upper: Of the 95 % interval.
    """

    channel: str
    what: str
    truth: float
    estimate: float
    lower: float
    upper: float
    unit: str

    @property
    def determined(self) -> bool:
        """Whether the record determines it."""
        return bool(np.isfinite(self.upper))

    @property
    def covered(self) -> bool:
        """Whether the interval holds the truth."""
        return self.lower <= self.truth <= self.upper


def compare(fitted: Fit, truth: Model) -> list[Comparison]:
    """True parameters beside those estimated for a model of the same form."""
    intervals = fitted.interval()
    rows = []
    for item in truth.parameters:
        key = item.key
        unit, scale = customary_unit(item.parameter.unit, fitted.wv.quantity, fitted.wv.unit)
        values = (item.value or 0.0, fitted.params[key], *intervals.get(key, (0.0, np.inf)))
        true, estimate, low, high = (scale * each for each in values)
        rows.append(Comparison(fitted.wv.name, key, true, estimate, low, high, unit))
    return rows


FILES_RATE, DRIVE = 25.0, 600.0
"""Hz; s. Small files, and a drive long enough to compare sensor models on."""

_GRAVITY = 9.80665


def write_demo_files(folder: Path, seconds: float, seed: int) -> tuple[float, float, float]:
    """Write ``static.csv``, ``imu.csv`` and ``fixes.csv``.

    seconds: Length of the recording at rest.
    Returns: from the IMU to the antenna: forward, right, down; m.
    """
    rng = np.random.default_rng(seed)
    still = sensors().simulate(round(seconds * FILES_RATE), 1.0 / FILES_RATE, rng).total
    _write(folder / "static.csv", still + np.array([0, 0, 0, 0, 0, -_GRAVITY]))
    log, _ = emulated_log(seed, duration=DRIVE, rate=FILES_RATE)
    _write(folder / "imu.csv", np.hstack([log.imu.rotation, log.imu.velocity]) * FILES_RATE)
    position, velocity = log.aiding.fixes
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
