"""A smooth spectrum that has given wavelet variances: the data's own, before any model.

It serves the equivalent degrees of freedom of the estimates and the first weights of a fit.
"""

from __future__ import annotations

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.process import PSD, quadrature
from gmwm.variance import tuning


def pilot_psd(variance: FloatArray, averaging: FloatArray, dt: float) -> PSD:
    """Power-law pieces between the pass bands of the levels, fitted to the wavelet variances.

    variance: (J,), Haar wavelet variances, u^2, positive.
    averaging: (J,), averaging times in samples, dyadic.
    dt: Sampling interval, s.
    Returns: ``psd(f, dt)``.
    """
    grid = quadrature(tuple(averaging.tolist()))
    knots = np.log(tuning.HAAR_PEAK / averaging)[::-1]  # rising frequency
    node = np.log(grid.frequency)
    level = np.log(2.0 * variance * averaging)
    for _ in range(tuning.PILOT_ITERATIONS):
        density = np.exp(_interpolate(node, knots, level[::-1]))
        implied = 2.0 * (grid.gain @ (grid.weight * density))
        level = level + np.clip(tuning.PILOT_STEP * np.log(variance / implied), -1.0, 1.0)
        level = _limit_slopes(level)

    def psd(f: FloatArray, sampling: float) -> FloatArray:
        return sampling * np.exp(_interpolate(np.log(f * sampling), knots, level[::-1]))

    return psd


def _interpolate(x: FloatArray, knots: FloatArray, level: FloatArray) -> FloatArray:
    """Piecewise linear; below the lowest knot with the mean slope of the lowest three."""
    inside = np.interp(x, knots, level)
    reach = min(3, knots.size - 1)
    if reach == 0:
        return np.asarray(inside)
    slope = (level[reach] - level[0]) / (knots[reach] - knots[0])
    slope = np.clip(slope, -2.0, 0.0)
    return np.asarray(inside + slope * np.minimum(x - knots[0], 0.0))


def _limit_slopes(level: FloatArray) -> FloatArray:
    """Keep the density within f^-2.5 .. f^2.5 from one level (an octave) to the next."""
    largest = tuning.PILOT_STEEPEST * np.log(2.0)
    limited = level.copy()
    for j in range(1, level.size):
        limited[j] = np.clip(limited[j], limited[j - 1] - largest, limited[j - 1] + largest)
    return limited
