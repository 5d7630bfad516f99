"""The heading that a filter starts with: from GNSS, or from the Earth's rotation."""

from __future__ import annotations

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.ins import tuning
from gmwm.ins.field.start.standing import positions_of
from gmwm.ins.filter import Aiding
from gmwm.ins.geometry import RATE, matrix_from_rpy, ned_difference, rpy_from_matrix, turn_body
from gmwm.ins.imu import Imu


def turned(imu: Imu, bias: FloatArray, C: FloatArray, levelled: int, epoch: int) -> FloatArray:
    """Attitude at an epoch, from that where the body was levelled, by the gyros."""
    result = np.ascontiguousarray(C, dtype=float)
    backwards = epoch < levelled
    begin, end = (epoch, levelled) if backwards else (levelled, epoch)
    turn = np.eye(3)
    _carry(turn, imu.rotation[begin:end] - bias * imu.dt, np.empty((0, 3, 3)))
    return result @ (turn.T if backwards else turn)


@compiled()
def _carry(C: FloatArray, rotation: FloatArray, kept: FloatArray) -> None:
    """Turn a body by increments; ``kept`` gets the matrix after each if it has room."""
    for i in range(rotation.shape[0]):
        turn_body(C, rotation[i, 0], rotation[i, 1], rotation[i, 2])
        if i < kept.shape[0]:
            kept[i] = C


def course(
    imu: Imu, aiding: Aiding, bias: FloatArray, C: FloatArray, epoch: int, drift: float
) -> tuple[float, float, str, float] | None:
    """Heading at an epoch from the first course that GNSS shows, turned back by the gyros.

    Heading, its standard deviation, how it was found, and the time over which it was turned, s.
    """
    found = _from_velocity(aiding, epoch * imu.dt) or _from_chord(aiding, epoch * imu.dt)
    if found is None:
        return None
    course, sd, begin, end = found
    last = min(round(end / imu.dt), imu.n)
    if last <= epoch:
        turned = np.zeros(1)
    else:
        kept = np.empty((last - epoch, 3, 3))
        _carry(C.copy(), imu.rotation[epoch:last] - bias * imu.dt, kept)
        part = kept[max(round(begin / imu.dt) - epoch - 1, 0) :]
        turned = rpy_from_matrix(part)[:, 2] - rpy_from_matrix(C)[2]
    mean_turn = float(np.angle(np.mean(np.exp(1j * turned))))
    back = 0.5 * (begin + end) - epoch * imu.dt
    total = float(np.sqrt(sd**2 + tuning.CRAB_SD**2 + (drift * back) ** 2))
    return course - mean_turn, total, f"heading from GNSS, {begin:.6g} s after the start", back


def _from_velocity(aiding: Aiding, start: float) -> tuple[float, float, float, float] | None:
    velocity = aiding.of("velocity")
    if velocity is None:
        return None
    speed = np.hypot(velocity.value[:, 0], velocity.value[:, 1])
    sd = np.sqrt(np.mean(velocity.sd[:, :2] ** 2, axis=1))
    fast = (speed > tuning.COURSE_RATIO * sd) & (velocity.time >= start)
    fast &= velocity.time <= start + tuning.SEARCHED
    if not np.any(fast):
        return None
    i = int(np.argmax(fast))
    time = float(velocity.time[i])
    course = float(np.arctan2(velocity.value[i, 1], velocity.value[i, 0]))
    return course, float(sd[i] / speed[i]), time, time


def _from_chord(aiding: Aiding, start: float) -> tuple[float, float, float, float] | None:
    """Course between two fixes that are near in time and far apart.

    Those between them and the next one lie on the way, or one of the two is an outlier; if no other
    are far apart, the first are taken all the same.
    """
    positions = positions_of(aiding)
    time, sd = positions.time, np.sqrt(np.mean(positions.sd[:, :2] ** 2, axis=1))
    begins = np.flatnonzero((time >= start - 1e-6) & (time <= start + tuning.SEARCHED))
    first = None
    for i in begins:
        for j in range(i + 1, time.size):
            if time[j] - time[i] > tuning.CHORD:
                break
            way = ned_difference(positions.value[i : j + 2], positions.value[i])[:, :2]
            (north, east), error = way[j - i], np.hypot(sd[i], sd[j])
            length = float(np.hypot(north, east))
            if length > tuning.COURSE_RATIO * error:
                course = float(np.arctan2(east, north))
                found = course, float(error / length), float(time[i]), float(time[j])
                share = (time[i : j + 2] - time[i]) / (time[j] - time[i])
                aside = np.hypot(*(way - share[:, None] * way[j - i]).T)
                if j + 1 < time.size and np.max(aside) < tuning.CHORD_ASIDE * length:
                    return found
                first = first or found
    return first


def compass(
    mean: FloatArray, level: FloatArray, lat: float, gyro_sd: float
) -> tuple[float, float, str, float] | None:
    """Heading from the Earth's rotation, if the gyros show it. Groves (2013), eq. 5.105."""
    north, east, _ = matrix_from_rpy(level) @ mean[:3]
    sd = float(gyro_sd / (RATE * np.cos(lat)))
    if sd > tuning.COMPASS_SD:
        return None
    return float(np.arctan2(-east, north)), sd, "heading from the Earth's rotation", 0.0
