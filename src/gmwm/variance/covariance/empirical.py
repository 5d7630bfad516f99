"""Covariance of the wavelet variances estimated from the coefficients themselves.

Eq. (4-5) of Stebler et al. (2012), after Serroukh, Walden & Percival (2000), *JASA* 95, 184-196:
sums over all lags of squared sample cross-covariances of two levels' coefficients. By Parseval's
theorem these are sums over frequencies of products of periodograms, so that all pairs of levels are
one Gram matrix, positive semi-definite whatever the data.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy import fft

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.variance import tuning

WINDOWS = ("none", "octave")


def data_covariance(
    coefficients: Iterable[FloatArray], longest: int, window: str = "none"
) -> FloatArray:
    """Covariance of the mean squares of several levels' coefficients.

    coefficients: iterable of (M_j,), one array a level.
    longest: The largest M_j; not that of the finest level where only coarser ones bridge gaps.
    window: {"none", "octave"}, "none" takes all lags, as eq. (5) does: unbiased, but as noisy as a
        periodogram. "octave" averages the cross-spectra over an eighth of an octave first, a lag
        window whose length is proportional to the period: for long records.
    Returns: (J, J), u^4, positive semi-definite.
    Raises InputError if ``window`` is unknown.
    """
    if window not in WINDOWS:
        raise InputError(f"window = {window!r}: known are {', '.join(WINDOWS)}")
    size = fft.next_fast_len(longest, real=True)
    # The mean is not removed, frequency zero not left out: at coarse levels that would take most of
    # the power, and a level of no variance would have all the weight.
    levels = list(coefficients)
    counts = np.array([level.size for level in levels], dtype=float)
    transforms = [fft.rfft(each, size)[: size // 2] / np.sqrt(each.size) for each in levels]
    bins = np.arange(size // 2)
    if window == "octave":
        number = int(np.ceil(np.log2(size // 2) * tuning.BINS_PER_OCTAVE)) + 1
        bins = np.unique(np.floor(np.geomspace(1.0, size // 2, number)).astype(int)) - 1
        bins = bins[bins < size // 2]
    width = np.diff(np.append(bins, size // 2)).astype(float)
    # A mean of b cross-periodograms has the expected square S^2 (1 + 1/b).
    weight = 2.0 * width / (1.0 + 1.0 / width) / (0.5 * size)
    weight[0] *= 0.5  # frequency zero has no negative counterpart
    if window == "none":
        power = np.abs(np.stack(transforms)) ** 2
        gram = (power * weight) @ power.T
    else:
        gram = np.zeros((counts.size, counts.size))
        for j, first in enumerate(transforms):
            for k in range(j, counts.size):
                cross = np.add.reduceat(first * np.conj(transforms[k]), bins) / width
                gram[j, k] = gram[k, j] = weight @ np.abs(cross) ** 2
    return np.asarray(gram / np.maximum.outer(counts, counts))
