"""The Earth (WGS-84 ellipsoid, rotation, normal gravity) and rotations."""

import math
from typing import Any

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray

RATE = 7.292115e-5  # of rotation, rad/s
SEMI_MAJOR_AXIS = 6_378_137.0  # equatorial radius, m
FLATTENING = 1.0 / 298.257223563
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)
GRAVITATIONAL_CONSTANT = 3.986004418e14  # of the Earth with its atmosphere, m^3/s^2
STANDARD_GRAVITY = 9.80665  # m/s^2, the unit g
_SEMI_MINOR_AXIS = SEMI_MAJOR_AXIS * (1.0 - FLATTENING)
_EQUATORIAL_GRAVITY = 9.7803253359  # m/s^2
_POLAR_GRAVITY = 9.8321849379  # m/s^2
_SOMIGLIANA = _SEMI_MINOR_AXIS * _POLAR_GRAVITY / (SEMI_MAJOR_AXIS * _EQUATORIAL_GRAVITY) - 1.0
_CENTRIFUGAL_RATIO = (
    RATE * RATE * SEMI_MAJOR_AXIS * SEMI_MAJOR_AXIS * _SEMI_MINOR_AXIS / GRAVITATIONAL_CONSTANT
)


@compiled()
def radii_at(sin_lat: float) -> tuple[float, float]:
    """Radii of curvature of the meridian and of the prime vertical, from the latitude's sine.

    Returns: meridian, transverse, m, on the ellipsoid. Groves (2013), eqs. 2.105 and 2.106.
    """
    shrink = 1.0 - ECCENTRICITY_SQUARED * (sin_lat * sin_lat)
    transverse = SEMI_MAJOR_AXIS / np.sqrt(shrink)
    return transverse * (1.0 - ECCENTRICITY_SQUARED) / shrink, transverse


@compiled()
def gravity_at(sin_lat: float, h: float) -> float:
    """Normal gravity, from the latitude's sine.

    h: Height above the ellipsoid, m.
    Returns: magnitude, m/s^2, taken to point down: Somigliana's formula (Groves 2013, eq. 2.134),
        continued to the height by the second-order free-air formula (eq. 2.139).
    """
    square = sin_lat * sin_lat
    at_ellipsoid = (
        _EQUATORIAL_GRAVITY
        * (1.0 + _SOMIGLIANA * square)
        / np.sqrt(1.0 - ECCENTRICITY_SQUARED * square)
    )
    x = h / SEMI_MAJOR_AXIS
    slope = 1.0 + FLATTENING * (1.0 - 2.0 * square) + _CENTRIFUGAL_RATIO
    return at_ellipsoid * (1.0 - 2.0 * slope * x + 3.0 * x * x)


@compiled()
def gravity(lat: float, h: float) -> float:
    """Normal gravity, m/s^2, at a latitude in rad and a height in m; see `gravity_at`."""
    return gravity_at(np.sin(lat), h)


