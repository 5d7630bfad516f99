"""Increments of an IMU: emulated along a trajectory, and preintegrated between keyframes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.linalg import block_diag

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.ins.geometry import (
    ECCENTRICITY_SQUARED,
    RATE,
    gravity_along,
    matrix_from_rotation_vector,
    radii_along,
    skew,
)
from gmwm.ins.sensors import AXES, SensorModels
from gmwm.ins.trajectory.trajectory import (
    Trajectory,
    check_latitudes,
    coefficients,
    finite_numbers,
    finite_rows,
    unwrapped_angles,
    unwrapped_longitudes,
)
from gmwm.process import block_diagonal

Start = Literal["known", "stationary"]

# Gauss-Legendre rules on [0, 1]: of three points for splines, exact for polynomials of degree 5; of
# five for turns of a radian a step, exact to rounding.
_NODES = (0.5 - math.sqrt(0.15), 0.5, 0.5 + math.sqrt(0.15))
_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
_FIVE_NODES, _FIVE_WEIGHTS = np.polynomial.legendre.leggauss(5)
_FIVE_NODES, _FIVE_WEIGHTS = 0.5 * (_FIVE_NODES + 1.0), 0.5 * _FIVE_WEIGHTS
_ROWS = 4096  # at a time: all that is computed of them stays in the processor's cache
_INCREMENTS = tuple(f"{what} {x}" for what in ("rotation", "velocity", "position") for x in "xyz")


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
        object.__setattr__(self, "dt", checks.sampling_interval(self.dt))
        hint = "rotation and velocity one row of 3 numbers for each interval"
        rotation = finite_rows(self.rotation, "rotation", hint)
        velocity = finite_rows(self.velocity, "velocity", hint, n=len(rotation))
        object.__setattr__(self, "rotation", rotation)
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


# -- preintegration -------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Preintegration:
    """Increments between two keyframes, in the body axes of the first.

    Errors are what is measured less what is true; that of the rotation is a vector in the body
    axes of the second keyframe, ``measured = true exp([error cross])``.

    Attributes
    ----------
    duration : float
        s.
    rotation : (3, 3) ndarray
        Takes vectors from the body axes of the second keyframe to those of the first.
    velocity : (3,) ndarray
        Integral of the specific force, m/s.
    position : (3,) ndarray
        Its second integral, m.
    covariance : (9 + m, 9 + m) ndarray
        Of the errors of rotation (rad), velocity (m/s) and position (m), and of the sensors'
        states at the second keyframe, given those at the first or with their covariance.
    jacobian : (9 + m, m) ndarray
        Derivative of the same errors with respect to the sensors' states at the first keyframe.
    states : tuple of str
        Their names: nine, then those of the sensors, gyro x to accelerometer z.
    """

    duration: float
    rotation: FloatArray
    velocity: FloatArray
    position: FloatArray
    covariance: FloatArray
    jacobian: FloatArray
    states: tuple[str, ...]


def preintegrate(
    imu: Imu,
    models: SensorModels | Calibration | Mapping[str, Any],
    start: Start | FloatArray = "known",
) -> Preintegration:
    """Preintegrate increments, with the exact covariance of a composite error model.

    Raises InputError if an axis has no model, a term has no state space, or ``start`` has another
    shape.

    Parameters
    ----------
    imu : Imu
        Increments between the two keyframes, less known biases.
    models : SensorModels, Calibration or mapping
        One model an axis, as `SensorModels.of` takes them; each may have any number of states.
    start : {"known", "stationary"} or (m, m) ndarray, optional
        Covariance of the sensors' states at the first keyframe. "known": zero, where they are
        variables of the factor graph, as the biases of a combined IMU factor are. "stationary":
        that which the models have by themselves, zero for random walks; the increments alone then
        make a factor that knows of no states.

    Notes
    -----
    The error of each sample is H x + v, with x[k+1] = F x[k] + w the exact samples of the models.
    The usual covariance (Forster et al. 2017, *IEEE Trans. Robotics* 33(1), 1-21) knows white noise
    and a random walk; here slow terms correlate the increments of all pairs of keyframes. Rate and
    specific force are constant within a step in body axes; turns within a step count in
    full. To first order in the errors nothing else is approximated. The mean of a rate ramp is no
    variance: take it off the increments.
    """
    models = SensorModels.of(models)
    parts = [models.models[axis].state_space(imu.dt) for axis in AXES]
    m = sum(part.n_states for part in parts)
    output = block_diag(*[part.output[None, :] for part in parts]) if m else np.zeros((6, 0))
    white = np.diag([part.measurement_noise for part in parts])
    drive, transition, stationary = (
        block_diagonal([getattr(part, name) for part in parts])
        for name in ("process_noise", "transition", "initial_covariance")
    )
    dt, (turns, mean, half, by_mean, by_half) = imu.dt, _steps(imu)
    rotation, velocity, position = np.eye(3), np.zeros(3), np.zeros(3)
    covariance = np.zeros((9 + m, 9 + m))
    if isinstance(start, str):
        if checks.choice("start", start, ("known", "stationary")) == "stationary":
            covariance[9:, 9:] = stationary
    else:
        given = checks.real_numbers(start, "start")
        if given.shape != stationary.shape:
            raise InputError(
                f"start has shape {given.shape}: give the {m} x {m} covariance of the sensors' "
                "states"
            )
        covariance[9:, 9:] = given
    jacobian = np.eye(9 + m)[:, 9:]
    A, B, Q = np.eye(9 + m), np.zeros((9, 6)), np.zeros((9 + m, 9 + m))
    A[9:, 9:], A[6:9, 3:6], Q[9:, 9:] = transition, dt * np.eye(3), drive
    for k in range(imu.n):
        G1, G2, u = mean[k], half[k], imu.velocity[k]
        A[:3, :3] = turns[k].T
        A[3:6, :3] = -rotation @ skew(G1 @ u)
        A[6:9, :3] = -rotation @ skew(G2 @ u) * dt
        B[:3, :3] = G1.T * dt
        B[3:6, :3], B[3:6, 3:] = rotation @ by_mean[k] * dt, rotation @ G1 * dt
        B[6:, :3], B[6:, 3:] = rotation @ by_half[k] * dt**2, rotation @ G2 * dt**2
        A[:9, 9:] = B @ output
        covariance = A @ covariance @ A.T + Q
        covariance[:9, :9] += B @ white @ B.T
        jacobian = A @ jacobian
        position = position + velocity * dt + rotation @ G2 @ u * dt
        velocity = velocity + rotation @ G1 @ u
        rotation = rotation @ turns[k]
    pairs = zip(AXES, parts, strict=True)
    names = (*_INCREMENTS, *(f"{axis} {name}" for axis, part in pairs for name in part.names))
    covariance = 0.5 * (covariance + covariance.T)
    increments = (rotation, velocity, position)
    return Preintegration(imu.n * dt, *increments, covariance, jacobian, names)


def _steps(imu: Imu) -> tuple[FloatArray, ...]:
    """Effects of the samples, (n, 3, 3) each.

    For a rotation vector r and a velocity increment u: turn exp(r), mean turn G1, G2 for the
    position, and the derivatives of G1 u and G2 u to r.
    """
    part = matrix_from_rotation_vector(_FIVE_NODES[:, None, None] * imu.rotation)  # exp(s r)
    mean = np.einsum("s,snij->nij", _FIVE_WEIGHTS, part)
    half = np.einsum("s,snij->nij", _FIVE_WEIGHTS * (1.0 - _FIVE_NODES), part)
    # Integral of exp(-q r) over q from 0 to s: the right Jacobian of s r, times s.
    products = np.multiply.outer(_FIVE_NODES, _FIVE_NODES)[:, :, None, None] * imu.rotation
    right = np.einsum("q,sqnij->snij", _FIVE_WEIGHTS, matrix_from_rotation_vector(-products))
    inner = part @ skew(imu.velocity) @ (_FIVE_NODES[:, None, None, None] * right)
    by_mean = -np.einsum("s,snij->nij", _FIVE_WEIGHTS, inner)
    by_half = -np.einsum("s,snij->nij", _FIVE_WEIGHTS * (1.0 - _FIVE_NODES), inner)
    return matrix_from_rotation_vector(imu.rotation), mean, half, by_mean, by_half
