"""Hot loops of the robust wavelet variance and its covariance."""

from __future__ import annotations

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray
from gmwm.variance.kernels import ANY_ORDER


@compiled(fastmath=ANY_ORDER)
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


@compiled(fastmath=ANY_ORDER)
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
