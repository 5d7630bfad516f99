"""A smooth spectrum that has given wavelet variances: the data's own, before any model.

It gives the equivalent degrees of freedom of the estimates and the first weights of a fit.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.process import PSD, Panels, node_weights
from gmwm.variance import tuning


def pilot_psd(variance: FloatArray, averaging: FloatArray, dt: float) -> PSD:
    """Power-law pieces between the pass bands of the levels, fitted to the wavelet variances.

    variance: (J,), Haar wavelet variances, u^2, positive.
    averaging: (J,), averaging times in samples, dyadic.
    dt: Sampling interval, s.
    Returns: ``psd(f, dt)``.
    """
    x, weight = _points(tuple(averaging.tolist()))
    knots = np.log(tuning.HAAR_PEAK / averaging)[::-1]  # rising frequency
    places = _Places(x, knots)
    level = np.log(2.0 * variance * averaging)
    for _ in range(tuning.PILOT_ITERATIONS):
        implied = weight @ np.exp(places.interpolated(level[::-1]))
        level = level + np.clip(tuning.PILOT_STEP * np.log(variance / implied), -1.0, 1.0)
        level = _limit_slopes(level)

    def psd(f: FloatArray, sampling: float) -> FloatArray:
        return sampling * np.exp(_Places(np.log(f * sampling), knots).interpolated(level[::-1]))

    return psd


@lru_cache(maxsize=32)  # gaps hide other levels in each channel; 0.1 MB each
def _points(averaging: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Logarithms of frequencies (cycles per sample), and weights of a spectrum there by level.

    A power law on an octave is a polynomial of its points to rounding.
    """
    frequency, weight = node_weights(averaging)
    lowest = np.log(tuning.HAAR_PEAK / averaging[-1])
    octaves = Panels.of(np.log(frequency) - lowest, np.log(2.0))
    points = lowest + octaves.points.ravel()
    weights = octaves.gathered(weight).reshape(len(averaging), -1)
    points.flags.writeable = weights.flags.writeable = False
    return points, weights


class _Places:
    """Places of values between knots, for repeated piecewise linear interpolation.

    It is quick where many values in a row lie in one piece.

    x: (n,).
    knots: (K,), rising.
    """

    def __init__(self, x: FloatArray, knots: FloatArray) -> None:
        self._knots = knots
        self._below = np.minimum(x - knots[0], 0.0)
        piece = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, max(knots.size - 2, 0))
        self._beyond = np.clip(x, knots[0], knots[-1]) - knots[piece]
        start = np.flatnonzero(np.diff(piece, prepend=-1))
        self._piece, self._repeats = piece[start], np.diff(start, append=piece.size)

    def interpolated(self, level: FloatArray) -> FloatArray:
        """Between levels at the knots; below the lowest with the mean slope of the lowest three."""
        reach = min(3, level.size - 1)
        if reach == 0:
            return np.full(self._below.shape, level[0])
        slopes = np.diff(level) / np.diff(self._knots)
        inside = np.repeat(slopes[self._piece], self._repeats) * self._beyond
        inside += np.repeat(level[self._piece], self._repeats)
        slope = (level[reach] - level[0]) / (self._knots[reach] - self._knots[0])
        return np.asarray(inside + np.clip(slope, -2.0, 0.0) * self._below)


def _limit_slopes(level: FloatArray) -> FloatArray:
    """Keep the density within f^-2.5 .. f^2.5 from one level (an octave) to the next."""
    largest = tuning.PILOT_STEEPEST * float(np.log(2.0))
    limited = level.tolist()
    for j in range(1, level.size):
        limited[j] = min(max(limited[j], limited[j - 1] - largest), limited[j - 1] + largest)
    return np.array(limited)
