"""Covariance of Haar wavelet variances of a series with gaps.

The pairs of coefficients that exist take the place of those of a complete series in the sum of
`gmwm.variance.covariance`,

    cov(nu2_j, nu2_k) = 2 / (M_j M_k) sum_h c_jk(h) g_jk(h)^2,

at every level and not only at coarse ones: runs between gaps may be short. The sum over lags is
taken on means of blocks of an eighth of the averaging time, over lags of up to a hundred averaging
times.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import fft

from gmwm._typing import FloatArray
from gmwm.process.spectral import PSD
from gmwm.variance.covariance import block_spectrum, integrals
from gmwm.variance.runs import Runs, pair_counts

_BLOCKS_PER_AVERAGE = 8
_FULL = 1024  # blocks in the record up to which all lags are taken
_WINDOW = 2048
_NEIGHBOURS = 3  # levels whose products are summed by lags where the window is not the record


@dataclass(frozen=True, eq=False)
class _Grid:
    """Lags of one level with itself and coarser ones; nothing depends on the spectrum."""

    block: int
    size: int
    is_full: bool
    frequency: FloatArray
    amplitude: FloatArray
    counts: FloatArray
    centred: FloatArray  # pairs of all coarser levels whose centres coincide


@lru_cache(maxsize=8)
def _grids(runs: Runs, averaging: tuple[float, ...]) -> tuple[_Grid, ...]:
    m = np.array(averaging, dtype=int)
    grids = []
    for j, m_j in enumerate(m):
        block = max(int(m_j) // _BLOCKS_PER_AVERAGE, 1)
        length = -(-runs.n // block)
        is_full = length <= _FULL
        size = fft.next_fast_len(3 * length, real=True) if is_full else _WINDOW
        size += size % 2
        frequency = np.arange(size // 2 + 1) / size
        frequency[0] = 1e-4 / size
        coarse = m[j:] if is_full else m[j : j + _NEIGHBOURS]
        scaled = coarse[:, None] / block
        amplitude = np.sin(np.pi * scaled * frequency) ** 2 / (scaled * np.sin(np.pi * frequency))
        lag = np.arange(size)
        lag[size // 2 + 1 :] -= size
        occupancy = [runs.occupancy(2 * int(m_k), block) for m_k in m[j:]]
        shift = (m_j - m[j:]) // block
        counts = np.stack(
            [pair_counts(occupancy[0], occupancy[k], lag + shift[k]) for k in range(coarse.size)]
        )
        centred = np.array(
            [
                pair_counts(occupancy[0], o, s[None])[0]
                for o, s in zip(occupancy, shift, strict=True)
            ]
        )
        grids.append(_Grid(block, size, is_full, frequency, amplitude, counts, centred))
    return tuple(grids)


def _cross(psd: PSD, dt: float, grid: _Grid) -> FloatArray:
    """Cross-covariances of the level with the coarser ones, (K, size), u^2."""
    spectrum = block_spectrum(psd, dt, grid.frequency, grid.size, grid.block)
    return np.asarray(fft.irfft(grid.amplitude[0] * grid.amplitude * spectrum, grid.size, axis=-1))


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
    grids = _grids(runs, tuple(m.tolist()))
    pairs = np.zeros((m.size, m.size))
    kept = np.empty(m.size)  # of the pairs at equal centres, averaged over the lags that matter
    for j, grid in enumerate(grids):
        square = _cross(psd, dt, grid) ** 2
        found = np.sum(grid.counts * square, axis=-1) / np.sum(square, axis=-1)
        kept[j] = found[0] / grid.centred[0]
        pairs[j, j : j + found.size] = grid.block * found
    for j, grid in enumerate(grids):
        far = j + grid.counts.shape[0]
        pairs[j, far:] = grid.block * grid.centred[far - j :] * kept[far:]
    pairs = np.triu(pairs) + np.triu(pairs, 1).T
    counts = runs.counts(2.0 * m)
    return integrals(psd, dt, m) * pairs / np.outer(counts, counts)


def gappy_mean_covariance(psd: PSD, runs: Runs, dt: float, m: FloatArray) -> FloatArray:
    """Covariance of the means over time of the Haar coefficients that exist, (J, J), u^2.

    Zero at fine levels, as in `gmwm.variance.covariance.mean_covariance`.
    """
    counts = runs.counts(2.0 * m)
    result = np.zeros((m.size, m.size))
    for j, grid in enumerate(_grids(runs, tuple(m.tolist()))):
        if grid.is_full:
            total = grid.block**2 * np.sum(grid.counts * _cross(psd, dt, grid), axis=-1)
            result[j, j:] = result[j:, j] = total / (counts[j] * counts[j:])
    return result
