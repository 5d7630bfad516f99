"""From the minimum of the method of moments to a result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.estimate.moments.checks import (
    level_notices,
    limit_notices,
    redundant_notices,
    with_doubtful_terms,
)
from gmwm.estimate.moments.design import Design
from gmwm.estimate.moments.profile import Point
from gmwm.estimate.moments.weights import Weights
from gmwm.estimate.problem import FittedMoments, Moments, drift_key, weight_root
from gmwm.estimate.result import (
    Comparison,
    Estimates,
    Fit,
    Goodness,
    conclude,
    upper_amplitude,
)
from gmwm.variance import WaveletVariance


def conclude_moments(
    design: Design,
    moments: Moments,
    covariance: FloatArray,
    statistical: FloatArray,
    point: Point,
    basis: FloatArray,
    weights: Weights,
    method: str,
    discrepancy: float,
    without: Callable[[int], Goodness | None],
) -> Fit:
    """Make the `Fit` of a minimum.

    moments: What was fitted.
    covariance: (J, J), of the moments under the fitted model, with the discrepancy, u^4.
    statistical: (J, J), the same without it.
    point: The minimum.
    basis: (J,), the wavelet variances to which ``covariance`` belongs, u^2.
    discrepancy: Relative error allowed for at each level, part of ``covariance``.
    without: How well the fit without a noise term describes the data: whether it is needed.
    """
    target = moments.target
    curves, amplitudes = design.curves(point.shapes), design.amplitudes(point.x)
    implied = curves @ amplitudes
    absent = [i for i in design.linear if amplitudes[i] == 0.0]
    jacobian = _jacobian(design, point, curves, absent)
    found = Estimates(
        coordinates=design.coordinates,
        processes=design.fitted_processes(point.x, point.shapes),
        covariance=_sandwich(jacobian, covariance, weights),
        absent={
            i: _upper_scale(
                design,
                point,
                i,
                absent,
                moments.wv,
                *_unrestricted(jacobian, curves[:, i], target - implied, covariance),
            )
            for i in absent
        },
        slope=moments.slope if moments.slope_is_free else None,
    )
    comparison = Comparison.of(target, implied, covariance, basis, jacobian.shape[1], statistical)
    fit = conclude(
        found, comparison, moments.wv, method=method, weights=weights.name,
        discrepancy=discrepancy, misfits=discrepancy > 0.0,
        notices=[
            *limit_notices(design, point.shapes, point.x),
            *level_notices(target.size, design.n_free),
        ],
    )  # fmt: skip
    keys = design.coordinates.fitted(found.processes, None)[1]
    places = {
        key: i
        for key, (i, is_amplitude) in zip(keys, design.coordinates.owners, strict=True)
        if is_amplitude
    }
    judged = replace(point, objective=comparison.objective)
    redundant = redundant_notices(design, judged, target, covariance)
    return with_doubtful_terms(fit, redundant, places, without)


def goodness_of(design: Design, moments: Moments, point: Point, discrepancy: float) -> Goodness:
    """How well a minimum describes the data: what `Fit.goodness` of its fit is."""
    slope = moments.slope if moments.slope_is_free else None
    processes = design.fitted_processes(point.x, point.shapes)
    model, keys = design.coordinates.fitted(processes, None if slope is None else slope.value)
    error = 0.0
    if slope is not None:
        keys.append(str(drift_key(model)))
        error = float(np.sqrt(slope.variance))
    at = FittedMoments.of(model, moments.wv, keys, error, discrepancy)
    return Goodness.of(at, moments.wv, is_tested=True)


def _jacobian(design: Design, point: Point, curves: FloatArray, absent: list[int]) -> FloatArray:
    """Derivative of the moments by the coordinates of the terms that have an amplitude, (J, d)."""
    amplitudes = design.amplitudes(point.x)
    slopes = iter((design.shape_derivatives(point.shapes) * amplitudes[design.owners()]).T)
    columns = [np.zeros((0, curves.shape[0]))]
    for i, is_amplitude in design.coordinates.owners:
        column = curves[:, i] * amplitudes[i] if is_amplitude else next(slopes)
        if i not in absent:
            columns.append(column[None, :])
    return np.concatenate(columns).T


def _sandwich(jacobian: FloatArray, covariance: FloatArray, weights: Weights) -> FloatArray:
    """B V B' with B = (D' Omega D)^-1 D' Omega, on parameters scaled to be of like size."""
    if jacobian.shape[1] == 0:
        return np.zeros((0, 0))
    root = weights.root(covariance)
    weighted = root @ jacobian
    length = np.sqrt(np.sum(weighted**2, axis=0))
    length[length == 0.0] = 1.0
    estimator = np.linalg.pinv(weighted / length, rcond=1e-10) @ root / length[:, None]
    return np.asarray(estimator @ covariance @ estimator.T)


def _unrestricted(
    jacobian: FloatArray, curve: FloatArray, residual: FloatArray, covariance: FloatArray
) -> tuple[float, float]:
    """Estimate of an amplitude that came out as zero, were it free, and its standard error."""
    root = weight_root(covariance)
    column, others = root @ curve, root @ jacobian
    if others.shape[1]:
        length = np.sqrt(np.sum(others**2, axis=0))
        basis, _ = np.linalg.qr(others / np.where(length > 0.0, length, 1.0))
        column = column - basis @ (basis.T @ column)
    information = float(column @ column)
    if information <= 0.0:
        return 0.0, float("inf")
    return float(column @ (root @ residual)) / information, 1.0 / float(np.sqrt(information))


def _upper_scale(
    design: Design,
    point: Point,
    term: int,
    absent: list[int],
    wv: WaveletVariance,
    centre: float,
    deviation: float,
) -> float:
    """95 % upper bound of the scale of a term whose amplitude came out as zero."""
    others = [i for i in absent if i != term]
    part = [i for i in range(len(design.terms)) if i not in others]
    processes = design.fitted_processes(point.x, point.shapes)
    bound = upper_amplitude(
        design.coordinates.without(others), [processes[i] for i in part], part.index(term),
        centre, deviation, 0.0, wv,
    )  # fmt: skip
    return float(max(bound, 0.0) ** (1.0 / design.terms[term].linear.power))
