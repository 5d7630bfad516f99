"""The rate ramp: a regressor X = t whose coefficient is estimated beside the noise.

The series is ``X beta + noise`` with one regressor, time, and beta the slope in u/s. The wavelet
variance knows the slope only by its square, so a moment of its own gives it, see
`gmwm.estimate.problem.regressors`. G_j is r_j^2 with r_j = tau_j / 2.

A random walk seen once looks like a ramp, and noise fitted to what a line leaves of it holds little
of it. So whether a slope is one, and its interval, are averaged over walks of all sizes that matter
beside the noise. The weight of each is the restricted likelihood of the block means, in which the
slope has no part (Harville 1974, *Biometrika* 61, 383-385).
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.linalg import eigvalsh, lstsq, solve, solve_toeplitz, toeplitz
from scipy.optimize import brentq

from gmwm._core.distributions import norm
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
    restricted,
)
from gmwm.process import PSD, Model, RandomWalk
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
    """Solve for the covariance of block differences at these places; least squares if singular."""
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


_UNKNOWN = 1e-9  # of the largest: a regressor that does not change
_MERGED = 128  # block means of which dense matrices are made
_WALKS = 40
_BETWEEN = 1000  # sizes of walks at which those are interpolated
_BEYOND = 10.0  # times the estimated K: the largest walk that is tried


@dataclass(frozen=True, eq=False)
class Walks:
    """Random walks beside a noise, and the generalized least-squares coefficients under each.

    Intervals have an even prior of K, as for other scales near zero (Gelman 2006, *Bayesian
    Analysis* 1, 515-534).

    sizes: (k,), K of each, evenly in the logarithm, u/s/sqrt(Hz).
    values, covariances: (k, p) and (k, p, p), of the coefficients: of a ramp its slope, u/s.
    likelihoods: (k,), in logarithms, up to a constant.
    """

    sizes: FloatArray
    values: FloatArray
    covariances: FloatArray
    likelihoods: FloatArray

    @classmethod
    def beside(cls, wv: WaveletVariance, psd: PSD, largest: float = 0.0) -> Self | None:
        """Beside a noise of spectrum ``psd``, at least up to K = ``largest``.

        Returns: ``None`` where too few blocks exist.
        """
        parts = list(_parts(wv, psd))
        if sum(len(y) for *_, y in parts) + 1 < tuning.FEWEST_BLOCKS:
            return None
        # K^2 of walks that make some coefficients as uncertain as the noise does.
        noise, walk = (
            np.sum([restricted(each[k], *each[2:])[0] for each in parts], axis=0) for k in (0, 1)
        )
        units = eigvalsh(walk, noise)
        units = units[units > _UNKNOWN * units[-1]]
        most = max(tuning.LARGEST_WALK * units[-1], largest**2)
        squares = np.geomspace(tuning.LEAST_WALK * units[0], most, _WALKS)
        fits = (
            [restricted(noise + square * walk, x, y) for noise, walk, x, y in parts]
            for square in squares
        )
        sums = ([sum(each) for each in zip(*fit, strict=True)] for fit in fits)
        information, score, left, half = (np.array(each) for each in zip(*sums, strict=True))
        inverse = np.linalg.inv(information)
        values = (inverse @ score[..., None])[..., 0]
        likelihoods = -half - 0.5 * np.linalg.slogdet(information)[1]
        likelihoods -= 0.5 * (left - np.sum(values * score, axis=1))
        return cls(np.sqrt(squares), values, growth(wv) * inverse, likelihoods)

    @property
    def weights(self) -> FloatArray:
        """Probabilities of the sizes, (k,)."""
        weight = np.exp(self.likelihoods - np.max(self.likelihoods)) * self.sizes
        weight[0] /= np.log(self.sizes[1] / self.sizes[0])  # all walks that are smaller
        return np.asarray(weight / np.sum(weight))

    @cached_property
    def _averaged(self) -> FloatArray:
        """Sizes, slopes, their standard errors and weights, between the sizes too, (4, k)."""
        at = np.log(self.sizes)
        between = np.linspace(at[0], at[-1], _BETWEEN)
        slopes, variances = self.values[:, 0], self.covariances[:, 0, 0]
        rows = np.stack([slopes, 0.5 * np.log(variances), self.likelihoods], axis=1)
        slopes, errors, likelihoods = make_interp_spline(at, rows)(between).T
        weight = np.exp(likelihoods - np.max(likelihoods) + between)
        weight[0] /= between[1] - between[0]  # all walks that are smaller
        return np.stack([np.exp(between), slopes, np.exp(errors), weight / np.sum(weight)])

    def quantile(self, probability: float) -> float:
        """Of K."""
        sizes, _, _, weight = self._averaged
        return float(np.interp(probability, np.cumsum(weight) - 0.5 * weight, sizes))

    def size_interval(self, value: float, level: float) -> tuple[float, float]:
        """Of K, with its estimate in it."""
        low, high = (self.quantile(0.5 + 0.5 * side * level) for side in (-1.0, 1.0))
        return min(low, value), max(high, value)

    def slope_interval(self, value: float, level: float) -> tuple[float, float]:
        """Symmetric interval of the slope, u/s."""
        _, slopes, errors, weight = self._averaged
        away, tail = slopes - value, 1.0 - level

        def excess(reach: float) -> float:
            outside = norm.sf((reach - away) / errors) + norm.sf((reach + away) / errors)
            return float(weight @ outside) - tail

        farthest = float(np.max(np.abs(away) - norm.ppf(0.1 * tail) * errors))
        reach = float(brentq(excess, 0.0, farthest))
        return value - reach, value + reach


def _parts(wv: WaveletVariance, psd: PSD) -> Iterator[tuple[FloatArray, ...]]:
    """Differences of neighbouring block means of each recording, few enough for dense matrices.

    Yields: their covariance by a noise and by a walk, (D, D), those of the regressors, (D, p), and
        of the series, (D,).
    """
    time = wv.block * wv.dt * np.arange(wv.blocks.size, dtype=float)
    parts = [(wv.blocks, time[None, :], wv.block)]
    if wv.regressors is not None:
        parts = [(part.blocks, part.columns, part.block) for part in wv.regressors.parts]
    for series, columns, block in parts:
        merged = -(-series.size // _MERGED)
        rows = np.vstack([series, columns])[:, : series.size // merged * merged]
        rows = rows.reshape(len(rows), -1, merged).mean(axis=2)
        first = beside(np.flatnonzero(~np.isnan(rows[0])))
        noise, walk = (
            toeplitz(difference_covariance(each, wv.dt, block * merged, rows.shape[1]))
            for each in (psd, RandomWalk(1.0).psd)
        )
        y, *x = np.diff(rows)[:, first]
        place = np.ix_(first, first)
        yield noise[place], walk[place], np.transpose(x), y


def walks_beside(
    model: Model, keys: Collection[str], wv: WaveletVariance, *, may_lack: bool = False
) -> Walks | None:
    """Sizes that the random walk of a model may have beside its ramp or a curve.

    may_lack: Whether there may be a walk where the model has none.
    Returns: ``None`` without a walk, or where it competes with other slow noise of the model.
    """
    values = {i.term: float(i.value or 0.0) for i in model.parameters if i.key in keys}
    sizes = [value for i, value in values.items() if model.terms[i].is_walk]
    rest = Model(tuple(t for t in model.terms if not (t.is_drift or t.is_walk)) or model.terms)
    depends = any(t.shape_parameters or t.is_flicker or t.is_drift for t in rest.terms)
    if depends or not (sizes or may_lack) or not any(rest.params.values()):
        return None
    if not all(term.has_spectrum() for term in rest.terms):
        return None
    try:
        return Walks.beside(wv, rest.psd, _BEYOND * max(sizes, default=0.0))
    except np.linalg.LinAlgError:  # differences of the means are known to rounding
        return None


def slope_p_value(wv: WaveletVariance, psd: PSD) -> float:
    """Probability of a slope as steep without a ramp, whatever walk the record does not resolve.

    Two-sided, with a prior of K that is even in the logarithm.

    psd: Spectrum ``psd(f, dt)`` of the noise without the drift, two-sided, in u^2/Hz.
    Returns: 1 where too few blocks exist.
    """
    found = Walks.beside(wv, psd)
    if found is None:
        return 1.0
    weight = np.exp(found.likelihoods - np.max(found.likelihoods))
    chance = 2.0 * norm.sf(np.abs(found.values[:, 0]) / np.sqrt(found.covariances[:, 0, 0]))
    return float(weight @ chance / np.sum(weight))
