"""The robust variance of wavelet coefficients: a bounded-influence M-estimator.

The robust variance nu^2 of the coefficients W_t of a level solves

    mean_t chi(W_t / nu) = a(c),    chi(r) = r^2 w(r)^2,    w(r) = (1 - (r/c)^2)^2 for |r| < c,

with Tukey's biweight w and a(c) = E chi(Z), Z ~ N(0, 1) (Mondal & Percival 2012, *Ann. Inst. Stat.
Math.* 64, 27-53). docs/derivations.md has its influence function, efficiency and limit, and the
covariance of two levels: that of the classical variances and a sum over even powers of the
correlations of their coefficients.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial.polynomial import polyval
from scipy import fft
from scipy.optimize import brentq

from gmwm._core.typing import QUARTILE, FloatArray
from gmwm.process import PSD, legendre, quadrature
from gmwm.variance import tuning
from gmwm.variance.covariance.haar import centred_pairs, dyadic_levels, haar_counts
from gmwm.variance.covariance.lags import block_density
from gmwm.variance.kernels import biweight_means

EFFICIENCY = 0.6  # at Gaussian data, by default
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
    """
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

    coefficients: (M,), finite, free of end effects, in u; at least one.
    """
    c = tuning_constant(efficiency)
    w = np.ascontiguousarray(coefficients, dtype=float)
    largest = max(float(np.max(w)), -float(np.min(w)))
    if largest == 0.0:
        return 0.0
    scale = _start(w, largest)
    return scale**2 * float(np.exp(_solve(w, scale, c)))


def _start(w: FloatArray, largest: float) -> float:
    """Median of the absolute coefficients over 0.6745; their root mean square if only rounding."""
    rank = w.size // 2
    scale = float(np.partition(np.abs(w), rank)[rank]) / QUARTILE
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


_MAX_TERMS = 40


@lru_cache(maxsize=64)
def excess_series(efficiency: float) -> FloatArray:
    """b_q^2 q! for q = 4, 6, ...: factors of the powers of the correlation.

    Their sum is 2/efficiency - 2; the last one holds what the series leaves out.
    """
    c = tuning_constant(efficiency)
    r, weight = half_normal(c)
    chi = weight * biweight_square(r, c)
    before, hermite = r, (r**2 - 1.0) / np.sqrt(2.0)  # H_q / sqrt(q!)
    second = chi @ hermite
    rest = 2.0 / efficiency - 2.0
    terms: list[float] = []
    order = 2
    while len(terms) < _MAX_TERMS and rest > tuning.NEGLIGIBLE_POWER:
        for q in (order, order + 1):
            before, hermite = hermite, (r * hermite - np.sqrt(q) * before) / np.sqrt(q + 1.0)
        order += 2
        terms.append(2.0 * float(chi @ hermite / second) ** 2)
        rest -= terms[-1]
    terms.append(max(rest, 0.0))
    result = np.array(terms)
    result.flags.writeable = False
    return result


@dataclass(frozen=True, eq=False)
class _Grid:
    """Lags and frequencies for some levels and the coarser ones within reach.

    block: Samples between lags.
    first, own: First level, and number of levels whose pairs are summed here.
    frequency: (L,), cycles per block.
    amplitude: (K, L), gain of each level over its phase, on means of blocks.
    weight: (own, tuning.ROBUST_REACH + 1, L), share of the pairs of coefficients at each lag, both
        signs together, for each level and the ones from itself on.
    """

    block: int
    first: int
    own: int
    frequency: FloatArray
    amplitude: FloatArray
    weight: FloatArray


def pair_shares(n: int, m_j: float, m_k: float, block: int, lags: int) -> FloatArray:
    """Share of all pairs of coefficients at each ``block``-th lag between their centres, (lags,).

    Both signs are counted at the positive lag.
    """
    first, second = haar_counts(n, np.array([m_j, m_k]))
    pairs = centred_pairs(first, second, block * np.arange(lags, dtype=float), block)
    pairs[1:] *= 2.0
    return np.asarray(pairs / (first * second))


@lru_cache(maxsize=4)
def _grids(n: int, levels: int) -> tuple[_Grid, ...]:
    """Grids of all levels, on samples for the finest ones, on means of blocks for the others."""
    m, reach, lags = dyadic_levels(n)[:levels], tuning.ROBUST_REACH, tuning.ROBUST_LAGS
    frequency = (np.arange(lags) + 0.5) / (2 * lags)
    grids = []
    first, own, block = 0, min(tuning.ROBUST_FIRST_LEVELS, m.size), 1
    while own:
        size = min(own + reach, m.size - first)
        coarse = m[first : first + size, None] / block
        amplitude = np.sin(np.pi * coarse * frequency) ** 2 / (coarse * np.sin(np.pi * frequency))
        weight = np.zeros((own, reach + 1, lags))
        for j in range(own):
            for k in range(j, min(j + reach + 1, size)):
                weight[j, k - j] = pair_shares(n, m[first + j], m[first + k], block, lags)
        grids.append(_Grid(block, first, own, frequency, amplitude, weight))
        first += own
        own = min(tuning.ROBUST_LEVELS_PER_GRID, m.size - first)
        block = int(m[first]) // tuning.ROBUST_BLOCKS_PER_AVERAGE if own else 0
    return tuple(grids)


def _excess(psd: PSD, n: int, dt: float, series: FloatArray, levels: int) -> FloatArray:
    """Excess of the covariance over nu_j^2 nu_k^2, for levels within reach, (J, J)."""
    result = np.zeros((levels, levels))
    for grid in _grids(n, levels):
        density = block_density(psd, dt, grid.frequency, grid.block)
        power = np.maximum(2.0 * grid.amplitude**2 @ density, np.finfo(float).tiny)
        scaled = grid.amplitude / np.sqrt(power)[:, None]
        for j in range(grid.own):
            product = scaled[j] * density * scaled[j : j + tuning.ROBUST_REACH + 1]
            for d, correlation in enumerate(fft.dct(product, type=2, axis=-1)):
                row, column = grid.first + j, grid.first + j + d
                square = correlation**2
                excess = grid.weight[j, d] @ (square**2 * polyval(square, series))
                result[row, column] = result[column, row] = excess
    return result


def _normalised(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Square roots of the diagonal, and the correlations."""
    deviation = np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    return deviation, matrix / np.outer(deviation, deviation)


