"""Preintegrated increments of an IMU and their exact covariance with any composite error model.

The usual covariance (Forster et al. 2017, *IEEE Trans. Robotics* 33(1), 1-21) knows white noise and
a random walk; here slow terms of any model correlate the increments of all pairs of keyframes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.linalg import block_diag

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.ins.geometry import matrix_from_rotation_vector, skew
from gmwm.ins.imu.emulation import Imu
from gmwm.ins.imu.sensors import AXES, SensorModels
from gmwm.process import block_diagonal

Start = Literal["known", "stationary"]

_NAMES = tuple(f"{what} {axis}" for what in ("rotation", "velocity", "position") for axis in "xyz")

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
# On [0, 1]: exact to rounding for turns of a radian a step.
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS


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
    Rate and specific force are constant within a step in body axes; turns within a step count in
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
                f"start has shape {given.shape}: the sensors have {m} states, give a "
                "covariance of theirs"
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
    names = (*_NAMES, *(f"{axis} {name}" for axis, part in pairs for name in part.names))
    covariance = 0.5 * (covariance + covariance.T)
    increments = (rotation, velocity, position)
    return Preintegration(imu.n * dt, *increments, covariance, jacobian, names)


def _steps(imu: Imu) -> tuple[FloatArray, ...]:
    """Effects of the samples, (n, 3, 3) each.

    For a rotation vector r and a velocity increment u: turn exp(r), mean turn G1, G2 for the
    position, and the derivatives of G1 u and G2 u to r.
    """
    part = matrix_from_rotation_vector(_NODES[:, None, None] * imu.rotation)  # exp(s r)
    mean = np.einsum("s,snij->nij", _WEIGHTS, part)
    half = np.einsum("s,snij->nij", _WEIGHTS * (1.0 - _NODES), part)
    # Integral of exp(-q r) over q from 0 to s: the right Jacobian of s r, times s.
    products = np.multiply.outer(_NODES, _NODES)[:, :, None, None] * imu.rotation
    right = np.einsum("q,sqnij->snij", _WEIGHTS, matrix_from_rotation_vector(-products))
    inner = part @ skew(imu.velocity) @ (_NODES[:, None, None, None] * right)
    by_mean = -np.einsum("s,snij->nij", _WEIGHTS, inner)
    by_half = -np.einsum("s,snij->nij", _WEIGHTS * (1.0 - _NODES), inner)
    return matrix_from_rotation_vector(imu.rotation), mean, half, by_mean, by_half
