"""The joint covariance of a true model and a filter's model: errors of filters without runs."""

from gmwm.ins.covariance.analysis import (
    Analysis as Analysis,
    CovarianceErrors as CovarianceErrors,
    covariance_analysis as covariance_analysis,
)
from gmwm.ins.covariance.joint_kernels import LinearStep as LinearStep, aid_jointly as aid_jointly
from gmwm.ins.covariance.reduction import (
    AIDINGS as AIDINGS,
    loiter_with_outages as loiter_with_outages,
    reduce as reduce,
    smallest_score as smallest_score,
)
