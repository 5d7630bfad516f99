"""Estimation: open parameters of a model from a series, by any method, and how good any can be."""

from gmwm.estimate.bootstrap import Bootstrap, bootstrap, bootstrap_test
from gmwm.estimate.cramer_rao import CramerRao, cramer_rao
from gmwm.estimate.entrance import METHODS, Data, Method, are_several, estimate, fit
from gmwm.estimate.likelihood import EM, MLE, Whittle
from gmwm.estimate.lines import AllanLines
from gmwm.estimate.moments import GMWM, SimulatedMoments
from gmwm.estimate.result import Estimate, Fit, JointFit

__all__ = [
    "EM",
    "GMWM",
    "METHODS",
    "MLE",
    "AllanLines",
    "Bootstrap",
    "CramerRao",
    "Data",
    "Estimate",
    "Fit",
    "JointFit",
    "Method",
    "SimulatedMoments",
    "Whittle",
    "are_several",
    "bootstrap",
    "bootstrap_test",
    "cramer_rao",
    "estimate",
    "fit",
]
