"""What is estimated from what: parameters as coordinates, moments, their covariance."""

from gmwm.estimate.problem.information import (
    density as density,
    error_growth as error_growth,
    frequency_nodes as frequency_nodes,
    spectral_information as spectral_information,
)
from gmwm.estimate.problem.moments import (
    CurveCoefficients as CurveCoefficients,
    Moments as Moments,
    Scales as Scales,
    Simulation as Simulation,
    chi_square as chi_square,
    slope_dof as slope_dof,
    weight_root as weight_root,
)
from gmwm.estimate.problem.nonnegative import (
    objectives_with as objectives_with,
    solve_nonnegative as solve_nonnegative,
)
from gmwm.estimate.problem.parameters import (
    Coordinates as Coordinates,
    keys_by_term as keys_by_term,
    shape_of as shape_of,
)
from gmwm.estimate.problem.ramp import (
    Slope as Slope,
    Walks as Walks,
    detrended_covariance as detrended_covariance,
    gls_slope as gls_slope,
    ols_slope as ols_slope,
    slope_p_value as slope_p_value,
)
from gmwm.estimate.problem.regressors import (
    Coefficients as Coefficients,
    difference_covariance as difference_covariance,
    pilot as pilot,
)
