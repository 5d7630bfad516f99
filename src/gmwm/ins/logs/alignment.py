"""Where a filter of real data starts: position, level, heading, and how well they are known.

Levelling and gyrocompassing after Groves (2013), secs. 5.6.2 and 5.6.3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gmwm._core.spool import Spool, is_spooled, release, windows
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.filter import Aiding, InitialSd
from gmwm.ins.geometry import (
    RATE,
    STANDARD_GRAVITY,
    matrix_from_rpy,
    offset,
    rpy_from_matrix,
)
from gmwm.ins.imu import AXES, Imu, SensorModels
from gmwm.ins.logs import tuning
from gmwm.ins.logs.attitude import (
    Heading,
    attitude_in_motion,
    gyrocompass,
    heading_from_course,
    positions_of,
    steady,
    turned,
    velocities_between,
    velocity_at_rest,
)
from gmwm.ins.logs.measured import Measured
from gmwm.ins.trajectory import NavState
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

    The heading is the given one, the course of GNSS once the vehicle moves, or that of the Earth's
    rotation if the gyros show it. A vehicle without a given attitude is levelled while steady; if
    it never is, the attitude follows from changes of its velocity.

    Raises InputError if there is no fix, no steady stretch or acceleration to level by, or no way
        to know the heading.
    """
    imu, models, attitude = measured.imu, measured.sensors, measured.attitude
    stretch = steady(imu) if attitude is None else None
    if stretch is not None:
        return _levelled(measured, stretch)
    fix, epoch = _first_fix(measured)
    if attitude is not None:
        values = {"attitude": list(attitude), "sd": measured.attitude_sd}
        degrees = ", ".join(f"{each:.2f}" for each in np.degrees(attitude))
        sd_deg = np.degrees(measured.attitude_sd)
        how = notice("attitude-given", values=values, degrees=degrees, sd_deg=sd_deg)
        C, tilt_sd = matrix_from_rpy(np.asarray(attitude)), measured.attitude_sd
        yaw_sd = tilt_sd
    else:
        gyro_sd, accel_sd = (
            biased_sd(models, kind, tuning.MOTION_LEAST, imu.dt) for kind in ("gyro", "accel")
        )
        place = positions_of(measured.aiding).value[fix]
        C, sd = attitude_in_motion(imu, measured.aiding, epoch, place, (gyro_sd, accel_sd))
        tilt_sd, yaw_sd = float(np.max(sd[:2])), float(sd[2])
        roll, pitch, yaw = np.degrees(rpy_from_matrix(C))
        how = notice(
            "aligned-in-motion",
            values={"tilt": tilt_sd, "heading": yaw_sd},
            roll=roll,
            pitch=pitch,
            yaw=yaw % 360.0,
            tilt_deg=np.degrees(tilt_sd),
            heading_deg=np.degrees(yaw_sd),
        )
    state = _state(measured, fix, C, InitialSd(tilt=tilt_sd, heading=yaw_sd))
    return Alignment(epoch, *state, np.zeros(3), None, (how,))


def _first_fix(measured: Measured, first: int = 0) -> tuple[int, int]:
    """Number of the first position fix from an epoch on, and its epoch."""
    time, dt = positions_of(measured.aiding).time, measured.imu.dt
    fix = int(np.searchsorted(time, (first - 0.5) * dt))
    if fix == time.size:
        raise InputError("there is no position fix once the IMU is steady: give later ones")
    return fix, int(np.rint(time[fix] / dt))


def _state(
    measured: Measured, fix: int, C: FloatArray, sd: InitialSd, is_at_rest: bool = False
) -> tuple[NavState, InitialSd]:
    """State at a position fix; completes ``sd``, but for the velocity of a vehicle at rest."""
    positions, dt = positions_of(measured.aiding), measured.imu.dt
    now = np.rint(positions.time[fix] / dt) * dt
    velocity = np.zeros(3)
    if not is_at_rest:
        velocity, velocity_sd = _velocity(measured.aiding, fix, now, dt)
        sd = replace(sd, velocity=velocity_sd)
    later = velocity * (now - positions.time[fix])
    lla = offset(positions.value[fix], later - C @ np.asarray(measured.aiding.lever_arm))
    sd = replace(sd, position=float(np.sqrt(np.mean(positions.sd[fix] ** 2))))
    return NavState(lla, velocity, rpy_from_matrix(C)), sd


