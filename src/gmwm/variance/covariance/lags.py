"""Sums over lags by FFT: the lags, the frequencies, and means of blocks of samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy import fft

from gmwm._core.typing import FloatArray
from gmwm.process import PSD, in_hertz, legendre
from gmwm.variance import tuning

_ZERO = 1e-4  # of a bin: the frequency that stands for zero


@dataclass(frozen=True)
class LagGrid:
    """Lags of covariances that are found by FFT, in blocks of samples.

    size: Number of lags, even.
    block: Samples from lag to lag.
    """

    size: int
    block: int

    @classmethod
    def holding(cls, lags: float, block: int) -> LagGrid:
        """A grid of at least so many lags, of a size that is quick to transform."""
        size = int(fft.next_fast_len(int(lags), real=True))
        return cls(size + size % 2, block)

    @cached_property
    def frequency(self) -> FloatArray:
        """Fourier frequencies, cycles per block; a small one stands for zero."""
        result = np.arange(self.size // 2 + 1) / self.size
        result[0] = _ZERO / self.size
        return result

    @cached_property
    def folds(self) -> tuple[FloatArray, FloatArray, _Folds]:
        """Frequencies and weights within the bin at zero, and the folds of all frequencies."""
        x, w = legendre(8)
        near = 0.25 / self.size * (x + 1.0)
        folds = _Folds.of(np.concatenate([self.frequency, near]), self.block)
        folds.frequency.flags.writeable = False  # spectra of it are cached
        return near, w, folds

    @cached_property
    def lag(self) -> npt.NDArray[np.intp]:
        """Lags in blocks, the negative ones at the end."""
        result = np.arange(self.size)
        result[self.size // 2 + 1 :] -= self.size
        return result

    def transform(self, spectrum: FloatArray) -> FloatArray:
        """Covariances at the lags from spectra at the frequencies, along the last axis."""
        return np.asarray(fft.irfft(spectrum, self.size, axis=-1))


def block_of(n: int) -> tuple[int, int]:
    """Samples per block in a record of ``n``, and in the shortest mean that lags are summed for."""
    if n <= tuning.EXACT_SAMPLES:
        return 1, 1
    block = 2 ** int(np.floor(np.log2(n / tuning.BLOCKS)))
    return block, block * tuning.BLOCKS_PER_AVERAGE


def block_density(psd: PSD, dt: float, frequency: FloatArray, block: int) -> FloatArray:
    """Spectrum of means over blocks of samples, in u^2 per cycle per block.

    The spectrum of block means is that of the running mean, folded ``block`` times. The nearest
    folds are summed; the smoothing of all others shares the factor sin^2(pi f), and their sum is
    an integral over the rest of the band.
    """
    return _Folds.of(frequency, block).density(psd, dt)


@dataclass(frozen=True, eq=False)
class _Folds:
    """Frequencies and weights of `block_density`.

    frequency: (A,), of all folds, then of the rest of the band, cycles per sample.
    smoothing: (folds, F), weights of the folds.
    square: (F,), weight of the rest.
    rest: (R,), weights of the integral over it.
    """

    frequency: FloatArray
    smoothing: FloatArray
    square: FloatArray
    rest: FloatArray

    @classmethod
    def of(cls, frequency: FloatArray, block: int) -> _Folds:
        if block == 1:
            one = np.ones((1, frequency.size))
            return cls(frequency, one, one[0], np.zeros(0))
        most = min(tuning.FOLDS, block // 2)
        folds = np.arange(-most, most + 1)
        f = np.abs(frequency + folds[:, None]) / block
        smoothing = (np.sin(np.pi * block * f) / (block * np.sin(np.pi * f))) ** 2 / block
        # With an even number of folds the outermost one is half of the fold on either side.
        smoothing[2 * np.abs(folds) == block] *= 0.5
        low = (most + 0.5) / block
        rest = weight = np.zeros(0)
        if low < 0.5:
            x, w = legendre(256)
            rest = low * (0.5 / low) ** (0.5 * (x + 1.0))
            weight = w * rest * np.log(0.5 / low) / np.sin(np.pi * rest) ** 2
        square = (np.sin(np.pi * frequency) / block) ** 2
        return cls(np.concatenate([f.ravel(), rest]), smoothing, square, weight)

    def density(self, psd: PSD, dt: float) -> FloatArray:
        """The spectrum of block means."""
        found = np.asarray(psd(in_hertz(self.frequency, dt), dt)) / dt
        folded = found[: self.smoothing.size].reshape(self.smoothing.shape)
        total = np.sum(self.smoothing * folded, axis=0)
        if self.rest.size:
            total += self.square * float(self.rest @ found[self.smoothing.size :])
        return np.asarray(total)


def block_spectrum(psd: PSD, dt: float, grid: LagGrid) -> FloatArray:
    """`block_density` at the Fourier frequencies of a grid.

    The product of two gains and the spectrum is f^2 S(f) near zero frequency. The bin at zero gets
    its mean over the bin, less the curvature of a smooth function: exact for short memory, where it
    vanishes, and for a random walk, where it is constant.
    """
    x, w, folds = grid.folds
    found = folds.density(psd, dt)
    result, near = found[: grid.frequency.size], found[grid.frequency.size :]
    mean = 0.5 * w @ (x**2 * near)
    bin_value = (12.0 * mean - grid.frequency[1] ** 2 * result[1]) / 11.0
    result[0] = max(bin_value, 0.0) / grid.frequency[0] ** 2
    return result
