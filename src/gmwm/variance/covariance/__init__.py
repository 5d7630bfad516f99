"""Covariance of wavelet variances, by theory and from the data."""

from gmwm.variance.covariance.haar import (
    dyadic_levels as dyadic_levels,
    haar_covariance as haar_covariance,
    mean_covariance as mean_covariance,
)
from gmwm.variance.covariance.lags import block_density as block_density
