"""The joint covariance of a true model and a filter's model: errors of filters without runs."""

from gmwm.ins.covariance.analysis import (
    AIDINGS as AIDINGS,
    Analysis as Analysis,
    CovarianceErrors as CovarianceErrors,
    covariance_analysis as covariance_analysis,
    loiter_with_outages as loiter_with_outages,
)
from gmwm.ins.covariance.joint_kernels import LinearStep as LinearStep, aid_jointly as aid_jointly
