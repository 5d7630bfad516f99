"""Residuals by their covariance: whitened, and as a chi-square."""

from __future__ import annotations

import numpy as np

from gmwm._core.typing import FloatArray


def weight_root(covariance: FloatArray) -> FloatArray:
    """L with L'L the inverse of a covariance matrix, computed on its correlations."""
    scale = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(scale, scale)
    values, vectors = np.linalg.eigh(correlation)
    # Levels that are all but copies of each other must not be weighted by rounding errors.
    values = np.maximum(values, 1e-8 * values[-1])
    return np.asarray((vectors / np.sqrt(values)).T / scale)


def chi_square(
    target: FloatArray, implied: FloatArray, covariance: FloatArray, basis: FloatArray
) -> tuple[FloatArray, float]:
    """Standardised residuals per level and their chi-square, on the cube-root scale.

    ``basis`` (J,) are the wavelet variances to which ``covariance`` belongs. A wavelet variance of
    few degrees of freedom is far from normal, its cube root is not (Wilson & Hilferty 1931, *PNAS*
    17, 684-688).
    """
    scale = np.sqrt(np.diag(covariance))
    share = (scale / basis) ** 2 / 9.0  # 2/(9 dof)
    root, expected = np.cbrt(target / basis), np.cbrt(implied / basis) * (1.0 - share)
    standard = (root - expected) / np.sqrt(share)
    whitened = weight_root(covariance / np.outer(scale, scale)) @ standard
    return standard, float(whitened @ whitened)
