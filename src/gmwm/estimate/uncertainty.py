"""From the minimum to a result: the covariance of the parameters, and upper bounds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2, norm

from gmwm._typing import FloatArray
from gmwm.estimate.coordinates import shape_jacobian
from gmwm.estimate.design import Design
from gmwm.estimate.discrepancy import chi_square
from gmwm.estimate.fit import Fit
from gmwm.estimate.information import error_growth, slope_dof
from gmwm.estimate.profile import Point, weight_root
from gmwm.estimate.ramp import Slope
from gmwm.estimate.remarks import (
    bound_remarks,
    confounded_remarks,
    count_remarks,
    idle_remarks,
    merged_remarks,
    misfit,
    shape_remarks,
    undetermined_remarks,
)
from gmwm.estimate.weights import Weights
from gmwm.process import Model, Process
from gmwm.process.base import Shape
from gmwm.variance.wavelet import WaveletVariance

_UPPER_LEVEL = 0.95
SIGNIFICANT = 1.645  # standard errors above zero, one-sided 5 %


def describe(
    design: Design,
    target: FloatArray,
    covariance: FloatArray,
    point: Point,
    slope: Slope | None,
    *,
    basis: FloatArray,
    wv: WaveletVariance,
    weights: Weights,
    method: str,
    slope_is_free: bool,
    discrepancy: float,
) -> Fit:
    """Make the `Fit` of a minimum.

    Parameters
    ----------
    design : Design
    target : (J,) ndarray
        The moments that were fitted, u^2.
    covariance : (J, J) ndarray
        Their covariance under the fitted model, u^4.
    point : Point
        The minimum.
    slope : Slope or None
    basis : (J,) ndarray
        The wavelet variances to which ``covariance`` belongs, u^2.
    wv : WaveletVariance
    weights : Weights
    method : str
    slope_is_free : bool
    discrepancy : float
        Relative error granted to the model, part of ``covariance``.
    """
    order = design.ordered(point.shapes)
    shapes = [point.shapes[i] for i in order]
    amplitudes = design.amplitudes(point.x)[order]
    model, places = _fitted_model(design, point, order, slope)
    sub = Design(_noise(design, order), design.scales)
    x = amplitudes[list(sub.linear)]
    keys, matrix, upper = _linearise(sub, shapes, x, target, covariance, weights, places, model)
    implied = sub.curves(shapes) @ sub.amplitudes(x)
    residual = target - implied
    whitened = weight_root(covariance) @ residual
    objective = float(whitened @ whitened)
    n_free = len(keys)
    dof = design.scales.tau.size - n_free
    p_value = float("nan")
    if dof > 0 and np.all(basis > 0.0):
        p_value = float(chi2.sf(chi_square(target, implied, covariance, basis)[1], dof))
    growth = error_growth(model, keys, wv.n, wv.dt)
    dof_of_slope = np.inf
    if slope_is_free and slope is not None:
        dof_of_slope = slope_dof(model, keys, matrix, wv.n, wv.dt)
        ramp_key = next(i.key for i in model.parameters if i.parameter.role == "slope")
        keys = (*keys, ramp_key)
        matrix = np.pad(matrix, (0, 1))
        matrix[-1, -1] = slope.variance
        keys, matrix = in_model_order(model, keys, matrix)
    remarks = [
        *bound_remarks(model, upper),
        *shape_remarks(sub, shapes, x),
        *idle_remarks(sub, Point(shapes, x, objective), target, covariance),
        *undetermined_remarks(model, keys, matrix),
        *merged_remarks(model, keys, matrix),
        *confounded_remarks(model, keys, matrix),
        *count_remarks(design, sub),
    ]
    misfits, poor = misfit(wv, target, implied, covariance, discrepancy)
    return Fit(
        model=model,
        wv=wv,
        keys=keys,
        covariance=matrix,
        upper_bounds=upper,
        objective=objective,
        dof=dof,
        discrepancy=discrepancy,
        p_value=p_value,
        method=method,
        omega=weights.omega,
        valid=not remarks and not poor,
        remarks=(*remarks, *misfits),
        slope_dof=dof_of_slope,
        error_growth=growth,
    )


def _noise(design: Design, order: Sequence[int]) -> Model:
    return Model(tuple(design.terms[i].process for i in order))


def _fitted_model(
    design: Design, point: Point, order: Sequence[int], slope: Slope | None
) -> tuple[Model, list[int]]:
    """The model with its estimated values, and where the ordered terms stand in it."""
    fitted = design.fitted_processes(point.x, point.shapes)
    terms: list[Process] = list(design.model.terms)
    places = [term.index for term in design.terms]
    for place, i in zip(places, order, strict=True):
        terms[place] = fitted[i]
    for i, term in enumerate(terms):
        if slope is not None and any(p.role == "slope" for p in term.parameters):
            terms[i] = term.with_values(R=slope.value)
    return Model(tuple(terms)), places


def _linearise(
    design: Design,
    shapes: Sequence[Shape],
    x: FloatArray,
    target: FloatArray,
    covariance: FloatArray,
    weights: Weights,
    places: Sequence[int],
    model: Model,
) -> tuple[tuple[str, ...], FloatArray, dict[str, float]]:
    """Keys and covariance of the free parameters; upper bounds of those not above zero.

    The covariance is the sandwich B V B' with B = (D' Omega D)^-1 D' Omega of the wavelet
    variances' covariance V, in the parameters' own units. A term of zero amplitude has no
    covariance; the bound of its amplitude is the quantile of the normal distribution of the
    unconstrained estimate, cut at zero. The same bound is given for an amplitude that is not
    significantly above zero.
    """
    amplitudes = design.amplitudes(x)
    curves = design.curves(shapes)
    owners = design.owners()
    slopes = design.shape_derivatives(shapes) * amplitudes[owners]
    positive = [k for k, i in enumerate(design.linear) if amplitudes[i] > 0.0]
    alive = [k for k, i in enumerate(owners) if amplitudes[i] > 0.0]
    jacobian = np.column_stack([curves[:, [design.linear[k] for k in positive]], slopes[:, alive]])
    natural = _sandwich(jacobian, covariance, weights)
    by_term = {(i.term, i.parameter.name): i.key for i in model.parameters}
    keys: list[str] = []
    upper: dict[str, float] = {}
    transform = np.zeros((jacobian.shape[1], jacobian.shape[1]))
    for row, k in enumerate(positive):
        i = design.linear[k]
        parameter = design.terms[i].linear_parameter
        keys.append(by_term[places[i], parameter.name])
        value = amplitudes[i] ** (1.0 / parameter.power)
        transform[row, row] = value / (parameter.power * amplitudes[i])
        deviation = float(np.sqrt(natural[row, row]))
        if i not in design.shaped and amplitudes[i] < SIGNIFICANT * deviation:
            bound = quantile_above_zero(float(amplitudes[i]), deviation)
            upper[keys[-1]] = bound ** (1.0 / parameter.power)
    start = len(positive)
    for i in design.shaped:
        columns = [start + alive.index(k) for k, owner in enumerate(owners)
                   if owner == i and k in alive]  # fmt: skip
        if not columns:
            continue
        term = design.terms[i]
        named = zip(term.process.shape_parameters, term.free_shape, strict=True)
        keys.extend(by_term[places[i], p.name] for p, is_free in named if is_free)
        block = shape_jacobian(term.process, shapes[i], term.free_shape)
        transform[np.ix_(columns, columns)] = block
    matrix = transform @ natural @ transform.T
    for i in design.linear:
        if amplitudes[i] == 0.0:
            parameter = design.terms[i].linear_parameter
            residual = target - curves @ amplitudes
            bound = _upper_amplitude(jacobian, curves[:, i], residual, covariance)
            upper[by_term[places[i], parameter.name]] = bound ** (1.0 / parameter.power)
    ordered_keys, ordered = in_model_order(model, tuple(keys), matrix)
    return ordered_keys, ordered, upper


def in_model_order(
    model: Model, keys: tuple[str, ...], matrix: FloatArray
) -> tuple[tuple[str, ...], FloatArray]:
    """Keys and covariance in the order of the model's parameters."""
    ranked = [key for key in model.params if key in keys]
    index = [keys.index(key) for key in ranked]
    return tuple(ranked), matrix[np.ix_(index, index)]


