"""Whether the wavelet variances of several recordings are equal, level by level.

Structures of models differ between recordings of one sensor far more than curves do. So the test
uses the models only for the covariances of the wavelet variances.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from gmwm._core.distributions import chi2, norm
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.estimate.problem import Scales, detrended_covariance, gls_slope, weight_root
from gmwm.population import tuning
from gmwm.process import Model

PARTS = ("short", "Q", "N", "B", "K", "R")
"""Parts of an Allan plot: times of the sensor's filter, then slopes -1, -1/2, 0, +1/2, +1."""

_SLOPES = (-1.5, -0.5, 0.5, 1.5)  # of the variance, between these parts
_UNDERFLOW = 1e-300


@dataclass(frozen=True, eq=False)
class Curve:
    """Wavelet variances of one recording with their errors.

    tau: (J,), averaging times, s.
    variance: (J,), u^2, without a drift where one was removed.
    relative: (J, J), covariance of the variances over the product of those that the models imply.
    """

    tau: FloatArray
    variance: FloatArray
    relative: FloatArray

    @classmethod
    def of(cls, fit: Fit, noises: Sequence[Model], *, drifting: bool) -> Self:
        """The data of a fit, up to the last level that is known well enough.

        Covariances are those of the mean spectrum of all recordings. If they are equal, it is
        nearer to the truth than each: a random walk that one model misses changes the covariances
        at long averaging times by half.

        noises: Models of all recordings, without drifts.
        drifting: Whether a drift is removed, even one that the fitted model does not have.
        """
        wv, scales, share = fit.wv, Scales.of(fit.wv), 1.0 / len(noises)
        spectra = [scales.spectrum(noise) for noise in noises]
        lines = [(f, a * share**0.5) for noise in noises for f, a in noise.lines()]

        def psd(f: FloatArray, dt: float) -> FloatArray:
            return share * np.sum([each(f, dt) for each in spectra], axis=0)

        covariance, variance = wv.covariance_under(psd, lines), wv.variance
        if drifting:
            slope = gls_slope(wv, psd)
            means = wv.mean_covariance_under(psd)
            covariance = detrended_covariance(covariance, means, wv.drift_response, slope)
            variance = wv.detrended(slope.value) + slope.variance * wv.drift_response**2
        implied = share * np.sum([scales.curve(noise) for noise in noises], axis=0)
        relative = covariance / np.outer(implied, implied)
        known = (variance > 0.0) & (np.diag(relative) <= 2.0 / tuning.LEAST_DOF)
        first = slice(0, known.size if known.all() else int(np.argmin(known)))
        return cls(wv.tau[first], variance[first], relative[first, first])


@dataclass(frozen=True, eq=False)
class Difference:
    """How far recordings are apart in one part of the Allan plot.

    ratios: (R,), Allan deviation of each recording over the common one; NaN without data there.
    errors: (R,), relative standard errors of these.
    """

    part: str
    shortest: float
    longest: float
    ratios: FloatArray
    errors: FloatArray

    @property
    def extent(self) -> float:
        """The largest deviation over the smallest, less one."""
        return float(np.nanmax(self.ratios) / np.nanmin(self.ratios) - 1.0)

    @property
    def sigma(self) -> float:
        """Significance as the point of a normal variable that is as improbable.

        For two recordings, their difference over its standard error.
        """
        known = np.isfinite(self.ratios)
        values, weight = np.log(self.ratios[known]), self.errors[known] ** -2.0
        square = float(np.sum(weight * (values - np.average(values, weights=weight)) ** 2))
        dof = values.size - 1
        p = float(chi2.sf(square, dof))
        if p < _UNDERFLOW:
            return float(np.sqrt(square - dof + 1.0))
        return max(float(norm.isf(0.5 * p)), 0.0)

    @property
    def resolution(self) -> float:
        """Relative difference of two of the recordings that would most likely have been found."""
        errors = self.errors[np.isfinite(self.errors)]
        return float(tuning.POWER * np.sqrt(2.0 * np.mean(errors**2)))


