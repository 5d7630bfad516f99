"""Where a filter of real data starts: position, level, heading, and how well they are known.

Levelling and gyrocompassing after Groves (2013), secs. 5.6.2 and 5.6.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.field.in_motion import attitude_in_motion, velocities
from gmwm.ins.filter import Aiding, Fixes, InitialSd
from gmwm.ins.geometry import (
    RATE,
    STANDARD_GRAVITY,
    matrix_from_rpy,
    ned_difference,
    offset,
    rpy_from_matrix,
    turn_body,
)
from gmwm.ins.imu import AXES, Imu, SensorModels
from gmwm.ins.trajectory import NavState


@dataclass(frozen=True, eq=False)
class Alignment:
    """An initial state.

    Attributes
    ----------
    epoch : int
        Of the IMU, where the filter starts.
    state : NavState
    sd : InitialSd
    gyro_bias : (3,) ndarray
        Subtracted from the gyros, rad/s; zero if the vehicle never stood still.
    gyro_bias_sd : float or None
        How well it is known, rad/s; ``None`` if the vehicle never stood still.
    notices : tuple of Notice
        How it came about.
    """

    epoch: int
    state: NavState
    sd: InitialSd
    gyro_bias: FloatArray
    gyro_bias_sd: float | None
    notices: tuple[Notice, ...]


def align(
    imu: Imu,
    aiding: Aiding,
    models: SensorModels,
    heading: float | None = None,
    heading_sd: float = tuning.HEADING_SD,
    attitude: Sequence[float] | None = None,
    attitude_sd: float = tuning.ATTITUDE_SD,
) -> Alignment:
    """Find an initial state in the data.

    Parameters
    ----------
    imu : Imu
    aiding : Aiding
        With position fixes.
    models : SensorModels
        Of the IMU, with the standard deviation of constant biases.
    heading : float, optional
        Of the forward axis at the first fix, rad from north to the east. By default that of the
        GNSS velocity once the vehicle moves, or of the Earth's rotation if the gyros show it.
    heading_sd : float, optional
        How well a given heading is known, rad.
    attitude : three floats, optional
        Roll, pitch and yaw at the first fix, rad. By default the vehicle is levelled while it is
        steady; if it never is, the attitude follows from how its velocity changes.
    attitude_sd : float, optional
        How well a given attitude is known, rad, each axis.

    Returns
    -------
    Alignment

    Raises
    ------
    InputError
        If there is no fix, no steady stretch or acceleration to level by, or no way to know the
        heading.
    """
    positions = _positions(aiding)
    if attitude is not None:
        return _given(imu, aiding, np.asarray(attitude, dtype=float), attitude_sd)
    steady = _steady(imu)
    if steady is None:
        return _in_motion(imu, aiding, models)
    first, last = steady
    still, velocity, velocity_sd = _motion(aiding, imu.dt, first, last)
    mean = np.concatenate([np.mean(imu.rotation[first:last], axis=0),
                           np.mean(imu.velocity[first:last], axis=0)]) / imu.dt  # fmt: skip
    bias = mean[:3] if still else np.zeros(3)
    epoch, fix = _starting_fix(positions, imu.dt, first)
    level = np.array([np.arctan2(-mean[4], -mean[5]), np.arctan2(mean[3], np.hypot(*mean[4:])), 0])
    # The time of levelling is the middle of the stretch unless all of it is at rest.
    levelled = epoch if still and first <= epoch <= last else (first + last) // 2
    matrices = _turned(imu, bias, matrix_from_rpy(level), levelled, epoch)
    gyro_sd = _mean_sd(models, "gyro", (last - first) * imu.dt, imu.dt)
    drift = gyro_sd if still else float(np.hypot(gyro_sd, np.hypot(_bias(models, "gyro"), RATE)))
    tilt_sd = float(np.hypot(
        _tilt_sd(models, (last - first) * imu.dt, imu.dt, still),
        drift * (epoch - levelled) * imu.dt,
    ))  # fmt: skip
    at_level = rpy_from_matrix(matrices)
    lat = float(positions.value[fix, 0])
    if heading is not None:
        yaw, yaw_sd, how = heading, heading_sd, "heading as given"
    else:
        found = [_course(imu, aiding, bias, matrices, epoch, drift)]
        if still:
            found.append(_compass(mean, level, lat, np.hypot(gyro_sd, _bias(models, "gyro"))))
        known = [each for each in found if each is not None]
        if not known:
            raise InputError(
                "the heading cannot be known: GNSS shows no motion fast enough in the first "
                f"{tuning.SEARCHED:g} s, and the gyros cannot find it from the Earth's rotation: "
                "give the heading",
                "heading-unknown",
            )
        yaw, yaw_sd, how = min(known, key=lambda each: each[1])
    C = matrix_from_rpy(np.array([0.0, 0.0, yaw])) @ matrix_from_rpy(
        at_level - [0.0, 0.0, at_level[2]]
    )
    if velocity is None:
        velocity, velocity_sd = _first_velocity(aiding, epoch, imu.dt)
    # The fix may be half a sampling interval from the epoch.
    later = velocity * (epoch * imu.dt - positions.time[fix])
    state = NavState(
        offset(positions.value[fix], later - C @ np.asarray(aiding.lever_arm)), velocity,
        rpy_from_matrix(C),
    )  # fmt: skip
    sd = InitialSd(
        position=float(np.sqrt(np.mean(positions.sd[fix] ** 2))),
        velocity=velocity_sd, tilt=tilt_sd, heading=yaw_sd,
    )  # fmt: skip
    earth = C.T @ np.array([RATE * np.cos(lat), 0.0, -RATE * np.sin(lat)])
    known_sd = float(np.hypot(gyro_sd, RATE * np.hypot(yaw_sd, tilt_sd))) if still else None
    length, start = (last - first) * imu.dt, first * imu.dt
    motion = "at rest; the gyros' mean there is subtracted" if still else "in steady motion"
    notices = (
        Notice(
            "levelled", "note", "",
            f"levelled by {length:.3g} s, {start:.6g} s after the start, {motion}",
            {"length": length, "start": start, "at rest": still},
        ),
        Notice(
            "heading", "note", "",
            f"{how}: {np.degrees(yaw) % 360.0:.2f} deg, 1 sigma {np.degrees(yaw_sd):.2g} deg",
            {"heading": yaw, "sd": yaw_sd},
        ),
    )  # fmt: skip
    return Alignment(epoch, state, sd, bias - earth if still else bias, known_sd, notices)


def _of_kind(aiding: Aiding, kind: str) -> Fixes | None:
    found = [each for each in aiding.fixes if each.kind == kind and each.time.size]
    return found[0] if found else None


def _positions(aiding: Aiding) -> Fixes:
    found = _of_kind(aiding, "position")
    if found is None:
        raise InputError("there is no position fix: a filter starts at one")
    return found


def _given(imu: Imu, aiding: Aiding, attitude: FloatArray, sd: float) -> Alignment:
    """A start at the first fix with an attitude that is given."""
    shown = ", ".join(f"{each:.2f}" for each in np.degrees(attitude))
    text = f"roll, pitch and yaw as given: {shown} deg, 1 sigma {np.degrees(sd):.2g} deg"
    notice = Notice("attitude-given", "note", "", text, {"attitude": attitude.tolist(), "sd": sd})
    epoch, fix = _starting_fix(_positions(aiding), imu.dt, 0)
    return _moving(imu, aiding, epoch, fix, matrix_from_rpy(attitude), (sd, sd), notice)


def _in_motion(imu: Imu, aiding: Aiding, models: SensorModels) -> Alignment:
    """A start at the first fix with an attitude from how the velocity changes."""
    positions = _positions(aiding)
    epoch, fix = _starting_fix(positions, imu.dt, 0)
    constant = [
        float(np.hypot(_bias(models, kind), _mean_sd(models, kind, tuning.MOTION_LEAST, imu.dt)))
        for kind in ("gyro", "accel")
    ]
    C, sd = attitude_in_motion(
        imu, epoch, velocities(positions, _of_kind(aiding, "velocity")), positions.value[fix],
        np.asarray(aiding.lever_arm, dtype=float), constant[0], constant[1],
    )  # fmt: skip
    tilt, heading = float(np.max(sd[:2])), float(sd[2])
    roll, pitch, yaw = np.degrees(rpy_from_matrix(C))
    text = (
        f"aligned in motion: roll {roll:.2f}, pitch {pitch:.2f}, yaw {yaw % 360.0:.2f} deg, "
        f"1 sigma {np.degrees(tilt):.2g} deg of tilt and {np.degrees(heading):.2g} of heading"
    )
    notice = Notice("aligned-in-motion", "note", "", text, {"tilt": tilt, "heading": heading})
    return _moving(imu, aiding, epoch, fix, C, (tilt, heading), notice)


def _moving(
    imu: Imu, aiding: Aiding, epoch: int, fix: int, C: FloatArray, sd: tuple[float, float],
    notice: Notice,
) -> Alignment:  # fmt: skip
    """A start at a fix in motion: nothing is known of the gyros' bias."""
    positions = _positions(aiding)
    velocity, velocity_sd = _first_velocity(aiding, epoch, imu.dt)
    later = velocity * (epoch * imu.dt - positions.time[fix])
    place = offset(positions.value[fix], later - C @ np.asarray(aiding.lever_arm))
    known = InitialSd(
        position=float(np.sqrt(np.mean(positions.sd[fix] ** 2))),
        velocity=velocity_sd, tilt=sd[0], heading=sd[1],
    )  # fmt: skip
    state = NavState(place, velocity, rpy_from_matrix(C))
    return Alignment(epoch, state, known, np.zeros(3), None, (notice,))


