"""Where a vehicle is steady, and whether it stands there."""

from __future__ import annotations

import numpy as np

from gmwm._core.distributions import chi2
from gmwm._core.spool import release
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter import Aiding, Fixes
from gmwm.ins.geometry import ned_difference
from gmwm.ins.imu import Imu

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
    """First stretch in which means over a window stay near the first one: rest, or steady motion.

    ``None`` if there is none.
    """
    window = max(round(tuning.STEADY_WINDOW / imu.dt), 1)
    count = min(imu.n, round(tuning.SEARCHED / imu.dt)) // window
    increments = np.hstack([each[: count * window] for each in (imu.rotation, imu.velocity)])
    means = increments.reshape(count, window, 6).mean(axis=1) / imu.dt
    least, most = (
        round(tuning.STEADY_LEAST / tuning.STEADY_WINDOW),
        round(tuning.STEADY_MOST / tuning.STEADY_WINDOW),
    )
    scatter = _scatter(increments.reshape(count, window, 6), imu.dt)
    limit = np.maximum(np.repeat(tuning.STEADY, 3), tuning.SIGMAS * scatter)
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
            return begin * window, end * window
        begin = end
    return None


def _scatter(windows: FloatArray, dt: float) -> FloatArray:
    """Standard deviation of the mean over a window from noise within it.

    From the quietest window, with what the smallest of so many variances is of the usual one: mean
    squares of successive differences have two thirds of the degrees of freedom.
    """
    count, size, _ = windows.shape
    steps = np.diff(windows, axis=1) / dt
    if not steps.size:
        return np.zeros(6)
    dof = 2.0 / 3.0 * (size - 1)
    smallest = chi2.ppf(1.0 - 0.5 ** (1.0 / count), dof) / dof
    noise = np.sqrt(np.min(np.mean(steps**2, axis=1), axis=0) / (2.0 * smallest))
    return np.asarray(noise / np.sqrt(size), dtype=float)


def at_rest(
    aiding: Aiding, dt: float, first: int, last: int
) -> tuple[bool, FloatArray | None, float]:
    """Whether the vehicle is at rest in a stretch, and if so its velocity and how well known."""
    begin, end = (first - 0.5) * dt, (last + 0.5) * dt
    velocity = aiding.of("velocity")
    if velocity is not None:
        inside = (velocity.time >= begin) & (velocity.time <= end)
        if np.any(inside):
            mean, sd = np.mean(velocity.value[inside], axis=0), np.mean(velocity.sd[inside], axis=0)
            sd = sd / np.sqrt(np.count_nonzero(inside))
            if np.all(np.abs(mean) < tuning.SIGMAS * sd):
                return True, np.zeros(3), max(float(np.max(sd)), tuning.STILL_VELOCITY_SD)
            return False, None, 0.0
    position = positions_of(aiding)
    inside = (position.time >= begin) & (position.time <= end)
    if np.count_nonzero(inside) < 2:
        return False, None, 0.0
    part = position.part(inside)
    sd = np.hypot(part.sd[0], part.sd[-1])
    if np.any(np.abs(ned_difference(part.value[-1], part.value[0])) > tuning.SIGMAS * sd):
        return False, None, 0.0
    speed_sd = float(np.max(sd)) / float(part.time[-1] - part.time[0])
    return True, np.zeros(3), max(speed_sd, tuning.STILL_VELOCITY_SD)


def standstills(imu: Imu, aiding: Aiding, sd: float) -> Fixes | None:
    """Standstills wherever the IMU is as quiet as where the vehicle stood at first.

    ``None`` if it stands nowhere at the start. Motion as quiet as that is taken for rest too; the
    filter rejects what contradicts it.

    Parameters
    ----------
    imu : Imu
    aiding : Aiding
    sd : float
        Of the velocity of a vehicle at rest, m/s.
    """
    stretch = steady(imu)
    if stretch is None or not at_rest(aiding, imu.dt, *stretch)[0]:
        return None
    quieter, length = tuning.ZERO_VELOCITY
    window = max(round(length / imu.dt), 2)
    count = imu.n // window
    mean, scatter = np.empty((count, 6)), np.empty((count, 6))
    for begin in range(0, count, _WINDOWS):
        part = slice(begin, min(begin + _WINDOWS, count))
        rows = slice(part.start * window, part.stop * window)
        samples = np.hstack([imu.rotation[rows], imu.velocity[rows]]) / imu.dt
        seconds = samples.reshape(-1, window, 6)
        mean[part], scatter[part] = seconds.mean(axis=1), seconds.std(axis=1)
        release(imu.rotation)
        release(imu.velocity)
    first, last = (-(-stretch[0] // window), stretch[1] // window)
    rest = slice(first, max(last, first + 1))
    level, usual = mean[rest].mean(axis=0), np.sqrt(np.mean(scatter[rest] ** 2, axis=0))
    slow = np.abs(mean[:, :3] - level[:3]) <= tuning.STEADY[0]
    still = np.all(scatter <= quieter * usual, axis=1) & np.all(slow, axis=1)
    time = np.asarray((np.flatnonzero(still) + 1) * window * imu.dt, dtype=float)
    zeros = np.zeros((time.size, 3))
    return Fixes("standstill", time, zeros, zeros + sd)
