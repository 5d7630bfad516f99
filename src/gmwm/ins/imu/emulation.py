"""Emulated IMUs: the increments that error-free sensors would give along a trajectory."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gmwm._core.checks import sampling_interval
from gmwm._core.typing import FloatArray
from gmwm.ins.geometry import ECCENTRICITY_SQUARED, RATE, gravity_along, radii_along
from gmwm.ins.trajectory import (
    Trajectory,
    check_latitudes,
    coefficients,
    finite_numbers,
    finite_rows,
    unwrapped_angles,
    unwrapped_longitudes,
)

# Gauss-Legendre rule of three points on [0, 1]: exact for polynomials of degree 5.
_NODES = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
_ROWS = 4096  # at a time: all that is computed of them stays in the processor's cache


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
        hint = "rotation and velocity one row of 3 numbers for each interval"
        rotation = finite_rows(self.rotation, "rotation", hint)
        object.__setattr__(self, "rotation", rotation)
        velocity = finite_rows(self.velocity, "velocity", hint, n=len(rotation))
        object.__setattr__(self, "velocity", velocity)

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
        hint = f"one row of 3 numbers for each of the {self.n:,} intervals"
        gyro = finite_rows(gyro_errors, "gyro_errors", hint, n=self.n)
        accel = finite_rows(accel_errors, "accel_errors", hint, n=self.n)
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
    # Relative to the first epoch fewer digits are lost in the second differences.
    dt, n = trajectory.dt, trajectory.n
    track, attitude = coefficients(lla - lla[0], dt), coefficients(rpy, dt)
    rotation, velocity = np.zeros((n, 3)), np.zeros((n, 3))
    for first in range(0, n, _ROWS):
        part = slice(first, first + _ROWS)
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            rate, force = _sensed(track[..., part], lla[0], attitude[..., part], node * dt)
            rotation[part] += weight * dt * rate
            velocity[part] += weight * dt * force
    return Imu(dt, rotation, velocity)


def _sensed(
    track: FloatArray, start: FloatArray, attitude: FloatArray, t: float
) -> tuple[FloatArray, FloatArray]:
    """Angular rate, rad/s, and specific force, m/s^2, (n, 3), some time into each interval."""
    (lat, _, h), (lat_rate, lon_rate, h_rate), (lat_turn, lon_turn, h_turn) = _cubic(track, t)
    lat, h = start[0] + lat, start[2] + h
    s, c = np.sin(lat), np.cos(lat)
    meridian, transverse = radii_along(lat)
    shrink = ECCENTRICITY_SQUARED * s * c / (1.0 - ECCENTRICITY_SQUARED * s * s) * lat_rate
    meridian_rate = 3.0 * meridian * shrink + h_rate
    transverse_rate = transverse * shrink + h_rate
    meridian, transverse = meridian + h, transverse + h

    vn, ve, vd = meridian * lat_rate, transverse * c * lon_rate, -h_rate
    an = meridian_rate * lat_rate + meridian * lat_turn
    ae = (transverse_rate * c - transverse * s * lat_rate) * lon_rate + transverse * c * lon_turn
    # The frame turns with the vehicle: (RATE + lon_rate) about the Earth's axis, lat_rate westward.
    wn, we, wd = (RATE + lon_rate) * c, -lat_rate, -(RATE + lon_rate) * s
    cn, cd = wn + RATE * c, wd - RATE * s
    fn = an + we * vd - cd * ve
    fe = ae + cd * vn - cn * vd
    fd = -h_turn + cn * ve - we * vn - gravity_along(lat, h)

    angles, (roll_rate, pitch_rate, yaw_rate), _ = _cubic(attitude, t)
    (sr, sp, sy), (cr, cp, cy) = np.sin(angles), np.cos(angles)

    def to_body(n: FloatArray, e: FloatArray, d: FloatArray) -> FloatArray:
        """Resolve a vector in body axes: yaw, then pitch, then roll."""
        x, y = cy * n + sy * e, cy * e - sy * n
        below = sp * x + cp * d
        return np.stack([cp * x - sp * d, cr * y + sr * below, cr * below - sr * y], axis=-1)

    rate = to_body(wn, we, wd)
    rate[:, 0] += roll_rate - yaw_rate * sp
    rate[:, 1] += pitch_rate * cr + yaw_rate * cp * sr
    rate[:, 2] += -pitch_rate * sr + yaw_rate * cp * cr
    return rate, to_body(fn, fe, fd)


def _cubic(c: FloatArray, t: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Values, first and second derivatives, (3, n), of cubics (4, 3, n)."""
    a, b, c2, c3 = c
    return (
        a + t * (b + t * (c2 + t * c3)),
        b + t * (2.0 * c2 + t * 3.0 * c3),
        2.0 * c2 + t * 6.0 * c3,
    )
