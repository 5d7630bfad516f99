"""What an estimation found: parameters, their uncertainty, agreement with the data."""

from gmwm.estimate.result.bound import upper_amplitude as upper_amplitude
from gmwm.estimate.result.conclusion import (
    Comparison as Comparison,
    Estimates as Estimates,
    conclude as conclude,
)
from gmwm.estimate.result.curves import dense_curves as dense_curves
from gmwm.estimate.result.estimate import Estimate as Estimate, InUnit as InUnit
from gmwm.estimate.result.fit import METHOD_NAMES as METHOD_NAMES, Fit as Fit
from gmwm.estimate.result.goodness import Goodness as Goodness
from gmwm.estimate.result.joint import (
    JointFit as JointFit,
    between as between,
    fit_joint as fit_joint,
)
from gmwm.estimate.result.region import Region as Region, slope_name as slope_name
from gmwm.estimate.result.remarks import no_test_notice as no_test_notice
from gmwm.estimate.result.serialization import plain as plain
