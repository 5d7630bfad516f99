"""What an estimation found: parameters, their uncertainty, agreement with the data."""

from gmwm.estimate.problem import (
    CurveCoefficients as CurveCoefficients,
)
from gmwm.estimate.result.conclusion import (
    estimate_notices as estimate_notices,
    misfit_notices as misfit_notices,
    missed_level_notices as missed_level_notices,
)
from gmwm.estimate.result.estimate import (
    Estimate as Estimate,
    confidence_interval as confidence_interval,
    estimates_of as estimates_of,
    quantile_above_zero as quantile_above_zero,
    upper_amplitude as upper_amplitude,
)
from gmwm.estimate.result.fit import Fit as Fit, dense_curves as dense_curves
from gmwm.estimate.result.goodness import Goodness as Goodness, left_open as left_open
from gmwm.estimate.result.joint import (
    JointFit as JointFit,
    between as between,
    fit_joint as fit_joint,
)
