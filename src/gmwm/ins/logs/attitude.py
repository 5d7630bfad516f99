"""Where a vehicle is steady or at rest, and its attitude there: from GNSS, IMU and gravity."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.distributions import chi2
from gmwm._core.spool import release
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.filter import Aiding, Fixes
from gmwm.ins.geometry import (
    RATE,
    STANDARD_GRAVITY,
    gravity,
    matrix_from_rpy,
    ned_difference,
    rpy_from_matrix,
    turn_body,
)
from gmwm.ins.imu import Imu
from gmwm.ins.logs import tuning

_WINDOWS = 1024  # looked at together: a few MB


def positions_of(aiding: Aiding) -> Fixes:
    """Position fixes; raises InputError if there are none."""
    found = aiding.of("position")
    if found is None:
        raise InputError("there is no position fix: give at least one, where the filter starts")
    return found


def velocities_between(position: Fixes) -> Fixes:
    """Mean velocity from each position to the next one near in time, at the time between."""
    step = np.diff(position.time)[:, None]
    way = ned_difference(position.value[1:], position.value[:-1])
    sd = np.hypot(position.sd[1:], position.sd[:-1])
    between = 0.5 * (position.time[1:] + position.time[:-1])
    near = step[:, 0] <= tuning.CHORD
    return Fixes("velocity", between[near], (way / step)[near], (sd / step)[near])


def steady(imu: Imu) -> tuple[int, int] | None:
    """First and last sample of the first steady stretch, at rest or in motion; ``None`` without."""
    size = max(round(tuning.STEADY_WINDOW / imu.dt), 1)
    count = min(imu.n, round(tuning.SEARCHED / imu.dt)) // size
    increments = np.hstack([each[: count * size] for each in (imu.rotation, imu.velocity)])
    windows = increments.reshape(count, size, 6) / imu.dt
    means = windows.mean(axis=1)
    least, most = (
        round(length / tuning.STEADY_WINDOW) for length in (tuning.STEADY_LEAST, tuning.STEADY_MOST)
    )
    steps, noise_of_means = np.diff(windows, axis=1), np.zeros(6)
    if steps.size:
        # The noise of the quietest window is divided by what the smallest of so many variances is
        # of the usual one. Mean squares of differences have two thirds of the degrees of freedom.
        dof = 2.0 / 3.0 * (size - 1)
        smallest = chi2.ppf(1.0 - 0.5 ** (1.0 / count), dof) / dof
        noise = np.sqrt(np.min(np.mean(steps**2, axis=1), axis=0) / (2.0 * smallest))
        noise_of_means = noise / np.sqrt(size)
    limit = np.maximum(np.repeat(tuning.STEADY, 3), tuning.SIGMAS * noise_of_means)
    begin = 0
    while begin + least <= count:
        end = begin + 1
        while end < count and end - begin < most:
            # The mean of those before is uncertain itself.
            far = limit * np.sqrt(1.0 + 1.0 / (end - begin))
            if np.any(np.abs(means[end] - np.mean(means[begin:end], axis=0)) > far):
                break
            end += 1
        if end - begin >= least:
            return begin * size, end * size
        begin = end
    return None


def velocity_at_rest(aiding: Aiding, dt: float, first: int, last: int) -> float | None:
    """Standard deviation of the velocity of a vehicle at rest in a stretch; ``None`` if it moves.

    Fixes show it: velocities near zero, or positions at one place.
    """

    def inside(fixes: Fixes) -> Fixes:
        return fixes.part((fixes.time >= (first - 0.5) * dt) & (fixes.time <= (last + 0.5) * dt))

    velocity = aiding.of("velocity")
    part = None if velocity is None else inside(velocity)
    if part is not None and part.time.size:
        mean, sd = np.mean(part.value, axis=0), np.mean(part.sd, axis=0) / np.sqrt(part.time.size)
    else:
        part = inside(positions_of(aiding))
        if part.time.size < 2:
            return None
        between = part.time[-1] - part.time[0]
        mean = ned_difference(part.value[-1], part.value[0]) / between
        sd = np.hypot(part.sd[0], part.sd[-1]) / between
    if np.any(np.abs(mean) > tuning.SIGMAS * sd):
        return None
    return max(float(np.max(sd)), tuning.STILL_VELOCITY_SD)


def standstills(imu: Imu, aiding: Aiding, sd: float) -> Fixes | None:
    """Standstills where the IMU is as quiet as at the start, with a velocity of ``sd`` (m/s).

    Motion as quiet as that counts as rest too; the filter rejects what contradicts it. ``None`` if
    the vehicle is not at rest at the start.
    """
    stretch = steady(imu)
    if stretch is None or velocity_at_rest(aiding, imu.dt, *stretch) is None:
        return None
    quieter, length = tuning.ZERO_VELOCITY
    size = max(round(length / imu.dt), 2)
    count = imu.n // size
    mean, scatter = np.empty((count, 6)), np.empty((count, 6))
    for begin in range(0, count, _WINDOWS):
        part = slice(begin, min(begin + _WINDOWS, count))
        rows = slice(part.start * size, part.stop * size)
        samples = np.hstack([imu.rotation[rows], imu.velocity[rows]]) / imu.dt
        seconds = samples.reshape(-1, size, 6)
        mean[part], scatter[part] = seconds.mean(axis=1), seconds.std(axis=1)
        release(imu.rotation)
        release(imu.velocity)
    first, last = (-(-stretch[0] // size), stretch[1] // size)
    rest = slice(first, max(last, first + 1))
    level, usual = mean[rest].mean(axis=0), np.sqrt(np.mean(scatter[rest] ** 2, axis=0))
    slow = np.abs(mean[:, :3] - level[:3]) <= tuning.STEADY[0]
    still = np.all(scatter <= quieter * usual, axis=1) & np.all(slow, axis=1)
    time = np.asarray((np.flatnonzero(still) + 1) * size * imu.dt, dtype=float)
    zeros = np.zeros((time.size, 3))
    return Fixes("standstill", time, zeros, zeros + sd)


# -- heading --------------------------------------------------------------------------------------


class Heading(NamedTuple):
    """A heading at the first epoch of the filter, rad, and how it was found in words."""

    yaw: float
    sd: float
    source: str


class _Course(NamedTuple):
    """A course of GNSS from one time to another (rad, s)."""

    angle: float
    sd: float
    begin: float
    end: float


def turned(imu: Imu, bias: FloatArray, C: FloatArray, levelled: int, epoch: int) -> FloatArray:
    """Attitude at an epoch, from the attitude at the epoch of levelling, by the gyros."""
    begin, end = sorted((epoch, levelled))
    turn = np.eye(3)
    _carry(turn, imu.rotation[begin:end] - bias * imu.dt, np.empty((0, 3, 3)))
    return np.ascontiguousarray(C, dtype=float) @ (turn.T if epoch < levelled else turn)


@compiled()
def _carry(C: FloatArray, rotation: FloatArray, kept: FloatArray) -> None:
    """Turn a body by increments; ``kept`` gets the matrix after each if it has room."""
    for i in range(rotation.shape[0]):
        turn_body(C, rotation[i, 0], rotation[i, 1], rotation[i, 2])
        if i < kept.shape[0]:
            kept[i] = C


def heading_from_course(
    imu: Imu, aiding: Aiding, bias: FloatArray, C: FloatArray, epoch: int, drift: float
) -> Heading | None:
    """Heading at an epoch from the first course of GNSS, turned back by the gyros.

    C: Attitude without its heading; ``drift`` is the standard deviation of the gyros, rad/s.
    """
    found = _course(aiding, epoch * imu.dt)
    if found is None:
        return None
    last = min(round(found.end / imu.dt), imu.n)
    since = np.zeros(1)
    if last > epoch:
        kept = np.empty((last - epoch, 3, 3))
        _carry(C.copy(), imu.rotation[epoch:last] - bias * imu.dt, kept)
        part = kept[max(round(found.begin / imu.dt) - epoch - 1, 0) :]
        since = rpy_from_matrix(part)[:, 2] - rpy_from_matrix(C)[2]
    mean_turn = float(np.angle(np.mean(np.exp(1j * since))))
    back = 0.5 * (found.begin + found.end) - epoch * imu.dt
    sd = float(np.sqrt(found.sd**2 + tuning.CRAB_SD**2 + (drift * back) ** 2))
    source = f"heading from GNSS, {found.begin:.6g} s after the start"
    return Heading(found.angle - mean_turn, sd, source)


def _course(aiding: Aiding, start: float) -> _Course | None:
    """Course of the first fast velocity, or between positions near in time and far apart."""
    velocity = aiding.of("velocity")
    if velocity is not None:
        speed = np.hypot(velocity.value[:, 0], velocity.value[:, 1])
        sd = np.sqrt(np.mean(velocity.sd[:, :2] ** 2, axis=1))
        fast = (speed > tuning.COURSE_RATIO * sd) & (velocity.time >= start)
        fast &= velocity.time <= start + tuning.SEARCHED
        if np.any(fast):
            k = int(np.argmax(fast))
            at = float(velocity.time[k])
            angle = float(np.arctan2(velocity.value[k, 1], velocity.value[k, 0]))
            return _Course(angle, float(sd[k] / speed[k]), at, at)
    return _course_of_positions(positions_of(aiding), start)


def _course_of_positions(positions: Fixes, start: float) -> _Course | None:
    """Course between two fixes; those between them and the next one lie on the line.

    Else one of the two is an outlier; if no others are far apart, the first two are taken.
    """
    time, sd = positions.time, np.sqrt(np.mean(positions.sd[:, :2] ** 2, axis=1))
    first = None
    for i in np.flatnonzero((time >= start - 1e-6) & (time <= start + tuning.SEARCHED)):
        for j in range(i + 1, int(np.searchsorted(time, time[i] + tuning.CHORD, side="right"))):
            way = ned_difference(positions.value[i : j + 2], positions.value[i])[:, :2]
            (north, east), error = way[j - i], np.hypot(sd[i], sd[j])
            length = float(np.hypot(north, east))
            if length <= tuning.COURSE_RATIO * error:
                continue
            angle = float(np.arctan2(east, north))
            found = _Course(angle, float(error / length), float(time[i]), float(time[j]))
            share = (time[i : j + 2] - time[i]) / (time[j] - time[i])
            aside = np.hypot(*(way - share[:, None] * way[j - i]).T)
            if j + 1 < time.size and np.max(aside) < tuning.CHORD_ASIDE * length:
                return found
            first = first or found
    return first


def gyrocompass(
    mean_rate: FloatArray, level: FloatArray, lat: float, gyro_sd: float
) -> Heading | None:
    """Heading from the Earth's rotation, if the gyros show it. Groves (2013), eq. 5.105."""
    north, east, _ = matrix_from_rpy(level) @ mean_rate
    sd = float(gyro_sd / (RATE * np.cos(lat)))
    if sd > tuning.COMPASS_SD:
        return None
    return Heading(float(np.arctan2(-east, north)), sd, "heading from the Earth's rotation")


