"""The robust variance of wavelet coefficients: a bounded-influence M-estimator.

A few outliers, jumps or glitches raise the wavelet variances of all levels they touch. The robust
variance of the coefficients W_t of a level solves

    mean_t chi(W_t / nu) = a(c),    chi(r) = r^2 w(r)^2,    w(r) = (1 - (r/c)^2)^2 for |r| < c,

with Tukey's biweight w, which takes all weight from coefficients beyond c nu, and
a(c) = E chi(Z), Z ~ N(0, 1), which makes it consistent for Gaussian data (Mondal & Percival 2012,
*Ann. Inst. Stat. Math.* 64, 27-53; Huber & Ronchetti 2009, *Robust Statistics*, ch. 5-6). From the
derivative of the equation by nu^2, with E[Z chi'(Z)] = E[(Z^2 - 1) chi(Z)] (Stein's identity), the
influence of a coefficient nu r on nu^2 is

    2 nu^2 (chi(r) - a) / E[(Z^2 - 1) chi(Z)],

and the efficiency at independent Gaussian coefficients, 2 nu^4 over its variance,

    E[(Z^2 - 1) chi(Z)]^2 / (2 var chi(Z)).

It has a limit. Outliers are rare in the coefficients of fine levels only: a coefficient of
averaging time m is made of 2 m samples. Where most of these coefficients contain an outlier, they
are nearly Gaussian with the raised variance, which no estimate from that level can tell from noise.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.optimize import brentq

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.process import legendre
from gmwm.variance.robust_kernels import biweight_means

EFFICIENCY = 0.6
"""Efficiency at Gaussian data by default."""

_QUARTILE = 0.6744897501960817  # median of |Z|
_TAIL = 13.0  # the normal density beyond is below double precision
_NODES = 256
_SMALLEST_C, _LARGEST_C = 2.0, 1e4  # efficiency 0 is at c = 2.395; 1 - 1e-7 is below 1e4
_TOLERANCE = 1e-7  # of the last Newton step in log nu^2; the error left is its square
_ZERO = 1e-6  # times the root mean square: a median below counts as zero
_NARROW = 1e-4  # in log nu^2: a maximum below zero, so close, is not a solution
_LARGEST_STEP = np.log(2.0)
_MAX_STEPS = 200


def biweight_square(r: FloatArray, c: float) -> FloatArray:
    """chi(r) = r^2 (1 - (r/c)^2)^4 within c, 0 beyond."""
    return np.asarray(r**2 * np.maximum(1.0 - (r / c) ** 2, 0.0) ** 4)


def half_normal(c: float) -> tuple[FloatArray, FloatArray]:
    """Nodes within [0, c] and weights for the mean of an even function that vanishes beyond c."""
    x, w = legendre(_NODES)
    half = 0.5 * min(c, _TAIL)
    r = half * (x + 1.0)
    return r, half * w * np.sqrt(2.0 / np.pi) * np.exp(-0.5 * r**2)


def consistency(c: float) -> float:
    """a(c) = E[Z^2 w(Z)^2] for Z ~ N(0, 1)."""
    r, weight = half_normal(c)
    return float(weight @ biweight_square(r, c))


def _root_of_efficiency(c: float) -> float:
    """Square root of the efficiency, negative where the equation has its slope the wrong way."""
    r, weight = half_normal(c)
    chi = biweight_square(r, c)
    slope = weight @ ((r**2 - 1.0) * chi)
    spread = weight @ chi**2 - (weight @ chi) ** 2
    return float(slope / np.sqrt(2.0 * spread))


@lru_cache(maxsize=64)
def tuning_constant(efficiency: float = EFFICIENCY) -> float:
    """Distance c, in standard deviations, beyond which a coefficient has no weight.

    efficiency: Variance of the classical estimate over that of the robust one, for independent
        Gaussian coefficients; between 0 and 1.
    Raises InputError for an efficiency outside (0, 1).
    """
    if not 0.0 < efficiency < 1.0:
        raise InputError(f"efficiency = {efficiency!r}: give a number between 0 and 1, e.g. 0.6")
    root = np.sqrt(efficiency)
    if root >= _root_of_efficiency(_LARGEST_C):
        return _LARGEST_C
    return float(
        brentq(lambda c: _root_of_efficiency(c) - root, _SMALLEST_C, _LARGEST_C, xtol=1e-13)
    )


def robust_variance(coefficients: FloatArray, efficiency: float = EFFICIENCY) -> float:
    """Robust variance, about zero, of the wavelet coefficients of one level, u^2.

    The equation has a second, meaningless solution far below, and may have more in contaminated
    data. The solution is the one found first from the squared median of \\|W\\| over 0.6745, on the
    branch on which the equation falls with nu^2, as it does for Gaussian data. Where more than half
    of the coefficients are zero, the search starts from their mean square. Without a solution the
    start itself is returned: at an efficiency of 0.6 with more than a quarter of far outliers, or
    of zeros beside noise. With few independent coefficients the estimate is biased, as any
    non-linear function of them. Independent uniform rounding errors give 15 % more than their
    variance, a level that holds nothing but a periodic line 40 % more.

    coefficients: (M,), free of end effects, in u; at least one.
    efficiency: See `tuning_constant`.
    Raises InputError for coefficients that are not one series of finite numbers, or an efficiency
        outside (0, 1).
    """
    c = tuning_constant(efficiency)
    w = np.ascontiguousarray(coefficients, dtype=float)
    if w.ndim != 1 or w.size == 0:
        raise InputError(f"coefficients of shape {w.shape}: give one series of 1 or more")
    largest = max(float(np.max(w)), -float(np.min(w)))
    if not np.isfinite(largest):
        raise InputError("the coefficients hold NaN or infinite values: remove or repair them")
    if largest == 0.0:
        return 0.0
    scale = _start(w, largest)
    return scale**2 * float(np.exp(_solve(w, scale, c)))


def _start(w: FloatArray, largest: float) -> float:
    """Median of the absolute coefficients over 0.6745, or their root mean square if it is zero.

    Coefficients that are zero come out as rounding errors of the cumulative sum: with long slow
    series up to about a millionth of the others.
    """
    rank = w.size // 2
    scale = float(np.partition(np.abs(w), rank)[rank]) / _QUARTILE
    if scale > _ZERO * largest:  # which is at least the root mean square
        return scale
    square = largest * float(np.sqrt(np.mean((w / largest) ** 2)))
    return scale if scale > _ZERO * square else square


def _solve(w: FloatArray, scale: float, c: float) -> float:
    """log(nu^2 / scale^2) of the solution next to ``scale``, or 0 if there is none.

    Newton's method on log(mean chi / a) against log nu^2, a straight line if nothing is cut off,
    within a bracket. Its upper end is above the solution. Its lower end is below it, or, as long
    as none is ``found``, beyond the maximum of mean chi, where that rises with nu^2.
    """
    a = consistency(c) / c**2
    low, high, found = -np.inf, np.inf, False
    x = 0.0
    for _ in range(_MAX_STEPS):
        mean, slope = biweight_means(w, float(np.exp(-0.5 * x)) / (c * scale))
        excess = np.log(mean / a) if mean > 0.0 else -np.inf
        if excess >= 0.0:
            low, found = x, True
        elif found or slope > 0.0:
            high = x
        elif high == np.inf:
            return 0.0
        else:
            low = x
        if not found and high - low < _NARROW:
            return 0.0
        step = excess * mean / slope if slope > 0.0 else np.copysign(_LARGEST_STEP, excess)
        following = x + float(np.clip(step, -_LARGEST_STEP, _LARGEST_STEP))
        if abs(step) < _TOLERANCE:
            return following
        if not low < following < high:
            following = 0.5 * (low + high)
        x = following
    return x