def _sandwich(jacobian: FloatArray, covariance: FloatArray, weights: Weights) -> FloatArray:
    """B V B' on parameters scaled so that they are of like size."""
    if jacobian.shape[1] == 0:
        return np.zeros((0, 0))
    root = weights.root(covariance)
    weighted = root @ jacobian
    length = np.sqrt(np.sum(weighted**2, axis=0))
    length[length == 0.0] = 1.0
    estimator = np.linalg.pinv(weighted / length, rcond=1e-10) @ root / length[:, None]
    return np.asarray(estimator @ covariance @ estimator.T)


def _upper_amplitude(
    jacobian: FloatArray, curve: FloatArray, residual: FloatArray, covariance: FloatArray
) -> float:
    """95 % upper bound of a non-negative amplitude whose estimate is zero."""
    root = weight_root(covariance)
    column, others = root @ curve, root @ jacobian
    if others.shape[1]:
        basis, _ = np.linalg.qr(others)
        column = column - basis @ (basis.T @ column)
    information = float(column @ column)
    if information <= 0.0:
        return float("inf")
    deviation = 1.0 / np.sqrt(information)
    centre = float(column @ (root @ residual)) / information
    return quantile_above_zero(centre, deviation)


def quantile_above_zero(centre: float, deviation: float) -> float:
    """95 % quantile of N(centre, deviation^2) restricted to positive values."""
    tail = norm.sf(-centre / deviation) * (1.0 - _UPPER_LEVEL)
    return centre + deviation * float(norm.isf(tail))
