"""Spectrum and Haar variance of an exponential autocovariance, for real or complex rates.

The sampled process with autocovariance exp(-a |k|) at lag k (a = dt/tau for Gauss-Markov) has

    S(f)  = dt coth(a/2) / (1 + sin^2(pi f dt) / sinh^2(a/2)),
    nu2_m = [2 m (sinh a - a) + h(m a)] / (8 m^2 sinh^2(a/2)),
    h(x)  = 2 x - 3 + 4 exp(-x) - exp(-2 x),

which is the AR(1) form of Zhang (2008, *Metrologia* 45, 549-561) rearranged into positive terms.
The textbook form subtracts numbers of order m a from each other and loses all digits as a -> 0;
here both terms are of third order in a and computed as such.
"""

from __future__ import annotations

import math
from math import factorial
from typing import Any

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray

_SERIES_BELOW = 0.5
_SINH_TERMS = [1.0 / factorial(2 * k + 1) for k in range(1, 9)]
_H_TERMS = [-((-1) ** k) * (2.0**k - 4.0) / factorial(k) for k in range(3, 22)]
_H_ARRAY = np.array(_H_TERMS)
_SINH_ARRAY = np.array(_SINH_TERMS)
_WHITE_ABOVE = 40.0  # exp(-a) is below rounding: white noise


def _sinh_minus_identity(a: Any) -> Any:
    """sinh(a) - a for scalar a, to full relative precision."""
    if abs(a) < _SERIES_BELOW:
        return a**3 * np.polynomial.polynomial.polyval(a * a, _SINH_TERMS)
    return np.sinh(a) - a


def _h(x: Any) -> Any:
    """2 x - 3 + 4 exp(-x) - exp(-2 x), to full relative precision."""
    y = np.where(np.abs(x) < _SERIES_BELOW, x, 0.0)  # keeps the unused branch finite
    series = y**3 * np.polynomial.polynomial.polyval(y, _H_TERMS)
    direct = 2.0 * x - 3.0 + 4.0 * np.exp(-x) - np.exp(-2.0 * x)
    return np.where(np.abs(x) < _SERIES_BELOW, series, direct)


def exponential_psd(rate: complex, f: FloatArray, dt: float) -> Any:
    """Two-sided spectrum of the unit-variance process, same shape as ``f``, in s."""
    half = 0.5 * rate
    if np.real(half) > 300.0:
        return np.full(np.shape(f), dt, dtype=np.result_type(half, float))
    s = np.sinh(half)
    return dt * np.cosh(half) * s / (s * s + np.sin(np.pi * f * dt) ** 2)


def exponential_haar(rate: complex, m: FloatArray) -> Any:
    """Haar wavelet variance of the unit-variance process.

    Parameters
    ----------
    rate : float or complex
        a > 0, or complex with positive real part (one of a conjugate pair).
    m : ndarray
        Averaging times in samples.
    """
    m = np.asarray(m, dtype=float)
    if np.real(rate) > _WHITE_ABOVE:
        return 0.5 / m + 0.0 * rate
    denominator = 8.0 * m**2 * np.sinh(0.5 * rate) ** 2
    return (2.0 * m * _sinh_minus_identity(rate) + _h(m * rate)) / denominator


@compiled()
def real_haar(rate: float, m: FloatArray) -> FloatArray:
    """`exponential_haar` for a real rate and m of shape (J,): the inner loop of every fit."""
    result = np.empty(m.size)
    if rate > _WHITE_ABOVE:
        for i in range(m.size):
            result[i] = 0.5 / m[i]
        return result
    if rate < _SERIES_BELOW:
        excess = 0.0
        for k in range(_SINH_ARRAY.size - 1, -1, -1):
            excess = excess * rate * rate + _SINH_ARRAY[k]
        excess *= rate * rate * rate
    else:
        excess = math.sinh(rate) - rate
    scale = 8.0 * math.sinh(0.5 * rate) ** 2
    for i in range(m.size):
        x = m[i] * rate
        if x < _SERIES_BELOW:
            h = 0.0
            for k in range(_H_ARRAY.size - 1, -1, -1):
                h = h * x + _H_ARRAY[k]
            h *= x * x * x
        else:
            h = 2.0 * x - 3.0 + 4.0 * math.exp(-x) - math.exp(-2.0 * x)
        result[i] = (2.0 * m[i] * excess + h) / (m[i] * m[i] * scale)
    return result
