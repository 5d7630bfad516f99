"""Cubic splines through a track and its attitude: twice differentiable everywhere."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline, make_lsq_spline

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.geometry import radii_along

_DEGREE = 3
_LARGEST_TURN = 0.5 * np.pi  # rad from epoch to epoch; beyond, the way round would be a guess


def unwrapped_longitudes(lla: FloatArray) -> FloatArray:
    """Positions of which the longitude does not jump at the date line, shape (n + 1, 3)."""
    result = np.array(lla, dtype=float)
    result[:, 1] = np.unwrap(result[:, 1])
    return result


def unwrapped_angles(rpy: FloatArray) -> FloatArray:
    """Roll, pitch and yaw that do not jump at +-180 deg.

    rpy: (n + 1, 3), rad.
    Raises InputError if roll or yaw turn by more than 90 deg between epochs all the same, as where
        the body points straight up or down.
    """
    result = np.unwrap(np.asarray(rpy, dtype=float), axis=0)
    result[:, 1] = rpy[:, 1]
    steps = np.abs(np.diff(result, axis=0))
    if np.any(steps > _LARGEST_TURN):
        row, column = (int(i) for i in np.argwhere(steps > _LARGEST_TURN)[0])
        raise InputError(
            f"{('roll', 'pitch', 'yaw')[column]} turns by "
            f"{np.degrees(steps[row, column]):.0f} deg from epoch {row} to {row + 1}: give "
            "attitudes that stay away from a pitch of +-90 deg, at a rate that follows the turns"
        )
    return result


def coefficients(values: FloatArray, dt: float) -> FloatArray:
    """Polynomials of the spline through evenly spaced values.

    values: (n + 1, 3).
    dt: s.
    Returns: (n, 3, 4), for each interval and column the coefficients of 1, t, t^2, t^3, with t in s
        from the beginning of the interval.
    """
    spline = CubicSpline(np.arange(len(values)) * dt, values, axis=0)
    return np.ascontiguousarray(np.transpose(spline.c[::-1], (1, 2, 0)))


def track_velocity(lla: FloatArray, dt: float) -> FloatArray:
    """Velocity along a track.

    lla: (n + 1, 3), latitude, longitude without jumps, rad, and height, m.
    dt: s.
    Returns: (n + 1, 3), to the north, east and down, m/s.
    """
    # Relative to the first epoch fewer digits are lost in the differences.
    spline = CubicSpline(np.arange(len(lla)) * dt, lla - lla[0], axis=0)
    rate = spline(np.arange(len(lla)) * dt, 1)
    lat, h = lla[:, 0], lla[:, 2]
    meridian, transverse = radii_along(lat)
    return np.stack(
        [(meridian + h) * rate[:, 0], (transverse + h) * np.cos(lat) * rate[:, 1], -rate[:, 2]],
        axis=-1,
    )


def smoothed(values: FloatArray, dt: float, cutoff: float) -> FloatArray:
    """Least-squares cubic spline with evenly spaced knots: what moves faster is left out.

    values: (n + 1, 3), without jumps.
    dt: s.
    cutoff: Hz. Knots are half its period apart; with less than two samples from knot to knot,
        nothing is left out.
    Returns: (n + 1, 3), values of the spline. de Boor (1978), *A Practical Guide to Splines*, ch.
        XIV.
    """
    n = len(values) - 1
    spans = max(round(2.0 * cutoff * n * dt), 1)
    if n < 2 * spans + _DEGREE:
        return values
    x = np.linspace(0.0, spans, n + 1)
    knots = np.concatenate([np.zeros(_DEGREE), np.arange(spans + 1.0), np.full(_DEGREE, spans)])
    # The mean is taken out so that a height of 500 m costs no digits.
    mean = np.mean(values, axis=0)
    spline = make_lsq_spline(x, values - mean, knots, _DEGREE)
    return mean + spline(x)