def _steady(imu: Imu) -> tuple[int, int] | None:
    """First stretch in which means over a window stay near the first one: rest, or steady motion.

    ``None`` if there is none.
    """
    window = max(round(tuning.STEADY_WINDOW / imu.dt), 1)
    count = min(imu.n, round(tuning.SEARCHED / imu.dt)) // window
    increments = np.hstack([imu.rotation, imu.velocity])[: count * window]
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
            if np.any(np.abs(means[end] - np.mean(means[begin:end], axis=0)) > limit):
                break
            end += 1
        if end - begin >= least:
            return begin * window, end * window
        begin = end
    return None


def _scatter(windows: FloatArray, dt: float) -> FloatArray:
    """Standard deviation of the mean over a window from noise within it, the quietest of all."""
    steps = np.diff(windows, axis=1) / dt
    noise = np.sqrt(np.min(np.mean(steps**2, axis=1), axis=0) / 2.0) if steps.size else np.zeros(6)
    return np.asarray(noise / np.sqrt(windows.shape[1]), dtype=float)


def _motion(
    aiding: Aiding, dt: float, first: int, last: int
) -> tuple[bool, FloatArray | None, float]:
    """Whether the vehicle is at rest in a stretch, and if so its velocity and how well known."""
    begin, end = (first - 0.5) * dt, (last + 0.5) * dt
    velocity = _of_kind(aiding, "velocity")
    if velocity is not None:
        inside = (velocity.time >= begin) & (velocity.time <= end)
        if np.any(inside):
            mean, sd = np.mean(velocity.value[inside], axis=0), np.mean(velocity.sd[inside], axis=0)
            sd = sd / np.sqrt(np.count_nonzero(inside))
            if np.all(np.abs(mean) < tuning.SIGMAS * sd):
                return True, np.zeros(3), max(float(np.max(sd)), tuning.STILL_VELOCITY_SD)
            return False, None, 0.0
    position = _positions(aiding)
    inside = (position.time >= begin) & (position.time <= end)
    if np.count_nonzero(inside) < 2:
        return False, None, 0.0
    part = position.part(inside)
    sd = np.hypot(part.sd[0], part.sd[-1])
    if np.any(np.abs(ned_difference(part.value[-1], part.value[0])) > tuning.SIGMAS * sd):
        return False, None, 0.0
    speed_sd = float(np.max(sd)) / float(part.time[-1] - part.time[0])
    return True, np.zeros(3), max(speed_sd, tuning.STILL_VELOCITY_SD)


