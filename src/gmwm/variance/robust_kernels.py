"""Hot loops of the robust wavelet variance and its covariance."""

from __future__ import annotations

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray

_DROPPED_BITS = 46  # of the 52 of a mantissa: bins of 1.6 %
_BIN_MASK = (1 << 17) - 1  # without the sign


@compiled()
def middle_bin(values: FloatArray) -> tuple[FloatArray, int]:
    """The absolute values next to that of rank ``values.size // 2``, and its rank among them.

    The leading bits of a floating-point number order it by size. Counted by these, only the
    values that share those of the wanted one need to be sorted: several times faster than to
    partition all.

    values: (M,), contiguous, without NaN.
    """
    bits = values.view(np.int64)
    counts = np.zeros(_BIN_MASK + 1, np.int64)
    for i in range(bits.size):
        counts[(bits[i] >> _DROPPED_BITS) & _BIN_MASK] += 1
    rank = values.size // 2
    place = 0
    while rank >= counts[place]:
        rank -= counts[place]
        place += 1
    same = np.empty(counts[place])
    number = 0
    for i in range(bits.size):
        if (bits[i] >> _DROPPED_BITS) & _BIN_MASK == place:
            same[number] = abs(values[i])
            number += 1
    return same, rank


# Sums may be taken in any order, so that they are vectorised; infinities stay what they are.
@compiled(fastmath={"reassoc", "contract", "nsz"})
def biweight_means(coefficients: FloatArray, factor: float) -> tuple[float, float]:
    """Means of u t^4 and of its derivative by log u, with u = (factor W)^2 and t = max(1 - u, 0).

    coefficients: (M,), W.
    factor: One over the distance beyond which a coefficient has no weight.
    """
    value = 0.0
    slope = 0.0
    for i in range(coefficients.size):
        v = coefficients[i] * factor
        u = min(v * v, 1.0)
        t = 1.0 - u
        t3 = t * t * t
        value += u * t3 * t
        slope += u * t3 * (1.0 - 5.0 * u)
    return value / coefficients.size, slope / coefficients.size


@compiled(fastmath={"reassoc", "contract", "nsz"})
def weighted_series(correlation: FloatArray, weight: FloatArray, series: FloatArray) -> float:
    """Sum over lags of weight times sum_p series[p] correlation^(2 p + 4).

    correlation, weight: (L,).
    series: (P,).
    """
    total = 0.0
    for i in range(correlation.size):
        z = correlation[i] * correlation[i]
        value = 0.0
        for p in range(series.size - 1, -1, -1):
            value = value * z + series[p]
        total += weight[i] * value * z * z
    return total
