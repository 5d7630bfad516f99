"""From the sums of a stream to its wavelet variance.

Half a window that has C of its m samples has their mean. Samples are missing at any place of the
half window equally often, as windows slide over a gap, so that mean differs from the mean of all
samples by a random part of variance

    (1/C - 1/m) L V(L, m) m / (m - L)

for gaps of L samples. V(L, m) is the variance of means of L samples about the mean of m: the sum of
the Haar wavelet variances of averaging times from L to m/2, whatever the spectrum (analysis of
variance; Percival & Walden 2000, sec. 8.1). For white noise that is (1/C - 1/m) times the variance
of a sample, exactly. Gaps that follow each other closely count as shorter ones: with a share p
missing at random, runs of missing samples have the mean 1/(1 - p) but the effect of single ones, so
L is the length times 1 - p. All variances needed are those of finer levels, so the part is
subtracted level by level.
"""

from __future__ import annotations

import numpy as np

from gmwm._core.typing import FloatArray, IntArray
from gmwm.errors import InputError
from gmwm.readers import Channel
from gmwm.variance import tuning
from gmwm.variance.covariance.haar import dyadic_levels
from gmwm.variance.gaps import GapEffects
from gmwm.variance.series import MIN_SAMPLES, check_varies, cumulant_of_powers, where_of
from gmwm.variance.stream_kernels import (
    BLOCKS,
    COUNT,
    FOURTH,
    HIGHEST,
    LOST_FOURTH,
    LOST_MEAN,
    LOST_SQUARE,
    LOST_SUM,
    LOWEST,
    MEAN,
    MISSING,
    REFERENCE,
    SCARCITY,
    SQUARE,
    SUM,
    N,
    Sums,
    coarsened,
    offsets,
)
from gmwm.variance.wavelet import WaveletVariance


def variance_of(sums: Sums, channel: Channel, confidence: float) -> WaveletVariance:
    """The wavelet variance of a stream that is worked off.

    channel: Without samples: its name, quantity, unit and sampling interval.
    Raises InputError if it is too short, constant or of no sensor's size.
    """
    where, totals = where_of(channel), sums.totals
    n, missing = int(sums.tallies[N]), int(sums.tallies[MISSING])
    if n - missing < MIN_SAMPLES:
        raise InputError(f"{where} has {n - missing} samples: {MIN_SAMPLES} or more are needed")
    low = float(totals[REFERENCE] + totals[LOWEST])
    spread = max(float(totals[HIGHEST] - totals[LOWEST]), 0.0)
    check_varies(Channel(channel.name, np.array([low, low + spread]), channel.dt))
    windows = sums.levels[:, COUNT]
    size = min(int(np.sum(np.cumprod(windows > 0.0))), dyadic_levels(n).size)
    if not size:
        raise InputError(
            f"{where} has no two samples without a missing one between them: nothing can be "
            "determined of its noise"
        )
    levels, windows = sums.levels[:size], windows[:size]
    mean = (levels[:, MEAN] + levels[:, LOST_MEAN]) / windows
    square = (levels[:, SQUARE] + levels[:, LOST_SQUARE]) / windows
    fourth = 16.0 * float(totals[FOURTH] + totals[LOST_FOURTH]) / float(windows[0])
    cumulant = cumulant_of_powers(4.0 * float(square[0]), fourth, float(windows[0]))
    gaps = None
    if missing:
        square, change = unmasked(square, levels[:, SCARCITY] / windows, sums.gaps, missing / n)
        gaps = effects(n, missing, sums.gaps, windows, change)
    else:
        for level in range(max(size - 2, 0), size):
            mean[level], square[level] = _of_few_windows(level, mean[level], square[level], sums)
    blocks, block = _block_means(sums)
    return WaveletVariance(
        tau=dyadic_levels(2**size) * channel.dt,
        variance=square,
        mean=mean,
        blocks=blocks,
        block=block,
        n=n,
        dt=channel.dt,
        confidence=confidence,
        name=channel.name,
        quantity=channel.quantity,
        unit=channel.unit or "u",
        gaps=gaps,
        fourth_cumulant=cumulant,
    )


