"""Spectra that lie above others at every frequency."""

from gmwm.filter_numbers.spectra.dominance import (
    KINDS,
    TIGHTEST,
    Problem,
    correlation_time,
    dominating,
    with_correlation_times,
)
from gmwm.filter_numbers.spectra.propagation import Estimated, standard_errors
from gmwm.filter_numbers.spectra.region import ParameterRegion, region_targets
from gmwm.filter_numbers.spectra.target import Target

__all__ = [
    "KINDS",
    "TIGHTEST",
    "Estimated",
    "ParameterRegion",
    "Problem",
    "Target",
    "correlation_time",
    "dominating",
    "region_targets",
    "standard_errors",
    "with_correlation_times",
]