# -- in motion ------------------------------------------------------------------------------------


def attitude_in_motion(
    imu: Imu, aiding: Aiding, epoch: int, place: FloatArray, constant_sd: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """Attitude at an epoch, C_bn, and its standard deviations about north, east and down.

    The specific force, turned into the body's axes of the start by the gyros, and the change of the
    velocity less the one by gravity are one vector in two frames, interval by interval. The
    rotation between them that fits best is Wahba's problem, solved by singular values (Markley
    1988, *J. Astronaut. Sci.* 36, 245-258; Wu & Pan 2013, *IEEE Trans. Aerosp. Electron. Syst.* 49,
    1006-1025).

    place: (3,), latitude, longitude, height.
    constant_sd: Standard deviations of constant errors of gyros and accelerometers, rad/s, m/s^2.
    Raises InputError if no stretch of up to `gmwm.ins.logs.tuning.MOTION_MOST` s shows the heading.
    """
    start = epoch * imu.dt
    velocity = aiding.of("velocity") or velocities_between(positions_of(aiding))
    after = velocity.part(velocity.time >= start)
    best: tuple[FloatArray, FloatArray] | None = None
    for length in np.arange(tuning.MOTION_LEAST, tuning.MOTION_MOST + 1.0, tuning.MOTION_LEAST):
        part = after.part(after.time <= start + length)
        last = round((start + length) / imu.dt)
        if last > imu.n or part.time.size < 3:
            break
        body = _velocity_in_body_axes(imu, epoch, last, part.time, np.asarray(aiding.lever_arm))
        found = _rotation(part, body, place, constant_sd)
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


def _velocity_in_body_axes(
    imu: Imu, epoch: int, last: int, times: FloatArray, lever: FloatArray
) -> FloatArray:
    """Velocity of the antenna that the IMU measures since an epoch, in the body's axes there."""
    turns = np.tile(np.eye(3), (last - epoch + 1, 1, 1))
    _carry(np.eye(3), imu.rotation[epoch:last], turns[1:])
    # Half of a sample's turn has happened when its force is resolved.
    middle = 0.5 * (turns[1:] + turns[:-1])
    force = np.einsum("kij,kj->ki", middle, imu.velocity[epoch:last])
    summed = np.vstack([np.zeros(3), np.cumsum(force, axis=0)])
    rates = imu.rotation[np.clip(np.arange(epoch, last + 1), 0, imu.n - 1)] / imu.dt
    # The antenna swings about the IMU.
    antenna = summed + np.einsum("kij,kj->ki", turns, np.cross(rates, lever))
    samples, at = (times - epoch * imu.dt) / imu.dt, np.arange(len(summed))
    return np.stack([np.interp(samples, at, each) for each in antenna.T], axis=1)


def _rotation(
    velocity: Fixes, body: FloatArray, place: FloatArray, constant_sd: tuple[float, float]
) -> tuple[FloatArray, FloatArray]:
    """The rotation from velocities in body axes to those of the fixes, and its deviations."""
    time = velocity.time - velocity.time[0]
    level = velocity.value - np.outer(time, [0.0, 0.0, float(gravity(place[0], place[2]))])
    a, b = level - level.mean(axis=0), body - body.mean(axis=0)
    left, _, right = np.linalg.svd(a.T @ b)
    C = left @ np.diag([1.0, 1.0, np.linalg.det(left) * np.linalg.det(right)]) @ right
    # Scatter about the fit: noise of the fixes, and the bend by the gyros' drift.
    rest = a - b @ C.T
    noise = max(float(np.mean(velocity.sd**2)), float(np.sum(rest**2)) / (3.0 * len(a) - 6.0))
    information = (np.sum(a**2) * np.eye(3) - a.T @ a) / noise
    gyro_sd, accel_sd = constant_sd
    drift = gyro_sd * 0.5 * float(time[-1])
    variances = np.diag(np.linalg.inv(information)) + drift**2
    # A constant error of the accelerometers tilts, and turns by its share of the acceleration.
    turning = np.sqrt(np.mean(np.gradient(velocity.value, time, axis=0)[:, :2] ** 2))
    ratio = accel_sd / np.array([STANDARD_GRAVITY, STANDARD_GRAVITY, max(turning, 1e-3)])
    return C, np.sqrt(variances + ratio**2)
