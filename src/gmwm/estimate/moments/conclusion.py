"""From the minimum of the method of moments to a fit, without terms that the data do not need."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import islice

import numpy as np

from gmwm._core.distributions import chi2
from gmwm._core.typing import FloatArray
from gmwm.estimate import tuning
from gmwm.estimate.moments.design import Design
from gmwm.estimate.moments.profile import Point, Profile
from gmwm.estimate.problem.moments import Compared, FittedMoments, Moments
from gmwm.estimate.problem.parameters import drift_key
from gmwm.estimate.problem.ramp import Slope
from gmwm.estimate.problem.regressors import Coefficients
from gmwm.estimate.result.bound import upper_limits
from gmwm.estimate.result.conclusion import Estimates, agreement, conclude, estimate_notices
from gmwm.estimate.result.fit import Fit
from gmwm.estimate.result.goodness import Goodness
from gmwm.issues import Notice, notice
from gmwm.process import Process
from gmwm.variance import WaveletVariance


@dataclass(frozen=True, eq=False)
class Converged:
    """The minimum of a fit, without the series: it is cached with that and must not keep it.

    found: Coefficients of the ramp or the curve removed from the wavelet variances.
    covariance: (J, J), of the moments, with the discrepancy, u^4.
    root: (J, J), L with L'L the weights, the inverse of ``covariance`` unless others are chosen.
    point: The minimum under the weights.
    discrepancy: Relative error allowed for at each level.
    """

    design: Design
    found: Coefficients | None
    compared: Compared
    covariance: FloatArray
    root: FloatArray
    point: Point
    discrepancy: float

    def moments(self, wv: WaveletVariance) -> Moments:
        """The moments that were fitted."""
        return replace(Moments.of(wv, self.design.model, self.design.scales), found=self.found)

    @cached_property
    def processes(self) -> Sequence[Process]:
        """The noise terms with their values."""
        return self.design.fitted_processes(self.point.x, self.point.shapes)

    @property
    def present(self) -> list[int]:
        """Coordinates of the terms that have an amplitude."""
        amplitudes = self.design.amplitudes(self.point.x)
        owners = self.design.coordinates.owners
        return [k for k, (i, _) in enumerate(owners) if amplitudes[i] > 0.0]

    def moved(self, point: Point) -> Converged:
        """The same at another point."""
        implied = self.design.implied(point.x, point.shapes)
        return replace(self, point=point, compared=replace(self.compared, implied=implied))

    def goodness(self, wv: WaveletVariance) -> Goodness:
        """Agreement of the data with the fitted model."""
        slope = self.moments(wv).slope
        value = None if slope is None else slope.value
        model, _ = self.design.coordinates.fitted(self.processes, value)
        at = FittedMoments.of(model, wv, self.discrepancy, is_free=slope is not None)
        return Goodness.of(at, wv, is_tested=True)


def conclude_moments(end: Converged, wv: WaveletVariance, method: str) -> Fit:
    """Make the `Fit` of a minimum under model weights."""
    design, point, moments, root = end.design, end.point, end.moments(wv), end.root
    coordinates, processes, present = design.coordinates, end.processes, end.present
    compared, slope = end.compared, moments.slope
    jacobian, curves = _jacobian(end, moments)
    covariance = _sandwich(jacobian, end.covariance, root)
    absent = [i for i in design.linear if design.amplitudes(point.x)[i] == 0.0]
    weighted, residual = root @ jacobian, root @ compared.residual
    free = {i: _unrestricted(weighted, root @ curves[:, i], residual) for i in absent}
    limits = upper_limits(coordinates, processes, present, covariance, free, wv)
    own = moments.coefficient_covariances(design.unit_terms(point.shapes))
    for i in absent:
        if own is not None and slope is not None and np.isfinite(limits[i]):
            more = tuning.MEAN_OF_LIMIT * limits[i] ** design.terms[i].linear.power * own[i]
            slope = Coefficients(slope.values, slope.covariance + more)
    notices = limit_notices(end)
    if wv.tau.size < design.n_free:
        values = {"levels": wv.tau.size, "parameters": design.n_free}
        notices.append(notice("too-few-levels", "", values))
    found = Estimates(
        coordinates=coordinates,
        processes=processes,
        present=present,
        covariance=covariance,
        limits=limits,
        slope=slope,
        method=method,
        weights="model",
        discrepancy=end.discrepancy,
        notices=notices,
    )
    agrees = agreement(compared, end.covariance, len(present))
    return conclude(found, agrees, wv, misfits=end.discrepancy > 0.0)


def reweighted(fit: Fit, end: Converged, other: Converged, weights: str) -> Fit:
    """The fit with another Omega: the minimum of eq. (9), errors by eq. (10) of Stebler et al.

    Whether the model is right and which terms the data need does not depend on Omega, so that all
    tests are those of the fit by model weights. B and the covariance of the wavelet variances are
    taken there too: at a poor estimate, errors would be as poor as that.

    end, other: The minimum under model weights, and that under the others.
    """
    coordinates = end.design.coordinates
    jacobian, _ = _jacobian(end, end.moments(fit.wv))
    matrix = _sandwich(jacobian, end.covariance, other.root)
    before, keys = (coordinates.fitted(each.processes)[1] for each in (end, other))
    rows = {before[k]: row for row, k in enumerate(end.present)}
    present = [k for k in other.present if keys[k] in rows]
    order = [rows[keys[k]] for k in present]
    drift, ends = str(drift_key(fit.model)), fit.interval()
    found = Estimates(
        coordinates=coordinates,
        processes=other.processes,
        present=present,
        covariance=matrix[np.ix_(order, order)],
        limits={
            i: ends[keys[k]][1]
            for k, (i, is_amplitude) in enumerate(coordinates.owners)
            if is_amplitude and k not in present and keys[k] in ends
        },
        slope=Slope(fit.params[drift], fit.stderr[drift] ** 2) if drift in fit.keys else None,
    )
    model, ordered, covariance, limits = found.by_key()
    upper = {**fit.upper_bounds, **limits}
    bad, others = estimate_notices(model, ordered, covariance, upper, fit.wv)
    kept = [each for each in fit.notices if each.code not in _OF_VALUES]
    return replace(
        fit,
        model=model,
        keys=ordered,
        covariance=covariance,
        upper_bounds=upper,
        weights=weights,
        notices=(*bad, *others, *limit_notices(other), *kept),
    )


_OF_VALUES = {"amplitude-bound", "confounded", "indistinct-terms", "search-limit"}
_OF_VALUES |= {"sensor-bandwidth", "undetermined"}
"""Codes of notices about estimates, which belong to one Omega; the others are about the model."""


def _jacobian(end: Converged, moments: Moments) -> tuple[FloatArray, FloatArray]:
    """Derivative of the moments by the coordinates of terms with an amplitude; curves of all."""
    design, point = end.design, end.point
    amplitudes, curves = design.amplitudes(point.x), design.curves(point.shapes)
    lost = moments.lost(design.unit_terms(point.shapes))
    if lost is not None:
        curves -= lost
    slopes = iter((design.shape_derivatives(point.shapes) * amplitudes[design.owners]).T)
    columns = [
        curves[:, i] * amplitudes[i] if is_amplitude else next(slopes)
        for i, is_amplitude in design.coordinates.owners
    ]
    derivative = np.reshape(columns, (len(columns), len(curves)))
    return derivative[end.present].T, curves


def _sandwich(jacobian: FloatArray, covariance: FloatArray, root: FloatArray) -> FloatArray:
    """B V B' with B = (D' L' L D)^-1 D' L' L, on parameters scaled to be of like size."""
    if jacobian.shape[1] == 0:
        return np.zeros((0, 0))
    weighted = root @ jacobian
    length = np.sqrt(np.sum(weighted**2, axis=0))
    unknown = np.where(length == 0.0, tuning.SEARCH_REACH**2, 0.0)
    length[length == 0.0] = 1.0
    estimator = np.linalg.pinv(weighted / length, rcond=1e-10) @ root / length[:, None]
    # A shape without effect, such as a bandwidth above half the rate, is not known at all.
    return np.asarray(estimator @ covariance @ estimator.T + np.diag(unknown))


