"""Covariance of the wavelet variances estimated from the coefficients themselves.

Eq. (4-5) of Stebler et al. (2012), after Serroukh, Walden & Percival (2000), *JASA* 95, 184-196:
sums over all lags of squared sample cross-covariances of two levels' coefficients. By Parseval's
theorem these are sums over frequencies of products of periodograms, so that all pairs of levels are
one Gram matrix, positive semi-definite whatever the data.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.variance import tuning

WINDOWS = ("none", "octave")
_SLICE = 1 << 16


def data_covariance(
    coefficients: Iterable[FloatArray], longest: int, window: str = "none"
) -> FloatArray:
    """Covariance of the mean squares of several levels' coefficients.

    coefficients: iterable of (M_j,), one array a level.
    longest: The largest M_j, which is not that of the finest where only coarser ones bridge gaps.
    window: {"none", "octave"}, "none" takes all lags, as eq. (5) does: unbiased, but as noisy as a
        periodogram. "octave" averages the cross-spectra over an eighth of an octave first, which is
        a lag window whose length grows with the period: for long records.
    Returns: (J, J), u^4, positive semi-definite.
    Raises InputError if ``window`` is unknown.
    """
    if window not in WINDOWS:
        raise InputError(f"window = {window!r}: known are {', '.join(WINDOWS)}")
    size = fft.next_fast_len(longest, real=True)
    transforms, counts = _transforms(coefficients, size)
    edges = _edges(transforms[0].size, window)
    width = np.diff(np.append(edges, transforms[0].size)).astype(float)
    # A mean of b cross-periodograms has the expected square S^2 (1 + 1/b).
    weight = 2.0 * width / (1.0 + 1.0 / width) / (0.5 * size)
    weight[0] *= 0.5  # frequency zero has no negative counterpart
    if window == "none":
        gram = _products(transforms, weight)
    else:
        gram = _smoothed_products(transforms, edges, width, weight)
    return gram / np.maximum.outer(counts, counts)


def _transforms(
    coefficients: Iterable[FloatArray], size: int
) -> tuple[list[FloatArray], FloatArray]:
    """Normalised transforms of a size, and numbers of coefficients.

    Their mean is not removed, frequency zero not left out: at coarse levels that would take most of
    what there is, and a level of no variance would have all the weight.
    """
    found, counts = [], []
    for level in coefficients:
        found.append(fft.rfft(level, size)[: size // 2] / np.sqrt(level.size))
        counts.append(level.size)
    return found, np.array(counts, dtype=float)


def _edges(count: int, window: str) -> NDArray[np.int64]:
    """First frequency of each bin."""
    if window == "none":
        return np.arange(count, dtype=np.int64)
    bins = int(np.ceil(np.log2(count) * tuning.BINS_PER_OCTAVE)) + 1
    edges = np.unique(np.floor(np.geomspace(1.0, count, bins)).astype(int)) - 1
    return edges[edges < count]


def _products(transforms: list[FloatArray], weight: FloatArray) -> FloatArray:
    """Weighted sums of products of periodograms, a slice of frequencies at a time."""
    total = np.zeros((len(transforms), len(transforms)))
    for start in range(0, transforms[0].size, _SLICE):
        part = slice(start, start + _SLICE)
        power = np.stack([np.abs(values[part]) ** 2 for values in transforms])
        total += (power * weight[part]) @ power.T
    return total


def _smoothed_products(
    transforms: list[FloatArray], edges: NDArray[np.int64], width: FloatArray, weight: FloatArray
) -> FloatArray:
    """Weighted sums of squared moduli of cross-spectra averaged over bins."""
    total = np.zeros((len(transforms), len(transforms)))
    for j, first in enumerate(transforms):
        for k in range(j, len(transforms)):
            cross = np.add.reduceat(first * np.conj(transforms[k]), edges) / width
            total[j, k] = total[k, j] = weight @ np.abs(cross) ** 2
    return total
