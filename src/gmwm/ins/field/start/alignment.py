"""Where a filter of real data starts: position, level, heading, and how well they are known.

Levelling and gyrocompassing after Groves (2013), secs. 5.6.2 and 5.6.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.spool import Spool, is_spooled, release, windows
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.field.start.heading import compass, course, turned
from gmwm.ins.field.start.in_motion import attitude_in_motion, velocities
from gmwm.ins.field.start.standing import at_rest, positions_of, steady
from gmwm.ins.filter import Aiding, Fixes, InitialSd
from gmwm.ins.geometry import (
    RATE,
    STANDARD_GRAVITY,
    matrix_from_rpy,
    ned_difference,
    offset,
    rpy_from_matrix,
)
from gmwm.ins.imu import AXES, Imu, SensorModels
from gmwm.ins.trajectory import NavState


@dataclass(frozen=True, eq=False)
class Alignment:
    """An initial state.

    epoch: Of the IMU, where the filter starts.
    gyro_bias: (3,), subtracted from the gyros, rad/s; zero if the vehicle never stood still.
    gyro_bias_sd: How well it is known, rad/s; ``None`` if the vehicle never stood still.
    notices: How it came about.
    stood: Time over which that was averaged, s.
    turned: Time over which the gyros turned a course of GNSS back to the start, s.
    """

    epoch: int
    state: NavState
    sd: InitialSd
    gyro_bias: FloatArray
    gyro_bias_sd: float | None
    notices: tuple[Notice, ...]
    stood: float = 0.0
    turned: float = 0.0


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

    aiding: With position fixes.
    models: Of the IMU, with the standard deviation of constant biases.
    heading: Of the forward axis at the first fix, rad from north to the east. By default that of
        the GNSS velocity once the vehicle moves, or of the Earth's rotation if the gyros show it.
    heading_sd: How well a given heading is known, rad.
    attitude: Roll, pitch and yaw at the first fix, rad. By default the vehicle is levelled while it
        is steady; if it never is, the attitude follows from how its velocity changes.
    attitude_sd: How well a given attitude is known, rad, each axis.
    Raises InputError if there is no fix, no steady stretch or acceleration to level by, or no way
        to know the heading.
    """
    positions = positions_of(aiding)
    if attitude is not None:
        return _given(imu, aiding, np.asarray(attitude, dtype=float), attitude_sd)
    stretch = steady(imu)
    if stretch is None:
        return _in_motion(imu, aiding, models)
    first, last = stretch
    length = (last - first) * imu.dt
    still, velocity, velocity_sd = at_rest(aiding, imu.dt, first, last)
    mean = np.concatenate([np.mean(imu.rotation[first:last], axis=0),
                           np.mean(imu.velocity[first:last], axis=0)]) / imu.dt  # fmt: skip
    bias = mean[:3] if still else np.zeros(3)
    epoch, fix = _starting_fix(positions, imu.dt, first)
    # The time of levelling is the middle of the stretch unless all of it is at rest.
    levelled = epoch if still and first <= epoch <= last else (first + last) // 2
    level = np.array([np.arctan2(-mean[4], -mean[5]), np.arctan2(mean[3], np.hypot(*mean[4:])), 0])
    body = turned(imu, bias, matrix_from_rpy(level), levelled, epoch)
    gyro_sd = mean_sd(models, "gyro", length, imu.dt)
    biased = float(np.hypot(gyro_sd, _bias(models, "gyro")))
    drift = gyro_sd if still else float(np.hypot(biased, RATE))
    tilt_sd = float(
        np.hypot(_tilt_sd(models, length, imu.dt, still), drift * (epoch - levelled) * imu.dt)
    )
    lat = float(positions.value[fix, 0])
    back = 0.0
    if heading is not None:
        yaw, yaw_sd, how = heading, heading_sd, "heading as given"
    else:
        yaw, yaw_sd, how, back = _heading(
            course(imu, aiding, bias, body, epoch, drift),
            compass(mean, level, lat, biased) if still else None,
        )
    upright = rpy_from_matrix(body) * [1.0, 1.0, 0.0]
    C = matrix_from_rpy(np.array([0.0, 0.0, yaw])) @ matrix_from_rpy(upright)
    if velocity is None:
        velocity, velocity_sd = _first_velocity(aiding, epoch, imu.dt)
    earth = C.T @ np.array([RATE * np.cos(lat), 0.0, -RATE * np.sin(lat)])
    known_sd = float(np.hypot(gyro_sd, RATE * np.hypot(yaw_sd, tilt_sd))) if still else None
    start = first * imu.dt
    motion, mean_off = (
        ("at rest", "; the gyros' mean there is subtracted") if still else ("in steady motion", "")
    )
    notices = (
        Notice(
            "levelled", "note", "",
            f"levelled on {length:.3g} s {motion}, from {start:.6g} s on{mean_off}",
            {"length": length, "start": start, "at rest": still},
        ),
        Notice(
            "heading", "note", "",
            f"{how}: {np.degrees(yaw) % 360.0:.2f} deg, 1 sigma {np.degrees(yaw_sd):.2g} deg",
            {"heading": yaw, "sd": yaw_sd},
        ),
    )  # fmt: skip
    return Alignment(
        epoch, *_at_fix(imu, aiding, epoch, fix, C, velocity, (velocity_sd, tilt_sd, yaw_sd)),
        bias - earth if still else bias, known_sd, notices, length if still else 0.0, back,
    )  # fmt: skip


