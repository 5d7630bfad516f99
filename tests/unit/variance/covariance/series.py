"""Noises whose wavelet covariances are held to those of their samples."""

import numpy as np
from scipy.linalg import toeplitz

import gmwm

PROCESSES = [
    gmwm.WhiteNoise(1.0),
    gmwm.GaussMarkov(1.0, 30.0),
    gmwm.GaussMarkov(1.0, 1e5),
    gmwm.RandomWalk(1.0),
    gmwm.QuantizationNoise(1.0),
    gmwm.AR([-0.6], 1.0),
]


def series_covariance(process, n):
    """Covariance matrix of n samples, or of n samples of a walk from its start."""
    if isinstance(process, gmwm.Model):
        return sum(series_covariance(term, n) for term in process.terms)
    if isinstance(process, gmwm.RandomWalk):
        k = np.arange(n, dtype=float)
        return process.K**2 * np.minimum.outer(k, k)
    return toeplitz(process.autocovariance(np.arange(n), 1.0))


def distance(found, expected):
    """Largest difference, in units of the product of standard deviations."""
    scale = np.sqrt(np.diag(expected))
    return np.max(np.abs(found - expected) / np.outer(scale, scale))
