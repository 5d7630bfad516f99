"""Logs of drives and flights with a known truth, right or with a fault, as users have them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np

import gmwm
from gmwm.ins import Fixes, Imu, Measured, SensorModels, Trajectory, gnss, helicopter_mapping
from gmwm.study.demo import LEVER_ARM, sensors

VEHICLES: dict[str, Callable[..., Trajectory]] = {
    "car": gmwm.ins.car_drive,
    "helicopter": helicopter_mapping,
    "loiter": gmwm.ins.fixed_wing_loiter,
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
    "slow clock": "the IMU's clock 2.7 % slow",
    "gyro scale": "3 % too much of all gyros",
    "accel scale": "3 % too much of all accelerometers",
}

_OFF_GRID = 4  # parts of a sampling interval


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
    """
    assert FAULTS.keys() >= set(faults)
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
    clock = 1.027 if "slow clock" in faults else 1.0

    def stamped(fixes: Fixes) -> Fixes:
        time = fixes.time
        later = by + (1.0 + drift) * time + step * (time > 0.5 * duration)
        return replace(fixes, time=later).part(later <= duration / clock)

    position, *others = map(stamped, aiding.fixes)
    aiding = replace(aiding, fixes=(_with_outliers(position, faults, rng), *others))
    if "lever arm" in faults:
        aiding = replace(aiding, lever_arm=(0.0, 0.0, 0.0))
    if "mounting" in faults:
        turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        imu = Imu(imu.dt, imu.rotation @ turn.T, imu.velocity @ turn.T)
    gyro, accel = (1.03 if f"{kind} scale" in faults else 1.0 for kind in ("gyro", "accel"))
    imu = Imu(imu.dt / clock, imu.rotation * gyro / clock, imu.velocity * accel / clock)
    models = believed or truth or sensors()
    return Measured(imu, aiding, models, title=f"{vehicle}, seed {seed}"), fine


@lru_cache(maxsize=4)
def _world(vehicle: str, duration: float, rate: float) -> tuple[Trajectory, Imu]:
    truth = VEHICLES[vehicle](duration=duration, dt=1.0 / rate)
    return truth, gmwm.ins.emulate(truth)


def _with_outliers(fixes: Fixes, faults: tuple[str, ...], rng: np.random.Generator) -> Fixes:
    by = np.zeros((fixes.time.size, 3))
    if "one far" in faults:
        by[fixes.time.size // 2, 0] = 500.0
    if "outliers" in faults:
        far = rng.random(fixes.time.size) < 0.03
        angle = rng.uniform(0.0, 2.0 * np.pi, fixes.time.size)
        by[far, 0], by[far, 1] = 50.0 * np.cos(angle[far]), 50.0 * np.sin(angle[far])
    return replace(fixes, value=fixes.moved(by))