def _block_means(sums: Sums) -> tuple[FloatArray, int]:
    """Means of blocks about the mean of the series, NaN where half of one is missing; their size.

    There are fewer of them where samples are missing, for the covariance of blocks with gaps.
    """
    n, missing, _, count, octave = sums.tallies.tolist()
    most = tuning.MOST_BLOCKS_WITH_GAPS if missing else tuning.MOST_BLOCKS
    values, there = sums.blocks[:, : sums.tallies[BLOCKS]].copy()
    while count > most:
        count = coarsened(values, there, count)
        octave += 1
    mean = float(sums.totals[SUM] + sums.totals[LOST_SUM]) / (n - missing)
    enough = there[:count] >= tuning.LEAST_OF_BLOCK * 2**octave
    return np.where(enough, values[:count] - mean, np.nan), 1 << octave


def _of_few_windows(level: int, mean: float, square: float, sums: Sums) -> tuple[float, float]:
    """Means of the coefficients of one of the two coarsest levels, and of their squares.

    Where there are few windows, nearly all of them are known from the marks; between those that
    are, lines are straight. Where there are many, those at multiples of 1/512 of the averaging time
    are known. The first and the last of these stand for half as many others, and the last also for
    those after it.

    mean, square: Over the windows at multiples.
    """
    m = 1 << level
    count = int(sums.tallies[N]) - 2 * m + 1
    if m <= tuning.STREAMING_STARTS:
        return mean, square
    begins = offsets()[: int(np.searchsorted(offsets(), count))]
    marked = sums.marks[:, 0].tolist()
    if not {0, m, 2 * m} <= set(marked):
        return mean, square
    first, middle, last = (sums.marks[marked.index(at), 1:][: begins.size] for at in (0, m, 2 * m))
    w = (last - 2.0 * middle + first) * (0.5 / m)
    if not np.all(np.isfinite(w)):
        return mean, square
    if count <= tuning.FEW_WINDOWS * m:
        steps = np.diff(begins, append=count)
        weights = np.append(0.5 * (steps[:-1] + 1.0), float(steps[-1]))
        weights[1:] += 0.5 * (steps[:-1] - 1.0)
        return float(weights @ w / count), float(weights @ w**2 / count)
    step = m // tuning.STREAMING_STARTS
    multiples, rest = divmod(count - 1, step)
    ends = np.array([-0.5 * (step - 1), rest - 0.5 * (step - 1)])
    known = step * (multiples + 1)
    return (
        float(known * mean + ends @ w[[0, -1]]) / count,
        float(known * square + ends @ w[[0, -1]] ** 2) / count,
    )


# -- missing samples -------------------------------------------------------------------------------


def unmasked(
    square: FloatArray, scarcity: FloatArray, gaps: IntArray, missing: float
) -> tuple[FloatArray, FloatArray]:
    """Variances without what missing samples add, and that relative to them, (J,) each.

    square: (J,), mean squares of the coefficients.
    scarcity: (J,), mean over windows of a quarter of 1/C - 1/m, for both halves together.
    gaps: (G, 2), number of gaps of up to 2^i samples, and samples they have.
    missing: Share of the samples that are missing.
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
        # Relative to what is expected: few windows that came out small by chance would weigh least.
        # No level is below half of the one before but by chance, or where steps are rounded.
        usual = max(variance[j], 0.5 * usual)
        change[j] = added / usual if usual > 0.0 else 0.0
    return variance, change


def _spread(variance: FloatArray, length: float) -> float:
    """Variance of means of ``length`` samples within the next averaging time.

    Between octaves as for white noise.
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

    A share p of the windows of a level is left. Windows left out singly cost little, since their
    neighbours say the same; as many in a row as are correlated cost 1/p.

    n, missing: Samples.
    gaps: (G, 2), number of gaps of up to 2^i samples, and samples they have.
    windows, change: (J,), number of windows used, and the change that `unmasked` finds.
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
