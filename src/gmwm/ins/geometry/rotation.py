"""Rotations: roll, pitch and yaw, rotation vectors, and 3x3 matrices changed in place."""

from __future__ import annotations

import math

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray

_SERIES_BELOW = 0.01  # rad^2: the terms left out of the series are below 1e-17

# Taylor coefficients of sin(a)/a and (1 - cos(a))/a^2 in a^2.
_S1, _S2, _S3, _S4, _S5 = ((-1.0) ** k / math.factorial(2 * k + 1) for k in (1, 2, 3, 4, 5))
_C1, _C2, _C3, _C4 = ((-1.0) ** k / math.factorial(2 * k + 2) for k in (1, 2, 3, 4))


@compiled()
def set_from_angles(C: FloatArray, roll: float, pitch: float, yaw: float) -> None:
    """Fill C_bn from roll, pitch and yaw (turns about z, then y, then x), rad.

    Groves (2013), eq. 2.22, transposed.
    """
    sr, cr = math.sin(roll), math.cos(roll)
    sp, cp = math.sin(pitch), math.cos(pitch)
    sy, cy = math.sin(yaw), math.cos(yaw)
    C[0, 0] = cp * cy
    C[0, 1] = sr * sp * cy - cr * sy
    C[0, 2] = cr * sp * cy + sr * sy
    C[1, 0] = cp * sy
    C[1, 1] = sr * sp * sy + cr * cy
    C[1, 2] = cr * sp * sy - sr * cy
    C[2, 0] = -sp
    C[2, 1] = sr * cp
    C[2, 2] = cr * cp


@compiled()
def angles(C: FloatArray) -> tuple[float, float, float]:
    """Roll, pitch and yaw of C_bn, rad.

    Roll and yaw lie in [-pi, pi]. Where the body points straight up or down, only their difference
    or sum is defined: roll is then 0.
    """
    level = math.hypot(C[2, 1], C[2, 2])
    pitch = math.atan2(-C[2, 0], level)
    if level < 1e-12:
        return 0.0, pitch, math.atan2(-C[0, 1], C[1, 1])
    return math.atan2(C[2, 1], C[2, 2]), pitch, math.atan2(C[1, 0], C[0, 0])


@compiled()
def rotation_coefficients(square: float) -> tuple[float, float, float]:
    """Factors of a rotation by an angle of which the square is given.

    square: Square of the angle a, rad^2.
    Returns: sin(a) / a; (1 - cos(a)) / a^2; (a - sin(a)) / a^3.
    """
    if square < _SERIES_BELOW:
        # Products with constants: divisions would take most of the time.
        sine = 1.0 + square * (_S1 + square * (_S2 + square * (_S3 + square * _S4)))
        cosine = 0.5 + square * (_C1 + square * (_C2 + square * (_C3 + square * _C4)))
        rest = -_S1 - square * (_S2 + square * (_S3 + square * (_S4 + square * _S5)))
        return sine, cosine, rest
    a = math.sqrt(square)
    sine = math.sin(a) / a
    half = math.sin(0.5 * a) / a
    return sine, 2.0 * half * half, (1.0 - sine) / square


@compiled()
def turn_body(C: FloatArray, x: float, y: float, z: float) -> None:
    """Turn the body by a rotation vector in its own axes, rad: C <- C exp([x, y, z] cross)."""
    sine, cosine, _ = rotation_coefficients(x * x + y * y + z * z)
    rotate(C, x, y, z, sine, cosine)


@compiled()
def rotate(C: FloatArray, x: float, y: float, z: float, sine: float, cosine: float) -> None:
    """Turn the body by a rotation vector of which the `rotation_coefficients` are known.

    Rodrigues' formula, e.g. Groves (2013), ch. 5.
    """
    for i in range(3):
        a, b, c = C[i, 0], C[i, 1], C[i, 2]
        # A row times [r cross] is the row cross r.
        p, q, r = b * z - c * y, c * x - a * z, a * y - b * x
        C[i, 0] = a + sine * p + cosine * (q * z - r * y)
        C[i, 1] = b + sine * q + cosine * (r * x - p * z)
        C[i, 2] = c + sine * r + cosine * (p * y - q * x)


