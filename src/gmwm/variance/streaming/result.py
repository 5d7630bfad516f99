"""From the sums of a stream to its wavelet variance."""

from __future__ import annotations

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.readers import Channel
from gmwm.variance import tuning
from gmwm.variance.analysis import MIN_SAMPLES, check_varies, cumulant_of_powers, where_of
from gmwm.variance.covariance.haar import dyadic_levels
from gmwm.variance.streaming.gaps import effects, unmasked
from gmwm.variance.streaming.series import Series
from gmwm.variance.wavelet import WaveletVariance


def variance_of(series: Series, channel: Channel, confidence: float) -> WaveletVariance:
    """The wavelet variance of the samples so far.

    channel: Of any samples: what it is called and measures.
    Raises InputError if it is too short, constant or of no sensor's size.
    """
    where = where_of(channel)
    there = series.n - series.missing
    if there < MIN_SAMPLES:
        raise InputError(f"{where} has {there} samples: {MIN_SAMPLES} or more are needed")
    low = series.lowest
    check_varies(Channel(channel.name, np.array([low, low + series.spread]), channel.dt))
    done = series.finished(goes_on=False)
    windows, mean, square, scarcity = done.level_sums()
    size = min(int(np.sum(np.cumprod(windows > 0.0))), dyadic_levels(series.n).size)
    if not size:
        raise InputError(
            f"{where} has no two samples without a missing one between them: nothing can be "
            "determined of its noise"
        )
    windows, mean, square, scarcity = (each[:size] for each in (windows, mean, square, scarcity))
    for level in range(max(size - 2, 0), size):
        mean[level], square[level] = done.of_ends(level, float(mean[level]), float(square[level]))
    variance, gaps = square, None
    if series.missing:
        variance, change = unmasked(square, scarcity, done.gaps, series.missing / series.n)
        gaps = effects(series.n, series.missing, done.gaps, windows, change)
    blocks, block = _blocks(done)
    return WaveletVariance(
        tau=dyadic_levels(2**size) * channel.dt,
        variance=variance,
        mean=mean,
        blocks=blocks,
        block=block,
        n=series.n,
        dt=channel.dt,
        confidence=confidence,
        name=channel.name,
        quantity=channel.quantity,
        unit=channel.unit or "u",
        gaps=gaps,
        fourth_cumulant=cumulant_of_powers(
            4.0 * float(square[0]), 16.0 * done.fourth_power, float(windows[0])
        ),
    )


def _blocks(series: Series) -> tuple[FloatArray, int]:
    """Means of blocks about the mean of the series, NaN where half of one is missing; their size.

    There are as few as the covariance of blocks with gaps needs, where there are gaps.
    """
    most = tuning.MOST_BLOCKS_WITH_GAPS if series.missing else tuning.MOST_BLOCKS
    means, there, block = series.block_means(most)
    return np.where(there >= tuning.LEAST_OF_BLOCK * block, means - series.mean, np.nan), block
