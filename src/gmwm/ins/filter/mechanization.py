"""Strapdown mechanization: attitude, velocity and position from the increments of an IMU."""

from __future__ import annotations

import math

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.ins.filter.records import Increments, Kinematics, Samples
from gmwm.ins.geometry import (
    RATE,
    SEMI_MAJOR_AXIS,
    gravity_at,
    matrix_from_rpy,
    orthonormalise,
    radii_at,
    rotate,
    rotation_coefficients,
    rpy_from_matrix,
    turn_navigation,
)
from gmwm.ins.imu import Imu
from gmwm.ins.trajectory import NavState, Trajectory, check_latitudes

_CLEAN_EVERY = 1000  # samples: rounding errors of the attitude matrix stay below 1e-13


@compiled()
def step(
    at: Kinematics, now: Increments, before: Increments, dt: float
) -> tuple[float, float, float]:
    """Propagate attitude, velocity and position over one sampling interval, in place.

    Coning and sculling are corrected with the increments of the interval before, as if rate and
    specific force changed linearly; on the first interval, give its own increments as those before.
    Returns the integral of the specific force over the interval, m/s, north, east and down.

    Savage (1998), Strapdown inertial navigation integration algorithm design, J. Guid. Control
    Dyn. 21: coning from Part 1, rotation and sculling of the velocity from Part 2, both with the
    interval before instead of subintervals. Rotation of the frame, Coriolis and gravity are those
    at the middle of the interval (Groves 2013, ch. 5); the position follows the trapezoidal rule.
    """
    C, v, lla = at
    ax, ay, az, fx, fy, fz = now
    ax_before, ay_before, az_before, fx_before, fy_before, fz_before = before
    # Rotation vector of the body.
    rx = ax + (ay_before * az - az_before * ay) / 12.0
    ry = ay + (az_before * ax - ax_before * az) / 12.0
    rz = az + (ax_before * ay - ay_before * ax) / 12.0

    # Integrated specific force in the body axes of the beginning.
    sine, half, sixth = rotation_coefficients(rx * rx + ry * ry + rz * rz)
    px, py, pz = ay * fz - az * fy, az * fx - ax * fz, ax * fy - ay * fx
    sx = ay_before * fz - az_before * fy + fy_before * az - fz_before * ay
    sy = az_before * fx - ax_before * fz + fz_before * ax - fx_before * az
    sz = ax_before * fy - ay_before * fx + fx_before * ay - fy_before * ax
    bx = fx + half * px + sixth * (ay * pz - az * py) + sx / 12.0
    by = fy + half * py + sixth * (az * px - ax * pz) + sy / 12.0
    bz = fz + half * pz + sixth * (ax * py - ay * px) + sz / 12.0
    un = C[0, 0] * bx + C[0, 1] * by + C[0, 2] * bz
    ue = C[1, 0] * bx + C[1, 1] * by + C[1, 2] * bz
    ud = C[2, 0] * bx + C[2, 1] * by + C[2, 2] * bz

    # The middle of the interval; on a sphere, and without acceleration, is good enough for it.
    half_dt = 0.5 * dt
    lat = lla[0] + half_dt * v[0] / SEMI_MAJOR_AXIS
    h = lla[2] - half_dt * v[2]
    s, c = math.sin(lat), math.cos(lat)
    meridian, transverse = radii_at(s)
    to_lat = 1.0 / (meridian + h)
    to_east = 1.0 / (transverse + h)
    per_c = 1.0 / c
    g = gravity_at(s, h) * dt
    vn, ve, vd = v[0] + 0.5 * un, v[1] + 0.5 * ue, v[2] + 0.5 * (ud + g)

    # Rotation of the navigation frame over the interval, and the Earth's part of it.
    en, ed = RATE * c * dt, -RATE * s * dt
    zn = en + ve * to_east * dt
    ze = -vn * to_lat * dt
    zd = ed - ve * to_east * s * per_c * dt

    # The frame has turned by half of it when the specific force is resolved.
    fn = un - 0.5 * (ze * ud - zd * ue)
    fe = ue - 0.5 * (zd * un - zn * ud)
    fd = ud - 0.5 * (zn * ue - ze * un)
    end_n = v[0] + fn - (ze * vd - (zd + ed) * ve)
    end_e = v[1] + fe - ((zd + ed) * vn - (zn + en) * vd)
    end_d = v[2] + fd + g - ((zn + en) * ve - ze * vn)

    lla[0] += half_dt * (v[0] + end_n) * to_lat
    lla[1] += half_dt * (v[1] + end_e) * to_east * per_c
    lla[2] -= half_dt * (v[2] + end_d)
    v[0], v[1], v[2] = end_n, end_e, end_d
    rotate(C, rx, ry, rz, sine, half)
    turn_navigation(C, zn, ze, zd)
    return fn, fe, fd


@compiled()
def _run(
    samples: Samples, at: Kinematics, lla: FloatArray, velocity: FloatArray, C: FloatArray
) -> None:
    """Fill the epochs after the first one, where the solution is ``at``."""
    a, f = samples.rotation, samples.velocity
    now = Increments(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(a.shape[0]):
        before = now
        now = Increments(a[i, 0], a[i, 1], a[i, 2], f[i, 0], f[i, 1], f[i, 2])
        step(at, now, now if i == 0 else before, samples.dt)
        if (i + 1) % _CLEAN_EVERY == 0:
            orthonormalise(at.C)
        lla[i + 1], velocity[i + 1], C[i + 1] = at.lla, at.v, at.C


def integrate(imu: Imu, initial: NavState) -> Trajectory:
    """Free inertial navigation: nothing but an IMU and where it started.

    The n increments give n + 1 epochs; roll and yaw are within [-pi, pi], the longitude runs on
    past 180 deg. The height of an unaided navigator is unstable: an error grows by a factor e in
    about 570 s.

    Raises InputError if it starts closer than 1 deg to a pole, where north cannot be steered by.
    """
    check_latitudes(initial.lla[None, :], "initial")
    lla, velocity = np.empty((imu.n + 1, 3)), np.empty((imu.n + 1, 3))
    matrix = np.empty((imu.n + 1, 3, 3))
    lla[0], velocity[0], matrix[0] = initial.lla, initial.velocity, matrix_from_rpy(initial.rpy)
    at = Kinematics(matrix[0].copy(), initial.velocity.copy(), initial.lla.copy())
    _run(Samples(imu.rotation, imu.velocity, imu.dt), at, lla, velocity, matrix)
    rpy = rpy_from_matrix(matrix)
    rpy[0] = initial.rpy
    return Trajectory(imu.dt, lla, velocity, rpy)
