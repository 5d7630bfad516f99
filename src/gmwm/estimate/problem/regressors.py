"""Regression together with the noise: ``X beta + noise``; a rate ramp is the case X = t.

The coefficients are those of generalized least squares of differences between means of neighbouring
blocks. They are stationary whatever the noise, and their Toeplitz covariance S is known from the
spectrum. Removing the fitted curve takes the loss ``tr(V G_j)`` from the wavelet variance of level
j, which is added again: V = (X' S^-1 X)^-1 is the covariance of the coefficients and G_j the mean
product of the regressors' wavelet coefficients.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.linalg import cho_factor, cho_solve, toeplitz

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import tuning
from gmwm.process import PSD
from gmwm.variance import RegressorPart, Regressors, WaveletVariance
from gmwm.variance.covariance import block_density

_ALIKE = 1e-10  # of the largest information: smaller ones are rounding errors
_JITTER = 1e-12  # of the variances of differences, which rounding may make singular
_RATIOS = (0.0, *np.geomspace(1e-6, 1e2, 28).tolist())  # walk per block over white, in variance


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Estimated coefficients of p regressors; of a ramp its slope alone, u/s.

    values: (p,), or a number where p is 1.
    covariance: (p, p), or a number.
    weights: Of each recording, (p, D), of the differences between neighbouring block means; None
        for given coefficients or ones by ordinary least squares.
    """

    values: FloatArray
    covariance: FloatArray
    weights: tuple[FloatArray, ...] | None = field(default=None, repr=False)

    @property
    def value(self) -> float:
        """Coefficient of a single regressor."""
        return float(self.values[0])

    @property
    def variance(self) -> float:
        """Variance of a single regressor's coefficient."""
        return float(self.covariance[0, 0])

    def towards(self, new: Coefficients, part: float) -> Coefficients:
        """Moved by a part of the way."""
        return Coefficients(
            (1.0 - part) * self.values + part * new.values,
            (1.0 - part) * self.covariance + part * new.covariance,
            new.weights,
        )


class Regression(ABC):
    """Regressors beside the noise of a series."""

    wv: WaveletVariance

    @property
    @abstractmethod
    def gram(self) -> FloatArray:
        """Mean products of the regressors' wavelet coefficients, (J, p, p)."""

    @abstractmethod
    def detrended(self, values: FloatArray) -> FloatArray:
        """Wavelet variances of the series less a curve, u^2, (J,)."""

    @abstractmethod
    def estimated(self, psd: PSD) -> Coefficients:
        """Coefficients by generalized least squares for noise of a spectrum."""

    @abstractmethod
    def covariances(self, found: Coefficients, terms: Sequence[PSD]) -> FloatArray:
        """Covariance of the coefficients that each noise alone gives them, (terms, p, p).

        For the terms of the noise that they are estimated under they sum to theirs, and are its
        derivatives by the amplitudes: the weights are those of least variance.
        """

    @abstractmethod
    def products(self, psd: PSD, covariance: FloatArray) -> FloatArray:
        """tr(V Q_jk), (J, J), u^4.

        Q_jk: mean of the products of the regressors' coefficients at two levels with the covariance
            of those of the noise, over all pairs of times.
        """

    def taken(self, covariance: FloatArray) -> FloatArray:
        """Loss tr(V G_j) of each expected wavelet variance by removing the curve, u^2, (..., J).

        The covariance of the best linear unbiased estimate with any other unbiased one, such as
        twice the mean coefficient over tau for a ramp, is its own variance: a loss of tau^2/4 V.

        covariance: (..., p, p), of the coefficients.
        """
        return np.asarray(np.einsum("...ab,jba->...j", covariance, self.gram))

    def covariance(self, covariance: FloatArray, psd: PSD, found: Coefficients) -> FloatArray:
        """Covariance of the wavelet variances after the estimated curve was removed, (J, J)."""
        weighted = found.covariance @ self.gram
        pairs = np.einsum("jab,kba->jk", weighted, weighted)
        return regressed_covariance(covariance, self.products(psd, found.covariance), pairs)


