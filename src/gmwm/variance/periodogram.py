"""The spectrum of a series, for the uncertainty of its variances: power laws and what they miss."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

from gmwm._core.typing import FloatArray, IntArray
from gmwm.variance import tuning


@dataclass(frozen=True, eq=False)
class Periodogram:
    """A smooth spectrum from a multitaper periodogram.

    At low frequencies few ordinates tell of the spectrum. There it is a sum of power laws fitted
    to all of them; at higher ones also what these miss in bins of an eighth of an octave.

    lowest: (B,), lowest frequency of each bin, cycles per sample.
    powers: (L,), of the power laws in 2 sin(pi f), u^2.
    missed: (B,), logarithm of the factor that the power laws miss.
    peaked: (B,), mean square of the spectrum in a bin over the square of its mean.
    """

    lowest: FloatArray
    powers: FloatArray
    missed: FloatArray
    peaked: FloatArray

    @classmethod
    def of(cls, values: FloatArray) -> Periodogram:
        """From a complete series, by sine tapers (Riedel & Sidorenko 1995).

        values: (n,), about their mean.
        """
        n = values.size
        place = np.linspace(-1.0, 1.0, n)
        series = values - place * (place @ values) / (place @ place)
        scale = np.sqrt(np.mean(series**2)) or 1.0
        power = np.zeros((n - 1) // 2)
        for taper in range(1, tuning.TAPERS + 1):
            weight = np.sin(0.5 * np.pi * taper * (place * (n - 1) / (n + 1) + 1.0))
            power += np.abs(fft.rfft(series / scale * weight)[1 : power.size + 1]) ** 2
        power *= 2.0 / (n + 1) / tuning.TAPERS
        # The first ordinate holds the line that was subtracted.
        f, power = np.arange(2, power.size + 1) / n, power[1:]
        bins = np.floor(tuning.SPECTRUM_BINS_PER_OCTAVE * np.log2(f / f[0]))
        start = np.flatnonzero(np.diff(bins, prepend=-1.0))
        count = np.diff(start, append=power.size).astype(float)
        sums = np.add.reduceat(np.stack([power, power**2, f]), start, axis=1)
        mean, square, centre = sums / count
        mean = np.maximum(mean, 1e-12 * np.max(mean))
        laws = _laws(centre)
        powers = _fitted(mean, count, laws)
        excess = square / mean**2 / (1.0 + 1.0 / tuning.TAPERS) * (1.0 + 2.0 / count)
        peaked = np.where(count >= tuning.ORDINATES_OF_BIN, np.maximum(excess, 1.0), 1.0)
        ratio = np.log(mean / (powers @ laws))
        # Its spread, less what may be chance; small ones are as large as those of other bins.
        spread = np.maximum(1.0 / tuning.ORDINATES_OF_BIN, ratio**2 - 4.0 / count)
        missed = ratio * spread / (spread + 1.0 / count)
        return cls(f[start], scale**2 * powers, missed, peaked)

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        """Two-sided spectrum, u^2/Hz."""
        missed = self.missed[self._bin(f * dt)]
        return np.asarray(dt * (self.powers @ _laws(f * dt)) * np.exp(missed))

    def square(self, f: FloatArray) -> FloatArray:
        """Mean square of the spectrum about a frequency in cycles per sample, u^4."""
        return np.asarray(self.psd(f, 1.0) ** 2 * self.peaked[self._bin(f)])

    def _bin(self, f: FloatArray) -> IntArray:
        return np.maximum(np.searchsorted(self.lowest, f, side="right") - 1, 0)


def _fitted(seen: FloatArray, count: FloatArray, laws: FloatArray) -> FloatArray:
    """Powers (L,) of the likeliest sum of power laws, none negative.

    The gamma likelihood by multiplicative steps (Fevotte & Idier 2011, *Neural Computation* 23,
    2421-2456); then peaks, which no sum has, pull by no more than a factor.

    seen, count: (B,), means of so many ordinates.
    laws: (L, B), what a power of one gives.
    """
    powers = np.mean(seen) / np.mean(laws, axis=1) / len(laws)
    known = count / (count + tuning.ORDINATES_OF_BIN)
    for bound in (np.inf, tuning.LARGEST_MISFIT):
        for _ in range(tuning.LAW_ITERATIONS):
            implied = powers @ laws
            share = laws * (known / implied)
            ratio = np.clip(seen / implied, 1.0 / bound, bound)
            powers = powers * np.sqrt(share @ ratio / np.sum(share, axis=1))
    return powers


def _laws(f: FloatArray) -> FloatArray:
    return (2.0 * np.sin(np.pi * f)) ** np.array(tuning.LAWS)[:, None]