@compiled()
def turn_navigation(C: FloatArray, x: float, y: float, z: float) -> None:
    """Turn the navigation frame by a small rotation vector in its axes, rad.

    C <- exp(-[x, y, z] cross) C to second order, which is exact in floating point for angles below
    1e-5 rad.
    """
    for j in range(3):
        a, b, c = C[0, j], C[1, j], C[2, j]
        # Minus r cross column.
        p, q, r = z * b - y * c, x * c - z * a, y * a - x * b
        C[0, j] = a + p + 0.5 * (z * q - y * r)
        C[1, j] = b + q + 0.5 * (x * r - z * p)
        C[2, j] = c + r + 0.5 * (y * p - x * q)


@compiled()
def orthonormalise(C: FloatArray) -> None:
    """Bring a matrix that is nearly a rotation back to one, in place.

    One Newton step C (3 I - C^T C) / 2 towards the nearest rotation: an error e becomes one of the
    order of e^2 (Higham 1986, SIAM J. Sci. Stat. Comput. 7).
    """
    xx = C[0, 0] * C[0, 0] + C[1, 0] * C[1, 0] + C[2, 0] * C[2, 0]
    yy = C[0, 1] * C[0, 1] + C[1, 1] * C[1, 1] + C[2, 1] * C[2, 1]
    zz = C[0, 2] * C[0, 2] + C[1, 2] * C[1, 2] + C[2, 2] * C[2, 2]
    xy = C[0, 0] * C[0, 1] + C[1, 0] * C[1, 1] + C[2, 0] * C[2, 1]
    xz = C[0, 0] * C[0, 2] + C[1, 0] * C[1, 2] + C[2, 0] * C[2, 2]
    yz = C[0, 1] * C[0, 2] + C[1, 1] * C[1, 2] + C[2, 1] * C[2, 2]
    for i in range(3):
        a, b, c = C[i, 0], C[i, 1], C[i, 2]
        C[i, 0] = 0.5 * ((3.0 - xx) * a - xy * b - xz * c)
        C[i, 1] = 0.5 * ((3.0 - yy) * b - xy * a - yz * c)
        C[i, 2] = 0.5 * ((3.0 - zz) * c - xz * a - yz * b)


@compiled()
def _matrices(rpy: FloatArray, result: FloatArray) -> None:
    for i in range(rpy.shape[0]):
        set_from_angles(result[i], rpy[i, 0], rpy[i, 1], rpy[i, 2])


@compiled()
def _all_angles(matrices: FloatArray, result: FloatArray) -> None:
    for i in range(matrices.shape[0]):
        result[i, 0], result[i, 1], result[i, 2] = angles(matrices[i])


@compiled()
def _exponentials(vectors: FloatArray, result: FloatArray) -> None:
    for i in range(vectors.shape[0]):
        for j in range(3):
            for k in range(3):
                result[i, j, k] = 1.0 if j == k else 0.0
        turn_body(result[i], vectors[i, 0], vectors[i, 1], vectors[i, 2])


def matrix_from_rpy(rpy: FloatArray) -> FloatArray:
    """Matrices C_bn (v_n = C_bn v_b) of roll, pitch and yaw.

    rpy: (..., 3), rad.
    Returns: (..., 3, 3).
    """
    flat = np.ascontiguousarray(rpy, dtype=float).reshape(-1, 3)
    result = np.empty((len(flat), 3, 3))
    _matrices(flat, result)
    return result.reshape(*np.shape(rpy), 3)


def rpy_from_matrix(matrices: FloatArray) -> FloatArray:
    """Roll, pitch and yaw of matrices C_bn.

    matrices: (..., 3, 3).
    Returns: (..., 3), rad; roll and yaw in [-pi, pi], roll 0 where the pitch is +-90 deg.
    """
    flat = np.ascontiguousarray(matrices, dtype=float).reshape(-1, 3, 3)
    result = np.empty((len(flat), 3))
    _all_angles(flat, result)
    return result.reshape(np.shape(matrices)[:-1])


def matrix_from_rotation_vector(vectors: FloatArray) -> FloatArray:
    """Rotation matrices exp([v cross]) of rotation vectors.

    vectors: (..., 3), axis times angle, rad.
    Returns: (..., 3, 3).
    """
    flat = np.ascontiguousarray(vectors, dtype=float).reshape(-1, 3)
    result = np.empty((len(flat), 3, 3))
    _exponentials(flat, result)
    return result.reshape(*np.shape(vectors), 3)


def skew(vector: FloatArray) -> FloatArray:
    """Matrices of the cross product, (..., 3, 3), of vectors (..., 3)."""
    x, y, z = np.moveaxis(np.asarray(vector), -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))
