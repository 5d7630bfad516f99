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
    to all of them; at higher ones also what these miss in bins of a quarter octave.

    knots: (B,), lowest frequency of each bin, cycles per sample.
    powers: (L,), of the power laws in 2 sin(pi f), u^2.
    missed: (B,), logarithm of the factor that the power laws miss.
    peaked: (B,), mean square of the spectrum in a bin over the square of its mean.
    """

    knots: FloatArray
    powers: FloatArray
    missed: FloatArray
    peaked: FloatArray

    @classmethod
    def of(cls, values: FloatArray) -> Periodogram:
        """From a complete series, by sine tapers (Riedel & Sidorenko 1995).

        values: (n,), any level.
        """
        n = values.size
        place = np.linspace(-1.0, 1.0, n)
        series = values - np.mean(values)
        series -= place * (place @ series) / (place @ place)
        scale = np.sqrt(np.mean(series**2)) or 1.0
        power = np.zeros((n - 1) // 2)
        for taper in range(1, tuning.TAPERS + 1):
            weight = np.sin(0.5 * np.pi * taper * (place * (n - 1) / (n + 1) + 1.0))
            power += np.abs(fft.rfft(series / scale * weight)[1 : power.size + 1]) ** 2
        power *= 2.0 / (n + 1) / tuning.TAPERS
        f = np.arange(1, power.size + 1) / n
        first = tuning.TAPERS // 2  # lower ones hold the line that was subtracted
        number = np.floor(tuning.BINS_OF_SPECTRUM * np.log2(f / f[first])).astype(int)[first:]
        start = first + np.flatnonzero(np.diff(number, prepend=-1))
        count = np.diff(start, append=power.size).astype(float)
        mean, square, knots = (
            np.add.reduceat(each, start) / count for each in (power, power**2, f)
        )
        edges = f[start]
        mean = np.maximum(mean, 1e-12 * np.max(mean))
        laws = law_values(knots)
        powers = power_laws(mean, count, laws)
        excess = square / mean**2 / (1.0 + 1.0 / tuning.TAPERS) * (1.0 + 2.0 / count)
        peaked = np.where(count >= tuning.ORDINATES_OF_BIN, np.maximum(excess, 1.0), 1.0)
        missed = missing(mean / (powers @ laws), count)
        return cls(edges, scale**2 * powers, missed, peaked)

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        """Two-sided spectrum, u^2/Hz."""
        missed = self.missed[self._bin(f * dt)]
        return np.asarray(dt * (self.powers @ law_values(f * dt)) * np.exp(missed))

    def square(self, f: FloatArray) -> FloatArray:
        """Mean square of the spectrum about a frequency in cycles per sample, u^4."""
        return np.asarray(self.psd(f, 1.0) ** 2 * self.peaked[self._bin(f)])

    def _bin(self, f: FloatArray) -> IntArray:
        return np.maximum(np.searchsorted(self.knots, f, side="right") - 1, 0)


def power_laws(seen: FloatArray, count: FloatArray, laws: FloatArray) -> FloatArray:
    """Non-negative powers (L,) of the likeliest sum of power laws.

    The gamma likelihood by multiplicative steps, none of which lowers it (Fevotte & Idier 2011,
    *Neural Computation* 23, 2421-2456); what no sum explains is bounded then.

    seen: (B,), estimates, positive.
    count: (B,), independent values of which each is the mean.
    laws: (L, B), what a power of one gives.
    """
    powers = np.mean(seen) / np.mean(laws, axis=1) / len(laws)
    known = count / (count + tuning.ORDINATES_OF_BIN)
    for bound in (np.inf, tuning.LARGEST_MISFIT):
        for _ in range(tuning.LAW_ITERATIONS):
            ratio = np.clip(seen / (powers @ laws), 1.0 / bound, bound)
            share = laws * (known / (powers @ laws))
            powers = powers * np.sqrt(share @ ratio / np.sum(share, axis=1))
    return powers


def missing(ratio: FloatArray, count: FloatArray) -> FloatArray:
    """Logarithm of what power laws miss, less what may be chance, (B,).

    ratio: (B,), of estimates to what the power laws imply.
    """
    log = np.log(ratio)
    spread = np.maximum(1.0 / tuning.ORDINATES_OF_BIN, log**2 - 4.0 / count)
    return np.asarray(log * spread / (spread + 1.0 / count))


def law_values(f: FloatArray) -> FloatArray:
    return (2.0 * np.sin(np.pi * f)) ** np.array(tuning.LAWS)[:, None]
