"""Estimation: open parameters of a model from a series, by any method, and how good any can be."""

from gmwm.estimate.arma_form import (
    GaussMarkovForm as GaussMarkovForm,
    to_gauss_markov as to_gauss_markov,
)
from gmwm.estimate.bootstrap import (
    Bootstrap as Bootstrap,
    bootstrap as bootstrap,
    bootstrap_test as bootstrap_test,
)
from gmwm.estimate.cramer_rao import CramerRao as CramerRao, cramer_rao as cramer_rao
from gmwm.estimate.entrance import (
    METHODS as METHODS,
    Data as Data,
    Method as Method,
    are_several as are_several,
    estimate as estimate,
    fit as fit,
)
from gmwm.estimate.likelihood import EM as EM, MLE as MLE, Whittle as Whittle
from gmwm.estimate.lines import AllanLines as AllanLines
from gmwm.estimate.moments import (
    GMWM as GMWM,
    SimulatedMoments as SimulatedMoments,
)
from gmwm.estimate.result import (
    Estimate as Estimate,
    Fit as Fit,
    JointFit as JointFit,
    left_open as left_open,
)
from gmwm.estimate.shared import fit_shared as fit_shared
