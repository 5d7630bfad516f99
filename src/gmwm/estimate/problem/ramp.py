"""The rate ramp: a regressor X = t whose coefficient is estimated beside the noise.

The series is ``X beta + noise`` with one regressor, time, and beta the slope in u/s. The wavelet
variance knows the slope only by its square, so a moment of its own gives it, see
`gmwm.estimate.problem.regressors`. G_j is r_j^2 with r_j = tau_j / 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lstsq, solve, solve_toeplitz, toeplitz

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.estimate.problem.regressors import (
    Coefficients,
    Regression,
    beside,
    difference_covariance,
    growth,
    regressed_covariance,
)
from gmwm.process import PSD
from gmwm.variance import WaveletVariance


class Slope(Coefficients):
    """An estimated slope: its value, u/s, variance, and weights of the differences, 1/s."""

    def __init__(self, value: float, variance: float, weights: FloatArray | None = None) -> None:
        own = None if weights is None else (weights[None, :],)
        super().__init__(np.array([value]), np.array([[variance]]), own)


@dataclass(frozen=True, eq=False)
class RampRegression(Regression):
    """Time alone."""

    wv: WaveletVariance

    @property
    def gram(self) -> FloatArray:
        return self.wv.drift_response[:, None, None] ** 2

    def detrended(self, values: FloatArray) -> FloatArray:
        return self.wv.detrended(float(values[0]))

    def estimated(self, psd: PSD) -> Coefficients:
        return gls_slope(self.wv, psd)

    def covariances(self, found: Coefficients, terms: Sequence[PSD]) -> FloatArray:
        if found.weights is None:
            return np.zeros((len(terms), 1, 1))
        own = found.weights[0][0]
        products = np.correlate(own, own, "full")[own.size - 1 :]
        products[1:] *= 2.0
        wv = self.wv
        columns = (difference_covariance(each, wv.dt, wv.block, wv.blocks.size) for each in terms)
        return growth(wv) * np.array([products @ column for column in columns])[:, None, None]

    def products(self, psd: PSD, covariance: FloatArray) -> FloatArray:
        response = self.wv.drift_response
        common = np.outer(response, response) * covariance[0, 0]
        return np.asarray(common * self.wv.mean_covariance_under(psd))


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
    first = beside(_existing(wv))
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
    return Slope(float(weights[first] @ y), growth(wv) / information, weights)


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


def detrended_covariance(
    covariance: FloatArray, means: FloatArray, response: FloatArray, slope: Coefficients
) -> FloatArray:
    """Covariance of the wavelet variances after the estimated slope was removed, u^4, (J, J).

    covariance: (J, J), of the wavelet variances, u^4.
    means: (J, J), covariance of the means of the coefficients, u^2.
    response: (J,), mean r of the coefficients per unit of drift, s.
    """
    common = np.outer(response, response) * slope.variance
    return regressed_covariance(covariance, common * means, common**2)
