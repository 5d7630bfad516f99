"""Coefficients of a curve beside the noise, as certain as the fitted noise allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.estimate import tuning
from gmwm.estimate.problem import CurveRegression, Scales
from gmwm.estimate.result.fit import Fit
from gmwm.process import Model

_STEP = 1e-2  # of a standard error


@dataclass(frozen=True, eq=False)
class CurveCoefficients:
    """Coefficients of the regressors that a wavelet variance holds.

    values: (p,), u.
    covariance: (p, p), u^2.
    spread: (k, p * p), errors of ``covariance`` by each of k independent errors of the noise.
    """

    values: FloatArray
    covariance: FloatArray
    spread: FloatArray

    @classmethod
    def of(cls, fit: Fit) -> CurveCoefficients:
        """By generalized least squares under the noise of a fit.

        A term that came out as zero counts with its mean size within its limit.
        """
        wv, curve = fit.wv, fit.wv.regressors
        if curve is None:
            raise ValueError("the wavelet variance has no regressors")
        scales, regression = Scales.of(wv), CurveRegression(wv, curve)
        found = regression.estimated(scales.spectrum(fit.model))

        def covariance(model: Model) -> FloatArray:
            return regression.covariances(found, [scales.spectrum(model)])[0]

        total, size = covariance(fit.model), curve.removed.size
        for item in fit.model.parameters:
            limit, term = fit.upper_bounds.get(item.key, np.inf), fit.model.terms[item.term]
            if fit.params[item.key] == 0.0 and np.isfinite(limit) and limit > 0.0:
                largest = term.with_values(**{item.parameter.name: float(limit)})
                total = total + tuning.MEAN_OF_LIMIT * covariance(Model((largest,)))
        changes = np.zeros((len(fit.keys), size * size))
        for row, key in enumerate(fit.keys):
            step = _STEP * min(fit.stderr[key], abs(fit.params[key]))
            ends = (
                covariance(fit.model.with_params({key: fit.params[key] + sign * step}))
                for sign in (1.0, -1.0)
            )
            if step > 0.0:
                changes[row] = np.subtract(*ends).ravel() / (2.0 * step)
        values, vectors = np.linalg.eigh(fit.covariance) if fit.keys else (np.zeros(0), changes)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        return cls(curve.removed + found.values, total, root.T @ changes)


def satterthwaite_dof(
    contrast: FloatArray, covariance: FloatArray, spread: FloatArray
) -> FloatArray:
    """Degrees of freedom of the variance of ``contrast @ coefficients``, (k,).

    That variance is computed from estimated noise; one of relative error r has 2/r^2 of them
    (Satterthwaite 1946, *Biometrics Bulletin* 2, 110-114).

    contrast: (k, p).
    covariance, spread: See `CurveCoefficients`.
    """
    variance = np.einsum("ki,ij,kj->k", contrast, covariance, contrast)
    size = contrast.shape[1]
    error = np.einsum("ki,mij,kj->km", contrast, spread.reshape(-1, size, size), contrast)
    square = np.sum(error**2, axis=1)
    ratio = np.divide(2.0 * variance**2, square, out=np.full_like(square, np.inf), where=square > 0)
    return np.maximum(ratio, 1.0)
