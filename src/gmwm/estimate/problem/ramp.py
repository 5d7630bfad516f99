"""The rate ramp: its slope by generalized least squares under the fitted noise.

The wavelet variance knows the slope only by its square, so a moment of its own gives it: the best
linear unbiased estimate from means of blocks of samples. Their differences are stationary whatever
the noise, their mean is the slope times the block length, and their covariance is a Toeplitz matrix
known from the spectrum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.linalg import solve, solve_toeplitz, toeplitz

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.process import PSD
from gmwm.variance import WaveletVariance
from gmwm.variance.covariance import block_density


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
    index = _existing(wv)
    t = index * (wv.block * wv.dt)
    return Slope(float(np.polynomial.polynomial.polyfit(t, wv.blocks[index], 1)[1]), 0.0)


def gls_slope(wv: WaveletVariance, psd: PSD) -> Slope:
    """Generalized least-squares slope for noise of spectrum ``psd``."""
    index = _existing(wv)
    difference, apart = np.diff(wv.blocks[index]), np.diff(index).astype(float)
    size = fft.next_fast_len(4 * wv.blocks.size, real=True)
    size += size % 2
    frequency = np.arange(size // 2 + 1) / size
    frequency[0] = 1e-2 / size
    density = block_density(psd, wv.dt, frequency, wv.block)
    density *= 4.0 * np.sin(np.pi * frequency) ** 2
    column = fft.irfft(density, size)[: wv.blocks.size - 1]
    solved = _solve(column, index, np.column_stack([apart, difference]))
    information = float(apart @ solved[:, 0])
    step = wv.block * wv.dt
    return Slope(float(apart @ solved[:, 1]) / information / step, 1.0 / information / step**2)


def _existing(wv: WaveletVariance) -> NDArray[np.intp]:
    """Places of the blocks that are not missing."""
    index = np.flatnonzero(~np.isnan(wv.blocks))
    if index.size < tuning.FEWEST_BLOCKS:
        raise InputError(
            f"{wv.name or 'the series'} has samples missing all over, which leaves no drift to "
            "estimate: take a model without RateRamp"
        )
    return index


def _solve(column: FloatArray, index: NDArray[np.intp], right: FloatArray) -> FloatArray:
    """Solve for the covariance of differences between blocks that exist.

    ``column`` is the autocovariance of differences of neighbours; across a gap they add up.
    """
    if index.size == column.size + 1:
        return np.asarray(solve_toeplitz(column, right))
    first = index[0]
    inner = toeplitz(column[: index[-1] - first])
    sums = np.add.reduceat(np.add.reduceat(inner, index[:-1] - first, axis=0),
                           index[:-1] - first, axis=1)  # fmt: skip
    return np.asarray(solve(sums, right, assume_a="pos"))


def bias_of_detrending(wv: WaveletVariance, slope: Slope) -> FloatArray:
    """What removing the estimated slope takes from each expected wavelet variance, u^2, (J,).

    The covariance of the best linear unbiased estimate with any other unbiased one, such as twice
    the mean coefficient over tau, is its own variance; hence tau^2/4 var(slope).
    """
    return wv.drift_response**2 * slope.variance


def detrended_covariance(
    covariance: FloatArray, means: FloatArray, response: FloatArray, slope: Slope
) -> FloatArray:
    """Covariance of the wavelet variances after the estimated slope was removed, u^4, (J, J).

    The coefficients lose the covariance c = r_j r_k var(slope) at every lag, which turns the mean
    of 2 g^2 into that of 2 (g - c)^2.

    Parameters
    ----------
    covariance : (J, J) ndarray
        Of the wavelet variances, u^4.
    means : (J, J) ndarray
        Covariance of the means of the coefficients, u^2.
    response : (J,) ndarray
        Mean r of the coefficients per unit of drift, s.
    slope : Slope
    """
    common = np.outer(response, response) * slope.variance
    taken = 4.0 * common * means - 2.0 * common**2
    # c is a mean over the record; at the coarsest levels it can take more than there is.
    excess = np.maximum(np.diag(taken) / np.diag(covariance) / tuning.LARGEST_TAKEN, 1.0)
    return np.asarray(covariance - taken / np.sqrt(np.outer(excess, excess)))
