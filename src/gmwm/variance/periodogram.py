"""The spectrum of a series, for the uncertainty of its variances: power laws and what they miss."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import Self

import numpy as np
from scipy import fft

from gmwm._core.documents import Array
from gmwm._core.typing import FloatArray, IntArray
from gmwm.process import PANEL
from gmwm.variance import tuning
from gmwm.variance.covariance.lags import block_density


@dataclass(frozen=True, eq=False)
class Periodogram:
    """A smooth spectrum from the bins of a multitaper periodogram.

    At low frequencies few ordinates tell of the spectrum. There it is a sum of power laws fitted
    to all of them; at higher ones also what these miss in bins of a fifth of an octave. The low
    frequencies of a long series are those of means of blocks of samples, the high ones those of
    two pieces of it.

    centre: (B,), frequency of each bin, rising, cycles per sample.
    count: (B,), ordinates in it.
    mean: (B,), their mean, u^2 per cycle per block.
    peaked: (B,), mean square of the spectrum in the bin over the square of its mean.
    block: (B,), samples in a block.
    """

    centre: Array
    count: Array
    mean: Array
    peaked: Array
    block: Array

    @classmethod
    def of(cls, values: FloatArray, integral: FloatArray) -> Self:
        """From a complete series, by sine tapers (Riedel & Sidorenko 1995).

        values: (n,), about their mean.
        integral: (n + 1,), their cumulative sum, starting with 0.
        """
        bins, high = [], 0.5
        for block, pieces in _resolutions(values, integral):
            power = np.stack([_ordinates(piece) for piece in pieces])
            spacing = 1.0 / (pieces[0].size + 1)
            bins.append(_bins(power, spacing, block, high))
            high = tuning.LEAST_ORDINATE * spacing / block
        return cls(*np.concatenate(bins[::-1], axis=1))

    def check(self) -> None:
        """Raise ValueError if these are not the bins of a spectrum."""
        bins = np.array([self.centre, self.count, self.mean, self.peaked, self.block])
        if bins.ndim != 2 or not 1 <= self.centre.size <= tuning.MOST_BINS:
            raise ValueError("the spectrum is not a list of bins")
        if not np.all((bins > 0.0) & (bins <= tuning.LARGEST_VARIANCE)):
            raise ValueError("the spectrum has a bin that is not positive, or too large")
        if np.any(np.diff(self.centre, append=0.5) <= 0.0):
            raise ValueError("the frequencies of the spectrum do not rise to half the rate")
        if np.any(self.block != np.rint(self.block)) or np.any(self.count < 1.0):
            raise ValueError("the spectrum has blocks of parts of samples, or bins of no ordinate")

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        """Two-sided spectrum, u^2/Hz."""
        powers, missed = self._fit
        factor = np.exp(missed[self._bin(f * dt)])
        sine = 2.0 * np.sin(np.pi * f * dt)
        laws = np.stack([sine**law for law in tuning.LAWS])
        return np.asarray(dt * (powers @ laws) * factor)

    def root_square(self, f: FloatArray, dt: float) -> FloatArray:
        """Root of the mean square of the spectrum about a frequency, u^2/Hz."""
        return np.asarray(self.psd(f, dt) * np.sqrt(self.peaked[self._bin(f * dt)]))

    def _bin(self, f: FloatArray) -> IntArray:
        """Index of the nearest bin."""
        own = _panel(self.centre)
        return np.searchsorted(0.5 * (own[1:] + own[:-1]), _panel(f))

    @cached_property
    def _fit(self) -> tuple[FloatArray, FloatArray]:
        """Powers of the laws, u^2, (L,), and logarithms of the factors that they miss, (B,)."""
        laws = np.empty((len(tuning.LAWS), self.centre.size))
        for block in np.unique(self.block):
            own = self.block == block
            f = self.centre[own] * block
            for row, law in zip(laws, tuning.LAWS, strict=True):
                row[own] = block_density(partial(_law, law), 1.0, f, int(block))
        known = self.count / (self.count + tuning.ORDINATES_OF_BIN)
        limits = (tuning.LAW_ITERATIONS, tuning.LARGEST_MISFIT)
        powers = _fitted(self.mean, known, laws, *limits)
        ratio = np.log(self.mean / (powers @ laws))
        # Its spread, less what may be chance; small ones are as large as those of other bins.
        spread = np.maximum(1.0 / tuning.ORDINATES_OF_BIN, ratio**2 - 4.0 / self.count)
        return powers, ratio * spread / (spread + 1.0 / self.count)


def _resolutions(
    values: FloatArray, integral: FloatArray
) -> Iterator[tuple[int, list[FloatArray]]]:
    """Samples in a block and means of blocks: two pieces while they are many, then all."""

    def means(start: int, reach: int) -> FloatArray:
        if block == 1:
            return values[start : start + reach]
        return np.diff(integral[start : start + reach + 1 : block]) / block

    block, n = 1, values.size
    while n // block > tuning.MOST_OF_SPECTRUM:
        reach = tuning.PIECE_OF_SPECTRUM * block
        aside = (n - 2 * reach) // 4
        yield block, [means(aside, reach), means(n - reach - aside, reach)]
        block *= tuning.COARSER_BLOCKS
    yield block, [means(0, block * (fft.prev_fast_len(n // block + 1, real=True) - 1))]


def _ordinates(piece: FloatArray) -> FloatArray:
    """The multitaper periodogram of a piece at multiples of 1/(n + 1) from the second on.

    A sine taper is the difference of two Fourier transforms half a multiple apart or more. The
    first ordinate holds the line that is subtracted.
    """
    n = piece.size
    place = np.linspace(-1.0, 1.0, n)
    series = piece - np.mean(piece)
    series -= place * (place @ series) / (place @ place)
    transform = fft.rfft(series, 2 * (n + 1))
    power = np.zeros((n - 2) // 2 - 1)
    stop = 2 * power.size + 3
    for taper in range(1, tuning.TAPERS + 1):
        turn = np.exp(1j * np.pi * taper / (n + 1))
        own = turn * transform[4 - taper : stop - taper : 2]
        own -= transform[4 + taper : stop + taper : 2] / turn
        power += own.real**2 + own.imag**2
    return power * (0.5 / (n + 1) / tuning.TAPERS)


def _bins(power: FloatArray, spacing: float, block: int, high: float) -> FloatArray:
    """Centre, count, mean, peakedness and block of the bins below a frequency, (5, bins)."""
    least = tuning.LEAST_ORDINATE if len(power) > 1 else 2
    start, centre, width = _places(least, power.shape[1] + 2, spacing / block, high)
    power = power[:, least - 2 : least - 2 + int(np.sum(width))]
    total = np.sum(power, axis=0)
    scale = np.max(total) or 1.0
    square = np.add.reduceat(np.sum((power / scale) ** 2, axis=0), start)
    count = width * len(power)
    mean = np.maximum(np.add.reduceat(total, start) / count, 1e-12 * scale)
    excess = square / count / (mean / scale) ** 2
    excess *= (1.0 + 2.0 / count) / (1.0 + 1.0 / tuning.TAPERS)
    peaked = np.where(count >= tuning.ORDINATES_OF_BIN, np.maximum(excess, 1.0), 1.0)
    return np.stack([centre, count, mean, peaked, np.full(count.size, float(block))])


@lru_cache(maxsize=16)
def _places(
    least: int, end: int, spacing: float, high: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """First ordinate of each bin, from 0 on, their centres and numbers of ordinates.

    least: Ordinate that the first bin begins with; no bin has one from ``end`` or ``high`` on.
    """
    ordinate = np.arange(float(least), end)
    ordinate = ordinate[ordinate * spacing < high]
    start = np.flatnonzero(np.diff(_panel(ordinate * spacing), prepend=-np.inf))
    width = np.diff(start, append=ordinate.size).astype(float)
    centre = (ordinate[start] + 0.5 * (width - 1.0)) * spacing
    return start, centre, width


def _panel(f: FloatArray) -> FloatArray:
    """Number of the panel of quadratures that holds a frequency in cycles per sample."""
    return np.floor(np.log(np.abs(np.tan(np.pi * f))) / PANEL)


def _fitted(
    seen: FloatArray, count: FloatArray, laws: FloatArray, steps: int, largest: float
) -> FloatArray:
    """Powers (L,) of the likeliest sum of power laws, none negative.

    The gamma likelihood by multiplicative steps (Fevotte & Idier 2011, *Neural Computation* 23,
    2421-2456); then peaks, which no sum has, pull by no more than a factor.

    seen, count: (B,), means of so many ordinates, and their weight.
    laws: (L, B), what a power of one gives.
    steps, largest: Of each kind, and that factor.
    """
    powers = np.sum(seen) / np.sum(laws, axis=1) / len(laws)
    for step in range(2 * steps):
        implied = powers @ laws
        ratio = seen / implied
        if step >= steps:
            ratio = np.minimum(np.maximum(ratio, 1.0 / largest), largest)
        weight = count / implied
        powers *= np.sqrt((laws @ (weight * ratio)) / (laws @ weight))
    return powers


def _law(power: float, f: FloatArray, dt: float) -> FloatArray:
    return np.asarray((2.0 * np.sin(np.pi * f * dt)) ** power)
