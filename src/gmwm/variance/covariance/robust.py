"""Covariance of the robust wavelet variances of a Gaussian series, from its spectrum.

The influence function of the robust variance (see `gmwm.variance.robust`) is even, and in Hermite
polynomials of r = W/nu, orthogonal under the normal law,

    nu^2 (H_2(r) + b_4 H_4(r) + b_6 H_6(r) + ...),    b_q = (2 / q!) E[chi H_q] / E[chi H_2].

The first term is the influence function of the classical variance. For coefficients of correlation
rho, E[H_p H_q] = q! rho^q if p = q, else 0 (Mehler), so that for two levels

    cov_robust = cov_classical
                 + nu_j^2 nu_k^2 / (M_j M_k) sum_h c_jk(h) sum_{q=4,6,..} b_q^2 q! rho_jk(h)^q,

with c_jk(h) the number of pairs at lag h. For independent coefficients the sum of all terms is
the classical variance over the efficiency. Each power of a correlation function is one itself
(Schur), so the excess is positive semi-definite.

The powers from the fourth on are local: two levels whose averaging times differ by 2^d have
correlations of order 2^(-d/2), over a few times the longer averaging time, and share about
2^(-3d/2) of the added variance (random walk) or less (2^(-5d/2) for white noise). Levels up to four
apart are summed, on a common grid of lags. It is made of means over blocks of samples, which give
the coefficients at every ``block``-th lag exactly; between these lags the sum of powers is taken as
a straight line. Correlations are by cosine transform from frequencies in the middle of their bins:
the transform then gives correlations less their first alias, and a spectrum that grows without
bound towards zero frequency needs no care. Farther levels hardly matter unless one narrow resonance
makes them all; they get a value of the right size.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import fft

from gmwm._core.typing import FloatArray
from gmwm.process import PSD, quadrature
from gmwm.variance import tuning
from gmwm.variance.covariance.haar import centred_pairs, dyadic_levels, haar_counts
from gmwm.variance.covariance.lags import block_density
from gmwm.variance.robust import biweight_square, half_normal, tuning_constant
from gmwm.variance.robust_kernels import weighted_series

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
    first, own, size: First level, number of levels whose pairs are summed here, number of levels in
        all.
    frequency: (L,), cycles per block.
    amplitude: (size, L), gain of each level over its phase, on means of blocks.
    weight: (own, tuning.ROBUST_REACH + 1, L), share of the pairs of coefficients at each lag, both
        signs together, for each level and the ones from itself on.
    """

    block: int
    first: int
    own: int
    size: int
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
        grids.append(_Grid(block, first, own, size, frequency, amplitude, weight))
        first += own
        own = min(tuning.ROBUST_LEVELS_PER_GRID, m.size - first)
        block = int(m[first]) // tuning.ROBUST_BLOCKS_PER_AVERAGE if own else 0
    return tuple(grids)


def excess_correlation(
    amplitude: FloatArray, density: FloatArray, weight: FloatArray, series: FloatArray
) -> FloatArray:
    """Weighted sums over lags of ``series`` in the even powers, from 4, of the correlation.

    amplitude: (K, L), zero-phase gains of the levels at L frequencies in the middle of their bins.
    density: (L,), spectrum there.
    weight: (O, D, L), of the lags 0 .. L-1 for level j < O and level j + d.
    series: (P,), see `excess_series`.
    Returns: (O, D).
    """
    deviation = np.sqrt(np.maximum(2.0 * amplitude**2 @ density, np.finfo(float).tiny))
    scaled = amplitude / deviation[:, None]
    weighted = scaled * density
    own, reach, _ = weight.shape
    result = np.zeros((own, reach))
    for j in range(own):
        correlation = fft.dct(weighted[j] * scaled[j : j + reach], type=2, axis=-1)
        for d, row in enumerate(correlation):
            result[j, d] = weighted_series(row, weight[j, d], series)
    return result


def _excess(psd: PSD, n: int, dt: float, series: FloatArray, levels: int) -> FloatArray:
    """Excess of the covariance over nu_j^2 nu_k^2, for levels within reach, (J, J)."""
    result = np.zeros((levels, levels))
    for grid in _grids(n, levels):
        density = block_density(psd, dt, grid.frequency, grid.block)
        excess = excess_correlation(grid.amplitude, density, grid.weight, series)
        for j in range(grid.own):
            for d in range(min(tuning.ROBUST_REACH + 1, grid.size - j)):
                row, column = grid.first + j, grid.first + j + d
                result[row, column] = result[column, row] = excess[j, d]
    return result


def _normalised(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Square roots of the diagonal, and the correlations."""
    deviation = np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    return deviation, matrix / np.outer(deviation, deviation)


def _semidefinite(matrix: FloatArray) -> FloatArray:
    """The matrix without its negative eigenvalues."""
    values, vectors = np.linalg.eigh(matrix)
    if values[0] >= 0.0:
        return matrix
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(root @ root.T)  # a product that is symmetric to the last digit


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

    psd: ``psd(f, dt)``, two-sided, in u^2/Hz.
    efficiency: Of the estimates at independent coefficients, between 0 and 1.
    classical: (J, J), covariance of the classical wavelet variances, u^4, of the first J levels of
        `dyadic_levels`. The result is at least that, and positive definite if that is.
    counts: (J,), numbers of coefficients, where samples are missing.
    Raises InputError for an efficiency outside (0, 1), or a spectrum that is not finite and
        non-negative.
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
    return np.asarray(classical + np.outer(deviation, deviation) * _semidefinite(correlation))
