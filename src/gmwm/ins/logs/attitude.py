"""Where a vehicle is steady or at rest, and its attitude there: from GNSS, IMU and gravity."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.distributions import chi2
from gmwm._core.spool import release
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter.aiding import Aiding, Fixes
from gmwm.ins.filter.records import set_matrix
from gmwm.ins.geometry import (
    RATE,
    STANDARD_GRAVITY,
    matrix_from_rpy,
    ned_difference,
    rpy_from_matrix,
    turn_body,
)
from gmwm.ins.increments import Imu

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


def steady(imu: Imu) -> Iterator[tuple[int, int]]:
    """First and last sample of each steady stretch, at rest or in motion."""
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
            yield begin * size, end * size
        begin = end


def velocity_at_rest(aiding: Aiding, dt: float, first: int, last: int) -> float | None:
    """Standard deviation of the velocity of a vehicle at rest in a stretch; ``None`` if it moves.

    Fixes show it: velocities near zero, or positions at one place. ``None`` too where they would
    not show a vehicle that speeds up from rest, whose accelerometers are as steady.
    """
    velocity = aiding.of("velocity")
    part = None if velocity is None else _inside(velocity, dt, first, last)
    if part is not None and part.time.size:
        mean, sd = np.mean(part.value, axis=0), np.mean(part.sd, axis=0) / np.sqrt(part.time.size)
    else:
        part = _inside(positions_of(aiding), dt, first, last)
        if part.time.size < 2:
            return None
        between = part.time[-1] - part.time[0]
        mean = ned_difference(part.value[-1], part.value[0]) / between
        sd = np.hypot(part.sd[0], part.sd[-1]) / between
    unseen = tuning.SIGMAS * sd
    fastest = tuning.TILT_MOST * STANDARD_GRAVITY * (np.mean(part.time[[0, -1]]) - first * dt)
    if np.any(np.abs(mean) > unseen) or np.max(unseen[:2]) > fastest:
        return None
    return max(float(np.max(sd)), tuning.STILL_VELOCITY_SD)


def acceleration(aiding: Aiding, dt: float, first: int, last: int) -> float:
    """Size of the acceleration in a stretch as GNSS shows it, and its standard deviation, m/s^2.

    By the line of least squares through the velocities; infinite where there are none at two times.
    """
    velocity = aiding.of("velocity") or velocities_between(positions_of(aiding))
    part = _inside(velocity, dt, first, last)
    if not part.time.size or part.time[0] == part.time[-1]:
        return np.inf
    time = part.time - np.mean(part.time)
    squares = np.sum(time**2)
    slope = time @ part.value / squares
    return float(np.linalg.norm(slope) + np.max(part.sd) / np.sqrt(squares))


def _inside(fixes: Fixes, dt: float, first: int, last: int) -> Fixes:
    return fixes.part((fixes.time >= (first - 0.5) * dt) & (fixes.time <= (last + 0.5) * dt))


def standstills(imu: Imu, aiding: Aiding, sd: float) -> Fixes | None:
    """Standstills where the IMU is as quiet as at the start, with a velocity of ``sd`` (m/s).

    Motion as quiet as that counts as rest too; the filter rejects what contradicts it. ``None`` if
    the vehicle is not at rest at the start.
    """
    stretch = next(steady(imu), None)
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
            set_matrix(kept[i], C)


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
    """Course between two fixes; those between them and the next one lie on the line."""
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