def _unrestricted(
    others: FloatArray, column: FloatArray, residual: FloatArray
) -> tuple[float, float]:
    """Estimate of an amplitude that came out as zero, were it free, and its standard error.

    others, column, residual: Weighted Jacobian of the free parameters, curve and residuals.
    """
    if others.shape[1]:
        length = np.sqrt(np.sum(others**2, axis=0))
        basis, _ = np.linalg.qr(others / np.where(length > 0.0, length, 1.0))
        column = column - basis @ (basis.T @ column)
    information = float(column @ column)
    if information <= 0.0:
        return 0.0, float("inf")
    return float(column @ residual) / information, 1.0 / float(np.sqrt(information))


def limit_notices(end: Converged) -> list[Notice]:
    """Shapes at the limit of the search."""
    design, shapes = end.design, end.point.shapes
    amplitudes, z = design.amplitudes(end.point.x), design.pack(shapes)
    low, high = design.bounds
    at_limit = (z <= low + tuning.SEARCH_MARGIN) | (z >= high - tuning.SEARCH_MARGIN)
    notices = []
    for k, i in enumerate(design.owners):
        if amplitudes[i] > 0.0 and at_limit[k]:
            process = end.processes[i]
            values = {"process": type(process).__name__, "shape": shapes[i][0]}
            notices.append(notice("search-limit", "", values, term=process.named()))
    return notices


