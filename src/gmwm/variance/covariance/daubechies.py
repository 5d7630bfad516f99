"""Covariance of the wavelet variance estimates of a Gaussian process, for any wavelet.

As in `gmwm.variance.covariance.haar`: with M_j coefficients W_j free of end effects, and c_jk(h)
pairs of them at lag h,

    cov(nu2_j, nu2_k) = 2 / (M_j M_k) sum_h c_jk(h) g_jk(h)^2,

g_jk being their cross-covariance (Serroukh, Walden & Percival 2000, *JASA* 95, 184-196). Sums over
all lags with min(M_j, M_k) pairs each are spectral integrals, whose weights are those of
`gmwm.process.wavelets`. For the coarse levels they are multiplied by the ratio of the two sums,
over the lags that are multiples of a block of samples: g_jk^2 is smooth on that scale. Filters need
not be symmetric: their transfer functions enter with their phases.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.process import PSD, ComplexArray, evaluated, gain_weights, unit_legendre, wavelet
from gmwm.variance import tuning
from gmwm.variance.covariance.haar import centred_pairs
from gmwm.variance.covariance.lags import LagGrid, block_of


@dataclass(frozen=True, eq=False)
class _LagSums:
    """Everything about the coarse levels that does not depend on the spectrum.

    first: Index of the first of the C coarse levels.
    frequency: (A, F), fourier frequencies of the lag sums and their aliases, cycles per sample,
        unsigned.
    transfer: (C, A, F), transfer functions there.
    counts: (C, C, size), pairs at each lag, relative to min(M_j, M_k).
    """

    first: int
    frequency: FloatArray
    transfer: ComplexArray
    counts: FloatArray
    grid: LagGrid


@lru_cache(maxsize=4)
def _lag_sums(name: str, n: int, levels: int) -> _LagSums:
    filters = wavelet(name)
    block, shortest = block_of(n)
    first = int(np.log2(shortest))
    coarse = range(min(first, levels) + 1, levels + 1)
    grid = LagGrid.holding(max(3 * n / block, tuning.LEAST_LAGS), block)
    folds = np.arange(max(-tuning.FOLDS, -(block // 2)), min(tuning.FOLDS, (block - 1) // 2) + 1)
    signed = (grid.frequency + folds[:, None]) / block
    transfer = np.empty((len(coarse), *signed.shape), dtype=complex)
    for row, level in enumerate(coarse):
        # With all digits of its size where it is minute.
        phase = np.angle(filters.transfer(level, signed))
        transfer[row] = np.sqrt(filters.gain(level, signed)) * np.exp(1j * phase)
    number = {level: n - filters.width(level) + 1 for level in coarse}

    def pairs(j: int, k: int) -> FloatArray:
        """Number of coefficients of levels j and k at each lag, relative to min(M_j, M_k)."""
        first, second = number[j], number[k]
        centre = filters.width(j) - 1 - n + 0.5 * (first + second)
        apart = (block * grid.lag - centre).astype(float)
        found = centred_pairs(first, second, apart, block)
        return found / (block * min(first, second))

    counts = np.array([[pairs(j, k) for k in coarse] for j in coarse])
    return _LagSums(first, np.abs(signed), transfer, counts, grid)


def _end_effects(psd: PSD, dt: float, sums: _LagSums, moments: int) -> FloatArray:
    """Sum over the lags that occur, relative to the sum over all lags, for the coarse levels."""
    density = evaluated(psd, sums.frequency.ravel() / dt, dt).reshape(sums.frequency.shape)
    zero = np.flatnonzero(sums.frequency[:, 0] * sums.grid.size * sums.grid.block < 0.5)
    density[zero, 0] = _at_zero(psd, dt, sums, moments, density[zero, 1])
    weighted = sums.transfer * density
    levels = sums.transfer.shape[0]
    result = np.ones((levels, levels))
    for j in range(levels):
        cross_spectrum = np.sum(weighted[j] * np.conj(sums.transfer[j:]), axis=1)
        square = sums.grid.transform(cross_spectrum) ** 2
        total = np.sum(square, axis=-1)
        seen = np.sum(sums.counts[j, j:] * square, axis=-1)
        np.divide(seen, total, out=result[j, j:], where=total > 0.0)
        result[j:, j] = result[j, j:]
    return result


def _at_zero(
    psd: PSD, dt: float, sums: _LagSums, moments: int, neighbour: FloatArray
) -> FloatArray:
    """Value of the spectrum that stands for the bin at zero frequency.

    The product of two gains and the spectrum is f^2r S(f) there: its mean over the bin, less the
    curvature of a smooth function.
    """
    x, w = unit_legendre(8)
    bin_width = 1.0 / (sums.grid.size * sums.grid.block)
    f = 0.5 * x
    zero = sums.grid.frequency[0] * sums.grid.size  # in bins
    mean = w @ (f ** (2 * moments) * evaluated(psd, f * bin_width / dt, dt))
    return np.asarray(np.maximum(12.0 * mean - neighbour, 0.0) / 11.0 / zero ** (2 * moments))


@lru_cache(maxsize=4)
def _gains(name: str, levels: int) -> FloatArray:
    """Gains at the nodes of `gmwm.process.gain_weights`, (levels, K)."""
    return wavelet(name).gains(levels, gain_weights(name, levels).frequency)


def wavelet_covariance(psd: PSD, n: int, dt: float, name: str, levels: int) -> FloatArray:
    """Covariance of the wavelet variance estimates of a Gaussian series.

    psd: ``psd(f, dt)``, two-sided, in u^2/Hz.
    n: Number of samples.
    dt: Sampling interval, s.
    name: Wavelet, see `gmwm.process.wavelets.wavelet`.
    levels: Number of levels J, each with a coefficient free of end effects.
    Returns: (J, J), in u^4.
    Raises InputError for an unknown wavelet, or a spectrum that is not finite and non-negative.
    """
    filters = wavelet(name)
    weights = gain_weights(filters.name, levels)
    density = evaluated(psd, weights.frequency / dt, dt) / dt
    # The lobes of the coarser level are in its weights; where those of the finer one are too many
    # for the nodes as well, the product is negligible.
    products = 4.0 * (weights.weight * density**2) @ _gains(filters.name, levels).T
    result = np.tril(products) + np.tril(products, -1).T
    sums = _lag_sums(filters.name, n, levels)
    if sums.transfer.size:
        coarse = slice(sums.first, None)
        result[coarse, coarse] *= _end_effects(psd, dt, sums, filters.vanishing_moments)
    counts = np.array([n - filters.width(j) + 1 for j in range(1, levels + 1)], dtype=float)
    return np.asarray(result / np.maximum.outer(counts, counts))
