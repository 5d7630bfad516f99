"""The joint covariance of a true model and a filter's model: errors of filters without runs."""

from gmwm.ins.covariance.analysis import CovarianceErrors as CovarianceErrors
from gmwm.ins.covariance.joint_kernels import LinearStep as LinearStep, aid_jointly as aid_jointly
