"""What is estimated from what: parameters as coordinates, moments, their covariance."""

from gmwm.estimate.problem.information import (
    density,
    error_growth,
    frequency_nodes,
    information_with,
    slope_dof,
    spectral_information,
)
from gmwm.estimate.problem.nonnegative import (
    objectives_with,
    orthogonal_to,
    solve_columns,
    solve_nonnegative,
)
from gmwm.estimate.problem.parameters import (
    Coordinates,
    Term,
    drift_key,
    in_model_order,
    keys_by_term,
    shape_of,
)
from gmwm.estimate.problem.ramp import (
    Slope,
    bias_of_detrending,
    detrended_covariance,
    difference_covariance,
    gls_slope,
    ols_slope,
    slope_p_value,
)
from gmwm.estimate.problem.scales import Scales, is_plain
from gmwm.estimate.problem.simulation import Simulation
from gmwm.estimate.problem.targets import FittedMoments, Moments
from gmwm.estimate.problem.whitening import chi_square, weight_root

__all__ = [
    "Coordinates",
    "FittedMoments",
    "Moments",
    "Scales",
    "Simulation",
    "Slope",
    "Term",
    "bias_of_detrending",
    "chi_square",
    "density",
    "detrended_covariance",
    "difference_covariance",
    "drift_key",
    "error_growth",
    "frequency_nodes",
    "gls_slope",
    "in_model_order",
    "information_with",
    "is_plain",
    "keys_by_term",
    "objectives_with",
    "ols_slope",
    "orthogonal_to",
    "shape_of",
    "slope_dof",
    "slope_p_value",
    "solve_columns",
    "solve_nonnegative",
    "spectral_information",
    "weight_root",
]
