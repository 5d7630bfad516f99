"""Emulated IMUs: the increments that error-free sensors would give along a trajectory."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gmwm._core.checks import sampling_interval
from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.geometry import ECCENTRICITY_SQUARED, RATE, gravity_at, radii_at
from gmwm.ins.trajectory import (
    Trajectory,
    check_latitudes,
    coefficients,
    finite_numbers,
    unwrapped_angles,
    unwrapped_longitudes,
)

# Gauss-Legendre rule of three points on [0, 1]: exact for polynomials of degree 5.
_NODES = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)


@dataclass(frozen=True, eq=False)
class Imu:
    """Increments of three gyros and three accelerometers.

    Attributes
    ----------
    dt : float
        Sampling interval, s.
    rotation : (n, 3) ndarray
        Integral of the inertial angular rate over each interval, body axes, rad.
    velocity : (n, 3) ndarray
        Integral of the specific force over each interval, body axes, m/s.
    """

    dt: float
    rotation: FloatArray
    velocity: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "dt", sampling_interval(self.dt))
        for name in ("rotation", "velocity"):
            values = finite_numbers(getattr(self, name), name)
            if values.ndim != 2 or values.shape[1] != 3 or len(values) != len(self.rotation):
                raise InputError(
                    f"{name} has shape {values.shape}: give rotation and velocity one row of 3 "
                    "numbers for each interval"
                )
            object.__setattr__(self, name, values)

    @property
    def n(self) -> int:
        """Number of sampling intervals."""
        return len(self.rotation)

    @property
    def rate(self) -> float:
        """Sampling rate, Hz."""
        return 1.0 / self.dt

    def with_errors(self, gyro_errors: FloatArray, accel_errors: FloatArray) -> Imu:
        """The same IMU with errors added.

        Raises InputError if a shape differs from that of the increments.

        Parameters
        ----------
        gyro_errors : (n, 3) ndarray
            rad/s, mean over each interval, body axes.
        accel_errors : (n, 3) ndarray
            m/s^2.
        """
        gyro = finite_numbers(gyro_errors, "gyro_errors")
        accel = finite_numbers(accel_errors, "accel_errors")
        for name, values in (("gyro_errors", gyro), ("accel_errors", accel)):
            if values.shape != self.rotation.shape:
                raise InputError(
                    f"{name} has shape {values.shape}: give one row of 3 numbers for each of the "
                    f"{self.n:,} intervals"
                )
        return Imu(self.dt, self.rotation + self.dt * gyro, self.velocity + self.dt * accel)


def emulate(trajectory: Trajectory) -> Imu:
    """Increments of error-free sensors along a trajectory on the rotating Earth.

    Cubic splines go through latitude, longitude, height and through roll, pitch, yaw. Angular rate
    and specific force follow from their derivatives, without any mechanization, and are integrated
    over each interval in the axes of the turning body. The trajectory's velocity is not used.

    Raises InputError if it comes closer than 1 deg to a pole, or if its angles turn by more than 90
    deg from epoch to epoch.

    Notes
    -----
    Groves (2013), *Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems*,
    2nd ed., ch. 2 (rates of Euler angles) and ch. 5 (rate of the velocity).
    """
    lla = unwrapped_longitudes(finite_numbers(trajectory.lla, "lla"))
    check_latitudes(lla, "lla")
    rpy = unwrapped_angles(finite_numbers(trajectory.rpy, "rpy"))
    rotation, velocity = np.empty((trajectory.n, 3)), np.empty((trajectory.n, 3))
    dt = trajectory.dt
    # Relative to the first epoch fewer digits are lost in the second differences.
    _fill(coefficients(lla - lla[0], dt), lla[0], coefficients(rpy, dt), dt, rotation, velocity)
    return Imu(dt, rotation, velocity)


@compiled()
def _fill(
    track: FloatArray,
    start: FloatArray,
    attitude: FloatArray,
    dt: float,
    rotation: FloatArray,
    velocity: FloatArray,
) -> None:
    """Integrate over each interval; polynomials as of `splines.coefficients`."""
    for i in range(track.shape[0]):
        for j in range(3):
            rotation[i, j] = velocity[i, j] = 0.0
        for k in range(3):
            t, weight = _NODES[k] * dt, _WEIGHTS[k] * dt
            wx, wy, wz, fx, fy, fz = _sensed(track[i], start, attitude[i], t)
            rotation[i, 0] += weight * wx
            rotation[i, 1] += weight * wy
            rotation[i, 2] += weight * wz
            velocity[i, 0] += weight * fx
            velocity[i, 1] += weight * fy
            velocity[i, 2] += weight * fz


@compiled()
def _sensed(
    track: FloatArray, start: FloatArray, attitude: FloatArray, t: float
) -> tuple[float, float, float, float, float, float]:
    """Angular rate, rad/s, and specific force, m/s^2, in body axes at one time."""
    lat, lat_rate, lat_turn = _polynomial(track[0], t)
    _, lon_rate, lon_turn = _polynomial(track[1], t)
    h, h_rate, h_turn = _polynomial(track[2], t)
    s, c = math.sin(start[0] + lat), math.cos(start[0] + lat)
    h += start[2]
    meridian, transverse = radii_at(s)
    shrink = ECCENTRICITY_SQUARED * s * c / (1.0 - ECCENTRICITY_SQUARED * s * s) * lat_rate
    meridian_rate = 3.0 * meridian * shrink + h_rate
    transverse_rate = transverse * shrink + h_rate
    meridian += h
    transverse += h

    vn, ve, vd = meridian * lat_rate, transverse * c * lon_rate, -h_rate
    an = meridian_rate * lat_rate + meridian * lat_turn
    ae = (transverse_rate * c - transverse * s * lat_rate) * lon_rate + transverse * c * lon_turn
    # The frame turns with the vehicle: (RATE + lon_rate) about the Earth's axis, lat_rate westward.
    wn, we, wd = (RATE + lon_rate) * c, -lat_rate, -(RATE + lon_rate) * s
    cn, cd = wn + RATE * c, wd - RATE * s
    fn = an + we * vd - cd * ve
    fe = ae + cd * vn - cn * vd
    fd = -h_turn + cn * ve - we * vn - gravity_at(s, h)

    roll, roll_rate, _ = _polynomial(attitude[0], t)
    pitch, pitch_rate, _ = _polynomial(attitude[1], t)
    yaw, yaw_rate, _ = _polynomial(attitude[2], t)
    sr, cr = math.sin(roll), math.cos(roll)
    sp, cp = math.sin(pitch), math.cos(pitch)
    sy, cy = math.sin(yaw), math.cos(yaw)
    wx, wy, wz = _to_body(wn, we, wd, sr, cr, sp, cp, sy, cy)
    fx, fy, fz = _to_body(fn, fe, fd, sr, cr, sp, cp, sy, cy)
    wx += roll_rate - yaw_rate * sp
    wy += pitch_rate * cr + yaw_rate * cp * sr
    wz += -pitch_rate * sr + yaw_rate * cp * cr
    return wx, wy, wz, fx, fy, fz


@compiled()
def _polynomial(c: FloatArray, t: float) -> tuple[float, float, float]:
    """Value, first and second derivative of a cubic."""
    value = c[0] + t * (c[1] + t * (c[2] + t * c[3]))
    return value, c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]), 2.0 * c[2] + t * 6.0 * c[3]


@compiled()
def _to_body(
    n: float, e: float, d: float, sr: float, cr: float, sp: float, cp: float, sy: float, cy: float
) -> tuple[float, float, float]:
    """Resolve a vector of the navigation frame in body axes, given sines and cosines."""
    # Yaw, then pitch, then roll.
    x, y = cy * n + sy * e, cy * e - sy * n
    forward, below = cp * x - sp * d, sp * x + cp * d
    return forward, cr * y + sr * below, cr * below - sr * y
