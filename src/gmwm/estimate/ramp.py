"""The rate ramp: its slope by generalized least squares under the fitted noise.

The wavelet variance knows the slope only by its square, so a moment of its own gives it: the best
linear unbiased estimate from means of blocks of samples. Their differences are stationary whatever
the noise, their mean is the slope times the block length, and their covariance is a Toeplitz matrix
known from the spectrum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft
from scipy.linalg import solve_toeplitz

from gmwm._typing import FloatArray
from gmwm.process.spectral import PSD
from gmwm.variance.covariance import block_density, dyadic_levels, mean_covariance
from gmwm.variance.wavelet import WaveletVariance

_LARGEST_SHARE = 0.95  # of a level's variance that detrending may take


@dataclass(frozen=True)
class Slope:
    """An estimated slope.

    Attributes
    ----------
    value : float
        u/s.
    variance : float
        Of the estimate, (u/s)^2.
    """

    value: float
    variance: float


def ols_slope(wv: WaveletVariance) -> Slope:
    """Ordinary least-squares slope of the block means, its variance left at zero: a first value."""
    t = np.arange(wv.blocks.size) * (wv.block * wv.dt)
    return Slope(float(np.polynomial.polynomial.polyfit(t, wv.blocks, 1)[1]), 0.0)


def gls_slope(wv: WaveletVariance, psd: PSD) -> Slope:
    """Generalized least-squares slope for noise of spectrum ``psd``."""
    difference = np.diff(wv.blocks)
    size = fft.next_fast_len(4 * wv.blocks.size, real=True)
    size += size % 2
    frequency = np.arange(size // 2 + 1) / size
    frequency[0] = 1e-2 / size
    density = block_density(psd, wv.dt, frequency, wv.block)
    density *= 4.0 * np.sin(np.pi * frequency) ** 2
    column = fft.irfft(density, size)[: difference.size]
    solved = solve_toeplitz(column, np.column_stack([np.ones_like(difference), difference]))
    information = float(np.sum(solved[:, 0]))
    step = wv.block * wv.dt
    return Slope(float(np.sum(solved[:, 1])) / information / step, 1.0 / information / step**2)


def bias_of_detrending(wv: WaveletVariance, slope: Slope) -> FloatArray:
    """What removing the estimated slope takes from each expected wavelet variance, u^2, (J,).

    The covariance of the best linear unbiased estimate with any other unbiased one, such as twice
    the mean coefficient over tau, is its own variance; hence tau^2/4 var(slope).
    """
    return 0.25 * wv.tau**2 * slope.variance


def detrended_covariance(
    covariance: FloatArray, n: int, dt: float, psd: PSD, slope: Slope
) -> FloatArray:
    """Covariance of the wavelet variances after the estimated slope was removed, u^4, (J, J).

    The coefficients lose the covariance c = tau_j tau_k var(slope)/4 at every lag, which turns
    the mean of 2 g^2 into that of 2 (g - c)^2.
    """
    tau = dyadic_levels(n) * dt
    common = 0.25 * np.outer(tau, tau) * slope.variance
    means = mean_covariance(psd, n, dt)
    taken = 4.0 * common * means - 2.0 * common**2
    # c is a mean over the record; at the coarsest levels it can take more than there is.
    excess = np.maximum(np.diag(taken) / np.diag(covariance) / _LARGEST_SHARE, 1.0)
    return np.asarray(covariance - taken / np.sqrt(np.outer(excess, excess)))