def _starting_fix(positions: Fixes, dt: float, first: int) -> tuple[int, int]:
    """Epoch and number of the first position fix from an epoch on."""
    later = np.flatnonzero(positions.time >= (first - 0.5) * dt)
    if not later.size:
        raise InputError("there is no position fix once the IMU is steady: give later ones")
    return int(np.rint(positions.time[later[0]] / dt)), int(later[0])


def _turned(imu: Imu, bias: FloatArray, C: FloatArray, levelled: int, epoch: int) -> FloatArray:
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


def _course(
    imu: Imu, aiding: Aiding, bias: FloatArray, C: FloatArray, epoch: int, drift: float
) -> tuple[float, float, str] | None:
    """Heading at an epoch from the first course that GNSS shows, turned back by the gyros."""
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
    gone = drift * (0.5 * (begin + end) - epoch * imu.dt)
    total = float(np.sqrt(sd**2 + tuning.CRAB_SD**2 + gone**2))
    return course - mean_turn, total, f"heading from GNSS, {begin:.6g} s after the start"


def _from_velocity(aiding: Aiding, start: float) -> tuple[float, float, float, float] | None:
    velocity = _of_kind(aiding, "velocity")
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
    """Course between two fixes that are near in time and far apart."""
    positions = _positions(aiding)
    time, sd = positions.time, np.sqrt(np.mean(positions.sd[:, :2] ** 2, axis=1))
    begins = np.flatnonzero((time >= start - 1e-6) & (time <= start + tuning.SEARCHED))
    for i in begins:
        for j in range(i + 1, time.size):
            if time[j] - time[i] > tuning.CHORD:
                break
            north, east, _ = ned_difference(positions.value[j], positions.value[i])
            length, error = np.hypot(north, east), np.hypot(sd[i], sd[j])
            if length > tuning.COURSE_RATIO * error:
                course = float(np.arctan2(east, north))
                return course, float(error / length), float(time[i]), float(time[j])
    return None