def robust_covariance(
    psd: PSD,
    n: int,
    dt: float,
    efficiency: float,
    classical: FloatArray,
    counts: FloatArray | None = None,
) -> FloatArray:
    """Asymptotic covariance of the robust Haar wavelet variances of a Gaussian series, u^4, (J, J).

    Asymptotic normality after Mondal & Percival (2012), *Ann. Inst. Stat. Math.* 64, 27-53; the
    series is their influence function in Hermite polynomials. It holds where a level has many
    independent coefficients: with fewer than about ten equivalent degrees of freedom robust
    estimates vary more than this.

    efficiency: Of the estimates at independent coefficients, between 0 and 1.
    classical: (J, J), covariance of the classical wavelet variances, u^4, of the first J levels of
        `dyadic_levels`. The result is at least that, and positive definite if that is.
    counts: (J,), numbers of coefficients, where samples are missing.
    Raises InputError for a spectrum that is not finite and non-negative.
    """
    levels = classical.shape[0]
    m = dyadic_levels(n)[:levels]
    variance = quadrature(tuple(m.tolist())).haar_variance(psd, dt)
    excess = _excess(psd, n, dt, excess_series(efficiency), levels)
    deviation, correlation = _normalised(excess)
    spread, classical_correlation = _normalised(classical)
    # The cube falls with the distance of two levels about as the sums of fourth powers do, and
    # is exact where one narrow resonance makes all levels.
    number = np.arange(levels)
    far = np.abs(np.subtract.outer(number, number)) > tuning.ROBUST_REACH
    correlation[far] = classical_correlation[far] ** 3
    deviation *= variance
    if counts is not None:
        deviation *= np.sqrt(haar_counts(n, m) / counts)
    # No power of a correlation exceeds its square. Sums over blocks may: pure quantization noise
    # is correlated at single lags, not between them.
    deviation = np.minimum(deviation, spread * np.sqrt(1.0 / efficiency - 1.0))
    values, vectors = np.linalg.eigh(correlation)
    if values[0] < 0.0:
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        correlation = root @ root.T  # a product that is symmetric to the last digit
    return np.asarray(classical + np.outer(deviation, deviation) * correlation)
