"""The Earth: the WGS-84 ellipsoid, its rotation and its normal gravity."""

from __future__ import annotations

from typing import Any

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray

RATE = 7.292115e-5
"""Rotation rate, rad/s."""

SEMI_MAJOR_AXIS = 6_378_137.0
"""Equatorial radius, m."""

FLATTENING = 1.0 / 298.257223563
"""Flattening of the ellipsoid."""

ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)
"""Square of the ellipsoid's first eccentricity."""

GRAVITATIONAL_CONSTANT = 3.986004418e14
"""Of the Earth with its atmosphere, m^3/s^2."""

STANDARD_GRAVITY = 9.80665
"""m/s^2, the unit g."""

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
def radii(lat: float) -> tuple[float, float]:
    """Radii of curvature of the meridian and of the prime vertical, m, at a latitude in rad."""
    return radii_at(np.sin(lat))


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


def ned_difference(lla: FloatArray, reference: FloatArray) -> FloatArray:
    """Points minus reference points in metres to the north, east and down.

    lla: (n, 3) or (3,), latitude, longitude, rad, and height, m.
    reference: (n, 3) or (3,), the points to be subtracted.
    Returns: (n, 3) or (3,), m, the shorter way across the date line. Radii of curvature are those
        half-way, so that the error is of third order in the distance: about 1 mm over 10 km at
        middle latitudes.
    """
    lla, reference = np.asarray(lla, dtype=float), np.asarray(reference, dtype=float)
    half_way = 0.5 * (lla + reference)
    difference = lla - reference
    east = difference[..., 1] - 2.0 * np.pi * np.round(difference[..., 1] / (2.0 * np.pi))
    meridian, transverse = radii_along(half_way[..., 0])
    h = half_way[..., 2]
    return np.stack(
        [
            (meridian + h) * difference[..., 0],
            (transverse + h) * np.cos(half_way[..., 0]) * east,
            -difference[..., 2],
        ],
        axis=-1,
    )


def offset(lla: FloatArray, ned: FloatArray) -> FloatArray:
    """Points moved by some metres to the north, east and down: `ned_difference` turned round.

    lla: (n, 3) or (3,), latitude, longitude, rad, and height, m.
    ned: (n, 3) or (3,), m.
    Returns: (n, 3) or (3,), latitude, longitude and height; the longitude may pass 180 deg.
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
