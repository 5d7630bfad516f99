"""What an estimation found: parameters, their uncertainty, agreement with the data."""

from gmwm.estimate.result.bound import upper_amplitude
from gmwm.estimate.result.conclusion import Comparison, Estimates, conclude
from gmwm.estimate.result.curves import dense_curves
from gmwm.estimate.result.estimate import Estimate, InUnit
from gmwm.estimate.result.fit import METHOD_NAMES, Fit
from gmwm.estimate.result.goodness import Goodness
from gmwm.estimate.result.joint import JointFit, fit_joint
from gmwm.estimate.result.region import Region, slope_name
from gmwm.estimate.result.remarks import no_test_notice
from gmwm.estimate.result.serialization import plain

__all__ = [
    "METHOD_NAMES",
    "Comparison",
    "Estimate",
    "Estimates",
    "Fit",
    "Goodness",
    "InUnit",
    "JointFit",
    "Region",
    "conclude",
    "dense_curves",
    "fit_joint",
    "no_test_notice",
    "plain",
    "slope_name",
    "upper_amplitude",
]
