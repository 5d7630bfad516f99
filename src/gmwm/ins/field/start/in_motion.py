"""Attitude of a vehicle that never stands still, from how its velocity changes.

The specific force, turned into the body's axes of the start by the gyros, and the change of the
velocity less that by gravity are one vector in two frames, interval by interval. The rotation
between them that fits best is Wahba's problem, solved by singular values (Markley 1988, *J.
Astronaut. Sci.* 36, 245-258; Wu & Pan 2013, *IEEE Trans. Aerosp. Electron. Syst.* 49, 1006-1025).
"""

from __future__ import annotations

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter import Fixes
from gmwm.ins.geometry import STANDARD_GRAVITY, gravity, matrix_from_rotation_vector, ned_difference
from gmwm.ins.imu import Imu


def velocities(position: Fixes, velocity: Fixes | None) -> Fixes:
    """Velocity fixes, or differences of positions at the times between them."""
    if velocity is not None:
        return velocity
    step = np.diff(position.time)
    near = step <= tuning.CHORD
    way = np.stack([
        ned_difference(late, early)
        for late, early in zip(position.value[1:], position.value[:-1], strict=True)
    ])[near] if np.any(near) else np.zeros((0, 3))  # fmt: skip
    sd = np.hypot(position.sd[1:], position.sd[:-1])[near]
    between = 0.5 * (position.time[1:] + position.time[:-1])[near]
    return Fixes("velocity", between, way / step[near, None], sd / step[near, None])


def attitude_in_motion(
    imu: Imu, epoch: int, velocity: Fixes, place: FloatArray, lever: FloatArray,
    gyro_sd: float, accel_sd: float,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Attitude at an epoch, C_bn, and its standard deviations about north, east and down.

    velocity: Of the antenna.
    place: (3,), latitude, longitude, height.
    lever: (3,), from the IMU to the antenna, m.
    gyro_sd, accel_sd: Of constant errors of the sensors, rad/s and m/s^2.
    Raises InputError if no stretch of up to `gmwm.ins.tuning.MOTION_MOST` s shows the heading.
    """
    start = epoch * imu.dt
    best: tuple[FloatArray, FloatArray] | None = None
    for length in np.arange(tuning.MOTION_LEAST, tuning.MOTION_MOST + 1.0, tuning.MOTION_LEAST):
        inside = (velocity.time >= start) & (velocity.time <= start + length)
        last = round((start + length) / imu.dt)
        if last > imu.n or np.count_nonzero(inside) < 3:
            break
        found = _fitted(imu, epoch, last, velocity.part(inside), place, lever, gyro_sd, accel_sd)
        if best is None or found[1][2] < best[1][2]:
            best = found
    if best is None or best[1][2] > tuning.MOTION_SD:
        raise InputError(
            "the attitude cannot be known: the IMU is steady nowhere in the first "
            f"{tuning.SEARCHED:g} s, and GNSS shows too little acceleration to find it from: give "
            "the attitude, or begin the record where the vehicle stands still",
            "attitude-unknown",
        )
    return best


def _fitted(
    imu: Imu, epoch: int, last: int, velocity: Fixes, place: FloatArray, lever: FloatArray,
    gyro_sd: float, accel_sd: float,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    turns = np.empty((last - epoch + 1, 3, 3))
    turns[0] = np.eye(3)
    for i, turn in enumerate(matrix_from_rotation_vector(imu.rotation[epoch:last])):
        turns[i + 1] = turns[i] @ turn
    # Half of a sample's turn has happened when its force is resolved.
    middle = 0.5 * (turns[1:] + turns[:-1])
    force = np.einsum("kij,kj->ki", middle, imu.velocity[epoch:last])
    summed = np.vstack([np.zeros(3), np.cumsum(force, axis=0)])
    rates = imu.rotation[np.clip(np.arange(epoch, last + 1), 0, imu.n - 1)] / imu.dt
    arm = np.einsum("kij,kj->ki", turns, np.cross(rates, lever))
    samples = (velocity.time - epoch * imu.dt) / imu.dt
    at = np.arange(len(summed))
    # The antenna swings about the IMU: its velocity, in the body's axes of the start.
    body = np.stack(
        [
            np.interp(samples, at, summed[:, j]) + np.interp(samples, at, arm[:, j])
            for j in range(3)
        ],
        axis=1,
    )
    time = velocity.time - velocity.time[0]
    level = velocity.value - np.outer(time, [0.0, 0.0, float(gravity(place[0], place[2]))])
    a, b = level - level.mean(axis=0), body - body.mean(axis=0)
    left, _, right = np.linalg.svd(a.T @ b)
    C = left @ np.diag([1.0, 1.0, np.linalg.det(left) * np.linalg.det(right)]) @ right
    # Scatter about the fit: noise of the fixes and what the gyros' drift bends.
    rest = a - b @ C.T
    noise = max(float(np.mean(velocity.sd**2)), float(np.sum(rest**2)) / (3.0 * len(a) - 6.0))
    information = (np.sum(a**2) * np.eye(3) - a.T @ a) / noise
    drift = gyro_sd * 0.5 * float(time[-1])
    variances = np.diag(np.linalg.inv(information)) + drift**2
    # A constant error of the accelerometers tilts, and turns by its share of the acceleration.
    turning = np.sqrt(np.mean(np.gradient(velocity.value, time, axis=0)[:, :2] ** 2))
    ratio = accel_sd / np.array([STANDARD_GRAVITY, STANDARD_GRAVITY, max(turning, 1e-3)])
    return C, np.sqrt(variances + ratio**2)
