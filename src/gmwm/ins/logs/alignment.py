"""Where a filter of real data starts: position, level, heading, and how well they are known.

Levelling and gyrocompassing after Groves (2013), secs. 5.6.2 and 5.6.3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gmwm._core.spool import alike, release, windows
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter.aiding import Aiding
from gmwm.ins.filter.filter import InitialSd
from gmwm.ins.geometry import RATE, STANDARD_GRAVITY, matrix_from_rpy, offset, rpy_from_matrix
from gmwm.ins.increments import Imu
from gmwm.ins.logs.attitude import (
    Heading,
    acceleration,
    gyrocompass,
    heading_from_course,
    positions_of,
    steady,
    turned,
    velocities_between,
    velocity_at_rest,
)
from gmwm.ins.logs.measured import Measured
from gmwm.ins.sensors import AXES, SensorModels
from gmwm.ins.trajectory.trajectory import NavState
from gmwm.issues import Notice, notice


@dataclass(frozen=True, eq=False)
class Alignment:
    """An initial state.

    epoch: Epoch of the IMU at which the filter starts.
    gyro_bias, gyro_bias_sd: (3,), subtracted from the gyros, and standard deviation, rad/s; zero
        and ``None`` if the vehicle never stood still.
    stood: Time over which the gyro bias was averaged, s.
    """

    epoch: int
    state: NavState
    sd: InitialSd
    gyro_bias: FloatArray
    gyro_bias_sd: float | None
    notices: tuple[Notice, ...]
    stood: float = 0.0


def align(measured: Measured) -> Alignment:
    """Find an initial state in the data.

    A vehicle without a given attitude is levelled while it is steady, at rest or where GNSS shows
    no acceleration. The heading is the given one, the course of GNSS once the vehicle moves, or
    that of the Earth's rotation if the gyros show it.

    Raises InputError if there is no fix, no steady stretch, or no way to know the heading.
    """
    imu, aiding, attitude = measured.imu, measured.aiding, measured.attitude
    if attitude is not None:
        fix, epoch = _first_fix(measured)
        values = {"attitude": list(attitude), "sd": measured.attitude_sd}
        degrees = ", ".join(f"{each:.2f}" for each in np.degrees(attitude))
        sd_deg = np.degrees(measured.attitude_sd)
        how = notice("attitude-given", values=values, degrees=degrees, sd_deg=sd_deg)
        sd = InitialSd(tilt=measured.attitude_sd, heading=measured.attitude_sd)
        state = _state(measured, fix, matrix_from_rpy(np.asarray(attitude)), sd)
        return Alignment(epoch, *state, np.zeros(3), None, (how,))
    for stretch in steady(imu):
        rest_sd, tilt = velocity_at_rest(aiding, imu.dt, *stretch), 0.0
        if rest_sd is None:
            slope = acceleration(aiding, imu.dt, *stretch) / STANDARD_GRAVITY
            tilt = max(slope, tuning.TILT_MOVING)
        if tilt <= tuning.TILT_MOST:
            return _levelled(measured, stretch, rest_sd, tilt)
    raise InputError(
        f"the attitude cannot be known: the fixes of the first {tuning.SEARCHED:g} s show the "
        f"vehicle neither at rest nor at constant velocity for {tuning.STEADY_LEAST:g} s: give the "
        "attitude, or begin the record where the vehicle stands",
        "attitude-unknown",
    )


def _first_fix(measured: Measured, first: int = 0) -> tuple[int, int]:
    """Number of the first position fix from an epoch on, and its epoch."""
    time, dt = positions_of(measured.aiding).time, measured.imu.dt
    fix = int(np.searchsorted(time, (first - 0.5) * dt))
    if fix == time.size:
        raise InputError(
            "no position fix follows the first time at which the IMU is steady: give later fixes"
        )
    return fix, int(np.rint(time[fix] / dt))


def _state(
    measured: Measured, fix: int, C: FloatArray, sd: InitialSd, is_at_rest: bool = False
) -> tuple[NavState, InitialSd]:
    """State at a position fix; completes ``sd``, but for the velocity of a vehicle at rest."""
    positions, dt = positions_of(measured.aiding), measured.imu.dt
    now = np.rint(positions.time[fix] / dt) * dt
    velocity = np.zeros(3)
    if not is_at_rest:
        # Of the next fix, or of the way to the next position.
        fixes = measured.aiding.of("velocity") or velocities_between(positions)
        after = fixes.part((fixes.time > now - dt) & (fixes.time <= now + tuning.CHORD))
        if not after.time.size:
            raise InputError(
                "no other fix near the first position fix: start where fixes are frequent"
            )
        # The vehicle may speed up by 1 m/s^2 until then.
        error = np.hypot(np.sqrt(np.mean(after.sd[0] ** 2)), after.time[0] - now)
        velocity, sd = after.value[0], replace(sd, velocity=float(error))
    later = velocity * (now - positions.time[fix])
    lla = offset(positions.value[fix], later - C @ np.asarray(measured.aiding.lever_arm))
    sd = replace(sd, position=float(np.sqrt(np.mean(positions.sd[fix] ** 2))))
    return NavState(lla, velocity, rpy_from_matrix(C)), sd


def _levelled(
    measured: Measured, stretch: tuple[int, int], rest_sd: float | None, moving: float
) -> Alignment:
    """A start that is levelled on a steady stretch, with a given heading or one from the data."""
    imu, aiding, models = measured.imu, measured.aiding, measured.sensors
    first, last = stretch
    length = (last - first) * imu.dt
    still = rest_sd is not None
    rate, force = (np.mean(e[first:last], axis=0) / imu.dt for e in (imu.rotation, imu.velocity))
    bias = rate if still else np.zeros(3)
    fix, epoch = _first_fix(measured, first)
    lat = float(positions_of(aiding).value[fix, 0])
    # The time of levelling is the middle of the stretch unless all of it is at rest.
    levelled = epoch if still and first <= epoch <= last else (first + last) // 2
    level = np.array(
        [np.arctan2(-force[1], -force[2]), np.arctan2(force[0], np.hypot(*force[1:])), 0]
    )
    body = turned(imu, bias, matrix_from_rpy(level), levelled, epoch)
    gyro_sd, biased = (each(models, "gyro", length, imu.dt) for each in (mean_sd, biased_sd))
    drift = gyro_sd if still else float(np.hypot(biased, RATE))
    turn = drift * (epoch - levelled) * imu.dt
    tilt_sd = float(np.linalg.norm([_tilt_sd(models, length, imu.dt), moving, turn]))
    if measured.heading is not None:
        heading = Heading(measured.heading, measured.heading_sd, "heading as given")
    else:
        by_course = heading_from_course(imu, aiding, bias, body, epoch, drift)
        by_gyros = gyrocompass(rate, level, lat, biased) if still else None
        known = [each for each in (by_course, by_gyros) if each is not None]
        if not known:
            raise InputError(
                "the heading cannot be known: GNSS shows no motion fast enough in the first "
                f"{tuning.SEARCHED:g} s, and the gyros cannot find it from the Earth's rotation: "
                "give the heading",
                "heading-unknown",
            )
        heading = min(known, key=lambda each: each.sd)
    yaw, yaw_sd = heading.yaw, heading.sd
    C = matrix_from_rpy(rpy_from_matrix(body) * [1.0, 1.0, 0.0] + [0.0, 0.0, yaw])
    notices = (
        notice(
            "levelled",
            values={"length": length, "start": first * imu.dt, "at rest": still},
            how="at rest" if still else "in steady motion",
            bias="; the gyros' mean there is subtracted" if still else "",
        ),
        notice(
            "heading",
            values={"heading": yaw, "sd": yaw_sd},
            source=heading.source,
            degrees=np.degrees(yaw) % 360.0,
            sd_deg=np.degrees(yaw_sd),
        ),
    )
    sd = InitialSd(velocity=rest_sd or 1.0, tilt=tilt_sd, heading=yaw_sd)
    state = _state(measured, fix, C, sd, still)
    found = Alignment(epoch, *state, np.zeros(3), None, notices)
    if not still:
        return found
    earth = C.T @ np.array([RATE * np.cos(lat), 0.0, -RATE * np.sin(lat)])
    bias_sd = float(np.hypot(gyro_sd, RATE * np.hypot(yaw_sd, tilt_sd)))
    return replace(found, gyro_bias=bias - earth, gyro_bias_sd=bias_sd, stood=length)


def mean_sd(models: SensorModels, kind: str, length: float, dt: float) -> float:
    """Standard deviation of a later error less its mean over a time, s; the worst axis."""
    own, tau = [axis for axis in AXES if axis.startswith(kind)], np.array([length])
    variances = [float(models.models[axis].haar_variance(tau, dt)[0]) for axis in own]
    # The Allan variance, twice the Haar one, is half the mean square of such a difference.
    return float(np.sqrt(4.0 * max(variances)))


def biased_sd(models: SensorModels, kind: str, length: float, dt: float) -> float:
    """The same with the turn-on bias."""
    bias = max(models.bias_sd[axis] for axis in AXES if axis.startswith(kind))
    return float(np.hypot(bias, mean_sd(models, kind, length, dt)))


def _tilt_sd(models: SensorModels, length: float, dt: float) -> float:
    """Standard deviation of the tilt of levelling at rest, rad."""
    errors = []
    for axis in (axis for axis in AXES if axis.startswith("accel")):
        form = models.models[axis].state_space(dt)
        errors.append(float(np.sqrt(form.output @ form.initial_covariance @ form.output)))
    error = np.hypot(max(errors), biased_sd(models, "accel", length, dt))
    return float(np.hypot(error / STANDARD_GRAVITY, tuning.TILT_FLOOR))


def started(measured: Measured, alignment: Alignment) -> tuple[Imu, Aiding]:
    """Increments and fixes after the initial state, with the gyros' bias subtracted."""
    imu, aiding = measured.imu, measured.aiding
    first, bias = alignment.epoch, alignment.gyro_bias * imu.dt
    fixes = []
    for each in aiding.fixes:
        shifted = replace(each, time=each.time - first * imu.dt)
        # Fixes of the first epoch made the initial state.
        fixes.append(shifted.part(shifted.time > 0.5 * imu.dt))
    given = imu.rotation[first:]
    rotation = alike(given, given.size).reshape(-1, 3)
    for part in windows(len(given)):
        rotation[part] = given[part] - bias
        release(given)
        release(rotation)
    return Imu(imu.dt, rotation, imu.velocity[first:]), replace(aiding, fixes=tuple(fixes))