def regressed_covariance(
    covariance: FloatArray, products: FloatArray, pairs: FloatArray
) -> FloatArray:
    """Covariance of the wavelet variances after an estimated curve was removed, u^4, (J, J).

    The coefficients of the noise lose the covariance ``x_j(t)' V x_k(s)``, which turns the mean of
    2 g^2 into that of 2 (g - c)^2.

    covariance: (J, J), of the wavelet variances, u^4.
    products: (J, J), mean of g c over all pairs of times.
    pairs: (J, J), that of c^2.
    """
    taken = 4.0 * products - 2.0 * pairs
    # c is a mean over the record; at the coarsest levels it can take more than there is.
    there = np.diag(covariance)
    share = np.divide(np.diag(taken), there, out=np.zeros_like(there), where=there > 0.0)
    excess = np.maximum(share / tuning.LARGEST_TAKEN, 1.0)
    return np.asarray(covariance - taken / np.sqrt(np.outer(excess, excess)))


@dataclass(frozen=True, eq=False)
class CurveRegression(Regression):
    """The regressors that a wavelet variance holds."""

    wv: WaveletVariance
    regressors: Regressors

    @property
    def gram(self) -> FloatArray:
        return self.regressors.gram

    def detrended(self, values: FloatArray) -> FloatArray:
        own = self.regressors
        return self.wv.variance - 2.0 * own.cross @ values + (own.gram @ values) @ values

    def estimated(self, psd: PSD) -> Coefficients:
        size, solved = len(self.gram[0]), []
        information, score = np.zeros((size, size)), np.zeros(size)
        for part in self.regressors.parts:
            first, (x, y) = _beside(part.blocks), _rows(part)
            own = toeplitz(self._column(psd, part))
            own = own if first.size == len(own) else own[np.ix_(first, first)]
            np.fill_diagonal(own, (1.0 + _JITTER) * np.diag(own))
            factor = cho_factor(own, lower=True)
            whole = np.zeros((part.blocks.size - 1, x.shape[1]))  # at the places of all differences
            whole[first] = cho_solve(factor, x)
            information, score = information + x.T @ whole[first], score + whole[first].T @ y
            solved.append(whole)
        covariance = _inverse(information)
        weights = tuple(covariance @ whole.T for whole in solved)
        return Coefficients(covariance @ score, growth(self.wv) * covariance, weights)

    def covariances(self, found: Coefficients, terms: Sequence[PSD]) -> FloatArray:
        parts = list(zip(self.regressors.parts, found.weights or (), strict=False))
        if not parts:
            return np.zeros((len(terms), *found.covariance.shape))
        each = [
            np.sum([w @ toeplitz(self._column(psd, part)) @ w.T for part, w in parts], axis=0)
            for psd in terms
        ]
        return growth(self.wv) * np.array(each)

    def products(self, psd: PSD, covariance: FloatArray) -> FloatArray:
        total = np.zeros((self.wv.tau.size,) * 2)
        for part, response in zip(self.regressors.parts, self.regressors.responses, strict=True):
            seen = np.flatnonzero(np.any(response, axis=(1, 2)))
            own = response[seen]
            noise = covariance @ own @ toeplitz(self._column(psd, part))
            total[np.ix_(seen, seen)] += np.tensordot(noise, own, ([1, 2], [1, 2]))
        return 0.5 * (total + total.T)

    def _column(self, psd: PSD, part: RegressorPart) -> FloatArray:
        return difference_covariance(psd, self.wv.dt, part.block, part.blocks.size)


def pilot(regressors: Regressors) -> tuple[Coefficients, float]:
    """Coefficients, and the log-likelihood, for white noise beside a random walk in any ratio.

    The ratio is that of the largest restricted likelihood (Harville 1974, *Biometrika* 61,
    383-385): coefficients before anything is known of the noise. The likelihood itself compares
    regressors.
    """
    turned, noise = map(np.concatenate, zip(*_turned(regressors), strict=True))
    best, found = (-np.inf, -np.inf), Coefficients(np.zeros(0), np.zeros((0, 0)))
    for ratio in _RATIOS:
        variance = noise @ [1.0, ratio]
        products = turned.T @ (turned / variance[:, None])
        information, score = products[:-1, :-1], products[:-1, -1]
        inverse = _inverse(information)
        values = inverse @ score
        squares = max(float(products[-1, -1] - values @ score), np.finfo(float).tiny)
        half, free = 0.5 * float(np.sum(np.log(variance))), variance.size - values.size
        profile = -half - 0.5 * free * np.log(squares)
        profile -= 0.5 * float(np.linalg.slogdet(information)[1])
        if profile > best[0]:
            best = (float(profile), float(-half - 0.5 * variance.size * np.log(squares)))
            found = Coefficients(values, inverse * squares / free)
    return found, best[1]