def with_doubtful_terms(
    fit: Fit, end: Converged, without: Callable[[int], Converged | None]
) -> Fit:
    """A fit with the notice of the term that the data can do without, if there is one.

    A slow term raises the errors of the very levels that show it, so that neither its gain nor its
    amplitude looks significant under the noise that it is part of. It is needed all the same where
    the model without it, by its own errors, misses an averaging time (`Goodness.loses_to`). Several
    similar terms can stand in for each other: one of them is too many, not all.

    without: The minimum without a noise term; None if nothing is left to fit.
    """
    redundant = _redundant_terms(end, fit.objective)
    # One without a finite interval is only limited, whether it is needed or not.
    largest = {key: tuning.UNDETERMINED * fit.params[key] for key in fit.upper_bounds}
    present = [key for key, error in fit.stderr.items() if 0.0 < error <= largest.get(key, 0.0)]
    if not redundant and not present:
        return fit

    @lru_cache
    def is_needed(i: int) -> bool:
        if fit.goodness.is_excluded:
            return False
        reduced = without(i)
        return reduced is not None and reduced.goodness(fit.wv).loses_to(fit.goodness)

    coordinates = end.design.coordinates
    keys = coordinates.fitted(end.processes)[1]
    places = {key: i for key, (i, _) in zip(keys, coordinates.owners, strict=True)}
    found = {key for key in present if is_needed(places[key])}
    notices = [n for n in fit.notices if n.code != "amplitude-bound" or n.where not in found]
    for gain, i in islice(((gain, i) for gain, i in redundant if not is_needed(i)), 1):
        process = end.processes[i]
        shape = {p.name: process.values[p.name] for p in process.shape_parameters}
        values = {"process": type(process).__name__, "gain": gain, **shape}
        notices.append(notice("redundant-term", "", values, term=process.named()))
    bounds = {key: bound for key, bound in fit.upper_bounds.items() if key not in found}
    return replace(fit, notices=tuple(notices), upper_bounds=bounds)


def _redundant_terms(end: Converged, objective: float) -> list[tuple[float, int]]:
    """Gain and place of terms that do not improve the fit significantly, the least useful first.

    Only terms with free shapes are tested. Their amplitude alone does not show it: among all shapes
    one always fits some accident. The objective without the term does, at one per cent shared among
    the levels where a term of this kind might have been found.

    objective: Of the minimum under its own covariance.
    """
    design, point, target = end.design, end.point, end.compared.target
    amplitudes = design.amplitudes(point.x)
    redundant: list[tuple[float, int]] = []
    for i in design.shaped:
        others = [k for k in range(len(design.terms)) if k != i]
        if amplitudes[i] == 0.0 or i not in design.linear or not others:
            continue
        reduced = Profile(design.part(others), target, end.root)
        without = reduced.refine(reduced.at([point.shapes[k] for k in others])).objective
        gain, freed = without - objective, 1 + design.terms[i].n_shapes
        if gain < chi2.isf(tuning.REDUNDANT_P / target.size, freed):
            redundant.append((gain, i))
    return sorted(redundant)
