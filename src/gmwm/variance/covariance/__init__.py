"""Covariance of wavelet variances, by theory and from the data."""

from gmwm.variance.covariance.haar import (
    dyadic_levels,
    haar_covariance,
    mean_covariance,
)
from gmwm.variance.covariance.lags import block_density

__all__ = [
    "block_density",
    "dyadic_levels",
    "haar_covariance",
    "mean_covariance",
]
