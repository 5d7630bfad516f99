"""Sums over lags of the covariances of Haar coefficients: the hot loop of their matrix."""

from __future__ import annotations

import numpy as np

from gmwm._core.compiled import compiled
from gmwm._core.typing import FloatArray, IntArray


@compiled(fastmath={"reassoc", "contract"})
def lag_sums(
    once: FloatArray, averaging: IntArray, zero: FloatArray, counts: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sums over the lags of covariances and their squares, for each pair of levels, (L, L).

    The gain of a Haar filter over its phase is (1 - cos(2 pi m f)) / (2 m sin(pi f)), so that a
    covariance is a second difference over the averaging time m of the coarser level.

    once: (L, size), covariances by lag of a level with that of which it is the second difference,
        one period.
    averaging: (L,) of int, averaging times, rising, in lags.
    zero: (L, L), what the bin at zero frequency adds, which no difference shows.
    counts: (L, L, H), weights of the lags from zero on, of those that there are.
    weights: (H,), of all of them.
    Returns: mean (L, L), sum of covariances times counts; above the diagonal, as are the others;
        square, whole (L, L), sums of their squares, times counts and times weights.
    """
    levels, size = once.shape
    lags, longest = weights.size, averaging[-1]
    shape = (levels, levels)
    mean, square, whole = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    around = np.empty(lags + 2 * longest)
    for j in range(levels):
        around[:longest] = once[j, size - longest :]
        around[longest:] = once[j, : lags + longest]
        # Of views that begin at zero: what an index may be below zero for is not vectorized.
        middle = around[longest:]
        for k in range(j, levels):
            m = averaging[k]
            before, after = around[longest - m :], around[longest + m :]
            scale, own, constant = 0.5 / m, counts[j, k], zero[j, k]
            plain, squared, total = 0.0, 0.0, 0.0
            for h in range(lags):
                value = scale * (middle[h] - 0.5 * (after[h] + before[h])) + constant
                plain += own[h] * value
                squared += own[h] * value * value
                total += weights[h] * value * value
            mean[j, k], square[j, k], whole[j, k] = plain, squared, total
    return mean, square, whole
