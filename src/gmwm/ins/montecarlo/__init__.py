"""Many runs of several filters on the same errors, and their statistics."""

from gmwm.ins.montecarlo.consistency import (
    Consistency,
    InnovationTest,
    Ratio,
    chi_square_ratio,
    mean_ratio,
)
from gmwm.ins.montecarlo.experiment import Experiment
from gmwm.ins.montecarlo.filter_errors import GROUPS, FilterErrors
from gmwm.ins.montecarlo.outage_errors import QUANTITIES
from gmwm.ins.montecarlo.scenario import ErrorSource, Scenario, Simulated
from gmwm.ins.montecarlo.validation import Validation

__all__ = [
    "GROUPS",
    "QUANTITIES",
    "Consistency",
    "ErrorSource",
    "Experiment",
    "FilterErrors",
    "InnovationTest",
    "Ratio",
    "Scenario",
    "Simulated",
    "Validation",
    "chi_square_ratio",
    "mean_ratio",
]