def _compass(
    mean: FloatArray, level: FloatArray, lat: float, gyro_sd: float
) -> tuple[float, float, str] | None:
    """Heading from the Earth's rotation, if the gyros show it. Groves (2013), eq. 5.105."""
    north, east, _ = matrix_from_rpy(level) @ mean[:3]
    sd = float(gyro_sd / (RATE * np.cos(lat)))
    if sd > tuning.COMPASS_SD:
        return None
    return float(np.arctan2(-east, north)), sd, "heading from the Earth's rotation"


def _first_velocity(aiding: Aiding, epoch: int, dt: float) -> tuple[FloatArray, float]:
    """Velocity where the filter starts: of a fix there, or of the way to the next one."""
    velocity = _of_kind(aiding, "velocity")
    if velocity is not None:
        i = int(np.argmin(np.abs(velocity.time - epoch * dt)))
        if abs(velocity.time[i] - epoch * dt) < dt:
            return velocity.value[i], float(np.sqrt(np.mean(velocity.sd[i] ** 2)))
    positions = _positions(aiding)
    i = int(np.argmin(np.abs(positions.time - epoch * dt)))
    if i + 1 >= positions.time.size or positions.time[i + 1] - positions.time[i] > tuning.CHORD:
        raise InputError("the first position fix has no other near it: begin where fixes are dense")
    step = positions.time[i + 1] - positions.time[i]
    way = ned_difference(positions.value[i + 1], positions.value[i])
    sd = np.hypot(positions.sd[i], positions.sd[i + 1]) / step
    # The vehicle may speed up by 1 m/s^2 on the way.
    return way / step, float(np.hypot(np.sqrt(np.mean(sd**2)), 0.5 * step))


def _bias(models: SensorModels, kind: str) -> float:
    return max(models.bias_sd[axis] for axis in AXES if axis.startswith(kind))


def _mean_sd(models: SensorModels, kind: str, length: float, dt: float) -> float:
    """Standard deviation of an error later, less its mean over a time; the worst axis."""
    variances = [
        float(models.models[axis].haar_variance(np.array([length]), dt)[0])
        for axis in AXES
        if axis.startswith(kind)
    ]
    # The Allan variance, twice the Haar one, is half the mean square of such a difference.
    return float(np.sqrt(4.0 * max(variances)))


def _tilt_sd(models: SensorModels, length: float, dt: float, still: bool) -> float:
    slow = [
        float(np.sqrt(_stationary(models, axis, dt))) for axis in AXES if axis.startswith("accel")
    ]
    error = np.hypot(max(slow), _mean_sd(models, "accel", length, dt))
    sd = np.hypot(np.hypot(error, _bias(models, "accel")) / STANDARD_GRAVITY, tuning.TILT_FLOOR)
    return float(sd if still else np.hypot(sd, tuning.TILT_MOVING))


def _stationary(models: SensorModels, axis: str, dt: float) -> float:
    form = models.models[axis].state_space(dt)
    return float(form.output @ form.initial_covariance @ form.output)


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
    steady = _steady(imu)
    if steady is None or not _motion(aiding, imu.dt, *steady)[0]:
        return None
    quieter, length = tuning.ZERO_VELOCITY
    window = max(round(length / imu.dt), 2)
    samples = np.hstack([imu.rotation, imu.velocity])[: imu.n // window * window] / imu.dt
    windows = samples.reshape(-1, window, 6)
    mean, scatter = windows.mean(axis=1), windows.std(axis=1)
    first, last = (-(-steady[0] // window), steady[1] // window)
    rest = slice(first, max(last, first + 1))
    level, usual = mean[rest].mean(axis=0), np.sqrt(np.mean(scatter[rest] ** 2, axis=0))
    slow = np.abs(mean[:, :3] - level[:3]) <= tuning.STEADY[0]
    still = np.all(scatter <= quieter * usual, axis=1) & np.all(slow, axis=1)
    time = np.asarray((np.flatnonzero(still) + 1) * window * imu.dt, dtype=float)
    zeros = np.zeros((time.size, 3))
    return Fixes("standstill", time, zeros, zeros + sd)


def started(imu: Imu, aiding: Aiding, alignment: Alignment) -> tuple[Imu, Aiding]:
    """Increments and fixes after the initial state, with the gyros' bias subtracted.

    Parameters
    ----------
    imu : Imu
    aiding : Aiding
    alignment : Alignment
    """
    first = alignment.epoch
    rotation = imu.rotation[first:] - alignment.gyro_bias * imu.dt
    fixes = []
    for each in aiding.fixes:
        shifted = replace(each, time=each.time - first * imu.dt)
        # Those of the first epoch made the initial state.
        fixes.append(shifted.part(shifted.time > 0.5 * imu.dt))
    return Imu(imu.dt, rotation, imu.velocity[first:]), replace(aiding, fixes=tuple(fixes))