def _turned(regressors: Regressors) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Differences of neighbouring blocks in uncorrelated directions, for each run without gaps.

    White noise and a random walk correlate neighbouring differences only: their covariances are
    tridiagonal Toeplitz matrices, which sines make diagonal.

    Yields: differences of regressors and series, (D, p + 1), and variances of them by white noise
        and by a walk, (D, 2).
    """
    first = float(regressors.parts[0].block)
    for part in regressors.parts:
        rows, place, size = np.column_stack(_rows(part)), _beside(part.blocks), part.block / first
        for run in np.split(np.arange(place.size), np.flatnonzero(np.diff(place) > 1) + 1):
            cosine = np.cos(np.pi * np.arange(1, run.size + 1) / (run.size + 1))
            white, less = 2.0 - 2.0 * cosine, 1.0 / part.block**2
            walk = (2.0 + less + (1.0 - less) * cosine) / 3.0
            noise = np.stack([white / size, walk * size], axis=1)
            yield fft.dst(rows[run], 1, axis=0, norm="ortho"), noise


def restricted(
    covariance: FloatArray, x: FloatArray, y: FloatArray
) -> tuple[FloatArray, FloatArray, float, float]:
    """Information on the coefficients of y on x, score, sum of squares of y, half log det."""
    factor = cho_factor(covariance, lower=True)
    solved = cho_solve(factor, np.column_stack([x, y]))
    half = float(np.sum(np.log(np.diag(factor[0]))))
    return x.T @ solved[:, :-1], x.T @ solved[:, -1], float(y @ solved[:, -1]), half


def difference_covariance(psd: PSD, dt: float, block: int, count: int) -> FloatArray:
    """Autocovariance of differences of neighbouring block means, (count - 1,), u^2."""
    size = fft.next_fast_len(4 * count, real=True)
    size += size % 2
    frequency = np.arange(size // 2 + 1) / size
    frequency[0] = 1e-2 / size
    density = block_density(psd, dt, frequency, block)
    density *= 4.0 * np.sin(np.pi * frequency) ** 2
    return np.asarray(fft.irfft(density, size)[: count - 1])


def beside(index: NDArray[np.intp]) -> NDArray[np.intp]:
    """Blocks whose next one exists too."""
    return index[:-1][np.diff(index) == 1]


def growth(wv: WaveletVariance) -> float:
    """Growth of the variance of block means by filled samples, taken as that of the last level."""
    return 1.0 if wv.gaps is None else 1.0 + max(float(wv.gaps.change[-1]), 0.0)


def _beside(blocks: FloatArray) -> NDArray[np.intp]:
    first = beside(np.flatnonzero(~np.isnan(blocks)))
    if first.size + 1 < tuning.FEWEST_BLOCKS:
        raise InputError("too few samples in a row, so no curve can be estimated: record longer")
    return first


def _rows(part: RegressorPart) -> tuple[FloatArray, FloatArray]:
    """Differences of neighbouring blocks: of the regressors, (D, p), and of the series, (D,)."""
    first = _beside(part.blocks)
    return np.diff(part.columns)[:, first].T, np.diff(part.blocks)[first]


def _inverse(information: FloatArray) -> FloatArray:
    """Inverse; directions without information have no variance, as nothing is fitted to them."""
    scale = np.sqrt(np.diag(information))
    scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    inverse = np.where(values > _ALIKE, 1.0 / np.maximum(values, _ALIKE), 0.0)
    return np.asarray((vectors * inverse) @ vectors.T / np.outer(scale, scale))
