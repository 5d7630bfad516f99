"""Where a filter of real data starts: position, level, heading, and how well they are known.

Levelling and gyrocompassing after Groves (2013), secs. 5.6.2 and 5.6.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gmwm._core.spool import Spool, is_spooled, release, windows
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.filter import Aiding, InitialSd
from gmwm.ins.geometry import (
    RATE,
    STANDARD_GRAVITY,
    matrix_from_rpy,
    ned_difference,
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
    velocity_at_rest,
)
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


@dataclass(frozen=True, eq=False)
class _Start:
    """The data of an alignment, and the position fix at which the filter starts."""

    imu: Imu
    aiding: Aiding
    epoch: int
    fix: int

    @classmethod
    def of(cls, imu: Imu, aiding: Aiding, first: int = 0) -> _Start:
        """The first position fix from an epoch on."""
        positions = positions_of(aiding)
        later = np.flatnonzero(positions.time >= (first - 0.5) * imu.dt)
        if not later.size:
            raise InputError("there is no position fix once the IMU is steady: give later ones")
        fix = int(later[0])
        return cls(imu, aiding, int(np.rint(positions.time[fix] / imu.dt)), fix)

    @property
    def lla(self) -> FloatArray:
        """Position of the fix."""
        return np.asarray(positions_of(self.aiding).value[self.fix])

    def velocity(self) -> tuple[FloatArray, float]:
        """Velocity and its standard deviation: of a fix, or of the way to the next position."""
        velocity, now = self.aiding.of("velocity"), self.epoch * self.imu.dt
        if velocity is not None:
            i = int(np.argmin(np.abs(velocity.time - now)))
            if abs(velocity.time[i] - now) < self.imu.dt:
                return velocity.value[i], float(np.sqrt(np.mean(velocity.sd[i] ** 2)))
        positions = positions_of(self.aiding)
        i = int(np.argmin(np.abs(positions.time - now)))
        last = i + 1 >= positions.time.size
        if last or positions.time[i + 1] - positions.time[i] > tuning.CHORD:
            raise InputError(
                "the first position fix has no other near it: begin where fixes are dense"
            )
        step = positions.time[i + 1] - positions.time[i]
        way = ned_difference(positions.value[i + 1], positions.value[i])
        sd = np.hypot(positions.sd[i], positions.sd[i + 1]) / step
        # The vehicle may speed up by 1 m/s^2 on the way.
        return way / step, float(np.hypot(np.sqrt(np.mean(sd**2)), 0.5 * step))

    def state(
        self, C: FloatArray, tilt_sd: float, heading_sd: float, rest_sd: float | None = None
    ) -> tuple[NavState, InitialSd]:
        """The state with an attitude C_bn; ``rest_sd`` is the velocity's of a vehicle at rest."""
        velocity, sd = (np.zeros(3), rest_sd) if rest_sd is not None else self.velocity()
        positions = positions_of(self.aiding)
        later = velocity * (self.epoch * self.imu.dt - positions.time[self.fix])
        lla = offset(self.lla, later - C @ np.asarray(self.aiding.lever_arm))
        position = float(np.sqrt(np.mean(positions.sd[self.fix] ** 2)))
        return (
            NavState(lla, velocity, rpy_from_matrix(C)),
            InitialSd(position=position, velocity=sd, tilt=tilt_sd, heading=heading_sd),
        )


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

    heading, heading_sd: Forward axis at the first fix, rad from north to the east. By default the
        course of GNSS once the vehicle moves, or from the Earth's rotation if the gyros show it.
    attitude, attitude_sd: Roll, pitch and yaw at the first fix, rad. By default the vehicle is
        levelled while steady; if it never is, the attitude follows from changes of its velocity.
    Raises InputError if there is no fix, no steady stretch or acceleration to level by, or no way
        to know the heading.
    """
    positions_of(aiding)
    if attitude is None:
        stretch = steady(imu)
        if stretch is not None:
            given = None if heading is None else Heading(heading, heading_sd, "heading as given")
            return _levelled(imu, aiding, models, stretch, given)
    start = _Start.of(imu, aiding)
    if attitude is not None:
        degrees = ", ".join(f"{each:.2f}" for each in np.degrees(attitude))
        values = {"attitude": [float(each) for each in attitude], "sd": attitude_sd}
        sd_deg = np.degrees(attitude_sd)
        how = notice("attitude-given", values=values, degrees=degrees, sd_deg=sd_deg)
        C, tilt_sd, yaw_sd = matrix_from_rpy(np.asarray(attitude)), attitude_sd, attitude_sd
    else:
        length = tuning.MOTION_LEAST
        gyro_sd, accel_sd = (
            float(np.hypot(_bias(models, kind), mean_sd(models, kind, length, imu.dt)))
            for kind in ("gyro", "accel")
        )
        C, sd = attitude_in_motion(imu, aiding, start.epoch, start.lla, (gyro_sd, accel_sd))
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
    return Alignment(start.epoch, *start.state(C, tilt_sd, yaw_sd), np.zeros(3), None, (how,))


def _levelled(
    imu: Imu, aiding: Aiding, models: SensorModels, stretch: tuple[int, int], given: Heading | None
) -> Alignment:
    """A start that is levelled on a steady stretch, with a given heading or one from the data."""
    first, last = stretch
    length = (last - first) * imu.dt
    rest_sd = velocity_at_rest(aiding, imu.dt, first, last)
    still = rest_sd is not None
    rate, force = (np.mean(e[first:last], axis=0) / imu.dt for e in (imu.rotation, imu.velocity))
    bias = rate if still else np.zeros(3)
    start = _Start.of(imu, aiding, first)
    epoch, lat = start.epoch, float(start.lla[0])
    # The time of levelling is the middle of the stretch unless all of it is at rest.
    levelled = epoch if still and first <= epoch <= last else (first + last) // 2
    level = np.array(
        [np.arctan2(-force[1], -force[2]), np.arctan2(force[0], np.hypot(*force[1:])), 0]
    )
    body = turned(imu, bias, matrix_from_rpy(level), levelled, epoch)
    gyro_sd = mean_sd(models, "gyro", length, imu.dt)
    biased = float(np.hypot(gyro_sd, _bias(models, "gyro")))
    drift = gyro_sd if still else float(np.hypot(biased, RATE))
    since_levelled = (epoch - levelled) * imu.dt
    tilt_sd = float(np.hypot(_tilt_sd(models, length, imu.dt, still), drift * since_levelled))
    heading = given
    if heading is None:
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
    upright = rpy_from_matrix(body) * [1.0, 1.0, 0.0]
    C = matrix_from_rpy(np.array([0.0, 0.0, yaw])) @ matrix_from_rpy(upright)
    values = {"length": length, "start": first * imu.dt, "at rest": still}
    words: dict[str, Any] = {"how": "in steady motion", "bias": ""}
    if still:
        words = {"how": "at rest", "bias": "; the gyros' mean there is subtracted"}
    notices = [notice("levelled", values=values, **words)]
    values = {"heading": yaw, "sd": yaw_sd}
    degrees, sd_deg = np.degrees(yaw) % 360.0, np.degrees(yaw_sd)
    notices.append(
        notice("heading", values=values, source=heading.source, degrees=degrees, sd_deg=sd_deg)
    )
    state = start.state(C, tilt_sd, yaw_sd, rest_sd)
    found = Alignment(epoch, *state, bias, None, tuple(notices))
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


def _tilt_sd(models: SensorModels, length: float, dt: float, still: bool) -> float:
    """Standard deviation of the tilt of levelling, rad."""
    errors = []
    for axis in (axis for axis in AXES if axis.startswith("accel")):
        form = models.models[axis].state_space(dt)
        errors.append(float(np.sqrt(form.output @ form.initial_covariance @ form.output)))
    error = np.hypot(max(errors), mean_sd(models, "accel", length, dt))
    sd = np.hypot(np.hypot(error, _bias(models, "accel")) / STANDARD_GRAVITY, tuning.TILT_FLOOR)
    return float(sd if still else np.hypot(sd, tuning.TILT_MOVING))


def started(imu: Imu, aiding: Aiding, alignment: Alignment) -> tuple[Imu, Aiding]:
    """Increments and fixes after the initial state, with the gyros' bias subtracted."""
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