def _heading(*found: tuple[float, float, str, float] | None) -> tuple[float, float, str, float]:
    """The one that is known best."""
    known = [each for each in found if each is not None]
    if not known:
        raise InputError(
            "the heading cannot be known: GNSS shows no motion fast enough in the first "
            f"{tuning.SEARCHED:g} s, and the gyros cannot find it from the Earth's rotation: "
            "give the heading",
            "heading-unknown",
        )
    return min(known, key=lambda each: each[1])


def _given(imu: Imu, aiding: Aiding, attitude: FloatArray, sd: float) -> Alignment:
    """A start at the first fix with an attitude that is given."""
    shown = ", ".join(f"{each:.2f}" for each in np.degrees(attitude))
    text = f"roll, pitch and yaw as given: {shown} deg, 1 sigma {np.degrees(sd):.2g} deg"
    notice = Notice("attitude-given", "note", "", text, {"attitude": attitude.tolist(), "sd": sd})
    epoch, fix = _starting_fix(positions_of(aiding), imu.dt, 0)
    return _moving(imu, aiding, epoch, fix, matrix_from_rpy(attitude), (sd, sd), notice)


def _in_motion(imu: Imu, aiding: Aiding, models: SensorModels) -> Alignment:
    """A start at the first fix with an attitude from how the velocity changes."""
    positions = positions_of(aiding)
    epoch, fix = _starting_fix(positions, imu.dt, 0)
    constant = [
        float(np.hypot(_bias(models, kind), mean_sd(models, kind, tuning.MOTION_LEAST, imu.dt)))
        for kind in ("gyro", "accel")
    ]
    C, sd = attitude_in_motion(
        imu, epoch, velocities(positions, aiding.of("velocity")), positions.value[fix],
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
    velocity, velocity_sd = _first_velocity(aiding, epoch, imu.dt)
    start = _at_fix(imu, aiding, epoch, fix, C, velocity, (velocity_sd, *sd))
    return Alignment(epoch, *start, np.zeros(3), None, (notice,))


def _at_fix(
    imu: Imu, aiding: Aiding, epoch: int, fix: int, C: FloatArray, velocity: FloatArray,
    sd: tuple[float, float, float],
) -> tuple[NavState, InitialSd]:  # fmt: skip
    """State at an epoch near a fix, and how well it is known: velocity, tilt and heading given."""
    positions = positions_of(aiding)
    later = velocity * (epoch * imu.dt - positions.time[fix])
    place = offset(positions.value[fix], later - C @ np.asarray(aiding.lever_arm))
    position = float(np.sqrt(np.mean(positions.sd[fix] ** 2)))
    return (
        NavState(place, velocity, rpy_from_matrix(C)),
        InitialSd(position=position, velocity=sd[0], tilt=sd[1], heading=sd[2]),
    )


def _starting_fix(positions: Fixes, dt: float, first: int) -> tuple[int, int]:
    """Epoch and number of the first position fix from an epoch on."""
    later = np.flatnonzero(positions.time >= (first - 0.5) * dt)
    if not later.size:
        raise InputError("there is no position fix once the IMU is steady: give later ones")
    return int(np.rint(positions.time[later[0]] / dt)), int(later[0])


def _first_velocity(aiding: Aiding, epoch: int, dt: float) -> tuple[FloatArray, float]:
    """Velocity where the filter starts: of a fix there, or of the way to the next one."""
    velocity = aiding.of("velocity")
    if velocity is not None:
        i = int(np.argmin(np.abs(velocity.time - epoch * dt)))
        if abs(velocity.time[i] - epoch * dt) < dt:
            return velocity.value[i], float(np.sqrt(np.mean(velocity.sd[i] ** 2)))
    positions = positions_of(aiding)
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


def mean_sd(models: SensorModels, kind: str, length: float, dt: float) -> float:
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
    error = np.hypot(max(slow), mean_sd(models, "accel", length, dt))
    sd = np.hypot(np.hypot(error, _bias(models, "accel")) / STANDARD_GRAVITY, tuning.TILT_FLOOR)
    return float(sd if still else np.hypot(sd, tuning.TILT_MOVING))


def _stationary(models: SensorModels, axis: str, dt: float) -> float:
    form = models.models[axis].state_space(dt)
    return float(form.output @ form.initial_covariance @ form.output)


def started(imu: Imu, aiding: Aiding, alignment: Alignment) -> tuple[Imu, Aiding]:
    """Increments and fixes after the initial state, with the gyros' bias subtracted."""
    first = alignment.epoch
    rotation = _less(imu.rotation[first:], alignment.gyro_bias * imu.dt)
    fixes = []
    for each in aiding.fixes:
        shifted = replace(each, time=each.time - first * imu.dt)
        # Those of the first epoch made the initial state.
        fixes.append(shifted.part(shifted.time > 0.5 * imu.dt))
    return Imu(imu.dt, rotation, imu.velocity[first:]), replace(aiding, fixes=tuple(fixes))


def _less(rotation: FloatArray, constant: FloatArray) -> FloatArray:
    """Increments less a constant; on disk if they are there."""
    if not is_spooled(rotation):
        return np.asarray(rotation - constant)
    spool = Spool(3)
    for part in windows(len(rotation)):
        spool.append(rotation[part] - constant)
        release(rotation)
    return spool.array()