@dataclass(frozen=True, eq=False)
class Equality:
    """Test that several recordings have the same wavelet variances.

    tau: (J,), averaging times that at least two recordings have, s.
    common: (J,), mean wavelet variance, u^2.
    ratios, errors: (R, J), Allan deviation of each recording over the common one, and relative
        standard errors; NaN where a recording has no such level.
    chi_square: Weighted sum of squares about the common curve, on cube roots of the variances.
    """

    tau: FloatArray
    common: FloatArray
    ratios: FloatArray
    errors: FloatArray
    chi_square: float
    dof: int
    differences: tuple[Difference, ...]

    @property
    def p_value(self) -> float:
        """p-value of equal recordings; NaN where nothing can be compared."""
        return float(chi2.sf(self.chi_square, self.dof)) if self.dof > 0 else float("nan")

    @property
    def evident(self) -> tuple[Difference, ...]:
        """Parts that differ beyond chance, the most certain one first."""
        found = [each for each in self.differences if each.sigma > tuning.EVIDENT]
        return tuple(sorted(found, key=lambda each: -each.sigma))

    @classmethod
    def of(cls, fits: Sequence[Fit]) -> Self:
        """The test for fits to several recordings of one channel at one rate."""
        drifting = any(term.is_drift for fit in fits for term in fit.model.terms)
        terms = [tuple(t for t in fit.model.terms if not t.is_drift) for fit in fits]
        noises = [Model(each) for each in terms if each]  # an Allan fit may have a ramp only
        curves = [Curve.of(fit, noises, drifting=drifting) for fit in fits]
        levels = sorted(curve.tau.size for curve in curves)[-2]
        tau = next(curve.tau[:levels] for curve in curves if curve.tau.size >= levels)
        for curve in curves:
            moved = np.abs(np.log(curve.tau[:levels] / tau[: curve.tau.size]))
            if np.any(moved > 2.0 * tuning.SAME_RATE):
                raise InputError(
                    "the curves have different averaging times: give all at the same times"
                )
        variance, share = np.full((2, len(curves), levels), np.nan)
        for row, part, curve in zip(variance, share, curves, strict=True):
            own = min(curve.tau.size, levels)
            row[:own], part[:own] = curve.variance[:own], np.diag(curve.relative)[:own]
        common = np.nansum(variance / share, axis=0) / np.nansum(1.0 / share, axis=0)
        ratios = np.sqrt(variance / common)
        chi_square, dof = _chi_square(curves, common)
        differences = _differences(tau, common, np.log(ratios), curves)
        return cls(tau, common, ratios, 0.5 * np.sqrt(share), chi_square, dof, differences)


def _chi_square(curves: Sequence[Curve], common: FloatArray) -> tuple[float, int]:
    """Statistic of the test and its degrees of freedom.

    Cube roots of chi-square variables are close to normal (Wilson & Hilferty 1931, *PNAS* 17,
    684-688); the common curve is their mean by generalized least squares.
    """
    levels = common.size
    if levels == 0:
        return float("nan"), 0
    information, right = np.zeros((levels, levels)), np.zeros(levels)
    points = []
    for curve in curves:
        size = min(curve.tau.size, levels)
        if size == 0:
            continue
        share = curve.relative[:size, :size] / 9.0
        value = np.cbrt(curve.variance[:size] / common[:size]) + np.diag(share)
        root = weight_root(share)
        information[:size, :size] += root.T @ root
        right[:size] += root.T @ (root @ value)
        points.append((value, root))
    mean = np.linalg.solve(information, right)
    away = [root @ (value - mean[: value.size]) for value, root in points]
    return float(sum(each @ each for each in away)), sum(each.size for each in away) - levels


def _differences(
    tau: FloatArray, common: FloatArray, logs: FloatArray, curves: Sequence[Curve]
) -> tuple[Difference, ...]:
    """Differences of the recordings in each part of the plot that two of them have."""
    if tau.size < 2:
        return ()
    fine = tau < max(tuning.FINEST_TIME, tuning.FINEST_SAMPLES * float(tau[0]))
    slope = np.gradient(np.log(common), np.log(tau))
    parts: NDArray[np.intp] = np.where(fine, 0, 1 + np.searchsorted(_SLOPES, slope))
    found = []
    for place, part in enumerate(PARTS):
        levels = np.flatnonzero(parts == place)
        ratios, errors = np.full((2, len(curves)), np.nan)
        for r, curve in enumerate(curves):
            own = levels[levels < curve.tau.size]
            if own.size == 0:
                continue
            weight = 1.0 / np.diag(curve.relative)[own]
            weight /= np.sum(weight)
            ratios[r] = np.exp(weight @ logs[r, own])
            errors[r] = 0.5 * np.sqrt(weight @ curve.relative[np.ix_(own, own)] @ weight)
        if np.count_nonzero(np.isfinite(ratios)) > 1:
            ends = float(tau[levels[0]]), float(tau[levels[-1]])
            found.append(Difference(part, *ends, ratios, errors))
    return tuple(found)
