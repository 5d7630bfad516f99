"""The rate ramp: a regressor X = t whose coefficient is estimated beside the noise.

The series is ``X beta + noise`` with one regressor, time, and beta the slope in u/s. The wavelet
variance knows the slope only by its square, so a moment of its own gives it: generalized least
squares of differences between means of neighbouring blocks. They are stationary whatever the noise,
and their Toeplitz covariance is known from the spectrum.

Removing the fitted regressor takes the loss ``tr(V G_j)`` from the wavelet variance of level j,
which is added again: V is the covariance of the coefficients and G_j the mean product of the
regressors' wavelet coefficients, here ``var(slope)`` and ``r_j^2`` with r_j = tau_j / 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.linalg import cho_factor, cho_solve, lstsq, solve, solve_toeplitz, toeplitz

from gmwm._core.distributions import norm
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.process import PSD, RandomWalk
from gmwm.variance import WaveletVariance
from gmwm.variance.covariance import block_density

_MERGED = 128  # block means of which dense matrices are made
_WALKS = 40


@dataclass(frozen=True)
class Slope:
    """An estimated slope.

    value: u/s.
    variance: Of the estimate, (u/s)^2.
    weights: Of the differences between neighbouring block means, 1/s; ``None`` for a given slope or
        one by ordinary least squares.
    """

    value: float
    variance: float
    weights: FloatArray | None = field(default=None, compare=False, repr=False)


def ols_slope(wv: WaveletVariance) -> Slope:
    """Least-squares slope of the block means, its variance left at zero: a first value.

    Each run of blocks has a level of its own.
    """
    index = _existing(wv)
    run = np.concatenate([[0], np.cumsum(np.diff(index) > 1)])
    x, y = (
        values - (np.bincount(run, values) / np.bincount(run))[run]
        for values in (index * (wv.block * wv.dt), wv.blocks[index])
    )
    return Slope(float(x @ y / (x @ x)), 0.0)


def gls_slope(wv: WaveletVariance, psd: PSD) -> Slope:
    """Generalized least-squares slope for noise of spectrum ``psd``.

    Differences across a gap are left out: the wavelet variances do not see them either.
    """
    first = _beside(_existing(wv))
    y = wv.blocks[first + 1] - wv.blocks[first]
    x = np.full(first.size, wv.block * wv.dt)
    column = difference_covariance(psd, wv.dt, wv.block, wv.blocks.size)
    solved = _solve(column, first, x)
    information = float(x @ solved)
    if not information > 0.0:
        raise InputError(
            f"block means of {wv.name or 'the series'} over {x[0]:.3g} s differ only by rounding, "
            "so no ramp can be estimated: fit a model without RateRamp"
        )
    weights = np.zeros(column.size)
    weights[first] = solved / information
    return Slope(float(weights[first] @ y), _growth(wv) / information, weights)


def slope_variances(wv: WaveletVariance, slope: Slope, terms: Sequence[PSD]) -> FloatArray:
    """Variance of an estimated slope that each noise alone gives it, (u/s)^2, (terms,).

    For the terms of the noise of which the slope is estimated they sum to its variance, and are the
    derivatives of that by their amplitudes: the weights are those of least variance.
    """
    if slope.weights is None:
        return np.zeros(len(terms))
    products = np.correlate(slope.weights, slope.weights, "full")[slope.weights.size - 1 :]
    products[1:] *= 2.0
    columns = (difference_covariance(each, wv.dt, wv.block, wv.blocks.size) for each in terms)
    return _growth(wv) * np.array([products @ column for column in columns])


def slope_p_value(wv: WaveletVariance, psd: PSD) -> float:
    """Probability of a slope as steep without a ramp, whatever walk the record does not resolve.

    A random walk seen once looks like a ramp, and noise fitted to what a line leaves of it holds
    little of it. So the two-sided p-value of the slope is taken under the noise plus a random walk,
    and averaged over the size of the walk with the restricted likelihood of the block means, in
    which the slope has no part (Harville 1974, *Biometrika* 61, 383-385), as weight. Its prior is
    even in the logarithm over all sizes that matter beside the noise.

    psd: Spectrum ``psd(f, dt)`` of the noise without the drift, two-sided, in u^2/Hz.
    Returns: 1 where too few blocks exist.
    """
    # Few enough block means that dense matrices of them are quick.
    merged = -(-wv.blocks.size // _MERGED)
    whole = wv.blocks.size // merged * merged
    blocks, block = wv.blocks[:whole].reshape(-1, merged).mean(axis=1), wv.block * merged
    first = _beside(np.flatnonzero(~np.isnan(blocks)))
    if first.size + 1 < tuning.FEWEST_BLOCKS:
        return 1.0
    noise, walk = (
        toeplitz(difference_covariance(each, wv.dt, block, blocks.size))[np.ix_(first, first)]
        for each in (psd, RandomWalk(1.0).psd)
    )
    x, y = np.full(first.size, block * wv.dt), blocks[first + 1] - blocks[first]
    # K^2 of a walk that makes the slope as uncertain as the noise does.
    unit = _restricted(noise, x, y)[1] * float(np.sum(x))
    found = np.array(
        [
            _restricted(noise + ratio * unit * walk, x, y)
            for ratio in np.geomspace(tuning.LEAST_WALK, tuning.LARGEST_WALK, _WALKS)
        ]
    )
    weight = np.exp(found[:, 2] - np.max(found[:, 2]))
    chance = 2.0 * norm.sf(np.abs(found[:, 0]) / np.sqrt(_growth(wv) * found[:, 1]))
    return float(weight @ chance / np.sum(weight))


def _restricted(covariance: FloatArray, x: FloatArray, y: FloatArray) -> tuple[float, float, float]:
    """Coefficient of y on x, its variance, and the restricted log-likelihood up to a constant."""
    factor = cho_factor(covariance, lower=True)
    solved = cho_solve(factor, np.column_stack([x, y]))
    information = float(x @ solved[:, 0])
    slope = float(x @ solved[:, 1]) / information
    squares = float(y @ solved[:, 1]) - slope**2 * information
    half_log_determinant = float(np.sum(np.log(np.diag(factor[0]))))
    likelihood = -half_log_determinant - 0.5 * np.log(information) - 0.5 * squares
    return slope, 1.0 / information, float(likelihood)


def difference_covariance(psd: PSD, dt: float, block: int, count: int) -> FloatArray:
    """Autocovariance of differences of neighbouring block means, (count - 1,), u^2."""
    size = fft.next_fast_len(4 * count, real=True)
    size += size % 2
    frequency = np.arange(size // 2 + 1) / size
    frequency[0] = 1e-2 / size
    density = block_density(psd, dt, frequency, block)
    density *= 4.0 * np.sin(np.pi * frequency) ** 2
    return np.asarray(fft.irfft(density, size)[: count - 1])


def _beside(index: NDArray[np.intp]) -> NDArray[np.intp]:
    """Blocks whose next one exists too."""
    return index[:-1][np.diff(index) == 1]


def _growth(wv: WaveletVariance) -> float:
    """Growth of the variance of block means by filled samples, taken as that of the last level."""
    return 1.0 if wv.gaps is None else 1.0 + max(float(wv.gaps.change[-1]), 0.0)


def _existing(wv: WaveletVariance) -> NDArray[np.intp]:
    """Places of the blocks that exist, each beside another one."""
    there = np.concatenate([[False], ~np.isnan(wv.blocks), [False]])
    index = np.flatnonzero(there[1:-1] & (there[:-2] | there[2:]))
    if index.size < tuning.FEWEST_BLOCKS:
        raise InputError(
            f"{wv.name or 'the series'} has no samples in a row, so no ramp can be estimated: fit "
            "a model without RateRamp"
        )
    return index


def _solve(column: FloatArray, first: NDArray[np.intp], right: FloatArray) -> FloatArray:
    """Solve for the covariance of differences of neighbouring blocks, at these places of all.

    ``column`` is the autocovariance of all differences. A covariance that is singular to rounding
    is solved by least squares.
    """
    try:
        if first.size == column.size:
            return np.asarray(solve_toeplitz(column, right))
        return np.asarray(solve(toeplitz(column)[np.ix_(first, first)], right, assume_a="pos"))
    except np.linalg.LinAlgError:
        return np.asarray(lstsq(toeplitz(column)[np.ix_(first, first)], right)[0])


def bias_of_detrending(wv: WaveletVariance, slope: Slope) -> FloatArray:
    """Loss tr(V G_j) of each expected wavelet variance by removing the estimated slope, u^2, (J,).

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

    covariance: (J, J), of the wavelet variances, u^4.
    means: (J, J), covariance of the means of the coefficients, u^2.
    response: (J,), mean r of the coefficients per unit of drift, s.
    """
    common = np.outer(response, response) * slope.variance
    taken = 4.0 * common * means - 2.0 * common**2
    # c is a mean over the record; at the coarsest levels it can take more than there is.
    there = np.diag(covariance)
    share = np.divide(np.diag(taken), there, out=np.zeros_like(there), where=there > 0.0)
    excess = np.maximum(share / tuning.LARGEST_TAKEN, 1.0)
    return np.asarray(covariance - taken / np.sqrt(np.outer(excess, excess)))
