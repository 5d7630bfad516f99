"""Covariance of Haar wavelet variances of a series with gaps.

The pairs of coefficients that exist take the place of those of a complete series in the sum of
`gmwm.variance.covariance.haar`,

    cov(nu2_j, nu2_k) = 2 / (M_j M_k) sum_h c_jk(h) g_jk(h)^2,

at every level and not only at coarse ones: runs between gaps may be short. The sum over lags is
taken on means of blocks of an eighth of the averaging time, over lags of up to a hundred averaging
times.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.process import PSD
from gmwm.variance.covariance.haar import integrals
from gmwm.variance.covariance.lags import LagGrid, block_spectrum
from gmwm.variance.runs import Runs, pair_counts

_BLOCKS_PER_AVERAGE = 8
_FULL = 1024  # blocks in the record up to which all lags are taken
_WINDOW = 2048
_NEIGHBOURS = 3  # levels whose products are summed by lags where the window is not the record


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Lags of one level with itself and coarser ones; nothing depends on the spectrum."""

    grid: LagGrid
    is_full: bool
    amplitude: FloatArray
    counts: FloatArray
    centred: FloatArray  # pairs of all coarser levels whose centres coincide


@lru_cache(maxsize=8)
def _pairs(runs: Runs, averaging: tuple[float, ...]) -> tuple[_Pairs, ...]:
    m = np.array(averaging, dtype=int)
    result = []
    for j, m_j in enumerate(m):
        block = max(int(m_j) // _BLOCKS_PER_AVERAGE, 1)
        length = -(-runs.n // block)
        is_full = length <= _FULL
        grid = LagGrid.holding(3 * length, block) if is_full else LagGrid(_WINDOW, block)
        coarse = m[j:] if is_full else m[j : j + _NEIGHBOURS]
        occupancy = [runs.occupancy(2 * int(m_k), block) for m_k in m[j:]]
        shift = (m_j - m[j:]) // block
        counts = np.stack(
            [
                pair_counts(occupancy[0], occupancy[k], grid.lag + shift[k])
                for k in range(coarse.size)
            ]
        )
        centred = np.array(
            [
                pair_counts(occupancy[0], o, s[None])[0]
                for o, s in zip(occupancy, shift, strict=True)
            ]
        )
        amplitude = grid.haar_amplitude(coarse / block)
        result.append(_Pairs(grid, is_full, amplitude, counts, centred))
    return tuple(result)


def _cross(psd: PSD, dt: float, pairs: _Pairs) -> FloatArray:
    """Cross-covariances of the level with the coarser ones, (K, size), u^2."""
    spectrum = block_spectrum(psd, dt, pairs.grid)
    return pairs.grid.transform(pairs.amplitude[0] * pairs.amplitude * spectrum)


def gappy_covariance(psd: PSD, runs: Runs, dt: float, m: FloatArray) -> FloatArray:
    """Covariance of the Haar wavelet variances of the samples that exist.

    Parameters
    ----------
    psd : callable
        ``psd(f, dt)``, two-sided, in u^2/Hz.
    runs : Runs
    dt : float
        Sampling interval, s.
    m : (J,) ndarray
        Averaging times in samples, each with a coefficient at least.

    Returns
    -------
    (J, J) ndarray
        In u^4.
    """
    levels = _pairs(runs, tuple(m.tolist()))
    number = np.zeros((m.size, m.size))
    kept = np.empty(m.size)  # of the pairs at equal centres, averaged over the lags that matter
    for j, pairs in enumerate(levels):
        square = _cross(psd, dt, pairs) ** 2
        found = np.sum(pairs.counts * square, axis=-1) / np.sum(square, axis=-1)
        kept[j] = found[0] / pairs.centred[0]
        number[j, j : j + found.size] = pairs.grid.block * found
    for j, pairs in enumerate(levels):
        far = j + pairs.counts.shape[0]
        number[j, far:] = pairs.grid.block * pairs.centred[far - j :] * kept[far:]
    number = np.triu(number) + np.triu(number, 1).T
    counts = runs.counts(2.0 * m)
    return integrals(psd, dt, m) * number / np.outer(counts, counts)


def gappy_mean_covariance(psd: PSD, runs: Runs, dt: float, m: FloatArray) -> FloatArray:
    """Covariance of the means over time of the Haar coefficients that exist, (J, J), u^2.

    Zero at fine levels, as in `gmwm.variance.covariance.haar.mean_covariance`.
    """
    counts = runs.counts(2.0 * m)
    result = np.zeros((m.size, m.size))
    for j, pairs in enumerate(_pairs(runs, tuple(m.tolist()))):
        if pairs.is_full:
            total = pairs.grid.block**2 * np.sum(pairs.counts * _cross(psd, dt, pairs), axis=-1)
            result[j, j:] = result[j:, j] = total / (counts[j] * counts[j:])
    return result
