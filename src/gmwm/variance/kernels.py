"""Hot loops of the wavelet variance."""

from __future__ import annotations

import numba
import numpy as np

from gmwm._typing import FloatArray


@numba.njit(cache=True, nogil=True)
def haar_moments(integral: FloatArray, m: int) -> tuple[float, float]:
    """Mean and mean square of the Haar MODWT coefficients free of end effects.

    Parameters
    ----------
    integral : (n + 1,) ndarray
        Cumulative sum of the series, starting with 0.
    m : int
        Averaging time in samples, 2 m <= n.
    """
    count = integral.size - 2 * m
    total = 0.0
    square = 0.0
    for t in range(count):
        w = integral[t + 2 * m] - 2.0 * integral[t + m] + integral[t]
        total += w
        square += w * w
    scale = 0.5 / m
    return total * scale / count, square * scale * scale / count


@numba.njit(cache=True, nogil=True)
def cumulative(values: FloatArray, mean: float) -> FloatArray:
    """Cumulative sum of ``values - mean`` with Kahan's compensation, starting with 0."""
    result = np.empty(values.size + 1)
    result[0] = 0.0
    total = 0.0
    lost = 0.0
    for t in range(values.size):
        y = values[t] - mean - lost
        following = total + y
        lost = (following - total) - y
        total = following
        result[t + 1] = total
    return result
