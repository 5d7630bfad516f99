"""Where a vehicle is steady, and whether it is at rest there."""

from __future__ import annotations

import numpy as np

from gmwm._core.distributions import chi2
from gmwm._core.spool import release
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.filter import Aiding, Fixes
from gmwm.ins.geometry import ned_difference
from gmwm.ins.imu import Imu
from gmwm.ins.logs import tuning

_WINDOWS = 1024  # looked at together: a few MB


def positions_of(aiding: Aiding) -> Fixes:
    """Position fixes.

    Raises InputError if there are none.
    """
    found = aiding.of("position")
    if found is None:
        raise InputError("there is no position fix: a filter starts at one")
    return found


def steady(imu: Imu) -> tuple[int, int] | None:
    """First and last sample of the first stretch whose window means stay near the first one.

    It is at rest or in steady motion; ``None`` if there is none.
    """
    size = max(round(tuning.STEADY_WINDOW / imu.dt), 1)
    count = min(imu.n, round(tuning.SEARCHED / imu.dt)) // size
    increments = np.hstack([each[: count * size] for each in (imu.rotation, imu.velocity)])
    windows = increments.reshape(count, size, 6) / imu.dt
    means = windows.mean(axis=1)
    least, most = (
        round(length / tuning.STEADY_WINDOW) for length in (tuning.STEADY_LEAST, tuning.STEADY_MOST)
    )
    limit = np.maximum(np.repeat(tuning.STEADY, 3), tuning.SIGMAS * _noise_of_means(windows))
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


def _noise_of_means(windows: FloatArray) -> FloatArray:
    """Standard deviation of the mean of a window from the noise within it, by axis.

    The noise of the quietest window is divided by what the smallest of so many variances is of the
    usual one. Mean squares of successive differences have two thirds of the degrees of freedom.
    """
    count, size, _ = windows.shape
    steps = np.diff(windows, axis=1)
    if not steps.size:
        return np.zeros(6)
    dof = 2.0 / 3.0 * (size - 1)
    smallest = chi2.ppf(1.0 - 0.5 ** (1.0 / count), dof) / dof
    noise = np.sqrt(np.min(np.mean(steps**2, axis=1), axis=0) / (2.0 * smallest))
    return np.asarray(noise / np.sqrt(size), dtype=float)


def velocity_at_rest(aiding: Aiding, dt: float, first: int, last: int) -> float | None:
    """Standard deviation of the velocity of a vehicle at rest in a stretch; ``None`` if it moves.

    Fixes show it: velocities near zero, or positions at one place.
    """
    begin, end = (first - 0.5) * dt, (last + 0.5) * dt
    velocity = aiding.of("velocity")
    if velocity is not None:
        inside = (velocity.time >= begin) & (velocity.time <= end)
        if np.any(inside):
            mean, sd = np.mean(velocity.value[inside], axis=0), np.mean(velocity.sd[inside], axis=0)
            sd = sd / np.sqrt(np.count_nonzero(inside))
            if np.any(np.abs(mean) >= tuning.SIGMAS * sd):
                return None
            return max(float(np.max(sd)), tuning.STILL_VELOCITY_SD)
    position = positions_of(aiding)
    part = position.part((position.time >= begin) & (position.time <= end))
    if part.time.size < 2:
        return None
    sd = np.hypot(part.sd[0], part.sd[-1])
    if np.any(np.abs(ned_difference(part.value[-1], part.value[0])) > tuning.SIGMAS * sd):
        return None
    speed_sd = float(np.max(sd)) / float(part.time[-1] - part.time[0])
    return max(speed_sd, tuning.STILL_VELOCITY_SD)


def standstills(imu: Imu, aiding: Aiding, sd: float) -> Fixes | None:
    """Standstills wherever the IMU is as quiet as where the vehicle stood at first.

    Motion as quiet as that counts as rest too; the filter rejects what contradicts it.

    Parameters
    ----------
    imu : Imu
    aiding : Aiding
    sd : float
        Standard deviation of the velocity of a vehicle at rest, m/s.

    Returns
    -------
    Fixes or None
        ``None`` if it is not at rest at the start.
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
