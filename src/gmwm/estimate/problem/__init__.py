"""What is estimated from what: parameters as coordinates, moments, their covariance."""

from gmwm.estimate.problem.moments import (
    CurveCoefficients as CurveCoefficients,
    Moments as Moments,
    Scales as Scales,
    chi_square as chi_square,
    weight_root as weight_root,
)
from gmwm.estimate.problem.nonnegative import (
    objectives_with as objectives_with,
    solve_nonnegative as solve_nonnegative,
)
from gmwm.estimate.problem.ramp import (
    detrended_covariance as detrended_covariance,
    gls_slope as gls_slope,
    slope_p_value as slope_p_value,
)
from gmwm.estimate.problem.regressors import (
    Coefficients as Coefficients,
    difference_covariance as difference_covariance,
    pilot as pilot,
)