def _velocity(aiding: Aiding, fix: int, now: float, dt: float) -> tuple[FloatArray, float]:
    """Velocity and its standard deviation: of a fix, or of the way to the next position."""
    velocity = aiding.of("velocity")
    if velocity is not None:
        i = int(np.argmin(np.abs(velocity.time - now)))
        if abs(velocity.time[i] - now) < dt:
            return velocity.value[i], float(np.sqrt(np.mean(velocity.sd[i] ** 2)))
    positions = positions_of(aiding)
    since = positions.time - positions.time[fix]
    near = positions.part((since >= 0.0) & (since <= tuning.CHORD))
    way = velocities_between(near)
    if not way.time.size:
        raise InputError("no other fix near the first position fix: start where fixes are frequent")
    # The vehicle may speed up by 1 m/s^2 on the way.
    faster = 0.5 * float(near.time[1] - near.time[0])
    return way.value[0], float(np.hypot(np.sqrt(np.mean(way.sd[0] ** 2)), faster))


def _levelled(measured: Measured, stretch: tuple[int, int]) -> Alignment:
    """A start that is levelled on a steady stretch, with a given heading or one from the data."""
    imu, aiding, models = measured.imu, measured.aiding, measured.sensors
    first, last = stretch
    length = (last - first) * imu.dt
    rest_sd = velocity_at_rest(aiding, imu.dt, first, last)
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
    tilt_sd = float(
        np.hypot(_tilt_sd(models, length, imu.dt, still), drift * (epoch - levelled) * imu.dt)
    )
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


def _bias(models: SensorModels, kind: str) -> float:
    return max(models.bias_sd[axis] for axis in AXES if axis.startswith(kind))


def mean_sd(models: SensorModels, kind: str, length: float, dt: float) -> float:
    """Standard deviation of a later error less its mean over a time, s; the worst axis."""
    own, tau = [axis for axis in AXES if axis.startswith(kind)], np.array([length])
    variances = [float(models.models[axis].haar_variance(tau, dt)[0]) for axis in own]
    # The Allan variance, twice the Haar one, is half the mean square of such a difference.
    return float(np.sqrt(4.0 * max(variances)))


def biased_sd(models: SensorModels, kind: str, length: float, dt: float) -> float:
    """The same with the turn-on bias."""
    return float(np.hypot(_bias(models, kind), mean_sd(models, kind, length, dt)))


def _tilt_sd(models: SensorModels, length: float, dt: float, still: bool) -> float:
    """Standard deviation of the tilt of levelling, rad."""
    errors = []
    for axis in (axis for axis in AXES if axis.startswith("accel")):
        form = models.models[axis].state_space(dt)
        errors.append(float(np.sqrt(form.output @ form.initial_covariance @ form.output)))
    error = np.hypot(max(errors), biased_sd(models, "accel", length, dt))
    sd = np.hypot(error / STANDARD_GRAVITY, tuning.TILT_FLOOR)
    return float(sd if still else np.hypot(sd, tuning.TILT_MOVING))


def started(measured: Measured, alignment: Alignment) -> tuple[Imu, Aiding]:
    """Increments and fixes after the initial state, with the gyros' bias subtracted."""
    imu, aiding = measured.imu, measured.aiding
    first, bias = alignment.epoch, alignment.gyro_bias * imu.dt
    fixes = []
    for each in aiding.fixes:
        shifted = replace(each, time=each.time - first * imu.dt)
        # Fixes of the first epoch made the initial state.
        fixes.append(shifted.part(shifted.time > 0.5 * imu.dt))
    rotation = imu.rotation[first:]
    if is_spooled(rotation):
        spool = Spool(3)
        for part in windows(len(rotation)):
            spool.append(rotation[part] - bias)
            release(rotation)
        rotation = spool.array()
    else:
        rotation = rotation - bias
    return Imu(imu.dt, rotation, imu.velocity[first:]), replace(aiding, fixes=tuple(fixes))