def radii_along(lat: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Radii of curvature of the meridian and of the prime vertical, m, at many latitudes, rad."""
    formula: Any = radii_at.py_func
    return formula(np.sin(lat))


def gravity_along(lat: FloatArray, h: FloatArray) -> FloatArray:
    """Normal gravity, m/s^2, at many latitudes (rad) and heights (m); see `gravity_at`."""
    formula: Any = gravity_at.py_func
    return formula(np.sin(lat), h)


def ned_difference(lla: FloatArray, reference: FloatArray) -> FloatArray:
    """Points minus reference points, (n, 3) or (3,), in metres to the north, east and down.

    The shorter way across the date line. Radii of curvature are those half-way: the error is of
    third order in the distance, about 1 mm over 10 km at middle latitudes.
    """
    lla, reference = np.asarray(lla, dtype=float), np.asarray(reference, dtype=float)
    lat, _, h = np.moveaxis(0.5 * (lla + reference), -1, 0)
    north, east, up = np.moveaxis(lla - reference, -1, 0)
    east = east - 2.0 * np.pi * np.round(east / (2.0 * np.pi))
    meridian, transverse = radii_along(lat)
    metres = [(meridian + h) * north, (transverse + h) * np.cos(lat) * east, -up]
    return np.stack(metres, axis=-1)


def offset(lla: FloatArray, ned: FloatArray) -> FloatArray:
    """Points, (n, 3) or (3,), moved by metres to the north, east and down.

    The inverse of `ned_difference`; the longitude may pass 180 deg.
    """
    lla, ned = np.asarray(lla, dtype=float), np.asarray(ned, dtype=float)
    h = lla[..., 2] - 0.5 * ned[..., 2]
    lat = lla[..., 0]
    # Radii change by less than 1 % of the distance in radians: one correction settles them.
    for _ in range(3):
        half_way = 0.5 * (lla[..., 0] + lat)
        meridian, transverse = radii_along(half_way)
        lat = lla[..., 0] + ned[..., 0] / (meridian + h)
    half_way = 0.5 * (lla[..., 0] + lat)
    lon = lla[..., 1] + ned[..., 1] / ((transverse + h) * np.cos(half_way))
    return np.stack(np.broadcast_arrays(lat, lon, lla[..., 2] - ned[..., 2]), axis=-1)


# -- rotations ------------------------------------------------------------------------------------

_SERIES_BELOW = 0.01  # rad^2: the terms left out of the series are below 1e-17

# Taylor coefficients of sin(a)/a and (1 - cos(a))/a^2 in a^2.
_S1, _S2, _S3, _S4, _S5 = ((-1.0) ** k / math.factorial(2 * k + 1) for k in (1, 2, 3, 4, 5))
_C1, _C2, _C3, _C4 = ((-1.0) ** k / math.factorial(2 * k + 2) for k in (1, 2, 3, 4))


@compiled()
def rotation_coefficients(square: float) -> tuple[float, float, float]:
    """sin(a) / a, (1 - cos(a)) / a^2 and (a - sin(a)) / a^3 of an angle's square, rad^2."""
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
    """Turn the body by a rotation vector with known `rotation_coefficients` (Rodrigues)."""
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


def matrix_from_rpy(rpy: FloatArray) -> FloatArray:
    """Matrices C_bn (v_n = C_bn v_b), (..., 3, 3), of roll, pitch and yaw, (..., 3), rad.

    Turns about z, then y, then x: Groves (2013), eq. 2.22, transposed.
    """
    sr, sp, sy = np.moveaxis(np.sin(np.asarray(rpy, dtype=float)), -1, 0)
    cr, cp, cy = np.moveaxis(np.cos(np.asarray(rpy, dtype=float)), -1, 0)
    elements = [
        *(cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy),
        *(cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy),
        *(-sp, sr * cp, cr * cp),
    ]
    return np.stack(elements, axis=-1).reshape(*np.shape(rpy), 3)


def rpy_from_matrix(matrices: FloatArray) -> FloatArray:
    """Roll, pitch and yaw, (..., 3), rad, of matrices C_bn, (..., 3, 3).

    Roll and yaw lie in [-pi, pi]. Where the body points straight up or down, only their difference
    or sum is defined: roll is then 0.
    """
    C = np.moveaxis(np.asarray(matrices, dtype=float), (-2, -1), (0, 1))
    level = np.hypot(C[2, 1], C[2, 2])
    upright = level < 1e-12
    roll = np.where(upright, 0.0, np.arctan2(C[2, 1], C[2, 2]))
    yaw = np.arctan2(np.where(upright, -C[0, 1], C[1, 0]), np.where(upright, C[1, 1], C[0, 0]))
    return np.stack([roll, np.arctan2(-C[2, 0], level), yaw], axis=-1)


def matrix_from_rotation_vector(vectors: FloatArray) -> FloatArray:
    """Rotation matrices exp([v cross]), (..., 3, 3), of rotation vectors, (..., 3), rad."""
    cross = skew(vectors)
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None] / np.pi
    half = np.sinc(0.5 * angle)
    return np.eye(3) + np.sinc(angle) * cross + 0.5 * half * half * (cross @ cross)


def skew(vector: FloatArray) -> FloatArray:
    """Matrices of the cross product, (..., 3, 3), of vectors (..., 3)."""
    x, y, z = np.moveaxis(np.asarray(vector), -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))
