"""Hot loops of the wavelet variance."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray


@compiled()
def haar_moments(integral: FloatArray, runs: NDArray[np.int64], m: int) -> tuple[float, float]:
    """Mean and mean square of the Haar MODWT coefficients that lie within a run.

    Parameters
    ----------
    integral : (n + 1,) ndarray
        Cumulative sum of the series, starting with 0; missing samples add nothing.
    runs : (P, 2) ndarray
        First sample of each run, and the one after its last; one of 2 m samples at least.
    m : int
        Averaging time in samples.
    """
    count = 0
    total = 0.0
    square = 0.0
    for p in range(runs.shape[0]):
        stop = runs[p, 1] - 2 * m + 1
        for t in range(runs[p, 0], stop):
            w = integral[t + 2 * m] - 2.0 * integral[t + m] + integral[t]
            total += w
            square += w * w
        count += max(stop - runs[p, 0], 0)
    scale = 0.5 / m
    return total * scale / count, square * scale * scale / count


@compiled()
def haar_coefficients(integral: FloatArray, start: int, stop: int, m: int) -> FloatArray:
    """Haar MODWT coefficients of the samples from ``start`` to ``stop``, free of end effects.

    Parameters
    ----------
    integral : (n + 1,) ndarray
        Cumulative sum of the series, starting with 0.
    start, stop : int
    m : int
        Averaging time in samples.
    """
    count = max(stop - start - 2 * m + 1, 0)
    result = np.empty(count)
    scale = 0.5 / m
    for i in range(count):
        t = start + i
        result[i] = scale * (integral[t + 2 * m] - 2.0 * integral[t + m] + integral[t])
    return result


@compiled()
def cumulative(values: FloatArray, mean: float) -> FloatArray:
    """Cumulative sum of ``values - mean`` with Kahan's compensation, starting with 0.

    Missing samples (NaN) add nothing.
    """
    result = np.empty(values.size + 1)
    result[0] = 0.0
    total = 0.0
    lost = 0.0
    for t in range(values.size):
        if np.isnan(values[t]):
            result[t + 1] = total
            continue
        y = values[t] - mean - lost
        following = total + y
        lost = (following - total) - y
        total = following
        result[t + 1] = total
    return result
