"""What an estimation found: parameters, their uncertainty, agreement with the data."""

from gmwm.estimate.problem import (
    CurveCoefficients as CurveCoefficients,
)
from gmwm.estimate.result.estimate import (
    Estimate as Estimate,
    confidence_interval as confidence_interval,
)
from gmwm.estimate.result.fit import Fit as Fit, dense_curves as dense_curves
from gmwm.estimate.result.goodness import left_open as left_open
from gmwm.estimate.result.joint import JointFit as JointFit, fit_joint as fit_joint
