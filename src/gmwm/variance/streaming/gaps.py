"""What missing samples do to the variances of a stream.

Half a window whose C of m samples are there has their mean. With samples missing at any place of
the half window equally often, as windows slide over a gap, that mean differs from the mean of all
samples by a random part of variance

    (1/C - 1/m) L V(L, m) m / (m - L)

for gaps of L samples, where V(L, m) is the variance of means of L samples about the mean of m: the
sum of the Haar wavelet variances of averaging times from L to m/2, whatever the spectrum (analysis
of variance; Percival & Walden 2000, sec. 8.1). For white noise that is (1/C - 1/m) times the
variance of a sample, exactly. Gaps that follow each other closely are as good as shorter ones: with
a part p missing at random, runs of missing samples have the mean 1/(1 - p), but the effect of
single ones, so that L is the length times 1 - p. All variances that are needed are those of finer
levels, so that the part is taken off level by level.
"""

from __future__ import annotations

import numpy as np

from gmwm._core.typing import FloatArray, IntArray
from gmwm.variance import tuning
from gmwm.variance.gaps import GapEffects


def unmasked(
    square: FloatArray, scarcity: FloatArray, gaps: IntArray, missing: float
) -> tuple[FloatArray, FloatArray]:
    """Variances without what missing samples add, and that relative to them, (J,) each.

    square: (J,), mean squares of the coefficients.
    scarcity: (J,), mean over windows of a quarter of 1/C - 1/m, for both halves together.
    gaps: (G, 2), number of gaps of up to 2^i samples, and samples that they have.
    missing: Part of the samples that are missing.
    """
    there = gaps[:, 0] > 0
    samples = gaps[there, 1].astype(float)
    length = np.maximum(samples / gaps[there, 0] * (1.0 - missing), 1.0)
    variance, change, usual = np.zeros(square.size), np.zeros(square.size), 0.0
    for j in range(square.size):
        m = 2.0**j
        within = length < tuning.LONGEST_WITHIN * m
        added = 0.0
        if np.any(within) and scarcity[j] > 0.0:
            own = length[within]
            spread = np.array([_spread(variance[:j], each) for each in own])
            each = own * spread * m / (m - own)
            added = scarcity[j] * float(np.average(each, weights=samples[within]))
        variance[j] = max(square[j] - added, square[j] / (1.0 + tuning.STREAMING_LARGEST_CHANGE))
        # Relative to what is expected: where few windows came out small by chance, they would weigh
        # least. No level is below half of the one before but by chance, or where steps are rounded.
        usual = max(variance[j], 0.5 * usual)
        change[j] = added / usual if usual > 0.0 else 0.0
    return variance, change


def _spread(variance: FloatArray, length: float) -> float:
    """Variance of means of so many samples within the next averaging time.

    Between octaves as that of white noise.
    """
    octave = int(np.log2(length))
    if octave >= variance.size:
        return 0.0
    part = 2.0 ** (octave + 1) / length - 1.0
    return float(part * variance[octave] + np.sum(variance[octave + 1 :]))


def effects(
    n: int, missing: int, gaps: IntArray, windows: FloatArray, change: FloatArray
) -> GapEffects:
    """What the gaps do to the levels.

    A part p of the windows of a level is left. Left out singly they cost little, since their
    neighbours say the same; as many in a row as are correlated cost 1/p.

    n, missing: Samples.
    gaps: (G, 2), number of gaps of up to 2^i samples, and samples that they have.
    windows: (J,), number of windows that were used.
    change: (J,).
    """
    m = 2.0 ** np.arange(windows.size)
    step = np.maximum(m / tuning.STREAMING_STARTS, 1.0)
    complete = np.floor(n / step) - 2.0 * m / step + 1.0
    left = np.minimum(windows / np.maximum(complete, 1.0), 1.0)
    # Sum of the squared autocorrelation of white noise over all lags.
    alike = np.maximum(tuning.ALIKE * m / step, 1.0)
    # Most are left out for a gap that takes an end of half a window.
    edge = np.maximum(m / tuning.STREAMING_EDGE, np.minimum(m, tuning.STREAMING_LEAST_EDGE))
    number = np.array([np.sum(gaps[int(np.ceil(np.log2(max(each, 1.0)))) :, 0]) for each in edge])
    run = np.maximum(complete - windows, 0.0) / np.maximum(number, 1.0)
    growth = 1.0 + (1.0 / left - 1.0) * np.minimum(run * left / alike, 1.0)
    deviation = np.sqrt(growth) * (1.0 + change)
    common = np.sqrt(np.minimum.outer(left, left) / np.maximum.outer(left, left))
    return GapEffects(missing, windows * step, change, np.outer(deviation, deviation) * common)
